#include <quoin/trace/ray.h>

#include <bit>

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

std::uint32_t any_hits(const OccupancyTree& tree, const RayPacket& rays) {
  QUOIN_ASSERT(rays.active >> RayPacket::kSize == 0, "active lanes are lanes of the packet");
  std::uint32_t unfinished = rays.active;
  std::uint32_t blocked = 0;
  if (const trace::TreeView* view = tree.view()) {
    blocked = trace::kernel().any_hits(*view, rays, unfinished);
    QUOIN_ASSERT(((blocked | unfinished) & ~rays.active) == 0, "results of active lanes only");
  }
  for (; unfinished != 0; unfinished &= unfinished - 1) {
    const int lane = std::countr_zero(unfinished);
    const bool is_blocked =
        walk_to_first_hit(tree, rays.ray(lane), rays.max_t[static_cast<std::size_t>(lane)]).has_value();
    blocked |= std::uint32_t{is_blocked} << lane;
  }
  return blocked;
}

void visit_hits(const OccupancyTree& tree, const Ray& ray, double max_t, FunctionRef<bool(const VoxelSpan&)> visit) {
  trace::visit_spans(
      tree, ray, max_t, [](Walk& walk) { walk.leave_voxel(); }, visit);
}

}  // namespace quoin
