// Capsules and balls in queries, compared with distances computed by bisection.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/sweep.h>

#include "scene/query/field_scene_for_tests.h"
#include "scene/query/field_search.h"

namespace quoin {
namespace {

Capsule moved(Capsule capsule, DVec3 by) {
  capsule.centre += by;
  return capsule;
}

Capsule random_capsule(Random& random, double size) {
  Capsule capsule{0.1 + std::abs(random.share()), random.vector() * size, random.vector() * 1.5};
  const int kind = static_cast<int>(random.engine() % 4);
  if (kind == 0) capsule.half_axis = DVec3(0.0);
  if (kind == 1) capsule.half_axis = {0.0, std::abs(capsule.half_axis.y), 0.0};
  return capsule;
}

// Finds the minimum of a convex function on [low, high] by ternary search.
template <class Function>
double least_of(double low, double high, const Function& function) {
  for (int i = 0; i < 60; ++i) {
    const double a = low + (high - low) / 3.0;
    const double b = high - (high - low) / 3.0;
    const bool is_lower = function(a) <= function(b);
    (is_lower ? high : low) = is_lower ? b : a;
  }
  return 0.5 * (low + high);
}

// Returns the distance between a capsule's line and a voxel, in the grid's space.
double line_distance(DVec3 centre, DVec3 half_axis, IVec3 voxel) {
  const auto distance = [&](double t) {
    const DVec3 point = centre + t * half_axis;
    return glm::length(point - glm::clamp(point, DVec3(voxel), DVec3(voxel + 1)));
  };
  return distance(least_of(-1.0, 1.0, distance));
}

struct InGrid {
  DVec3 centre, half_axis, displacement;
  double radius;
};

InGrid in_grid(const Instance& instance, const Capsule& capsule, DVec3 displacement) {
  const auto turned = [&](DVec3 v) {
    v = glm::inverse(instance.rotation) * v / instance.voxel_size;
    return instance.mirrored ? DVec3(-v.x, v.y, v.z) : v;
  };
  return {turned(capsule.centre - instance.position), turned(capsule.half_axis), turned(displacement),
          capsule.radius / instance.voxel_size};
}

// Returns true if the capsule's path comes near enough to the voxel to need a search.
bool is_near(const InGrid& capsule, IVec3 voxel) {
  const DVec3 reach = glm::abs(capsule.half_axis) + capsule.radius;
  const DVec3 end = capsule.centre + capsule.displacement;
  const DVec3 low = glm::min(capsule.centre, end) - reach - 0.01;
  const DVec3 high = glm::max(capsule.centre, end) + reach + 0.01;
  for (int axis = 0; axis < 3; ++axis) {
    if (voxel[axis] > high[axis] || voxel[axis] + 1 < low[axis]) return false;
  }
  return true;
}

// Returns the time when a capsule first touches any voxel; 0 if it starts inside.
std::optional<double> first_meeting(const Grid& grid, const InGrid& capsule) {
  std::optional<double> first;
  grid.for_each_row([&](IVec3 row, std::span<const VoxelType> types) {
    for (std::size_t i = 0; i < types.size(); ++i) {
      if (types[i] != kStone) continue;
      const IVec3 voxel = row + IVec3{static_cast<int>(i), 0, 0};
      if (!is_near(capsule, voxel)) continue;
      const auto distance = [&](double time) {
        return line_distance(capsule.centre + time * capsule.displacement, capsule.half_axis, voxel) - capsule.radius;
      };
      double low = 0.0;
      double high = least_of(0.0, 1.0, distance);
      if (distance(high) >= 0.0) continue;
      if (distance(0.0) < 0.0) {
        first = 0.0;
        return;
      }
      for (int step = 0; step < 45; ++step) {
        const double middle = 0.5 * (low + high);
        (distance(middle) < 0.0 ? high : low) = middle;
      }
      if (!first || high < *first) first = high;
    }
  });
  return first;
}

Grid random_voxels(Random& random) {
  Grid grid;
  for (int i = 0; i < 25; ++i) {
    grid.set(IVec3(random.vector() * 4.0), random.engine() % 5 == 0 ? kWater : kStone);
  }
  return grid;
}

TEST(Capsule, SweepsStopAtRadiusFromVoxels) {
  Random random(11);
  int hits = 0;
  int inside = 0;
  for (int i = 0; i < 150; ++i) {
    SceneGrid content;
    content.grid = random_voxels(random);
    const Grid grid = content.grid.snapshot();
    Instance instance;
    if (i % 2 == 1) place_anywhere(instance, random);
    const Scene scene = scene_of(std::move(content), instance);
    const SceneTracer tracer(scene);
    const Instance& placed = scene.instances()[scene.instances().handles().front()];
    for (int n = 0; n < 4; ++n) {
      const Capsule capsule = moved(random_capsule(random, 8.0), placed.position);
      const DVec3 aside = random.vector() * 4.0 * placed.voxel_size;
      const DVec3 displacement =
          n % 2 == 0 ? (placed.position - capsule.centre + aside) * 1.5 : random.direction() * 2.0;
      const auto wanted = first_meeting(grid, in_grid(placed, capsule, displacement));
      const auto hit = sweep_capsule(tracer, capsule, displacement);
      EXPECT_EQ(!overlaps(tracer, capsule).empty(), wanted == 0.0);
      if (hit && !wanted) {
        // A grazing contact: rounding decides.
        EXPECT_TRUE(overlaps(tracer, moved({capsule.radius * (1 + 1e-7), capsule.centre, capsule.half_axis},
                                           hit->fraction * displacement))
                        .size() == 1);
        continue;
      }
      ASSERT_EQ(hit.has_value(), wanted.has_value()) << i << " " << n;
      if (!hit) continue;
      ++hits;
      EXPECT_NEAR(hit->fraction, *wanted, 1e-7);
      EXPECT_NEAR(glm::length(hit->normal), 1.0, 1e-12);
      if (hit->depth > 0.0) {
        ++inside;
        // The depth leads out of that voxel, and a shorter way does not.
        const auto distance = [&](double share) {
          const InGrid out = in_grid(placed, moved(capsule, share * hit->depth * hit->normal), displacement);
          return line_distance(out.centre, out.half_axis, hit->voxel) - out.radius;
        };
        EXPECT_NEAR(distance(1.0), 0.0, 1e-7);
        EXPECT_LT(distance(0.99), 0.0);
        continue;
      }
      EXPECT_LT(glm::dot(hit->normal, displacement), 0.0);
      const Capsule there = moved(capsule, hit->fraction * displacement);
      EXPECT_TRUE(overlaps(tracer, moved(there, 1e-6 * hit->normal)).empty());
      EXPECT_FALSE(overlaps(tracer, moved(there, -1e-6 * hit->normal)).empty());
    }
  }
  EXPECT_GT(hits, 250);
  EXPECT_GT(inside, 30);
}

TEST(Capsule, InvalidCapsulesHitNothing) {
  SceneGrid content;
  content.grid.fill_box({IVec3{-3}, IVec3{3}}, kStone);
  const Scene scene = scene_of(std::move(content), {});
  const SceneTracer tracer(scene);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Capsule& bad : {Capsule{0.5, {nan, 0, 0}}, Capsule{0.5, {0, 0, 0}, {0, kInfinity, 0}}, Capsule{nan},
                             Capsule{0.0}, Capsule{-1.0}, Capsule{kInfinity}}) {
    EXPECT_FALSE(sweep_capsule(tracer, bad, {1, 0, 0}));
    EXPECT_TRUE(overlaps(tracer, bad).empty());
    EXPECT_FALSE(depenetration(tracer, bad, 1.0));
  }
  EXPECT_FALSE(sweep_capsule(tracer, Capsule{}, {nan, 0, 0}));
  const auto hit = sweep_capsule(tracer, Capsule{0.5, {0, 1e7, 0}}, {0, -2e7, 0});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->fraction * 2e7, 1e7 - 4.0, 1e-6);
  EXPECT_TRUE(sweep_capsule(tracer, Capsule{}, DVec3(0.0))) << "it starts inside";
}

