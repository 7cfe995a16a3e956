#include <quoin/trace/packet.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "mesh/mesh_oracle.h"
#include "trace/trace_oracle.h"

namespace quoin {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array kSets = {InstructionSet::Avx512, InstructionSet::Avx2, InstructionSet::Plain};

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

// Packets of mixed rays: random, short, along axes, from faces, from far away, of odd lengths.
class Packets : public testing::TestWithParam<unsigned> {
 protected:
  void SetUp() override {
    grid_ = oracle::random_world(GetParam(), {IVec3{-90, -40, -70}, IVec3{80, 90, 75}}, 3, 0.0005 * (GetParam() % 4));
    tree_ = OccupancyTree::build(grid_, oracle::mixed_types());
  }
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

  std::mt19937 random_{GetParam()};
  Grid grid_;
  OccupancyTree tree_;
};

TEST_P(Packets, AnswerTheSameWithEveryInstructionSetAndOneByOne) {
  int hits = 0;
  for (int i = 0; i < 5'000; ++i) {
    const RayPacket rays = packet();
    std::array<PacketHits, 3> found;
    for (std::size_t set = 0; set < 3; ++set) {
      first_hits(tree_, rays, found[set], kSets[set]);
      ASSERT_EQ(any_hits(tree_, rays, kSets[set]), found[set].hit);
    }
    ASSERT_NO_FATAL_FAILURE(expect_same(found[0], found[1]));
    ASSERT_NO_FATAL_FAILURE(expect_same(found[0], found[2]));
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      if ((rays.active >> lane & 1U) == 0) continue;
      const auto single = first_hit(tree_, rays.ray(lane), rays.max_t[static_cast<std::size_t>(lane)]);
      ASSERT_EQ(single.has_value(), (found[0].hit >> lane & 1U) != 0);
      for (const InstructionSet set : kSets) {
        const double max_t = rays.max_t[static_cast<std::size_t>(lane)];
        ASSERT_EQ(any_hit(tree_, rays.ray(lane), max_t, set), single.has_value());
        ASSERT_EQ(first_hit(tree_, rays.ray(lane), max_t, set).has_value(), single.has_value());
      }
      if (!single) continue;
      ++hits;
      ASSERT_EQ(single->voxel, found[0][lane].voxel);
      ASSERT_EQ(single->t, found[0][lane].t);
      ASSERT_EQ(single->face, found[0][lane].face);
    }
  }
  EXPECT_GT(hits, 500);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Packets, testing::Range(1U, 9U));

}  // namespace
}  // namespace quoin
