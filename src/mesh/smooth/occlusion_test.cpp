#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>
#include <random>

#include <gtest/gtest.h>
#include <quoin/grid/density_grid.h>
#include <quoin/mesh/smooth.h>

#include "core/work/nightly_for_tests.h"
#include "mesh/smooth/smooth_cell.h"
#include "mesh/smooth/smooth_test_support.h"

namespace quoin {
namespace {

/// Returns the occlusion of an open surface: 0, except for the published curve.
float when_open(SmoothOcclusion form) {
  return form == SmoothOcclusion::WeightedPublished ? 0.4F * 0.4F : 0.0F;
}

/// Returns a field within reach of the middle chunk's vertices; the rest is not computed.
World world_of(const std::function<double(IVec3)>& field) {
  const int reach = reach_of(SmoothOcclusionOptions{});
  return World(field, IBox{IVec3(-reach), IVec3(kChunkEdge + reach)});
}

SmoothChunkMesh mesh_of(const World& world, SmoothOcclusion form, float spread = 2.0F) {
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  mesher.mesh(world.around(), with(form, 0, spread), mesh);
  return mesh;
}

SmoothChunkMesh mesh_of(const std::function<double(IVec3)>& field, SmoothOcclusion form) {
  return mesh_of(world_of(field), form);
}

DVec3 random_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return glm::normalize(DVec3(normal(random), normal(random), normal(random)));
}

TEST(SmoothOcclusion, PlaneOfAnyOrientationIsFullyOpen) {
  std::mt19937 random(11);
  for (int i = 0; i < 12; ++i) {
    const DVec3 n =
        i < 6 ? DVec3(IVec3(i % 3 == 0, i % 3 == 1, i % 3 == 2)) * (i < 3 ? 1.0 : -1.0) : random_direction(random);
    const double at = glm::dot(n, DVec3(31.3, 30.8, 33.1));
    const World world = world_of([=](IVec3 p) { return glm::dot(n, DVec3(p)) - at; });
    for (const SmoothOcclusion form : kForms) {
      for (const float spread : {0.4F, 2.0F}) {
        const SmoothChunkMesh mesh = mesh_of(world, form, spread);
        ASSERT_GT(mesh.occlusion.size(), 1'000U);
        for (const float occlusion : mesh.occlusion) {
          ASSERT_EQ(occlusion, when_open(form)) << n.x << " " << n.y << " " << n.z << " spread " << spread;
        }
      }
    }
  }
}

TEST(SmoothOcclusion, ConvexSurfaceIsFullyOpen) {
  for (const SmoothOcclusion form : kForms) {
    const SmoothChunkMesh mesh = mesh_of(sphere({31.2, 32.4, 30.9}, 20.0), form);
    for (const float occlusion : mesh.occlusion) ASSERT_EQ(occlusion, when_open(form));
  }
}

constexpr DVec3 kValleyBottom{31.37, 20.41, 0.0};

/// Returns a valley along z whose two slopes rise at `degrees` from the horizontal.
World valley(double degrees) {
  const double angle = glm::radians(degrees);
  const DVec3 left(std::sin(angle), std::cos(angle), 0);
  const DVec3 right(-std::sin(angle), std::cos(angle), 0);
  return world_of([=](IVec3 p) {
    const DVec3 d = DVec3(p.x, p.y, 0) - kValleyBottom;
    return std::min(glm::dot(left, d), glm::dot(right, d));
  });
}

/// Returns the mean occlusion along the bottom of a valley.
double occlusion_in_valley(const World& valley, SmoothOcclusion form) {
  const SmoothChunkMesh mesh = mesh_of(valley, form);
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    if (std::abs(mesh.positions[i].x - kValleyBottom.x) > 1.0) continue;
    sum += mesh.occlusion[i];
    ++count;
  }
  return sum / count;
}

TEST(SmoothOcclusion, SharperValleysAreDarker) {
  const World flat = valley(0.0);
  const std::array sharper = {valley(15.0), valley(30.0), valley(45.0), valley(60.0)};
  for (const SmoothOcclusion form : kForms) {
    double last = when_open(form);
    EXPECT_NEAR(occlusion_in_valley(flat, form), last, 1e-6);
    for (const World& next : sharper) {
      const double occlusion = occlusion_in_valley(next, form);
      EXPECT_GT(occlusion, last);
      last = occlusion;
    }
    EXPECT_GT(last, 0.2);
  }
}

// s = sum of min(density, 0), m the least of them, ratio = s / (27 m); openness = clamp(1 - (ratio + offset)^power).
TEST(SmoothOcclusion, MatchesPublishedCurve) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> any(-4.0F, 4.0F);
  for (int round = 0; round < 200; ++round) {
    SmoothOcclusionOptions options;
    options.method = SmoothOcclusion::WeightedPublished;
    options.offset = round % 2 == 0 ? 0.4F : 0.1F;
    options.power = round % 3 == 0 ? 2.0F : 1.5F;
    std::array<float, 27> samples{};
    for (float& sample : samples) sample = any(random) + static_cast<float>(round % 9) - 4.0F;
    double sum = 0.0;
    double least = 0.0;
    for (const float sample : samples) {
      sum += std::min(sample, 0.0F);
      least = std::min(least, double{sample});
    }
    const double ratio = least < -0.001 ? sum / (27.0 * least) : 0.0;
    const double openness = std::clamp(1.0 - std::pow(ratio + double{options.offset}, double{options.power}), 0.0, 1.0);
    EXPECT_NEAR(smooth::occlusion_of(samples, options), 1.0 - openness, 1e-5) << round;
  }
}

