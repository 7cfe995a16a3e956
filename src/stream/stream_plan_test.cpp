#include "stream/stream_plan.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <tuple>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace quoin {
namespace {

using stream::Eye;
using stream::Placements;
using stream::StreamPlan;
using stream::StreamRequests;

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
    for (int look = 0; look < 14; ++look) placements.find_eyes(scene, scene.grids()[grid], {&viewer, 1}, eyes);
    std::vector<double> expected;
    for (const InstanceHandle each : instances) {
      expected.push_back(glm::length(grid_from_world(scene.instances()[each], scene.grids()[grid], viewer.position)));
    }
    std::sort(expected.begin(), expected.end());
    expected.resize(Placements::kNearest);
    EXPECT_EQ(distances_of(eyes), expected) << step;
  }
  for (const InstanceHandle each : instances) EXPECT_TRUE(placements.contains(each));
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
  std::vector<Eye> eyes;
  placements.find_eyes(scene, scene.grids()[grid], viewers, eyes);
  EXPECT_EQ(eyes.size(), 10U);
  placements.find_eyes(scene, scene.grids()[grid], {}, eyes);
  EXPECT_TRUE(eyes.empty());
}

StreamRequests around(DVec3 position, double radius, std::size_t max_chunks = 1 << 18) {
  StreamRequests requests;
  requests.eyes[0] = {{.position = position, .radius = radius}};
  requests.max_chunks = max_chunks;
  return requests;
}

double distance_to(DVec3 point, IVec3 chunk) {
  const DVec3 low = DVec3(chunk) * 64.0;
  return glm::length(glm::clamp(point, low, low + 64.0) - point);
}

// A slow plan of one grid: all chunks of a box around the viewer, counted again each time.
struct SlowPlan {
  std::map<std::tuple<int, int, int>, StreamPlan::State> states;
  std::set<std::tuple<int, int, int>> others;
  IBox extent;
  DVec3 position{0.0};
  double radius = 0.0;

  [[nodiscard]] std::vector<double> missing() const {
    std::vector<double> distances;
    const IVec3 centre(glm::floor(position / 64.0));
    const int reach = static_cast<int>(radius / 64.0) + 2;
    for (int z = -reach; z <= reach; ++z) {
      for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
          const IVec3 at = centre + IVec3{x, y, z};
          const std::tuple key{at.x, at.y, at.z};
          if (!extent.contains(at) && !others.contains(key)) continue;
          const double distance = distance_to(position, at);
          const auto state = states.find(key);
          if (distance <= radius && (state == states.end() || state->second == StreamPlan::State::Begun)) {
            distances.push_back(distance);
          }
        }
      }
    }
    return distances;
  }
};

TEST(StreamPlan, CountsLikeSlowPlan) {
  using State = StreamPlan::State;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    std::mt19937 random(seed);
    SlowPlan slow;
    slow.extent = {{-6, -1, -6}, {6, 1, 6}};
    StreamPlan plan;
    std::vector<IVec3> others;
    for (int i = 0; i < 20; ++i) {
      const IVec3 other{static_cast<int>(random() % 16) - 8, 1 + static_cast<int>(random() % 4), 0};
      others.push_back(other);
      slow.others.insert({other.x, other.y, other.z});
    }
    plan.set_extent(0, slow.extent, others);
    for (int step = 0; step < 300; ++step) {
      if (step % 50 == 0) {
        slow.position = DVec3(static_cast<double>(random() % 400), 20.0, static_cast<double>(random() % 400)) - 200.0;
        slow.radius = 100.0 + static_cast<double>(random() % 200);
        plan.plan(around(slow.position, slow.radius));
      }
      ChunkAddress place;
      if (random() % 3 == 0 && plan.next(place, true)) {
        slow.states[{place.chunk.x, place.chunk.y, place.chunk.z}] = State::Begun;
      } else {
        place.chunk = {static_cast<int>(random() % 12) - 6, static_cast<int>(random() % 2) - 1,
                       static_cast<int>(random() % 12) - 6};
        const State state = std::array{State::Unknown, State::Begun, State::Here, State::Broken}.at(random() % 4);
        plan.set_state(place, state);
        const std::tuple key{place.chunk.x, place.chunk.y, place.chunk.z};
        if (state == State::Unknown) {
          slow.states.erase(key);
        } else {
          slow.states[key] = state;
        }
      }
      const std::vector<double> missing = slow.missing();
      ASSERT_EQ(plan.missing(), missing.size()) << "seed " << seed << " step " << step;
      ASSERT_EQ(plan.complete_radius(), missing.empty() ? slow.radius : *std::ranges::min_element(missing));
    }
  }
}

