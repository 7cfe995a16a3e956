#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/function_ref.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>
#include <quoin/store/world_store.h>

namespace [[gnu::visibility("default")]] quoin {

struct LoadedWorld;

/// Cameras, as in LoadedScene.
struct WorldView {
  std::optional<Camera> camera;
  std::vector<FileCamera> cameras;
};

/// Saves a scene to a world incrementally: each `save` writes the changes since the previous one, found through the
/// change journals.
///
///   auto world = quoin::WorldStore::open("home.quoin", quoin::WorldAccess::Write);
///   auto loaded = quoin::load_world(*world);
///   quoin::Scene& scene = loaded->loaded.scene;
///   while (play(scene)) {
///     if (!it_is_time()) continue;
///     const auto begun = loaded->saver.save(*world, scene);   // the world writes on its own thread
///     if (!begun) complain(begun.error());
///   }
///   if (const auto begun = loaded->saver.save(*world, scene); !begun) complain(begun.error());
///   if (const auto saved = world->flush(); !saved) complain(saved.error());
///
/// A chunk that becomes empty through edits is stored as air (StoredChunk). Grids, instances, groups and layers keep
/// their numbers in the world. Instances that were edited but have the values of their last save are not written again.
///
/// A game that must not wait in a frame saves in steps. The saved state is that of the call of `begin`, in one commit:
///
///   saver.follow(scene);                                      // each frame: reads the changes
///   if (it_is_time() && !saver.is_begun()) (void)saver.begin(*world, scene);
///   (void)saver.step(*world, 0.0002);                         // each frame
///
/// Marks:    objects that are not to be saved (`is_saved`) are left out: an instance also if its grid is left out, or a
///           group above it. A changed mark removes the object from the world at the next save, or adds it with a new
///           number.
/// Lifetime: holds no reference between calls.
/// Threads:  as the scene.
class WorldSaver {
 public:
  /// Creates a saver for a world that has no scene yet; the first `save` writes everything.
  WorldSaver();
  WorldSaver(WorldSaver&&) noexcept;
  WorldSaver& operator=(WorldSaver&&) noexcept;
  ~WorldSaver();

  /// Saves all changes as one atomic commit, in the background. Chunks are shared with the scene, not copied. `more` is
  /// saved in the same commit: game values or a thumbnail, for example.
  /// Errors:   InvalidArgument, and nothing is saved, for unregistered voxel types, numbers that are not finite, an
  ///           instance whose grid does not exist, or a partial grid of the world that is marked as not saved, because
  ///           its unloaded chunks would be lost. With a default-constructed saver, also if the world already holds a
  ///           scene or other types. For write errors, see WorldStore::save. If it throws bad_alloc, the next save
  ///           stores everything.
  /// Cost:     O(changes); O(chunks) the first time.
  /// Requires: the same world and scene (or a snapshot of it) in every call; the world is open for writing; no save in
  ///           steps is begun.
  Result<SaveTicket> save(WorldStore& world, const Scene& scene, WorldChanges more = {},
                          std::function<void(const Status&)> on_saved = {});