TEST(Capsule, FiltersLikeBoxes) {
  SceneGrid content;
  content.grid.set({0, 0, 0}, kWater);
  content.grid.set({0, -3, 0}, kStone);
  const Scene scene = scene_of(std::move(content), {});
  const SceneTracer tracer(scene);
  const Capsule ball{0.4, {0.5, 4.0, 0.5}, DVec3(0.0)};
  const auto through = sweep_capsule(tracer, ball, {0, -10, 0});
  ASSERT_TRUE(through);
  EXPECT_EQ(through->voxel, IVec3(0, -3, 0));
  QueryFilter all;
  all.types = QueryTypes::All;
  EXPECT_EQ(sweep_capsule(tracer, ball, {0, -10, 0}, all)->voxel, IVec3(0, 0, 0));
  const InstanceHandle instance = scene.instances().handles().front();
  QueryFilter without;
  without.ignored = {&instance, 1};
  EXPECT_FALSE(sweep_capsule(tracer, ball, {0, -10, 0}, without));
}

// For distance fields, analysis gives the contact.
TEST(Capsule, StopsAtSurfaceOfField) {
  Random random(4);
  for (int i = 0; i < 60; ++i) {
    const DVec3 normal = random.direction();
    DensityGrid field(64.0F);
    field.edit({IVec3{-12}, IVec3{13}}, [&](IVec3 p, DensitySample) {
      return DensitySample{static_cast<float>(glm::dot(DVec3(p), normal)), kStone};
    });
    const Scene scene = scene_of(std::move(field), {});
    const SceneTracer tracer(scene);
    Capsule capsule = random_capsule(random, 1.0);
    capsule.half_axis *= 0.5;
    const double reach = std::abs(glm::dot(capsule.half_axis, normal)) + capsule.radius;
    capsule.centre += normal * (reach + 1.0 - glm::dot(capsule.centre, normal));
    const DVec3 displacement = -3.0 * normal + 1.0 * glm::cross(normal, random.direction());
    const auto hit = sweep_capsule(tracer, capsule, displacement);
    ASSERT_TRUE(hit) << i;
    EXPECT_TRUE(hit->in_field);
    EXPECT_NEAR(hit->fraction, 1.0 / 3.0, 0.01) << i << ": densities are half floats";
    EXPECT_GT(glm::dot(hit->normal, normal), 0.9995) << i;
    EXPECT_TRUE(overlaps(tracer, moved(capsule, (hit->fraction - 1e-4) * displacement)).empty());
    EXPECT_FALSE(overlaps(tracer, moved(capsule, (hit->fraction + 1e-3) * displacement)).empty());
    const auto out = sweep_capsule(tracer, moved(capsule, -normal * 1.5), displacement);
    ASSERT_TRUE(out);
    EXPECT_NEAR(out->depth, 0.5, 0.02) << i;
    EXPECT_GT(glm::dot(out->normal, normal), 0.99);
  }
}

