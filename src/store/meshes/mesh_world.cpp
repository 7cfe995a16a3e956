#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <mutex>
#include <set>
#include <utility>

#include <glm/common.hpp>

#include <quoin/core/assert.h>
#include <quoin/scene/near_grids.h>
#include <quoin/store/world_meshes.h>

#include "core/bytes/error_path.h"
#include "core/coordinates/chunk_order.h"
#include "core/work/workers.h"
#include "mesh/blocky/chunk_triangles.h"
#include "scene/meshes/glass_thickness.h"
#include "store/meshes/chunk_cache.h"
#include "store/meshes/spool.h"

namespace quoin {

using namespace store;

namespace {

// Number of chunks meshed at once.
constexpr std::size_t kBatch = 32;
// Interval for releasing mapped file pages: memory statistics do not attribute these pages to the mesher.
constexpr auto kGiveBack = std::chrono::milliseconds(10);

/// The triangles of a grid, in files.
class SpooledMesh {
 public:
  Status append(const BlockyMesh& mesh, const std::filesystem::path& folder) {
    for (std::size_t i = 0; i < kSurfaceClasses; ++i) {
      const BlockyTriangles& from = mesh.surfaces[i];
      if (from.indices.empty()) continue;
      QUOIN_ASSERT(from.directions.size() == from.positions.size() && from.types.size() == from.positions.size() &&
                       from.occlusion.size() == from.positions.size(),
                   "one value per vertex");
      Surface& to = surfaces_[i];
      if (to.vertices + from.positions.size() > std::numeric_limits<std::uint32_t>::max() - 1'024) {
        return make_error(ErrorCode::LimitExceeded, "the mesh needs more than 2^32 vertices");
      }
      std::vector<std::uint32_t> indices = from.indices;
      for (std::uint32_t& index : indices) index += static_cast<std::uint32_t>(to.vertices);
      to.vertices += from.positions.size();
      for (const Status& done :
           {to.positions.append(from.positions, folder), to.directions.append(from.directions, folder),
            to.occlusion.append(from.occlusion, folder), to.types.append(from.types, folder),
            to.indices.append(indices, folder)}) {
        if (!done) return done;
      }
    }
    return {};
  }
  Status finish() {
    for (Surface& surface : surfaces_) {
      for (Spool* const spool : surface.all()) {
        if (auto done = spool->finish(); !done) return done;
      }
    }
    giver_.start(1, [this](Workers::Lock& /*lock*/, unsigned /*worker*/) {
      for (Surface& surface : surfaces_) {
        for (const Spool* const spool : surface.all()) spool->give_back();
      }
      return Workers::Clock::now() + kGiveBack;
    });
    return {};
  }
  [[nodiscard]] std::vector<MeshView> views() const {
    std::vector<MeshView> views;
    for (std::size_t i = 0; i < kSurfaceClasses; ++i) {
      const Surface& surface = surfaces_[i];
      if (surface.vertices == 0) continue;
      MeshView& view = views.emplace_back();
      view.positions = surface.positions.values<Vec3>();
      view.indices = surface.indices.values<std::uint32_t>();
      view.surface = static_cast<SurfaceClass>(i);
      view.directions = surface.directions.values<Direction>();
      view.types = surface.types.values<VoxelType>();
      view.block_occlusion = surface.occlusion.values<std::uint8_t>();
    }
    return views;
  }

 private:
  struct Surface {
    std::uint64_t vertices = 0;
    Spool positions, directions, occlusion, types, indices;
    std::array<Spool*, 5> all() { return {&positions, &directions, &occlusion, &types, &indices}; }
  };

  std::array<Surface, kSurfaceClasses> surfaces_;
  std::mutex mutex_;
  Workers giver_{mutex_};
};

/// Reads voxels of a grid across chunks.
class CachedReader {
 public:
  /// `origin`: the chunk whose corner is the origin of voxel coordinates.
  CachedReader(ChunkCache& cache, IVec3 origin, Threads threads)
      : cache_(cache), origin_(origin * kChunkEdge), threads_(threads) {}
  VoxelType get(IVec3 from_origin) {
    const IVec3 voxel = origin_ + from_origin;
    const IVec3 place = chunk_of(voxel);
    if (chunk_ == nullptr || place != place_) {
      cache_.trim();
      cache_.load({&place, 1}, threads_);
      chunk_ = cache_.find(place);
      place_ = place;
    }
    return chunk_ == nullptr ? kAir : chunk_->get(local_of(voxel));
  }

