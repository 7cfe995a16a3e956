#include <quoin/trace/density_ray.h>

#include <bit>
#include <cmath>

#include <quoin/core/assert.h>

#include "core/trilinear.h"
#include "grid/density/density_storage.h"
#include "trace/kernel/ray_kernel.h"

namespace quoin {
namespace {

using trace::FieldHit;

const DensityStorage* find_storage(const DensityGrid& field, int x, int y, int z) {
  const DensityChunk* const chunk = field.find_chunk({x, y, z});
  return chunk == nullptr ? nullptr : DensityStorage::of(*chunk);
}

void read_corners(const DensityGrid& field, int x, int y, int z, float* corners) {
  const auto find_chunk = [&](IVec3 chunk) { return field.find_chunk(chunk); };
  read_cell_corners(
      {x, y, z}, 1, find_chunk, [&] { return field.band(); }, corners);
}

trace::FieldView view_of(const DensityTree& tree) {
  return {tree.cells().view(), &tree.field(), find_storage, read_corners};
}

template <bool kAsksWhere>
std::optional<FieldHit> find(const DensityTree& tree, const Ray& ray, double max_t) {
  const trace::FieldView field = view_of(tree);
  const auto kernel = kAsksWhere ? trace::field_kernel().first_in_field : trace::field_kernel().any_in_field;
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
  QUOIN_ASSERT(rays.active >> RayPacket::kSize == 0, "active lanes are lanes of the packet");
  const trace::FieldView field = view_of(tree);
  const auto kernel = trace::field_kernel().first_hits_in_field;
  RayPacket::Lanes<FieldHit> found;
  std::uint32_t one_by_one = rays.active;
  hits.hit = 0;
  if (field.cells != nullptr && kernel != nullptr) hits.hit = kernel(field, rays, found.data(), one_by_one);
  QUOIN_ASSERT(((hits.hit | one_by_one) & ~rays.active) == 0 && (hits.hit & one_by_one) == 0,
               "one result per active lane");
  for (; one_by_one != 0; one_by_one &= one_by_one - 1) {
    const int lane = std::countr_zero(one_by_one);
    const auto i = static_cast<std::size_t>(lane);
    const std::optional<FieldHit> hit = find<true>(tree, rays.ray(lane), rays.max_t[i]);
    if (!hit) continue;
    hits.hit |= 1U << lane;
    found[i] = *hit;
  }
  for (std::uint32_t left = hits.hit; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const auto i = static_cast<std::size_t>(lane);
    hits.lanes[i] = described(tree.field(), rays.ray(lane), found[i]);
  }
}

std::uint32_t any_hits(const DensityTree& tree, const RayPacket& rays) {
  QUOIN_ASSERT(rays.active >> RayPacket::kSize == 0, "active lanes are lanes of the packet");
  const trace::FieldView field = view_of(tree);
  const auto kernel = trace::field_kernel().any_hits_in_field;
  std::uint32_t one_by_one = rays.active;
  std::uint32_t blocked = 0;
  if (field.cells != nullptr && kernel != nullptr) blocked = kernel(field, rays, one_by_one);
  QUOIN_ASSERT(((blocked | one_by_one) & ~rays.active) == 0, "results of active lanes only");
  for (; one_by_one != 0; one_by_one &= one_by_one - 1) {
    const int lane = std::countr_zero(one_by_one);
    const double max_t = rays.max_t[static_cast<std::size_t>(lane)];
    blocked |= std::uint32_t{find<false>(tree, rays.ray(lane), max_t).has_value()} << lane;
  }
  return blocked;
}

}  // namespace quoin