double hills(DVec3 p) {
  return 1.5 *
         (std::sin(0.31 * p.x + 1) + std::sin(0.27 * p.y + 2) * std::cos(0.23 * p.z) + std::cos(0.37 * p.z + 0.5));
}

/// One of the 48 ways to turn and mirror the cube: axes permuted, some negated.
struct Symmetry {
  std::array<int, 3> axes;
  DVec3 signs;

  [[nodiscard]] DVec3 operator()(DVec3 p) const { return DVec3(p[axes[0]], p[axes[1]], p[axes[2]]) * signs; }
};

std::vector<Symmetry> symmetries() {
  std::vector<Symmetry> all;
  std::array<int, 3> axes = {0, 1, 2};
  do {
    for (int s = 0; s < 8; ++s) all.push_back({axes, DVec3((s & 1) ? -1 : 1, (s & 2) ? -1 : 1, (s & 4) ? -1 : 1)});
  } while (std::next_permutation(axes.begin(), axes.end()));
  return all;
}

// Returns a field whose features grow with its cells; air between its lattice points.
World enlarged(const World& small, int level) {
  const DensityNeighbourhood chunks = small.around();
  const int size = 1 << level;
  return World([&](IVec3 p) {
    const bool is_on_lattice = (p & IVec3(size - 1)) == IVec3(0);
    return is_on_lattice ? size * double{float_from_half(chunks.get(p / size))} : 0.0;
  });
}

TEST(SmoothOcclusion, ScalesWithFieldCellsAndSpread) {
  // Within the band at every size.
  const World small(
      [](IVec3 p) { return 0.3 * (std::sin(0.7 * p.x) + std::sin(0.9 * p.y + 1.0) + std::cos(0.8 * p.z)); });
  for (int level = 1; level <= kMaxSmoothLevel; ++level) {
    const World large = enlarged(small, level);
    for (const SmoothOcclusion form : kForms) {
      for (const float spread : {0.3F, 0.5F}) {
        const SmoothChunkMesh fine = mesh_of(small, form, spread);
        std::map<std::uint32_t, float> expected;
        for (std::size_t i = 0; i < fine.cells.size(); ++i) expected[fine.cells[i].bits] = fine.occlusion[i];
        SmoothMesher mesher;
        SmoothChunkMesh coarse;
        mesher.mesh(large.around(), with(form, level, std::ldexp(spread, level)), coarse);
        ASSERT_GT(coarse.cells.size(), 40U);
        EXPECT_GT(*std::max_element(coarse.occlusion.begin(), coarse.occlusion.end()), 0.0F);
        for (std::size_t i = 0; i < coarse.cells.size(); ++i) {
          if (coarse.cells[i].chunk_offset() != IVec3(0)) continue;  // these have other names in the small field
          ASSERT_EQ(coarse.occlusion[i], expected.at(coarse.cells[i].bits))
              << "level " << level << " spread " << spread;
        }
      }
    }
  }
}

// Returns hills and caves within reach of level-2 meshes.
World rugged() {
  return World([](IVec3 p) {
    const DVec3 at(p);
    const double hills = 9.0 * std::sin(0.11 * at.x + 0.5) * std::cos(0.13 * at.z);
    const double height = 30.0 + hills + 4.0 * std::sin(0.42 * at.x) * std::cos(0.37 * at.z + 1.0);
    const double cave = glm::distance(at, DVec3(30.0, 22.0, 34.0)) - 11.0;
    return std::max(0.8 * (at.y - height), -cave);
  });
}

