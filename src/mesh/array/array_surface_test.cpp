#include <quoin/mesh/array_surface.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/mesh/mesh_view.h>
#include <quoin/mesh/smooth_mesh.h>

#include "core/death_for_tests.h"
#include "core/instruction_sets_for_tests.h"
#include "mesh/array/array_for_tests.h"
#include "mesh/smooth/surface_check_for_tests.h"

namespace quoin {
namespace {

using namespace array_tests;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// One vertex per cell: most of these tests count vertices.
constexpr ArraySurfaceOptions kPlain = {.split_sheets = false};

ArraySurface surface_of(const ArrayView& view, const ArraySurfaceOptions& options = kPlain, unsigned threads = 1) {
  auto surface = surface_from_array(view, options, {threads});
  EXPECT_TRUE(surface.has_value()) << to_string(surface.error());
  return surface ? std::move(*surface) : ArraySurface{};
}

oracle::SurfaceCount count_of(const ArraySurface& surface) {
  return oracle::count_surface({surface.indices.data(), surface.indices.size()}, surface.positions.size(), true);
}

void expect_same(const ArraySurface& a, const ArraySurface& b) {
  EXPECT_TRUE(same_bytes(a.positions, b.positions));
  EXPECT_TRUE(same_bytes(a.normals, b.normals));
  EXPECT_TRUE(same_bytes(a.indices, b.indices));
}

// Compares surfaces up to rounding: vertices at the same positions, in any order.
void expect_alike(const ArraySurface& a, const ArraySurface& b) {
  ASSERT_EQ(a.positions.size(), b.positions.size());
  ASSERT_EQ(a.indices.size(), b.indices.size());
  const auto sum = [](const Buffer<Vec3>& all) {
    DVec3 s(0.0);
    for (const Vec3& v : all) s += DVec3(v) * (1.0 + DVec3(v.y, v.z, v.x));
    return s / static_cast<double>(all.size());
  };
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(sum(a.positions)[axis], sum(b.positions)[axis], 1e-4);
    EXPECT_NEAR(sum(a.normals)[axis], sum(b.normals)[axis], 1e-4);
  }
  const double volume = enclosed_volume(a.positions, a.indices);
  EXPECT_NEAR(volume, enclosed_volume(b.positions, b.indices), 1e-3 * std::abs(volume));
  EXPECT_GT(volume, 0.0);
}

// A ball, sampled as signed distances.
struct Ball {
  Size size{};
  DVec3 centre{0.0};
  double radius = 1.0;
  DVec3 spacing{1.0};
  DVec3 origin{0.0};

