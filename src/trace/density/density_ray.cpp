#include <quoin/trace/density_ray.h>

#include <bit>
#include <cmath>

#include "grid/density/trilinear.h"
#include "trace/kernel/kernel.h"

namespace quoin {
namespace {

using trace::FieldHit;

const DensityStorage* find_storage(const DensityGrid& field, int x, int y, int z) {
  const DensityChunk* const chunk = field.find_chunk({x, y, z});
  return chunk == nullptr ? nullptr : chunk->storage();
}

void read_corners(const DensityGrid& field, int x, int y, int z, float* corners) {
  for (int i = 0; i < 8; ++i) corners[i] = field.density(IVec3{x, y, z} + IVec3{i & 1, i >> 1 & 1, i >> 2});
}

template <bool kAsksWhere>
std::optional<FieldHit> find(const DensityTree& tree, const Ray& ray, double max_t) {
  const trace::FieldView field{tree.cells().view(), &tree.field(), find_storage, read_corners};
  const auto kernel = kAsksWhere ? trace::kernel().first_in_field : trace::kernel().any_in_field;
  FieldHit hit;
  bool is_unfinished = true;
  if (field.cells != nullptr && kernel != nullptr && kernel(field, ray, max_t, hit, is_unfinished)) return hit;
  if (!is_unfinished) return std::nullopt;
  const bool is_hit = trace::walk_in_field(tree.cells(), field, ray, max_t, kAsksWhere, hit);
  return is_hit ? std::optional(hit) : std::nullopt;
}

DensityHit described(const DensityGrid& field, const Ray& ray, const FieldHit& found) {
  DensityHit hit;
  hit.t = found.t;
  hit.cell = {found.x, found.y, found.z};
  CellCorners corners;
  std::copy_n(found.corners, corners.size(), corners.begin());
  const DVec3 at = glm::clamp(ray.origin + ray.direction * hit.t - DVec3(hit.cell), 0.0, 1.0);
  const DVec3 gradient = trilinear_gradient(corners, at);
  const double length = glm::length(gradient);
  if (length > 0.0) hit.normal = gradient / length;
  double least = std::numeric_limits<double>::infinity();
  IVec3 nearest{0};
  for (int i = 0; i < 8; ++i) {
    const IVec3 corner{i & 1, i >> 1 & 1, i >> 2};
    const DVec3 away = DVec3(corner) - at;
    const double square = glm::dot(away, away);
    if (!(corners[static_cast<std::size_t>(i)] < 0.0) || !(square < least)) continue;
    least = square;
    nearest = corner;
  }
  hit.material = field.material(hit.cell + nearest);
  hit.starts_inside = hit.t == 0.0 && trilinear(corners, at) < 0.0;
  return hit;
}

}  // namespace

std::optional<DensityHit> first_hit(const DensityTree& tree, const Ray& ray, double max_t) {
  const std::optional<FieldHit> found = find<true>(tree, ray, max_t);
  if (!found) return std::nullopt;
  return described(tree.field(), ray, *found);
}

bool any_hit(const DensityTree& tree, const Ray& ray, double max_t) {
  return find<false>(tree, ray, max_t).has_value();
}

void first_hits(const DensityTree& tree, const RayPacket& rays, DensityPacketHits& hits) {
  hits.hit = 0;
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const auto i = static_cast<std::size_t>(lane);
    const Ray ray = rays.ray(lane);
    const std::optional<FieldHit> found = find<true>(tree, ray, rays.max_t[i]);
    if (!found) continue;
    hits.hit |= 1U << lane;
    hits.lanes[i] = described(tree.field(), ray, *found);
  }
}

std::uint32_t any_hits(const DensityTree& tree, const RayPacket& rays) {
  std::uint32_t blocked = 0;
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const auto i = static_cast<std::size_t>(lane);
    const bool is_blocked = find<false>(tree, rays.ray(lane), rays.max_t[i]).has_value();
    blocked |= std::uint32_t{is_blocked} << lane;
  }
  return blocked;
}

}  // namespace quoin
