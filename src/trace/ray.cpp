#include <quoin/trace/ray.h>

#include <algorithm>
#include <bit>
#include <span>

#include <quoin/core/assert.h>
#include <quoin/trace/packet.h>

#include "trace/kernel/ray_kernel.h"
#include "trace/tree_view.h"
#include "trace/walk.h"

namespace quoin {

using trace::face_of, trace::facing, trace::is_usable, trace::Walk;

namespace {

// `first_hit` in single steps, for rays of any length in worlds of any size.
std::optional<RayHit> walk_to_first_hit(const OccupancyTree& tree, const Ray& ray, double max_t) {
  if (!is_usable(ray, max_t)) return std::nullopt;
  Walk walk(tree, ray);
  if (!walk.enter(tree.bounds(), max_t) || !walk.find(max_t)) return std::nullopt;
  return RayHit{walk.voxel(), face_of(walk, ray), walk.t(), walk.axis() < 0};
}

// Finds the blocked rays of at most trace::kMostPackets packets.
void some_any_hits(const OccupancyTree& tree, std::span<const RayPacket> packets, std::span<std::uint32_t> blocked) {
  for (const RayPacket& rays : packets) {
    QUOIN_ASSERT(rays.active >> RayPacket::kSize == 0, "active lanes are lanes of the packet");
  }
  const trace::TreeView* const view = tree.view();
  std::uint32_t unfinished[trace::kMostPackets];
  if (view != nullptr) {
    trace::kernel().any_hits(*view, packets.data(), packets.size(), blocked.data(), unfinished);
  } else {
    for (std::size_t i = 0; i < packets.size(); ++i) {
      blocked[i] = 0;
      unfinished[i] = packets[i].active;
    }
  }
  for (std::size_t i = 0; i < packets.size(); ++i) {
    const RayPacket& rays = packets[i];
    QUOIN_ASSERT(((blocked[i] | unfinished[i]) & ~rays.active) == 0, "results of active lanes only");
    for (std::uint32_t left = unfinished[i]; left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      const double max_t = rays.max_t[static_cast<std::size_t>(lane)];
      const bool is_blocked = walk_to_first_hit(tree, rays.ray(lane), max_t).has_value();
      blocked[i] |= std::uint32_t{is_blocked} << lane;
    }
  }
}

}  // namespace

std::optional<RayHit> first_hit(const OccupancyTree& tree, const Ray& ray, double max_t) {
  const trace::TreeView* view = tree.view();
  if (view == nullptr) return walk_to_first_hit(tree, ray, max_t);
  RayHit hit;
  bool is_unfinished = false;
  if (!trace::kernel().first_hit(*view, ray, max_t, hit, is_unfinished)) {
    if (is_unfinished) [[unlikely]]
      return walk_to_first_hit(tree, ray, max_t);
    return std::nullopt;
  }
  if (hit.starts_inside) hit.face = facing(ray.direction);
  return hit;
}

bool any_hit(const OccupancyTree& tree, const Ray& ray, double max_t) {
  const trace::TreeView* view = tree.view();
  if (view == nullptr) return walk_to_first_hit(tree, ray, max_t).has_value();
  bool is_unfinished = false;
  const bool is_hit = trace::kernel().any_hit(*view, ray, max_t, is_unfinished);
  return is_unfinished ? walk_to_first_hit(tree, ray, max_t).has_value() : is_hit;
}

void first_hits(const OccupancyTree& tree, const RayPacket& rays, PacketHits& hits) {
  QUOIN_ASSERT(rays.active >> RayPacket::kSize == 0, "active lanes are lanes of the packet");
  hits.hit = hits.starts_inside = 0;
  std::uint32_t unfinished = rays.active;
  if (const trace::TreeView* view = tree.view()) {
    trace::kernel().first_hits(*view, rays, hits, unfinished);
    QUOIN_ASSERT(((hits.hit | unfinished) & ~rays.active) == 0, "results of active lanes only");
    QUOIN_ASSERT((hits.hit & unfinished) == 0 && (hits.starts_inside & ~hits.hit) == 0, "one result per lane");
  }
  for (std::uint32_t inside = hits.starts_inside; inside != 0; inside &= inside - 1) {
    const int lane = std::countr_zero(inside);
    hits.face[static_cast<std::size_t>(lane)] = facing(rays.ray(lane).direction);
  }
  for (; unfinished != 0; unfinished &= unfinished - 1) {
    const int lane = std::countr_zero(unfinished);
    const double max_t = rays.max_t[static_cast<std::size_t>(lane)];
    if (const auto hit = walk_to_first_hit(tree, rays.ray(lane), max_t)) hits.set(lane, *hit);
  }
}

void any_hits(const OccupancyTree& tree, std::span<const RayPacket> packets, std::span<std::uint32_t> blocked) {
  QUOIN_ASSERT(blocked.size() >= packets.size(), "a mask for every packet");
  for (std::size_t first = 0; first < packets.size(); first += trace::kMostPackets) {
    const std::size_t size = std::min(trace::kMostPackets, packets.size() - first);
    some_any_hits(tree, packets.subspan(first, size), blocked.subspan(first, size));
  }
}

std::uint32_t any_hits(const OccupancyTree& tree, const RayPacket& rays) {
  std::uint32_t blocked = 0;
  some_any_hits(tree, std::span(&rays, 1), std::span(&blocked, 1));
  return blocked;
}

void visit_hits(const OccupancyTree& tree, const Ray& ray, double max_t, FunctionRef<bool(const VoxelSpan&)> visit) {
  trace::visit_spans(
      tree, ray, max_t, [](Walk& walk, const trace::WalkSpan& /*begun*/) { walk.leave_voxel(); }, visit);
}

}  // namespace quoin
