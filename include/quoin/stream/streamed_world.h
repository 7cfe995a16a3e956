#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/scene/scene.h>
#include <quoin/store/world_saver.h>
#include <quoin/store/world_store.h>
#include <quoin/stream/chunk_generator.h>
#include <quoin/stream/world_edit.h>

namespace quoin {

/// Around whom a world is to be in memory.
struct Viewer {
  DVec3 position{0.0};    ///< in the world
  DVec3 direction{0.0};   ///< where it looks: what lies there comes first; 0 or not finite: nowhere in particular
  double radius = 512.0;  ///< world units within which all is to be loaded
};

struct StreamOptions {
  /// For what is loaded and what is made of it (`other_bytes`) together: where it does not suffice, less than the
  /// viewers' radius is loaded. What the process has resident keeps to it by `return_freed_memory`.
  std::size_t budget_bytes = std::size_t{1} << 30;
  /// Bytes that are kept elsewhere because of what is loaded: meshes, trees, light, device memory. Asked for by
  /// `update`, ten times a second. May be empty.
  std::function<std::size_t()> other_bytes{};
  /// What one `update` may take of its caller's time, in seconds; one chunk comes or goes at least.
  double update_seconds = 0.0001;
  /// How often `update` saves what was edited; 0: each time.
  std::chrono::milliseconds save_interval{1000};
  /// Whether made chunks are saved, so that a generator is asked once for each; without, once each time that it is
  /// loaded, until it is edited.
  bool keep_generated = true;
  Threads workers{};  ///< unlike elsewhere 0 means one less than the machine has, at least 1
};

struct StreamStats {
  std::size_t loaded_chunks = 0;   ///< in memory, air too
  std::size_t loaded_bytes = 0;    ///< of their voxels and densities
  std::size_t other_bytes = 0;     ///< as StreamOptions::other_bytes said last
  std::size_t wanted_chunks = 0;   ///< within the viewers' radius and the budget
  std::size_t missing_chunks = 0;  ///< of these, that are not loaded yet
  bool is_complete = false;        ///< all that was wanted in the last `update` or `plan` is in place
  std::size_t waiting_edits = 0;   ///< chunks that edits wait for
  /// World units: so far around every viewer all is loaded. Meshes are there up to a chunk (64 voxels) less.
  double complete_radius = 0.0;
  std::uint64_t chunks_read = 0;  ///< since it was opened: from the world's file
  std::uint64_t chunks_made = 0;  ///< likewise: by generators
  std::uint64_t chunks_unloaded = 0;
  std::uint64_t chunks_dropped = 0;     ///< that came when nobody wanted them any more
  double longest_update_seconds = 0.0;  ///< since `stats` was called last
};

/// What a world may reach to, loaded or not. In the world's space, as its instances place it.
struct WorldExtent {
  DBox stored;                    ///< of the chunks in its file; empty: none
  DBox generated;                 ///< of what generators may make; empty: there are none
  std::size_t stored_chunks = 0;  ///< of the finest level, of all grids
};

/// A world of which only what lies around viewers is in memory; what is edited is saved, and comes back.
///
///   auto world = quoin::StreamedWorld::open_or_create("home.quoin");
///   if (world->is_new()) {
///     if (const auto land = world->add_terrain({.seed = 7}); !land) complain(land.error());
///   }
///   while (play(world->scene())) {             // edits its grids like any scene's
///     const quoin::Viewer eye{.position = player, .direction = looks};
///     if (const auto saved = world->update({&eye, 1}); !saved) complain(saved.error());
///     meshes.update(world->scene(), player);   // and all else that follows scenes
///   }
///   if (const auto saved = world->flush(); !saved) complain(saved.error());
///
/// Grids:   those that the world held when it was opened, and those of `add_grid`, are partial (Grid::make_partial):
///          chunks come near to far and go when they are far; edits change what is loaded, `apply` also what is not.
///          Grids that the program adds to the scene itself are whole, and saved.
/// Order:   what is loaded, saved and made depends on the edits and where viewers were, never on threads or time.
/// Memory:  chunks, and what is on its way, are counted before they are read. Far ones go first.
/// Safety:  as WorldStore: `flush` returns when all is on disk. A world that may not be written keeps what was edited
///          in memory.
/// Threads: all calls come from one thread, or one after the other. Nothing waits for workers but what says so.
/// Lifetime: the scene stays where it is, also when the world is moved.
class StreamedWorld {
 public:
  /// Opens a world; of its chunks nothing is read yet. With WorldAccess::Read nothing is saved.
  /// Errors: as WorldStore::open and load_partial_world.
  [[nodiscard]] static Result<StreamedWorld> open(const std::filesystem::path& path, WorldAccess access,
                                                  const StreamOptions& options = {});
  /// Opens a world for writing; makes it where there is none.
  [[nodiscard]] static Result<StreamedWorld> open_or_create(const std::filesystem::path& path,
                                                            const StreamOptions& options = {});
  StreamedWorld(StreamedWorld&&) noexcept;
  StreamedWorld& operator=(StreamedWorld&&) noexcept;
  /// Ends the workers and saves what was edited (`flush` says whether that went well).
  ~StreamedWorld();

