#include <quoin/grid/copy_box.h>

#include <limits>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

namespace quoin {
namespace {

constexpr int kWorldEdge = std::numeric_limits<int>::max() / kChunkEdge * kChunkEdge;

// Returns the target of a voxel of the box, by definition.
IVec3 target_of(IVec3 voxel, const IBox& box, IVec3 to_min, AxisOrientation orientation) {
  const IVec3 turned = orientation.apply(voxel - box.min);
  const IVec3 far = orientation.apply(box.size() - 1);
  return to_min + turned - glm::min(far, IVec3(0));
}

// Copies voxel by voxel; reads all of them before it writes.
std::int64_t plain_copy(const Grid& from, const IBox& box, Grid& to, IVec3 to_min, AxisOrientation orientation,
                        const CopyOptions& options) {
  std::vector<std::pair<IVec3, VoxelType>> voxels;
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      for (int x = box.min.x; x < box.max.x; ++x) {
        VoxelType type = from.get(x, y, z);
        if (type != kAir && type < options.type_map.size()) type = options.type_map[type];
        if (type != kAir || options.copy_air) voxels.emplace_back(target_of({x, y, z}, box, to_min, orientation), type);
      }
    }
  }
  std::int64_t changed = 0;
  for (const auto& [voxel, type] : voxels) changed += std::int64_t{to.set(voxel, type)};
  return changed;
}

void expect_equal(const Grid& found, const Grid& expected) {
  ASSERT_EQ(found.chunks(), expected.chunks());
  for (const IVec3 chunk : expected.chunks()) ASSERT_TRUE(*found.find_chunk(chunk) == *expected.find_chunk(chunk));
}

struct RandomBoxes {
  std::mt19937 engine;
  explicit RandomBoxes(unsigned seed) : engine(seed) {}
  int below(int limit) { return static_cast<int>(engine() % static_cast<unsigned>(limit)); }
  IVec3 place(int reach) { return {below(2 * reach) - reach, below(2 * reach) - reach, below(2 * reach) - reach}; }
  // Returns a grid of boxes, single voxels and uniform chunks.
  Grid grid() {
    Grid made;
    const int types = 1 + below(300);
    for (int i = 0; i < 6; ++i) {
      const IVec3 first = place(100);
      made.fill_box({first, first + IVec3(below(90), below(90), below(90)) + 1}, static_cast<VoxelType>(below(types)));
    }
    const IVec3 chunk = place(2);
    made.fill_box({chunk * kChunkEdge, (chunk + IVec3(2, 1, 1)) * kChunkEdge}, 9);
    for (int i = 0; i < 400; ++i) made.set(place(90), static_cast<VoxelType>(below(types)));
    return made;
  }
  IBox box() {
    const IVec3 first = place(100);
    return {first, first + 1 + IVec3(below(100), below(100), below(100))};
  }
  AxisOrientation orientation() { return AxisOrientation::at(below(AxisOrientation::kCount)); }
};

TEST(CopyBox, MatchesVoxelwiseCopy) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomBoxes random(seed);
    const Grid from = random.grid();
    Grid to = random.grid();
    Grid expected = to.snapshot();
    const IBox box = random.box();
    const IVec3 to_min = random.place(100);
    const AxisOrientation orientation =
        seed <= 48 ? AxisOrientation::at(static_cast<int>(seed) - 1) : AxisOrientation();
    const std::vector<VoxelType> type_map = {5, 2, kAir, 1, 4, 7, 7};
    CopyOptions options;
    options.copy_air = seed % 3 != 0;
    if (seed % 4 == 0) options.type_map = type_map;
    const std::int64_t changed = plain_copy(from, box, expected, to_min, orientation, options);
    EXPECT_EQ(copy_box(from, box, to, to_min, orientation, options), changed);
    expect_equal(to, expected);
    EXPECT_EQ(copy_box(from, box, to, to_min, orientation, options), 0);
  }
}

TEST(CopyBox, CopiesOverlappingBoxesWithinGrid) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomBoxes random(seed);
    Grid grid = random.grid();
    Grid expected = grid.snapshot();
    const IBox box = random.box();
    // The boxes overlap, sometimes by whole chunks.
    IVec3 to_min = box.min + random.place(40);
    if (seed % 4 == 0) to_min = box.min + random.place(2) * kChunkEdge;
    const AxisOrientation orientation = seed % 2 == 0 ? AxisOrientation() : random.orientation();
    CopyOptions options;
    options.copy_air = seed % 3 != 0;
    const std::int64_t changed = plain_copy(expected.snapshot(), box, expected, to_min, orientation, options);
    EXPECT_EQ(copy_box(grid, box, grid, to_min, orientation, options), changed);
    expect_equal(grid, expected);
  }
}

