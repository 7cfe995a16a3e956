#pragma once

#include <map>
#include <vector>

#include <quoin/scene/scene_meshes.h>

namespace quoin {

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
  [[nodiscard]] float thickness_of_smooth() const { return smooth_.empty() ? 1.0F : typical_of(smooth_).thickness; }

 private:
  struct Seen {
    float thickness = 1.0F;
    double unit = 1.0;
    double area = 0.0;  // in the world
  };

  void add_blocks(const MeshPart& part, const MeshView& view, double unit, double times);
  static Typical typical_of(std::vector<Seen> seen);

  std::map<VoxelType, std::vector<Seen>> by_type_;
  std::vector<Seen> smooth_;
};

}  // namespace quoin
