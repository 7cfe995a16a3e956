#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <system_error>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include <glm/common.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/grid/chunk.h>
#include <quoin/mesh/blocky.h>
#include <quoin/scene/scene_meshes.h>
#include <quoin/store/world_meshes.h>
#include <quoin/store/world_store.h>

#include "core/bytes/files.h"
#include "core/caches.h"
#include "core/coordinates/chunk_order.h"
#include "core/work/workers.h"
#include "store/world/world_changes.h"

namespace quoin::store {
namespace {

/// Values written once, in order, and then read: in an unnamed temporary file, which is deleted with the object.
class Spool {
 public:
  Spool() = default;
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;
  ~Spool();

  /// Errors: CannotWrite (a full disk, a missing folder).
  [[nodiscard]] Status append(std::span<const std::byte> bytes, const std::filesystem::path& folder);
  template <class T>
  [[nodiscard]] Status append(const std::vector<T>& values, const std::filesystem::path& folder) {
    return append(std::as_bytes(std::span(values)), folder);
  }
  /// Ends writing; values can then be read. Errors: as `append`.
  [[nodiscard]] Status finish();

  /// Returns all values. Lifetime: as the spool. Requires: finished, and written as values of that type.
  template <class T>
  [[nodiscard]] std::span<const T> values() const {
    QUOIN_ASSERT(buffer_.empty() && (mapped_ != nullptr || written_ == 0), "a finished spool");
    QUOIN_ASSERT(written_ % sizeof(T) == 0, "whole values of this type");
    return {static_cast<const T*>(mapped_), static_cast<std::size_t>(written_) / sizeof(T)};
  }
  [[nodiscard]] std::uint64_t bytes() const { return written_ + buffer_.size(); }
  /// Releases the pages read from this process's memory; later accesses read them from the file again.
  void give_back() const;

 private:
  [[nodiscard]] Status write_buffer();