TEST(CopyBox, SharesChunksMovedByWholeChunks) {
  RandomBoxes random(1);
  const Grid from = random.grid();
  Grid to;
  const IBox all{IVec3(-256), IVec3(256)};
  copy_box(from, all, to, all.min + IVec3(640, -64, 128));
  EXPECT_EQ(to.voxel_count(), from.voxel_count());
  for (const IVec3 chunk : from.chunks()) {
    const Chunk* copy = to.find_chunk(chunk + IVec3(10, -1, 2));
    ASSERT_NE(copy, nullptr);
    EXPECT_TRUE(copy->shares_storage_with(*from.find_chunk(chunk)));
  }
  // Also tests a type map that changes none of the chunk's types, and an empty target without copied air.
  Grid third;
  const std::vector<VoxelType> type_map = {0, 1, 2};
  CopyOptions options;
  options.type_map = type_map;
  options.copy_air = false;
  copy_box(from, all, third, all.min, {}, options);
  for (const IVec3 chunk : from.chunks()) {
    EXPECT_TRUE(third.find_chunk(chunk)->shares_storage_with(*from.find_chunk(chunk)));
  }
}

TEST(CopyBox, FourTurnsRestoreBox) {
  RandomBoxes random(7);
  const Grid from = random.grid();
  const IBox box{{-70, -40, -90}, {50, 77, 33}};
  for (int axis = 0; axis < 3; ++axis) {
    Grid turned;
    copy_box(from, box, turned, IVec3(0));
    IVec3 size = box.size();
    for (int turn = 0; turn < 4; ++turn) {
      Grid next;
      const auto quarter = AxisOrientation::quarter_turns(axis, 1);
      copy_box(turned, {IVec3(0), size}, next, IVec3(0), quarter);
      size = quarter.size_of(size);
      turned = std::move(next);
    }
    Grid expected;
    copy_box(from, box, expected, IVec3(0));
    expect_equal(turned, expected);
  }
}

TEST(CopyBox, TurnsStatesOfTypesWithOrientations) {
  VoxelRegistry types;
  const VoxelType stone = *types.add({.name = "stone", .state_bits = 4});
  const VoxelType log = *types.add({.state_bits = 2, .orientations = StateOrientations::along_axes()});
  const VoxelType torch = *types.add({.state_bits = 4, .orientations = StateOrientations::to_directions(1)});
  const VoxelType stairs = *types.add({.state_bits = 3, .orientations = StateOrientations::about_y_and_upside_down()});
  const std::vector<VoxelType> type_map = {kAir, stone, log, stairs, stairs};
  for (int i = 0; i < AxisOrientation::kCount; ++i) {
    SCOPED_TRACE(i);
    RandomBoxes random(static_cast<unsigned>(i));
    const AxisOrientation turn = AxisOrientation::at(i);
    Grid from;
    Grid to;
    to.fill_box({{0, 0, 0}, {20, 20, 20}}, torch);
    to.set_data({1, 1, 1}, {.state = 9});
    if (i % 2 == 0) from.fill_box({{0, 0, 0}, {64, 64, 64}}, stairs);
    for (int k = 0; k < 300; ++k) {
      const auto state = static_cast<std::uint32_t>(random.below(3) == 0 ? 0 : random.below(8));
      from.set(random.place(20), static_cast<VoxelType>(random.below(5)), {.state = state});
    }
    CopyOptions options;
    options.types = &types;
    if (i % 3 == 0) options.type_map = type_map;
    const IBox box{{-20, -15, -18}, {20, 20, 15}};
    copy_box(from, box, to, {3, -2, 60}, turn, options);
    for (int z = box.min.z; z < box.max.z; ++z) {
      for (int y = box.min.y; y < box.max.y; ++y) {
        for (int x = box.min.x; x < box.max.x; ++x) {
          VoxelType type = from.get(x, y, z);
          if (i % 3 == 0) type = type_map[type];
          const IVec3 at = target_of({x, y, z}, box, {3, -2, 60}, turn);
          ASSERT_EQ(to.get(at), type);
          const std::uint32_t state = from.data({x, y, z}).state;
          const bool is_turned = i != AxisOrientation().index() && !types[type].orientations.empty();
          ASSERT_EQ(to.data(at).state, is_turned ? types[type].orientations.turned(state, turn) : state)
              << "type " << type << " state " << state;
        }
      }
    }
    // A map of the caller's own replaces the turn.
    options.map_state = [](VoxelType, std::uint32_t state) { return state ^ 1U; };
    Grid own;
    copy_box(from, box, own, {0, 0, 0}, turn, options);
    own.for_each_data([&](IVec3, VoxelType, const VoxelData& data) { EXPECT_NE(data.state, 0U); });
    EXPECT_LE(own.data_count(), from.data_count());
  }
}

