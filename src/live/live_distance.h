#pragma once

#include <vector>

#include <quoin/core/vec.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// How far the eye is from chunks of a grid, in the world: from the nearest of its instances.
class ChunkDistances {
 public:
  /// `chunks` hold all that will be asked for, or nearly so.
  ChunkDistances(const IBox& chunks, DVec3 eye) : chunks_(chunks), eye_(eye) {}

  /// Requires: the instance has a place.
  void add(const Instance& instance, const SceneGrid& grid);
  /// Call it once all instances are added.
  void sort();
  /// 0 where numbers are not finite, or nothing was added.
  [[nodiscard]] double to(IVec3 chunk) const;

 private:
  struct Place {
    DVec3 eye_in_grid{0.0};
    double voxel_size = 1.0;
    double least = 0.0;  // distance of any chunk
  };
  IBox chunks_;
  DVec3 eye_;
  std::vector<Place> places_;
};

}  // namespace quoin
