#include <quoin/trace/packet.h>

#include <bit>

namespace quoin {

void first_hits(const OccupancyTree& tree, const RayPacket& rays, PacketHits& hits, InstructionSet instructions) {
  static_cast<void>(instructions);
  hits.hit = hits.starts_inside = 0;
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const auto i = static_cast<std::size_t>(lane);
    const auto hit = first_hit(tree, rays.ray(lane), rays.max_t[i]);
    if (!hit) continue;
    hits.hit |= 1U << lane;
    hits.starts_inside |= std::uint32_t{hit->starts_inside} << lane;
    hits.x[i] = hit->voxel.x, hits.y[i] = hit->voxel.y, hits.z[i] = hit->voxel.z;
    hits.t[i] = hit->t;
    hits.face[i] = hit->face;
  }
}

std::uint32_t any_hits(const OccupancyTree& tree, const RayPacket& rays, InstructionSet instructions) {
  static_cast<void>(instructions);
  std::uint32_t blocked = 0;
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    if (any_hit(tree, rays.ray(lane), rays.max_t[static_cast<std::size_t>(lane)])) blocked |= 1U << lane;
  }
  return blocked;
}

}  // namespace quoin
