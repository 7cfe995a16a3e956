#include <quoin/scene/scene_query.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "core/coordinates/chunk_order.h"
#include "scene/query/field_search.h"
#include "scene/query/moving_shapes.h"
#include "scene/query/query_in_grid.h"
#include "scene/query/unloaded_chunks.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {

namespace {

// A ray hit in one grid; `normal` in the grid's space.
struct GridHit {
  RayHit hit;
  bool in_field = false;
  VoxelType material = kAir;
  DVec3 normal{0.0};
};

// The first voxel of a tree of types that count.
std::optional<RayHit> first_of_tree(const OccupancyTree& tree, const PlacedGrid& placed, const TypesMet& types,
                                    const Ray& ray, double max_t) {
  std::optional<RayHit> hit = first_hit(tree, ray, max_t);
  if (!hit || types.are_all() || types.holds(placed.voxels->get(hit->voxel))) return hit;
  hit.reset();
  visit_hits(tree, ray, max_t, [&](const VoxelSpan& span) {
    if (!types.holds(placed.voxels->get(span.voxel))) return true;
    hit = RayHit{span.voxel, span.face, span.t_enter, span.starts_inside};
    return false;
  });
  return hit;
}

// Returns the maximum distance for a ray to be inside a box.
double leaves_at(const IBox& box, const Ray& ray) {
  double last = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double d = ray.direction[axis];
    if (d == 0.0) continue;
    last = std::min(last, ((d > 0.0 ? box.max[axis] : box.min[axis]) - ray.origin[axis]) / d);
  }
  return last;
}

// Returns the first hit of a ray with field solid of matching types, past other solid. Sweeps a point.
std::optional<DensityHit> first_beyond(const DensityTree& field, const TypesMet& types, const Ray& ray, double max_t) {
  MovingBox point;
  point.centre = ray.origin;
  point.half_axes = glm::dmat3(0.0);
  const double until = std::min(max_t, leaves_at(field.cells().bounds(), ray));
  if (!(until >= 0.0)) return std::nullopt;
  point.displacement = ray.direction * until;
  FieldSweep<MovingBox> sweep(field, types, point, 1.0);
  follow_way(point, 1.0, sweep);
  const FieldContact& met = sweep.best();
  if (!(met.fraction <= 1.0)) return std::nullopt;
  const DVec3 gradient = met.piece.gradient(met.point);
  const double steepness = glm::length(gradient);
  return DensityHit{met.fraction * until, met.starts_inside, met.piece.cell, sweep.material(),
                    steepness > 0.0 ? gradient / steepness : DVec3(0.0)};
}

std::optional<DensityHit> first_of_field(const PlacedGrid& placed, const TypesMet& types, const Ray& ray,
                                         double max_t) {
  const DensityTree* const field = types.are_opaque() ? placed.opaque_field : placed.field;
  if (field == nullptr) return std::nullopt;
  const std::optional<DensityHit> hit = first_hit(*field, ray, max_t);
  if (!hit || types.are_all() || types.are_opaque() || types.holds_solid(hit->material)) return hit;
  return first_beyond(*field, types, ray, max_t);
}

std::optional<GridHit> first_of_grid(const PlacedGrid& placed, const TypesMet& types, const Ray& ray, double max_t) {
  std::optional<GridHit> best;
  for (const OccupancyTree* const tree : {placed.opaque, types.are_opaque() ? nullptr : placed.transparent}) {
    if (tree == nullptr) continue;
    const std::optional<RayHit> hit = first_of_tree(*tree, placed, types, ray, best ? best->hit.t : max_t);
    if (hit && (!best || hit->t < best->hit.t)) best = GridHit{*hit, false, kAir, DVec3(normal_of(hit->face))};
  }
  ShapeHit in_shape;
  if (placed.shapes != nullptr &&
      first_shape(*placed.shapes, types.registry(), ray, best ? best->hit.t : max_t, types.parts(), in_shape)) {
    best = GridHit{{in_shape.voxel, in_shape.direction, in_shape.t, in_shape.starts_inside},
                   false,
                   in_shape.type,
                   glm::normalize(DVec3(in_shape.normal))};
  }
  const std::optional<DensityHit> hit = first_of_field(placed, types, ray, best ? best->hit.t : max_t);
  if (!hit || (best && hit->t >= best->hit.t)) return best;
  return GridHit{
      {hit->cell, nearest_direction(hit->normal), hit->t, hit->starts_inside}, true, hit->material, hit->normal};
}

