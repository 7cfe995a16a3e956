#include "render/chunks/surface_source.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>
#include <quoin/grid/chunk.h>

#include "render/chunks/field_surfaces.h"
#include "render/chunks/voxel_surfaces.h"

namespace quoin {
namespace {

double distance_to_chunks(DVec3 point, const IBox& chunks) {
  QUOIN_ASSERT(!chunks.empty(), "a box of chunks");
  const DVec3 first = DVec3(chunks.min) * double{kChunkEdge};
  const DVec3 last = DVec3(chunks.max) * double{kChunkEdge};
  const double distance = glm::length(point - glm::clamp(point, first, last));
  return distance >= 0.0 ? distance : 0.0;
}

}  // namespace

void ChunkDistances::add(const Instance& instance, const SceneGrid& grid) {
  QUOIN_ASSERT(has_valid_transform(instance), "an instance with a finite transform");
  for (const DVec3 eye : eyes_) {
    Place place;
    place.voxel_size = instance.voxel_size;
    place.eye_in_grid =
        glm::transpose(world_axes(instance)) * (eye - instance.position) / instance.voxel_size + grid.pivot;
    if (!chunks_.empty()) place.least = distance_to_chunks(place.eye_in_grid, chunks_) * place.voxel_size;
    places_.push_back(place);
  }
}

void ChunkDistances::sort() {
  std::sort(places_.begin(), places_.end(), [](const Place& a, const Place& b) { return a.least < b.least; });
}

double ChunkDistances::to(IVec3 chunk) const {
  if (places_.empty()) return 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (const Place& place : places_) {
    if (place.least >= least) break;
    const double distance = distance_to_chunks(place.eye_in_grid, {chunk, chunk + 1}) * place.voxel_size;
    least = std::min(least, distance);
  }
  return least;
}

double ChunkDistances::in_voxels(IVec3 chunk) const {
  double least = places_.empty() ? 0.0 : std::numeric_limits<double>::infinity();
  for (const Place& place : places_) least = std::min(least, distance_to_chunks(place.eye_in_grid, {chunk, chunk + 1}));
  return least;
}

std::unique_ptr<SurfaceSource> make_surface_source(SurfaceKey key, const ChunkSurfaceOptions& options,
                                                   SurfaceTotals& totals) {
  if (key.content == SurfaceContent::Field) return std::make_unique<FieldSurfaces>(key.grid, options, totals);
  return std::make_unique<VoxelSurfaces>(key.grid, options, totals);
}

GridSurfaces::GridSurfaces(GridHandle handle, SurfaceContent content, SurfaceStyle style)
    : options_{.style = style, .shapes = ShapeUse::Cubes},
      source_(make_surface_source({handle, content}, options_, totals_)) {
  totals_.loads_only = true;  // `update` returns all surfaces together
}

std::vector<SurfaceUpdate> GridSurfaces::update(const SceneGrid& grid, const VoxelRegistry& types, Threads threads) {
  source_->follow(grid, types, SurfaceClock::now());
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
