#include "trace/walk.h"

#include <random>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace quoin {
namespace {

class BlockWalk : public ::testing::Test {
 protected:
  BlockWalk() {
    for (const Visibility visibility : {Visibility::Transparent, Visibility::Transparent, Visibility::Opaque}) {
      VoxelProperties properties;
      properties.visibility = visibility;
      ids.push_back(types.add(properties).value());
    }
  }

  /// Adds boxes and single voxels of two types of glass, with stone inside, across chunks that are full of one type.
  void scatter() {
    const int low = -80;
    std::uniform_int_distribution<int> place(low, 90);
    std::uniform_int_distribution<int> size(1, 40);
    grid.fill_box({{-64, 0, 0}, {0, 64, 64}}, ids[0]);
    for (int i = 0; i < 60; ++i) {
      const IVec3 from{place(random), place(random), place(random)};
      grid.fill_box({from, from + IVec3{size(random), size(random), size(random)}}, pick(i % 7 == 0));
    }
    for (int i = 0; i < 500; ++i) grid.set({place(random), place(random), place(random)}, pick(i % 3 == 0));
  }

  /// Returns one of the two types of glass, or any type.
  VoxelType pick(bool anything) {
    const VoxelType any[] = {ids[0], ids[1], ids[2], kAir};
    return any[std::uniform_int_distribution<std::size_t>(0, anything ? 3 : 1)(random)];
  }

  Ray ray() {
    std::uniform_real_distribution<double> place(-150.0, 150.0);
    std::normal_distribution<double> number;
    const DVec3 from{place(random), place(random), place(random)};
    const DVec3 at = 0.4 * DVec3{place(random), place(random), place(random)};
    switch (std::uniform_int_distribution<int>(0, 7)(random)) {
      case 0:  // along an axis, on the planes between voxels
        return {glm::floor(from), {0.0, 0.0, from.z > 0.0 ? -1.0 : 1.0}};
      case 1:  // through edges and corners
        return {glm::floor(from), {1.0, from.y > 0.0 ? -1.0 : 1.0, 1.0}};
      case 2:  // from within
        return {at, {number(random), number(random), number(random)}};
      default:
        return {from, at - from};
    }
  }

  std::vector<VoxelSpan> blocks(const OccupancyTree& tree, const Ray& ray, double max_t, double largest = 64.0) {
    std::vector<VoxelSpan> spans;
    const auto no_matter = [](const VoxelSpan& /*begun*/) {};
    const auto any = [&] { return largest; };
    trace::visit_blocks(tree, ray, max_t, no_matter, any, [&](const VoxelSpan& span) {
      spans.push_back(span);
      return true;
    });
    return spans;
  }

  /// Returns the number of voxels per block along the rays of a loop.
  double compare(const OccupancyTree& tree, int rays) {
    std::size_t block_count = 0;
    std::size_t voxel_count = 0;
    for (int i = 0; i < rays && !::testing::Test::HasFailure(); ++i) {
      const Ray along = ray();
      const double max_t = i % 5 == 0 ? 0.7 : 1e9;
      const auto found = blocks(tree, along, max_t, i % 3 == 0 ? 16.0 : 64.0);
      std::size_t next = 0;
      visit_hits(tree, along, max_t, [&](const VoxelSpan& voxel) {
        const bool begins = next < found.size() && found[next].voxel == voxel.voxel;
        if (begins) {
          EXPECT_EQ(found[next].t_enter, voxel.t_enter);
          EXPECT_EQ(found[next].face, voxel.face);
          EXPECT_EQ(found[next].starts_inside, voxel.starts_inside);
          ++next;
        }
        EXPECT_GT(next, 0U) << "a voxel before the first block";
        if (next == 0) return false;
        EXPECT_LE(voxel.t_exit, found[next - 1].t_exit);
        EXPECT_EQ(grid.get(voxel.voxel), grid.get(found[next - 1].voxel));
        ++voxel_count;
        return true;
      });
      EXPECT_EQ(next, found.size()) << "every block begins with a voxel";
      block_count += found.size();
    }
    return static_cast<double>(voxel_count) / static_cast<double>(std::max<std::size_t>(block_count, 1));
  }

  std::mt19937 random{77};
  VoxelRegistry types;
  std::vector<VoxelType> ids;
  Grid grid;
};

TEST_F(BlockWalk, VisitsSameVoxelsAtSameDistances) {
  scatter();
  const OccupancyTree tree = OccupancyTree::build(grid, types, Occupancy::Transparent);
  EXPECT_GT(compare(tree, 4000), 2.0) << "most steps are longer than a voxel";
}

TEST_F(BlockWalk, FollowsEdits) {
  scatter();
  OccupancyTree tree = OccupancyTree::build(grid, types, Occupancy::Transparent);
  ChangeCursor cursor;
  (void)grid.changes_since(cursor);
  for (int round = 0; round < 20; ++round) {
    const IVec3 from{8 * round - 80, 5, 3 * round};
    grid.fill_box({from, from + 30}, round % 4 == 3 ? kAir : ids[static_cast<std::size_t>(round) % 3]);
    grid.set(from + 9, ids[1]);
    tree.update(grid, types, grid.changes_since(cursor));
    compare(tree, 150);
  }
}

TEST_F(BlockWalk, CrossesUniformAreasInLargeSteps) {
  grid.fill_box({{0, 0, 0}, {128, 64, 64}}, ids[0]);
  const OccupancyTree tree = OccupancyTree::build(grid, types, Occupancy::Transparent);
  EXPECT_EQ(blocks(tree, {{-5, 30.5, 30.5}, {1, 0, 0}}, 1e9).size(), 2U);
  grid.fill_box({{70, 0, 0}, {71, 64, 64}}, ids[1]);
  const OccupancyTree edited = OccupancyTree::build(grid, types, Occupancy::Transparent);
  // Bricks of 16 in uniform areas, and cells of 4 next to the sheet.
  EXPECT_EQ(blocks(edited, {{-5, 30.5, 30.5}, {1, 0, 0}}, 1e9).size(), 1U + 1 + 4 + 2 + 3);
  EXPECT_EQ(blocks(edited, {{-5, 30.5, 30.5}, {1, 0, 0}}, 1e9, 5.0).size(), 16U + 1 + 4 + 2 + 12);
  EXPECT_EQ(blocks(edited, {{-5, 30.5, 30.5}, {1, 0, 0}}, 1e9, 0.0).size(), 128U);
}

}  // namespace
}  // namespace quoin
