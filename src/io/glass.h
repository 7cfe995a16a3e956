#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/mesh/mesh_view.h>
#include <quoin/scene/scene_meshes.h>

#include "light/surfaces.h"

namespace quoin {

/// Represents a body of glass or water in mesh files, whose materials have one alpha and no path length through voxels.
///
/// Behind a body of thickness L, Quoin's images show the fraction `passed` of each channel of the background and `own`,
/// the share of the body's colour c (GlassLook). Clients with alpha only show `1 - alpha` and `alpha`. Clients with
/// transmission show, by coverage and base colour, `1 - alpha + alpha * transmission * c * attenuation` and
/// `alpha * (1 - transmission)`. Therefore:
///
///   alpha         minimises the sum of the squared errors of both over the channels, for clients with alpha only;
///   transmission  gives the body's own share exactly;
///   attenuation   gives, with these, the exact `passed` if possible: it is at most 1, and at least `passed` and
///                 1/100. Blender's Cycles also attenuates the uncovered part: for a pale pane the remaining difference
///                 is small, and would make the pane violet there.
struct GlassMaterial {
  float thickness = 1.0F;  ///< voxels
  float alpha = 1.0F;
  float transmission = 0.0F;
  Vec3 attenuation{1.0F};  ///< per channel through the whole thickness; above 0
  Vec3 tint{1.0F};         ///< transmittance of each channel in the uncovered part
};

/// Requires: `thickness` is above 0.
[[nodiscard]] GlassMaterial glass_material(const Surface& surface, float thickness);

/// Returns the alpha of a smooth surface's vertex, 0 to 65,535, for bodies of that thickness. Requires: as above.
[[nodiscard]] std::uint16_t glass_alpha(const LinearRgba16& albedo, float thickness);

/// Estimates the thickness of closed bodies from their surface: the volume divided by the largest of its projected
/// areas along the axes. Returns 1 for open or empty surfaces. Cost: O(triangles).
[[nodiscard]] float thickness_of(const MeshView& view);

/// The thickness of transparent bodies in a scene's meshes: for each type the median over all placements, weighted by
/// surface area.
class GlassBodies {
 public:
  struct Typical {
    float thickness = 1.0F;  ///< voxels
    float unit = 1.0F;       ///< the world's length of a voxel, the mean by area
  };

  /// Cost: O(transparent triangles), plus another pass per type for parts without MeshPart::thickness.
  explicit GlassBodies(const SceneMeshes& meshes);

  [[nodiscard]] Typical typical(VoxelType type) const;
  /// As `typical`, for smooth surfaces of a type.
  [[nodiscard]] Typical typical_of_smooth(VoxelType type) const;
  [[nodiscard]] float thickness_of_smooth() const { return smooth_.empty() ? 1.0F : typical_of(smooth_).thickness; }

 private:
  struct Seen {
    float thickness = 1.0F;
    double unit = 1.0;
    double area = 0.0;  // in the world
  };

  using ByType = std::map<VoxelType, std::vector<Seen>>;

  /// `times`: the area of its placements in the world.
  static void add_by_type(const MeshPart& part, const MeshView& view, double unit, double times, ByType& all);
  static Typical typical_of(std::vector<Seen> seen);

  ByType by_type_;
  ByType smooth_by_type_;
  std::vector<Seen> smooth_;
};

}  // namespace quoin
