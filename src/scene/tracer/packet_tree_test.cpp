#include "scene/tracer/packet_tree.h"

#include <cmath>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/memory.h>

#include "core/death_for_tests.h"
#include "core/not_finite_for_tests.h"
#include "scene/query/box_test_support.h"

namespace quoin {
namespace {

// Returns, by the index of each visited box, the lanes that may hit it.
std::map<std::size_t, std::uint32_t> visited(const PacketTree& tree, const RayPacket& rays) {
  std::map<std::size_t, std::uint32_t> found;
  const PacketBounds bounds(rays);
  const PacketLanes lanes(rays, bounds);
  tree.visit(bounds, [&](std::size_t i, const FourBoxes& boxes, std::size_t box) {
    EXPECT_EQ(found.count(i), 0U);
    found[i] = lanes.meet(boxes, box) & rays.active;
    return true;
  });
  return found;
}

RayPacket random_packet(RandomBoxes& world, int round, DVec3 around) {
  RayPacket rays;
  const DVec3 origin = around + world.vector(150.0);
  const DVec3 direction = world.vector(1.0);
  const double spread = std::array{0.0, 0.1, 2.0}.at(static_cast<std::size_t>(round % 3));
  const double length = std::array{1.0, 1e-20, 1e20, 1e-40, 1e40}.at(static_cast<std::size_t>(round / 7 % 5));
  for (int lane = 0; lane < 16; ++lane) {
    if (round % 4 == 1 && world.random() % 2 == 0) continue;
    Ray ray{origin + world.vector(spread), direction + world.vector(spread)};
    if (round % 5 == 0) ray.direction.y = 0.0;
    if (round % 10 == 0) ray.direction.x = -0.0;
    ray.direction *= length;
    rays.set(lane, ray, (round % 2 == 0 ? kInfinity : 60.0) / length);
  }
  return rays;
}

TEST(PacketTree, FindsEveryHitBoxAndItsRays) {
  for (const DVec3 far : {DVec3(0.0), DVec3(1e9, -2e7, 3e8)}) {
    RandomBoxes world(3);
    for (const int count : {0, 1, 2, 5, 64, 300}) {
      BlockVector<DBox> boxes = world.boxes(count);
      for (DBox& box : boxes) box = {box.min + far, box.max + far};
      const PacketTree tree(InstanceTree(boxes), far);
      for (int round = 0; round < 210; ++round) {
        const RayPacket rays = random_packet(world, round, DVec3(0.0));
        auto found = visited(tree, rays);
        for (std::size_t i = 0; i < boxes.size(); ++i) {
          const DBox in_view{boxes[i].min - far, boxes[i].max - far};
          for (int lane = 0; lane < 16; ++lane) {
            if ((rays.active >> lane & 1U) == 0) continue;
            if (!meets(rays.ray(lane), rays.max_t[static_cast<std::size_t>(lane)], in_view)) continue;
            ASSERT_EQ(found[i] >> lane & 1U, 1U) << count << " " << round << " " << i << " " << lane;
          }
        }
      }
    }
  }
}

TEST(PacketTree, SkipsNearlyAllBoxesMissedByRay) {
  RandomBoxes world(4);
  const BlockVector<DBox> boxes = world.boxes(1000);
  const PacketTree tree(InstanceTree(boxes), DVec3(0.0));
  int met = 0;
  int needless = 0;
  for (int round = 0; round < 300; ++round) {
    RayPacket rays;
    const DVec3 origin = world.vector(150.0);
    rays.set(round % 16, {origin, world.vector(80.0) - origin}, kInfinity);
    for (const auto& [i, lanes] : visited(tree, rays)) {
      const bool is_met = meets(rays.ray(round % 16), kInfinity, boxes[i]);
      met += is_met;
      needless += !is_met;
    }
  }
  EXPECT_GT(met, 200);
  EXPECT_LT(needless, met / 100 + 1);
}

TEST(PacketTree, VisitsNearerBoxesFirstWithinReach) {
  BlockVector<DBox> boxes;
  for (int i = 0; i < 50; ++i) boxes.push_back({{3.0 * i, -1, -1}, {3.0 * i + 1.0, 1, 1}});
  const PacketTree tree(InstanceTree(boxes), DVec3(0.0));
  RayPacket rays;
  for (int lane = 0; lane < 16; ++lane) rays.set(lane, {{-5, 0.01 * lane, 0}, {2, 0, 0.001 * lane}}, kInfinity);
  PacketBounds bounds(rays);
  std::vector<std::size_t> order;
  tree.visit(bounds, [&](std::size_t i, const FourBoxes&, std::size_t) {
    order.push_back(i);
    if (i == 7) bounds.set_reach((5.0 + 22.0) / 2.0);
    return true;
  });
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5, 6, 7}));
}

TEST(PacketTree, IgnoresNonFiniteAndDirectionlessRays) {
  const DBox unit{DVec3(-1.0), DVec3(1.0)};
  const PacketTree tree(InstanceTree({unit, DBox{}, unit, unit, unit, unit, unit}), DVec3(0.0));
  RayPacket rays;
  EXPECT_TRUE(visited(tree, rays).empty()) << "no ray at all";
  rays.set(0, {{0, 0, 5}, {0, 0, 0}}, kInfinity);
  EXPECT_TRUE(visited(tree, rays).empty());
  rays.set(1, {DVec3(kNan), {0, 0, kNan}}, kNan);
  rays.set(2, {{0, 0, kInfinity}, {kInfinity, 0, 0}}, kInfinity);
  (void)visited(tree, rays);
  rays = {};
  rays.set(0, {DVec3(kNan), DVec3(kNan)}, kNan);
  rays.set(1, {{0, 0, 5}, {0, 0, 0}}, kInfinity);
  rays.set(2, {{0, 0, 5}, {0, 0, -1}}, kInfinity);
  const auto found = visited(tree, rays);
  EXPECT_EQ(found.size(), 6U);
  for (const auto& [i, lanes] : found) EXPECT_NE(lanes & 4U, 0U);
}

TEST(PacketTree, SkipsExcludedInstances) {
  RandomBoxes world(6);
  const BlockVector<DBox> boxes = world.boxes(40);
  for (const std::size_t kept : {std::size_t{0}, std::size_t{3}, std::size_t{40}}) {
    std::vector<bool> left_out(boxes.size());
    for (std::size_t i = kept; i < boxes.size(); ++i) left_out[i] = true;
    const PacketTree tree(InstanceTree(boxes), DVec3(0.0), left_out);
    RayPacket rays;
    for (int lane = 0; lane < 16; ++lane) rays.set(lane, {world.vector(300.0), world.vector(1.0)}, kInfinity);
    for (const auto& [i, lanes] : visited(tree, rays)) EXPECT_LT(i, kept);
  }
}

TEST(PacketTreeDeathTest, RejectsIndicesAndListsOfOtherSizes) {
  RandomBoxes world(7);
  const InstanceTree boxes(world.boxes(5));
  QUOIN_EXPECT_MISTAKE(PacketTree(boxes, DVec3(0.0), std::vector<bool>(4)), "one entry per box, or none");
  RayPacket rays;
  rays.set(0, {{0, 0, 0}, {1, 0, 0}}, kInfinity);
  PacketLanes lanes(rays, PacketBounds(rays));
  QUOIN_EXPECT_MISTAKE((void)lanes.meet({}, 4), "one of the four boxes");
  QUOIN_EXPECT_MISTAKE(lanes.set_reach(RayPacket::kSize, 1.0), "0 <= lane < kSize");
}

}  // namespace
}  // namespace quoin
