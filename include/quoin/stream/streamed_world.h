#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/scene.h>
#include <quoin/store/world_saver.h>
#include <quoin/store/world_store.h>
#include <quoin/stream/world_edit.h>

namespace [[gnu::visibility("default")]] quoin {

/// Generates the chunks that a world does not hold yet: a landscape, or another program's world.
///
/// Threads: `make` is called from several threads at once.
class ChunkGenerator {
 public:
  ChunkGenerator() = default;
  ChunkGenerator(const ChunkGenerator&) = delete;
  ChunkGenerator& operator=(const ChunkGenerator&) = delete;
  virtual ~ChunkGenerator() = default;

  /// Returns the box of chunks (half open) that `make` can fill. Everything outside is air, unless it was edited. This
  /// air counts as loaded everywhere and takes no memory and no time, so keep the box small. The box must not change.
  [[nodiscard]] virtual IBox chunks() const = 0;
  /// Makes one chunk: voxels, densities or both. Its content must pass `validate_chunk` with the types that the scene
  /// had in the last `use_generator`, `add_grid` or `update`, and with the band of the grid's field.
  /// Errors:    any, also as an exception. The chunk is then air, and is not saved, until the world is opened again.
  ///            StreamedWorld::take_problems reports the error. The same holds for content that is not valid. After
  ///            bad_alloc the call is repeated.
  /// Cancelled: `cancelled` is requested when no viewer and no edit needs the chunk any more, and when the world
  ///            closes. Return ErrorCode::Cancelled then. This is no error: the call is repeated if the chunk is needed
  ///            again. A complete chunk is used as always. The world closes after all calls have returned.
  /// Duration:  a call occupies one worker; the others continue. See StreamOptions::generator_timeout.
  [[nodiscard]] virtual Result<StoredChunk> make(IVec3 chunk, const Cancellation& cancelled) const = 0;
};

/// An endless landscape. The worlds of `generate_terrain` and `generate_smooth_terrain` are pieces of it.
struct EndlessTerrain {
  std::uint64_t seed = 42;
  int height = 4;          ///< in chunks of 64 voxels, upwards from y = 0: 1 to 16
  bool is_smooth = false;  ///< makes a density field instead of voxels

