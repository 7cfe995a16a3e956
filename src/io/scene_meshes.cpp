#include <quoin/io/scene_meshes.h>

#include <algorithm>
#include <mutex>
#include <optional>

namespace quoin {

namespace {

/// Grids of at most this many chunks are meshed side by side, one thread each; larger ones one after the other, with
/// all threads on their chunks.
constexpr std::size_t kSmallGridChunks = 4;

/// Adds up the progress of many grids, each weighted by its chunks, for one listener.
class SharedProgress {
 public:
  SharedProgress(const Progress& listener, std::size_t total)
      : listener_(listener), total_(std::max<std::size_t>(total, 1)) {}

  /// Says that `chunks` more are done; false when the listener wants to stop.
  bool advance(double chunks) {
    if (!listener_) return true;
    const std::lock_guard lock(mutex_);
    done_ += chunks;
    if (going_) going_ = listener_(std::min(1.0, done_ / static_cast<double>(total_)));
    return going_;
  }

 private:
  const Progress& listener_;
  std::size_t total_;
  std::mutex mutex_;
  double done_ = 0;
  bool going_ = true;
};

std::vector<GridHandle> drawn_grids(const Scene& scene, bool hidden) {
  std::vector<GridHandle> grids;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (is_drawn(scene, instance, hidden)) grids.push_back(instance.grid);
  }
  std::sort(grids.begin(), grids.end());
  grids.erase(std::unique(grids.begin(), grids.end()), grids.end());
  return grids;
}

Result<BlockyMesh> mesh_grid(const Scene& scene, GridHandle handle, const BlockyMeshOptions& options, Threads threads,
                             SharedProgress& progress) {
  const Grid& grid = scene.grids()[handle].grid;
  const auto chunks = static_cast<double>(grid.chunk_count());
  double told = 0;
  auto mesh = build_blocky_mesh(grid, scene.types, options, threads, [&](double fraction) {
    const double more = (fraction - told) * chunks;
    told = fraction;
    return progress.advance(more);
  });
  if (mesh && !progress.advance((1.0 - told) * chunks)) return fail(ErrorCode::Cancelled, "cancelled");
  return mesh;
}

using MeshResults = std::vector<std::optional<Result<BlockyMesh>>>;

MeshResults mesh_all(const Scene& scene, const std::vector<GridHandle>& grids, const BlockyMeshOptions& options,
                     Threads threads, const Progress& listener) {
  std::size_t chunks = 0;
  std::vector<std::size_t> small;
  std::vector<std::size_t> large;
  for (std::size_t i = 0; i < grids.size(); ++i) {
    const std::size_t count = scene.grids()[grids[i]].grid.chunk_count();
    chunks += count;
    (count <= kSmallGridChunks ? small : large).push_back(i);
  }
  SharedProgress progress(listener, chunks);
  MeshResults results(grids.size());
  parallel_for(small.size(), threads, [&](std::size_t i) {
    results[small[i]] = mesh_grid(scene, grids[small[i]], options, Threads{1}, progress);
  });
  for (const std::size_t i : large) {
    results[i] = mesh_grid(scene, grids[i], options, threads, progress);
    if (!*results[i]) break;
  }
  return results;
}

/// A type that is not registered counts as opaque, so only opaque surfaces can have one.
bool has_unregistered_type(const BlockyMesh& mesh, const VoxelRegistry& types) {
  const std::vector<VoxelType>& used = mesh.surfaces[static_cast<std::size_t>(SurfaceClass::Opaque)].types;
  return !used.empty() && *std::max_element(used.begin(), used.end()) >= types.size();
}

void add_totals(SceneMeshes& meshes, const BlockyMesh& mesh) {
  meshes.faces_visible += mesh.faces_visible;
  meshes.faces_total += mesh.faces_total;
  meshes.quads += mesh.quads;
  meshes.triangles += mesh.triangle_count();
  meshes.vertices += mesh.vertex_count();
}

}  // namespace

const BlockyMesh* SceneMeshes::find(GridHandle grid) const {
  const auto found = std::lower_bound(grids.begin(), grids.end(), grid,
                                      [](const GridMesh& entry, GridHandle handle) { return entry.grid < handle; });
  return found != grids.end() && found->grid == grid ? &found->mesh : nullptr;
}

bool is_drawn(const Scene& scene, const Instance& instance, bool hidden) {
  return (instance.visible || hidden) && scene.grids().find(instance.grid) != nullptr;
}

Result<SceneMeshes> mesh_scene(const Scene& scene, const BlockyMeshOptions& options, bool hidden, Threads threads,
                               const Progress& progress) {
  const std::vector<GridHandle> grids = drawn_grids(scene, hidden);
  MeshResults results = mesh_all(scene, grids, options, threads, progress);
  for (const auto& result : results) {
    if (result && !*result) return tl::unexpected<Error>(result->error());
  }
  SceneMeshes meshes;
  meshes.occlusion = options.occlusion;
  meshes.hidden = hidden;
  meshes.grids.reserve(grids.size());
  for (std::size_t i = 0; i < grids.size(); ++i) {
    if (has_unregistered_type(**results[i], scene.types)) {
      return fail(ErrorCode::InvalidArgument,
                  "grid \"" + scene.grids()[grids[i]].name + "\" holds voxels of a type that is not registered");
    }
    add_totals(meshes, **results[i]);
    meshes.grids.push_back({grids[i], std::move(**results[i])});
  }
  return meshes;
}

}  // namespace quoin
