#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include <glm/gtc/type_ptr.hpp>

#include <quoin/core/direction.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/vec.h>
#include <quoin/grid/texture.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/grid/voxel_shape.h>
#include <quoin/trace/packet.h>
#include <quoin/trace/ray.h>

#include "grid/shapes/shape_index.h"
#include "scene/tracer/tree_cache.h"

namespace quoin {

/// The way of a ray through a box of a shape, or through a fluid with an inclined surface. A plate has no length.
struct ShapeSpan {
  /// One end of the way.
  struct End {
    double t = 0.0;
    std::int16_t face = -1;            ///< index into ShapeModel::faces; -1: a side that is not drawn
    Direction side = Direction::PosX;  ///< of the box, in its own space
  };

  PlacedShape shape;
  const ModelBox* box = nullptr;  ///< null for fluids
  End enter;                      ///< negative t: the ray starts inside
  End exit;

  [[nodiscard]] bool starts_inside() const { return enter.t < 0.0; }
  /// Returns true if bodies collide with the box.
  [[nodiscard]] bool collides() const { return box == nullptr || box->collides; }
  /// Returns the outward unit normal at an end, in the grid's space.
  [[nodiscard]] Vec3 normal(const End& end) const;
};

/// Returns the upper or lower direction of an axis.
[[nodiscard]] inline Direction side_of(int axis, bool is_upper) {
  return static_cast<Direction>(2 * axis + (is_upper ? 0 : 1));
}

/// A ray in the space of a box.
class BoxRay {
 public:
  BoxRay(const DVec3& origin, const DVec3& direction) : origin_(origin), inverse_(1.0 / direction) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      const bool is_backward = std::signbit(inverse_[axis]);
      near_[i] = static_cast<std::uint32_t>(axis + (is_backward ? 3 : 0));
      far_[i] = static_cast<std::uint32_t>(axis + (is_backward ? 0 : 3));
      has_still_axis_ |= std::isinf(inverse_[axis]);
    }
  }

  void set_origin(const DVec3& origin) { origin_ = origin; }
  // Returns the inverse of the direction's components: infinite where they are 0.
  [[nodiscard]] const DVec3& inverse() const { return inverse_; }

  // Finds the way through a box as far as it lies between `least` and `most`. Returns false if there is none.
  [[nodiscard]] bool cross(const ListedBox& box, double least, double most, ShapeSpan::End& enter_end,
                           ShapeSpan::End& exit_end) const {
    std::array<double, 3> near;
    std::array<double, 3> far;
    double enter = -std::numeric_limits<double>::infinity();
    double exit = std::numeric_limits<double>::infinity();
    // No branches: rays through small boxes miss about as often as they hit. A distance that is NaN, since the ray runs
    // in the plane, does not count.
    for (std::size_t i = 0; i < 3; ++i) {
      near[i] = (box.planes[near_[i]] - of(origin_, i)) * of(inverse_, i);
      far[i] = (box.planes[far_[i]] - of(origin_, i)) * of(inverse_, i);
      enter = near[i] > enter ? near[i] : enter;
      exit = far[i] < exit ? far[i] : exit;
    }
    if (!((enter > least ? enter : least) <= (exit < most ? exit : most))) return false;
    if (has_still_axis_ && runs_in_plate(box)) return false;
    // If a ray crosses several planes at once, the last one counts, as for voxels.
    const std::size_t enter_axis = near[2] == enter ? 2 : near[1] == enter ? 1 : 0;
    const std::size_t exit_axis = far[0] == exit ? 0 : far[1] == exit ? 1 : 2;
    if (enter == exit ? enter_axis != exit_axis : exit == 0.0) return false;
    const Direction enter_side = side_of(static_cast<int>(enter_axis), near_[enter_axis] >= 3);
    const Direction exit_side = side_of(static_cast<int>(exit_axis), near_[exit_axis] < 3);
    enter_end = {enter, box.box->faces[static_cast<std::size_t>(enter_side)], enter_side};
    exit_end = {exit, box.box->faces[static_cast<std::size_t>(exit_side)], exit_side};
    return true;
  }

 private:
  static double of(const DVec3& v, std::size_t i) { return glm::value_ptr(v)[i]; }
  [[nodiscard]] bool runs_in_plate(const ListedBox& box) const {
    for (std::size_t i = 0; i < 3; ++i) {
      if (std::isinf(of(inverse_, i)) && box.planes[i] == box.planes[i + 3]) return true;
    }
    return false;
  }

  DVec3 origin_;
  DVec3 inverse_;
  // Indices in ListedBox::planes of the planes that the ray meets first and last.
  std::array<std::uint32_t, 3> near_{};
  std::array<std::uint32_t, 3> far_{};
  bool has_still_axis_ = false;
};

