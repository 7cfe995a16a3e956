#include <quoin/trace/ray.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "bench/workloads.h"
#include "core/instruction_sets_for_tests.h"
#include "core/not_finite_for_tests.h"
#include "core/work/nightly_for_tests.h"
#include "grid/change_follower_for_tests.h"
#include "mesh/mesh_oracle.h"
#include "trace/trace_oracle.h"

namespace quoin {
namespace {

// Returns the distance from a point of the ray to the nearest edge of the voxel lattice.
double distance_to_edge(const DVec3& p) {
  std::array<double, 3> off{};
  for (int a = 0; a < 3; ++a) off[static_cast<std::size_t>(a)] = std::abs(p[a] - std::round(p[a]));
  std::sort(off.begin(), off.end());
  return std::sqrt(off[0] * off[0] + off[1] * off[1]);
}

struct Tally {
  int rays = 0;
  int hits = 0;
  int excused = 0;
};

// Compares one ray with the dense tracer by the specification's definition of agreement.
void compare(const Grid& grid, const OccupancyTree& tree, const Ray& ray, double max_t, Tally& tally) {
  const auto fast = first_hit(tree, ray, max_t);
  const auto dense = oracle::dense_first_hit(grid, grid.bounds(), ray, max_t);
  ++tally.rays;
  tally.hits += dense.has_value();
  ASSERT_EQ(any_hit(tree, ray, max_t), fast.has_value());
  const bool agrees = fast.has_value() == dense.has_value() &&
                      (!fast || (fast->voxel == dense->voxel && fast->starts_inside == dense->starts_inside &&
                                 (fast->starts_inside || fast->face == dense->face) &&
                                 std::abs(fast->t - dense->t) <= 1e-4 * std::max(1.0, dense->t)));
  if (agrees) return;
  ++tally.excused;
  // Only grazing hits may differ, and then the hit must be a voxel that the ray touches.
  double nearest = kInfinity;
  for (const auto& hit : {fast, dense}) {
    if (hit) nearest = std::min(nearest, distance_to_edge(ray.origin + ray.direction * hit->t));
  }
  EXPECT_LT(nearest, 1e-3) << ray.origin.x << ' ' << ray.origin.y << ' ' << ray.origin.z << " -> " << ray.direction.x
                           << ' ' << ray.direction.y << ' ' << ray.direction.z;
}

class Rays : public testing::TestWithParam<unsigned> {
 protected:
  void SetUp() override {
    grid_ = oracle::random_world(GetParam(), {IVec3{-90, -40, -70}, IVec3{80, 90, 75}}, 3, 0.0005 * (GetParam() % 4));
    tree_ = OccupancyTree::build(grid_, oracle::mixed_types());
  }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  DVec3 point() { return {uniform(-120, 110), uniform(-70, 120), uniform(-100, 105)}; }
  DVec3 direction() {
    for (;;) {
      const DVec3 d{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
      const double length = glm::length(d);
      if (length > 0.1 && length <= 1.0) return d / length;
    }
  }
  int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }

  std::mt19937 random_{GetParam()};
  Grid grid_;
  OccupancyTree tree_;
};

TEST_P(Rays, RandomRaysMatchDenseTracer) {
  Tally tally;
  for (int i = 0; i < 20'000; ++i) compare(grid_, tree_, {point(), direction()}, kInfinity, tally);
  EXPECT_GT(tally.hits, 20);
  EXPECT_LE(tally.excused, tally.rays / 1'000);
}

TEST_P(Rays, ShortRaysMatchDenseTracer) {
  Tally tally;
  for (int i = 0; i < 20'000; ++i) compare(grid_, tree_, {point(), direction()}, uniform(0, 8), tally);
  EXPECT_LE(tally.excused, tally.rays / 1'000);
}

TEST_P(Rays, AxisAlignedRaysMatchDenseTracer) {
  Tally tally;
  const double zeros[] = {0.0, -0.0, 1.0, -1.0};
  for (int i = 0; i < 20'000; ++i) {
    DVec3 d{0.0};
    while (d == DVec3{0.0}) d = {zeros[whole(0, 3)], zeros[whole(0, 3)], zeros[whole(0, 3)]};
    if (i % 3 == 0) d[whole(0, 2)] = uniform(-1, 1);
    DVec3 o = point();
    if (i % 2 == 0) o[whole(0, 2)] = whole(-60, 60);  // starts on a face
    compare(grid_, tree_, {o, d}, kInfinity, tally);
  }
  EXPECT_GT(tally.hits, 20);
}

TEST_P(Rays, RaysThroughEdgesAndCornersMatchDenseTracer) {
  Tally tally;
  const double signs[] = {-1.0, 1.0};
  for (int i = 0; i < 20'000; ++i) {
    const DVec3 o{DVec3(whole(-100, 90), whole(-60, 110), whole(-90, 95))};
    DVec3 d{signs[whole(0, 1)], signs[whole(0, 1)], signs[whole(0, 1)]};
    if (i % 2 == 0) d[whole(0, 2)] = 0.0;
    compare(grid_, tree_, {o + (i % 3 == 0 ? DVec3{0.5} : DVec3{0.0}), d}, kInfinity, tally);
  }
  EXPECT_GT(tally.hits, 20);
  EXPECT_EQ(tally.excused, 0) << "whole numbers leave nothing to round";
}

TEST_P(Rays, DistantRaysMatchDenseTracer) {
  Tally tally;
  for (int i = 0; i < 300; ++i) {
    const DVec3 target = point() * 0.5;
    const DVec3 d = direction();
    compare(grid_, tree_, {target - d * uniform(1e3, 2e4), d}, kInfinity, tally);
  }
  EXPECT_GT(tally.hits, 10);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Rays, testing::Range(1U, static_cast<unsigned>(cases(7, 13))));

TEST(Ray, HitsAreTheSameFarFromOrigin) {
  const IVec3 away{1'000'000'000, -1'000'000'000, 999'999'937};
  Grid near;
  Grid far;
  near.fill_sphere({0, 0, 0}, 20, 1);
  far.fill_sphere(DVec3(away), 20, 1);
  const VoxelRegistry types = oracle::mixed_types();
  const OccupancyTree near_tree = OccupancyTree::build(near, types);
  const OccupancyTree far_tree = OccupancyTree::build(far, types);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-40.0, 40.0);
  int hits = 0;
  for (int i = 0; i < 5'000; ++i) {
    // Origins that are exact at both positions.
    const DVec3 o = glm::floor(DVec3(uniform(random), uniform(random), uniform(random)) * 1024.0) / 1024.0;
    const DVec3 d{uniform(random), uniform(random), uniform(random)};
    const auto a = first_hit(near_tree, {o, d});
    const auto b = first_hit(far_tree, {o + DVec3(away), d});
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) continue;
    ++hits;
    EXPECT_EQ(a->voxel + away, b->voxel);
    EXPECT_EQ(a->face, b->face);
    EXPECT_NEAR(a->t, b->t, 1e-6);
  }
  EXPECT_GT(hits, 500);
}

TEST(Ray, RejectsNonFiniteRay) {
  Grid grid;
  grid.fill_box({{-5, -5, -5}, {6, 6, 6}}, 1);
  const OccupancyTree tree = OccupancyTree::build(grid, oracle::mixed_types());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(first_hit(tree, {{0, 0, 0}, {0, 0, 0}}).has_value());
  EXPECT_FALSE(first_hit(tree, {{nan, 0, 0}, {1, 0, 0}}).has_value());
  EXPECT_FALSE(first_hit(tree, {{0, 0, 0}, {kInfinity, 0, 0}}).has_value());
  EXPECT_FALSE(first_hit(tree, {{0, 0, 0}, {1, 0, 0}}, nan).has_value());
  EXPECT_FALSE(first_hit(tree, {{0, 0, 0}, {1, 0, 0}}, -1).has_value());
  EXPECT_FALSE(first_hit(OccupancyTree::build(Grid(), oracle::mixed_types()), {{0, 0, 0}, {1, 0, 0}}).has_value());
  EXPECT_TRUE(first_hit(tree, {{0, 0, 0}, {1e-300, 0, 0}}).has_value());
  EXPECT_TRUE(first_hit(tree, {{-1e6, 0.5, 0.5}, {1, 0, 0}}).has_value());
}

TEST(Ray, HitsImmediatelyFromInside) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {10, 10, 10}}, 1);
  const OccupancyTree tree = OccupancyTree::build(grid, oracle::mixed_types());
  const auto hit = first_hit(tree, {{5.5, 5.5, 5.5}, {0.2, -0.9, 0.1}});
  ASSERT_TRUE(hit.has_value());
  EXPECT_TRUE(hit->starts_inside);
  EXPECT_EQ(hit->t, 0.0);
  EXPECT_EQ(hit->voxel, IVec3(5, 5, 5));
  EXPECT_EQ(hit->face, Direction::PosY);
}

TEST(Ray, HitsVoxelThatStartsAtEnd) {
  Grid grid;
  grid.set({10, 0, 0}, 1);
  const OccupancyTree tree = OccupancyTree::build(grid, oracle::mixed_types());
  EXPECT_TRUE(any_hit(tree, {{0.5, 0.5, 0.5}, {1, 0, 0}}, 9.5));
  EXPECT_FALSE(any_hit(tree, {{0.5, 0.5, 0.5}, {1, 0, 0}}, 9.4999));
}

// Rays from far away are moved to the bounds first. A flat floor is one face of these bounds.
TEST(Ray, HitsWithinReportedDistance) {
  Grid grid;
  grid.fill_box({{-200, -5, -200}, {201, 1, 201}}, 1);
  const OccupancyTree tree = OccupancyTree::build(grid, oracle::mixed_types());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-190.0, 190.0);
  for (int i = 0; i < 20'000; ++i) {
    const DVec3 from = glm::floor(DVec3{uniform(random), 200.0 + uniform(random) / 2, uniform(random)} * 10.0) / 10.0;
    const Ray ray{from, DVec3{uniform(random), 0.0, uniform(random)} - from};
    const auto hit = first_hit(tree, ray);
    ASSERT_TRUE(hit);
    for (const InstructionSet set : sets_of_this_machine()) {
      const InstructionSetOverride over(set);
      ASSERT_TRUE(first_hit(tree, ray, hit->t));
      ASSERT_TRUE(any_hit(tree, ray, hit->t));
      ASSERT_FALSE(any_hit(tree, ray, std::nextafter(hit->t, 0.0)));
    }
  }
}