  bool operator==(const EndlessTerrain&) const = default;
};

/// Returns the generator of an endless landscape and adds the landscape's types (`add_terrain_types`) to `types`. Each
/// chunk equals the chunk of any `generate_terrain` piece with the same height and seed, except within a chunk of the
/// piece's sides. The landscape extends 2^24 voxels from the origin.
/// Errors: InvalidArgument for a height out of range; LimitExceeded if the registry is full.
[[nodiscard]] Result<std::shared_ptr<const ChunkGenerator>> make_terrain_generator(const EndlessTerrain& terrain,
                                                                                   VoxelRegistry& types);

/// A position around which a world is kept in memory. A viewer whose position is not finite, or whose radius is not
/// positive, is ignored.
struct Viewer {
  DVec3 position{0.0};    ///< in world space
  DVec3 direction{0.0};   ///< view direction: chunks there load first; 0 or not finite: no preference
  double radius = 512.0;  ///< world units within which all chunks are to be loaded
};

struct StreamOptions {
  /// Memory budget for loaded chunks and the data derived from them (`other_bytes`). If it is too small, less than the
  /// viewers' radius is loaded. `return_freed_memory` keeps the process's resident memory within it. Whole grids do not
  /// count.
  std::size_t budget_bytes = std::size_t{1} << 30;
  /// Maximum memory for the file's whole grids: estimated from a sample of their chunks, then counted while they load.
  /// Opening a world fails with LimitExceeded and the name of a grid if they need more, or more than the available
  /// memory.
  std::size_t max_whole_bytes = std::numeric_limits<std::size_t>::max();
  /// Returns the bytes held elsewhere for loaded chunks: meshes, trees, light, GPU memory. No other derived data counts
  /// in the budget. `update`, `plan` and `load_all` call it on their thread, at most ten times per second; it must not
  /// edit the scene. May be empty.
  std::function<std::size_t()> other_bytes{};
  /// Maximum time in which one `update` call adds and unloads chunks, in seconds; at least one chunk per call. If few
  /// chunks wait, `update` spreads them over several calls. Half of this time is also the maximum in which a call of
  /// `update` or `plan` copies edited chunks for a save, at least 16 per call: a save of many chunks takes several
  /// calls.
  double update_seconds = 0.0005;
  /// Minimum time between two saves in `update`; 0: saves in every call.
  std::chrono::milliseconds save_interval{1000};
  /// Saves generated chunks, so that each is generated once. If false, a chunk is generated at each load until it is
  /// edited.
  bool keep_generated = true;
  /// Duration of a call of ChunkGenerator::make after which `take_problems` reports the call, while it still runs, and
  /// `flush` no longer waits for it.
  std::chrono::milliseconds generator_timeout{10'000};
  Threads workers{};
};

struct StreamStats {
  std::size_t loaded_chunks = 0;   ///< in memory, including air within the generators' boxes
  std::size_t loaded_bytes = 0;    ///< voxels and densities of the loaded chunks
  std::size_t other_bytes = 0;     ///< last value from StreamOptions::other_bytes
  std::size_t wanted_chunks = 0;   ///< within the viewers' radius and the budget
  std::size_t missing_chunks = 0;  ///< wanted chunks that are not loaded yet
  bool is_complete = false;        ///< all chunks wanted in the last `update` or `plan` are loaded
  std::size_t waiting_edits = 0;   ///< chunks with waiting edits
  /// Radius in world units within which every viewer has all chunks loaded. Meshes may end up to one chunk (64
  /// voxels) earlier.
  double complete_radius = 0.0;
  std::uint64_t chunks_read = 0;  ///< from the world's file, since it was opened
  std::uint64_t chunks_made = 0;  ///< by generators, since the world was opened
  std::uint64_t chunks_unloaded = 0;
  std::uint64_t chunks_dropped = 0;     ///< completed loads that were no longer wanted
  bool has_save_failed = false;         ///< the last save failed: its data is in memory until a later save succeeds
  double longest_update_seconds = 0.0;  ///< since the last call of `stats`
};

/// World-space bounds of everything that a world can contain, loaded or not. Instances place the grids.
struct WorldExtent {
  DBox stored;                    ///< bounds of the stored chunks and of whole grids; empty if there are none
  DBox generated;                 ///< bounds of the chunks that generators can make; empty without generators
  std::size_t stored_chunks = 0;  ///< of level 0, of all streamed grids
};

/// A world that keeps only the surroundings of its viewers in memory. Edits are saved and restored.
///
///   auto world = quoin::StreamedWorld::open_or_create("home.quoin");
///   if (world->is_new()) {
///     if (const auto land = world->add_terrain({.seed = 7}); !land) complain(land.error());
///   }
///   while (play(world->scene())) {             // edits its grids like any scene's
///     const quoin::Viewer eye{.position = player, .direction = view_direction};
///     if (const auto saved = world->update({&eye, 1}); !saved) complain(saved.error());
///     meshes.update(world->scene(), player);   // then update everything else that depends on the scene
///   }
///   if (const auto saved = world->flush(); !saved) complain(saved.error());
///
/// Grids:    streamed or whole. The file stores which, so a grid is the same when the world is opened again.
///           Streamed grids come from `add_grid`. They are partial (Grid::make_partial): their chunks load from near to
///           far and unload at a distance. Direct edits change loaded chunks; `apply` also changes unloaded ones.
///           Chunks that no generator makes (ChunkGenerator::chunks) and that the file does not hold are known air:
///           they count as loaded, and edits of them are saved like others.
///           Whole grids are those that the program adds to the scene itself (Scene::add_grid), and grids that the file
///           stores with SceneGrid::whole. They are fully in memory from the start; `open` loads them.
///           All other grids of a file are streamed: those of files that earlier versions wrote, and those that
///           write_world and WorldSaver stored without SceneGrid::whole.
/// Saving:   grids, instances and groups are saved unless they are marked as not saved (`is_saved`). Each save has the
///           state of one moment, as one commit, however many calls of `update` collect it. Chunks with edits that no
///           save has yet are not unloaded.
/// Order:    loaded, saved and generated chunks depend on the edits and viewer positions, never on threads or timing.
/// Memory:   chunks, including pending loads, are counted before they are read. Far chunks are unloaded first.
/// Safety:   as WorldStore; `flush` returns when everything is on disk. A read-only world keeps edits in memory.
/// Threads:  calls must not overlap, but may come from different threads. Only functions documented to do so wait for
///           workers.
/// Lifetime: the scene keeps its address, even when the world is moved.
class StreamedWorld {
 public:
  /// Opens a world and loads its whole grids, but no chunks of streamed ones. With WorldAccess::Read, nothing is saved.
  /// Damaged chunks of whole grids are left out with a warning in `opened`, and stay in the file.
  /// Cost:   O(chunks of whole grids + stored chunks): the others are listed but not read.
  /// Errors: as WorldStore::open and load_partial_world.
  [[nodiscard]] static Result<StreamedWorld> open(const std::filesystem::path& path, WorldAccess access,
                                                  const StreamOptions& options = {});
  /// Opens a world for writing, or creates it if the file does not exist.
  [[nodiscard]] static Result<StreamedWorld> open_or_create(const std::filesystem::path& path,
                                                            const StreamOptions& options = {});
  StreamedWorld(StreamedWorld&&) noexcept;
  StreamedWorld& operator=(StreamedWorld&&) noexcept;
  /// Calls `flush`, cancels the calls of generators and waits for their return. Edits that `flush` could not apply are
  /// lost: call `flush` first to see errors.
  ~StreamedWorld();

