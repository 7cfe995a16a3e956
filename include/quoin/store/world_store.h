#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace [[gnu::visibility("default")]] quoin {

/// The address of a chunk in a world.
struct ChunkAddress {
  std::uint32_t grid = 0;  ///< the grid's number in the world; never reused
  std::uint8_t level = 0;  ///< level of detail: voxels have edges of 2^level
  IVec3 chunk{0};          ///< chunk coordinates, as in Grid::find_chunk

  bool operator==(const ChunkAddress&) const = default;
};

/// The stored content of a chunk. A chunk stored as air was generated and is empty; a chunk that is not stored was
/// never generated.
struct StoredChunk {
  Chunk voxels{kAir};  ///< with per-voxel data
  std::optional<DensityChunk> densities = std::nullopt;

  bool operator==(const StoredChunk&) const = default;
};

/// Checks the content of a chunk from another source, such as a generator, before it is used or saved. Cost: up to
/// 0.1 ms with densities. Requires: 0 < band.
/// Errors: InvalidArgument for types that `types` does not have; densities that are no `stored_density` of the band;
///         per-voxel data with more state bits than its type or more than 64 MiB. Unsupported in builds without SQLite.
[[nodiscard]] Status validate_chunk(const StoredChunk& chunk, const VoxelRegistry& types, float band);

namespace store {
struct [[gnu::visibility("hidden")]] ChangeSet;
}

/// The properties of a grid in a world, without its chunks.
struct WorldGrid {
  std::string name{};
  DVec3 pivot{0.0};   ///< as SceneGrid
  IBox canvas{};      ///< as SceneGrid
  float band = 8.0F;  ///< band of its density field, as in DensityGrid; must not change once densities are stored
  /// True if StreamedWorld loads all of the grid when it opens the world. Grids of files of version 3 or earlier are
  /// not whole: StreamedWorld streams them.
  bool whole = false;

  bool operator==(const WorldGrid&) const = default;
};

enum class WorldAccess : std::uint8_t { Read, Write };

/// A set of changes that is saved atomically: after a power cut, the file has all of them or none. A later change of
/// the same item replaces an earlier one.
class WorldChanges {
 public:
  WorldChanges();
  WorldChanges(WorldChanges&&) noexcept;
  WorldChanges& operator=(WorldChanges&&) noexcept;
  ~WorldChanges();

  /// Stores a chunk. Cost: copies a few pointers; chunks share storage with their grids, which may be edited
  /// afterwards.
  void put_chunk(const ChunkAddress& address, StoredChunk chunk);
  /// Removes a chunk, as if it had never been generated.
  void remove_chunk(const ChunkAddress& address);
  /// Stores the types of a registry, from `first` on. Types in use can be changed but not removed.
  void put_types(const VoxelRegistry& types, VoxelType first = 1);
  /// Stores one type. Requires: not air.
  void put_type(VoxelType type, const VoxelProperties& properties);
  void put_grid(std::uint32_t number, const WorldGrid& grid);
  /// Removes the grid and all its chunks.
  void remove_grid(std::uint32_t number);
  /// Stores a game-defined value (inventory, time of day, ...) of up to 64 MiB under any name.
  void put_value(std::string name, std::vector<std::byte> bytes);
  void remove_value(std::string name);
  /// Stores a preview image for world lists, a PNG of up to 16 MiB. The caller renders it; it stays until replaced.
  void put_thumbnail(std::vector<std::byte> png);
  void remove_thumbnail();

  [[nodiscard]] bool empty() const;
  [[nodiscard]] std::size_t chunk_count() const;

  // For Quoin's own sources.
  [[nodiscard]] store::ChangeSet& content() { return *content_; }

 private:
  std::unique_ptr<store::ChangeSet> content_;
};

/// Identifies a save: see WorldStore::wait.
struct SaveTicket {
  std::uint64_t number = 0;  ///< later saves have greater numbers; 0: there was nothing to save
};

struct WorldStats {
  std::uint64_t pending_chunks = 0;  ///< not on disk yet
  std::uint64_t pending_bytes = 0;   ///< memory of the pending chunks
  std::uint64_t saved_chunks = 0;    ///< since the world was opened
  std::uint64_t saved_bytes = 0;     ///< size on disk of the saved chunks
  std::uint64_t commits = 0;
};

