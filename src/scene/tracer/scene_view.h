#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include <glm/mat3x3.hpp>

#include <quoin/core/function_ref.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/trace/packet.h>
#include <quoin/trace/ray.h>

#include "scene/tracer/placed_grid.h"
#include "scene/tracer/shape_rays.h"

namespace quoin {

/// Moves points and directions from one space to another.
struct Affine {
  glm::dmat3 axes{1.0};
  DVec3 offset{0.0};
  [[nodiscard]] DVec3 point(const DVec3& p) const { return axes * p + offset; }
};

/// The hits of a ray packet in a scene, with voxels, shapes or fields. Lanes without a bit in `grids.hit` are
/// undefined.
struct SceneHits {
  PacketHits grids;                         ///< voxels and faces in the grid, distances of the packet's rays
  RayPacket::Lanes<std::int32_t> placed{};  ///< index into SceneTracer::placed
  /// Lanes that hit a field. For these, the voxel is the cell and the face is the direction nearest to the normal. The
  /// members below contain the unit normal, in the grid's space, and the material.
  std::uint32_t in_field = 0;
  RayPacket::Lanes<float> normal_x{}, normal_y{}, normal_z{};
  RayPacket::Lanes<VoxelType> material{};

  /// Lanes that hit a shape. For these, the voxel is that of the shape, and the face is ShapeHit::direction.
  std::uint32_t in_shape = 0;
  RayPacket::Lanes<ShapeHit> shapes;

  [[nodiscard]] Vec3 normal(std::size_t lane) const { return {normal_x[lane], normal_y[lane], normal_z[lane]}; }
};

/// The rays of a packet that may meet transparent content.
struct ThroughHits {
  RayPacket rays;           ///< in view space, or in that of the only grid of the scene (`has_first`)
  std::uint32_t glass = 0;  ///< lanes that hit voxels with glass or field cells
  std::uint32_t faces = 0;  ///< lanes that hit cells of faces
  /// The scene has one grid, with shapes or cells of faces: the first voxels that the rays hit are known.
  bool has_first = false;
  PacketHits first_glass;
  PacketHits first_faces;
};

/// Traces rays through a scene, relative to a point near the rays.
///
/// Spaces: view, the world's axes and units with `origin` in the middle, so that rays are as exact 10^9 away from the
///         world's origin as near it; and grid, PlacedGrid::voxels of a placed grid. A ray's t is the same number in
///         both.
/// Threads: any number may trace concurrently.
class SceneView {
 public:
  /// `tracer` must outlive it. Cost: O(instances).
  SceneView(const SceneTracer& tracer, DVec3 origin);
  SceneView(SceneView&&) noexcept;
  SceneView& operator=(SceneView&&) noexcept;
  ~SceneView();

  [[nodiscard]] const SceneTracer& tracer() const;

  /// Makes `first_hits` skip these instances (indices into SceneTracer::placed), because impostors draw them. They
  /// still block other rays. Cost: O(instances * log instances).
  void leave_to_impostors(std::span<const std::int32_t> placed);

  /// Finds the nearest opaque voxel, visible part of a shape (ShapeParts::Visible) or field surface of all instances
  /// for each ray, in view space. Of equally near hits, the one of the first instance counts, and a shape before a
  /// voxel, and a voxel before a field.
  void first_hits(const RayPacket& rays_in_view, SceneHits& hits) const;

  /// Returns the rays that hit an opaque voxel, visible part of a shape or field of any instance. They are in the
  /// space of grid `home`, which is tested first.
  [[nodiscard]] std::uint32_t any_hits(std::int32_t home, const RayPacket& rays_in_grid,
                                       MostRays expected = MostRays::Miss) const;
  /// Sets `blocked[i]` to the result of `any_hits` for packet i. Faster than one by one for endless rays.
  /// Requires: at least as many elements in `blocked` as packets.
  void any_hits(std::int32_t home, std::span<const RayPacket> packets_in_grid, std::span<std::uint32_t> blocked) const;

  /// Returns the rays that hit a transparent voxel of any instance, or a voxel or field cell that may contain
  /// transparent parts of a shape or transparent material.
  [[nodiscard]] std::uint32_t any_transparent(const RayPacket& rays_in_view) const;
  /// As above, with more about them.
  void find_through(const RayPacket& rays_in_view, ThroughHits& hits) const;
  /// As above, for rays in the space of grid `home`, without cells of faces.
  void find_glass(std::int32_t home, const RayPacket& rays_in_grid, ThroughHits& hits) const;
  /// Calls `visit` for each instance whose cells of faces some of the rays may hit, beginning with grid `home`, in
  /// whose space the rays are. Passes an index into SceneTracer::placed, the rays in its space, and their first hits
  /// on cells; `visit` returns the rays that end there, which other instances need not look at. Returns all these
  /// rays.
  std::uint32_t visit_face_cells(
      std::int32_t home, const RayPacket& rays_in_grid,
      FunctionRef<std::uint32_t(std::int32_t placed, const RayPacket& rays_in_grid, const PacketHits& first)> visit)
      const;

  /// Calls `visit` for each instance with transparent voxels or transparent field parts that one ray may hit before
  /// `max_t`. Passes an index into SceneTracer::placed and the ray in the grid's space.
  void visit_transparent(const Ray& ray_in_view, double max_t,
                         FunctionRef<void(std::int32_t placed, const Ray& ray_in_grid)> visit) const;

  [[nodiscard]] const Affine& grid_from_view(std::int32_t placed) const;
  [[nodiscard]] const Affine& view_from_grid(std::int32_t placed) const;
  [[nodiscard]] RayPacket view_from_grid(std::int32_t placed, const RayPacket& rays_in_grid) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
