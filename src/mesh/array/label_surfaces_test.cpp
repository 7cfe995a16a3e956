#include <quoin/mesh/label_surfaces.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "core/instruction_sets_for_tests.h"
#include "mesh/array/array_for_tests.h"
#include "mesh/smooth/surface_check_for_tests.h"

namespace quoin {
namespace {

using namespace array_tests;

LabelSurfaces surfaces_of(const ArrayView& view, const LabelSurfaceOptions& options = {}, unsigned threads = 1) {
  auto surfaces = surfaces_from_labels(view, options, {threads});
  EXPECT_TRUE(surfaces.has_value()) << to_string(surfaces.error());
  return surfaces ? std::move(*surfaces) : LabelSurfaces{};
}

void expect_same(const LabelSurfaces& a, const LabelSurfaces& b) {
  EXPECT_TRUE(same_bytes(a.positions, b.positions));
  EXPECT_TRUE(same_bytes(a.indices, b.indices));
  ASSERT_EQ(a.interfaces.size(), b.interfaces.size());
  for (std::size_t i = 0; i < a.interfaces.size(); ++i) {
    EXPECT_EQ(a.interfaces[i].back, b.interfaces[i].back);
    EXPECT_EQ(a.interfaces[i].front, b.interfaces[i].front);
    EXPECT_EQ(a.interfaces[i].first_index, b.interfaces[i].first_index);
    EXPECT_EQ(a.interfaces[i].index_count, b.interfaces[i].index_count);
  }
}

// Returns random samples.
template <class T>
TestArray<T> scattered(Size size, unsigned seed, unsigned kinds = 5) {
  std::mt19937 random(seed);
  return {size, [&](DVec3) { return static_cast<T>(random() % kinds); }};
}

// Labels each sample by the nearest of some seeds within a ball, otherwise 0.
TestArray<std::uint8_t> cells_in_a_ball(int n, unsigned seed, int kinds) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(0.0, n);
  std::vector<DVec3> seeds;
  for (int i = 0; i < kinds; ++i) seeds.emplace_back(place(random), place(random), place(random));
  return {{n, n, n}, [&](DVec3 p) {
            if (glm::length(p - 0.5 * (n - 1)) > 0.45 * n) return std::uint8_t{0};
            const auto nearest = std::min_element(
                seeds.begin(), seeds.end(), [&](DVec3 a, DVec3 b) { return glm::length(a - p) < glm::length(b - p); });
            return static_cast<std::uint8_t>(nearest - seeds.begin() + 1);
          }};
}

// A face, given by the samples behind and in front of it.
using Face = std::array<int, 6>;

// Returns all faces of an array, with both labels.
template <class T>
std::map<Face, std::pair<std::int64_t, std::int64_t>> naive_faces(const TestArray<T>& labels, std::int64_t background) {
  const auto label = [&](IVec3 p) { return labels.has(p) ? static_cast<std::int64_t>(labels.at(p)) : background; };
  std::map<Face, std::pair<std::int64_t, std::int64_t>> faces;
  const Size size = labels.size();
  for (int x = -1; x < size[0]; ++x) {
    for (int y = -1; y < size[1]; ++y) {
      for (int z = -1; z < size[2]; ++z) {
        for (int axis = 0; axis < 3; ++axis) {
          IVec3 back(x, y, z);
          IVec3 front = back;
          ++front[axis];
          if (label(back) == label(front)) continue;
          const bool is_swapped =
              label(back) == background || (label(front) != background && label(back) < label(front));
          if (is_swapped) std::swap(back, front);
          faces[{back.x, back.y, back.z, front.x, front.y, front.z}] = {label(back), label(front)};
        }
      }
    }
  }
  return faces;
}

// Returns the face inside a quad, from the cells of its four vertices, which lie strictly within their cells.
Face face_of(const LabelSurfaces& surfaces, std::size_t first_index) {
  IVec3 least(1 << 20);
  IVec3 most(-(1 << 20));
  for (std::size_t i = 0; i < 6; ++i) {
    const IVec3 cell(glm::floor(surfaces.positions[surfaces.indices[first_index + i]]));
    least = glm::min(least, cell);
    most = glm::max(most, cell);
  }
  const IVec3 extent = most - least;
  EXPECT_EQ(extent.x + extent.y + extent.z, 2);
  const int axis = extent.x == 0 ? 0 : extent.y == 0 ? 1 : 2;
  IVec3 start = most;
  IVec3 end = most;
  ++end[axis];
  // The orientation of the quad.
  const auto at = [&](std::size_t i) { return DVec3(surfaces.positions[surfaces.indices[first_index + i]]); };
  const DVec3 normal = glm::cross(at(1) - at(0), at(2) - at(0)) + glm::cross(at(4) - at(3), at(5) - at(3));
  if (normal[axis] < 0.0) std::swap(start, end);
  return {start.x, start.y, start.z, end.x, end.y, end.z};
}

class LabelNoise : public testing::TestWithParam<Size> {};

TEST_P(LabelNoise, HasOneFaceBetweenDifferingNeighbours) {
  for (const std::int64_t background : {std::int64_t{0}, std::int64_t{3}}) {
    const auto labels = scattered<std::uint8_t>(GetParam(), 21);
    const LabelSurfaces surfaces = surfaces_of(labels.view(), {background, 0});
    auto expected = naive_faces(labels, background);
    EXPECT_EQ(surfaces.indices.size(), 6 * expected.size());
    std::size_t next = 0;
    for (const LabelInterface& interface : surfaces.interfaces) {
      EXPECT_EQ(interface.first_index, next);
      next += interface.index_count;
      for (std::size_t i = 0; i < interface.index_count; i += 6) {
        const auto found = expected.find(face_of(surfaces, interface.first_index + i));
        ASSERT_NE(found, expected.end());
        EXPECT_EQ(found->second, std::pair(interface.back, interface.front));
        expected.erase(found);
      }
    }
    EXPECT_EQ(next, surfaces.indices.size());
    EXPECT_TRUE(expected.empty());
  }
}

TEST_P(LabelNoise, HasClosedSurfacePerLabel) {
  const auto labels = scattered<std::uint8_t>(GetParam(), 22);
  for (const int steps : {0, 3}) {
    const LabelSurfaces surfaces = surfaces_of(labels.view(), {0, steps});
    double volume = 0.0;
    for (const std::int64_t label : labels_of(surfaces)) {
      const ArraySurface surface = surface_of_label(surfaces, label);
      const auto count =
          oracle::count_surface({surface.indices.data(), surface.indices.size()}, surface.positions.size());
      oracle::expect_closed(count);
      volume += enclosed_volume(surface.positions, surface.indices);
      for (const Vec3& normal : surface.normals) ASSERT_NEAR(glm::length(normal), 1.0F, 1e-5F);
    }
    // All labels together fill all space outside the background.
    EXPECT_NEAR(volume, -enclosed_volume(surfaces.positions, indices_of_label(surfaces, 0)), 1e-3);
  }
}

TEST_P(LabelNoise, IsTheSameForEveryInstructionSetAndThreadCount) {
  const auto labels = scattered<std::int16_t>(GetParam(), 23, 1000);
  const LabelSurfaces expected = surfaces_of(labels.view());
  for (const InstructionSet set : sets_of_this_machine()) {
    const InstructionSetOverride over(set);
    for (const unsigned threads : {1U, 3U}) expect_same(surfaces_of(labels.view(), {}, threads), expected);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, LabelNoise,
                         testing::Values(Size{1, 1, 1}, Size{1, 1, 70}, Size{2, 1, 63}, Size{1, 40, 1}, Size{3, 3, 64},
                                         Size{40, 5, 65}, Size{18, 17, 127}, Size{5, 33, 128}, Size{4, 60, 3}),
                         [](const auto& param) {
                           return std::to_string(param.param[0]) + "x" + std::to_string(param.param[1]) + "x" +
                                  std::to_string(param.param[2]);
                         });

TEST(LabelSurfaces, ShareInterfaceBetweenNeighbours) {
  const auto labels = cells_in_a_ball(48, 31, 12);
  const LabelSurfaces surfaces = surfaces_of(labels.view());
  // Each triangle starts at its least vertex.
  const auto triangles = [&](std::int64_t label, bool is_turned) {
    std::set<std::array<std::uint32_t, 3>> all;
    const Buffer<std::uint32_t> indices = indices_of_label(surfaces, label);
    for (std::size_t i = 0; i < indices.size(); i += 3) {
      std::array<std::uint32_t, 3> t = {indices[i], indices[i + 1], indices[i + 2]};
      if (is_turned) std::swap(t[1], t[2]);
      std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
      all.insert(t);
    }
    return all;
  };
  int between_objects = 0;
  for (const LabelInterface& interface : surfaces.interfaces) {
    const auto behind = triangles(interface.back, false);
    const auto before = triangles(interface.front, true);
    std::vector<std::array<std::uint32_t, 3>> both;
    std::set_intersection(behind.begin(), behind.end(), before.begin(), before.end(), std::back_inserter(both));
    EXPECT_EQ(both.size(), interface.index_count / 3);
    between_objects += interface.front != 0;
  }
  EXPECT_GT(between_objects, 10);
}

TEST(LabelSurfaces, StayWithinCellsWhenRelaxed) {
  const auto labels = scattered<std::uint8_t>({19, 20, 70}, 24);
  const LabelSurfaces before = surfaces_of(labels.view(), {0, 0});
  const LabelSurfaces after = surfaces_of(labels.view(), {0, 25});

  ASSERT_EQ(before.positions.size(), after.positions.size());
  float moved = 0.0F;
  for (std::size_t i = 0; i < before.positions.size(); ++i) {
    ASSERT_EQ(glm::floor(before.positions[i]), glm::floor(after.positions[i]));
    moved = std::max(moved, glm::length(before.positions[i] - after.positions[i]));
  }
  EXPECT_GT(moved, 0.2F);
}

TEST(LabelSurfaces, AreSmootherWhenRelaxed) {
  constexpr double kRadius = 20.3;
  const DVec3 centre(29.7, 30.2, 30.6);
  const TestArray<std::uint8_t> labels(
      {60, 60, 60}, [&](DVec3 p) { return static_cast<std::uint8_t>(glm::length(p - centre) < kRadius); });
  // Returns the mean angle between the triangles' normals and the ball's normals.
  const auto roughness = [&](int steps) {
    const ArraySurface surface = surface_of_label(surfaces_of(labels.view(), {0, steps}), 1);
    double sum = 0.0;
    for (std::size_t i = 0; i < surface.indices.size(); i += 3) {
      const auto at = [&](std::size_t k) { return DVec3(surface.positions[surface.indices[i + k]]); };
      const DVec3 normal = glm::normalize(glm::cross(at(1) - at(0), at(2) - at(0)));
      sum += std::acos(std::clamp(glm::dot(normal, glm::normalize(at(0) - centre)), -1.0, 1.0));
    }
    return sum / static_cast<double>(surface.indices.size() / 3);
  };
  const double stairs = roughness(0);
  EXPECT_LT(roughness(4), 0.6 * stairs);
  EXPECT_LT(roughness(16), 0.5 * stairs);
  const ArraySurface surface = surface_of_label(surfaces_of(labels.view(), {0, 16}), 1);
  EXPECT_NEAR(enclosed_volume(surface.positions, surface.indices), 4.18879 * kRadius * kRadius * kRadius, 1'050.0);
}

TEST(LabelSurfaces, AreIndependentOfStrides) {
  const auto labels = cells_in_a_ball(44, 32, 9);
  const LabelSurfaces expected = surfaces_of(labels.view());
  const Relaid<std::uint8_t> sparse(labels, {2, 1, 0}, 0, 3, 1);
  expect_same(surfaces_of(sparse.view()), expected);
  for (const std::array<int, 3>& order : {std::array{0, 1, 2}, std::array{1, 0, 2}, std::array{2, 0, 1}}) {
    for (int reversed = 0; reversed < 8; ++reversed) {
      const Relaid<std::uint8_t> other(labels, order, reversed, 1 + reversed % 2);
      const LabelSurfaces surfaces = surfaces_of(other.view());
      ASSERT_EQ(surfaces.interfaces.size(), expected.interfaces.size());
      for (const std::int64_t label : labels_of(expected)) {
        const double volume = enclosed_volume(expected.positions, indices_of_label(expected, label));
        EXPECT_GT(volume, 0.0);
        EXPECT_NEAR(enclosed_volume(surfaces.positions, indices_of_label(surfaces, label)), volume,
                    0.02 * volume + 2.0);
      }
    }
  }
}

TEST(LabelSurfaces, FaceOutwardsInMirroredSpace) {
  const auto labels = cells_in_a_ball(40, 33, 5);
  ArrayView view = labels.view();
  const LabelSurfaces expected = surfaces_of(view);
  view.spacing = {-0.5, 2.0, 1.0};
  view.origin = {7.0, -3.0, 1.0};
  const LabelSurfaces surfaces = surfaces_of(view);
  for (const std::int64_t label : labels_of(expected)) {
    const double volume = enclosed_volume(expected.positions, indices_of_label(expected, label));
    EXPECT_NEAR(enclosed_volume(surfaces.positions, indices_of_label(surfaces, label)), volume, 0.02 * volume);
  }
}

template <class T>
class LabelTypes : public testing::Test {};
using LabelSampleTypes = testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::uint32_t,
                                        std::int32_t, std::uint64_t, std::int64_t>;
TYPED_TEST_SUITE(LabelTypes, LabelSampleTypes);

TYPED_TEST(LabelTypes, MakeSameSurfaces) {
  const auto bytes = scattered<std::uint8_t>({18, 9, 66}, 25);
  const TestArray<TypeParam> others(bytes.size(), [&](DVec3 p) { return static_cast<TypeParam>(bytes.at(IVec3(p))); });
  expect_same(surfaces_of(others.view()), surfaces_of(bytes.view()));
}

TYPED_TEST(LabelTypes, KeepExtremeLabels) {
  const std::array<TypeParam, 3> kinds = {std::numeric_limits<TypeParam>::lowest(),
                                          std::numeric_limits<TypeParam>::max(), 7};
  const TestArray<TypeParam> labels({4, 5, 60}, [&](DVec3 p) { return kinds[static_cast<std::size_t>(p.z) / 20]; });
  const LabelSurfaces surfaces = surfaces_of(labels.view(), {7, 0});
  std::vector<std::int64_t> expected = {static_cast<std::int64_t>(kinds[0]), static_cast<std::int64_t>(kinds[1])};
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(labels_of(surfaces), expected);
  ASSERT_EQ(surfaces.interfaces.size(), 3U);
  EXPECT_EQ(surfaces.interfaces[0].back, static_cast<std::int64_t>(kinds[0]));
  EXPECT_EQ(surfaces.interfaces[0].front, 7);
  EXPECT_EQ(surfaces.interfaces[2].back, static_cast<std::int64_t>(kinds[1]));
  EXPECT_EQ(surfaces.interfaces[2].front, static_cast<std::int64_t>(kinds[0]));
}

TEST(LabelSurfaces, SingleLabelIsBoxOrEmpty) {
  const TestArray<std::uint16_t> labels({6, 7, 64}, [](DVec3) { return std::uint16_t{9}; });
  const LabelSurfaces box = surfaces_of(labels.view(), {0, 0});
  EXPECT_EQ(labels_of(box), std::vector<std::int64_t>{9});
  EXPECT_NEAR(enclosed_volume(box.positions, box.indices), 6.0 * 7.0 * 64.0, 80.0);
  EXPECT_TRUE(indices_of_label(box, 4).empty());
  EXPECT_TRUE(surface_of_label(box, 4).positions.empty());
  const LabelSurfaces nothing = surfaces_of(labels.view(), {9, 4});
  EXPECT_TRUE(nothing.indices.empty());
  EXPECT_TRUE(nothing.positions.empty());
  EXPECT_TRUE(nothing.interfaces.empty());
}

TEST(LabelSurfaces, RejectInvalidInput) {
  const TestArray<std::uint8_t> labels({4, 5, 6}, [](DVec3) { return std::uint8_t{1}; });
  const TestArray<float> floats({4, 5, 6}, [](DVec3) { return 1.0F; });
  const auto error = [](const ArrayView& view, LabelSurfaceOptions options) {
    const auto surfaces = surfaces_from_labels(view, options, {1});
    EXPECT_FALSE(surfaces.has_value());
    return surfaces ? ErrorCode::BadFormat : surfaces.error().code;
  };
  EXPECT_EQ(error(floats.view(), {}), ErrorCode::InvalidArgument);
  EXPECT_EQ(error(labels.view(), {-1, 0}), ErrorCode::InvalidArgument);
  EXPECT_EQ(error(labels.view(), {256, 0}), ErrorCode::InvalidArgument);
  EXPECT_EQ(error(labels.view(), {0, -1}), ErrorCode::InvalidArgument);
  EXPECT_EQ(error(labels.view(), {0, 1'001}), ErrorCode::InvalidArgument);
  ArrayView empty = labels.view();
  empty.size[1] = 0;
  EXPECT_EQ(error(empty, {}), ErrorCode::InvalidArgument);
  const auto stopped = surfaces_from_labels(labels.view(), {}, {1}, [](double) { return false; });
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
}

}  // namespace
}  // namespace quoin
