#pragma once

#include <span>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// How far the nearest eye is from chunks of a grid: from the nearest of its instances.
class ChunkDistances {
 public:
  /// `chunks` hold all that will be asked for, or nearly so; empty: no matter which. `eyes` are read while it lives.
  ChunkDistances(const IBox& chunks, std::span<const DVec3> eyes) : chunks_(chunks), eyes_(eyes) {}

  /// Requires: the instance has a place.
  void add(const Instance& instance, const SceneGrid& grid);
  /// Call it once all instances are added.
  void sort();
  /// In the world. 0 where numbers are not finite, or nothing was added.
  [[nodiscard]] double to(IVec3 chunk) const;
  /// In voxels, or samples, of the instance that is nearest in these. As `to`.
  [[nodiscard]] double in_voxels(IVec3 chunk) const;

 private:
  struct Place {
    DVec3 eye_in_grid{0.0};
    double voxel_size = 1.0;
    double least = 0.0;  // distance of any chunk
  };
  IBox chunks_;
  std::span<const DVec3> eyes_;
  std::vector<Place> places_;
};

}  // namespace quoin
