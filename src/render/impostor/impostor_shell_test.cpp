#include "render/impostor/impostor_surface.h"

#include <algorithm>
#include <random>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include <quoin/core/memory.h>
#include <quoin/grid/grid.h>

#include "bench/workloads.h"
#include "core/death_for_tests.h"

namespace quoin {
namespace {

constexpr std::int64_t kPlenty = std::int64_t{1} << 40;

using Key = std::tuple<int, int, int, int>;
Key key_of(const ShellFace& face) {
  return {face.voxel.x, face.voxel.y, face.voxel.z, static_cast<int>(face.direction)};
}

struct ShellWorld {
  VoxelRegistry types = workloads::three_types();
  Grid grid;
  OccupancyTree tree;

  explicit ShellWorld(unsigned seed) {
    std::mt19937 random(seed);
    const auto around = [&](int reach) {
      return static_cast<int>(random() % static_cast<unsigned>(2 * reach)) - reach;
    };
    const IVec3 corner{around(3000), around(3000), around(3000)};
    for (int i = 0; i < 30; ++i) {
      const IVec3 at = corner + IVec3{around(45), around(45), around(45)};
      grid.fill_box({at, at + IVec3{static_cast<int>(random() % 12) + 1, static_cast<int>(random() % 12) + 1, 4}},
                    random() % 4 == 0 ? kAir : static_cast<VoxelType>(1 + random() % 3));
    }
    grid.set(corner, 1);
    tree = OccupancyTree::build(grid, types, Occupancy::Opaque);
  }
};

TEST(ImpostorShell, HoldsEveryFaceOnce) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const ShellWorld world(seed);
    const auto shell = ImpostorShell::build(world.tree, kPlenty, kPlenty);
    ASSERT_TRUE(shell.has_value());
    const BlockVector<ShellFace> faces = shell->faces();
    std::set<Key> expected;
    const IBox box = world.tree.bounds();
    GridReader reader(world.grid);
    for (int z = box.min.z - 1; z <= box.max.z; ++z) {
      for (int y = box.min.y - 1; y <= box.max.y; ++y) {
        for (int x = box.min.x - 1; x <= box.max.x; ++x) {
          const bool is_solid = reader.get({x, y, z}) != kAir;
          ASSERT_EQ(shell->is_occupied({x, y, z}), is_solid) << seed;
          for (const Direction direction : kDirections) {
            if (is_solid && reader.get(IVec3{x, y, z} + normal_of(direction)) == kAir) {
              expected.insert(key_of({{x, y, z}, direction}));
            }
          }
        }
      }
    }
    ASSERT_EQ(faces.size(), expected.size()) << seed;
    for (std::size_t i = 0; i < faces.size(); ++i) {
      ASSERT_TRUE(expected.contains(key_of(faces[i]))) << seed;
      expected.erase(key_of(faces[i]));
      ASSERT_LE(faces[i == 0 ? 0 : i - 1].direction, faces[i].direction);
    }
  }
}

TEST(ImpostorShell, FullBoxesHaveOnlyOccupiedVoxels) {
  std::mt19937 random(7);
  int full = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const ShellWorld world(seed);
    const auto shell = ImpostorShell::build(world.tree, kPlenty, kPlenty);
    ASSERT_TRUE(shell.has_value());
    const IBox around{world.tree.bounds().min - 1, world.tree.bounds().max + 1};
    const BlockVector<ShellFace> faces = shell->faces();
    for (int i = 0; i < 20'000; ++i) {
      const IVec3 near = faces[random() % faces.size()].voxel;
      IBox box;
      for (int axis = 0; axis < 3; ++axis) {
        const int length = 1 + static_cast<int>(random() % (i % 4 == 0 ? 9U : 3U));
        const int low = near[axis] - static_cast<int>(random() % static_cast<unsigned>(length));
        box.min[axis] = std::max(low, around.min[axis]);
        box.max[axis] = std::min(low + length, around.max[axis]);
      }
      bool expected = true;
      for (int z = box.min.z; z < box.max.z; ++z) {
        for (int y = box.min.y; y < box.max.y; ++y) {
          for (int x = box.min.x; x < box.max.x; ++x) expected &= shell->is_occupied({x, y, z});
        }
      }
      ASSERT_EQ(shell->is_full(box), expected) << seed << ", box " << i;
      full += expected ? 1 : 0;
    }
    EXPECT_TRUE(shell->is_full({around.min, around.min})) << "an empty box";
  }
  EXPECT_GT(full, 10'000);
}

TEST(ImpostorShell, BuildsNothingBeyondLimits) {
  const ShellWorld world(3);
  const auto shell = ImpostorShell::build(world.tree, kPlenty, kPlenty);
  ASSERT_TRUE(shell.has_value());
  const auto count = static_cast<std::int64_t>(shell->faces().size());
  EXPECT_TRUE(ImpostorShell::build(world.tree, kPlenty, count).has_value());
  EXPECT_FALSE(ImpostorShell::build(world.tree, kPlenty, count - 1).has_value());
  EXPECT_FALSE(ImpostorShell::build(world.tree, 1000, kPlenty).has_value());
  // A row of few voxels with much empty space around it.
  Grid row;
  row.set({0, 0, 0}, 1);
  row.set({20'000'000, 0, 0}, 1);
  const OccupancyTree row_tree = OccupancyTree::build(row, world.types, Occupancy::Opaque);
  EXPECT_FALSE(ImpostorShell::build(row_tree, 1 << 26, kPlenty).has_value());
  Grid wide;
  wide.set({-2'000'000'000, -2'000'000'000, -2'000'000'000}, 1);
  wide.set({2'000'000'000, 2'000'000'000, 2'000'000'000}, 1);
  const OccupancyTree tree = OccupancyTree::build(wide, world.types, Occupancy::Opaque);
  EXPECT_FALSE(ImpostorShell::build(tree, kPlenty, kPlenty).has_value()) << "without a sum that overflows";
}

TEST(ImpostorShellDeathTest, RejectsPositionsFarOutsideBox) {
  const ShellWorld world(3);
  const auto shell = ImpostorShell::build(world.tree, kPlenty, kPlenty);
  ASSERT_TRUE(shell.has_value());
  const IVec3 adjacent = world.tree.bounds().max;
  EXPECT_FALSE(shell->is_occupied(adjacent));
  QUOIN_EXPECT_MISTAKE(static_cast<void>(shell->is_occupied(adjacent + 20)), "a position in the box or next to it");
}

}  // namespace
}  // namespace quoin
