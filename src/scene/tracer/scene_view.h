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

namespace quoin {

/// Moves points and directions from one space to another.
struct Affine {
  glm::dmat3 axes{1.0};
  DVec3 offset{0.0};
  [[nodiscard]] DVec3 point(const DVec3& p) const { return axes * p + offset; }
};

/// What a packet of rays met in a scene, voxels or fields; lanes whose bit in `grids.hit` is not set hold nothing of
/// meaning.
struct SceneHits {
  PacketHits grids;                         ///< voxels and faces in the grid, distances of the packet's rays
  RayPacket::Lanes<std::int32_t> placed{};  ///< index into SceneTracer::placed
  /// Lanes that met a field. For these the voxel is the cell, the face that to which the normal is nearest; and here is
  /// the unit normal, in the grid, and the material.
  std::uint32_t in_field = 0;
  RayPacket::Lanes<float> normal_x{}, normal_y{}, normal_z{};
  RayPacket::Lanes<VoxelType> material{};

  [[nodiscard]] Vec3 normal(std::size_t lane) const { return {normal_x[lane], normal_y[lane], normal_z[lane]}; }
};

/// Traces rays through a scene, relative to a point near which they are.
///
/// Spaces: view, the world's axes and units with `origin` in the middle, so that rays are as exact 10^9 away from the
///         world's origin as near it; and grid, PlacedGrid::voxels of a placed grid. A ray's t is the same number in
///         both.
/// Threads: any number may trace at once.
class SceneView {
 public:
  /// `tracer` must outlive it. Cost: O(instances).
  SceneView(const SceneTracer& tracer, DVec3 origin);
  SceneView(SceneView&&) noexcept;
  SceneView& operator=(SceneView&&) noexcept;
  ~SceneView();

  [[nodiscard]] const SceneTracer& tracer() const;

  /// From now on `first_hits` passes through these (indices into SceneTracer::placed), which are drawn in another way.
  /// They still stop other rays. Cost: O(instances * log instances).
  void leave_to_impostors(std::span<const std::int32_t> placed);

  /// The nearest opaque voxel, or what is opaque of a field, of all instances for each ray, in view space; of equally
  /// near ones the instance that comes first, in it the voxel.
  void first_hits(const RayPacket& rays_in_view, SceneHits& hits) const;

  /// Which rays meet an opaque voxel, or what is opaque of a field, of any instance. They are in the space of grid
  /// `home`, which is asked first.
  [[nodiscard]] std::uint32_t any_hits(std::int32_t home, const RayPacket& rays_in_grid) const;

  /// Which rays meet a transparent voxel of any instance, or a cell of a field that may hold something transparent.
  [[nodiscard]] std::uint32_t any_transparent(const RayPacket& rays_in_view) const;

  /// Calls `visit` for each instance with transparent voxels, or a field of which something is transparent, that one
  /// ray may meet before `max_t`: an index into SceneTracer::placed, and the ray in its grid.
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
