// Chunks of different levels of detail meet without an open edge.

#include <cstring>
#include <map>
#include <random>
#include <tuple>

#include <gtest/gtest.h>

#include <quoin/mesh/smooth_mesh.h>

#include "mesh/smooth_levels.h"
#include "mesh/smooth_oracle.h"
#include "mesh/smooth_test_support.h"

namespace quoin {
namespace {

using oracle::count_surface;
using oracle::grid_of;
using oracle::mesh_of;
using oracle::SurfaceCount;

// A level for every chunk, from a seed.
std::function<int(IVec3)> random_levels(unsigned seed) {
  return [=](IVec3 chunk) {
    std::seed_seq seeds{seed, static_cast<unsigned>(chunk.x), static_cast<unsigned>(chunk.y),
                        static_cast<unsigned>(chunk.z)};
    std::array<std::uint32_t, 1> value{};
    seeds.generate(value.begin(), value.end());
    return static_cast<int>(value[0] % 4);
  };
}

SmoothMeshOptions options_with(const std::function<int(IVec3)>& level_of, bool split = false) {
  SmoothMeshOptions options;
  options.level_of = level_of;
  options.split_sheets = split;
  options.occlusion.form = SmoothOcclusion::None;
  return options;
}

// A box over a chunk's middle in y and over faces, edges and corners of chunks elsewhere.
constexpr IBox box_over_borders() {
  return {{64 - 26, -14, 64 - 25}, {64 + 27, 64 + 20, 64 + 22}};
}

class MixedLevels : public testing::TestWithParam<unsigned> {};

TEST_P(MixedLevels, NoiseOfAnyScaleHasNoOpenEdge) {
  for (const double wavelength : {6.0, 17.0, 50.0}) {
    SCOPED_TRACE(testing::Message() << "seed " << GetParam() << ", wavelength " << wavelength);
    const DensityGrid grid = grid_of(box_over_borders(), oracle::waves(GetParam(), wavelength));
    for (const bool split : {false, true}) {
      const SmoothMesh mesh = mesh_of(grid, options_with(random_levels(GetParam()), split));
      const SurfaceCount count = count_surface(mesh);
      oracle::expect_closed(count);
      EXPECT_EQ(count.doubled_triangles, 0) << count;
    }
  }
}

TEST_P(MixedLevels, ScatteredSamplesHaveNoOpenEdge) {
  const IBox box{IVec3{64 - 14}, IVec3{64 + 13}};
  for (const double share : {0.03, 0.5, 0.97}) {
    SCOPED_TRACE(testing::Message() << "seed " << GetParam() << ", solid share " << share);
    const DensityGrid grid = grid_of(box, oracle::scatter(GetParam(), share));
    for (const bool split : {false, true}) {
      oracle::expect_closed(count_surface(mesh_of(grid, options_with(random_levels(GetParam()), split))));
    }
  }
}

TEST_P(MixedLevels, ALargeSphereStaysASphere) {
  std::mt19937 random(GetParam());
  std::uniform_real_distribution<double> offset(-30.0, 30.0);
  const DVec3 centre{64.0 + offset(random), 64.0 + offset(random), 64.0 + offset(random)};
  const double radius = 44.0;
  SCOPED_TRACE(testing::Message() << "seed " << GetParam());
  const DensityGrid grid = grid_of(oracle::box_around(centre, radius + 16.0), oracle::sphere(centre, radius), 64.0F);
  const SmoothMesh mesh = mesh_of(grid, options_with(random_levels(GetParam())));
  const SurfaceCount count = count_surface(mesh, true);
  oracle::expect_manifold(count);
  EXPECT_EQ(count.euler(), 2);
  const double volume = 4.0 / 3.0 * 3.14159265 * radius * radius * radius;
  EXPECT_NEAR(oracle::signed_volume(mesh), volume, volume * 0.05);
  double farthest = 0.0;
  double worst_cosine = 1.0;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const DVec3 away = DVec3(mesh.positions[i]) - centre;
    farthest = std::max(farthest, std::abs(glm::length(away) - radius));
    worst_cosine = std::min(worst_cosine, glm::dot(DVec3(mesh.normals[i]), glm::normalize(away)));
  }
  // The coarsest cells are 8 wide: crossings lie within 8^2 / (8 * 44) of the sphere, and the mean of such points
  // in a cell within (8 sqrt(3))^2 / (8 * 44) of them.
  EXPECT_LT(farthest, 0.75);
  EXPECT_GT(worst_cosine, 0.98);
}

INSTANTIATE_TEST_SUITE_P(Seeds, MixedLevels, testing::Range(1U, 9U));

// What a chunk's mesh says of a cell's vertex.
struct VertexBits {
  std::array<std::uint32_t, 7> bits{};
  bool operator==(const VertexBits&) const = default;
};

VertexBits bits_of(const SmoothChunkMesh& mesh, std::size_t i) {
  VertexBits vertex;
  // The same place relative to the cell's own chunk: exact, as both are multiples of 2^-16 of at most 64.
  const Vec3 position = mesh.positions[i] - Vec3(mesh.cells[i].chunk_offset() * kChunkEdge);
  std::memcpy(vertex.bits.data(), &position, 12);
  std::memcpy(vertex.bits.data() + 3, &mesh.normals[i], 12);
  if (!mesh.openness.empty()) std::memcpy(vertex.bits.data() + 6, &mesh.openness[i], 4);
  return vertex;
}

// Meshes the chunks of a box one by one; a cell's vertex must be the same in each that has it.
void expect_that_chunks_agree(const DensityGrid& grid, const std::function<int(IVec3)>& level_of, bool split) {
  std::map<std::tuple<int, int, int, std::uint32_t>, VertexBits> known;
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  SmoothOptions options;
  options.split_sheets = split;
  options.occlusion.form = SmoothOcclusion::Weighted;
  std::int64_t shared = 0;
  for (int i = 0; i < 64; ++i) {
    const IVec3 chunk = IVec3{i % 4, i / 4 % 4, i / 16} - 1;
    for (int k = 0; k < 27; ++k) {
      const IVec3 offset = IVec3{k % 3, k / 3 % 3, k / 9} - 1;
      options.levels[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(level_of(chunk + offset));
    }
    mesher.mesh(grid.neighbourhood(chunk), options, mesh);
    for (std::size_t v = 0; v < mesh.cells.size(); ++v) {
      const IVec3 owner = chunk + mesh.cells[v].chunk_offset();
      const std::uint32_t name = mesh.cells[v].bits & ~(7U << SmoothCell::kPreviousShift);
      const VertexBits bits = bits_of(mesh, v);
      const auto [found, is_new] = known.emplace(std::tuple(owner.x, owner.y, owner.z, name), bits);
      if (is_new) continue;
      ++shared;
      ASSERT_EQ(found->second.bits, bits.bits)
          << "cell " << mesh.cells[v].cell().x << " " << mesh.cells[v].cell().y << " " << mesh.cells[v].cell().z;
    }
  }
  EXPECT_GT(shared, 50);
}

TEST(SmoothBorders, ChunksGiveTheirCommonVerticesTheSameBits) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const DensityGrid grid = grid_of(box_over_borders(), oracle::waves(seed, 9.0 + 4.0 * seed));
    for (const bool split : {false, true}) {
      expect_that_chunks_agree(grid, random_levels(seed), split);
      for (int level = 0; level <= kCoarsestLevel; ++level) {
        expect_that_chunks_agree(
            grid, [=](IVec3) { return level; }, split);
      }
    }
  }
}

}  // namespace
}  // namespace quoin
