#pragma once

#include <memory>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/chunk_surface.h>
#include <quoin/scene/scene.h>

#include "render/chunks/surface_source.h"

namespace quoin {

/// The surfaces of the chunks of one grid's voxels or field, made on request instead of by workers. Equal to those of
/// LiveMeshes; after an edit, only the affected ones are made.
class GridSurfaces {
 public:
  GridSurfaces(GridHandle handle, SurfaceContent content, SurfaceStyle style);
  GridSurfaces(const GridSurfaces&) = delete;
  GridSurfaces& operator=(const GridSurfaces&) = delete;

  [[nodiscard]] SurfaceStyle style() const { return options_.style; }
  /// Makes the next `update` start from scratch, because the look of types may have changed.
  void forget() { source_->forget(); }
  /// Returns the changes since the last call, as LiveMeshes::take does. Requires: always the same grid or its
  /// snapshots. Errors: bad_alloc; do not call it again after that.
  [[nodiscard]] std::vector<SurfaceUpdate> update(const SceneGrid& grid, const VoxelRegistry& types, Threads threads);

 private:
  const ChunkSurfaceOptions options_;
  SurfaceTotals totals_;
  std::unique_ptr<SurfaceSource> source_;
};

}  // namespace quoin
