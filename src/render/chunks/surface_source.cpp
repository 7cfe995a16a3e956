#include "render/chunks/surface_source.h"

#include <algorithm>
#include <limits>

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

}  // namespace quoin