  [[nodiscard]] double distance(DVec3 at) const { return glm::length(at - centre) - radius; }
  [[nodiscard]] TestArray<float> samples() const {
    return TestArray<float>(size, [&](DVec3 p) { return static_cast<float>(distance(origin + spacing * p)); });
  }
  [[nodiscard]] ArrayView view(const TestArray<float>& array) const {
    ArrayView view = array.view();
    view.spacing = spacing;
    view.origin = origin;
    return view;
  }
};

constexpr ArraySurfaceOptions kBelow = {0.0, SolidSide::Below, ArrayBorder::Closed, false};

void expect_ball(const ArraySurface& surface, const Ball& ball, double tolerance, double least_cosine) {
  const oracle::SurfaceCount count = count_of(surface);
  oracle::expect_manifold(count);
  EXPECT_EQ(count.vertices - count.edges + count.triangles, 2);
  for (std::size_t i = 0; i < surface.positions.size(); ++i) {
    const DVec3 at(surface.positions[i]);
    ASSERT_NEAR(ball.distance(at), 0.0, tolerance);
    ASSERT_NEAR(glm::length(surface.normals[i]), 1.0F, 1e-5F);
    ASSERT_GT(glm::dot(glm::normalize(at - ball.centre), DVec3(surface.normals[i])), least_cosine);
  }
  const double volume = 4.18879020479 * ball.radius * ball.radius * ball.radius;
  EXPECT_NEAR(enclosed_volume(surface.positions, surface.indices), volume, 0.01 * volume);
}

TEST(ArraySurface, MatchesSampledBall) {
  const Ball ball{{64, 70, 81}, {31.3, 34.1, 40.7}, 27.4};
  const TestArray<float> samples = ball.samples();
  expect_ball(surface_of(ball.view(samples), kBelow), ball, 0.02, 0.9995);
}

TEST(ArraySurface, AppliesSpacingPerAxis) {
  for (const DVec3 sign : {DVec3(1, 1, 1), DVec3(-1, 1, 1), DVec3(1, -1, -1), DVec3(-1, -1, -1), DVec3(1, 1, -1)}) {
    Ball ball{{90, 50, 40}, DVec3(0.0), 15.0, sign * DVec3(0.4, 0.75, 1.0)};
    ball.origin = -0.5 * ball.spacing * DVec3(ball.size[0], ball.size[1], ball.size[2]) + DVec3(0.1, 0.2, 0.0);
    ball.centre = DVec3(0.3, -0.2, 0.1);
    const TestArray<float> samples = ball.samples();
    expect_ball(surface_of(ball.view(samples), kBelow), ball, 0.05, 0.999);
  }
}

TEST(ArraySurface, SolidSideMatchesNegatedValues) {
  const Ball ball{{40, 40, 40}, {19.3, 20.1, 19.7}, 14.0};
  const TestArray<float> samples = ball.samples();
  const TestArray<float> negated(ball.size, [&](DVec3 p) { return static_cast<float>(-ball.distance(p)); });
  expect_same(surface_of(samples.view(), kBelow), surface_of(negated.view()));
}

// Noise has every configuration, including cells with several sheets.
class ArrayNoise : public testing::TestWithParam<Size> {};

TEST_P(ArrayNoise, IsClosedAtAnySize) {
  const TestArray<float> samples = noise(GetParam(), 11);
  const ArraySurface surface = surface_of(samples.view());
  if (!surface.indices.empty()) {
    oracle::expect_closed(count_of(surface));
    EXPECT_GT(enclosed_volume(surface.positions, surface.indices), 0.0);
  }
  EXPECT_EQ(surface.positions.size(), naive_vertices(samples, 0.0).size());
  EXPECT_EQ(surface.indices.size(), 6 * naive_edges(samples, 0.0));
}

TEST_P(ArrayNoise, HasVerticesAtMeanOfCrossings) {
  const TestArray<float> samples = noise(GetParam(), 12);
  const ArraySurface surface = surface_of(samples.view());
  const std::vector<DVec3> expected = naive_vertices(samples, 0.0);
  ASSERT_EQ(surface.positions.size(), expected.size());
  // Both are in memory order, unless rows are short or axes have one sample.
  if (GetParam()[2] < 40 || GetParam()[1] == 1) return;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_NEAR(glm::length(DVec3(surface.positions[i]) - expected[i]), 0.0, 3e-5) << i;
  }
}

TEST_P(ArrayNoise, IsTheSameForEveryInstructionSetAndThreadCount) {
  const TestArray<float> samples = noise(GetParam(), 13);
  const ArraySurface expected = surface_of(samples.view());
  for (const InstructionSet set : sets_of_this_machine()) {
    const InstructionSetOverride over(set);
    for (const unsigned threads : {1U, 3U}) expect_same(surface_of(samples.view(), kPlain, threads), expected);
  }
}

TEST_P(ArrayNoise, EndsAtOpenBorder) {
  const TestArray<float> samples = noise(GetParam(), 14);
  ArraySurfaceOptions options = kPlain;
  options.border = ArrayBorder::Open;
  const ArraySurface surface = surface_of(samples.view(), options);
  const oracle::SurfaceCount count = count_of(surface);
  EXPECT_EQ(count.unused_vertices, 0);
  EXPECT_EQ(count.degenerate_triangles, 0);
  const Size size = GetParam();
  for (const Vec3& p : surface.positions) {
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_GE(p[axis], 0.0F);
      ASSERT_LE(p[axis], static_cast<float>(size[static_cast<std::size_t>(axis)] - 1));
    }
  }
  EXPECT_EQ(surface.indices.size(), 6 * naive_edges(samples, 0.0, true));
}