TEST(CopyBox, RecordsExactlyTheChanges) {
  RandomBoxes random(11);
  Grid grid = random.grid();
  ChangeCursor cursor = grid.cursor();
  EXPECT_EQ(copy_box(grid, {IVec3(-80), IVec3(80)}, grid, IVec3(-80)), 0);
  EXPECT_TRUE(grid.changes_since(cursor).empty());
  Grid piece;
  piece.set({3, 4, 5}, 1'000);
  EXPECT_EQ(copy_box(piece, {IVec3(0), IVec3(10)}, grid, {20, 20, 20}, {}, {false, {}}), 1);
  const GridChanges changes = grid.changes_since(cursor);
  ASSERT_EQ(changes.items_unless_all().size(), 1U);
  EXPECT_EQ(changes.items_unless_all()[0].chunk, IVec3(0));
  EXPECT_EQ(grid.get(23, 24, 25), 1'000);
}

TEST(CopyBox, VisitsOnlyExistingChunksOfAlmostEmptyWorlds) {
  Grid from;
  from.set({1'000'000, -2'000'000, 5}, 3);
  from.set({-7, 8, 9}, 4);
  Grid to;
  to.set({500'000'000, 0, 0}, 1);
  to.set({-400'000'000, 5, 5}, 2);
  const IBox all{IVec3(-1'000'000'000), IVec3(1'000'000'000)};
  EXPECT_EQ(copy_box(from, all, to, all.min + IVec3(10, 20, 30)), 4);
  EXPECT_EQ(to.voxel_count(), 2);
  EXPECT_EQ(to.get(1'000'010, -1'999'980, 35), 3);
  EXPECT_EQ(to.get(3, 28, 39), 4);
  Grid mirrored;
  EXPECT_EQ(copy_box(from, all, mirrored, all.min, AxisOrientation::mirror(0)), 2);
  EXPECT_EQ(mirrored.get(-1'000'001, -2'000'000, 5), 3);
}

TEST(CopyBox, KeepsDataIfSourceIsOutsideWorld) {
  constexpr int kLast = std::numeric_limits<int>::max();
  Grid from;
  from.set(0, 0, 0, 1);
  CopyOptions solid;
  solid.copy_air = false;
  for (const int first : {kLast - 7, -kLast}) {
    Grid to;
    const IVec3 voxel{first > 0 ? 63 : 0, 0, 0};
    to.set(voxel, 1);
    ASSERT_TRUE(to.set_data(voxel, {5, {}}));
    EXPECT_EQ(copy_box(from, {{first, 0, 0}, {first + 4, 1, 1}}, to, {20, 0, 0}, {}, solid), 0);
    EXPECT_EQ(to.data(voxel).state, 5U);
  }
}

TEST(CopyBox, SkipsVoxelsOutsideTheWorld) {
  Grid from;
  from.fill_box({{0, 0, 0}, {10, 10, 10}}, 1);
  Grid to;
  EXPECT_EQ(copy_box(from, {IVec3(0), IVec3(10)}, to, {kWorldEdge - 5, 0, 0}), 500);
  EXPECT_EQ(to.get(kWorldEdge - 1, 9, 9), 1);
  constexpr int kLast = std::numeric_limits<int>::max();
  EXPECT_EQ(copy_box(from, {IVec3(0), IVec3(10)}, to, {0, kLast - 3, 0}, AxisOrientation::quarter_turns(0, 1)), 0);
  // A box that spans all coordinates.
  const IBox all{IVec3(std::numeric_limits<int>::min()), IVec3(kLast)};
  Grid whole;
  EXPECT_EQ(copy_box(from, all, whole, all.min), 1'000);
  EXPECT_EQ(whole.get(9, 9, 9), 1);
  EXPECT_EQ(copy_box(from, {}, to, IVec3(0)), 0);
  EXPECT_EQ(copy_box(from, {IVec3(5), IVec3(5)}, to, IVec3(0)), 0);
}

}  // namespace
}  // namespace quoin
