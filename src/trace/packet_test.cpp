#include <quoin/trace/packet.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "core/instruction_sets_for_tests.h"
#include "core/not_finite_for_tests.h"
#include "core/work/nightly_for_tests.h"
#include "grid/change_follower_for_tests.h"
#include "mesh/mesh_oracle.h"
#include "trace/kernel/ray_kernel.h"
#include "trace/trace_oracle.h"
#include "trace/tree_view.h"

namespace quoin {
namespace {

void expect_same(const PacketHits& a, const PacketHits& b) {
  ASSERT_EQ(a.hit, b.hit);
  ASSERT_EQ(a.starts_inside, b.starts_inside);
  for (int lane = 0; lane < RayPacket::kSize; ++lane) {
    if ((a.hit >> lane & 1U) == 0) continue;
    ASSERT_EQ(a[lane].voxel, b[lane].voxel);
    ASSERT_EQ(a[lane].t, b[lane].t);
    ASSERT_EQ(a[lane].face, b[lane].face);
  }
}

// Packets of mixed rays: random, short, along axes, from faces, from far away, of unusual lengths.
class Packets : public testing::TestWithParam<std::tuple<unsigned, InstructionSet>> {
 protected:
  void SetUp() override {
    QUOIN_SKIP_WITHOUT(set());
    grid_ = oracle::random_world(seed(), {IVec3{-90, -40, -70}, IVec3{80, 90, 75}}, 3, 0.0005 * (seed() % 4));
    tree_ = OccupancyTree::build(grid_, oracle::mixed_types());
  }
  static unsigned seed() { return std::get<0>(GetParam()); }
  static InstructionSet set() { return std::get<1>(GetParam()); }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }

  Ray ray() {
    Ray ray{{uniform(-120, 110), uniform(-70, 120), uniform(-100, 105)},
            {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}};
    const double few[] = {0.0, -0.0, 1.0, -1.0};
    switch (whole(0, 7)) {
      case 0:
        ray.direction[whole(0, 2)] = few[whole(0, 1)];
        break;
      case 1:
        ray.direction = {few[whole(0, 3)], few[whole(0, 3)], few[whole(2, 3)]};
        ray.origin[whole(0, 2)] = whole(-60, 60);
        break;
      case 2:
        ray.origin = glm::floor(ray.origin);
        break;
      case 3:
        ray.origin -= ray.direction * uniform(0, 3e3);
        break;
      case 4:
        ray.direction *= std::exp2(whole(-40, 40));
        break;
      case 5:
        ray.direction[whole(0, 2)] *= std::exp2(whole(-200, -10));
        break;
      default:
        break;
    }
    return ray;
  }

  RayPacket packet() {
    RayPacket rays;
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      if (whole(0, 9) != 0) rays.set(lane, ray(), whole(0, 1) == 0 ? uniform(0, whole(0, 1) == 0 ? 8 : 30) : kInfinity);
    }
    return rays;
  }

  // Returns rays from one point, or from near it, in about one direction.
  RayPacket beam() {
    const Ray middle = ray();
    const double distance = whole(0, 1) == 0 ? 0.0 : uniform(0, 8);
    const double spread = std::exp2(whole(-12, -1));
    RayPacket rays;
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      Ray one = middle;
      for (int axis = 0; axis < 3; ++axis) {
        one.origin[axis] += distance * uniform(-0.5, 0.5);
        if (whole(0, 7) != 0) one.direction[axis] *= 1 + spread * uniform(-1, 1);
        if (whole(0, 40) == 0) one.direction[axis] = 0;
        if (whole(0, 9) == 0) one.origin[axis] = std::floor(one.origin[axis]);
      }
      if (whole(0, 15) != 0) rays.set(lane, one, whole(0, 3) == 0 ? uniform(0, 200) : kInfinity);
    }
    return rays;
  }

  // Returns short rays from about one point in any direction, similar to occlusion rays; sometimes one has an invalid
  // origin.
  RayPacket bunch() {
    const DVec3 middle = glm::floor(ray().origin * 0.9);
    const double length = std::exp2(whole(0, 3) == 0 ? whole(-18, 18) : 0);
    RayPacket rays;
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      Ray one = ray();
      one.direction *= length / std::max(1e-300, glm::length(one.direction));
      const double limit = (whole(0, 2) == 0 ? whole(0, 20) : uniform(0, 20)) / length;
      for (int axis = 0; axis < 3; ++axis) {
        one.origin[axis] = middle[axis] + (whole(0, 3) == 0 ? 0.5 * whole(-2, 2) : uniform(-3, 3));
        if (whole(0, 9) == 0) one.direction[axis] *= std::exp2(whole(-60, -8));
      }
      if (whole(0, 15) != 0) rays.set(lane, one, limit);
    }
    const double strays[] = {5e9,        -5e9,         4e9 + 65,     1e12,         kInfinity,
                             -kInfinity, std::nan(""), 2147483647.0, -2147483648.0};
    const auto lane = static_cast<std::size_t>(whole(1, RayPacket::kSize - 1));
    RayPacket::Lanes<double>* const axes[] = {&rays.origin_x, &rays.origin_y, &rays.origin_z};
    if (whole(0, 3) == 0) (*axes[whole(0, 2)])[lane] = strays[whole(0, 8)] + whole(-2, 2);
    return rays;
  }

  std::mt19937 random_{seed()};
  Grid grid_;
  OccupancyTree tree_;
};

