#include "stream/stream_plan.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <random>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace quoin {
namespace {

using stream::Eye;
using stream::Placements;

std::vector<double> distances_of(const std::vector<Eye>& eyes) {
  std::vector<double> all;
  for (const Eye& eye : eyes) all.push_back(glm::length(eye.position));
  std::sort(all.begin(), all.end());
  return all;
}

// Thousands of placements move, appear and disappear; the nearest are found after a few updates at most.
TEST(Placements, FindsNearestAmongThousands) {
  std::mt19937 random(4);
  const auto place = [&] { return static_cast<double>(random() % 20'000); };
  Scene scene;
  const GridHandle grid = scene.add_grid({});
  Placements placements;
  std::vector<InstanceHandle> instances;
  const auto add = [&] {
    Instance instance;
    instance.grid = grid;
    instance.position = {place(), place(), place()};
    instances.push_back(scene.add_instance(instance));
    placements.put(instances.back());
  };
  for (int i = 0; i < 3000; ++i) add();
  Viewer viewer{.position = {9000.0, 9000.0, 9000.0}, .radius = 100.0};
  for (int step = 0; step < 40; ++step) {
    viewer.position.x += 50.0;
    for (int i = 0; i < 20; ++i) {
      const std::size_t at = random() % instances.size();
      scene.edit(instances[at]).position = viewer.position + DVec3(place(), place(), place()) / 20.0;
      placements.put(instances[at]);
    }
    add();
    placements.remove(instances.front());
    scene.remove_instance(instances.front());
    instances.erase(instances.begin());
    std::vector<Eye> eyes;
    for (int look = 0; look < 14; ++look) eyes = placements.eyes(scene, scene.grids()[grid], {&viewer, 1});
    std::vector<double> expected;
    for (const InstanceHandle each : instances) {
      expected.push_back(glm::length(grid_from_world(scene.instances()[each], scene.grids()[grid], viewer.position)));
    }
    std::sort(expected.begin(), expected.end());
    expected.resize(Placements::kNearest);
    EXPECT_EQ(distances_of(eyes), expected) << step;
  }
  EXPECT_EQ(placements.instances().size(), instances.size());
}

TEST(Placements, UsesAllOfFewPlacements) {
  Scene scene;
  const GridHandle grid = scene.add_grid({});
  Placements placements;
  for (int i = 0; i < 5; ++i) {
    Instance instance;
    instance.grid = grid;
    instance.position = {100.0 * i, 0.0, 0.0};
    placements.put(scene.add_instance(instance));
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Viewer> viewers{{.position = {1.0, 0.0, 0.0}},
                                    {.position = {7.0, 0.0, 0.0}},
                                    {.radius = -1.0},
                                    {.radius = nan},
                                    {.position = {nan, 0.0, 0.0}},
                                    {.position = {0.0, 0.0, std::numeric_limits<double>::infinity()}}};
  EXPECT_EQ(placements.eyes(scene, scene.grids()[grid], viewers).size(), 10U);
  EXPECT_TRUE(placements.eyes(scene, scene.grids()[grid], {}).empty());
}

}  // namespace
}  // namespace quoin
