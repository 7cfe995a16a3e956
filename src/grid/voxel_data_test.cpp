// Voxel data follows its voxels through every edit, copy and snapshot.

#include <algorithm>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/axis_orientation.h>
#include <quoin/grid/connected.h>
#include <quoin/grid/copy_box.h>
#include <quoin/grid/grid.h>

#include "core/death_for_tests.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

constexpr VoxelType kStone = 1;
constexpr VoxelType kChest = 2;

std::vector<std::byte> bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

struct Held {
  VoxelType type = kAir;
  std::uint32_t state = 0;
  std::vector<std::byte> bytes;
  bool operator==(const Held&) const = default;
};
using Key = std::tuple<int, int, int>;  // z, y, x
using HeldVoxels = std::map<Key, Held>;

Key key_of(IVec3 at) {
  return {at.z, at.y, at.x};
}

HeldVoxels voxels_of(const Grid& grid) {
  HeldVoxels found;
  grid.for_each([&](IVec3 at, VoxelType type) {
    const VoxelData data = grid.data(at);
    found[key_of(at)] = {type, data.state, {data.bytes.begin(), data.bytes.end()}};
  });
  return found;
}

// A grid and a slow, simple model of it.
struct CheckedDataGrid {
  Grid grid;
  HeldVoxels voxels;

  void set(IVec3 at, VoxelType type) {
    grid.set(at, type);
    note(at, type);
  }
  void note(IVec3 at, VoxelType type) {
    if (type == kAir) {
      voxels.erase(key_of(at));
    } else if (Held& held = voxels[key_of(at)]; held.type != type) {
      held = {type, 0, {}};
    }
  }
  void set_data(IVec3 at, const VoxelData& data) {
    const auto found = voxels.find(key_of(at));
    bool is_other = false;
    if (found != voxels.end()) {
      const Held held{found->second.type, data.state, {data.bytes.begin(), data.bytes.end()}};
      is_other = held != found->second;
      found->second = held;
    }
    ASSERT_EQ(grid.set_data(at, data), is_other);
  }
};

void expect_equal_data(const CheckedDataGrid& checked) {
  ASSERT_EQ(voxels_of(checked.grid), checked.voxels);
  std::vector<Key> with_data;
  for (const auto& [key, held] : checked.voxels) {
    if (held.state != 0 || !held.bytes.empty()) with_data.push_back(key);
  }
  std::vector<Key> visited;
  checked.grid.for_each_data([&](IVec3 at, VoxelType type, const VoxelData& data) {
    ASSERT_EQ(type, checked.grid.get(at));
    ASSERT_EQ(data, checked.grid.data(at));
    visited.push_back(key_of(at));
  });
  ASSERT_EQ(checked.grid.data_count(), static_cast<std::int64_t>(with_data.size()));
  std::ranges::sort(visited);
  ASSERT_EQ(visited, with_data);
}

constexpr int kFirst = 56;  // places around a corner of eight chunks
constexpr int kSize = 16;

class RandomEdits {
 public:
  explicit RandomEdits(unsigned seed) : random_(seed) {}

  int up_to(int end) { return static_cast<int>(random_() % static_cast<unsigned>(end)); }
  IVec3 place() { return {kFirst + up_to(kSize), kFirst + up_to(kSize), kFirst + up_to(kSize)}; }
  VoxelType type() { return static_cast<VoxelType>(up_to(4)); }
  IBox box() {
    const IVec3 a = place();
    const IVec3 b = place();
    return {glm::min(a, b), glm::max(a, b) + 1};
  }
  std::vector<std::byte> bytes() {
    return std::vector<std::byte>(random_() % 3 == 0 ? random_() % 9 : 0, std::byte(random_()));
  }