bool is_any_in_grid(const PlacedGrid& placed, const TypesMet& types, const Ray& ray, double max_t) {
  ShapeHit in_shape;
  if (placed.shapes != nullptr && first_shape(*placed.shapes, types.registry(), ray, max_t, types.parts(), in_shape)) {
    return true;
  }
  if (types.are_opaque()) {
    return any_hit(*placed.opaque, ray, max_t) ||
           (placed.opaque_field != nullptr && any_hit(*placed.opaque_field, ray, max_t));
  }
  if (!types.are_all()) return first_of_grid(placed, types, ray, max_t).has_value();
  return any_hit(*placed.opaque, ray, max_t) ||
         (placed.transparent != nullptr && any_hit(*placed.transparent, ray, max_t)) ||
         (placed.field != nullptr && any_hit(*placed.field, ray, max_t));
}

bool can_meet_anything(const Ray& ray, double max_t) {
  return is_finite(ray.origin) && is_finite(ray.direction) && ray.direction != DVec3(0.0) && max_t >= 0.0;
}

Ray ray_in_grid(const PlacedGrid& placed, const Ray& ray) {
  const ToGrid to_grid(placed);
  return {to_grid.point(ray.origin), to_grid.axes * ray.direction};
}

// A capsule in a grid's space, for overlap queries.
class CapsuleInGrid {
 public:
  explicit CapsuleInGrid(const MovingCapsule& capsule) : capsule_(capsule) {}
  [[nodiscard]] DBox bounds() const { return bounds_between(capsule_, reach_of(capsule_), 0.0, 0.0); }
  [[nodiscard]] bool meets(IVec3 voxel) const {
    const LineGap gap = gap_of_line(capsule_.centre - (DVec3(voxel) + 0.5), capsule_.half_axis);
    return gap.distance < capsule_.radius - kTouch;
  }
  [[nodiscard]] bool meets(const DBox& box) const {
    const LineGap gap =
        gap_of_line(capsule_.centre - 0.5 * (box.min + box.max), capsule_.half_axis, 0.5 * (box.max - box.min));
    return gap.distance < capsule_.radius - kTouch;
  }
  [[nodiscard]] CapsuleInField in_field() const { return {capsule_, 0.0}; }
  [[nodiscard]] CapsuleInGrid moved(DVec3 by) const {
    MovingCapsule capsule = capsule_;
    capsule.centre += by;
    return CapsuleInGrid(capsule);
  }

 private:
  MovingCapsule capsule_;
};

class BoxInGrid {
 public:
  explicit BoxInGrid(const MovingBox& box) : box_(box), separators_(separating_axes(box.half_axes)) {}
  [[nodiscard]] DBox bounds() const { return bounds_between(box_, reach_of_axes(box_.half_axes), 0.0, 0.0); }
  [[nodiscard]] bool meets(IVec3 voxel) const { return meets(DVec3(voxel) + 0.5 - box_.centre, HalfVoxel{}); }
  [[nodiscard]] bool meets(const DBox& box) const {
    return meets(0.5 * (box.min + box.max) - box_.centre, 0.5 * (box.max - box.min));
  }
  [[nodiscard]] BoxInField in_field() const { return {box_, 0.0}; }
  [[nodiscard]] const MovingBox& box() const { return box_; }
  [[nodiscard]] BoxInGrid moved(DVec3 by) const {
    MovingBox box = box_;
    box.centre += by;
    return BoxInGrid(box);
  }

 private:
  // `between`: from the box's centre to that of the obstacle with half size `half`.
  template <class Half>
  [[nodiscard]] bool meets(DVec3 between, const Half& half) const {
    return std::all_of(separators_.begin(), separators_.end(), [&](DVec3 axis) {
      if (axis == DVec3(0.0)) return true;  // parallel edges: the other axes decide
      return std::abs(glm::dot(between, axis)) < reach_along(axis, box_.half_axes, half) - kTouch;
    });
  }