TEST(OccupancyTree, ContainsRequestedTypesAndFollowsEdits) {
  const VoxelRegistry types = oracle::mixed_types();
  Grid grid = oracle::random_world(3, {IVec3{-70}, IVec3{70}}, 5, 0.001);
  std::array<OccupancyTree, 3> trees;
  for (int which = 0; which < 3; ++which) {
    trees[static_cast<std::size_t>(which)] = OccupancyTree::build(grid, types, static_cast<Occupancy>(which));
  }
  ChangeFollower follower(grid);
  std::mt19937 random(9);
  const auto near = [&] { return static_cast<int>(random() % 150) - 75; };
  for (int round = 0; round < 12; ++round) {
    if (round % 2 == 0) {
      grid.fill_sphere({near(), near(), near()}, 20.0, static_cast<VoxelType>(random() % 6));
    } else {
      grid.set({near(), near(), near()}, static_cast<VoxelType>(random() % 6));
    }
    const GridChanges dirty = follower.changes(grid);
    for (OccupancyTree& tree : trees) {
      tree.update(grid, types, dirty);
    }
    for (int i = 0; i < 20'000; ++i) {
      const IVec3 v{near(), near(), near()};
      const VoxelType type = grid.get(v);
      ASSERT_EQ(trees[0].is_occupied(v), type != kAir);
      ASSERT_EQ(trees[1].is_occupied(v), types.is_opaque(type));
      ASSERT_EQ(trees[2].is_occupied(v), types.is_transparent(type));
    }
    EXPECT_EQ(trees[0].bounds(), grid.bounds());
  }
  grid.clear();
  trees[0].update(grid, types, follower.changes(grid));
  EXPECT_TRUE(trees[0].bounds().empty());
}

}  // namespace
}  // namespace quoin