TEST_P(ArrayNoise, IsManifoldWithSplitSheets) {
  for (const unsigned seed : {15U, 16U, 17U}) {
    const TestArray<float> samples = noise(GetParam(), seed);
    ArraySurfaceOptions options = kPlain;
    const ArraySurface joined = surface_of(samples.view(), options);
    if (joined.indices.empty()) continue;
    options.split_sheets = true;
    const ArraySurface split = surface_of(samples.view(), options);
    oracle::expect_manifold(count_of(split));
    EXPECT_EQ(split.indices.size(), joined.indices.size());
    EXPECT_GE(split.positions.size(), joined.positions.size());
    for (const InstructionSet set : sets_of_this_machine()) {
      const InstructionSetOverride over(set);
      expect_same(surface_of(samples.view(), options, 3), split);
    }
    options.border = ArrayBorder::Open;
    EXPECT_EQ(count_of(surface_of(samples.view(), options)).unused_vertices, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, ArrayNoise,
                         testing::Values(Size{1, 1, 1}, Size{1, 1, 70}, Size{2, 1, 63}, Size{1, 40, 1}, Size{3, 3, 64},
                                         Size{40, 5, 65}, Size{18, 17, 127}, Size{5, 33, 128}, Size{4, 60, 3}),
                         [](const auto& param) {
                           return std::to_string(param.param[0]) + "x" + std::to_string(param.param[1]) + "x" +
                                  std::to_string(param.param[2]);
                         });

TEST(ArraySurface, IsIndependentOfStrides) {
  const Ball ball{{45, 52, 70}, {20.2, 30.1, 33.3}, 18.0};
  const TestArray<float> samples = ball.samples();
  const ArraySurface expected = surface_of(samples.view(), kBelow);
  for (const std::array<int, 3>& order :
       {std::array{0, 1, 2}, std::array{1, 0, 2}, std::array{2, 0, 1}, std::array{0, 2, 1}}) {
    for (int reversed = 0; reversed < 8; ++reversed) {
      const Relaid<float> other(samples, order, reversed, 1);
      expect_alike(surface_of(other.view(), kBelow), expected);
    }
  }
}

TEST(ArraySurface, ReadsUnalignedAndSparseSamples) {
  const TestArray<float> samples = noise({9, 10, 70}, 3);
  const ArraySurface expected = surface_of(samples.view());
  const Relaid<float> unaligned(samples, {2, 1, 0}, 0, 1, 1);
  expect_same(surface_of(unaligned.view()), expected);
  const Relaid<float> sparse(samples, {2, 1, 0}, 0, 3, 2);
  expect_same(surface_of(sparse.view()), expected);
}

TEST(ArraySurface, RepeatsSamplesAlongAStrideOfZero) {
  const TestArray<float> row({1, 50, 60},
                             [](DVec3 p) { return static_cast<float>(9.0 - std::hypot(p.y - 24.5, p.z - 31.2)); });
  const TestArray<float> full({7, 50, 60},
                              [](DVec3 p) { return static_cast<float>(9.0 - std::hypot(p.y - 24.5, p.z - 31.2)); });
  ArrayView repeated = row.view();
  repeated.size[0] = 7;
  repeated.strides[0] = 0;
  expect_same(surface_of(repeated), surface_of(full.view()));
  for (std::size_t axis = 0; axis < 3; ++axis) repeated.strides[axis] = 0;
  EXPECT_EQ(surface_of(repeated).indices.size(), 0U) << "one value";
}

template <class T>
class ArrayTypes : public testing::Test {};
using SampleTypes = testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::uint32_t, std::int32_t,
                                   std::uint64_t, std::int64_t, float, double>;
TYPED_TEST_SUITE(ArrayTypes, SampleTypes);

// Integers from 0 to 100 are exact in all types.
TYPED_TEST(ArrayTypes, MakeSameSurface) {
  const TestArray<float> samples = noise({20, 21, 66}, 5);
  const auto whole = [&](DVec3 p) { return std::floor(50.0F + 50.0F * samples.at(IVec3(p))); };
  const TestArray<double> doubles(samples.size(), [&](DVec3 p) { return static_cast<double>(whole(p)); });
  const TestArray<TypeParam> others(samples.size(), [&](DVec3 p) { return static_cast<TypeParam>(whole(p)); });
  for (const double iso : {30.0, 44.25, 61.1}) {
    for (const SolidSide side : {SolidSide::Above, SolidSide::Below}) {
      const ArraySurfaceOptions options{iso, side, ArrayBorder::Closed, false};
      expect_same(surface_of(others.view(), options), surface_of(doubles.view(), options));
    }
  }
}

std::size_t triangles_without_area(const ArraySurface& surface) {
  std::size_t flat = 0;
  for (std::size_t i = 0; i < surface.indices.size(); i += 3) {
    const Vec3 a = surface.positions[surface.indices[i]];
    const Vec3 b = surface.positions[surface.indices[i + 1]];
    const Vec3 c = surface.positions[surface.indices[i + 2]];
    flat += a == b || b == c || c == a ? 1 : 0;
  }
  return flat;
}

// Waves and noise with few distinct values, so that many values equal iso.
TYPED_TEST(ArrayTypes, MakeNoDegenerateTrianglesAtIso) {
  const TestArray<float> random = noise({20, 21, 66}, 9);
  for (const double levels : {2.0, 6.0}) {
    const TestArray<TypeParam> samples(random.size(), [&](DVec3 p) {
      const double wave = std::sin(0.4 * p.x) + std::sin(0.3 * p.y) + std::sin(0.5 * p.z);
      return static_cast<TypeParam>(std::floor(20.0 + levels * (wave + 0.3 * double{random.at(IVec3(p))})));
    });
    for (const SolidSide side : {SolidSide::Above, SolidSide::Below}) {
      for (const bool splits : {false, true}) {
        const ArraySurfaceOptions options{20.0, side, ArrayBorder::Closed, splits};
        const ArraySurface surface = surface_of(samples.view(), options);
        ASSERT_GT(surface.indices.size(), 1'000U);
        EXPECT_EQ(triangles_without_area(surface), 0U);
        for (const InstructionSet set : sets_of_this_machine()) {
          const InstructionSetOverride over(set);
          expect_same(surface_of(samples.view(), options), surface);
        }
      }
    }
  }
}

TYPED_TEST(ArrayTypes, HandleIsoOutsideTheirRange) {
  const TestArray<TypeParam> samples({3, 4, 50}, [](DVec3 p) {
    return p.z == 7 ? std::numeric_limits<TypeParam>::max() : std::numeric_limits<TypeParam>::lowest();
  });
  const auto triangles = [&](double iso, SolidSide side) {
    return surface_of(samples.view(), {iso, side, ArrayBorder::Closed, false}).indices.size();
  };
  const std::size_t full = 12 * (12 + 150 + 200);
  for (const double iso : {-kInfinity * 1.0, -1e39, -1e20}) {
    if (iso >= static_cast<double>(std::numeric_limits<TypeParam>::lowest())) continue;
    EXPECT_EQ(triangles(iso, SolidSide::Above), full);
    EXPECT_EQ(triangles(iso, SolidSide::Below), 0U);
    EXPECT_EQ(triangles(-iso, SolidSide::Above), 0U);
    EXPECT_EQ(triangles(-iso, SolidSide::Below), full);
  }
  const auto most = static_cast<double>(std::numeric_limits<TypeParam>::max());
  EXPECT_EQ(triangles(most, SolidSide::Above), 0U) << "the value of the surface is air";
}

TEST(ArraySurface, DistinguishesLargeIntegers) {
  const TestArray<float> samples = noise({12, 13, 64}, 6);
  const auto whole = [&](DVec3 p) { return static_cast<std::int64_t>(std::floor(50.0F * samples.at(IVec3(p)))); };
  const TestArray<std::int64_t> small(samples.size(), whole);
  constexpr std::int64_t kLarge = std::int64_t{1} << 62;
  const TestArray<std::int64_t> large(samples.size(), [&](DVec3 p) { return whole(p) - kLarge; });
  constexpr std::uint64_t kLarger = std::uint64_t{1} << 63;
  const TestArray<std::uint64_t> larger(samples.size(),
                                        [&](DVec3 p) { return kLarger + static_cast<std::uint64_t>(whole(p)); });
  const ArraySurface expected = surface_of(small.view());
  expect_same(surface_of(large.view(), {-static_cast<double>(kLarge), SolidSide::Above, ArrayBorder::Closed, false}),
              expected);
  expect_same(surface_of(larger.view(), {static_cast<double>(kLarger), SolidSide::Above, ArrayBorder::Closed, false}),
              expected);
}

TEST(ArraySurface, IsIndependentOfValueScale) {
  const TestArray<float> samples = noise({12, 13, 64}, 7);
  const ArraySurface expected = surface_of(samples.view());
  for (const double scale : {1e-310, 1e-200, 1e-36, 1e30, 1e200}) {
    const TestArray<double> scaled(samples.size(), [&](DVec3 p) { return samples.at(IVec3(p)) * scale; });
    const ArraySurface surface = surface_of(scaled.view());
    ASSERT_EQ(surface.positions.size(), expected.positions.size());
    for (std::size_t i = 0; i < expected.positions.size(); ++i) {
      ASSERT_NEAR(glm::length(surface.positions[i] - expected.positions[i]), 0.0F, 4e-5F) << scale;
      ASSERT_NEAR(glm::length(surface.normals[i] - expected.normals[i]), 0.0F, 2e-4F) << scale;
    }
  }
}

TEST(ArraySurface, DistinguishesDoublesThatRoundToOneFloat) {
  const TestArray<double> samples({3, 3, 50}, [](DVec3 p) { return 1.0 + (p.z < 20.0 ? 1e-12 : -1e-12); });
  const ArraySurface surface = surface_of(samples.view(), {1.0, SolidSide::Above, ArrayBorder::Closed, false});
  float most = 0.0F;
  for (const Vec3& p : surface.positions) most = std::max(most, p.z);
  EXPECT_NEAR(most, 19.5F, 1e-3F);
}

TEST(ArraySurface, StaysFiniteForNonFiniteValues) {
  TestArray<float> samples = noise({20, 21, 66}, 8);
  std::mt19937 random(8);
  for (float& value : samples.values()) {
    const unsigned what = random() % 16;
    value = what == 0   ? kNan
            : what == 1 ? kInfinity
            : what == 2 ? -kInfinity
            : what == 3 ? 3e38F
            : what == 4 ? -1e-42F
                        : value;
  }
  for (const SolidSide side : {SolidSide::Above, SolidSide::Below}) {
    const ArraySurface surface = surface_of(samples.view(), {0.0, side, ArrayBorder::Closed, false});
    oracle::expect_closed(count_of(surface));
    for (std::size_t i = 0; i < surface.positions.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_GE(surface.positions[i][axis], -1.0F);
        ASSERT_LE(surface.positions[i][axis], 66.0F);
      }
      ASSERT_NEAR(glm::length(surface.normals[i]), 1.0F, 1e-5F);
    }
    for (const InstructionSet set : sets_of_this_machine()) {
      const InstructionSetOverride over(set);
      expect_same(surface_of(samples.view(), {0.0, side, ArrayBorder::Closed, false}), surface);
    }
  }
}

TEST(ArraySurface, TreatsNanAsAir) {
  const TestArray<float> samples({5, 5, 50}, [](DVec3 p) { return p.z < 20 ? 4.0F : kNan; });
  const ArraySurface above = surface_of(samples.view());
  float most = 0.0F;
  for (const Vec3& p : above.positions) most = std::max(most, p.z);
  EXPECT_EQ(most, 19.5F);
  const TestArray<float> negative({5, 5, 50}, [](DVec3 p) { return p.z < 20 ? -4.0F : kNan; });
  expect_same(surface_of(negative.view(), kBelow), above);
}

TEST(ArraySurface, FullArrayBecomesBox) {
  const TestArray<std::uint8_t> samples({30, 20, 50}, [](DVec3) { return std::uint8_t{1}; });
  const ArraySurface surface = surface_of(samples.view(), {0.5, SolidSide::Above, ArrayBorder::Closed, false});
  oracle::expect_manifold(count_of(surface));
  EXPECT_NEAR(enclosed_volume(surface.positions, surface.indices), 30.0 * 20.0 * 50.0, 300.0);
  EXPECT_EQ(surface_of(samples.view(), {1.5, SolidSide::Above, ArrayBorder::Closed, false}).positions.size(), 0U);
  const ArraySurface open = surface_of(samples.view(), {0.5, SolidSide::Above, ArrayBorder::Open, false});
  EXPECT_EQ(open.positions.size(), 0U);
}

TEST(ArraySurface, SingleSampleIsClosed) {
  const float one = 1.0F;
  ArrayView view{&one, ScalarType::Float32, {1, 1, 1}, {4, 4, 4}};
  const ArraySurface surface = surface_of(view);
  oracle::expect_manifold(count_of(surface));
  EXPECT_EQ(surface.positions.size(), 8U);
  EXPECT_EQ(surface.indices.size(), 36U);
  EXPECT_GT(enclosed_volume(surface.positions, surface.indices), 0.0);
}

// Halves and a band of 8: positions agree within the precision of both.
TEST(ArraySurface, MatchesSurfaceOfVolumeField) {
  Volume volume;
  volume.size = {70, 60, 50};
  const oracle::Field field = oracle::waves(4, 12.0, 0.4);
  for (int z = 0; z < 50; ++z) {
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 70; ++x) {
        const bool is_outer = x == 0 || y == 0 || z == 0 || x == 69 || y == 59 || z == 49;
        volume.values.push_back(is_outer ? -8.0F : static_cast<float>(-field({x, y, z})));
      }
    }
  }
  const auto grid = field_from_volume(volume, {});
  ASSERT_TRUE(grid.has_value());
  for (const bool splits : {false, true}) {
    SmoothMeshOptions options;
    options.occlusion.method = SmoothOcclusion::None;
    options.split_sheets = splits;
    const SmoothMesh mesh = oracle::mesh_of(*grid, options);
    const ArraySurface surface = surface_of(view_of(volume), {0.0, SolidSide::Above, ArrayBorder::Closed, splits});
    ASSERT_GT(mesh.positions.size(), 1'000U);
    ASSERT_EQ(surface.positions.size(), mesh.positions.size());
    ASSERT_EQ(surface.indices.size(), mesh.indices.size());
    // Compares by cell; a vertex on a cell's face may belong to either cell.
    std::map<std::array<int, 3>, std::vector<Vec3>> theirs;
    const auto cell_of = [](Vec3 p, IVec3 step) {
      const IVec3 cell = IVec3(glm::floor(p)) + step;
      return std::array{cell.x, cell.y, cell.z};
    };
    for (const Vec3& p : mesh.positions) theirs[cell_of(p, IVec3(0))].push_back(p);
    double worst = 0.0;
    for (const Vec3& p : surface.positions) {
      double nearest = 9.0;
      for (int i = 0; i < 27; ++i) {
        const auto found = theirs.find(cell_of(p, IVec3(i % 3, i / 3 % 3, i / 9) - 1));
        if (found == theirs.end()) continue;
        for (const Vec3& q : found->second) nearest = std::min(nearest, double{glm::length(p - q)});
      }
      worst = std::max(worst, nearest);
    }
    EXPECT_LT(worst, 2e-3);
  }
}

TEST(ArraySurface, RejectsInvalidInput) {
  const TestArray<float> samples({4, 5, 6}, [](DVec3) { return 1.0F; });
  const auto error = [&](auto change, double iso = 0.0) {
    ArrayView view = samples.view();
    change(view);
    const auto surface = surface_from_array(view, {iso, SolidSide::Above, ArrayBorder::Closed, false}, {1});
    EXPECT_FALSE(surface.has_value());
    return surface ? ErrorCode::BadFormat : surface.error().code;
  };
  constexpr std::int64_t kHuge = std::numeric_limits<std::int64_t>::max() / 2;
  EXPECT_EQ(error([](ArrayView&) {}, std::nan("")), ErrorCode::InvalidArgument);
  EXPECT_EQ(error([](ArrayView& v) { v.data = nullptr; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(error([](ArrayView& v) { v.size[1] = 0; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(error([](ArrayView& v) { v.size[2] = -3; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(error([](ArrayView& v) { v.strides[0] = kHuge; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(error([](ArrayView& v) { v.strides[0] = -kHuge; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(error([](ArrayView& v) { v.strides[0] = std::numeric_limits<std::int64_t>::min(); }),
            ErrorCode::InvalidArgument);
  EXPECT_EQ(error([](ArrayView& v) { v.spacing.y = 0.0; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(error([](ArrayView& v) { v.spacing.x = std::nan(""); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(error([](ArrayView& v) { v.origin.z = std::numeric_limits<double>::infinity(); }),
            ErrorCode::InvalidArgument);
  EXPECT_EQ(error([](ArrayView& v) { v.type = static_cast<ScalarType>(17); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(error([](ArrayView& v) {
              v.size[0] = std::int64_t{1} << 31;
              v.strides[0] = 0;
            }),
            ErrorCode::LimitExceeded);
}

TEST(ArraySurface, ReportsProgressAndCanBeCancelled) {
  const TestArray<float> samples = noise({40, 10, 50}, 9);
  double last = 0.0;
  const auto reported = surface_from_array(samples.view(), {}, {1}, [&](double fraction) {
    EXPECT_GE(fraction, last);
    last = fraction;
    return true;
  });
  EXPECT_TRUE(reported.has_value());
  EXPECT_EQ(last, 1.0);
  for (const double end : {0.0, 0.3, 0.6, 0.9}) {
    const auto stopped = surface_from_array(samples.view(), {}, {2}, [&](double fraction) { return fraction < end; });
    ASSERT_FALSE(stopped.has_value());
    EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
  }
}

TEST(ArraySurfaceDeathTest, AssertsOnMissingAlbedo) {
  ArraySurface surface;
  surface.positions.resize(3);
  surface.normals.resize(3);
  const std::vector<LinearRgba16> albedo(2);
  QUOIN_EXPECT_MISTAKE((void)view_of(surface, albedo), "one albedo per vertex");
}

}  // namespace
}  // namespace quoin