  MovingBox box_;
  SeparatingAxes separators_;
};

// Reads voxels from `source` within `tight`.
template <class Reader, class Shape, class Source>
std::optional<SceneOverlap> first_of_shape(const PlacedGrid& placed, const TypesMet& types, const Shape& shape,
                                           const Source& source, const IBox& tight) {
  const IBox box = voxels_within(shape.bounds(), tight);
  Reader reader(source);
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      for (int x = box.min.x; x < box.max.x; ++x) {
        const IVec3 voxel(x, y, z);
        const VoxelType type = reader.get(voxel);
        if (types.holds(type) && shape.meets(voxel)) return SceneOverlap{placed.instance, voxel, type};
      }
    }
  }
  return std::nullopt;
}

// As above, among cubes and shapes.
template <class Shape>
std::optional<SceneOverlap> first_with_shapes(const PlacedGrid& placed, const TypesMet& types, const Shape& shape) {
  const ShapeObstacles shapes(placed, types);
  const IBox cells = voxels_within(shape.bounds(), shapes.bounds(placed.voxels->bounds()));
  GridReader reader(*placed.voxels);
  std::optional<IVec3> first;
  const auto take = [&](IVec3 voxel) {
    if (!first || by_zyx(voxel, *first)) first = voxel;
  };
  // A shape reaches at most one voxel outside its own.
  for (int z = cells.min.z; z < cells.max.z && !(first && first->z + 1 < z); ++z) {
    for (int y = cells.min.y; y < cells.max.y; ++y) {
      for (int x = cells.min.x; x < cells.max.x; ++x) {
        const IVec3 cell(x, y, z);
        if (shapes.is_cube_met(cell, reader.get(cell)) && shape.meets(cell)) take(cell);
        shapes.visit(cell, [&](IVec3 voxel, const DBox& box) {
          if (shape.meets(box)) take(voxel);
        });
      }
    }
  }
  if (!first) return std::nullopt;
  return SceneOverlap{placed.instance, *first, reader.get(*first)};
}

// `first_of_side(shape)`: the first overlap of a shape.
template <class FirstOf>
std::optional<SceneOverlap> first_of_sides(const CapsuleInGrid& capsule, const FirstOf& first_of_side) {
  return first_of_side(capsule);
}
template <class FirstOf>
std::optional<SceneOverlap> first_of_sides(const BoxInGrid& box, const FirstOf& first_of_side) {
  std::optional<SceneOverlap> first;
  visit_sides(box.box(), [&](const MovingBox& side) {
    const auto found = first_of_side(BoxInGrid(side));
    if (!found || !first) first = found;
    return found.has_value();
  });
  return first;
}

template <class Reader, class Shape, class Source>
std::optional<SceneOverlap> first_of(const PlacedGrid& placed, const TypesMet& types, const Shape& shape,
                                     const Source& source, const IBox& tight) {
  return first_of_sides(shape,
                        [&](const auto& side) { return first_of_shape<Reader>(placed, types, side, source, tight); });
}

template <class Shape>
std::optional<SceneOverlap> first_of_voxels(const PlacedGrid& placed, const TypesMet& types, const Shape& shape) {
  if (placed.shapes != nullptr) {
    return first_of_sides(shape, [&](const auto& side) { return first_with_shapes(placed, types, side); });
  }
  return first_of<GridReader>(placed, types, shape, *placed.voxels, placed.voxels->bounds());
}

// The first chunk that is not loaded and meets a shape in chunks.
template <class Shape>
std::optional<SceneOverlap> first_of_unloaded(const PlacedGrid& chunks, const Shape& shape) {
  if (is_surely_loaded(*chunks.grid, shape.bounds())) return std::nullopt;
  const VoxelRegistry none;
  const TypesMet all(none, QueryTypes::All);
  std::optional<SceneOverlap> first;
  for_each_corner(*chunks.grid, [&](DVec3 offset, const UnloadedReader& reader) {
    const auto found = first_of<UnloadedReader>(chunks, all, shape.moved(offset), reader, extent_of(*chunks.grid));
    if (found && (!first || by_zyx(found->voxel, first->voxel))) first = found;
  });
  if (!first) return std::nullopt;
  first->voxel *= kChunkEdge;
  first->type = kAir;
  first->is_unloaded = true;
  return first;
}