// The entries and steps of a plan are those of the chunks that can be loaded, not of the sphere around the viewer.
TEST(StreamPlan, AirOutsideOfExtentTakesNoEntry) {
  StreamPlan plan;
  plan.set_extent(0, {{-1000, 0, -1000}, {1000, 4, 1000}}, std::vector<IVec3>{{3, 9, 3}, {500, 9, 500}});
  const DVec3 eye{10.0, 150.0, 10.0};
  const double radius = 2048.0;
  std::size_t expected = 1;  // (3, 9, 3)
  for (int z = -40; z <= 40; ++z) {
    for (int y = 0; y < 4; ++y) {
      for (int x = -40; x <= 40; ++x) expected += distance_to(eye, {x, y, z}) <= radius ? 1 : 0;
    }
  }
  // A budget for the sphere of a smaller radius is enough for all of these chunks.
  plan.plan(around(eye, radius, expected));
  EXPECT_EQ(plan.wanted(), expected);
  EXPECT_EQ(plan.missing(), expected);
  EXPECT_EQ(plan.entries(), expected);
  std::size_t steps = 0;
  for (ChunkAddress place; plan.next(place, true); ++steps) plan.set_state(place, StreamPlan::State::Here);
  EXPECT_EQ(steps, expected);
  EXPECT_EQ(plan.missing(), 0U);
  EXPECT_EQ(plan.complete_radius(), radius);
  // With less, the budget cuts the plan.
  plan.plan(around(eye, radius, expected / 2));
  EXPECT_LT(plan.wanted(), expected / 2);
  EXPECT_LT(plan.complete_radius(), radius);
  EXPECT_GT(plan.complete_radius(), radius / 2);
}

TEST(StreamPlan, EditedAirJoinsTheChunksToLoad) {
  StreamPlan plan;
  plan.set_extent(0, {}, {});
  plan.plan(around(DVec3(0.0), 100.0));
  EXPECT_EQ(plan.wanted(), 0U);
  EXPECT_EQ(plan.complete_radius(), 100.0);
  const ChunkAddress edited{0, 0, {1, 1, 0}};
  plan.set_state(edited, StreamPlan::State::Here);
  plan.plan(around(DVec3(9000.0), 100.0));
  EXPECT_EQ(plan.take_leaving(), std::vector<ChunkAddress>{edited});
  plan.forget(edited);
  EXPECT_EQ(plan.entries(), 0U);
  plan.plan(around(DVec3(0.0), 100.0));
  EXPECT_EQ(plan.missing(), 1U);
  ChunkAddress place;
  ASSERT_TRUE(plan.next(place, true));
  EXPECT_EQ(place, edited);
  EXPECT_FALSE(plan.next(place, true));
}

// Chunks of the list before may leave after the plan was made with them.
TEST(StreamPlan, LoadsWantedChunksAgainThatAreForgotten) {
  StreamPlan plan;
  plan.set_extent(0, {IVec3(-1), IVec3(1)}, {});
  const ChunkAddress here{0, 0, {0, 0, 0}};
  plan.set_state(here, StreamPlan::State::Here);
  plan.plan(around(DVec3(0.0), 200.0));
  EXPECT_EQ(plan.wanted(), 8U);
  ChunkAddress place;
  for (int i = 0; i < 7; ++i) {
    ASSERT_TRUE(plan.next(place, true));
    EXPECT_NE(place, here);
    plan.set_state(place, StreamPlan::State::Here);
  }
  EXPECT_FALSE(plan.has_next(true));
  plan.forget(here);
  EXPECT_EQ(plan.missing(), 1U);
  EXPECT_TRUE(plan.has_next(true));
  ASSERT_TRUE(plan.next(place, true));
  EXPECT_EQ(place, here);
  plan.forget(here);  // its load was dropped
  ASSERT_TRUE(plan.next(place, true));
  EXPECT_EQ(place, here);
  EXPECT_FALSE(plan.next(place, true));
}

}  // namespace
}  // namespace quoin