/// A world on disk in one file (docs/formats/world.md): the chunks of any number of grids, and the scene.
///
///   auto world = quoin::WorldStore::open("home.quoin", quoin::WorldAccess::Write);
///   quoin::WorldChanges changes;
///   changes.put_chunk({.chunk = {0, 1, 0}}, {*grid.find_chunk({0, 1, 0})});
///   if (const auto begun = world->save(std::move(changes)); !begun) complain(begun.error());  // on its own thread
///   if (const auto saved = world->flush(); !saved) complain(saved.error());
///
/// Safety:   once `wait`, `flush` or a callback reports a save as done, it survives kill -9 and power cuts. Before
///           that, a crash leaves either the whole save or none of it.
/// Writers:  one at a time among all processes on the machine. Any number of readers; each sees a save entirely or not
///           at all.
/// Threads:  any function may be called from any thread, also from several at once. `load_chunk` sees all earlier
///           saves, including pending ones.
/// Files:    while NAME is written, NAME-wal, NAME-shm and NAME-lock exist next to it. NAME-wal is part of the world:
///           after a crash it holds the latest saves. On network file systems there is no -wal, and readers wait for
///           writers.
/// Requires: while the world is open, no other code in this process opens and closes the file: on POSIX systems,
///           closing it would release Quoin's locks.
/// Lifetime: moving it is cheap. The destructor waits for pending saves.
class WorldStore {
 public:
  /// Creates a new, empty world atomically and opens it for writing.
  /// Errors: CannotWrite, also if the file exists; Unsupported in builds without SQLite.
  [[nodiscard]] static Result<WorldStore> create(const std::filesystem::path& path, Threads threads = {});
  /// Opens a world.
  /// Errors: CannotRead; CannotWrite (another writer, a read-only file); BadFormat (not a world, truncated, too damaged
  ///         to read: see repair_world); Unsupported (a later version; builds without SQLite).
  [[nodiscard]] static Result<WorldStore> open(const std::filesystem::path& path, WorldAccess access,
                                               Threads threads = {});
  /// Opens a world for writing, or creates it if the file does not exist. Errors: as `open` and `create`.
  [[nodiscard]] static Result<WorldStore> open_or_create(const std::filesystem::path& path, Threads threads = {});
  WorldStore(WorldStore&&) noexcept;
  WorldStore& operator=(WorldStore&&) noexcept;
  ~WorldStore();

  /// Loads a chunk. Returns nullopt if it is not stored, which differs from air.
  /// Errors: BadFormat if it is damaged; CannotRead.
  [[nodiscard]] Result<std::optional<StoredChunk>> load_chunk(const ChunkAddress& address) const;
  /// Returns the coordinates of all stored chunks of a grid and level in a box of chunk coordinates (half open), sorted
  /// by z, then y, then x. Cost: the lesser of O(box volume) and O(chunks in the regions of 32^3 chunks that the box
  /// touches).
  [[nodiscard]] Result<std::vector<IVec3>> chunks(std::uint32_t grid, std::uint8_t level, const IBox& box) const;
  /// Returns the coordinates of all stored chunks of a level, sorted as above.
  [[nodiscard]] Result<std::vector<IVec3>> chunks(std::uint32_t grid, std::uint8_t level) const;
  /// Returns the voxel types. Damaged types are replaced by magenta ones with other names. Errors: CannotRead.
  [[nodiscard]] Result<VoxelRegistry> types() const;
  /// Returns the grids by number. Damaged grids have no name. Errors: as `types`.
  [[nodiscard]] Result<std::map<std::uint32_t, WorldGrid>> grids() const;
  /// Returns an unused grid number, which no earlier grid had and no other call returns.
  [[nodiscard]] std::uint32_t next_grid();
  /// Returns a value, or nullopt if it is not stored. Errors: BadFormat if it is damaged; CannotRead.
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> value(std::string_view name) const;
  /// Returns the names of all values, sorted.
  [[nodiscard]] Result<std::vector<std::string>> value_names() const;

  /// Returns the thumbnail PNG, or nullopt if there is none. Errors: as `value`.
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> thumbnail() const;

  /// Starts a save on the world's own thread and returns at once. Calls `on_saved` on that thread after success, and
  /// after each failure of this or an earlier save; the callback must not call `wait` or `flush`. A failed save stays
  /// in memory, where `load_chunk` finds it, and is retried with the next save or `flush`.
  /// Errors:   InvalidArgument, and nothing is saved, for types with fewer state bits than before; chunks with types or
  ///           grids that were never stored; chunks more than 2^26 chunks from the origin; per-voxel data with more
  ///           state bits than its type or more than 64 MiB in one chunk; a value above 64 MiB; a thumbnail that is not
  ///           a PNG.
  /// Requires: open for writing.
  Result<SaveTicket> save(WorldChanges changes, std::function<void(const Status&)> on_saved = {});
  /// Waits until a save is on disk. Errors: CannotWrite (disk full, ...); the save is not on disk but stays in memory.
  /// Requires: a ticket of this world.
  [[nodiscard]] Status wait(SaveTicket ticket);
  /// Waits for all earlier saves and retries failed ones. Errors: as `wait`.
  [[nodiscard]] Status flush();
  [[nodiscard]] WorldStats stats() const;

  [[nodiscard]] const std::filesystem::path& path() const;
  [[nodiscard]] bool is_writable() const;

  // For Quoin's own sources.
  struct [[gnu::visibility("hidden")]] Impl;
  explicit WorldStore(std::unique_ptr<Impl> impl);
  [[nodiscard]] const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
