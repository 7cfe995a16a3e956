#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include <quoin/mesh/blocky.h>

#include "core/instruction_sets_for_tests.h"
#include "core/made_with_for_tests.h"
#include "mesh/mesh_oracle.h"

// One mesher meshes many chunks; earlier calls must not affect later results.

namespace quoin {
namespace {

using oracle::FaceSet;

/// The faces of one chunk's voxels inside `region`.
FaceSet expected_faces(const FaceSet& all, IVec3 chunk, const IBox& region) {
  FaceSet faces;
  for (const auto& [key, face] : all) {
    const auto [x, y, z, d] = key;
    const IVec3 voxel{x, y, z};
    if (chunk_of(voxel) == chunk && region.contains(local_of(voxel))) faces[key] = face;
  }
  return faces;
}

FaceSet faces_of(const QuadBuffer& quads, IVec3 chunk) {
  FaceSet faces;
  for (const Quad& quad : quads) oracle::add_quad(quad, chunk * kChunkEdge, faces);
  return faces;
}

/// Types 1 to `count`; every seventh type is transparent if `transparent`.
VoxelRegistry many_types(int count, bool transparent) {
  VoxelRegistry types;
  for (int i = 1; i <= count; ++i) {
    VoxelProperties properties;
    properties.name = std::to_string(i);
    if (transparent && i % 7 == 2) properties.visibility = Visibility::Transparent;
    EXPECT_TRUE(types.add(properties).has_value());
  }
  return types;
}

TEST(MesherReuse, CulledAfterGreedyMergesNothing) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {10, 10, 10}}, 1);
  const VoxelRegistry types = oracle::mixed_types();
  BlockyMesher mesher;
  QuadBuffer quads;
  mesher.mesh(grid.neighbourhood({0, 0, 0}), types, {}, quads);
  EXPECT_EQ(quads.size(), 6U);
  QuadOptions culled;
  culled.merge = false;
  mesher.mesh(grid.neighbourhood({0, 0, 0}), types, culled, quads);
  EXPECT_EQ(quads.size(), 600U);
}

class NeighbourOffset : public testing::TestWithParam<int> {};