/// Finds the ways of a ray through the boxes of one of the shapes that touch a voxel: all that end at or after t = 0,
/// in the order of the boxes. A ray that only touches an edge meets nothing. Precision: double, relative to the shape's
/// voxel. `straight`: the ray, from any origin.
void visit_shape(const ShapesAtVoxel& here, const ListedShape& shape, const Ray& ray_in_grid, BoxRay& straight,
                 FunctionRef<void(const ShapeSpan&)> visit);

/// A surface of a shape that a ray meets, in the space of its grid. Without default values, so that packets of them
/// need not be cleared.
struct ShapeHit {
  double t;
  IVec3 voxel;              ///< of the shape, not of the cell in which the ray meets it
  const ShapeModel* model;  ///< of that voxel
  Vec3 normal;              ///< unit, towards the ray's origin
  VoxelType type;
  std::int16_t face;    ///< index into `model->faces`; -1: a side that is not drawn, or none
  Direction direction;  ///< nearest to `normal`
  bool starts_inside;   ///< `t` is 0, and `normal` is the direction that is most opposed to the ray's
};

/// A point of a texture.
struct ShapeUv {
  std::array<float, 2> uv{};    ///< 0 to 1 within the texture, rightwards and downwards
  double square_density = 1.0;  ///< square of the sides of the texture per voxel, along its rows or columns
};

/// Returns the point of the texture that a point of a face shows. `point`: relative to the face's voxel. `look`: of the
/// face, from `look_of`, not null.
[[nodiscard]] ShapeUv shape_uv(const ModelFace& face, const VoxelFace& look, const DVec3& point);
/// Returns the texel of level 0 at such a point. Requires: the look has a texture.
[[nodiscard]] Rgba8 shape_texel(const ModelFace& face, const VoxelFace& look, const DVec3& point);

/// The parts of shapes that a ray can hit.
enum class ShapeParts : std::uint8_t {
  All,        ///< boxes and fluids, with drawn sides or without, except for fluids next to a voxel's own shape
  Colliding,  ///< the ones that stop moving bodies
  Opaque,     ///< those of an opaque material
  Visible,    ///< drawn sides that hide the background: opaque ones, and visible texels of cutout ones
};

/// Finds the nearest part of the shapes that a ray meets from 0 up to and including `max_t`. Returns false if there is
/// none. Cost: O(cells on the ray that shapes touch).
bool first_shape(const TracedShapes& shapes, const VoxelRegistry& types, const Ray& ray_in_grid, double max_t,
                 ShapeParts parts, ShapeHit& hit);

/// Finds the nearest opaque voxel or visible part of a shape (ShapeParts::Visible) for each active ray of a packet. For
/// shapes, the voxel of `hits` is that of the shape, and its face is ShapeHit::direction. Returns the lanes that hit
/// shapes, with their entries in `in_shapes`. `voxels`: the grid with the shapes.
std::uint32_t first_solids(const TracedShapes& shapes, const Grid& voxels, const VoxelRegistry& types,
                           const RayPacket& rays_in_grid, PacketHits& hits, RayPacket::Lanes<ShapeHit>& in_shapes);
/// Finds the first voxel in which each active ray of a packet meets glass, of `glass_voxels` (SightTrees::glass). Skips
/// the voxel where a ray starts if it misses the shapes there, as above the surface of water.
void first_glass(const TracedShapes& shapes, const OccupancyTree& glass_voxels, const RayPacket& rays_in_grid,
                 PacketHits& hits);
/// The expected result of most rays of a packet. Changes their cost, not their results.
enum class MostRays : std::uint8_t {
  Miss,  ///< as rays of occlusion
  Hit,   ///< opaque voxels, as rays to lamps behind walls
};
/// Sets `blocked[i]` to the rays of packet i that hit opaque voxels or visible parts of shapes. `opaque`: the tree of
/// the opaque voxels of `voxels`. Requires: as many elements in `blocked` as packets.
void any_solids(const TracedShapes& shapes, const OccupancyTree& opaque, const Grid& voxels, const VoxelRegistry& types,
                std::span<const RayPacket> packets_in_grid, std::span<std::uint32_t> blocked,
                MostRays expected = MostRays::Miss);

}  // namespace quoin