  void edit(CheckedDataGrid& checked) {
    switch (up_to(7)) {
      case 0:
        return checked.set(place(), type());
      case 1:
      case 2:
      case 3: {
        const std::vector<std::byte> made = bytes();
        const std::uint32_t state = up_to(3) == 0 ? 0 : random_();
        return checked.set_data(place(), {state, made});
      }
      case 4: {
        const IBox filled = box();
        const VoxelType to = type();
        checked.grid.fill_box(filled, to);
        return for_each_in(filled, [&](IVec3 at) { checked.note(at, to); });
      }
      case 5: {
        std::array<VoxelType, kChunkEdge> row{};
        for (VoxelType& each : row) each = type();
        const IVec3 at = place();
        const std::uint64_t mask = std::uint64_t{random_()} << 32 | random_();
        checked.grid.write_row(at, mask, row);
        const int first = at.x & ~(kChunkEdge - 1);
        for (int i = 0; i < kChunkEdge; ++i) {
          if ((mask >> i & 1U) != 0) checked.note({first + i, at.y, at.z}, row[static_cast<std::size_t>(i)]);
        }
        return;
      }
      default: {
        const IVec3 at = place();
        const std::vector<std::byte> made = bytes();
        const VoxelType to = type();
        const std::uint32_t state = random_();
        checked.grid.set(at, to, {state, made});
        checked.note(at, to);
        if (to != kAir) checked.voxels[key_of(at)] = {to, state, made};
      }
    }
  }

  template <class Visit>
  static void for_each_in(const IBox& box, Visit&& visit) {
    for (int z = box.min.z; z < box.max.z; ++z) {
      for (int y = box.min.y; y < box.max.y; ++y) {
        for (int x = box.min.x; x < box.max.x; ++x) visit({x, y, z});
      }
    }
  }

 private:
  std::mt19937 random_;
};

TEST(VoxelData, FollowsVoxelsThroughEditsAndSnapshots) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    RandomEdits edits(seed);
    std::vector<CheckedDataGrid> all(1);
    for (int i = 0; i < 400; ++i) {
      CheckedDataGrid& checked = all[static_cast<std::size_t>(edits.up_to(static_cast<int>(all.size())))];
      if (i % 60 == 30 && all.size() < 5) {
        CheckedDataGrid copy{checked.grid.snapshot(), checked.voxels};
        all.push_back(std::move(copy));
        continue;
      }
      edits.edit(checked);
    }
    for (const CheckedDataGrid& checked : all) expect_equal_data(checked);
  }
}

TEST(VoxelData, IsRemovedOnlyWhenTypeChanges) {
  Grid grid;
  const IVec3 at{3, 4, 5};
  EXPECT_FALSE(grid.set_data(at, {.state = 7})) << "air holds nothing";
  grid.set(at, kStone);
  EXPECT_TRUE(grid.set_data(at, {.state = 7}));
  EXPECT_FALSE(grid.set_data(at, {.state = 7}));
  grid.set(at, kStone);
  grid.fill_box({at - 2, at + 2}, kStone);
  EXPECT_EQ(grid.data(at).state, 7U);
  EXPECT_TRUE(grid.set(at, kChest, grid.data(at))) << "keeps it on request";
  EXPECT_EQ(grid.data(at).state, 7U);
  grid.set(at, kStone);
  EXPECT_TRUE(grid.data(at).empty());
  EXPECT_EQ(grid.data_count(), 0);
}

TEST(VoxelData, AcceptsViewOfOwnData) {
  Grid grid;
  const IVec3 at{-1, -1, -1};
  const std::vector<std::byte> inventory = bytes_of("three apples");
  grid.set(at, kStone, {.state = 9, .bytes = inventory});
  grid.set(at, kChest, grid.data(at));
  EXPECT_EQ(grid.data(at), (VoxelData{9, inventory}));
  grid.set_data(at, {.state = grid.data(at).state ^ 1U, .bytes = grid.data(at).bytes.first(5)});
  EXPECT_EQ(grid.data(at), (VoxelData{8, std::span(inventory).first(5)}));
}

