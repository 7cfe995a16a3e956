#include "scene/instance_tree.h"

#include <cmath>
#include <limits>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace quoin {
namespace {

// Whether a single ray meets a box, by slabs.
bool meets(const Ray& ray, double max_t, const DBox& box) {
  double low = 0.0;
  double high = max_t;
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.direction[axis] == 0.0) {
      if (ray.origin[axis] < box.min[axis] || ray.origin[axis] > box.max[axis]) return false;
      continue;
    }
    const double a = (box.min[axis] - ray.origin[axis]) / ray.direction[axis];
    const double b = (box.max[axis] - ray.origin[axis]) / ray.direction[axis];
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  return low <= high;
}

struct RandomBoxes {
  std::mt19937 random{3};
  std::uniform_real_distribution<double> share{-1.0, 1.0};
  DVec3 vector(double size) { return DVec3(share(random), share(random), share(random)) * size; }
  std::vector<DBox> boxes(int count) {
    std::vector<DBox> all(static_cast<std::size_t>(count));
    for (DBox& box : all) {
      const DVec3 at = vector(100.0);
      box.extend(at);
      box.extend(at + glm::abs(vector(10.0)));
    }
    return all;
  }
};

TEST(InstanceTree, FindsEveryBoxThatAnyRayOfAPacketMeets) {
  RandomBoxes world;
  for (const int count : {1, 2, 5, 64, 300}) {
    const std::vector<DBox> boxes = world.boxes(count);
    const InstanceTree tree(boxes);
    for (int round = 0; round < 200; ++round) {
      RayPacket rays;
      const DVec3 origin = world.vector(150.0);
      const DVec3 direction = world.vector(1.0);
      const double spread = round % 3 == 0 ? 0.0 : 0.1;
      const double max_t = round % 2 == 0 ? std::numeric_limits<double>::infinity() : 60.0;
      for (int lane = 0; lane < 16; ++lane) {
        Ray ray{origin + world.vector(spread), direction + world.vector(spread)};
        if (round % 5 == 0) ray.direction.y = 0.0;
        rays.set(lane, ray, max_t);
      }
      std::set<std::size_t> found;
      RayInterval interval = interval_of(rays);
      tree.visit(interval, [&](std::size_t i) { return found.insert(i).second; });
      for (std::size_t i = 0; i < boxes.size(); ++i) {
        for (int lane = 0; lane < 16; ++lane) {
          ASSERT_TRUE(found.count(i) == 1 || !meets(rays.ray(lane), max_t, boxes[i]));
        }
      }
    }
  }
}

TEST(InstanceTree, LeavesOutMostOfWhatIsFarFromTheRays) {
  RandomBoxes world;
  const InstanceTree tree(world.boxes(1000));
  RayPacket rays;
  rays.set(3, {{-200, 0, 0}, {1, 0, 0}}, std::numeric_limits<double>::infinity());
  RayInterval interval = interval_of(rays);
  int visited = 0;
  tree.visit(interval, [&](std::size_t) { return ++visited > 0; });
  EXPECT_LT(visited, 40);
}

TEST(InstanceTree, StopsWhenToldAndIgnoresEmptyBoxes) {
  const DBox unit{DVec3(0.0), DVec3(1.0)};
  const InstanceTree tree({unit, DBox{}, unit, unit});
  RayInterval all{DVec3(-1.0), DVec3(-1.0), DVec3(1.0), DVec3(1.0), 10.0};
  std::set<std::size_t> found;
  tree.visit(all, [&](std::size_t i) { return found.insert(i).second; });
  EXPECT_EQ(found, (std::set<std::size_t>{0, 2, 3}));
  int visited = 0;
  tree.visit(all, [&](std::size_t) { return ++visited < 2; });
  EXPECT_EQ(visited, 2);
  InstanceTree().visit(all, [](std::size_t) -> bool { throw 1; });
}

}  // namespace
}  // namespace quoin
