#pragma once

// The unloaded chunks of partial grids, as rays and shapes hit them: cubes of chunk size, in a space whose unit is a
// chunk. Between field samples a point is known if all eight samples around it are. Queries of a field therefore test
// the point itself and the positions one sample farther along each axis.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <type_traits>

#include <glm/common.hpp>

#include <quoin/core/direction.h>
#include <quoin/scene/scene_query.h>
#include <quoin/trace/ray.h>

#include "core/coordinates/long_box.h"
#include "scene/query/query_in_grid.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {

/// Reads the chunks of a placed grid as voxels: unloaded chunks are solid, loaded ones are air.
class UnloadedReader {
 public:
  /// `asks_voxels`: tests the voxels in addition to the field.
  UnloadedReader(const SceneGrid& grid, bool asks_voxels) : grid_(&grid), asks_voxels_(asks_voxels) {}
  [[nodiscard]] VoxelType get(IVec3 chunk) const {
    const bool is_loaded = (!asks_voxels_ || grid_->grid.is_loaded(chunk)) && grid_->field.is_loaded(chunk);
    return is_loaded ? kAir : VoxelType{1};
  }

 private:
  const SceneGrid* grid_;
  bool asks_voxels_;
};

/// Returns a box of all chunks that can be unloaded.
inline IBox extent_of(const SceneGrid& grid) {
  return unite(grid.grid.extent(), grid.field.extent());
}

/// Calls `ask(offset in chunks, reader)` for a point. If the grid has a partial field, also calls it for the seven
/// samples around the point.
template <class Ask>
void for_each_corner(const SceneGrid& grid, const Ask& ask) {
  const int count = grid.field.is_partial() ? 8 : 1;
  for (int i = 0; i < count; ++i) {
    ask(DVec3(i & 1, i >> 1 & 1, i >> 2) / double{kChunkEdge}, UnloadedReader(grid, i == 0));
  }
}

/// Returns true if all chunks that a box may touch are loaded; the box is in chunk units. Returns false if there are
/// too many to check.
inline bool is_surely_loaded(const SceneGrid& grid, const DBox& bounds) {
  constexpr double kFew = 256.0;
  const DBox all{bounds.min - 1e-6, bounds.max + 1e-6 + (grid.field.is_partial() ? 1.0 / kChunkEdge : 0.0)};
  const IBox chunks = voxels_within(all, extent_of(grid));
  const DVec3 size = DVec3(chunks.max) - DVec3(chunks.min);
  if (size.x * size.y * size.z > kFew) return false;
  const UnloadedReader reader(grid, true);
  for (int z = chunks.min.z; z < chunks.max.z; ++z) {
    for (int y = chunks.min.y; y < chunks.max.y; ++y) {
      for (int x = chunks.min.x; x < chunks.max.x; ++x) {
        if (reader.get({x, y, z}) != kAir) return false;
      }
    }
  }
  return true;
}

/// The first chunk that is not loaded along a ray in chunks, up to and including `max_t`; as `first_hit` of voxels.
/// Cost: O(loaded chunks on the ray within `extent_of`).
[[nodiscard]] std::optional<RayHit> first_unloaded(const SceneGrid& grid, const Ray& ray_in_chunks, double max_t);

}  // namespace quoin