// Compares plain rays with rays of an instruction set, in a packet and alone. Returns the number of hits.
int hits_if_all_agree(const OccupancyTree& tree, const RayPacket& rays, InstructionSet with) {
  const InstructionSet sets[] = {InstructionSet::Plain, with};
  int hits = 0;
  const auto check = [&] {
    std::array<PacketHits, 2> found;
    for (std::size_t i = 0; i < 2; ++i) {
      const InstructionSetOverride over(sets[i]);
      first_hits(tree, rays, found[i]);
      ASSERT_EQ(any_hits(tree, rays), found[i].hit);
    }
    ASSERT_NO_FATAL_FAILURE(expect_same(found[0], found[1]));
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      if ((rays.active >> lane & 1U) == 0) continue;
      const double max_t = rays.max_t[static_cast<std::size_t>(lane)];
      for (const InstructionSet set : sets) {
        const InstructionSetOverride over(set);
        const auto single = first_hit(tree, rays.ray(lane), max_t);
        ASSERT_EQ(single.has_value(), (found[0].hit >> lane & 1U) != 0);
        ASSERT_EQ(any_hit(tree, rays.ray(lane), max_t), single.has_value());
        if (!single) continue;
        ASSERT_EQ(single->voxel, found[0][lane].voxel);
        ASSERT_EQ(single->t, found[0][lane].t);
        ASSERT_EQ(single->face, found[0][lane].face);
        ASSERT_EQ(single->starts_inside, found[0][lane].starts_inside);
      }
      hits += (found[0].hit >> lane & 1U) != 0 ? 1 : 0;
    }
  };
  check();
  return hits;
}

// Limits each ray exactly to its hit, and to the adjacent numbers.
void limit_to_hits(const OccupancyTree& tree, RayPacket& rays, InstructionSet with, std::mt19937& random) {
  for (int lane = 0; lane < RayPacket::kSize; ++lane) {
    const auto hit = first_hit(tree, rays.ray(lane), rays.max_t[static_cast<std::size_t>(lane)]);
    if (!hit) continue;
    const double towards[] = {-1.0, hit->t, kInfinity};
    const double limit = std::nextafter(hit->t, towards[random() % 3]);
    rays.max_t[static_cast<std::size_t>(lane)] = limit;
    for (const InstructionSet set : {InstructionSet::Plain, with}) {
      const InstructionSetOverride over(set);
      ASSERT_EQ(first_hit(tree, rays.ray(lane), limit).has_value(), hit->t <= limit);
      ASSERT_EQ(any_hit(tree, rays.ray(lane), limit), hit->t <= limit);
    }
  }
}

TEST_P(Packets, MatchPlainPacketsAndSingleRays) {
  int hits = 0;
  for (int i = 0; i < 5'000; ++i) {
    RayPacket rays = packet();
    hits += hits_if_all_agree(tree_, rays, set());
    limit_to_hits(tree_, rays, set(), random_);
    hits_if_all_agree(tree_, rays, set());
    ASSERT_FALSE(HasFatalFailure()) << "packet " << i;
  }
  EXPECT_GT(hits, 500);
}

