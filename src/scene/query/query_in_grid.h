#pragma once

// Shared parts of scene queries: transforms into a grid's space, and boxes against voxels.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <quoin/core/assert.h>
#include <quoin/core/vec.h>
#include <quoin/scene/scene_query.h>

#include "core/coordinates/unit_rotation.h"
#include "core/memory/make_room.h"
#include "scene/tracer/placed_grid.h"
#include "scene/tracer/scene_tracer_impl.h"
#include "scene/tracer/shape_rays.h"

namespace quoin {

// A length below which two shapes touch rather than overlap, in voxels.
inline constexpr double kTouch = 1e-9;

// Transforms into the space of a placed grid's voxels.
struct ToGrid {
  explicit ToGrid(const PlacedGrid& placed)
      : axes(glm::transpose(placed.world_axes) / placed.voxel_size), position(placed.position), pivot(placed.pivot) {
    QUOIN_ASSERT(placed.voxel_size > 0.0, "a positive voxel size");
  }
  // The difference of two far positions is taken first: it is small, and mostly exact.
  [[nodiscard]] DVec3 point(DVec3 in_world) const { return axes * (in_world - position) + pivot; }

  glm::dmat3 axes;
  DVec3 position;
  DVec3 pivot;
};

// The whole voxels that a shape's bounds touch, within the grid's own.
inline IBox voxels_within(const DBox& bounds, const IBox& tight) {
  IBox box;
  for (int axis = 0; axis < 3; ++axis) {
    QUOIN_ASSERT(tight.min[axis] <= tight.max[axis], "bounds with min <= max");
    box.min[axis] =
        static_cast<int>(std::clamp(std::floor(bounds.min[axis]), double(tight.min[axis]), double(tight.max[axis])));
    box.max[axis] =
        static_cast<int>(std::clamp(std::ceil(bounds.max[axis]), double(tight.min[axis]), double(tight.max[axis])));
  }
  return box;
}

/// Returns true if the box is valid: finite, with half sizes of at least 0.
inline bool is_box(const OrientedBox& box) {
  const DVec3 half = box.half_size;
  const DQuat& q = box.rotation;
  return is_finite(box.centre) && is_finite({q.x, q.y, q.z}) && std::isfinite(q.w) && is_finite(half) &&
         half.x >= 0.0 && half.y >= 0.0 && half.z >= 0.0;
}

/// A box's half edges in the world, as columns.
inline glm::dmat3 half_axes_of(const OrientedBox& box) {
  glm::dmat3 half_axes = glm::mat3_cast(unit_rotation(box.rotation));
  for (int axis = 0; axis < 3; ++axis) half_axes[axis] *= box.half_size[axis];
  return half_axes;
}

/// The set of types that a query meets. Unregistered types count as colliding and opaque.
class TypesMet {
 public:
  TypesMet(const VoxelRegistry& types, QueryTypes which) : types_(&types), which_(which), parts_(parts_of(which)) {
    // If all types match, skips the lookup.
    if (which == QueryTypes::Colliding && !types.has_passable()) which_ = QueryTypes::All;
    if (which == QueryTypes::Opaque && !types.has_transparent()) which_ = QueryTypes::All;
  }
  [[nodiscard]] bool are_all() const { return which_ == QueryTypes::All; }
  [[nodiscard]] bool are_opaque() const { return which_ == QueryTypes::Opaque; }
  /// Returns the parts of shapes that count. Shapes of an opaque material are opaque, although their voxels are not.
  [[nodiscard]] ShapeParts parts() const { return parts_; }
  [[nodiscard]] const VoxelRegistry& registry() const { return *types_; }
  /// For cubes: voxels without shapes.
  [[nodiscard]] bool holds(VoxelType type) const { return type != kAir && holds_solid(type); }
  /// For a field's solid. Solid without a material also counts.
  [[nodiscard]] bool holds_solid(VoxelType material) const {
    if (which_ == QueryTypes::All || material == kAir || material >= types_->size()) return true;
    return which_ == QueryTypes::Opaque ? types_->is_opaque(material) : (*types_)[material].collides;
  }

 private:
  static ShapeParts parts_of(QueryTypes which) {
    if (which == QueryTypes::All) return ShapeParts::All;
    return which == QueryTypes::Opaque ? ShapeParts::Opaque : ShapeParts::Colliding;
  }

  const VoxelRegistry* types_;
  QueryTypes which_;
  ShapeParts parts_;
};

/// The shapes of a placed grid, as bodies meet them: boxes in the grid's space. All other voxels are cubes.
class ShapeObstacles {
 public:
  ShapeObstacles(const PlacedGrid& placed, const TypesMet& types) : shapes_(*placed.shapes), types_(types) {}

