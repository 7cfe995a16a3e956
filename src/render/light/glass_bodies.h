#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <quoin/core/vec.h>

#include "scene/surfaces.h"
#include "scene/tracer/scene_view.h"

namespace quoin {

/// A run of transparent voxels, parts of shapes or field solid, of one type along a ray. It counts as one piece of
/// glass even if it spans grids and chunks.
struct GlassBody {
  std::int32_t placed = 0;  ///< the grid in which the ray enters the body
  IVec3 voxel{0};           ///< the voxel of entry, or that of the shape, or the cell of a field
  Direction face = Direction::PosX;
  VoxelType type = kAir;
  bool starts_inside = false;
  double t_enter = 0.0;
  double t_exit = 0.0;
  double voxels = 0.0;                    ///< length inside, in voxels of the grids
  std::int32_t exit_placed = 0;           ///< the grid in which the ray leaves the body
  Direction exit_face = Direction::PosX;  ///< the face through which it leaves
  bool in_field = false;                  ///< the ray enters through a field's surface; `face` is unused
  bool exit_in_field = false;             ///< the ray leaves through a field's surface; `exit_face` is unused
  VoxelType before = kAir;                ///< fields only: the transparent material that ends where this one begins
  /// True for CellContent::TexturedGlass and textured shapes that the ray enters.
  bool is_textured = false;
  Rgba8 texel{};  ///< of level 0, where the ray enters textured glass
  /// For shapes: the side through which the ray enters, an index into `model->faces`, or -1 if it starts inside; its
  /// look, if it is textured; the model of `voxel`, else null; and the outward normals where it enters and leaves, in
  /// the grid.
  std::int16_t shape_face = -1;
  bool exit_in_shape = false;
  const VoxelFace* look = nullptr;
  const ShapeModel* model = nullptr;
  Vec3 normal{0.0F};
  Vec3 exit_normal{0.0F};
};

/// The transparent voxels and field parts that a ray meets: bodies of glass, and visible texels of other transparent
/// types. Both nearest first.
struct SeenThrough {
  std::vector<GlassBody> bodies;
  std::vector<MetFace> faces;
  double end = 0.0;  ///< where the ray ends: the first face that hides everything, or `max_t`

  /// Returns where the first content begins; infinity if there is none.
  [[nodiscard]] double begin() const {
    const double body = bodies.empty() ? std::numeric_limits<double>::infinity() : bodies.front().t_enter;
    return faces.empty() ? body : std::min(body, faces.front().t);
  }
  [[nodiscard]] bool empty() const { return bodies.empty() && faces.empty(); }
  /// Returns true if the last face hides everything behind it.
  [[nodiscard]] bool is_closed() const { return !faces.empty() && faces.back().cover >= 1.0F; }
  void clear() {
    bodies.clear();
    faces.clear();
  }
};

/// Finds the transparent content that a ray passes before `max_t`. Clears `out` first. The lists end at a face that
/// hides everything behind it, and deep inside a body that absorbs all light.
void find_transparent(const SceneView& view, const Surfaces& surfaces, const Ray& ray_in_view, double max_t,
                      SeenThrough& out);

/// As above, for a ray of a packet. Faster in a scene with one grid.
void find_transparent(const SceneView& view, const Surfaces& surfaces, const ThroughHits& hits, int lane, double max_t,
                      SeenThrough& out);

/// Returns the rays that end at a visible texel of a cell of faces. They are in the space of grid `home`, all of whose
/// opaque content they miss. Sets `met` to the rays that hit any such cell. Cost: that of a packet, and of a walk from
/// the first cell on for each ray in `met`.
[[nodiscard]] std::uint32_t ends_at_faces(const SceneView& view, const Surfaces& surfaces, std::int32_t home,
                                          const RayPacket& rays_in_grid, std::uint32_t& met);

/// Returns the surface of textured glass: that of its type, with the colour and alpha of its texel.
[[nodiscard]] Surface textured_surface(const Surfaces& surfaces, const GlassBody& body);
/// Returns the surface of a body. `room`: memory for that of textured glass, which must outlive the result.
[[nodiscard]] inline const Surface& surface_of(const Surfaces& surfaces, const GlassBody& body,
                                               std::optional<Surface>& room) {
  return body.is_textured ? room.emplace(textured_surface(surfaces, body)) : surfaces[body.type];
}

/// The appearance of a body to a ray that passes through it.
struct GlassLook {
  Vec3 passed{1.0F};  ///< transmittance per channel
  float own = 0.0F;   ///< share of the body's own colour; at most 1 together with `passed`
};

/// Applies the Beer-Lambert law to the length inside, and adds the material's own colour for the part that is hidden. A
/// voxel body that the ray enters counts as at least one voxel long, so that its edges are crisp. A field body has no
/// edges and keeps its true thickness near its boundary.
[[nodiscard]] GlassLook look_of(const Surface& surface, const GlassBody& body);

/// Returns true if the ray is inside the body at `t` or has just left it. Another body or a surface that begins at `t`
/// then touches this body.
[[nodiscard]] inline bool reaches(const GlassBody& body, double t) {
  constexpr double kTouching = 1e-6;  // the rounding of placed grids
  return t <= body.t_exit + kTouching * std::max(1.0, body.t_exit);
}

/// Returns true if an opaque surface at `t` touches the body's far side. A gap below a hundredth of a voxel counts as
/// touching, so that the rounding of stacked grids does not matter.
[[nodiscard]] bool lies_on_opaque(const SceneView& view, const Ray& ray_in_view, const GlassBody& body, double t);

/// The effect of the surface between two media on a ray.
struct Mirror {
  float share = 0.0F;  ///< share of the seen light that comes from the mirrored direction
  float up = 0.0F;     ///< y component of that direction, a unit vector
};

/// Return the outward normal of a body's surface at the point where a ray enters it, or leaves it into air. In the
/// space of the grid `placed` or `exit_placed`, of unit length, or 0. Cost for fields: about a microsecond.
[[nodiscard]] DVec3 normal_entered(const SceneView& view, const Ray& ray_in_view, const GlassBody& body);
[[nodiscard]] DVec3 normal_left(const SceneView& view, const Ray& ray_in_view, const GlassBody& body);

/// Computes the reflection at a surface of a placed grid between media of these indices of refraction, by Fresnel's
/// equations without polarisation. Rays are not refracted, so their angle counts as the angle in the thinner medium on
/// both sides. Both faces of a pane then mirror the same share, as with refraction, and never all light.
[[nodiscard]] Mirror mirror_at(const SceneView& view, const Ray& ray_in_view, std::int32_t placed,
                               const DVec3& normal_in_grid, float ior, float other_ior);

/// Returns the transmittance per channel of all transparent content on a ray of a packet. `room`: memory to be reused.
[[nodiscard]] Vec3 transmittance_along(const SceneView& view, const Surfaces& surfaces, const ThroughHits& hits,
                                       int lane, double max_t, SeenThrough& room);

}  // namespace quoin