TEST(VoxelData, UniformChunkKeepsData) {
  Chunk chunk(kStone);
  chunk.set_data({1, 2, 3}, {.state = 5});
  chunk.set_data({63, 63, 63}, {.state = 6});
  EXPECT_TRUE(chunk.uniform().has_value());
  chunk.fill(kStone);
  EXPECT_EQ(chunk.data_count(), 2);
  chunk.set({0, 0, 0}, kChest);
  EXPECT_EQ(chunk.data({1, 2, 3}).state, 5U);
  chunk.fill(kChest);
  EXPECT_EQ(chunk.data_count(), 0);
}

TEST(VoxelData, TakesNoMemoryInChunksWithoutData) {
  Chunk chunk(kStone);
  EXPECT_EQ(chunk.bytes(), sizeof(Chunk));
  EXPECT_LE(sizeof(Chunk), 3 * sizeof(void*));
  chunk.set_data({1, 2, 3}, {.state = 5});
  EXPECT_LT(chunk.bytes(), sizeof(Chunk) + 2'600);
  chunk.set_data({1, 2, 3}, {});
  EXPECT_EQ(chunk.bytes(), sizeof(Chunk));
}

TEST(VoxelData, IsComparedWithChunks) {
  Chunk one(kStone);
  one.set_data({1, 2, 3}, {.state = 5});
  const Chunk same = one;
  Chunk made(kStone);
  made.set_data({1, 2, 3}, {.state = 5});
  Chunk other(kStone);
  other.set_data({1, 2, 3}, {.state = 6});
  EXPECT_TRUE(one.shares_storage_with(same));
  EXPECT_FALSE(one.shares_storage_with(made));
  EXPECT_EQ(one, made);
  EXPECT_EQ(one.content_hash(), made.content_hash());
  EXPECT_FALSE(one == other);
  EXPECT_FALSE(one == Chunk(kStone));
  EXPECT_NE(one.content_hash(), other.content_hash());
}

TEST(VoxelDataChanges, AreSeparateFromTypeChanges) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {128, 8, 8}}, kStone);
  ChangeCursor types = grid.cursor();
  ChangeCursor data = grid.cursor();
  grid.set_data({70, 1, 2}, {.state = 3});
  EXPECT_FALSE(grid.has_changed_since(types));
  EXPECT_TRUE(grid.has_data_changed_since(data));
  EXPECT_TRUE(grid.changes_since(types).empty());
  const DataChanges reported = grid.data_changes_since(data);
  ASSERT_EQ(reported.items_unless_all().size(), 1U);
  EXPECT_EQ(reported.items_unless_all()[0].chunk, IVec3(1, 0, 0));
  EXPECT_EQ(reported.items_unless_all()[0].box, (IBox{{6, 1, 2}, {7, 2, 3}}));
  EXPECT_FALSE(grid.has_data_changed_since(data));

  grid.set({1, 1, 1}, kChest);
  EXPECT_TRUE(grid.has_changed_since(types));
  EXPECT_FALSE(grid.has_data_changed_since(data)) << "there was none";
  EXPECT_TRUE(grid.data_changes_since(data).empty());
  EXPECT_EQ(grid.changes_since(types).items_unless_all().size(), 1U);

  grid.set({70, 1, 2}, kChest);
  EXPECT_EQ(grid.data_changes_since(data).items_unless_all().size(), 1U) << "it went with its voxel";
  EXPECT_EQ(grid.changes_since(types).items_unless_all().size(), 1U);
  EXPECT_EQ(grid.bounds(), (IBox{{0, 0, 0}, {128, 8, 8}}));
}

