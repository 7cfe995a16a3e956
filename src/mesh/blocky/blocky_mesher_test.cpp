#include <quoin/mesh/blocky.h>

#include <ostream>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "bench/workloads.h"
#include "core/death_for_tests.h"
#include "core/instruction_sets_for_tests.h"
#include "core/made_with_for_tests.h"
#include "grid/change_follower_for_tests.h"
#include "mesh/mesh_oracle.h"

namespace quoin {
namespace {

using oracle::FaceSet;

FaceSet faces_of_quads(const Grid& grid, const VoxelRegistry& types, const QuadOptions& options,
                       std::int64_t* count = nullptr) {
  BlockyMesher mesher;
  QuadBuffer quads;
  FaceSet faces;
  for (const IVec3 chunk : grid.chunks()) {
    mesher.mesh(grid.neighbourhood(chunk), types, options, quads);
    const std::size_t before = faces.size();
    for (const Quad& quad : quads) oracle::add_quad(quad, chunk * kChunkEdge, faces);
    EXPECT_EQ(face_count(quads), static_cast<std::int64_t>(faces.size() - before));
    if (count != nullptr) *count += static_cast<std::int64_t>(quads.size());
  }
  return faces;
}

int quad_count(const Chunk& chunk, Direction direction, bool occlusion = true) {
  QuadOptions options;
  options.bake_occlusion = occlusion;
  QuadBuffer quads;
  BlockyMesher().mesh(isolated(chunk), oracle::mixed_types(), options, quads);
  int count = 0;
  for (const Quad& quad : quads) count += quad.direction() == direction;
  return count;
}

std::int64_t faces_shown(const Neighbourhood& chunks) {
  QuadBuffer quads;
  BlockyMesher().mesh(chunks, oracle::mixed_types(), {}, quads);
  return face_count(quads);
}

Chunk box_chunk(const IBox& box, VoxelType type = 1) {
  Chunk chunk;
  chunk.fill_box(box, type, [](int, int, std::uint64_t) {});
  return chunk;
}

TEST(BlockyMesher, EmptyChunkHasNoQuads) {
  QuadBuffer quads(5);
  BlockyMesher().mesh(isolated(Chunk()), oracle::mixed_types(), {}, quads);
  EXPECT_TRUE(quads.empty());
  BlockyMesher().mesh(Neighbourhood{}, oracle::mixed_types(), {}, quads);
  EXPECT_TRUE(quads.empty());
}

TEST(BlockyMesher, SingleVoxelHasSixQuads) {
  QuadBuffer quads;
  BlockyMesher().mesh(isolated(box_chunk({{5, 6, 7}, {6, 7, 8}})), oracle::mixed_types(), {}, quads);
  EXPECT_EQ(quads.size(), 6U);
  for (const Quad& quad : quads) EXPECT_EQ(quad.voxel(), IVec3(5, 6, 7));
}

TEST(BlockyMesher, SolidCubeHasSixQuads) {
  QuadBuffer quads;
  BlockyMesher().mesh(isolated(box_chunk({{0, 0, 0}, {32, 32, 32}})), oracle::mixed_types(), {}, quads);
  EXPECT_EQ(quads.size(), 6U);
  BlockyMesher().mesh(isolated(Chunk(1)), oracle::mixed_types(), {}, quads);
  EXPECT_EQ(quads.size(), 6U);
  EXPECT_EQ(quads[0].size_u(), 64);
}

TEST(BlockyMesher, SlabTopIsOneQuad) {
  EXPECT_EQ(quad_count(box_chunk({{0, 4, 0}, {32, 5, 32}}), Direction::PosY), 1);
}

TEST(BlockyMesher, CheckerboardLayerTopHas512Quads) {
  Chunk chunk;
  for (int z = 0; z < 32; ++z) {
    for (int x = z & 1; x < 32; x += 2) chunk.set(x, 4, z, 1);
  }
  EXPECT_EQ(quad_count(chunk, Direction::PosY), 512);
}

TEST(BlockyMesher, CheckerboardOfTwoTypesTopHas1024Quads) {
  Chunk chunk;
  for (int z = 0; z < 32; ++z) {
    for (int x = 0; x < 32; ++x) chunk.set(x, 4, z, static_cast<VoxelType>(1 + ((x ^ z) & 1)));
  }
  EXPECT_EQ(quad_count(chunk, Direction::PosY), 1'024);
}

TEST(BlockyMesher, SplitsFloorAlongFootOfWall) {
  Chunk chunk = box_chunk({{0, 0, 0}, {16, 1, 16}});
  chunk.fill_box({{0, 1, 8}, {16, 4, 9}}, 1, [](int, int, std::uint64_t) {});
  // On either side: the floor away from the wall, the row at its foot, and the two ends of that row, where the end of
  // the wall leaves one corner lighter. In addition the top of the wall.
  EXPECT_EQ(quad_count(chunk, Direction::PosY), 4 + 4 + 1);
  EXPECT_EQ(quad_count(chunk, Direction::PosY, false), 3);
}

TEST(BlockyMesher, TerrainHasSpecifiedFacesAndQuads) {
  const VoxelRegistry types = workloads::glass_types();
  QuadOptions options;
  options.region = workloads::kInterior;
  QuadBuffer quads;
  BlockyMesher mesher;
  using workloads::Blocky;
  for (const Blocky which : {Blocky::W1, Blocky::W2, Blocky::W3a, Blocky::W3b, Blocky::W3c, Blocky::W4, Blocky::Glass,
                             Blocky::GlassColumns}) {
    const Chunk chunk = workloads::blocky_chunk(which);
    mesher.mesh(isolated(chunk), types, options, quads);
    EXPECT_EQ(face_count(quads), workloads::expected_faces(which));
    if (which != Blocky::W1) continue;
    EXPECT_NEAR(static_cast<double>(quads.size()), 8'450.0, 50.0);
    options.bake_occlusion = false;
    mesher.mesh(isolated(chunk), types, options, quads);
    EXPECT_NEAR(static_cast<double>(quads.size()), 5'750.0, 50.0);
    options.bake_occlusion = true;
  }
}

TEST(BlockyMesher, UniformBuriedChunkShowsOnlyVisibleFaces) {
  const Chunk full(1);
  Neighbourhood n;
  n.chunks.fill(&full);
  EXPECT_EQ(faces_shown(n), 0);
  const Chunk glass(4);
  n.chunks[13] = &glass;
  EXPECT_EQ(faces_shown(n), 0);
  n.chunks.fill(&glass);
  EXPECT_EQ(faces_shown(n), 0);
  n.chunks[13] = &full;
  EXPECT_EQ(faces_shown(n), 6 * 64 * 64);
}

struct World {
  unsigned seed;
  int types;  // 3: opaque only, 5: with transparent ones
  double density;
};

// Prints a name for the test; gtest would print the bytes, including padding. CTest reads no times of names with
// spaces.
void PrintTo(const World& world, std::ostream* out) {
  *out << "seed=" << world.seed << ",types=" << world.types << ",density=" << world.density;
}

// Spans a corner where eight chunks meet.
Grid grid_of(const World& w, IVec3 shift = IVec3{0}) {
  return oracle::random_world(w.seed, {IVec3{-20, -13, -17} + shift, IVec3{15, 22, 18} + shift}, w.types, w.density);
}

class RandomWorld : public testing::TestWithParam<World> {
 protected:
  Grid world(IVec3 shift = IVec3{0}) const { return grid_of(GetParam(), shift); }
};

TEST_P(RandomWorld, QuadsCoverEachVisibleFaceOnce) {
  const Grid grid = world();
  for (const VoxelRegistry& types : {oracle::mixed_types(), oracle::unoccluding_types()})
    for (const bool occlusion : {true, false}) {
      const FaceSet expected = oracle::visible_faces(grid, types, occlusion);
      for (const bool merge : {true, false}) {
        QuadOptions options;
        options.merge = merge;
        options.bake_occlusion = occlusion;
        std::int64_t quads = 0;
        EXPECT_EQ(faces_of_quads(grid, types, options, &quads), expected);
        if (!merge) {
          EXPECT_EQ(quads, static_cast<std::int64_t>(expected.size()));
        }
      }
    }
}

TEST_P(RandomWorld, ChunkedFacesMatchSingleChunk) {
  const VoxelRegistry types = oracle::unoccluding_types();
  const IVec3 shift{30, 30, 30};  // the whole world in one chunk
  const FaceSet cut = faces_of_quads(world(), types, {});
  const Grid whole_grid = world(shift);
  ASSERT_EQ(whole_grid.chunk_count(), 1U);
  FaceSet moved;
  for (const auto& [key, face] : faces_of_quads(whole_grid, types, {})) {
    const auto [x, y, z, d] = key;
    moved[{x - shift.x, y - shift.y, z - shift.z, d}] = face;
  }
  EXPECT_EQ(cut, moved);
}

TEST_P(RandomWorld, VisibleFacesMatchOracle) {
  const VoxelRegistry types = oracle::mixed_types();
  const Grid grid = world();
  const FaceSet expected = oracle::visible_faces(grid, types, false);
  std::size_t found = 0;
  for (const IVec3 chunk : grid.chunks()) {
    std::vector<DirectionSet> faces;
    const IBox region = {{3, 0, 40}, {64, 64, 64}};
    visible_faces(grid.neighbourhood(chunk), types, region, faces);
    std::size_t next = 0;
    for (int z = region.min.z; z < region.max.z; ++z) {
      for (int y = region.min.y; y < region.max.y; ++y) {
        for (int x = region.min.x; x < region.max.x; ++x, ++next) {
          const IVec3 at = chunk * kChunkEdge + IVec3{x, y, z};
          for (const Direction d : kDirections) {
            ASSERT_EQ(faces[next].contains(d), expected.contains({at.x, at.y, at.z, static_cast<int>(d)}));
          }
          found += static_cast<std::size_t>(faces[next].size());
        }
      }
    }
  }
  if (!expected.empty() && GetParam().density > 0.1) {
    EXPECT_GT(found, 0U);
  }
}

constexpr World kWorlds[] = {World{1, 1, 0.0},  World{2, 1, 0.02}, World{3, 1, 0.5},  World{4, 3, 0.0},
                             World{5, 3, 0.01}, World{6, 3, 0.3},  World{7, 5, 0.0},  World{8, 5, 0.01},
                             World{9, 5, 0.1},  World{10, 5, 0.7}, World{11, 5, 0.0}, World{12, 4, 0.05}};
INSTANTIATE_TEST_SUITE_P(Seeds, RandomWorld, testing::ValuesIn(kWorlds));

class BlockyMesherKernels : public testing::TestWithParam<InstructionSet> {};

TEST_P(BlockyMesherKernels, MatchPlainKernel) {
  QUOIN_SKIP_WITHOUT(GetParam());
  const std::array<VoxelRegistry, 2> registries{oracle::mixed_types(), oracle::unoccluding_types()};
  BlockyMesher mesher = made_with<BlockyMesher>(GetParam());
  BlockyMesher plain = made_with<BlockyMesher>(InstructionSet::Plain);
  QuadBuffer quads;
  QuadBuffer plain_quads;
  for (const World& world : kWorlds) {
    const Grid grid = grid_of(world);
    for (const IVec3 chunk : grid.chunks()) {
      for (const std::size_t kind : {0, 1, 2}) {
        QuadOptions options;
        options.bake_occlusion = kind > 0;
        plain.mesh(grid.neighbourhood(chunk), registries[kind / 2], options, plain_quads);
        mesher.mesh(grid.neighbourhood(chunk), registries[kind / 2], options, quads);
        EXPECT_EQ(quads, plain_quads);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, BlockyMesherKernels,
                         testing::Values(InstructionSet::Avx2, InstructionSet::Avx512Bytes), name_of_set);

// Wide palettes reach the same masks by other code paths.
class ManyTypes : public testing::TestWithParam<int> {};

TEST_P(ManyTypes, MatchOracle) {
  VoxelRegistry types;
  for (int i = 0; i < GetParam(); ++i) {
    VoxelProperties properties;
    properties.name = std::to_string(i);
    if (i % 7 == 3) properties.visibility = Visibility::Transparent;
    if (GetParam() % 2 == 1 || i % 7 == 5) properties.occludes = false;
    if (i % 7 == 1) properties.occludes.reset();
    ASSERT_TRUE(types.add(properties).has_value());
  }
  Grid grid = oracle::random_world(99, {IVec3{-10, -10, -10}, IVec3{14, 14, 14}}, GetParam(), 0.4);
  const FaceSet expected = oracle::visible_faces(grid, types, true);
  for (const InstructionSet set : sets_of_this_machine()) {
    const InstructionSetOverride over(set);
    EXPECT_EQ(faces_of_quads(grid, types, {}), expected);
  }
  grid.compact();
  EXPECT_EQ(faces_of_quads(grid, types, {}), expected);
}

INSTANTIATE_TEST_SUITE_P(Counts, ManyTypes, testing::Values(3, 12, 13, 40, 250, 251, 1'000, 1'001));

// A pillar on a floor splits the floor where it darkens it. The faces are the same, and hidden ones stay hidden.
TEST(BlockyMesher, OnlyOccludersDarkenAndSplitFloor) {
  const VoxelRegistry types = oracle::unoccluding_types();
  const auto floor_quads = [&](VoxelType pillar, int& darkened) {
    Grid grid;
    grid.fill_box({{0, 0, 0}, {16, 1, 16}}, 1);
    grid.set({8, 1, 8}, pillar);
    QuadBuffer quads;
    BlockyMesher().mesh(grid.neighbourhood({0, 0, 0}), types, {}, quads);
    EXPECT_EQ(face_count(quads), 16 * 16 * 2 + 4 * 16 + 4) << "no face below the pillar";
    darkened = 0;
    for (const Quad& quad : quads) {
      const bool is_floor = quad.direction() == Direction::PosY && quad.voxel().y == 0;
      darkened += is_floor && quad.occlusion() != FaceOcclusion{} ? 1 : 0;
    }
    return quads.size();
  };
  int darkened = 0;
  const std::size_t open = floor_quads(2, darkened);
  EXPECT_EQ(darkened, 0);
  EXPECT_GT(floor_quads(3, darkened), open);
  EXPECT_GT(darkened, 0);
}

TEST(BlockyMesher, EmitsOnlyVoxelsOfRegion) {
  const VoxelRegistry types = oracle::mixed_types();
  const Grid grid = oracle::random_world(21, {IVec3{0}, IVec3{64}}, 5, 0.05);
  std::mt19937 random(5);
  for (int i = 0; i < 30; ++i) {
    const auto corner = [&] { return static_cast<int>(random() % 65); };
    const IVec3 a{corner(), corner(), corner()};
    const IVec3 b{corner(), corner(), corner()};
    QuadOptions options;
    options.region = {glm::min(a, b), glm::max(a, b)};
    FaceSet expected;
    for (const auto& [key, face] : oracle::visible_faces(grid, types, true)) {
      const auto [x, y, z, d] = key;
      if (options.region.contains({x, y, z})) expected[key] = face;
    }
    EXPECT_EQ(faces_of_quads(grid, types, options), expected);
  }
}

TEST(BlockyMesher, EditsReportExactlyTheChunksWithChangedQuads) {
  const VoxelRegistry types = oracle::mixed_types();
  std::mt19937 random(17);
  Grid grid = oracle::random_world(31, {IVec3{-70, -70, -70}, IVec3{70, 70, 70}}, 5, 0.01);
  BlockyMesher mesher;
  const auto mesh_all = [&] {
    std::map<std::tuple<int, int, int>, QuadBuffer> all;
    for (const IVec3 c : grid.chunks()) mesher.mesh(grid.neighbourhood(c), types, {}, all[{c.x, c.y, c.z}]);
    return all;
  };
  auto before = mesh_all();
  ChangeFollower follower(grid);
  int dirty_count = 0;
  for (int i = 0; i < 40; ++i) {
    const auto border = [&] { return static_cast<int>(random() % 2) * 64 - static_cast<int>(random() % 3); };
    const IVec3 at{border(), border(), border()};
    const auto type = static_cast<VoxelType>(random() % 6);
    if (i % 4 == 0) {
      grid.fill_sphere(DVec3(at), 3.0, type);
    } else {
      grid.set(at, type);
    }
    auto after = mesh_all();
    std::set<std::tuple<int, int, int>> dirty;
    for (const IVec3 c : follower.take(grid)) dirty.insert({c.x, c.y, c.z});
    dirty_count += static_cast<int>(dirty.size());
    for (const auto& [key, quads] : after) {
      if (quads != before[key]) {
        EXPECT_TRUE(dirty.count(key) == 1) << "a chunk changed and was not dirty";
      }
    }
    for (const auto& [key, quads] : before) {
      if (after.count(key) == 0) {
        EXPECT_TRUE(dirty.count(key) == 1) << "a chunk went and was not dirty";
      }
    }
    before = std::move(after);
  }
  EXPECT_GT(dirty_count, 100);
}

TEST(QuadDeathTest, AssertsOnInvalidCorner) {
  const Quad quad;
  QUOIN_EXPECT_MISTAKE((void)quad.corner(4), "0 <= index < 4");
  QUOIN_EXPECT_MISTAKE((void)quad.occlusion(-1), "0 <= corner < 4");
}

}  // namespace
}  // namespace quoin
