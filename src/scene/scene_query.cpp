#include <quoin/scene/scene_query.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "scene/scene_tracer_impl.h"

namespace quoin {

// What queries may see of a tracer.
class SceneQuery {
 public:
  static const InstanceTree& instances(const SceneTracer& tracer) { return tracer.impl_->instances; }
};

namespace {

// A length below which two shapes touch rather than overlap, in voxels.
constexpr double kTouch = 1e-9;

// Into the space of a placed grid's voxels.
struct ToGrid {
  explicit ToGrid(const PlacedGrid& placed)
      : axes(glm::transpose(placed.world_axes) / placed.voxel_size),
        position(placed.position),
        pivot(placed.grid->pivot) {}
  // The difference of two far positions is taken first: it is small, and mostly exact.
  [[nodiscard]] DVec3 point(DVec3 in_world) const { return axes * (in_world - position) + pivot; }

  glm::dmat3 axes;
  DVec3 position;
  DVec3 pivot;
};

std::optional<RayHit> first_of_grid(const PlacedGrid& placed, const Ray& ray, double max_t) {
  std::optional<RayHit> hit = first_hit(*placed.opaque, ray, max_t);
  if (placed.transparent == nullptr) return hit;
  const std::optional<RayHit> clear = first_hit(*placed.transparent, ray, hit ? hit->t : max_t);
  return clear && (!hit || clear->t < hit->t) ? clear : hit;
}

// What overlap queries ask of a shape in a grid's space.
class SphereInGrid {
 public:
  SphereInGrid(DVec3 centre, double radius) : centre_(centre), radius_(radius) {}
  [[nodiscard]] DBox bounds() const { return {centre_ - radius_, centre_ + radius_}; }
  [[nodiscard]] bool meets(IVec3 voxel) const {
    const DVec3 nearest = glm::clamp(centre_, DVec3(voxel), DVec3(voxel + 1));
    return glm::length(nearest - centre_) < radius_ - kTouch;
  }

 private:
  DVec3 centre_;
  double radius_;
};

class BoxInGrid {
 public:
  // `half_axes`: the box's half edges.
  BoxInGrid(DVec3 centre, const glm::dmat3& half_axes) : centre_(centre), half_axes_(half_axes) {
    for (int i = 0; i < 3; ++i) separators_.at(static_cast<std::size_t>(i))[i] = 1.0;
    std::size_t next = 3;
    for (int i = 0; i < 3; ++i) {
      separators_.at(next++) = glm::cross(half_axes_[(i + 1) % 3], half_axes_[(i + 2) % 3]);
      for (int axis = 0; axis < 3; ++axis) {
        DVec3 unit(0.0);
        unit[axis] = 1.0;
        separators_.at(next++) = glm::cross(half_axes_[i], unit);
      }
    }
    for (DVec3& axis : separators_) {
      const double length = glm::length(axis);
      axis = length > 0.0 ? axis / length : DVec3(0.0);
    }
  }
  [[nodiscard]] DBox bounds() const {
    const DVec3 reach = glm::abs(half_axes_[0]) + glm::abs(half_axes_[1]) + glm::abs(half_axes_[2]);
    return {centre_ - reach, centre_ + reach};
  }
  // Source: S. Gottschalk, M. Lin, D. Manocha, "OBBTree" (1996): two boxes are apart when one of 15 axes parts them.
  [[nodiscard]] bool meets(IVec3 voxel) const {
    const DVec3 between = DVec3(voxel) + 0.5 - centre_;
    return std::all_of(separators_.begin(), separators_.end(), [&](DVec3 axis) {
      if (axis == DVec3(0.0)) return true;  // of parallel edges: the other axes decide
      double reach = 0.5 * (std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z));
      for (int i = 0; i < 3; ++i) reach += std::abs(glm::dot(half_axes_[i], axis));
      return std::abs(glm::dot(between, axis)) < reach - kTouch;
    });
  }

 private:
  DVec3 centre_;
  glm::dmat3 half_axes_;
  std::array<DVec3, 15> separators_{};
};

// The whole voxels that a shape's bounds touch, within the grid's own.
IBox voxels_within(const DBox& bounds, const IBox& tight) {
  IBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] =
        static_cast<int>(std::clamp(std::floor(bounds.min[axis]), double(tight.min[axis]), double(tight.max[axis])));
    box.max[axis] =
        static_cast<int>(std::clamp(std::ceil(bounds.max[axis]), double(tight.min[axis]), double(tight.max[axis])));
  }
  return box;
}

template <class Shape>
std::optional<IVec3> first_overlap(const Grid& grid, const VoxelRegistry& types, const Shape& shape) {
  const IBox box = voxels_within(shape.bounds(), grid.bounds());
  GridReader reader(grid);
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      for (int x = box.min.x; x < box.max.x; ++x) {
        const IVec3 voxel(x, y, z);
        const VoxelType type = reader.get(voxel);
        if (type == kAir || (type < types.size() && !types[type].collides)) continue;
        if (shape.meets(voxel)) return voxel;
      }
    }
  }
  return std::nullopt;
}

