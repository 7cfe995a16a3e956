// Each sheet of the surface that crosses a cell has its own vertex, and the mesh is manifold.

#include "mesh/nets/sheets.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <numeric>

#include <gtest/gtest.h>

#include <quoin/mesh/smooth_mesh.h>

#include "core/death_for_tests.h"
#include "core/work/nightly_for_tests.h"
#include "mesh/smooth/level_cells.h"
#include "mesh/smooth/surface_check_for_tests.h"

namespace quoin {
namespace {

using oracle::count_surface;
using oracle::grid_of;
using oracle::mesh_of;
using oracle::SurfaceCount;
using smooth::joined_face;
using smooth::kNoFace;
using smooth::Sheets;
using smooth::sheets_of;

// Returns the four edges of a face, by their numbers in Sheets, in circular order.
std::array<std::size_t, 4> edges_around(int face) {
  const auto axis = static_cast<std::size_t>(face / 2);
  const std::size_t u = (axis + 1) % 3;
  const std::size_t v = (axis + 2) % 3;
  const auto side = static_cast<std::size_t>(face % 2);
  // An edge along u has (v, axis) as its next two axes; one along v has (axis, u).
  return {4 * u + 2 * side, 4 * v + side + 2, 4 * u + 2 * side + 1, 4 * v + side};
}

bool is_ambiguous(std::uint32_t solid, int face) {
  const Sheets sheets = sheets_of(solid);
  const auto edges = edges_around(face);
  return std::all_of(edges.begin(), edges.end(),
                     [&](std::size_t edge) { return sheets.of_edge[edge] != Sheets::kUncrossed; });
}

TEST(SmoothSheets, FormCyclesCrossingFacesInPairs) {
  for (std::uint32_t solid = 0; solid < 256; ++solid) {
    for (int flipped = 0; flipped <= kNoFace; ++flipped) {
      const Sheets sheets = sheets_of(solid, flipped);
      std::array<int, 16> crossings{};
      for (const std::uint8_t sheet : sheets.of_edge) ++crossings[sheet];
      EXPECT_LE(sheets.count, 4);
      for (int sheet = 0; sheet < sheets.count; ++sheet) EXPECT_GE(crossings[static_cast<std::size_t>(sheet)], 3);
      EXPECT_EQ(std::accumulate(crossings.begin(), crossings.begin() + sheets.count, 0),
                12 - crossings[Sheets::kUncrossed]);
      for (int face = 0; face < 6; ++face) {
        std::map<int, int> on_face;
        for (const std::size_t edge : edges_around(face)) ++on_face[sheets.of_edge[edge]];
        on_face.erase(Sheets::kUncrossed);
        for (const auto& [sheet, count] : on_face) EXPECT_EQ(count % 2, 0) << solid << " face " << face;
      }
    }
  }
}

TEST(SmoothSheets, MatchPartCountsOfSimpleCells) {
  EXPECT_EQ(sheets_of(0).count, 0);
  EXPECT_EQ(sheets_of(0xFF).count, 0);
  EXPECT_EQ(sheets_of(0x01).count, 1);
  EXPECT_EQ(sheets_of(0x0F).count, 1);
  EXPECT_EQ(sheets_of(0x81).count, 2) << "two opposite corners";
  EXPECT_EQ(sheets_of(0x69).count, 4) << "every other corner";
  EXPECT_EQ(sheets_of(0x96).count, 4);
  EXPECT_EQ(sheets_of(0x09).count, 2) << "two corners across a face: apart";
  EXPECT_EQ(sheets_of(0xF6).count, 1) << "their complement: one piece of solid around a bridge of air";
}

// The proof in docs/decisions/archive/021-two-sheets.md depends on this.
TEST(SmoothSheets, JoinAllCrossingsOnAtMostOneFace) {
  int cells_with_one = 0;
  for (std::uint32_t solid = 0; solid < 256; ++solid) {
    int joined = 0;
    for (int face = 0; face < 6; ++face) {
      if (!is_ambiguous(solid, face)) continue;
      const Sheets sheets = sheets_of(solid);
      const auto edges = edges_around(face);
      const bool all_one = std::all_of(edges.begin(), edges.end(), [&](std::size_t edge) {
        return sheets.of_edge[edge] == sheets.of_edge[edges[0]];
      });
      if (!all_one) continue;
      ++joined;
      EXPECT_EQ(joined_face(solid), face);
    }
    EXPECT_LE(joined, 1) << solid;
    if (joined == 0) {
      EXPECT_EQ(joined_face(solid), kNoFace);
    }
    cells_with_one += joined;
  }
  EXPECT_GT(cells_with_one, 0);
}

TEST(SmoothSheets, OtherPairingSplitsJoinedFace) {
  for (std::uint32_t solid = 0; solid < 256; ++solid) {
    const int face = joined_face(solid);
    if (face == kNoFace) continue;
    const Sheets sheets = sheets_of(solid, face);
    const auto edges = edges_around(face);
    EXPECT_EQ(sheets.count, sheets_of(solid).count + 1) << solid;
    EXPECT_FALSE(std::all_of(edges.begin(), edges.end(), [&](std::size_t edge) {
      return sheets.of_edge[edge] == sheets.of_edge[edges[0]];
    })) << solid;
    // No other face gets all crossings in one sheet.
    for (int other = 0; other < 6; ++other) {
      if (!is_ambiguous(solid, other)) continue;
      const auto around = edges_around(other);
      EXPECT_FALSE(std::all_of(around.begin(), around.end(), [&](std::size_t edge) {
        return sheets.of_edge[edge] == sheets.of_edge[around[0]];
      })) << solid;
    }
  }
}

class SplitNoise : public testing::TestWithParam<unsigned> {};

TEST_P(SplitNoise, ScatteredSamplesAreManifold) {
  const IBox box{IVec3{64 - 17}, IVec3{64 + 18}};
  for (const double share : {0.15, 0.5, 0.8}) {
    SCOPED_TRACE(testing::Message() << "seed " << GetParam() << ", solid share " << share);
    const DensityGrid grid = grid_of(box, oracle::scatter(GetParam(), share));
    SmoothMeshOptions options;
    options.occlusion.method = SmoothOcclusion::None;
    oracle::expect_manifold(count_surface(mesh_of(grid, options), true));
    options.split_sheets = false;
    EXPECT_GT(count_surface(mesh_of(grid, options)).crowded_edges, 0) << "the test asks for nothing";
  }
}

TEST_P(SplitNoise, IsManifoldAtEveryLevel) {
  const IBox box{IVec3{64 - 32}, IVec3{64 + 32}};
  const DensityGrid grid = grid_of(box, oracle::waves(GetParam(), 6.0));
  for (int level = 0; level <= kMaxSmoothLevel; ++level) {
    SCOPED_TRACE(testing::Message() << "seed " << GetParam() << ", level " << level);
    SmoothMeshOptions options;
    options.level_of = [=](IVec3) { return level; };
    oracle::expect_manifold(count_surface(mesh_of(grid, options), true));
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, SplitNoise, testing::Range(1U, static_cast<unsigned>(cases(3, 6))));

TEST(SmoothSheets, LeaveSingleSheetCellsUnchanged) {
  const DensityGrid grid = grid_of({IVec3{-1}, IVec3{66}}, oracle::waves(11, 7.0));
  SmoothMesher mesher;
  SmoothChunkMesh plain;
  SmoothChunkMesh split;
  SmoothOptions options;
  options.split_sheets = false;
  mesher.mesh(grid.neighbourhood(IVec3{0}), options, plain);
  options.split_sheets = true;
  mesher.mesh(grid.neighbourhood(IVec3{0}), options, split);
  ASSERT_GT(split.positions.size(), plain.positions.size());
  ASSERT_EQ(split.indices.size(), plain.indices.size());
  std::map<std::uint32_t, int> sheets;
  for (std::size_t v = plain.cells.size(); v < split.cells.size(); ++v) {
    ++sheets[split.cells[v].bits & ~(3U << SmoothCell::kSheetShift)];
  }
  std::int64_t same = 0;
  for (std::size_t v = 0; v < plain.cells.size(); ++v) {
    ASSERT_EQ(plain.cells[v], split.cells[v]);
    if (sheets.count(plain.cells[v].bits) != 0) continue;
    ++same;
    ASSERT_EQ(std::memcmp(&plain.positions[v], &split.positions[v], sizeof(Vec3)), 0);
    ASSERT_EQ(std::memcmp(&plain.normals[v], &split.normals[v], sizeof(Vec3)), 0);
    ASSERT_EQ(plain.occlusion[v], split.occlusion[v]);
  }
  EXPECT_GT(same, 1000);
}

TEST(SmoothSheets, KeepVerticesInTheirCells) {
  const DensityGrid grid = grid_of({IVec3{2}, IVec3{40}}, oracle::scatter(4));
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  SmoothOptions options;
  options.split_sheets = true;
  mesher.mesh(grid.neighbourhood(IVec3{0}), options, mesh);
  for (std::size_t v = 0; v < mesh.cells.size(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      const float within = mesh.positions[v][axis] - static_cast<float>(mesh.cells[v].cell()[axis]);
      EXPECT_TRUE(within >= 0.0F && within <= 1.0F);
    }
    EXPECT_NEAR(glm::length(mesh.normals[v]), 1.0F, 1e-5F);
  }
}

// Returns the number of samples in a layer below the chunk that change its mesh when their sign flips.
int edits_that_matter(DensityGrid& grid, int z) {
  SmoothMesher mesher;
  SmoothChunkMesh before;
  SmoothChunkMesh after;
  SmoothOptions options;
  options.split_sheets = true;
  options.occlusion.method = SmoothOcclusion::None;
  mesher.mesh(grid.neighbourhood(IVec3{0}), options, before);
  int changed = 0;
  for (int i = 0; i < 20 * 20; ++i) {
    const IVec3 sample{i % 20, i / 20, z};
    const DensitySample old{grid.density(sample), grid.material(sample)};
    grid.set(sample, {-old.density, 1});
    mesher.mesh(grid.neighbourhood(IVec3{0}), options, after);
    changed += before.positions.size() != after.positions.size() ||
               !std::equal(before.indices.begin(), before.indices.end(), after.indices.begin(), after.indices.end()) ||
               std::memcmp(before.positions.data(), after.positions.data(), 12 * before.positions.size()) != 0;
    grid.set(sample, old);
  }
  return changed;
}

// A sheet's vertex depends on the neighbouring cells, one further than the kernel reads.
TEST(SmoothSheets, EditsReachTwoSamplesWithoutOcclusion) {
  const SmoothOcclusionOptions none{SmoothOcclusion::None, 2.0F, 0.4F, 2.0F};
  ASSERT_EQ(reach_of(none), 2);
  DensityGrid grid = grid_of({{-1, -1, -5}, {22, 22, 3}}, oracle::scatter(21));
  EXPECT_GT(edits_that_matter(grid, -2), 0);
  EXPECT_EQ(edits_that_matter(grid, -3), 0);
}

TEST(SheetsDeathTest, AssertsOnMoreThanEightCorners) {
  QUOIN_EXPECT_MISTAKE(static_cast<void>(joined_face(256)), "eight corners");
}

TEST(SheetsDeathTest, RejectsPartOfQuad) {
  SmoothChunkMesh mesh;
  mesh.indices.resize(6);
  QUOIN_EXPECT_MISTAKE(smooth::split_sheets({}, {}, 5, mesh), "whole quads of the mesh");
  QUOIN_EXPECT_MISTAKE(smooth::split_sheets({}, {}, 12, mesh), "whole quads of the mesh");
}

}  // namespace
}  // namespace quoin