// A chunk with a single neighbour at each of the 26 offsets: the neighbour's voxels must hide and darken faces.
TEST_P(NeighbourOffset, HidesAndDarkensFaces) {
  const int i = GetParam();
  const IVec3 offset = Neighbourhood::offset(i);
  const VoxelRegistry types = oracle::mixed_types();
  for (const VoxelType type : {VoxelType{1}, VoxelType{4}}) {
    Grid grid = oracle::random_world(static_cast<unsigned>(i), {IVec3{0}, IVec3{64}}, 5, 0.02);
    grid.edit({IVec3{-2}, IVec3{66}}, [&](IVec3 voxel, VoxelType current) {
      if (chunk_of(voxel) == IVec3{0}) return current;
      const bool is_there = chunk_of(voxel) == offset && (voxel.x * 7 + voxel.y * 3 + voxel.z * 5) % 3 == 0;
      return is_there ? type : kAir;
    });
    const FaceSet expected = expected_faces(oracle::visible_faces(grid, types, true), IVec3{0}, kWholeChunk);
    for (const InstructionSet set : sets_of_this_machine()) {
      const InstructionSetOverride over(set);
      QuadBuffer quads;
      BlockyMesher().mesh(grid.neighbourhood(IVec3{0}), types, {}, quads);
      EXPECT_EQ(faces_of(quads, IVec3{0}), expected);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Offsets, NeighbourOffset, testing::Range(0, 27));

struct LitWorld {
  Grid grid;
  VoxelRegistry types;
  FaceSet lit;
  FaceSet unlit;
};

/// Returns worlds whose chunks have 1 to 16 bits per voxel, with and without transparent types, spanning 27 chunks.
std::vector<LitWorld> worlds_of_all_widths() {
  std::vector<LitWorld> worlds;
  for (const bool transparent : {false, true}) {
    for (const int types : {1, 3, 12, 200, 900}) {
      LitWorld world;
      world.types = many_types(types, transparent);
      const auto seed = static_cast<unsigned>(types * 2 + transparent);
      world.grid = oracle::random_world(seed, {IVec3{-5}, IVec3{69}}, types, 0.01);
      // A solid floor of several types with a hole: the mesher skips such layers.
      world.grid.edit({IVec3{-5}, {69, 20, 69}}, [&](IVec3 v, VoxelType) {
        const auto type = static_cast<VoxelType>(1 + (v.x / 4 + v.z / 8 + 40) % std::min(types, 8));
        return v == IVec3{30, 9, 63} || world.types.is_transparent(type) ? kAir : type;
      });
      world.lit = oracle::visible_faces(world.grid, world.types, true);
      world.unlit = oracle::visible_faces(world.grid, world.types, false);
      worlds.push_back(std::move(world));
    }
  }
  return worlds;
}

QuadOptions random_options(std::mt19937& random) {
  const auto corner = [&] {
    const auto pick = random() % 4;
    return pick == 0 ? 0 : pick == 1 ? 64 : static_cast<int>(random() % 65);
  };
  const IVec3 a{corner(), corner(), corner()};
  const IVec3 b{corner(), corner(), corner()};
  QuadOptions options;
  if (random() % 3 != 0) options.region = {glm::min(a, b), glm::max(a, b)};
  options.merge = random() % 3 != 0;
  options.bake_occlusion = random() % 3 != 0;
  return options;
}

class MesherReuse : public testing::TestWithParam<InstructionSet> {};

// Compares the plain kernel with the oracle, and the other kernels, in the same sequence, with the plain kernel.
TEST_P(MesherReuse, MatchesOracleOverRandomSequences) {
  QUOIN_SKIP_WITHOUT(GetParam());
  const std::vector<LitWorld> worlds = worlds_of_all_widths();
  std::mt19937 random(11);
  BlockyMesher mesher = made_with<BlockyMesher>(GetParam());
  BlockyMesher plain = made_with<BlockyMesher>(InstructionSet::Plain);
  QuadBuffer quads;
  QuadBuffer plain_quads;
  FaceRows rows;
  for (int round = 0; round < 300; ++round) {
    const LitWorld& world = worlds[random() % worlds.size()];
    const auto near = [&] { return static_cast<int>(random() % 3) - 1; };
    const IVec3 chunk = random() % 2 == 0 ? IVec3{0} : IVec3{near(), near(), near()};
    const QuadOptions options = random_options(random);
    const Neighbourhood n = world.grid.neighbourhood(chunk);
    plain.mesh(n, world.types, options, plain_quads);
    mesher.mesh(n, world.types, options, quads);
    ASSERT_EQ(quads, plain_quads) << "round " << round;
    const bool with_rows = random() % 3 == 0;
    std::int64_t count = 0;
    std::int64_t all = 0;
    if (GetParam() == InstructionSet::Plain) {
      const FaceSet expected = expected_faces(options.bake_occlusion ? world.lit : world.unlit, chunk, options.region);
      ASSERT_EQ(faces_of(plain_quads, chunk), expected) << "round " << round;
      if (!options.merge) {
        ASSERT_EQ(plain_quads.size(), expected.size()) << "round " << round;
      }
      count = static_cast<std::int64_t>(expected.size());
      if (with_rows) all = static_cast<std::int64_t>(expected_faces(world.unlit, chunk, kWholeChunk).size());
    } else if (with_rows) {
      plain.find_faces(n, world.types, options.region, rows);
      count = rows.count();
      all = plain.count_faces(n, world.types);
    }
    if (!with_rows) continue;
    mesher.find_faces(n, world.types, options.region, rows);
    ASSERT_EQ(rows.count(), count) << "round " << round;
    ASSERT_EQ(mesher.count_faces(n, world.types), all) << "round " << round;
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, MesherReuse,
                         testing::Values(InstructionSet::Plain, InstructionSet::Avx2, InstructionSet::Avx512Bytes),
                         name_of_set);

}  // namespace
}  // namespace quoin