template <class Shape>
std::optional<SceneOverlap> first_of_field(const PlacedGrid& placed, const TypesMet& types, const Shape& shape) {
  if (placed.field == nullptr) return std::nullopt;
  FieldCells cells(*placed.field, types);
  auto in_field = shape.in_field();
  const auto contact = first_overlap_in_field(cells, in_field);
  if (!contact) return std::nullopt;
  const IVec3 cell = contact->piece.cell;
  const DVec3 gradient = contact->piece.gradient(contact->point);
  const double length = glm::length(gradient);
  const DVec3 normal = length > 0.0 ? placed.world_axes * (gradient / length) : DVec3(0.0);
  return SceneOverlap{placed.instance, cell, cells.material(cell, contact->point), true, normal};
}

// `shape_of(placed)` is the shape in that grid's space.
template <class ShapeOf>
std::vector<SceneOverlap> overlaps_of(const SceneTracer& tracer, const DBox& bounds, const QueryFilter& filter,
                                      ShapeOf shape_of) {
  const Seen seen(tracer, filter, QueryTypes::Colliding);
  std::vector<SceneOverlap> found;
  seen.visit_near(bounds, [&](const PlacedGrid& placed) {
    const auto shape = shape_of(placed);
    auto overlap = first_of_voxels(placed, seen.types, shape);
    if (!overlap) overlap = first_of_field(placed, seen.types, shape);
    if (overlap) found.push_back(*overlap);
  });
  if (!seen.meets_unloaded) return found;
  seen.visit_partial([&](const PlacedGrid& chunks) {
    const auto at =
        std::lower_bound(found.begin(), found.end(), chunks.instance,
                         [](const SceneOverlap& each, InstanceHandle instance) { return each.instance < instance; });
    if (at != found.end() && at->instance == chunks.instance) return;
    if (const auto overlap = first_of_unloaded(chunks, shape_of(chunks))) found.insert(at, *overlap);
  });
  return found;
}

// The first chunk that is not loaded on a ray in the world, up to and including `max_t`, that a query may see.
std::optional<SceneHit> first_unloaded_of(const Seen& seen, const Ray& ray, double max_t) {
  std::optional<SceneHit> first;
  seen.visit_partial([&](const PlacedGrid& chunks) {
    const Ray in_chunks = ray_in_grid(chunks, ray);
    const auto hit = first_unloaded(*chunks.grid, in_chunks, first ? first->t : max_t);
    if (!hit || (first && hit->t >= first->t)) return;
    first = SceneHit{chunks.instance,
                     hit->voxel * kChunkEdge,
                     kAir,
                     hit->face,
                     hit->t,
                     ray.origin + hit->t * ray.direction,
                     hit->starts_inside,
                     false,
                     chunks.world_axes * DVec3(normal_of(hit->face)),
                     true};
  });
  return first;
}

// Updates a hit with an unloaded chunk before it, or replaces a miss within `max_t` by the unloaded chunk.
void note_unloaded(const Seen& seen, const Ray& ray, double max_t, std::optional<SceneHit>& found) {
  if (!found && !seen.meets_unloaded) return;
  const auto unloaded = first_unloaded_of(seen, ray, max_t);
  if (!unloaded || (found && unloaded->t >= found->t)) return;
  if (seen.meets_unloaded) {
    found = unloaded;
  } else {
    found->unloaded_t = unloaded->t;
  }
}

}  // namespace

