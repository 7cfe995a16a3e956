#include <quoin/mesh/blocky.h>

#include <algorithm>

#include "core/work/progress_steps.h"
#include "mesh/blocky/chunk_triangles.h"

namespace quoin {

std::int64_t BlockyMesh::triangle_count() const {
  std::size_t total = 0;
  for (const BlockyTriangles& surface : surfaces) total += surface.indices.size() / 3;
  return static_cast<std::int64_t>(total);
}

std::int64_t BlockyMesh::vertex_count() const {
  std::size_t total = 0;
  for (const BlockyTriangles& surface : surfaces) total += surface.positions.size();
  return static_cast<std::int64_t>(total);
}

namespace {

// Returns the quads of all chunks; fewer if `reporter` was cancelled.
std::vector<QuadBuffer> quads_of(const Grid& grid, const std::vector<IVec3>& chunks, const VoxelRegistry& types,
                                 const BlockyMeshOptions& options, Threads threads, ProgressSteps& reporter) {
  std::vector<QuadBuffer> parts(chunks.size());
  // Enough tasks to keep every thread busy; each task uses one mesher for its chunks.
  const std::size_t tasks = std::min<std::size_t>(chunks.size(), std::size_t{8} * thread_count(threads));
  parallel_for(tasks, threads, [&](std::size_t task) {
    BlockyMesher mesher;
    QuadOptions quad_options;
    quad_options.merge = options.merge;
    quad_options.bake_occlusion = options.bake_occlusion;
    for (std::size_t i = task; i < chunks.size() && !reporter.cancelled(); i += tasks) {
      mesher.mesh(grid.neighbourhood(chunks[i]), types, quad_options, parts[i]);
      if (options.cut) options.cut(chunks[i], parts[i]);
      reporter.step();
    }
  });
  return parts;
}

}  // namespace

Result<BlockyMesh> build_blocky_mesh(const Grid& grid, const VoxelRegistry& types, const BlockyMeshOptions& options,
                                     Threads threads, const Progress& progress) {
  const std::vector<IVec3> chunks = grid.chunks();
  ProgressSteps reporter(progress, 2 * chunks.size());
  std::vector<QuadBuffer> parts = quads_of(grid, chunks, types, options, threads, reporter);
  if (reporter.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");

  BlockyMesh mesh;
  mesh.faces_total = 6 * grid.voxel_count();
  ChunkTriangles triangles(types, options.watertight);
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    if (auto done = triangles.append(parts[i], chunks[i], mesh); !done) return done.error();
    parts[i] = {};
    reporter.step();
    if (reporter.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  return mesh;
}

}  // namespace quoin
