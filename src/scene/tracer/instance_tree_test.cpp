#include "scene/tracer/instance_tree.h"

#include <set>

#include <gtest/gtest.h>

#include <quoin/core/memory.h>

#include "core/not_finite_for_tests.h"
#include "scene/query/box_test_support.h"

namespace quoin {
namespace {

std::set<std::size_t> visited(const InstanceTree& tree, const Ray& ray, double max_t) {
  std::set<std::size_t> found;
  tree.visit(ray, max_t, [&](std::size_t i) { return found.insert(i).second; });
  return found;
}

void expect_finds_all(const InstanceTree& tree, const BlockVector<DBox>& boxes, RandomBoxes& world) {
  for (int round = 0; round < 100; ++round) {
    Ray ray{world.vector(150.0), world.vector(1.0)};
    if (round % 5 == 0) ray.direction.y = 0.0;
    const double max_t = round % 2 == 0 ? kInfinity : 60.0;
    const std::set<std::size_t> found = visited(tree, ray, max_t);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      ASSERT_TRUE(found.count(i) == 1 || !meets(ray, max_t, boxes[i])) << i;
      ASSERT_TRUE(found.count(i) == 0 || !boxes[i].empty()) << i;
    }
  }
}

TEST(InstanceTree, FindsEveryBoxHitByRay) {
  RandomBoxes world(3);
  for (const int count : {0, 1, 2, 5, 64, 300}) {
    const BlockVector<DBox> boxes = world.boxes(count);
    expect_finds_all(InstanceTree(boxes), boxes, world);
  }
}

TEST(InstanceTree, FindsEveryBoxAfterChanges) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    RandomBoxes world(seed);
    BlockVector<DBox> boxes = world.boxes(1 + static_cast<int>(world.random() % 100));
    InstanceTree tree(boxes);
    for (int round = 0; round < 10; ++round) {
      std::vector<InstanceTree::Change> changes;
      const BlockVector<DBox> others = world.boxes(static_cast<int>(world.random() % 20));
      for (DBox other : others) {
        const std::size_t i = world.random() % boxes.size();
        if (world.random() % 8 == 0) other = {};
        boxes[i] = other;
        changes.push_back({i, other});
      }
      tree.change(changes);
      for (std::size_t i = 0; i < boxes.size(); ++i) {
        EXPECT_EQ(tree.boxes()[i].min, boxes[i].min);
        EXPECT_EQ(tree.boxes()[i].max, boxes[i].max);
      }
      expect_finds_all(tree, boxes, world);
    }
  }
}

// After random movements of boxes, the search cost stays within a factor of a new tree's.
TEST(InstanceTree, StaysEfficientAsBoxesMove) {
  RandomBoxes world(5);
  BlockVector<DBox> boxes = world.boxes(1000);
  InstanceTree tree(boxes);
  for (int round = 0; round < 20; ++round) {
    std::vector<InstanceTree::Change> changes;
    const BlockVector<DBox> others = world.boxes(100);
    for (const DBox& other : others) {
      const std::size_t i = world.random() % boxes.size();
      boxes[i] = other;
      changes.push_back({i, other});
    }
    tree.change(changes);
  }
  const auto looked_into = [](const InstanceTree& each) {
    int count = 0;
    for (const InstanceTree::Node& node : each.nodes()) count += may_meet({{-200, 3, 4}, {1, 0, 0}}, 1e9, node.box);
    return count;
  };
  EXPECT_LT(looked_into(tree), 4 * looked_into(InstanceTree(boxes)));
}

TEST(InstanceTree, SkipsMostBoxesFarFromRay) {
  RandomBoxes world(3);
  const InstanceTree tree(world.boxes(1000));
  EXPECT_LT(visited(tree, {{-200, 0, 0}, {1, 0, 0}}, kInfinity).size(), 40U);
}

TEST(InstanceTree, StopsOnRequestAndIgnoresEmptyBoxes) {
  const DBox unit{DVec3(0.0), DVec3(1.0)};
  const InstanceTree tree({unit, DBox{}, unit, unit});
  const Ray ray{DVec3(-1.0), DVec3(1.0)};
  EXPECT_EQ(visited(tree, ray, 10.0), (std::set<std::size_t>{0, 2, 3}));
  int count = 0;
  double max_t = 10.0;
  tree.visit(ray, max_t, [&](std::size_t) { return ++count < 2; });
  EXPECT_EQ(count, 2);
  InstanceTree().visit(ray, max_t, [](std::size_t) -> bool { throw 1; });
}

}  // namespace
}  // namespace quoin
