#include <quoin/live/live_meshes.h>

#include <quoin/core/assert.h>

#include "live/mesh_scheduler.h"

namespace quoin {

std::int64_t ChunkSurface::triangles() const {
  return 2 * static_cast<std::int64_t>(quads.size()) + static_cast<std::int64_t>(smooth.indices.size() / 3);
}

std::size_t ChunkSurface::bytes() const {
  return sizeof(ChunkSurface) + quads.capacity() * sizeof(Quad) + smooth.positions.capacity() * sizeof(Vec3) +
         smooth.normals.capacity() * sizeof(Vec3) + smooth.occlusion.capacity() * sizeof(float) +
         smooth.cells.capacity() * sizeof(SmoothCell) + smooth.indices.capacity() * sizeof(std::uint32_t) +
         albedo.capacity() * sizeof(LinearRgba16) + types.capacity() * sizeof(VoxelType) +
         regions.capacity() * sizeof(SurfaceRegion) + light.capacity() * sizeof(FaceLight);
}

struct LiveMeshes::Impl {
  explicit Impl(const LiveMeshOptions& options)
      : scheduler(options,
                  [options](LiveJob& job, LiveWorkspace& workspace) { make_live_surface(options, job, workspace); }) {}
  MeshScheduler scheduler;
};

LiveMeshes::LiveMeshes(const LiveMeshOptions& options) {
  QUOIN_ASSERT(options.region_edge == 16 || options.region_edge == 32 || options.region_edge == 64,
               "regions are 16, 32 or 64 voxels wide");
  impl_ = std::make_unique<Impl>(options);
}
// Workers may call the callback until they have stopped.
LiveMeshes::~LiveMeshes() {
  impl_->scheduler.stop();
}

void LiveMeshes::update(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes) {
  impl_->scheduler.update(scene, eye, other_eyes);
}
void LiveMeshes::use_light(const SceneLight* light) {
  impl_->scheduler.use_light(light);
}
std::vector<SurfaceUpdate> LiveMeshes::take(std::size_t max_bytes) {
  return impl_->scheduler.take(max_bytes);
}
std::size_t LiveMeshes::pending() const {
  return impl_->scheduler.pending();
}
void LiveMeshes::finish(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes) {
  impl_->scheduler.finish(scene, eye, other_eyes);
}
LiveMeshes::Stats LiveMeshes::stats() const {
  return impl_->scheduler.stats();
}

}  // namespace quoin