// Several consumers read at different rates.
TEST(VoxelDataChanges, ReportEveryDifferingVoxel) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    RandomEdits edits(seed);
    CheckedDataGrid checked;
    struct Consumer {
      ChangeCursor types, data;
      Grid before;
      HeldVoxels voxels;
    };
    std::vector<Consumer> consumers(3);
    for (int i = 0; i < 300; ++i) {
      edits.edit(checked);
      Consumer& consumer = consumers[static_cast<std::size_t>(edits.up_to(60)) % 20 % 3];
      if (edits.up_to(5) != 0) continue;
      std::map<Key, std::uint32_t> expected;
      for (const auto& each : {&consumer.voxels, &checked.voxels}) {
        for (const auto& [key, held] : *each) {
          const auto a = consumer.voxels.find(key);
          const auto b = checked.voxels.find(key);
          const Held none;
          const Held& old_held = a == consumer.voxels.end() ? none : a->second;
          const Held& new_held = b == checked.voxels.end() ? none : b->second;
          if (old_held.state != new_held.state || old_held.bytes != new_held.bytes) expected[key] = new_held.state;
        }
      }
      const bool is_reported = checked.grid.has_data_changed_since(consumer.data);
      const DataChanges changes = checked.grid.data_changes_since(consumer.data);
      ASSERT_EQ(is_reported, !changes.empty());
      std::map<Key, std::uint32_t> found;
      visit_data_changes(consumer.before, checked.grid, changes, [&](IVec3 at, const VoxelData& a, const VoxelData& b) {
        ASSERT_NE(a, b);
        ASSERT_TRUE(changes.all || std::ranges::any_of(changes.items_unless_all(), [&](const DataChange& change) {
                      return change.chunk == chunk_of(at) && change.box.contains(local_of(at));
                    }));
        found[key_of(at)] = b.state;
      });
      ASSERT_EQ(found, expected);
      const bool has_types = checked.grid.has_changed_since(consumer.types);
      ASSERT_EQ(has_types, !checked.grid.changes_since(consumer.types).empty());
      consumer.before = checked.grid.snapshot();
      consumer.voxels = checked.voxels;
    }
  }
}

TEST(VoxelDataChanges, ReportDataOfClearedGrid) {
  Grid grid;
  grid.set({1, 1, 1}, kChest, {.state = 1});
  grid.set({100, 1, 1}, kStone);
  ChangeCursor data = grid.cursor();
  grid.clear();
  const DataChanges reported = grid.data_changes_since(data);
  ASSERT_EQ(reported.items_unless_all().size(), 1U);
  EXPECT_EQ(reported.items_unless_all()[0].chunk, IVec3(0));
  EXPECT_EQ(grid.data_count(), 0);
}

TEST(VoxelDataCopies, TurnWithTheirVoxels) {
  for (unsigned seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE(seed);
    RandomEdits edits(seed);
    CheckedDataGrid from;
    CheckedDataGrid to;
    for (int i = 0; i < 150; ++i) edits.edit(from);
    for (int i = 0; i < 150; ++i) edits.edit(to);
    const AxisOrientation turn = AxisOrientation::at(edits.up_to(AxisOrientation::kCount));
    const IBox box = edits.box();
    const IVec3 place = edits.place();
    CopyOptions options;
    options.copy_air = edits.up_to(2) == 0;
    const std::vector<VoxelType> map = {0, 2, 0, 3};
    if (edits.up_to(2) == 0) options.type_map = map;
    if (edits.up_to(2) == 0) options.map_state = [](VoxelType type, std::uint32_t state) { return state * 3 + type; };
    const IVec3 size = turn.size_of(box.size());
    RandomEdits::for_each_in({IVec3(0), size}, [&](IVec3 v) {
      IVec3 source{0};
      for (int axis = 0; axis < 3; ++axis) {
        const int along = turn.source_axis(axis);
        source[along] = box.min[along] + (turn.is_negated(axis) ? size[axis] - 1 - v[axis] : v[axis]);
      }
      const auto found = from.voxels.find(key_of(source));
      Held held = found == from.voxels.end() ? Held{} : found->second;
      if (held.type == kAir && !options.copy_air) return;
      if (!options.type_map.empty() && held.type < map.size()) held.type = map[held.type];
      if (held.type == kAir) {
        // Without copy_air, a type that is mapped to air removes nothing.
        if (options.copy_air) to.voxels.erase(key_of(place + v));
        return;
      }
      if (options.map_state && held.state != 0) held.state = options.map_state(held.type, held.state);
      to.voxels[key_of(place + v)] = held;
    });
    copy_box(from.grid, box, to.grid, place, turn, options);
    expect_equal_data(to);
  }
}

