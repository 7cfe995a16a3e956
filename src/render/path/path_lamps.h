#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/axis_orientation.h>
#include <quoin/core/changes.h>
#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/mesh/quad.h>
#include <quoin/scene/scene.h>

#include "render/light/emissive_cells.h"
#include "render/light/lamp_table.h"
#include "render/path/light_tree.h"
#include "render/path/path_math.h"
#include "scene/surfaces.h"
#include "scene/tracer/placed_grid.h"

namespace quoin::path {

/// A merged face that emits the same radiance in all directions in front of it, or a lamp without a body.
struct PathLamp {
  DVec3 corner{0.0};  ///< in the world; the position of a lamp without a body
  Vec3 u{0.0F};       ///< along its sides, unit; they and the normal are perpendicular
  Vec3 v{0.0F};
  Vec3 normal{0.0F, 1.0F, 0.0F};  ///< a spot's direction
  float size_u = 0.0F;            ///< world units
  float size_v = 0.0F;
  Vec3 radiance{0.0F};  ///< without a body: intensity
  bool is_point = false;
  bool is_of_shape = false;  ///< a side of a shape: paths do not add its light when they meet it by chance
  float far_boost = 0.0F;    ///< of a side of a shape: see far_light
  float cos_inner = -2.0F;   ///< of a spot, as in PlacedLamp
  float cos_outer = -3.0F;
  float reach = 0.0F;  ///< of a lamp without a body
  /// The texture of the face, whose mean is `radiance`; null without one. The Surfaces of PathLampCache::lamps own it.
  const FaceTexels* texels = nullptr;
  Direction face = Direction::PosX;  ///< in the grid
  AxisOrientation unturned{};        ///< turns the voxels' faces back (VoxelProperties::orientations)
  float voxel_size = 1.0F;           ///< world units
  float light_of_texel = 0.0F;       ///< radiance as a multiple of the texel's colour
};

/// Returns the light of a side of a shape at a distance, as a multiple of its radiance: from afar
/// 1 + PathLamp::far_boost. Below half a voxel the boost fades: close to a small lamp, light would be noise.
[[nodiscard]] inline float far_light(const PathLamp& lamp, float distance) {
  const float square = distance * distance;
  return 1.0F + lamp.far_boost * square / (square + 0.25F * lamp.voxel_size * lamp.voxel_size);
}

/// Light from a lamp towards a point.
struct LampSample {
  Vec3 direction{0.0F};  ///< to the lamp, unit, in the world
  float distance = 0.0F;
  Vec3 radiance{0.0F};   ///< divided by the density; 0: none
  float density = 0.0F;  ///< by solid angle; infinite for a lamp that paths do not meet by chance
};

/// All lamps of a scene, for points anywhere.
class PathLamps {
 public:
  /// `origin`: a point near all lamps.
  PathLamps(std::vector<PathLamp> lamps, DVec3 origin);

  [[nodiscard]] bool empty() const { return lamps_.empty(); }
  [[nodiscard]] std::size_t size() const { return lamps_.size(); }
  /// The tree for choosing lamps; its points are relative to `origin`.
  [[nodiscard]] const LightTree& tree() const { return tree_; }
  [[nodiscard]] DVec3 origin() const { return origin_; }  ///< in the world
  /// Samples a point of a chosen lamp as seen from `point`, in the world.
  [[nodiscard]] LampSample sample(LightTree::Choice chosen, DVec3 point, Pair u) const;
  /// Returns the density of `sample` for the point of a chosen lamp in `direction` at `distance`.
  [[nodiscard]] float density(std::int32_t lamp, DVec3 point, Vec3 direction, float distance) const;

  /// Records that a unit face of a placed grid's voxel is part of a lamp.
  void add_face(std::int32_t placed, IVec3 voxel, Direction face, std::int32_t lamp);
  /// Returns the index of the lamp that contains the face; -1 if none does.
  [[nodiscard]] std::int32_t lamp_of(std::int32_t placed, IVec3 voxel, Direction face) const;

  struct Face {
    IVec3 voxel{0};
    std::int32_t placed = 0;
    std::int32_t lamp = -1;  ///< -1: the slot is free
    Direction direction = Direction::PosX;

    [[nodiscard]] friend bool operator==(const Face&, const Face&) = default;
  };
  // For renderers with their own sampling.
  [[nodiscard]] std::span<const PathLamp> lamps() const { return lamps_; }
  /// The hash table of `lamp_of`; a power of two of slots, or empty.
  [[nodiscard]] std::span<const Face> faces() const { return faces_; }

 private:
  [[nodiscard]] static std::size_t hash_of_face(std::int32_t placed, IVec3 voxel, Direction face);
  void grow();

  DVec3 origin_;
  std::vector<PathLamp> lamps_;
  LightTree tree_;
  std::vector<Face> faces_;  // hash table; a power of two of slots
  std::size_t face_count_ = 0;
};

/// A rectangular side of a shape that emits (is_lamp_side), in voxels from its chunk's lower corner.
struct ShapeLamp {
  Vec3 corner{0.0F};
  Vec3 u{0.0F};  ///< along its sides, perpendicular
  Vec3 v{0.0F};
  Vec3 normal{0.0F};
  Vec3 radiance{0.0F};
  float far_boost = 0.0F;  ///< PathLamp::far_boost
};

/// Keeps the emissive faces of a scene's grids up to date across edits.
class PathLampCache {
 public:
  /// Returns the lamps of the placed instances. `surfaces`: of the scene's types; `sample` requires that they were not
  /// updated since. `brightness`: factor of the lamps'
  /// light. Cost: the quads of changed chunks, and O(faces that emit).
  [[nodiscard]] std::shared_ptr<const PathLamps> lamps(const Scene& scene, std::span<const PlacedGrid> placed,
                                                       const Surfaces& surfaces, double brightness);

 private:
  struct OfGrid {
    EmissiveChunks<Quad> quads;
    EmissiveChunks<ShapeLamp> sides;
    ChangeCursor followed_data;  // the state turns faces and selects shapes
  };
  std::map<GridHandle, OfGrid> quads_;
};

}  // namespace quoin::path
