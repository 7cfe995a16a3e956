#include <quoin/mesh/occlusion.h>

#include <vector>

#include <gtest/gtest.h>

#include <quoin/mesh/visible_faces.h>

#include "core/death_for_tests.h"
#include "mesh/blocky/blocky_mesher.h"
#include "mesh/mesh_oracle.h"

namespace quoin {
namespace {

constexpr VoxelType kStone = 1;
constexpr VoxelType kGlass = 4;
constexpr VoxelType kOtherGlass = 5;
constexpr IBox kCube32 = {IVec3{0}, IVec3{32}};

DirectionSet faces_of(const Grid& grid, IVec3 voxel) {
  std::vector<DirectionSet> faces;
  const IVec3 local = local_of(voxel);
  const VoxelRegistry types = oracle::mixed_types();
  visible_faces(grid.neighbourhood(chunk_of(voxel)), types, {local, local + 1}, faces);
  EXPECT_EQ(visible_faces(grid.neighbourhood(chunk_of(voxel)), types, local), faces.at(0));
  return faces.at(0);
}

DirectionSet all_but(Direction direction) {
  DirectionSet faces = DirectionSet::all();
  faces.erase(direction);
  return faces;
}

int face_count(const Grid& grid, IVec3 voxel) {
  return faces_of(grid, voxel).size();
}

TEST(VisibleFaces, SingleVoxelShowsSixFaces) {
  Grid grid;
  grid.set({10, 10, 10}, kStone);
  EXPECT_EQ(faces_of(grid, {10, 10, 10}), DirectionSet::all());
  EXPECT_EQ(faces_of(grid, {10, 10, 11}), DirectionSet()) << "air has none";
}

TEST(VisibleFaces, NeighboursHideSharedFace) {
  Grid grid;
  grid.set({10, 10, 10}, kStone);
  grid.set({11, 10, 10}, kStone);
  EXPECT_EQ(faces_of(grid, {10, 10, 10}), all_but(Direction::PosX));
  EXPECT_EQ(faces_of(grid, {11, 10, 10}), all_but(Direction::NegX));
}

TEST(VisibleFaces, StoneHidesGlassButGlassShowsStone) {
  Grid grid;
  grid.set({10, 10, 10}, kStone);
  grid.set({11, 10, 10}, kGlass);
  EXPECT_EQ(face_count(grid, {10, 10, 10}), 6);
  EXPECT_EQ(face_count(grid, {11, 10, 10}), 5);
}

TEST(VisibleFaces, GlassOfOneTypeHidesItsSharedFaces) {
  Grid grid;
  grid.set({10, 10, 10}, kGlass);
  grid.set({11, 10, 10}, kGlass);
  EXPECT_EQ(face_count(grid, {10, 10, 10}), 5);
  EXPECT_EQ(face_count(grid, {11, 10, 10}), 5);
}

TEST(VisibleFaces, GlassOfTwoTypesShowsBothFaces) {
  Grid grid;
  grid.set({10, 10, 10}, kGlass);
  grid.set({11, 10, 10}, kOtherGlass);
  EXPECT_EQ(face_count(grid, {10, 10, 10}), 6);
  EXPECT_EQ(face_count(grid, {11, 10, 10}), 6);
}

TEST(VisibleFaces, NeighbourChunkHidesFaces) {
  Grid grid;
  grid.set({0, 10, 10}, kStone);
  grid.set({-1, 10, 10}, kStone);
  EXPECT_EQ(faces_of(grid, {0, 10, 10}), all_but(Direction::NegX));
  EXPECT_EQ(faces_of(grid, {-1, 10, 10}), all_but(Direction::PosX));
}

TEST(VisibleFaces, FullRegionAloneShowsItsShell) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {32, 32, 32}}, kStone);
  std::vector<DirectionSet> faces;
  visible_faces(grid.neighbourhood({0, 0, 0}), oracle::mixed_types(), kCube32, faces);
  int visible = 0;
  for (const DirectionSet set : faces) visible += set.size();
  EXPECT_EQ(visible, 6'144);
  EXPECT_EQ(faces.size() * 6, 196'608U);
}

TEST(VisibleFaces, FullRegionInsideFullNeighboursShowsNothing) {
  Grid grid;
  grid.fill_box({{-64, -64, -64}, {128, 128, 128}}, kStone);
  std::vector<DirectionSet> faces;
  visible_faces(grid.neighbourhood({0, 0, 0}), oracle::mixed_types(), kCube32, faces);
  EXPECT_EQ(faces, std::vector<DirectionSet>(32 * 32 * 32));
}

TEST(VisibleFaces, EmptyChunkShowsNothing) {
  std::vector<DirectionSet> faces;
  visible_faces(Neighbourhood{}, oracle::mixed_types(), kCube32, faces);
  EXPECT_EQ(faces, std::vector<DirectionSet>(32 * 32 * 32));
}

TEST(VertexOcclusion, CountsNeighboursAndIsThreeBetweenSides) {
  EXPECT_EQ(vertex_occlusion(false, false, false), 0);
  EXPECT_EQ(vertex_occlusion(false, false, true), 1);
  EXPECT_EQ(vertex_occlusion(true, false, false), 1);
  EXPECT_EQ(vertex_occlusion(false, true, false), 1);
  EXPECT_EQ(vertex_occlusion(true, false, true), 2);
  EXPECT_EQ(vertex_occlusion(false, true, true), 2);
  EXPECT_EQ(vertex_occlusion(true, true, false), 3);
  EXPECT_EQ(vertex_occlusion(true, true, true), 3);
}

TEST(VertexOcclusion, BrightnessFallsByQuarters) {
  EXPECT_EQ(occlusion_brightness(0), 1.0F);
  EXPECT_EQ(occlusion_brightness(1), 0.75F);
  EXPECT_EQ(occlusion_brightness(2), 0.5F);
  EXPECT_EQ(occlusion_brightness(3), 0.25F);
}

TEST(FaceOcclusion, WallDarkensFloorAtFoot) {
  Grid grid;
  grid.set({5, 0, 5}, kStone);
  grid.set({5, 1, 6}, kStone);
  const FaceOcclusion corners =
      face_occlusion(grid.neighbourhood({0, 0, 0}), oracle::mixed_types(), {5, 0, 5}, Direction::PosY);
  // +Y has u = z, v = x: corners 1 and 2 lie towards z = 6.
  EXPECT_EQ(corners, (FaceOcclusion{0, 1, 1, 0}));
}

TEST(FaceOcclusion, GlassDoesNotDarken) {
  Grid grid;
  grid.set({5, 0, 5}, kStone);
  grid.set({5, 1, 6}, kGlass);
  const FaceOcclusion corners =
      face_occlusion(grid.neighbourhood({0, 0, 0}), oracle::mixed_types(), {5, 0, 5}, Direction::PosY);
  EXPECT_EQ(corners, FaceOcclusion{});
}

TEST(FaceOcclusion, MatchesOracleAcrossChunkCorners) {
  const VoxelRegistry types = oracle::unoccluding_types();
  const Grid grid = oracle::random_world(3, {IVec3{-4}, IVec3{4}}, 5, 0.6);
  grid.for_each([&](IVec3 v, VoxelType) {
    for (const Direction d : kDirections) {
      EXPECT_EQ(face_occlusion(grid.neighbourhood(chunk_of(v)), types, local_of(v), d),
                oracle::corners_of_face(grid, types, v, d));
    }
  });
}

TEST(FaceOcclusion, MatchesTableOfCornerNeighbours) {
  const VoxelRegistry types = oracle::mixed_types();
  const Grid grid = oracle::random_world(5, {IVec3{-4}, IVec3{4}}, 5, 0.6);
  const auto is_opaque = [&](IVec3 at) { return types.is_opaque(grid.get(at)); };
  grid.for_each([&](IVec3 v, VoxelType) {
    for (const Direction d : kDirections) {
      FaceOcclusion corners{};
      for (std::size_t i = 0; i < 4; ++i) {
        const CornerNeighbours& at = kCornerNeighbours[static_cast<std::size_t>(d)][i];
        corners[i] = vertex_occlusion(is_opaque(v + at.side1), is_opaque(v + at.side2), is_opaque(v + at.corner));
      }
      EXPECT_EQ(corners, oracle::corners_of_face(grid, types, v, d));
    }
  });
}

TEST(FaceOcclusion, TableListsVoxelsInFrontOfCorner) {
  for (const Direction d : kDirections) {
    const FaceFrame& frame = frame_of(d);
    for (std::size_t i = 0; i < 4; ++i) {
      // Twice the corner's position, relative to the voxel's centre: integers.
      IVec3 corner = normal_of(d);
      corner[frame.u] = i == 1 || i == 2 ? 1 : -1;
      corner[frame.v] = i >= 2 ? 1 : -1;
      const CornerNeighbours& at = kCornerNeighbours[static_cast<std::size_t>(d)][i];
      for (const IVec3 offset : {at.side1, at.side2, at.corner}) {
        EXPECT_EQ(offset[frame.axis], frame.sign);
        EXPECT_EQ(glm::abs(2 * offset - corner), IVec3(1)) << name_of(d) << " corner " << i;
      }
      EXPECT_EQ(at.side1 + at.side2 - normal_of(d), at.corner);
      EXPECT_EQ(at.side1[frame.v], 0);
      EXPECT_EQ(at.side2[frame.u], 0);
    }
  }
}

TEST(Diagonal, ConnectsBrighterCorners) {
  EXPECT_FALSE(flips_diagonal({0, 0, 0, 0}));
  EXPECT_FALSE(flips_diagonal({2, 2, 2, 2}));
  EXPECT_TRUE(flips_diagonal({3, 0, 3, 0}));
  EXPECT_FALSE(flips_diagonal({0, 3, 0, 3}));
  EXPECT_FALSE(flips_diagonal({0, 1, 1, 1}));
}

TEST(OcclusionDeathTest, RejectsBrightnessOfUnknownOcclusion) {
  QUOIN_EXPECT_MISTAKE((void)occlusion_brightness(4), "0 <= occlusion <= 3");
}

}  // namespace
}  // namespace quoin