  [[nodiscard]] Scene& scene();
  [[nodiscard]] const Scene& scene() const;
  /// Returns true if `open_or_create` created the world.
  [[nodiscard]] bool is_new() const;
  /// Returns the warnings, sun and cameras read when the world was opened, as `load_world` does. For the scene, call
  /// `scene()`.
  [[nodiscard]] const LoadedScene& opened() const;
  /// Sets the cameras that the next save stores in the file, as WorldSaver::set_view.
  void set_view(WorldView view);
  /// Returns the extent of the file's chunks and of the generators. Cost: O(stored chunks + instances). Errors:
  /// CannotRead.
  [[nodiscard]] Result<WorldExtent> extent() const;

  /// Adds an empty grid whose chunks are loaded, or made by the generator, around viewers. It is visible only where an
  /// instance places it. Requires: `grid` has no voxels and no densities. Errors: CannotWrite; InvalidArgument if it is
  /// marked as not saved or as whole; as WorldSaver::save.
  Result<GridHandle> add_grid(SceneGrid grid, std::shared_ptr<const ChunkGenerator> generator = nullptr);
  /// Sets the generator for a grid's chunks that are not in the file. Call it before the first `update`, `plan`,
  /// `load_all` or `flush`. From the first `update`, `load_all` or `flush` on, a grid from the file without a generator
  /// has only its stored chunks; all other chunks count as loaded air and can be edited. A generator that is set later
  /// replaces the former one. It does not change chunks that are in memory or in the file. Returns when no worker calls
  /// or holds the former generator of this grid any more, so that a plug-in can be unloaded.
  /// Cost: O(stored and loaded chunks), and waits for calls of the former `make`. If it throws bad_alloc, nothing has
  /// changed. `take_problems` reports errors.
  /// Requires: the scene has the grid. Whole grids have no generator: the call does nothing, and `take_problems`
  /// reports it.
  void use_generator(GridHandle grid, std::shared_ptr<const ChunkGenerator> generator);
  /// Adds a grid of generated landscape, placed at the origin. The file stores its parameters, so that it continues
  /// when the world is opened again.
  /// Errors: as make_terrain_generator and WorldSaver::save.
  Result<GridHandle> add_terrain(const EndlessTerrain& terrain);

