#include "live/grid_surfaces.h"

#include <memory>
#include <utility>

namespace quoin {

LiveMeshOptions GridSurfaces::options_for(SurfaceStyle style) {
  LiveMeshOptions options;
  options.style = style;
  return options;
}

GridSurfaces::GridSurfaces(GridHandle handle, SurfaceStyle style)
    : options_(options_for(style)), grid_(handle, options_, totals_) {}

std::vector<SurfaceUpdate> GridSurfaces::update(const Grid& grid, const VoxelRegistry& types, Threads threads) {
  grid_.follow(grid, LiveClock::now());
  std::vector<SurfaceUpdate> updates;
  if (!grid_.waiting().empty()) {
    const auto voxels = std::make_shared<const Grid>(grid.snapshot());
    LiveTypes looks;
    looks.registry = std::shared_ptr<const VoxelRegistry>(std::shared_ptr<void>(), &types);
    if (options_.style == SurfaceStyle::Smooth) looks.materials = std::make_shared<const SurfaceMaterials>(types);
    const std::vector<IVec3> waiting(grid_.waiting().begin(), grid_.waiting().end());
    std::vector<std::unique_ptr<LiveJob>> jobs;
    for (const IVec3 chunk : waiting) {
      jobs.push_back(grid_.make_job(voxels, chunk, looks));
      grid_.hand_over(chunk, jobs.back()->serial);
    }
    parallel_for(jobs.size(), threads, [&](std::size_t i) {
      thread_local LiveWorkspace workspace;
      try {
        make_live_surface(options_, *jobs[i], workspace);
      } catch (...) {
        workspace = {};  // what memory ran out in may be half made
        throw;
      }
    });
    for (const auto& job : jobs) grid_.collect(*job);
  }
  for (const ReadyChunk& ready : std::exchange(totals_.ready, {})) grid_.take(ready.chunk, updates);
  return updates;
}

}  // namespace quoin
