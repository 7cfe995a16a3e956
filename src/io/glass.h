#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/mesh/mesh_view.h>
#include <quoin/scene/scene_meshes.h>

#include "light/surfaces.h"

namespace quoin {

/// How files say a body of glass or water, whose materials have one alpha and not a way through voxels.
///
/// Behind a body of thickness L Quoin's pictures have `passed` of each channel of what lies there and `own` of the
/// body's colour c (GlassLook). Clients that know alpha only have `1 - alpha` and `alpha`. Those that know transmission
/// have, by coverage and base colour, `1 - alpha + alpha * transmission * c * attenuation` and
/// `alpha * (1 - transmission)`. So that
///
///   alpha         makes the least error of both, summed in squares over the channels, where nothing else is known;
///   transmission  gives the body's own share exactly;
///   attenuation   gives, with these, what passes, where it can: it is at most 1, and no less than `passed` and a
///                 hundredth. Blender's Cycles attenuates what is not covered too: of a pale pane the difference that
///                 is left over is small, and would make it violet there.
struct GlassMaterial {
  float thickness = 1.0F;  ///< voxels
  float alpha = 1.0F;
  float transmission = 0.0F;
  Vec3 attenuation{1.0F};  ///< of each channel by the whole thickness; above 0
  Vec3 tint{1.0F};         ///< of each channel, what passes of what is not covered
};

/// Requires: `thickness` is above 0.
[[nodiscard]] GlassMaterial glass_material(const Surface& surface, float thickness);

/// The alpha of a smooth surface's vertex, 0 to 65,535, for bodies of that thickness. Requires: as above.
[[nodiscard]] std::uint16_t glass_alpha(const LinearRgba16& albedo, float thickness);

/// The thickness of closed bodies by their surface alone: what they hold, by the largest of the areas that they show
/// along the axes. 1 where it is not closed or holds nothing. Cost: O(triangles).
[[nodiscard]] float thickness_of(const MeshView& view);

/// How thick the bodies of transparent types are in a scene's meshes: of each type the median over all placements, by
/// the area of its surface in them.
class GlassBodies {
 public:
  struct Typical {
    float thickness = 1.0F;  ///< voxels
    float unit = 1.0F;       ///< the world's length of a voxel, the mean by area
  };

  /// Cost: O(triangles that are transparent), and of parts without MeshPart::thickness once more a type.
  explicit GlassBodies(const SceneMeshes& meshes);

  [[nodiscard]] Typical typical(VoxelType type) const;
  /// The same of smooth surfaces of a type.
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