std::optional<SceneHit> first_hit(const SceneTracer& tracer, const Ray& ray, double max_t, const QueryFilter& filter) {
  if (!can_meet_anything(ray, max_t)) return std::nullopt;
  const Seen seen(tracer, filter, QueryTypes::All);
  std::optional<GridHit> best;
  std::size_t best_placed = 0;
  tracer.impl().instances.visit(ray, max_t, [&](std::size_t i) {
    const PlacedGrid& placed = placed_in(tracer)[i];
    if (!seen.includes(placed)) return true;
    const auto hit = first_of_grid(placed, seen.types, ray_in_grid(placed, ray), max_t);
    if (hit && (!best || hit->hit.t < best->hit.t || (hit->hit.t == best->hit.t && i < best_placed))) {
      best = hit;
      best_placed = i;
      max_t = hit->hit.t;
    }
    return true;
  });
  std::optional<SceneHit> found;
  if (best) {
    const PlacedGrid& placed = placed_in(tracer)[best_placed];
    const RayHit& hit = best->hit;
    found = SceneHit{placed.instance,   hit.voxel,      best->in_field ? best->material : placed.voxels->get(hit.voxel),
                     hit.face,          hit.t,          ray.origin + hit.t * ray.direction,
                     hit.starts_inside, best->in_field, placed.world_axes * best->normal};
  }
  if (!tracer.impl().unloaded.empty()) note_unloaded(seen, ray, max_t, found);
  return found;
}

bool any_hit(const SceneTracer& tracer, const Ray& ray, double max_t, const QueryFilter& filter) {
  if (!can_meet_anything(ray, max_t)) return false;
  const Seen seen(tracer, filter, QueryTypes::All);
  bool is_hit = false;
  tracer.impl().instances.visit(ray, max_t, [&](std::size_t i) {
    const PlacedGrid& placed = placed_in(tracer)[i];
    is_hit = seen.includes(placed) && is_any_in_grid(placed, seen.types, ray_in_grid(placed, ray), max_t);
    return !is_hit;
  });
  return is_hit || (seen.meets_unloaded && first_unloaded_of(seen, ray, max_t));
}

std::optional<SceneHit> pick(const SceneTracer& tracer, const Camera& camera, const ImagePoint& point,
                             const QueryFilter& filter) {
  return first_hit(tracer, ray_through(camera, point), std::numeric_limits<double>::infinity(), filter);
}

std::optional<SceneHit> voxel_at_depth(const SceneTracer& tracer, const Camera& camera, const ImagePoint& point,
                                       float depth, const QueryFilter& filter) {
  if (!(depth >= 0.0F) || std::isinf(depth)) return std::nullopt;
  // Twice half a unit in the last place of a float.
  const double room = double{depth} * 0x1p-23 + 1e-6;
  Ray ray = ray_through(camera, point);
  const double begin = std::max(double{depth} - room, 0.0);
  ray.origin += begin * ray.direction;
  auto hit = first_hit(tracer, ray, double{depth} + room - begin, filter);
  if (!hit) return hit;
  hit->t += begin;
  hit->unloaded_t += begin;
  return hit;
}

std::vector<SceneOverlap> overlaps(const SceneTracer& tracer, DVec3 centre, double radius, const QueryFilter& filter) {
  return overlaps(tracer, Capsule{radius, centre, DVec3(0.0)}, filter);
}

std::vector<SceneOverlap> overlaps(const SceneTracer& tracer, const Capsule& capsule, const QueryFilter& filter) {
  if (!is_capsule(capsule)) return {};
  const DVec3 reach = reach_of(capsule);
  return overlaps_of(tracer, {capsule.centre - reach, capsule.centre + reach}, filter, [&](const PlacedGrid& placed) {
    return CapsuleInGrid(moving_in_grid(placed, capsule, DVec3(0.0)));
  });
}

std::vector<SceneOverlap> overlaps(const SceneTracer& tracer, const OrientedBox& box, const QueryFilter& filter) {
  if (!is_box(box)) return {};
  const glm::dmat3 half_axes = half_axes_of(box);
  const DVec3 reach = reach_of_axes(half_axes);
  return overlaps_of(tracer, {box.centre - reach, box.centre + reach}, filter, [&](const PlacedGrid& placed) {
    return BoxInGrid(moving_in_grid(placed, box, half_axes, DVec3(0.0)));
  });
}

}  // namespace quoin