TEST(VoxelDataCopies, ShareDataOfWholeChunks) {
  Grid from;
  from.fill_box({{0, 0, 0}, {128, 64, 64}}, kStone);
  from.set({70, 2, 2}, kChest, {.state = 4});
  from.set_data({3, 3, 3}, {.state = 5});
  Grid to;
  to.set({0, 0, 0}, kStone, {.state = 1});
  copy_box(from, {{0, 0, 0}, {128, 64, 64}}, to, {0, 64, 0});
  EXPECT_EQ(to.data({70, 66, 2}).state, 4U);
  EXPECT_EQ(to.data({3, 67, 3}).state, 5U);
  EXPECT_TRUE(to.find_chunk({1, 1, 0})->shares_storage_with(*from.find_chunk({1, 0, 0})));
  copy_box(from, {{0, 0, 0}, {64, 64, 64}}, to, {0, 0, 0});
  EXPECT_TRUE(to.data({0, 0, 0}).empty()) << "the chunk that came has none there";
  EXPECT_EQ(to.data_count(), 3);
}

TEST(VoxelDataPieces, MoveWithDetachedPieces) {
  Grid world;
  world.fill_box({{0, 0, 0}, {100, 1, 100}}, kStone);
  world.fill_box({{60, 10, 10}, {70, 12, 12}}, kStone);
  world.set_data({61, 10, 10}, {.state = 1});
  world.set_data({2, 0, 2}, {.state = 2});
  ConnectedPieces pieces;
  pieces.update(world);
  world.set_data({66, 11, 11}, {.state = 3});  // same type: pieces stay, their data changes
  pieces.update(world);
  const std::vector<std::size_t> fallen = pieces.not_touching({{0, 0, 0}, {100, 1, 100}});
  ASSERT_EQ(fallen.size(), 1U);
  const Grid body = pieces.extract(fallen[0]);
  EXPECT_EQ(body.data_count(), 2);
  EXPECT_EQ(body.data({61, 10, 10}).state, 1U);
  EXPECT_EQ(body.data({66, 11, 11}).state, 3U);
  pieces.remove_from(world, fallen[0]);
  EXPECT_EQ(world.data_count(), 1);
}

TEST(VoxelDataDeathTest, AssertsOnTooManyBytes) {
  Grid grid;
  grid.set({0, 0, 0}, kChest);
  const std::vector<std::byte> most(kMaxVoxelDataBytes);
  EXPECT_TRUE(grid.set_data({0, 0, 0}, {.bytes = most}));
  const std::vector<std::byte> more(kMaxVoxelDataBytes + 1);
  QUOIN_EXPECT_MISTAKE(grid.set_data({0, 0, 0}, {.bytes = more}), "no more bytes");
}

TEST(VoxelData, StatesOfARowAreThoseOfItsVoxels) {
  std::mt19937 random(5);
  Chunk chunk(kStone);
  for (int i = 0; i < 400; ++i) {
    const IVec3 at(random() % 64, random() % 6, random() % 6);
    VoxelData data{.state = static_cast<std::uint32_t>(random() % 3)};
    const std::vector<std::byte> bytes = bytes_of("a chest");
    if (i % 5 == 0) data.bytes = bytes;
    chunk.set_data(at, data);
  }
  for (int i = 0; i < 64; ++i) {
    const RowStates row = RowStates::of(chunk, i % 8, i / 8);
    std::size_t next = 0;
    for (int x = 0; x < kChunkEdge; ++x) {
      const std::uint32_t state = (row.voxels >> x & 1U) != 0 ? row.states[next++] : 0;
      EXPECT_EQ(state, chunk.data({x, i % 8, i / 8}).state);
    }
  }
  EXPECT_EQ(RowStates::of(Chunk(kStone), 0, 0).voxels, 0U);
}

}  // namespace
}  // namespace quoin