  [[nodiscard]] Scene& scene();
  [[nodiscard]] const Scene& scene() const;
  /// Whether the world was made by `open_or_create`.
  [[nodiscard]] bool is_new() const;
  /// What could not be read of it when it was opened, sun and cameras, as `load_world` tells them; the scene is
  /// `scene()`.
  [[nodiscard]] const LoadedScene& opened() const;
  void set_view(WorldView view);
  /// What the file and the generators hold now. Cost: O(stored chunks). Errors: CannotRead.
  [[nodiscard]] Result<WorldExtent> extent() const;

  /// Adds an empty grid whose chunks are loaded, or made by the generator, around viewers; it shows once an instance
  /// places it. Requires: neither voxels nor densities. Errors: CannotWrite; as WorldSaver::save.
  Result<GridHandle> add_grid(SceneGrid grid, std::shared_ptr<const ChunkGenerator> generator = nullptr);
  /// Who makes what of a grid is not in the world's file; to be called before the first `update`.
  /// Requires: the world had the grid, or `add_grid` added it.
  void use_generator(GridHandle grid, std::shared_ptr<const ChunkGenerator> generator);
  /// Adds a grid of generated landscape, placed at the origin. Which is written in the world's file, so that it goes on
  /// when that is opened again.
  /// Errors: as make_terrain_generator; of saving.
  Result<GridHandle> add_terrain(const EndlessTerrain& terrain);

  /// Puts in place what workers have read or made, takes away what is too far, and says what is wanted next. Call it
  /// once a frame.
  /// Cost:   StreamOptions::update_seconds, and what an edit costs WorldSaver::save when it is time to save.
  /// Errors: those of saving: nothing is lost, it is tried again. bad_alloc.
  Status update(std::span<const Viewer> viewers);
  /// For who draws the scene on another thread: does all that `update` does but for the scene, which is only read, so
  /// that the caller need not stop drawing for every update. Errors: as update.
  Status plan(std::span<const Viewer> viewers);
  /// Whether the next `update` has chunks to put in place or to take away, as of the last `plan`.
  [[nodiscard]] bool has_chunks_to_move() const;
  /// Calls `update` until all that these viewers want is there: for tools and tests.
  Status load_all(std::span<const Viewer> viewers);

  /// Whether a chunk of a grid is in memory.
  [[nodiscard]] bool is_loaded(GridHandle grid, IVec3 chunk) const;
  /// Edits what is loaded at once, and what is not once it is: chunks are brought into memory for it, and saved.
  /// Edits of one chunk happen in the order in which they were applied.
  /// Data that is set on air, or that has more bits of state than its voxel's type, is left out, without an error.
  /// Errors: InvalidArgument, and nothing is changed: the grid is not there, or is not one that
  ///         the world had or `add_grid` added, or a type is not registered; and as chunks_of_edit.
  Status apply(const WorldEdit& edit);
  /// The number that edits (WorldEdit::grid) and the store (ChunkPlace::grid) name a grid by; nothing for grids that
  /// are not streamed. Cost: O(log grids).
  [[nodiscard]] std::optional<std::uint32_t> number_of(GridHandle grid) const;

  /// Saves what was edited, also by edits that wait for chunks, and returns once it is on disk.
  /// Errors: CannotWrite; what could not be saved is kept in memory. CannotRead where edits wait for a chunk that is
  ///         damaged; the rest is saved.
  Status flush();
  /// What went wrong with single chunks since the last call: that were damaged (which stay not loaded) or could not be
  /// made (which are air).
  [[nodiscard]] std::vector<std::string> take_problems();
  [[nodiscard]] StreamStats stats();
  /// For what a game keeps beside chunks: values, and whatever `save` takes.
  [[nodiscard]] WorldStore& store();

 private:
  struct Impl;
  explicit StreamedWorld(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
