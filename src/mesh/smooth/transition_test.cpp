// Chunks of different levels of detail meet without an open edge.

#include <cstring>
#include <map>
#include <random>
#include <tuple>

#include <gtest/gtest.h>

#include <quoin/mesh/smooth_mesh.h>

#include "core/death_for_tests.h"
#include "mesh/smooth/level_cells.h"
#include "mesh/smooth/smooth_oracle.h"
#include "mesh/smooth/surface_check_for_tests.h"

namespace quoin {
namespace {

using oracle::count_surface;
using oracle::grid_of;
using oracle::mesh_of;
using oracle::SurfaceCount;

// Returns a random level for every chunk.
std::function<int(IVec3)> random_levels(unsigned seed) {
  return [=](IVec3 chunk) { return static_cast<int>(oracle::hash_of(seed, chunk) % 4); };
}

SmoothMeshOptions options_with(const std::function<int(IVec3)>& level_of, bool split = false) {
  SmoothMeshOptions options;
  options.level_of = level_of;
  options.split_sheets = split;
  options.occlusion.method = SmoothOcclusion::None;
  return options;
}

// A box across faces, edges and two corners of chunks.
constexpr IBox box_over_borders() {
  return {{64 - 22, -10, 64 - 21}, {64 + 23, 64 + 14, 64 + 19}};
}

class MixedLevels : public testing::TestWithParam<unsigned> {};

TEST_P(MixedLevels, NoiseHasNoOpenEdges) {
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

TEST_P(MixedLevels, ScatteredSamplesHaveNoOpenEdges) {
  const IBox box{IVec3{64 - 14}, IVec3{64 + 13}};
  for (const double share : {0.03, 0.5, 0.97}) {
    SCOPED_TRACE(testing::Message() << "seed " << GetParam() << ", solid share " << share);
    const DensityGrid grid = grid_of(box, oracle::scatter(GetParam(), share));
    for (const bool split : {false, true}) {
      const SurfaceCount count = count_surface(mesh_of(grid, options_with(random_levels(GetParam()), split)));
      oracle::expect_closed(count);
      EXPECT_EQ(count.doubled_triangles, 0) << count;
    }
  }
}

TEST_P(MixedLevels, LargeSphereStaysSphere) {
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

// The bits of a cell's vertex in a chunk's mesh.
struct VertexBits {
  std::array<std::uint32_t, 7> bits{};
  bool operator==(const VertexBits&) const = default;
};

VertexBits bits_of(const SmoothChunkMesh& mesh, std::size_t i) {
  VertexBits vertex;
  // The position relative to the cell's own chunk: exact, as both are multiples of 2^-16 of at most 64.
  const Vec3 position = mesh.positions[i] - Vec3(mesh.cells[i].chunk_offset() * kChunkEdge);
  std::memcpy(vertex.bits.data(), &position, 12);
  std::memcpy(vertex.bits.data() + 3, &mesh.normals[i], 12);
  if (!mesh.occlusion.empty()) std::memcpy(vertex.bits.data() + 6, &mesh.occlusion[i], 4);
  return vertex;
}

// Meshes the chunks of a box one by one. All chunks that have a cell's vertex must agree on it.
void expect_that_chunks_agree(const DensityGrid& grid, const std::function<int(IVec3)>& level_of, bool split) {
  std::map<std::tuple<int, int, int, std::uint32_t>, VertexBits> known;
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  SmoothOptions options;
  options.split_sheets = split;
  options.occlusion.method = SmoothOcclusion::Weighted;
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

TEST(SmoothBorders, MatchExactlyAtSharedVertices) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const DensityGrid grid = grid_of(box_over_borders(), oracle::waves(seed, 9.0 + 4.0 * seed));
    for (const bool split : {false, true}) {
      expect_that_chunks_agree(grid, random_levels(seed), split);
      for (int level = 0; level <= kMaxSmoothLevel; ++level) {
        expect_that_chunks_agree(
            grid, [=](IVec3) { return level; }, split);
      }
    }
  }
}

// A chunk and a cell, in samples of the whole field.
using CellKey = std::tuple<int, int, int, int>;

struct WeightedMean {
  DVec3 sum{0.0};
  double weight = 0.0;
};

struct Polygons {
  std::map<CellKey, WeightedMean> cells;
  std::int64_t triangles = 0;
};

CellKey cell_around(IVec3 sample, const std::function<int(IVec3)>& level_of) {
  const int level = level_of(chunk_of(sample));
  const IVec3 first = sample & IVec3{-(1 << level)};
  return {first.x, first.y, first.z, level};
}

// Visits an edge from each of its four sides: if it is crossed and no edge there is shorter, counts it for every cell.
void look_at_edge(const DensityGrid& grid, const std::function<int(IVec3)>& level_of, IVec3 p, int axis,
                  Polygons& polygons) {
  std::set<CellKey> cells;
  int level = kMaxSmoothLevel;
  for (const IVec3 side : smooth::cells_around(p, axis)) {
    cells.insert(cell_around(side, level_of));
    level = std::min(level, level_of(chunk_of(side)));
  }
  const int length = 1 << level;
  if ((p & IVec3{length - 1}) != IVec3{0}) return;
  const double a = grid.density(p);
  const double b = grid.density(p + smooth::unit_axis(axis) * length);
  if ((a < 0.0) == (b < 0.0)) return;
  polygons.triangles += static_cast<std::int64_t>(cells.size()) - 2;
  for (const CellKey& cell : cells) {
    WeightedMean& mean = polygons.cells[cell];
    mean.sum += (DVec3(p) + DVec3(smooth::unit_axis(axis)) * (length * a / (a - b))) * static_cast<double>(length);
    mean.weight += length;
  }
}

Polygons polygons_of(const DensityGrid& grid, const IBox& box, const std::function<int(IVec3)>& level_of) {
  Polygons polygons;
  for (int z = box.min.z - 8; z < box.max.z; ++z) {
    for (int y = box.min.y - 8; y < box.max.y; ++y) {
      for (int x = box.min.x - 8; x < box.max.x; ++x) {
        for (int axis = 0; axis < 3; ++axis) look_at_edge(grid, level_of, {x, y, z}, axis, polygons);
      }
    }
  }
  return polygons;
}

void expect_vertices_of(const SmoothChunkMesh& mesh, IVec3 chunk, int level, Polygons& polygons) {
  for (std::size_t v = 0; v < mesh.cells.size(); ++v) {
    if (mesh.cells[v].chunk_offset() != IVec3{0}) continue;
    const IVec3 first = chunk * kChunkEdge + mesh.cells[v].cell() * (1 << level);
    const auto found = polygons.cells.find({first.x, first.y, first.z, level});
    ASSERT_NE(found, polygons.cells.end()) << "a vertex too many";
    const DVec3 expected = found->second.sum / found->second.weight;
    const DVec3 position = DVec3(mesh.positions[v]) + DVec3(chunk * kChunkEdge);
    EXPECT_LT(glm::length(position - expected), 2e-5 * (1 << level));
    polygons.cells.erase(found);
  }
}

TEST_P(MixedLevels, MatchOraclePolygonsAndVertices) {
  const auto level_of = random_levels(GetParam() + 100);
  const IBox box = box_over_borders();
  const DensityGrid grid = grid_of(box, oracle::waves(GetParam(), 14.0));
  Polygons polygons = polygons_of(grid, box, level_of);
  std::int64_t triangles = 0;
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  for (int i = 0; i < 64; ++i) {
    const IVec3 chunk = IVec3{i % 4, i / 4 % 4, i / 16} - 1;
    SmoothOptions options;
    options.split_sheets = false;
    for (int k = 0; k < 27; ++k) {
      const IVec3 offset = IVec3{k % 3, k / 3 % 3, k / 9} - 1;
      options.levels[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(level_of(chunk + offset));
    }
    mesher.mesh(grid.neighbourhood(chunk), options, mesh);
    triangles += static_cast<std::int64_t>(mesh.indices.size() / 3);
    expect_vertices_of(mesh, chunk, options.levels[13], polygons);
  }
  EXPECT_EQ(triangles, polygons.triangles);
  EXPECT_TRUE(polygons.cells.empty()) << polygons.cells.size() << " cells lack their vertex";
}

// Shows that the tests above can fail: without transitions the borders between levels are open.
TEST(SmoothLevels, MeshesWithoutNeighbourLevelsDoNotMeet) {
  const DVec3 centre{64.0, 30.0, 30.0};
  const DensityGrid grid = grid_of(oracle::box_around(centre, 30.0), oracle::sphere(centre, 20.0), 32.0F);
  SmoothMesher mesher;
  SmoothChunkMesh fine;
  SmoothChunkMesh coarse;
  SmoothOptions options;
  options.split_sheets = false;
  mesher.mesh(grid.neighbourhood({1, 0, 0}), options, fine);
  options.levels.fill(2);
  mesher.mesh(grid.neighbourhood(IVec3{0}), options, coarse);
  const auto open_edges = [](const SmoothChunkMesh& mesh) {
    return count_surface({mesh.indices.data(), mesh.indices.size()}, mesh.positions.size()).odd_edges;
  };
  EXPECT_GT(open_edges(fine), 2 * open_edges(coarse));
}

// Returns the distance of a sample from the samples of chunk (0, 0, 0), along the farthest axis.
int distance_from_chunk(IVec3 sample) {
  const IVec3 outside = glm::max(glm::max(-sample, sample - (kChunkEdge - 1)), IVec3{0});
  return std::max({outside.x, outside.y, outside.z});
}

std::vector<VertexBits> all_bits(const SmoothChunkMesh& mesh) {
  std::vector<VertexBits> all;
  for (std::size_t v = 0; v < mesh.cells.size(); ++v) all.push_back(bits_of(mesh, v));
  return all;
}

TEST(SmoothLevels, IgnoreEditsBeyondReach) {
  SmoothMesher mesher;
  SmoothChunkMesh before;
  SmoothChunkMesh after;
  int changed_within = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    DensityGrid grid = grid_of({IVec3{-14}, IVec3{14}}, oracle::scatter(seed));
    SmoothOptions options;
    options.split_sheets = true;
    options.occlusion.method = seed % 2 == 0 ? SmoothOcclusion::None : SmoothOcclusion::Weighted;
    const int coarsest = static_cast<int>(seed % 3);
    for (std::size_t k = 0; k < 27; ++k) {
      const auto chunk = static_cast<int>(k);
      options.levels[k] =
          static_cast<std::uint8_t>(oracle::hash_of(seed, {chunk, 0, 0}) % static_cast<std::uint64_t>(coarsest + 1));
    }
    options.levels[0] = static_cast<std::uint8_t>(coarsest);
    const int reach = reach_of(options.occlusion, coarsest);
    mesher.mesh(grid.neighbourhood(IVec3{0}), options, before);
    for (int i = 0; i < 60; ++i) {
      const std::uint64_t random = oracle::hash_of(seed, {i, 1, 2});
      IVec3 sample{static_cast<int>(random % 28) - 14, static_cast<int>(random / 28 % 28) - 14, 0};
      sample.z = -reach - 1 + (i % 2) * reach;
      const DensitySample old{grid.density(sample), grid.material(sample)};
      grid.set(sample, {old.density < 0.0F ? 1.5F : -1.5F, 1});
      mesher.mesh(grid.neighbourhood(IVec3{0}), options, after);
      const bool same = all_bits(before) == all_bits(after) &&
                        std::equal(before.indices.begin(), before.indices.end(), after.indices.begin());
      if (distance_from_chunk(sample) > reach) {
        EXPECT_TRUE(same) << "seed " << seed << ": " << sample.x << " " << sample.y << " " << sample.z;
      } else {
        changed_within += same ? 0 : 1;
      }
      grid.set(sample, old);
    }
  }
  EXPECT_GT(changed_within, 20) << "the edits reach nothing";
}

TEST(SmoothLevels, MatchKernelAwayFromOtherLevels) {
  const DensityGrid grid = grid_of({{-3, 0, 0}, {70, 50, 50}}, oracle::waves(3, 15.0));
  SmoothMesher mesher;
  SmoothChunkMesh mixed;
  SmoothChunkMesh plain;
  SmoothOptions options;
  options.split_sheets = false;
  options.levels.fill(1);
  mesher.mesh(grid.neighbourhood(IVec3{0}), options, plain);
  options.levels[14] = 0;  // the next chunk along x
  mesher.mesh(grid.neighbourhood(IVec3{0}), options, mixed);
  std::map<std::uint32_t, VertexBits> known;
  for (std::size_t v = 0; v < plain.cells.size(); ++v) known[plain.cells[v].bits] = bits_of(plain, v);
  std::int64_t compared = 0;
  for (std::size_t v = 0; v < mixed.cells.size(); ++v) {
    if (mixed.cells[v].cell().x == 31 && mixed.cells[v].chunk_offset().x == 0) continue;
    ASSERT_EQ(known.at(mixed.cells[v].bits).bits, bits_of(mixed, v).bits);
    ++compared;
  }
  EXPECT_GT(compared, 1000);
}

INSTANTIATE_TEST_SUITE_P(Seeds, MixedLevels, testing::Range(1U, 7U));

TEST(TransitionsDeathTest, AssertsOnOpenBorder) {
  SmoothOptions options;
  options.border = SmoothBorder::Open;
  SmoothChunkMesh mesh;
  QUOIN_EXPECT_MISTAKE(smooth::mesh_with_transitions(
                           {}, options, [](SmoothChunkMesh&) {}, mesh),
                       "must be Shared");
}

TEST(SmoothCellDeathTest, RejectsCellsBeyondPackedRange) {
  QUOIN_EXPECT_MISTAKE((void)smooth::cell_name(IVec3(64, 0, 0), IVec3(0)), "a cell of the chunk");
  QUOIN_EXPECT_MISTAKE((void)smooth::cell_name(IVec3(0), IVec3(0, 1, 0)), "0 or -1 on each axis");
  QUOIN_EXPECT_MISTAKE((void)smooth::ChunkLevels({}).of_chunk(IVec3(2, 0, 0)), "one of its 26 neighbours");
}

}  // namespace
}  // namespace quoin