// Compares the results for arrays of packets with those of single plain rays. Returns the number of hits.
int hits_if_array_agrees(const OccupancyTree& tree, const std::vector<RayPacket>& packets, InstructionSet with) {
  std::vector<std::uint32_t> expected(packets.size());
  int hits = 0;
  for (std::size_t i = 0; i < packets.size(); ++i) {
    const InstructionSetOverride over(InstructionSet::Plain);
    for (std::uint32_t left = packets[i].active; left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      const bool is_hit = any_hit(tree, packets[i].ray(lane), packets[i].max_t[static_cast<std::size_t>(lane)]);
      expected[i] |= std::uint32_t{is_hit} << lane;
    }
    hits += std::popcount(expected[i]);
  }
  constexpr std::uint32_t kUntouched = 0xABCD1234;
  for (const InstructionSet set : {InstructionSet::Plain, with}) {
    const InstructionSetOverride over(set);
    std::vector<std::uint32_t> found(packets.size() + 1, kUntouched);
    any_hits(tree, packets, found);
    EXPECT_EQ(found.back(), kUntouched);
    found.pop_back();
    EXPECT_EQ(found, expected) << name_in_tests(set);
  }
  return hits;
}

TEST_P(Packets, ArraysMatchSingleRays) {
  int hits = 0;
  for (int i = 0; i < 200 && !HasFailure(); ++i) {
    std::vector<RayPacket> packets(static_cast<std::size_t>(whole(0, 3) == 0 ? whole(0, 3) : whole(4, 60)));
    const bool is_endless = whole(0, 2) != 0;
    for (RayPacket& rays : packets) {
      const int kind = whole(0, 3);
      rays = kind == 0 ? packet() : kind == 1 ? bunch() : beam();
      if (is_endless || whole(0, 1) == 0) rays.max_t.fill(kInfinity);
      if (whole(0, 5) == 0) rays.active &= static_cast<std::uint32_t>(whole(0, 0xFFFF));
    }
    hits += hits_if_array_agrees(tree_, packets, set());
  }
  EXPECT_GT(hits, 1'000);
}

// As shadow rays: from the faces of voxels, most of them blocked soon or never.
TEST_P(Packets, ArraysOfShadowRaysMatchSingleRays) {
  int hits = 0;
  for (int i = 0; i < 100 && !HasFailure(); ++i) {
    const DVec3 sun = glm::normalize(DVec3{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)});
    std::vector<RayPacket> packets(static_cast<std::size_t>(whole(1, 40)));
    for (RayPacket& rays : packets) {
      for (int lane = 0; lane < RayPacket::kSize; ++lane) {
        const Ray towards = ray();
        const auto hit = first_hit(tree_, towards);
        if (!hit) continue;
        const DVec3 lift = (whole(0, 2) == 0 ? 0.0 : 0.001) * DVec3(normal_of(hit->face));
        rays.set(lane, {towards.origin + towards.direction * hit->t + lift, sun}, kInfinity);
      }
    }
    hits += hits_if_array_agrees(tree_, packets, set());
  }
  EXPECT_GT(hits, 400);
}

// Values in inactive lanes change no bit, however small they are.
TEST_P(Packets, IgnoreInactiveLanes) {
  const InstructionSetOverride over(set());
  int hits = 0;
  for (int i = 0; i < 1'000; ++i) {
    RayPacket rays = whole(0, 2) == 0 ? bunch() : packet();
    rays.active &= static_cast<std::uint32_t>(whole(1, 0xFFFF));
    PacketHits expected;
    first_hits(tree_, rays, expected);
    const std::uint32_t blocked = any_hits(tree_, rays);
    hits += std::popcount(blocked);
    for (const double number : {0.0, 1e-40, -1e-310, 1e-310, 1e300, kInfinity, std::nan("")}) {
      for (int lane = 0; lane < RayPacket::kSize; ++lane) {
        if ((rays.active >> lane & 1U) != 0) continue;
        const std::uint32_t active = rays.active;
        rays.set(lane, {DVec3(number), DVec3(number)}, number);
        rays.active = active;
      }
      PacketHits found;
      first_hits(tree_, rays, found);
      ASSERT_NO_FATAL_FAILURE(expect_same(expected, found)) << "packet " << i << " with " << number;
      ASSERT_EQ(any_hits(tree_, rays), blocked) << "packet " << i << " with " << number;
    }
  }
  EXPECT_GT(hits, 100);
}