TEST(Capsule, NeverEntersFieldWithoutHit) {
  Random random(8);
  int hits = 0;
  for (int i = 0; i < 80; ++i) {
    const Scene scene = i % 2 == 0 ? random_blobs(random) : random_noise(random);
    const SceneTracer tracer(scene);
    const Capsule capsule = random_capsule(random, 12.0);
    if (!overlaps(tracer, capsule).empty()) continue;
    const DVec3 displacement = -1.5 * capsule.centre + random.vector() * 3.0;
    const auto hit = sweep_capsule(tracer, capsule, displacement);
    const double end = hit ? hit->fraction : 1.0;
    const DensityGrid& field = scene.grids()[scene.grids().handles().front()].field;
    hits += hit.has_value();
    for (int n = 0; n < 400; ++n) {
      // Points inside the capsule on its way to the contact.
      const DVec3 centre = capsule.centre + displacement * end * std::abs(random.share());
      const DVec3 point = centre + capsule.half_axis * random.share() +
                          random.direction() * (capsule.radius * std::abs(random.share()));
      ASSERT_GT(field.density_at(point), -1e-3) << i;
    }
    if (!hit) continue;
    EXPECT_FALSE(overlaps(tracer, moved(capsule, displacement * hit->fraction - hit->normal * 2e-3)).empty()) << i;
  }
  EXPECT_GT(hits, 30);
}

// Sweeps the largest capsule in a player's box, and the box, one skin above random ground.
struct CountedSweeps {
  std::vector<int> of_capsule;  // cells and parts of cells compared with the shape, per sweep
  std::vector<int> of_box;
};