// Lengths are in samples of level 0, so the surface of one field is about as dark at several levels.
TEST(SmoothOcclusion, IsSimilarAtEveryLevel) {
  const World world = rugged();
  for (const SmoothOcclusion form :
       {SmoothOcclusion::SolidShare, SmoothOcclusion::SoftShare, SmoothOcclusion::Weighted}) {
    std::array<double, 3> means{};
    for (int level = 0; level < 3; ++level) {
      SmoothMesher mesher;
      SmoothChunkMesh mesh;
      mesher.mesh(world.around(), with(form, level), mesh);
      const double sum = std::accumulate(mesh.occlusion.begin(), mesh.occlusion.end(), 0.0);
      means[static_cast<std::size_t>(level)] = sum / static_cast<double>(mesh.occlusion.size());
    }
    EXPECT_GT(means[0], 0.002);
    for (const double coarse : {means[1], means[2]}) {
      EXPECT_NEAR(coarse, means[0], 0.02) << static_cast<int>(form);
      EXPECT_NEAR(coarse / means[0], 1.0, 0.5) << static_cast<int>(form);
    }
  }
}

// The soft share follows the plain one, but also has values between the 28 values of a count.
TEST(SmoothOcclusion, SoftShareHasNoSteps) {
  const World world = rugged();
  const SmoothChunkMesh soft = mesh_of(world, SmoothOcclusion::SoftShare);
  const SmoothChunkMesh counted = mesh_of(world, SmoothOcclusion::SolidShare);
  std::size_t dark = 0;
  std::size_t on_steps = 0;
  double difference = 0.0;
  for (std::size_t i = 0; i < soft.occlusion.size(); ++i) {
    ASSERT_LE(soft.occlusion[i], counted.occlusion[i] + 1e-6F);
    if (!(soft.occlusion[i] > 0.0F)) continue;
    ++dark;
    difference += static_cast<double>(counted.occlusion[i] - soft.occlusion[i]);
    const float steps = soft.occlusion[i] * 27.0F;
    on_steps += std::abs(steps - std::round(steps)) < 1e-4F ? 1 : 0;
  }
  ASSERT_GT(dark, 1'500U);
  EXPECT_LT(on_steps, dark / 10);
  EXPECT_LT(difference / static_cast<double>(dark), 0.05);
}

TEST(SmoothOcclusion, TurnsAndMirrorsWithField) {
  const DVec3 centre(31.5);
  using Cell = std::array<int, 3>;
  std::map<std::size_t, World> worlds;  // by symmetry: the methods share them
  const auto occlusion_by_cell = [&](std::size_t number, const Symmetry& turn, SmoothOcclusion form) {
    auto world = worlds.find(number);
    if (world == worlds.end()) {
      world = worlds.emplace(number, world_of([&](IVec3 p) { return hills(turn(DVec3(p) - centre)); })).first;
    }
    const SmoothChunkMesh mesh = mesh_of(world->second, form);
    std::map<Cell, float> cells;
    for (std::size_t i = 0; i < mesh.cells.size(); ++i) {
      if (mesh.cells[i].chunk_offset() != IVec3(0)) continue;
      const DVec3 cell = turn(DVec3(mesh.cells[i].cell()) + 0.5 - centre) + centre;
      cells[{static_cast<int>(std::floor(cell.x)), static_cast<int>(std::floor(cell.y)),
             static_cast<int>(std::floor(cell.z))}] = mesh.occlusion[i];
    }
    return cells;
  };
  const std::vector<Symmetry> all = symmetries();
  ASSERT_EQ(all.size(), 48U);
  for (const SmoothOcclusion form :
       {SmoothOcclusion::SolidShare, SmoothOcclusion::Weighted, SmoothOcclusion::SoftShare}) {
    // At night the sum is compared with all 48; the count shares all but its last step.
    const std::size_t step = !is_nightly() ? 11 : form == SmoothOcclusion::SolidShare ? 5 : 1;
    const auto expected = occlusion_by_cell(0, all[0], form);
    int shared = 0;
    int jumps = 0;
    for (std::size_t i = 0; i < all.size(); i += step) {
      for (const auto& [cell, occlusion] : occlusion_by_cell(i, all[i], form)) {
        // Cells at x, y or z = 63 have their mirror images in cell -1, which the neighbour owns.
        const auto found = expected.find(cell);
        if (found == expected.end()) continue;
        ++shared;
        const double difference = std::abs(occlusion - found->second);
        // A count jumps if a sample is 0 except for rounding.
        if (form == SmoothOcclusion::SolidShare && std::abs(difference - 1.0 / 27) < 1e-6) {
          ++jumps;
        } else {
          ASSERT_LE(difference, 1e-5);
        }
      }
    }
    EXPECT_GT(shared, static_cast<int>(all.size() / step) * 5'000);
    EXPECT_LE(jumps, shared / 20'000);
  }
}

TEST(SmoothOcclusion, ChunksMatchExactlyAtSharedVertices) {
  DensityGrid grid(kBand);
  const auto field = [](IVec3 p) { return hills(DVec3(p) * 1.7) * 1.3; };
  for (int i = 0; i < 64; ++i) {
    const IVec3 chunk(i % 4 - 1, i / 4 % 4 - 1, i / 16 - 1);
    grid.put_chunk(chunk, chunk_of_field(field, chunk));
  }
  SmoothMesher mesher;
  for (const SmoothOcclusion form : kForms) {
    for (int i = 0; i < 7; ++i) {
      const IVec3 step((i + 1) & 1, (i + 1) >> 1 & 1, (i + 1) >> 2 & 1);
      SmoothChunkMesh low;
      SmoothChunkMesh high;
      mesher.mesh(grid.neighbourhood(IVec3(0)), with(form), low);
      mesher.mesh(grid.neighbourhood(step), with(form), high);
      std::map<std::uint32_t, std::size_t> by_cell;
      for (std::size_t v = 0; v < low.cells.size(); ++v) by_cell[low.cells[v].bits] = v;
      int shared = 0;
      for (std::size_t v = 0; v < high.cells.size(); ++v) {
        if (high.cells[v].chunk_offset() != -step) continue;
        const auto found = by_cell.find(high.cells[v].bits & 0x3FFFF);
        ASSERT_NE(found, by_cell.end());
        ++shared;
        ASSERT_EQ(low.positions[found->second], high.positions[v] + Vec3(step * kChunkEdge));
        ASSERT_EQ(std::memcmp(&low.normals[found->second], &high.normals[v], sizeof(Vec3)), 0);
        ASSERT_EQ(low.occlusion[found->second], high.occlusion[v]);
      }
      EXPECT_GT(shared, i == 6 ? -1 : 10) << step.x << step.y << step.z;
    }
  }
}

TEST(SmoothOcclusion, IgnoresEditsBeyondReach) {
  const auto field = [](IVec3 p) { return hills(DVec3(p)); };
  for (const int level : {0, 2}) {
    const SmoothOptions options = with(SmoothOcclusion::Weighted, level);
    const int reach = reach_of(options.occlusion, level);
    DensityGrid grid(kBand);
    for (int i = 0; i < 27; ++i) {
      const IVec3 chunk = Neighbourhood::offset(i);
      grid.put_chunk(chunk, chunk_of_field(field, chunk));
    }
    SmoothMesher mesher;
    SmoothChunkMesh before;
    mesher.mesh(grid.neighbourhood(IVec3(0)), options, before);
    grid.edit({{-64, -64, -64}, {128, 128, -reach}}, [](IVec3, DensitySample s) {
      return DensitySample{-s.density, 1};
    });
    SmoothChunkMesh after;
    mesher.mesh(grid.neighbourhood(IVec3(0)), options, after);
    ASSERT_EQ(before.occlusion.size(), after.occlusion.size());
    EXPECT_EQ(std::memcmp(before.occlusion.data(), after.occlusion.data(), 4 * before.occlusion.size()), 0);
    // A change one sample nearer has an effect: the reach is no wider than the corner case requires.
    grid.edit({{-64, -64, -reach}, {128, 128, 0}}, [](IVec3, DensitySample) { return DensitySample{-8.0F, 1}; });
    mesher.mesh(grid.neighbourhood(IVec3(0)), options, after);
    const bool is_same = before.occlusion.size() == after.occlusion.size() &&
                         std::memcmp(before.occlusion.data(), after.occlusion.data(), 4 * before.occlusion.size()) == 0;
    EXPECT_FALSE(is_same);
  }
}

}  // namespace
}  // namespace quoin