  /// Reads the changes of the scene since the last call, for the next save. `save` and `begin` call it. If saves are
  /// rare, call it each frame: a journal keeps a limited number of changes (ChangeCursor), and a saver that reads them
  /// too late saves every chunk.
  ///
  /// Calls `on_edit(grid, chunk)` for each edited chunk of the grids that were saved or loaded before, once per call
  /// and aspect (voxels, data, densities); with nullopt if any chunk of the grid may have been edited. Chunks that
  /// were only loaded or unloaded (Grid::load_chunk) are left out. If it throws, the next call reports again.
  /// Cost: O(changes), and O(objects changed since the last save) if there are new ones among them.
  void follow(const Scene& scene, FunctionRef<void(GridHandle grid, std::optional<IVec3> chunk)> on_edit);
  void follow(const Scene& scene) {
    follow(scene, [](GridHandle, std::optional<IVec3>) {});
  }
  /// Begins a save of the scene as it is now. Later edits belong to the next save. Groups and other small parts are
  /// copied at once. Changed instances are copied as they are, and `step` compares and numbers the copies. If a grid
  /// has more than 16 changed chunks, `step` copies them from a snapshot of the grid.
  /// Errors:   as `save`, and no save is begun.
  /// Cost:     O(changes except those of chunks + changed grids). O(chunks) for new grids, and after a failed save.
  /// Requires: as `save`.
  Status begin(WorldStore& world, const Scene& scene, WorldChanges more = {},
               std::function<void(const Status&)> on_saved = {});
  /// Returns true between `begin` and the `step` that hands the save to the world.
  [[nodiscard]] bool is_begun() const;
  /// Copies changed instances and chunks for about `seconds`, at least 16 of them. When all are copied, hands the save
  /// to the world as one atomic commit and returns its ticket: in the same call if at most half of the time has passed,
  /// else in the next one. Returns nullopt before that, and if no save is begun.
  /// Errors:   as `save`; the save ends, and the next one stores everything.
  /// Cost:     `seconds`, or half of it and then a check of all chunks of the save, about 0.2 us for each.
  /// Requires: the world of `begin`.
  Result<std::optional<SaveTicket>> step(WorldStore& world, double seconds);
  /// Sets the cameras to store with the next `save`. If not called, `save` keeps the values from load_world.
  void set_view(WorldView view);
  /// Returns the number of a grid in the world (ChunkAddress::grid), or nullopt before its first save and if it is left
  /// out. Cost: O(log grids).
  [[nodiscard]] std::optional<std::uint32_t> number_of(GridHandle grid) const;

  // For Quoin's own sources.
  struct [[gnu::visibility("hidden")]] Impl;
  [[nodiscard]] Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// A loaded scene and the saver for its changes.
struct LoadedWorld {
  LoadedScene loaded;
  WorldSaver saver;
};

/// Loads a world's scene with all chunks of level 0 into memory.
///
/// Warnings: one per damaged item; it is left out of the scene but stays in the file. Also one for an unreadable sky
///           image.
/// Errors:   CannotRead, BadFormat, Cancelled.
[[nodiscard]] Result<LoadedWorld> load_world(const WorldStore& world, const LoadOptions& options = {},
                                             Threads threads = {}, const Progress& progress = {});

/// Loads a world's scene without chunks: its grids are partial, with all chunks unloaded (Grid::make_partial). The
/// saver saves edits of chunks that are loaded later; unloaded chunks stay as stored. It stores new grids that are not
/// partial as whole. Does not read the sky image.
///
/// `max_whole_bytes`: if not 0, loads the grids that are stored as whole (SceneGrid::whole) with all their chunks, if
///           these need at most this many bytes: estimated from a sample of the chunks before, and counted during
///           loading.
/// Warnings: as load_world.
/// Errors:   CannotRead, BadFormat; LimitExceeded, with the grid's name, if whole grids need more than
///           `max_whole_bytes` or more than the available memory.
[[nodiscard]] Result<LoadedWorld> load_partial_world(const WorldStore& world, const LoadOptions& options = {},
                                                     std::uint64_t max_whole_bytes = 0);

/// Writes a scene as a new world, replacing an existing file atomically. Returns its size. `more`: see
/// WorldSaver::save.
///
/// Errors: as WorldSaver::save; CannotWrite, also if another process writes the existing world.
[[nodiscard]] Result<SavedScene> write_world(const Scene& scene, const std::filesystem::path& path,
                                             Threads threads = {}, const Progress& progress = {},
                                             WorldChanges more = {});
/// Writes a loaded scene with its cameras as a new world.
[[nodiscard]] Result<SavedScene> write_world(const LoadedScene& loaded, const std::filesystem::path& path,
                                             Threads threads = {}, const Progress& progress = {},
                                             WorldChanges more = {});

}  // namespace quoin