  int file_ = -1;
  std::vector<std::byte> buffer_;
  std::uint64_t written_ = 0;
  void* mapped_ = nullptr;
};

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

Status failed(int number) {
  return make_error(ErrorCode::CannotWrite,
                    "cannot write a temporary file: " + std::generic_category().message(number));
}

// Opens a file without a name, or removes its name at once.
int open_nameless(const std::filesystem::path& folder) {
  const std::string where = folder.empty() ? "." : folder.string();
  const int file = ::open(where.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL)) return file;
  std::string name = where + "/.quoin-spool-XXXXXX";
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

Spool::~Spool() {
  if (mapped_ != nullptr) ::munmap(mapped_, written_);
  if (file_ >= 0) ::close(file_);
}

Status Spool::append(std::span<const std::byte> bytes, const std::filesystem::path& folder) {
  QUOIN_ASSERT(mapped_ == nullptr, "not finished");
  if (file_ < 0) {
    file_ = open_nameless(folder);
    if (file_ < 0) return failed(errno);
  }
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  return buffer_.size() < kBufferBytes ? Status() : write_buffer();
}

Status Spool::write_buffer() {
  for (std::size_t done = 0; done < buffer_.size();) {
    const ssize_t count = ::write(file_, buffer_.data() + done, buffer_.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return failed(count < 0 ? errno : ENOSPC);
    done += static_cast<std::size_t>(count);
  }
  written_ += buffer_.size();
  buffer_.clear();
  return {};
}

Status Spool::finish() {
  if (file_ < 0) return {};
  if (auto done = write_buffer(); !done) return done;
  buffer_ = {};
  if (written_ == 0) return {};
  void* const mapped = ::mmap(nullptr, written_, PROT_READ, MAP_SHARED, file_, 0);
  if (mapped == MAP_FAILED) return failed(errno);
  mapped_ = mapped;
  ::close(std::exchange(file_, -1));
  return {};
}

void Spool::give_back() const {
  if (mapped_ != nullptr) ::madvise(mapped_, written_, MADV_DONTNEED);
}

/// The chunks of a world's grid, level 0; the most recently used ones are in memory.
class ChunkCache {
 public:
  /// `bytes`: limit of the kept voxels. `world` must outlive it. Errors of reading keys: see `status`.
  ChunkCache(const WorldStore& world, std::uint32_t grid, std::size_t bytes);
  /// Returns the errors of reading the world itself.
  [[nodiscard]] const Status& status() const { return status_; }

  /// Returns the coordinates of all chunks, sorted by z, then y, then x.
  [[nodiscard]] std::span<const IVec3> places() const { return places_; }
  /// Reads the missing chunks on several threads; skips addresses without a chunk.
  void load(std::span<const IVec3> places, Threads threads);
  /// Returns null if the chunk does not exist or is not loaded. Lifetime: until the next `trim`.
  [[nodiscard]] const Chunk* find(IVec3 place) const;
  /// Drops chunks that are not part of the last load and exceed the limit.
  void trim();

  /// Totals over all chunks read, each counted once: non-air voxels, voxels with data.
  [[nodiscard]] std::int64_t voxels() const { return voxels_; }
  [[nodiscard]] std::int64_t data() const { return data_; }
  [[nodiscard]] bool has_densities() const { return has_densities_; }
  /// Returns a line for each damaged chunk; these count as air.
  [[nodiscard]] const std::vector<std::string>& damage() const { return damage_; }

 private:
  struct Entry {
    Chunk chunk{kAir};
    std::uint64_t last_use = 0;
  };

  const WorldStore& world_;
  std::uint32_t grid_;
  std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  std::uint64_t now_ = 0;
  Status status_;
  std::vector<IVec3> places_;
  std::unordered_map<IVec3, Entry, CoordinateHash> loaded_;
  std::unordered_set<IVec3, CoordinateHash> counted_;
  std::int64_t voxels_ = 0;
  std::int64_t data_ = 0;
  bool has_densities_ = false;
  std::vector<std::string> damage_;
};

ChunkCache::ChunkCache(const WorldStore& world, std::uint32_t grid, std::size_t bytes)
    : world_(world), grid_(grid), max_bytes_(bytes) {
  auto places = world.chunks(grid, 0);
  if (!places) {
    status_ = places.error();
    return;
  }
  places_ = std::move(*places);
}

void ChunkCache::load(std::span<const IVec3> places, Threads threads) {
  ++now_;
  std::vector<IVec3> missing;
  const auto before = [](IVec3 a, IVec3 b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); };
  for (const IVec3 place : places) {
    const auto found = loaded_.find(place);
    if (found != loaded_.end()) {
      found->second.last_use = now_;
    } else if (std::ranges::binary_search(places_, place, before)) {
      missing.push_back(place);
    }
  }
  std::vector<std::optional<Result<std::optional<StoredChunk>>>> read(missing.size());
  parallel_for(missing.size(), threads, [&](std::size_t i) { read[i] = world_.load_chunk({grid_, 0, missing[i]}); });
  for (std::size_t i = 0; i < missing.size(); ++i) {
    Result<std::optional<StoredChunk>>& outcome = *read[i];
    const bool is_new = counted_.insert(missing[i]).second;
    Entry entry;
    entry.last_use = now_;
    if (!outcome) {
      if (outcome.error().code != ErrorCode::BadFormat && status_) status_ = outcome.error();
      if (is_new) damage_.push_back(outcome.error().message);
    } else if (*outcome) {
      entry.chunk = std::move((*outcome)->voxels);
      if (is_new) {
        voxels_ += entry.chunk.non_air_count();
        data_ += static_cast<std::int64_t>(entry.chunk.data_count());
      }
      has_densities_ = has_densities_ || (*outcome)->densities.has_value();
    }
    bytes_ += entry.chunk.bytes();
    loaded_.insert_or_assign(missing[i], std::move(entry));
  }
}

const Chunk* ChunkCache::find(IVec3 place) const {
  const auto found = loaded_.find(place);
  return found == loaded_.end() ? nullptr : &found->second.chunk;
}

void ChunkCache::trim() {
  if (bytes_ <= max_bytes_) return;
  // Drops more than necessary, so that the cache is not searched for each chunk.
  bytes_ = drop_oldest(
      loaded_, bytes_, max_bytes_ / 8 * 7, [&](auto each) { return each->second.last_use != now_; },
      [](auto each) { return each->second.chunk.bytes(); }, [&](auto each) { loaded_.erase(each); });
}

}  // namespace
}  // namespace quoin::store

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
      if (auto done = append_looks(from, to, folder); !done) return done;
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
  Status finish(const std::filesystem::path& folder) {
    for (Surface& surface : surfaces_) {
      if (surface.looked > 0) {
        if (auto done = skip_looks(surface, folder); !done) return done;
      }
      for (Spool* const spool : surface.all()) {
        if (auto done = spool->finish(); !done) return done;
      }
    }
    const auto give_back = [this](Workers::Lock& /*lock*/, unsigned /*worker*/) {
      for (Surface& surface : surfaces_) {
        for (const Spool* const spool : surface.all()) spool->give_back();
      }
      return Workers::Clock::now() + kGiveBack;
    };
    giver_.start(1, give_back, {.name = "give back", .has_own_threads = true});
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
      view.looks = surface.looks.values<VertexLook>();
      view.faces = surface.faces;
    }
    return views;
  }

 private:
  struct Surface {
    std::uint64_t vertices = 0;
    std::uint64_t looked = 0;  // vertices in `looks`; 0 if none has a look of its own
    Spool positions, directions, occlusion, types, indices, looks;
    std::vector<VoxelFace> faces;
    std::array<Spool*, 6> all() { return {&positions, &directions, &occlusion, &types, &indices, &looks}; }
  };

  // Appends looks of vertices without any, so that all vertices have one.
  static Status skip_looks(Surface& to, const std::filesystem::path& folder) {
    const std::vector<VertexLook> none(to.vertices - to.looked);
    to.looked = to.vertices;
    return to.looks.append(none, folder);
  }

  // Appends the looks of new vertices, if any has one.
  static Status append_looks(const BlockyTriangles& from, Surface& to, const std::filesystem::path& folder) {
    if (from.looks.empty()) return {};
    if (auto done = skip_looks(to, folder); !done) return done;
    std::vector<std::uint32_t> numbers = {0};  // by VertexLook::face
    for (const VoxelFace& face : from.faces) {
      auto known = std::find(to.faces.begin(), to.faces.end(), face);
      if (known == to.faces.end()) known = to.faces.insert(known, face);
      numbers.push_back(static_cast<std::uint32_t>(known - to.faces.begin()) + 1);
    }
    std::vector<VertexLook> looks = from.looks;
    for (VertexLook& look : looks) look.face = numbers[look.face];
    to.looked += looks.size();
    return to.looks.append(looks, folder);
  }

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
    const std::span<const IVec3> places = cache.places();
    const auto origin = origin_of(places);
    if (!origin) return origin.error();
    for (std::size_t i = 0; i < places.size(); i += kBatch) {
      const auto batch = places.subspan(i, std::min(kBatch, places.size() - i));
      BlockyMesh mesh;
      Status done = mesh_batch(batch, *origin, cache, mesh);
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
    if (auto done = spooled->finish(options_.folder); !done) return of_folder(done.error());
    MeshPart part{{}, spooled->views(), DVec3(-*origin * kChunkEdge), spooled};
    CachedReader reader(cache, *origin, threads_);
    part.thickness = glass_thickness([&](IVec3 voxel) { return reader.get(voxel); }, part.surfaces);
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

  Status mesh_batch(std::span<const IVec3> batch, IVec3 origin, ChunkCache& cache, BlockyMesh& mesh) const {
    const auto window = window_around(batch, cache, threads_);
    if (!window) return window.error();
    if (cache.has_densities()) return densities();
    const VoxelRegistry& types = loaded_.loaded.scene.types;
    std::vector<QuadBuffer> quads(batch.size());
    std::vector<ShapeFaceBuffer> shapes(types.has_shapes() ? batch.size() : 0);
    const std::size_t tasks = std::min<std::size_t>(batch.size(), thread_count(threads_));
    parallel_for(tasks, threads_, [&](std::size_t task) {
      BlockyMesher mesher;
      QuadOptions options;
      options.merge = options_.scene.mesh.merge;
      options.bake_occlusion = options_.scene.mesh.bake_occlusion;
      for (std::size_t i = task; i < batch.size(); i += tasks) {
        const Neighbourhood near = window->neighbourhood(batch[i]);
        if (shapes.empty()) {
          mesher.mesh(near, types, options, quads[i]);
        } else {
          mesher.mesh(near, types, options, quads[i], shapes[i]);
        }
      }
    });
    std::vector<IVec3> from_origin;
    for (const IVec3 chunk : batch) from_origin.push_back(chunk - origin);
    return append_triangles(quads, from_origin, types, options_.scene.mesh.watertight, mesh, shapes);
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
  return with_world(WorldMesher(world, loaded, options, threads, progress).run(), world.path());
}

Result<FaceCounts> count_world_faces(const WorldStore& world, const LoadedWorld& loaded, InstanceFilter filter,
                                     Threads threads, const Progress& progress) {
  const Scene& scene = loaded.loaded.scene;
  const std::vector<GridHandle> drawn = drawn_grids(scene, filter);
  FaceCounts counts;
  std::size_t done = 0;
  for (const GridHandle grid : drawn) {
    const auto number = loaded.saver.number_of(grid);
    QUOIN_ASSERT(number.has_value(), "a loaded grid has a number");
    ChunkCache cache(world, *number, WorldMeshOptions().cache_bytes);
    const auto share = [&](std::size_t i) { return static_cast<double>(i) / static_cast<double>(drawn.size()); };
    const auto more = count_grid_faces(cache, scene.types, threads, part_of(progress, share(done), share(done + 1)));
    if (!more) return with_world(Result<FaceCounts>(more.error()), world.path());
    counts += *more;
    ++done;
  }
  return counts;
}

}  // namespace quoin
