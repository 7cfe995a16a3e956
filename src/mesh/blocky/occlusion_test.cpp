#include <quoin/mesh/occlusion.h>

#include <bit>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/mesh/visible_faces.h>

#include "mesh/mesh_oracle.h"

namespace quoin {
namespace {

constexpr VoxelType kStone = 1;
constexpr VoxelType kGlass = 4;
constexpr VoxelType kOtherGlass = 5;
constexpr IBox kCube32 = {IVec3{0}, IVec3{32}};

std::uint8_t face_bits(const Grid& grid, IVec3 voxel) {
  std::vector<std::uint8_t> faces;
  const IVec3 local = local_of(voxel);
  visible_faces(grid.neighbourhood(chunk_of(voxel)), oracle::mixed_types(), {local, local + 1}, faces);
  return faces.at(0);
}

int face_count(const Grid& grid, IVec3 voxel) {
  return std::popcount(face_bits(grid, voxel));
}

TEST(VisibleFaces, OneVoxelShowsAllSix) {
  Grid grid;
  grid.set({10, 10, 10}, kStone);
  EXPECT_EQ(face_bits(grid, {10, 10, 10}), 0b111111);
}

TEST(VisibleFaces, NeighboursHideTheFaceBetweenThem) {
  Grid grid;
  grid.set({10, 10, 10}, kStone);
  grid.set({11, 10, 10}, kStone);
  EXPECT_EQ(face_bits(grid, {10, 10, 10}), 0b111110);
  EXPECT_EQ(face_bits(grid, {11, 10, 10}), 0b111101);
}

TEST(VisibleFaces, StoneShowsBehindGlassAndGlassNotBehindStone) {
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

TEST(VisibleFaces, TwoKindsOfGlassShowBoth) {
  Grid grid;
  grid.set({10, 10, 10}, kGlass);
  grid.set({11, 10, 10}, kOtherGlass);
  EXPECT_EQ(face_count(grid, {10, 10, 10}), 6);
  EXPECT_EQ(face_count(grid, {11, 10, 10}), 6);
}

TEST(VisibleFaces, ANeighbourChunkHidesFacesToo) {
  Grid grid;
  grid.set({0, 10, 10}, kStone);
  grid.set({-1, 10, 10}, kStone);
  EXPECT_EQ(face_bits(grid, {0, 10, 10}), 0b111101);
  EXPECT_EQ(face_bits(grid, {-1, 10, 10}), 0b111110);
}

TEST(VisibleFaces, FullRegionAloneShowsItsShell) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {32, 32, 32}}, kStone);
  std::vector<std::uint8_t> faces;
  visible_faces(grid.neighbourhood({0, 0, 0}), oracle::mixed_types(), kCube32, faces);
  int visible = 0;
  for (const std::uint8_t mask : faces) visible += std::popcount(mask);
  EXPECT_EQ(visible, 6'144);
  EXPECT_EQ(faces.size() * 6, 196'608U);
}

TEST(VisibleFaces, FullRegionInsideFullNeighboursShowsNothing) {
  Grid grid;
  grid.fill_box({{-64, -64, -64}, {128, 128, 128}}, kStone);
  std::vector<std::uint8_t> faces;
  visible_faces(grid.neighbourhood({0, 0, 0}), oracle::mixed_types(), kCube32, faces);
  EXPECT_EQ(faces, std::vector<std::uint8_t>(32 * 32 * 32, 0));
}

TEST(VisibleFaces, EmptyChunkShowsNothing) {
  std::vector<std::uint8_t> faces;
  visible_faces(Neighbourhood{}, oracle::mixed_types(), kCube32, faces);
  EXPECT_EQ(faces, std::vector<std::uint8_t>(32 * 32 * 32, 0));
}

TEST(VertexOcclusion, IsThreeBetweenTwoSidesAndACountOtherwise) {
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

TEST(FaceOcclusion, AWallDarkensTheFloorAtItsFoot) {
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

TEST(FaceOcclusion, AgreesWithTheOracleAcrossChunkCorners) {
  const VoxelRegistry types = oracle::mixed_types();
  const Grid grid = oracle::random_world(3, {IVec3{-4}, IVec3{4}}, 5, 0.6);
  grid.for_each([&](IVec3 v, VoxelType) {
    for (const Direction d : kDirections) {
      EXPECT_EQ(face_occlusion(grid.neighbourhood(chunk_of(v)), types, local_of(v), d),
                oracle::corners_of_face(grid, types, v, d));
    }
  });
}

TEST(Diagonal, KeepsTheBrighterOne) {
  EXPECT_FALSE(flips_diagonal({0, 0, 0, 0}));
  EXPECT_FALSE(flips_diagonal({2, 2, 2, 2}));
  EXPECT_TRUE(flips_diagonal({3, 0, 3, 0}));
  EXPECT_FALSE(flips_diagonal({0, 3, 0, 3}));
  EXPECT_FALSE(flips_diagonal({0, 1, 1, 1}));
}

}  // namespace
}  // namespace quoin
