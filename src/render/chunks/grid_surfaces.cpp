#include "render/chunks/grid_surfaces.h"

#include <utility>

namespace quoin {

GridSurfaces::GridSurfaces(GridHandle handle, SurfaceContent content, SurfaceStyle style)
    : options_{.style = style}, source_(make_surface_source({handle, content}, options_, totals_)) {}

std::vector<SurfaceUpdate> GridSurfaces::update(const SceneGrid& grid, const VoxelRegistry& types, Threads threads) {
  source_->follow(grid, SurfaceClock::now());
  SurfaceTypes looks;
  looks.registry = std::shared_ptr<const VoxelRegistry>(std::shared_ptr<void>(), &types);
  // Connected chunks of a field are meshed as one group; chunks that waited for the group may follow.
  for (source_->prepare(grid, types); !source_->waiting().empty(); source_->prepare(grid, types)) {
    const bool needs_materials = options_.style == SurfaceStyle::Smooth && looks.materials == nullptr;
    if (needs_materials) looks.materials = std::make_shared<const SurfaceMaterials>(types);
    SurfaceInputs inputs(grid, looks);
    const std::vector<IVec3> waiting(source_->waiting().begin(), source_->waiting().end());
    std::vector<std::unique_ptr<SurfaceJob>> jobs;
    for (const IVec3 chunk : waiting) {
      jobs.push_back(source_->make_job(inputs, chunk));
      source_->hand_over(chunk, jobs.back()->serial);
    }
    parallel_for(jobs.size(), threads, [&](std::size_t i) {
      thread_local SurfaceWorkspace workspace;
      try {
        make_chunk_surface(options_, *jobs[i], workspace);
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
