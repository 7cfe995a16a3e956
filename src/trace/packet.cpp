#include <quoin/trace/packet.h>

#include <bit>

#include "trace/tree_view.h"
#include "trace/walk.h"

namespace quoin {

void first_hits(const OccupancyTree& tree, const RayPacket& rays, PacketHits& hits, InstructionSet instructions) {
  hits.hit = hits.starts_inside = 0;
  std::uint32_t unfinished = rays.active;
  if (const trace::TreeView* view = tree.view()) {
    trace::kernel_of(instructions).first_hits(*view, rays, hits, unfinished);
  }
  for (std::uint32_t inside = hits.starts_inside; inside != 0; inside &= inside - 1) {
    const int lane = std::countr_zero(inside);
    hits.face[static_cast<std::size_t>(lane)] = trace::facing(rays.ray(lane).direction);
  }
  for (; unfinished != 0; unfinished &= unfinished - 1) {
    const int lane = std::countr_zero(unfinished);
    const double max_t = rays.max_t[static_cast<std::size_t>(lane)];
    if (const auto hit = trace::walk_to_first_hit(tree, rays.ray(lane), max_t)) hits.set(lane, *hit);
  }
}

std::uint32_t any_hits(const OccupancyTree& tree, const RayPacket& rays, InstructionSet instructions) {
  std::uint32_t unfinished = rays.active;
  std::uint32_t blocked = 0;
  if (const trace::TreeView* view = tree.view()) {
    blocked = trace::kernel_of(instructions).any_hits(*view, rays, unfinished);
  }
  for (; unfinished != 0; unfinished &= unfinished - 1) {
    const int lane = std::countr_zero(unfinished);
    const bool is_blocked =
        trace::walk_to_first_hit(tree, rays.ray(lane), rays.max_t[static_cast<std::size_t>(lane)]).has_value();
    blocked |= std::uint32_t{is_blocked} << lane;
  }
  return blocked;
}

}  // namespace quoin
