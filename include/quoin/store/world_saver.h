#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>
#include <quoin/store/world_store.h>

namespace quoin {

struct LoadedWorld;

/// As in LoadedScene.
struct WorldView {
  std::optional<DVec3> sun;
  std::optional<Camera> camera;
  std::vector<FileCamera> cameras;
};

/// Keeps a scene in a world: each `save` writes what changed since the one before, found by the journals.
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
/// A chunk that edits emptied is kept as air (StoredChunk). Numbers of grids, instances, groups and layers stay theirs.
/// Lifetime: it holds no reference between calls.
/// Threads:  as the scene.
class WorldSaver {
 public:
  /// Of a scene for a world that holds none yet: the first `save` writes all of it.
  WorldSaver();
  WorldSaver(WorldSaver&&) noexcept;
  WorldSaver& operator=(WorldSaver&&) noexcept;
  ~WorldSaver();

  /// Saves what changed, all of it in one go; returns at once. Chunks are shared with the scene, not copied.
  /// `more`: is saved with it, a game's own values for one, or a thumbnail.
  /// Errors: InvalidArgument, and nothing is saved: voxels of types that are not registered, numbers that are not
  ///         finite, an instance whose grid is not there; the first time, a world that holds a scene or other types.
  ///         Of writing: see WorldStore::save.
  /// Cost:   O(what changed); the first time O(chunks).
  /// Requires: the same world and scene (or a snapshot of it) each time; the world is open for writing.
  Result<SaveTicket> save(WorldStore& world, const Scene& scene, WorldChanges more = {},
                          std::function<void(const Status&)> on_saved = {});
  /// From where it is looked at, and lit: saved with the next `save`. What load_world read until then.
  void set_view(WorldView view);
  /// The number that a grid has in the world (ChunkPlace::grid); nothing before it was saved. Cost: O(log grids).
  [[nodiscard]] std::optional<std::uint32_t> number_of(GridHandle grid) const;

 private:
  friend Result<LoadedWorld> load_partial_world(const WorldStore& world, const LoadOptions& options);
  friend Result<LoadedWorld> load_world(const WorldStore& world, const LoadOptions& options, Threads threads,
                                        const Progress& progress);
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A world's scene, and what saves what becomes of it.
struct LoadedWorld {
  LoadedScene loaded;
  WorldSaver saver;
};

/// Reads a world's scene: all chunks of level 0, into memory.
///
/// Warnings: of what is damaged, which is left out, and stays in the file.
/// Errors:   CannotRead, BadFormat, Cancelled.
[[nodiscard]] Result<LoadedWorld> load_world(const WorldStore& world, const LoadOptions& options = {},
                                             Threads threads = {}, const Progress& progress = {});

/// The same without chunks: its grids are partial, and nothing of them is loaded (Grid::make_partial). The saver keeps
/// what is edited in what is loaded later; what is not loaded stays as it is stored.
[[nodiscard]] Result<LoadedWorld> load_partial_world(const WorldStore& world, const LoadOptions& options = {});

/// Writes a scene as a new world, in place of what is there; it appears whole or not at all. Returns its size.
/// `more`: as WorldSaver::save.
///
/// Errors: those of WorldSaver::save; CannotWrite, also where another program writes the world that is there.
[[nodiscard]] Result<SavedScene> write_world(const Scene& scene, const std::filesystem::path& path,
                                             Threads threads = {}, const Progress& progress = {},
                                             WorldChanges more = {});
/// The same with the sun and the cameras of a scene that was read.
[[nodiscard]] Result<SavedScene> write_world(const LoadedScene& loaded, const std::filesystem::path& path,
                                             Threads threads = {}, const Progress& progress = {},
                                             WorldChanges more = {});

}  // namespace quoin