CountedSweeps count_sweeps(double steepness) {
  Random random(31);
  const DensityGrid field = rolling_ground(random, 24, steepness);
  const DensityTree tree(field);
  const VoxelRegistry types;
  const TypesMet all(types, QueryTypes::All);
  CountedSweeps counted;
  const auto sweep = [&](const auto& shape) {
    FieldSweep<std::decay_t<decltype(shape)>> found(tree, all, shape, 1.0);
    follow_way(shape, 1.0, found);
    return std::pair(found.best().fraction, found.tested());
  };
  for (int i = 0; i < 300; ++i) {
    const double x = 20.0 * random.share();
    const double z = 20.0 * random.share();
    MovingCapsule capsule{{x, height_of(field, x, z) + 3.0, z}, {0.0, 0.5, 0.0}, 0.4, {0.0, -4.0, 0.0}};
    capsule.centre.y -= 4.0 * sweep(capsule).first - 1e-3;
    MovingBox box;
    box.centre = {x, height_of(field, x, z) + 3.0, z};
    box.half_size = {0.4, 0.9, 0.4};
    for (int axis = 0; axis < 3; ++axis) box.half_axes[axis] = box.axes[axis] * box.half_size[axis];
    box.displacement = {0.0, -4.0, 0.0};
    box.centre.y -= 4.0 * sweep(box).first - 1e-3;
    const DVec3 aside = random.direction() * 0.1;
    for (const DVec3 way : {aside, DVec3(aside.x, 0.0, aside.z), DVec3(0.0, -0.4, 0.0)}) {
      capsule.displacement = box.displacement = way;
      counted.of_capsule.push_back(sweep(capsule).second);
      counted.of_box.push_back(sweep(box).second);
    }
  }
  return counted;
}

TEST(Capsule, ComparesFewPartsOfCellsOnGround) {
  for (const double steepness : {0.5, 1.0, 2.0}) {
    CountedSweeps counted = count_sweeps(steepness);
    const auto sum = [](const std::vector<int>& counts) { return std::accumulate(counts.begin(), counts.end(), 0); };
    EXPECT_LE(sum(counted.of_capsule), 3 * sum(counted.of_box)) << steepness;
    std::sort(counted.of_capsule.begin(), counted.of_capsule.end());
    EXPECT_LE(counted.of_capsule[counted.of_capsule.size() * 99 / 100], 60) << steepness;
    EXPECT_LE(counted.of_capsule.back(), 250) << steepness;
  }
}

// The distance from the line is at least the radius at the contact, for points of the solid near it, and the contact
// is not early.
TEST(Capsule, ContactWithFieldIsExact) {
  Random random(77);
  int hits = 0;
  for (int i = 0; i < 60; ++i) {
    const Scene scene = i % 2 == 0 ? random_blobs(random) : scene_of(rolling_ground(random, 14, 1.0 + i % 3), {});
    const SceneTracer tracer(scene);
    Capsule capsule = random_capsule(random, 1.0);
    capsule.centre = random.direction() * 11.0 + DVec3(0.0, i % 2 == 0 ? 0.0 : 14.0, 0.0);
    if (!overlaps(tracer, capsule).empty()) continue;
    const DVec3 displacement = -1.2 * capsule.centre + random.vector() * 3.0;
    const auto hit = sweep_capsule(tracer, capsule, displacement);
    if (!hit) continue;
    ++hits;
    // Deeper than the touch tolerance along the normal there is an overlap; the same distance away there is none.
    const Capsule there = moved(capsule, hit->fraction * displacement);
    EXPECT_TRUE(overlaps(tracer, moved(there, 2e-6 * hit->normal)).empty()) << i;
    EXPECT_FALSE(overlaps(tracer, moved(there, -8e-6 * hit->normal)).empty()) << i;
    EXPECT_LE(glm::dot(hit->normal, displacement), 0.0) << i;
  }
  EXPECT_GT(hits, 30);
}

SlideOptions walking() {
  SlideOptions options;
  options.floor = FloorOptions{{0.0, 1.0, 0.0}, 50.0, 1.05, 0.3};
  return options;
}