TEST_P(Packets, RaysWithTinyDirectionComponentsAgree) {
  int hits = 0;
  for (int i = 0; i < 1'000; ++i) {
    RayPacket rays;
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      Ray tiny = ray();
      tiny.direction[whole(0, 2)] = whole(0, 1) == 0 ? 1e-40 : -1e-310;
      rays.set(lane, tiny, whole(0, 1) == 0 ? 6.0 : kInfinity);
    }
    hits += hits_if_all_agree(tree_, rays, set());
    ASSERT_FALSE(HasFatalFailure()) << "packet " << i;
  }
  EXPECT_GT(hits, 100);
}

TEST_P(Packets, ParallelRaysAgree) {
  int hits = 0;
  for (int i = 0; i < 4'000; ++i) {
    hits += hits_if_all_agree(tree_, beam(), set());
    ASSERT_FALSE(HasFatalFailure()) << "packet " << i;
  }
  EXPECT_GT(hits, 1'000);
}

TEST_P(Packets, ShortRaysFromNearbyOriginsAgree) {
  int hits = 0;
  for (int i = 0; i < 5'000; ++i) {
    RayPacket rays = bunch();
    hits += hits_if_all_agree(tree_, rays, set());
    limit_to_hits(tree_, rays, set(), random_);
    hits_if_all_agree(tree_, rays, set());
    ASSERT_FALSE(HasFatalFailure()) << "packet " << i;
  }
  EXPECT_GT(hits, 300);
}

// Voxels fill whole chunks, so that rays reach the ends of the tables.
TEST_P(Packets, ShortRaysAtEndsOfWorldAgree) {
  Grid grid;
  const IVec3 corner = IVec3{whole(-2, 1), whole(-2, 1), whole(-2, 1)} * kChunkEdge;
  const IVec3 size = IVec3{whole(1, 2), whole(1, 2), whole(1, 2)} * kChunkEdge;
  const unsigned one_in = seed() % 2 == 0 ? 2 : 40;
  grid.edit({corner, corner + size}, [&](IVec3, VoxelType) { return static_cast<VoxelType>(random_() % one_in == 0); });
  const OccupancyTree tree = OccupancyTree::build(grid, oracle::mixed_types());
  int hits = 0;
  for (int i = 0; i < 3'000; ++i) {
    RayPacket rays = bunch();
    const DVec3 first = rays.ray(0).origin;
    const DVec3 end = DVec3(corner) + DVec3(size) * DVec3(whole(0, 2), whole(0, 2), whole(0, 2)) * 0.5;
    for (std::size_t lane = 0; lane < RayPacket::kSize; ++lane) {
      rays.origin_x[lane] += std::floor(end.x - first.x) + whole(-7, 7);
      rays.origin_y[lane] += std::floor(end.y - first.y) + whole(-7, 7);
      rays.origin_z[lane] += std::floor(end.z - first.z) + whole(-7, 7);
    }
    hits += hits_if_all_agree(tree, rays, set());
    ASSERT_FALSE(HasFatalFailure()) << "packet " << i;
  }
  EXPECT_GT(hits, 1'000);
}

// Rays that are moved to the bounds and enter them where planes meet, or nearly miss them.
TEST_P(Packets, DistantRaysToEdgesAndCornersAgree) {
  Grid grid;
  const IVec3 corner{whole(-40, 40), whole(-40, 40), whole(-40, 40)};
  grid.fill_box({corner, corner + IVec3{whole(1, 40), whole(1, 40), whole(1, 40)}}, VoxelType{1});
  const OccupancyTree tree = OccupancyTree::build(grid, oracle::mixed_types());
  const IBox bounds = tree.bounds();
  const auto toward_bounds = [&] {
    Ray ray{DVec3(0.0), {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}};
    if (whole(0, 1) == 0) ray.direction = glm::sign(ray.direction) * std::exp2(whole(-4, 4));
    if (whole(0, 3) == 0) ray.direction[whole(0, 2)] = whole(0, 1) == 0 ? 0.0 : -0.0;
    const double distance = whole(0, 1) == 0 ? whole(100, 5'000) : uniform(100, 5'000);
    for (int axis = 0; axis < 3; ++axis) {
      const double ends[] = {static_cast<double>(bounds.min[axis]), static_cast<double>(bounds.max[axis])};
      const double end = ends[whole(0, 1)];
      const double targets[] = {end, end, end + uniform(-2e-3, 2e-3), uniform(ends[0], ends[1])};
      ray.origin[axis] = targets[whole(0, 3)] - ray.direction[axis] * distance;
    }
    return ray;
  };
  int hits = 0;
  for (int i = 0; i < 2'000; ++i) {
    RayPacket rays;
    for (int lane = 0; lane < RayPacket::kSize; ++lane)
      rays.set(lane, toward_bounds(), whole(0, 3) == 0 ? uniform(0, 10'000) : kInfinity);
    hits += hits_if_all_agree(tree, rays, set());
    limit_to_hits(tree, rays, set(), random_);
    hits_if_all_agree(tree, rays, set());
    ASSERT_FALSE(HasFatalFailure()) << "packet " << i;
  }
  EXPECT_GT(hits, 1'000);
}

// Beyond the 4^3 chunks that a beam reads at a time, and beyond the range of single precision.
TEST_P(Packets, ParallelRaysThroughLongWorldAgree) {
  Grid grid;
  for (int i = 0; i < 400; ++i) {
    const IVec3 corner{whole(-1'500, 2'500), whole(-40, 90), whole(-70, 75)};
    grid.fill_box({corner, corner + IVec3{whole(1, 4) + 1, whole(1, 4) + 1, whole(1, 4) + 1}}, VoxelType{1});
  }
  const OccupancyTree tree = OccupancyTree::build(grid, oracle::mixed_types());
  ASSERT_NE(tree.view(), nullptr);
  int hits = 0;
  for (int i = 0; i < 3'000; ++i) {
    RayPacket rays = beam();
    for (std::size_t lane = 0; lane < RayPacket::kSize; ++lane) {
      rays.direction_x[lane] *= 20;
      rays.origin_x[lane] *= 15;
    }
    hits += hits_if_all_agree(tree, rays, set());
    ASSERT_FALSE(HasFatalFailure()) << "packet " << i;
  }
  EXPECT_GT(hits, 500);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Packets,
                         testing::Combine(testing::Range(1U, static_cast<unsigned>(cases(5, 9))),
                                          testing::Values(InstructionSet::Avx2, InstructionSet::Avx512)),
                         [](const auto& each) {
                           return std::to_string(std::get<0>(each.param)) + name_in_tests(std::get<1>(each.param));
                         });

// Rays of every kind give the same results in a tree that followed edits and in a new tree.
TEST(PacketTracing, UpdatedTreeMatchesNewTree) {
  const VoxelRegistry types = oracle::mixed_types();
  Grid grid;
  grid.fill_box({{-70, -70, -70}, {71, -19, 71}}, 1);
  OccupancyTree tree = OccupancyTree::build(grid, types);
  ChangeFollower follower(grid);
  std::mt19937 random(3);
  const auto near = [&](int reach) { return static_cast<int>(random() % static_cast<unsigned>(2 * reach)) - reach; };
  for (int round = 0; round < 24; ++round) {
    // Within the box of chunks, and sometimes beyond it.
    const int reach = round % 6 == 5 ? 400 : 70;
    const auto type = static_cast<VoxelType>(random() % 3);
    if (round % 2 == 0) {
      grid.fill_sphere({near(reach), near(reach), near(reach)}, 15.0, type);
    } else {
      grid.set({near(reach), near(reach), near(reach)}, type);
    }
    tree.update(grid, types, follower.changes(grid));
    const OccupancyTree fresh = OccupancyTree::build(grid, types);
    ASSERT_EQ(tree.bounds(), fresh.bounds());
    for (int i = 0; i < 200; ++i) {
      RayPacket rays;
      for (int lane = 0; lane < RayPacket::kSize; ++lane) {
        const DVec3 o{near(90) + 0.5, near(90) + 0.25, near(90) + 0.125};
        rays.set(lane, {o, {near(1000) + 0.5, near(1000), near(1000)}}, kInfinity);
      }
      PacketHits followed;
      PacketHits expected;
      first_hits(tree, rays, followed);
      first_hits(fresh, rays, expected);
      ASSERT_NO_FATAL_FAILURE(expect_same(followed, expected));
    }
  }
}

// Rays too long for single precision, and worlds without flat tables, are walked in double precision.
TEST(PacketTracing, MatchesDenseTracerOverLongDistances) {
  const VoxelRegistry types = oracle::mixed_types();
  for (const int gap : {5'000, 1'000'000}) {
    Grid grid;
    grid.fill_box({{0, 0, 0}, {9, 41, 41}}, 1);
    grid.fill_sphere({gap, 20, 20}, 15.0, 2);
    const OccupancyTree tree = OccupancyTree::build(grid, types);
    EXPECT_EQ(tree.view() == nullptr, gap == 1'000'000);
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(0.0, 40.0);
    int hits = 0;
    for (int i = 0; i < 40; ++i) {
      RayPacket rays;
      for (int lane = 0; lane < RayPacket::kSize; ++lane) {
        const DVec3 from{8.5, uniform(random), uniform(random)};
        const DVec3 to{static_cast<double>(gap), uniform(random), uniform(random)};
        rays.set(lane, {from, glm::normalize(to - from)}, kInfinity);
      }
      PacketHits found;
      first_hits(tree, rays, found);
      for (int lane = 0; lane < RayPacket::kSize; ++lane) {
        const Ray ray = rays.ray(lane);
        ASSERT_EQ(first_hit(tree, ray).has_value(), (found.hit >> lane & 1U) != 0);
        if (gap > 5'000) continue;  // the dense tracer would take minutes
        const auto dense = oracle::dense_first_hit(grid, grid.bounds(), ray, kInfinity);
        ASSERT_EQ(dense.has_value(), (found.hit >> lane & 1U) != 0);
        ASSERT_TRUE(!dense || dense->voxel == found[lane].voxel);
      }
      hits += std::popcount(found.hit);
    }
    EXPECT_GT(hits, 100);
  }
}

// More packets than a kernel takes at once, of rays that only a walk in double precision can finish.
TEST(PacketTracing, LongArraysMatchSingleRays) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(0.0, 40.0);
  std::vector<RayPacket> packets(2 * trace::kMostPackets + 44);
  for (RayPacket& rays : packets) {
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      const DVec3 from{8.5, uniform(random), uniform(random)};
      const DVec3 to{random() % 3 == 0 ? 9.5 : 5'000, uniform(random), uniform(random)};
      rays.set(lane, {from, glm::normalize(to - from)}, random() % 40 == 0 ? 1'000.0 : kInfinity);
    }
  }
  for (const bool has_table : {true, false}) {
    Grid grid;
    grid.fill_box({{0, 0, 0}, {9, 41, 41}}, 1);
    grid.fill_sphere({5'000, 20, 20}, 15.0, 2);
    if (!has_table) grid.fill_box({{1'000'000, 0, 0}, {1'000'009, 41, 41}}, 1);
    const OccupancyTree tree = OccupancyTree::build(grid, oracle::mixed_types());
    EXPECT_EQ(tree.view() != nullptr, has_table);
    for (const InstructionSet set : sets_of_this_machine()) EXPECT_GT(hits_if_array_agrees(tree, packets, set), 1'000);
  }
}

TEST(PacketTracing, EmptyArraysAreTraced) {
  const OccupancyTree empty;
  Grid grid;
  grid.set({0, 0, 0}, 1);
  const OccupancyTree tree = OccupancyTree::build(grid, oracle::mixed_types());
  for (const InstructionSet set : sets_of_this_machine()) {
    const InstructionSetOverride over(set);
    any_hits(tree, {}, {});
    std::array<std::uint32_t, 2> blocked{7, 7};
    const std::array<RayPacket, 2> idle{};
    any_hits(tree, idle, blocked);
    EXPECT_EQ(blocked, (std::array<std::uint32_t, 2>{}));
    std::array<RayPacket, 2> rays{};
    rays[1].set(5, {{0.5, 0.5, -3.0}, {0.0, 0.0, 1.0}}, kInfinity);
    any_hits(empty, rays, blocked);
    EXPECT_EQ(blocked, (std::array<std::uint32_t, 2>{}));
    any_hits(tree, rays, blocked);
    EXPECT_EQ(blocked, (std::array<std::uint32_t, 2>{0, 1U << 5}));
  }
}

TEST(PacketTracing, InvalidRaysHitNothing) {
  Grid grid;
  grid.fill_box({{-5, -5, -5}, {6, 6, 6}}, 1);
  const OccupancyTree tree = OccupancyTree::build(grid, oracle::mixed_types());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  RayPacket rays;
  EXPECT_EQ(any_hits(tree, rays), 0U);
  rays.set(3, {{nan, 0, 0}, {1, 0, 0}}, kInfinity);
  rays.set(4, {{0, 0, 0}, {0, 0, 0}}, kInfinity);
  rays.set(5, {{0, 0, 0}, {1, kInfinity, 0}}, kInfinity);
  rays.set(6, {{0, 0, 0}, {1, 0, 0}}, nan);
  rays.set(7, {{0, 0, 0}, {1, 0, 0}}, -1.0);
  rays.set(8, {{1e300, 0, 0}, {-1, 0, 0}}, kInfinity);
  rays.set(9, {{0, 0, 0}, {1, 0, 0}}, 0.0);
  std::vector<RayPacket> endless(20, rays);
  for (RayPacket& each : endless) each.max_t.fill(kInfinity);
  for (const InstructionSet set : sets_of_this_machine()) {
    const InstructionSetOverride over(set);
    PacketHits found;
    first_hits(tree, rays, found);
    EXPECT_EQ(found.hit, 0x300U) << "the far one and the one that starts inside";
    EXPECT_EQ(any_hits(tree, rays), 0x300U);
    std::vector<std::uint32_t> blocked(endless.size());
    any_hits(tree, endless, blocked);
    EXPECT_EQ(blocked, std::vector<std::uint32_t>(endless.size(), 0x3C0U)) << "towards the box or in it";
    EXPECT_EQ(any_hits(OccupancyTree::build(Grid(), oracle::mixed_types()), rays), 0U);
  }
}

TEST(PacketDeathTest, AssertsOnInvalidLane) {
  RayPacket rays;
  QUOIN_EXPECT_MISTAKE(rays.set(RayPacket::kSize, Ray{}, kInfinity), "0 <= lane < kSize");
  QUOIN_EXPECT_MISTAKE((void)rays.ray(-1), "0 <= lane < kSize");
  PacketHits hits;
  QUOIN_EXPECT_MISTAKE(hits.set(-1, RayHit{}), "0 <= lane < kSize");
  QUOIN_EXPECT_MISTAKE((void)hits[RayPacket::kSize], "0 <= lane < kSize");
}

TEST(PacketDeathTest, RejectsActiveLanesBeyondThePacket) {
  RayPacket rays;
  rays.active = 1U << RayPacket::kSize;
  PacketHits hits;
  const OccupancyTree tree;
  QUOIN_EXPECT_MISTAKE(first_hits(tree, rays, hits), "active lanes are lanes of the packet");
  QUOIN_EXPECT_MISTAKE((void)any_hits(tree, rays), "active lanes are lanes of the packet");
}

TEST(PacketDeathTest, RejectsTooFewMasks) {
  const OccupancyTree tree;
  const std::vector<RayPacket> packets(2);
  std::vector<std::uint32_t> blocked(1);
  QUOIN_EXPECT_MISTAKE(any_hits(tree, packets, blocked), "a mask for every packet");
}

TEST(PacketDeathTest, AssertsOnReadOfLaneWithoutHit) {
  PacketHits hits;
  hits.set(3, RayHit{});
  EXPECT_EQ(hits[3].voxel, IVec3(0));
  QUOIN_EXPECT_MISTAKE((void)hits[4], "a lane that hit something");
}

}  // namespace
}  // namespace quoin