 private:
  ChunkCache& cache_;
  IVec3 origin_;
  Threads threads_;
  const Chunk* chunk_ = nullptr;
  IVec3 place_{0};
};

/// Reads the chunks of a batch and their neighbours through the cache.
Result<Grid> window_around(std::span<const IVec3> batch, ChunkCache& cache, Threads threads) {
  std::vector<IVec3> around;
  for (const IVec3 chunk : batch) {
    for (int i = 0; i < 27; ++i) around.push_back(chunk + IVec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
  }
  sort_and_unite(around);
  cache.load(around, threads);
  if (!cache.status()) return cache.status().error();
  Grid window;
  for (const IVec3 place : around) {
    if (const Chunk* const chunk = cache.find(place)) window.put_chunk(place, *chunk);
  }
  cache.trim();
  return window;
}

/// Counts the faces of one grid of a world. Errors: read errors; Cancelled.
Result<FaceCounts> count_grid_faces(ChunkCache& cache, const VoxelRegistry& types, Threads threads,
                                    const Progress& progress) {
  FaceCounts counts;
  const std::span<const IVec3> places = cache.places();
  for (std::size_t i = 0; i < places.size(); i += kBatch) {
    const auto batch = places.subspan(i, std::min(kBatch, places.size() - i));
    const auto window = window_around(batch, cache, threads);
    if (!window) return window.error();
    std::vector<std::int64_t> visible(batch.size());
    const std::size_t tasks = std::min<std::size_t>(batch.size(), thread_count(threads));
    parallel_for(tasks, threads, [&](std::size_t task) {
      BlockyMesher mesher;
      for (std::size_t k = task; k < batch.size(); k += tasks) {
        visible[k] = mesher.count_faces(window->neighbourhood(batch[k]), types);
      }
    });
    for (const std::int64_t count : visible) counts.visible += count;
    if (progress && !progress(static_cast<double>(i) / static_cast<double>(places.size()))) {
      return make_error(ErrorCode::Cancelled, "cancelled");
    }
  }
  if (!cache.status()) return cache.status().error();
  counts.total = 6 * cache.voxels();
  return counts;
}

class WorldMesher {
 public:
  WorldMesher(const WorldStore& world, const LoadedWorld& loaded, const WorldMeshOptions& options, Threads threads,
              const Progress& progress)
      : world_(world), loaded_(loaded), options_(options), threads_(threads), progress_(progress) {}

  Result<WorldMeshes> run() {
    const Scene& scene = loaded_.loaded.scene;
    BlockySceneOptions wanted = options_.scene;
    wanted.part_of = [this](GridHandle grid, MeshStats& stats) { return part_of_grid(grid, stats); };
    auto meshes = mesh_scene(scene, wanted, threads_, {});
    if (!meshes) return meshes.error();
    made_.meshes = std::move(*meshes);
    // Grids without placements are counted too.
    for (const GridHandle grid : scene.grids().handles()) {
      if (meshed_.contains(grid)) continue;
      ChunkCache cache(world_, number_of(grid), options_.cache_bytes);
      if (auto done = read_all(cache); !done) return done.error();
    }
    return std::move(made_);
  }

 private:
  [[nodiscard]] std::uint32_t number_of(GridHandle grid) const {
    const auto number = loaded_.saver.number_of(grid);
    QUOIN_ASSERT(number.has_value(), "a loaded grid has a number");
    return *number;
  }
  [[nodiscard]] Status cancelled() const {
    return make_error(ErrorCode::Cancelled, "cancelled", world_.path().string());
  }
  [[nodiscard]] static Status densities() {
    return make_error(ErrorCode::Unsupported, "cannot mesh densities in parts: load the whole world");
  }
  [[nodiscard]] Error of_folder(Error error) const {
    if (error.code == ErrorCode::CannotWrite) error.path = options_.folder.empty() ? "." : options_.folder.string();
    return error;
  }
  void count(const ChunkCache& cache) {
    made_.voxels += cache.voxels();
    made_.voxels_with_data += cache.data();
    made_.broken.insert(made_.broken.end(), cache.damage().begin(), cache.damage().end());
  }

  Status read_all(ChunkCache& cache) {
    const std::span<const IVec3> places = cache.places();
    for (std::size_t i = 0; cache.status() && i < places.size(); i += kBatch) {
      cache.load(places.subspan(i, std::min(kBatch, places.size() - i)), threads_);
      cache.trim();
      if (progress_ && !progress_(1.0)) return cancelled();
    }
    count(cache);
    return cache.status();
  }

  Result<MeshPart> part_of_grid(GridHandle grid, MeshStats& stats) {
    meshed_.insert(grid);
    ChunkCache cache(world_, number_of(grid), options_.cache_bytes);
    auto spooled = std::make_shared<SpooledMesh>();
    ChunkTriangles triangles(loaded_.loaded.scene.types, options_.scene.mesh.watertight);
    const std::span<const IVec3> places = cache.places();
    const auto origin = origin_of(places);
    if (!origin) return origin.error();
    for (std::size_t i = 0; i < places.size(); i += kBatch) {
      const auto batch = places.subspan(i, std::min(kBatch, places.size() - i));
      BlockyMesh mesh;
      Status done = mesh_batch(batch, *origin, cache, triangles, mesh);
      if (!done) return done.error();
      if (auto spool = spooled->append(mesh, options_.folder); !spool) return of_folder(spool.error());
      stats.faces_visible += mesh.faces_visible;
      stats.quads += mesh.quads;
      stats.triangles += mesh.triangle_count();
      stats.vertices += mesh.vertex_count();
      if (progress_ && !progress_(static_cast<double>(i) / static_cast<double>(places.size()))) {
        return cancelled().error();
      }
    }
    if (!cache.status()) return cache.status().error();
    stats.faces_total += 6 * cache.voxels();
    count(cache);
    if (auto done = spooled->finish(); !done) return of_folder(done.error());
    MeshPart part{{}, spooled->views(), DVec3(-*origin * kChunkEdge), spooled};
    CachedReader reader(cache, *origin, threads_);
    part.thickness = glass_thickness(reader, part.surfaces);
    return part;
  }

  /// Returns the chunk that vertices are relative to: floats are exact near it.
  static Result<IVec3> origin_of(std::span<const IVec3> places) {
    constexpr int kMostChunks = (1 << 24) / kChunkEdge;
    constexpr int kNearChunks = kNearVoxels / kChunkEdge;
    if (places.empty()) return IVec3(0);
    IVec3 min = places.front();
    IVec3 max = min;
    for (const IVec3 place : places) {
      min = glm::min(min, place);
      max = glm::max(max, place);
    }
    const IVec3 far = glm::max(glm::abs(min), glm::abs(max + 1));
    if (std::max({far.x, far.y, far.z}) <= kNearChunks) return IVec3(0);
    const IVec3 size = max + 1 - min;
    if (std::max({size.x, size.y, size.z}) <= kMostChunks) return min;
    return make_error(ErrorCode::Unsupported, "chunks are too far apart to mesh in one grid");
  }

  Status mesh_batch(std::span<const IVec3> batch, IVec3 origin, ChunkCache& cache, ChunkTriangles& triangles,
                    BlockyMesh& mesh) const {
    const auto window = window_around(batch, cache, threads_);
    if (!window) return window.error();
    if (cache.has_densities()) return densities();
    std::vector<QuadBuffer> quads(batch.size());
    const std::size_t tasks = std::min<std::size_t>(batch.size(), thread_count(threads_));
    parallel_for(tasks, threads_, [&](std::size_t task) {
      BlockyMesher mesher;
      QuadOptions options;
      options.merge = options_.scene.mesh.merge;
      options.bake_occlusion = options_.scene.mesh.bake_occlusion;
      for (std::size_t i = task; i < batch.size(); i += tasks) {
        mesher.mesh(window->neighbourhood(batch[i]), loaded_.loaded.scene.types, options, quads[i]);
      }
    });
    for (std::size_t i = 0; i < batch.size(); ++i) {
      if (auto done = triangles.append(quads[i], batch[i] - origin, mesh); !done) return done;
    }
    return {};
  }

  const WorldStore& world_;
  const LoadedWorld& loaded_;
  const WorldMeshOptions& options_;
  Threads threads_;
  const Progress& progress_;
  std::set<GridHandle> meshed_;
  WorldMeshes made_;
};

}  // namespace

Result<WorldMeshes> mesh_world(const WorldStore& world, const LoadedWorld& loaded, const WorldMeshOptions& options,
                               Threads threads, const Progress& progress) {
  QUOIN_ASSERT(!options.scene.atlas && !options.scene.cut && !options.scene.mesh.cut, "as the header says");
  return with_path(WorldMesher(world, loaded, options, threads, progress).run(), world.path());
}

Result<FaceCounts> count_world_faces(const WorldStore& world, const LoadedWorld& loaded, InstanceFilter filter,
                                     Threads threads, const Progress& progress) {
  const Scene& scene = loaded.loaded.scene;
  std::set<GridHandle> drawn;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (is_drawn(scene, instance, filter)) drawn.insert(instance.grid);
  }
  FaceCounts counts;
  std::size_t done = 0;
  for (const GridHandle grid : drawn) {
    const auto number = loaded.saver.number_of(grid);
    QUOIN_ASSERT(number.has_value(), "a loaded grid has a number");
    ChunkCache cache(world, *number, WorldMeshOptions().cache_bytes);
    const auto share = [&](std::size_t i) { return static_cast<double>(i) / static_cast<double>(drawn.size()); };
    const auto more = count_grid_faces(cache, scene.types, threads, part_of(progress, share(done), share(done + 1)));
    if (!more) return with_path(Result<FaceCounts>(more.error()), world.path());
    counts += *more;
    ++done;
  }
  return counts;
}

}  // namespace quoin