TEST(Capsule, WalksLevelGroundStairsAndEdges) {
  SceneGrid content;
  content.grid.fill_box({{-20, -3, -20}, {40, 0, 20}}, kStone);
  for (int step = 0; step < 5; ++step) content.grid.fill_box({{8 + 2 * step, 0, -20}, {40, step + 1, 20}}, kStone);
  const Scene scene = scene_of(std::move(content), {});
  const SceneTracer tracer(scene);
  Capsule player{0.4, {-10.0, 0.9 + 1e-3, 0.37}, {0.0, 0.5, 0.0}};
  bool was_blocked = false;
  for (int frame = 0; frame < 140; ++frame) {
    const SlideResult moved_by = move_and_slide(tracer, player, {0.1, -0.05, 0.03}, walking());
    EXPECT_TRUE(moved_by.is_on_floor) << frame;
    was_blocked |= moved_by.is_blocked;
    player.centre = moved_by.centre;
    if (player.centre.x < 7.0) {
      EXPECT_NEAR(player.centre.y, 0.9, 3e-3) << "nothing catches on level ground";
      EXPECT_FALSE(was_blocked);
    }
  }
  for (int frame = 0; frame < 200; ++frame)
    player.centre = move_and_slide(tracer, player, {0.1, -0.05, 0.0}, walking()).centre;
  EXPECT_NEAR(player.centre.y, 5.0 + 0.9, 3e-3) << "up the stairs";
}

// In a crease of two steep slopes, a move meets the same walls again and again without getting anywhere.
TEST(Capsule, AttemptsStepOncePerWallInCrease) {
  for (const double degrees : {58.0, 65.0, 75.0}) {
    const double angle = degrees * std::numbers::pi / 180.0;
    SceneGrid content;
    content.field.edit({{-12, -4, -12}, {13, 24, 13}}, [&](IVec3 p, DensitySample) {
      const double height = 0.3 * p.z + std::tan(angle) * std::abs(p.x + 0.4 * p.z + 0.3);
      return DensitySample{static_cast<float>((p.y - height) * std::cos(angle)), kStone};
    });
    const Scene scene = scene_of(std::move(content), {});
    const SceneTracer tracer(scene);
    for (const DVec3 way : {DVec3(0.1, -0.2, 0.06), DVec3(-0.08, -0.3, 0.1), DVec3(0.02, -0.1, 0.1)}) {
      Capsule player{0.4, {-0.3, 4.0, 0.0}, {0.0, 0.5, 0.0}};
      int most = 0;
      for (int frame = 0; frame < 120; ++frame) {
        const SlideResult result = move_and_slide(tracer, player, way, walking());
        player.centre = result.centre;
        most = std::max(most, result.sweeps);
      }
      EXPECT_GT(most, 6) << "it attempts steps";
      EXPECT_LE(most, 32) << degrees << ": five steps, one per contact, are 33 sweeps and more";
    }
  }
}

TEST(Capsule, IsPushedOutToFreePosition) {
  Random random(21);
  SceneGrid content;
  content.grid.fill_box({{0, 0, 0}, {100, 20, 100}}, kStone);
  content.grid.fill_box({{49, 20, 49}, {52, 21, 52}}, kStone);
  const Scene scene = scene_of(std::move(content), {});
  const SceneTracer tracer(scene);
  const Capsule player{0.4, {50.5, 20.95, 50.5}, {0.0, 0.5, 0.0}};
  const auto away = depenetration(tracer, player, 2.0);
  ASSERT_TRUE(away);
  EXPECT_TRUE(overlaps(tracer, moved(player, *away)).empty());
  EXPECT_NEAR(away->y, 0.95, 2.0 / 32.0);
  EXPECT_LT(std::hypot(away->x, away->z), 0.4);
  EXPECT_FALSE(depenetration(tracer, player, 0.5));
  // Random heaps: the result is free, and none of many other positions is much nearer.
  for (int i = 0; i < 25; ++i) {
    SceneGrid heap;
    for (int n = 0; n < 150; ++n) heap.grid.set(IVec3(random.vector() * 4.0), kStone);
    const Scene heaps = scene_of(std::move(heap), {});
    const SceneTracer among(heaps);
    const Capsule capsule = random_capsule(random, 2.0);
    const auto found = depenetration(among, capsule, 4.0);
    if (found) {
      EXPECT_TRUE(overlaps(among, moved(capsule, *found)).empty());
    }
    const double length = found ? glm::length(*found) : 4.0;
    for (int n = 0; n < 300; ++n) {
      const DVec3 other = random.direction() * std::max(length - 4.0 / 32.0, 0.0) * std::abs(random.share());
      if (length <= 4.0 / 32.0) break;
      EXPECT_FALSE(overlaps(among, moved(capsule, other)).empty()) << i;
    }
  }
  const SlideResult out = move_and_slide(tracer, player, {0.0, -0.01, 0.0}, walking());
  EXPECT_TRUE(overlaps(tracer, moved(player, out.centre - player.centre)).empty());
}

}  // namespace
}  // namespace quoin
