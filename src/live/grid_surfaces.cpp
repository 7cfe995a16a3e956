#include "live/grid_surfaces.h"

#include <memory>
#include <utility>

#include "live/live_field.h"
#include "live/live_grid.h"

namespace quoin {

LiveMeshOptions GridSurfaces::options_for(SurfaceStyle style) {
  LiveMeshOptions options;
  options.style = style;
  return options;
}

GridSurfaces::GridSurfaces(GridHandle handle, SurfaceContent content, SurfaceStyle style)
    : options_(options_for(style)) {
  if (content == SurfaceContent::Field) {
    source_ = std::make_unique<LiveField>(handle, options_, totals_);
  } else {
    source_ = std::make_unique<LiveGrid>(handle, options_, totals_);
  }
}

std::vector<SurfaceUpdate> GridSurfaces::update(const SceneGrid& grid, const VoxelRegistry& types, Threads threads) {
  source_->follow(grid, LiveClock::now());
  LiveTypes looks;
  looks.registry = std::shared_ptr<const VoxelRegistry>(std::shared_ptr<void>(), &types);
  // Connected chunks of a field are meshed as one group; chunks that waited for the group may follow.
  for (source_->prepare(grid, types); !source_->waiting().empty(); source_->prepare(grid, types)) {
    const bool needs_materials = options_.style == SurfaceStyle::Smooth && looks.materials == nullptr;
    if (needs_materials) looks.materials = std::make_shared<const SurfaceMaterials>(types);
    LiveInputs inputs(grid, looks);
    const std::vector<IVec3> waiting(source_->waiting().begin(), source_->waiting().end());
    std::vector<std::unique_ptr<LiveJob>> jobs;
    for (const IVec3 chunk : waiting) {
      jobs.push_back(source_->make_job(inputs, chunk));
      source_->hand_over(chunk, jobs.back()->serial);
    }
    parallel_for(jobs.size(), threads, [&](std::size_t i) {
      thread_local LiveWorkspace workspace;
      try {
        make_live_surface(options_, *jobs[i], workspace);
      } catch (...) {
        workspace = {};  // an allocation failure may have left it incomplete
        throw;
      }
    });
    for (const auto& job : jobs) source_->collect(*job);
  }
  std::vector<SurfaceUpdate> updates;
  for (const ReadyChunk& ready : std::exchange(totals_.ready, {})) source_->take(ready.chunk, updates);
  return updates;
}

}  // namespace quoin