  /// Returns the bounds of voxels and shapes. `of_voxels`: of the grid.
  [[nodiscard]] IBox bounds(const IBox& of_voxels) const { return unite(of_voxels, shapes_.touched.bounds()); }
  /// Returns true if the query meets a voxel of a type, and it is a cube.
  [[nodiscard]] bool is_cube_met(IVec3 voxel, VoxelType type) const {
    if (!types_.holds(type)) return false;
    return !types_.registry().is_shaped(type) || shapes_.index.is_cube(voxel);
  }
  /// Calls `visit(voxel, box)` for each box that the query meets of the shapes that touch a cell. `voxel`: of the
  /// shape.
  template <class Visit>
  void visit(IVec3 cell, const Visit& visit) const {
    for (const ListedShape& shape : shapes_.index.at(cell).listed()) {
      if (shape.is_inner) continue;
      if (types_.parts() == ShapeParts::Colliding && !types_.registry()[shape.type].collides) continue;
      if (types_.parts() == ShapeParts::Opaque && !shape.is_opaque) continue;
      const IVec3 voxel = shape.voxel(cell);
      const DVec3 at(voxel);
      visit_solid_boxes(*shape.model, types_.parts() != ShapeParts::Colliding, [&](const DBox& box) {
        visit(voxel, DBox{box.min + at, box.max + at});
      });
    }
  }
  /// Calls `visit(cell)` for the cells of a box that shapes touch.
  template <class Visit>
  void visit_touched(const IBox& cells, const Visit& visit) const {
    const IBox box = intersect(cells, shapes_.touched.bounds());
    for (int z = box.min.z; z < box.max.z; ++z) {
      for (int y = box.min.y; y < box.max.y; ++y) {
        for (int first = box.min.x & ~(kChunkEdge - 1); first < box.max.x; first += kChunkEdge) {
          for (std::uint64_t left = shapes_.index.touched_row({first, y, z}); left != 0; left &= left - 1) {
            const IVec3 cell{first + std::countr_zero(left), y, z};
            if (cell.x >= box.min.x && cell.x < box.max.x) visit(cell);
          }
        }
      }
    }
  }

 private:
  const TracedShapes& shapes_;
  const TypesMet& types_;
};

/// The part of a scene that a filter includes.
class Seen {
 public:
  Seen(const SceneTracer& tracer, const QueryFilter& filter, QueryTypes by_default)
      : types(tracer.scene().types, filter.types.value_or(by_default)),
        meets_unloaded(filter.unloaded.value_or(by_default == QueryTypes::Colliding
                                                    ? UnloadedChunks::Block
                                                    : UnloadedChunks::Ignore) == UnloadedChunks::Block),
        tracer_(tracer),
        filter_(filter) {}

  [[nodiscard]] bool includes(const PlacedGrid& placed) const {
    if (std::find(filter_.ignored.begin(), filter_.ignored.end(), placed.instance) != filter_.ignored.end())
      return false;
    if (filter_.categories == ~std::uint32_t{0}) return true;
    const Instance* const instance = tracer_.scene().instances().find(placed.instance);
    return instance == nullptr || (instance->categories & filter_.categories) != 0;
  }
  /// Calls `visit(placed)` for each included instance near a box in the world, in order.
  template <class Visit>
  void visit_near(const DBox& box, const Visit& visit) const {
    KeptList<std::size_t, Seen> near;
    tracer_.impl().instances.visit_box(box, [&](std::size_t i) { near->push_back(i); });
    std::sort(near->begin(), near->end());
    for (const std::size_t i : *near) {
      if (includes(placed_in(tracer_)[i])) visit(placed_in(tracer_)[i]);
    }
  }

  /// Calls `visit(chunks)` for each instance of a partial grid (SceneTracer::Impl::unloaded), in their order.
  template <class Visit>
  void visit_partial(const Visit& visit) const {
    for (const PlacedGrid& chunks : tracer_.impl().unloaded) {
      if (includes(chunks)) visit(chunks);
    }
  }

  const TypesMet types;
  const bool meets_unloaded;

 private:
  const SceneTracer& tracer_;
  const QueryFilter& filter_;
};

/// The directions that can part a box from a voxel: the voxel's three, then the box's three and the nine products of
/// both; those of parallel edges are 0.
///
/// Source: S. Gottschalk, M. Lin, D. Manocha, "OBBTree" (1996).
using SeparatingAxes = std::array<DVec3, 15>;

inline SeparatingAxes separating_axes(const glm::dmat3& half_axes) {
  SeparatingAxes axes{};
  std::size_t next = 3;
  for (int i = 0; i < 3; ++i) {
    axes.at(static_cast<std::size_t>(i))[i] = 1.0;
    axes.at(next++) = glm::cross(half_axes[(i + 1) % 3], half_axes[(i + 2) % 3]);
  }
  for (int i = 0; i < 3; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      DVec3 unit(0.0);
      unit[axis] = 1.0;
      const DVec3 product = glm::cross(half_axes[i], unit);
      // The direction of nearly parallel edges is unreliable.
      axes.at(next++) = glm::length(product) > 1e-6 * glm::length(half_axes[i]) ? product : DVec3(0.0);
    }
  }
  for (DVec3& axis : axes) {
    const double length = glm::length(axis);
    axis = length > 0.0 ? axis / length : DVec3(0.0);
  }
  return axes;
}

/// Returns the half-extents of a box along each of the world's axes.
inline DVec3 reach_of_axes(const glm::dmat3& half_axes) {
  return glm::abs(half_axes[0]) + glm::abs(half_axes[1]) + glm::abs(half_axes[2]);
}

/// Stands for the half size of a voxel.
struct HalfVoxel {};
inline double reach_along(DVec3 axis, HalfVoxel /*half*/) {
  return 0.5 * (std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z));
}
/// Returns the reach of a box of the grid along an axis. `half`: its half size.
inline double reach_along(DVec3 axis, const DVec3& half) {
  return half.x * std::abs(axis.x) + half.y * std::abs(axis.y) + half.z * std::abs(axis.z);
}

/// Returns the distance of the centres of a box and a voxel, or a box of the grid, along an axis when the two touch.
template <class Half = HalfVoxel>
double reach_along(DVec3 axis, const glm::dmat3& half_axes, const Half& half = {}) {
  double reach = reach_along(axis, half);
  for (int i = 0; i < 3; ++i) reach += std::abs(glm::dot(half_axes[i], axis));
  return reach;
}

}  // namespace quoin