// `shape_of(placed)` is the shape in that grid's space.
template <class ShapeOf>
std::vector<SceneOverlap> overlaps_of(const SceneTracer& tracer, const VoxelRegistry& types, const DBox& bounds,
                                      ShapeOf shape_of) {
  std::vector<std::size_t> near;
  SceneQuery::instances(tracer).visit_box(bounds, [&](std::size_t i) { near.push_back(i); });
  std::sort(near.begin(), near.end());
  std::vector<SceneOverlap> found;
  for (const std::size_t i : near) {
    const PlacedGrid& placed = tracer.placed()[i];
    const auto voxel = first_overlap(placed.grid->grid, types, shape_of(placed));
    if (voxel) found.push_back({placed.instance, *voxel});
  }
  return found;
}

DQuat unit_rotation(DQuat q) {
  const double length = std::sqrt(glm::dot(q, q));
  return length > 0.0 && std::isfinite(length) ? q / length : DQuat(1.0, 0.0, 0.0, 0.0);
}

}  // namespace

std::optional<SceneHit> first_hit(const SceneTracer& tracer, const Ray& ray_in_world, double max_distance) {
  const Ray& ray = ray_in_world;
  if (!is_finite(ray.origin) || !is_finite(ray.direction) || ray.direction == DVec3(0.0) || !(max_distance >= 0.0)) {
    return std::nullopt;
  }
  RayInterval interval{ray.origin, ray.origin, ray.direction, ray.direction, max_distance};
  std::optional<RayHit> best;
  std::size_t best_placed = 0;
  SceneQuery::instances(tracer).visit(interval, [&](std::size_t i) {
    const PlacedGrid& placed = tracer.placed()[i];
    const ToGrid to_grid(placed);
    const auto hit = first_of_grid(placed, {to_grid.point(ray.origin), to_grid.axes * ray.direction}, interval.max_t);
    if (hit && (!best || hit->t < best->t || (hit->t == best->t && i < best_placed))) {
      best = hit;
      best_placed = i;
      interval.max_t = hit->t;
    }
    return true;
  });
  if (!best) return std::nullopt;
  const PlacedGrid& placed = tracer.placed()[best_placed];
  return SceneHit{placed.instance,    best->voxel, placed.grid->grid.get(best->voxel),
                  best->face,         best->t,     ray.origin + best->t * ray.direction,
                  best->starts_inside};
}

std::optional<SceneHit> pick(const SceneTracer& tracer, const Camera& camera, double x, double y, int width,
                             int height) {
  return first_hit(tracer, ray_through(camera, x, y, width, height));
}

std::optional<SceneHit> voxel_at_depth(const SceneTracer& tracer, const Camera& camera, double x, double y, int width,
                                       int height, float depth) {
  if (!(depth >= 0.0F) || std::isinf(depth)) return std::nullopt;
  // Half a unit in a float's last place, twice over.
  const double room = double{depth} * 0x1p-23 + 1e-6;
  Ray ray = ray_through(camera, x, y, width, height);
  const double begin = std::max(double{depth} - room, 0.0);
  ray.origin += begin * ray.direction;
  auto hit = first_hit(tracer, ray, double{depth} + room - begin);
  if (hit) hit->distance += begin;
  return hit;
}

std::vector<SceneOverlap> overlaps(const SceneTracer& tracer, const VoxelRegistry& types, DVec3 centre, double radius) {
  if (!is_finite(centre) || !std::isfinite(radius) || radius <= 0.0) return {};
  return overlaps_of(tracer, types, {centre - radius, centre + radius}, [&](const PlacedGrid& placed) {
    return SphereInGrid(ToGrid(placed).point(centre), radius / placed.voxel_size);
  });
}

std::vector<SceneOverlap> overlaps(const SceneTracer& tracer, const VoxelRegistry& types, const OrientedBox& box) {
  const DVec3 half = box.half_size;
  if (!is_finite(box.centre) || !is_finite(half) || half.x <= 0.0 || half.y <= 0.0 || half.z <= 0.0) return {};
  glm::dmat3 half_axes = glm::mat3_cast(unit_rotation(box.rotation));
  for (int axis = 0; axis < 3; ++axis) half_axes[axis] *= half[axis];
  const DBox bounds = BoxInGrid(box.centre, half_axes).bounds();
  return overlaps_of(tracer, types, bounds, [&](const PlacedGrid& placed) {
    const ToGrid to_grid(placed);
    return BoxInGrid(to_grid.point(box.centre), to_grid.axes * half_axes);
  });
}

}  // namespace quoin