  /// Adds the chunks that workers have loaded or generated, unloads far chunks and requests new ones. Call it once per
  /// frame.
  /// Cost:   StreamOptions::update_seconds for moving chunks and for saving; plus O(chunks edited since the last call),
  ///         and WorldSaver::begin when a save is due. New voxel types are saved at once, with all edits.
  ///         Calls StreamOptions::other_bytes, and waits for it.
  /// Errors: as WorldSaver::save and WorldStore::wait (disk full, ...), once per failed save. Everything else is done
  ///         all the same. Unsaved edits stay in memory, and the next save retries (StreamStats::has_save_failed).
  ///         bad_alloc.
  Status update(std::span<const Viewer> viewers);
  /// Does the part of `update` that only reads the scene: finds edits, saves if a save is due, requests chunks. Another
  /// thread can draw the scene during the call. A game with a render thread calls `plan` each frame, and stops drawing
  /// for `update` only if `has_chunks_to_move`.
  /// Errors: as `update`.
  Status plan(std::span<const Viewer> viewers);
  /// Returns true if the next `update` changes the scene: it has chunks to add or unload, as of the last `plan`, or it
  /// is the first one and limits grids that have no generator to their stored chunks (see `use_generator`).
  [[nodiscard]] bool has_chunks_to_move() const;
  /// Calls `update` until all chunks that these viewers want are loaded, however long their generators take. For tools
  /// and tests. Errors: as `update`.
  Status load_all(std::span<const Viewer> viewers);

  /// Returns true if the content of a grid's chunk is known: it is in memory, or air that is neither generated nor
  /// stored.
  [[nodiscard]] bool is_loaded(GridHandle grid, IVec3 chunk) const;
  /// Applies an edit: to loaded chunks at once, and to unloaded chunks after loading them for the edit. The result is
  /// saved. Edits of one chunk are applied in call order. Per-voxel data on air, or with more state bits than the
  /// voxel's type, is ignored without an error.
  /// Errors: InvalidArgument, without any change, if the grid does not exist or is not streamed (see `number_of`), or
  ///         if a type is not registered; errors of chunks_of_edit.
  Status apply(const WorldEdit& edit);
  /// Returns the number that identifies a grid in edits (WorldEdit::grid) and in the store (ChunkAddress::grid);
  /// nullopt for grids that are not streamed. Cost: O(log grids).
  [[nodiscard]] std::optional<std::uint32_t> number_of(GridHandle grid) const;

  /// Saves all edits, including edits that wait for chunks, and returns when they are on disk. With a job system, it
  /// calls generators on this thread only if no worker takes such a chunk for a second.
  /// Errors: CannotWrite; unsaved data stays in memory. CannotRead if edits wait for a damaged chunk, or for a
  ///         generator that has not returned for StreamOptions::generator_timeout; the rest is saved, and these edits
  ///         still wait.
  Status flush();
  /// Returns the errors of single chunks since the last call, at most 1,000: damaged chunks (which stay unloaded),
  /// chunks that could not be generated (which are air), and calls of generators that run for longer than
  /// StreamOptions::generator_timeout (each once). Also reports generators that a grid cannot use, and grids whose
  /// stored chunks cannot be listed: their chunks are looked up one by one, and none counts as air without that.
  [[nodiscard]] std::vector<std::string> take_problems();
  [[nodiscard]] StreamStats stats();
  /// Returns the store, for game values and other data that WorldStore::save accepts. Save chunks of streamed
  /// grids by edits, not through the store.
  [[nodiscard]] WorldStore& store();

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  explicit StreamedWorld(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
