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
#include <quoin/grid/voxel_registry.h>
#include <quoin/store/stored_chunk.h>

namespace quoin {

namespace store {
struct ChangeSet;
}

/// What a world knows of a grid, but for its chunks.
struct WorldGrid {
  std::string name{};
  DVec3 pivot{0.0};   ///< as SceneGrid
  IBox canvas{};      ///< as SceneGrid
  float band = 8.0F;  ///< of its densities, as DensityGrid; it must not change once there are any

  bool operator==(const WorldGrid&) const = default;
};

enum class WorldAccess : std::uint8_t { Read, Write };

/// What is saved together: all of it, or after a power cut none of it. Later changes of one thing replace earlier ones.
class WorldChanges {
 public:
  WorldChanges();
  WorldChanges(WorldChanges&&) noexcept;
  WorldChanges& operator=(WorldChanges&&) noexcept;
  ~WorldChanges();

  /// Cost: a pointer or two; chunks are shared with the grids that they are from, which may be edited meanwhile.
  void put_chunk(const ChunkPlace& place, StoredChunk chunk);
  /// As if it had never been made.
  void remove_chunk(const ChunkPlace& place);
  /// The types of a registry, from one on. A type that chunks use may change, but not go.
  void put_types(const VoxelRegistry& types, VoxelType first = 1);
  /// Requires: not air.
  void put_type(VoxelType type, const VoxelProperties& properties);
  void put_grid(std::uint32_t number, const WorldGrid& grid);
  /// The grid and all its chunks.
  void remove_grid(std::uint32_t number);
  /// What a game keeps beside the world: an inventory, the time of day. Any bytes under any name, up to 64 MiB.
  void put_value(std::string name, std::vector<std::byte> bytes);
  void remove_value(std::string name);
  /// What shows the world in lists: a PNG, up to 16 MiB. Whoever saves draws it, at any time; it stays until the next.
  void put_thumbnail(std::vector<std::byte> png);
  void remove_thumbnail();

  [[nodiscard]] bool empty() const;
  [[nodiscard]] std::size_t chunk_count() const;

 private:
  friend class WorldStore;
  friend struct WorldParts;
  std::unique_ptr<store::ChangeSet> content_;
};

/// A save that was begun: WorldStore::wait.
struct SaveTicket {
  std::uint64_t number = 0;  ///< later saves have greater ones; 0: nothing was to be saved
};

struct WorldStats {
  std::uint64_t pending_chunks = 0;  ///< that are not on disk yet
  std::uint64_t pending_bytes = 0;   ///< of memory that these take
  std::uint64_t saved_chunks = 0;    ///< since the world was opened
  std::uint64_t saved_bytes = 0;     ///< of these, on disk
  std::uint64_t commits = 0;
};

/// A world on disk, in one file (docs/formats/world.md): chunks of any number of grids, and all that a scene has.
///
///   auto world = quoin::WorldStore::open("home.quoin", quoin::WorldAccess::Write);
///   quoin::WorldChanges changes;
///   changes.put_chunk({.chunk = {0, 1, 0}}, {*grid.find_chunk({0, 1, 0})});
///   if (const auto begun = world->save(std::move(changes)); !begun) complain(begun.error());  // on its own thread
///   if (const auto saved = world->flush(); !saved) complain(saved.error());
///
/// Safety:  what `wait`, `flush` or a callback said was saved survives kill -9 and power cuts. Until then it is there
///          after a crash as a whole or not at all, never in part.
/// Writers: one at a time, of all processes of the machine; readers any number, which see each save as a whole.
/// Threads: any function from any thread, also at once. `load_chunk` sees what was saved before, on disk or not yet.
/// Files:   beside NAME there are NAME-wal, NAME-shm and NAME-lock while it is written, of which the first belongs to
///          it: after a crash it holds what was saved last. On network file systems there is no -wal; readers then wait
///          for writers.
/// Requires: nothing but Quoin opens and closes the file in this process while it is open: that would end its locks.
/// Lifetime: moving it is cheap; it waits for its saves when it ends.
class WorldStore {
 public:
  /// Makes a new, empty world, open for writing. It appears whole or not at all.
  /// Errors: CannotWrite, also where there is a file of that name; Unsupported in builds without SQLite.
  [[nodiscard]] static Result<WorldStore> create(const std::filesystem::path& path, Threads threads = {});
  /// Errors: CannotRead, CannotWrite (another writer, a read-only file); BadFormat (no world, cut off, damaged beyond
  ///         reading: see repair_world); Unsupported (of a later version; in builds without SQLite).
  [[nodiscard]] static Result<WorldStore> open(const std::filesystem::path& path, WorldAccess access,
                                               Threads threads = {});
  /// Opens a world for writing; makes it where there is none. Errors: as those two.
  [[nodiscard]] static Result<WorldStore> open_or_create(const std::filesystem::path& path, Threads threads = {});
  WorldStore(WorldStore&&) noexcept;
  WorldStore& operator=(WorldStore&&) noexcept;
  ~WorldStore();

  /// The chunk; nothing where there is none, which is not the same as air.
  /// Errors: BadFormat where it is damaged; CannotRead.
  [[nodiscard]] Result<std::optional<StoredChunk>> load_chunk(const ChunkPlace& place) const;
  /// The places of all chunks of a grid and level that lie in a box of chunk coordinates (half open), sorted by z, then
  /// y, then x. Cost: O(volume of the box) or O(chunks of the regions, of 32^3 chunks, that it meets), the lesser.
  [[nodiscard]] Result<std::vector<IVec3>> chunks(std::uint32_t grid, std::uint8_t level, const IBox& box) const;
  /// The same of a whole level.
  [[nodiscard]] Result<std::vector<IVec3>> chunks(std::uint32_t grid, std::uint8_t level) const;
  /// The types of its voxels; those that are damaged are magenta ones of other names. Errors: CannotRead.
  [[nodiscard]] Result<VoxelRegistry> types() const;
  /// Its grids by their numbers; those that are damaged are nameless. Errors: as `types`.
  [[nodiscard]] Result<std::map<std::uint32_t, WorldGrid>> grids() const;
  /// A number for a new grid, which no grid had before, and which no other call returns.
  [[nodiscard]] std::uint32_t next_grid();
  /// Nothing where none was put. Errors: BadFormat where it is damaged; CannotRead.
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> value(std::string_view name) const;
  /// The names of all values, sorted.
  [[nodiscard]] Result<std::vector<std::string>> value_names() const;

  /// The PNG that shows the world; nothing where none was put. Errors: as `value`.
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> thumbnail() const;

  /// Saves, on the world's own thread; returns at once. `on_saved` is called there once it is on disk, or when it
  /// failed; it must not call `wait` or `flush`. What failed is kept in memory, read by `load_chunk`, and tried again
  /// with the next save or `flush`.
  /// Errors: InvalidArgument, and nothing is saved: types with fewer state bits than before; chunks with types, or of
  ///         grids, that were never put; voxels' data with more state bits than their type has, or more than 64 MiB in
  ///         one chunk; a value of more; a thumbnail that is no PNG.
  /// Requires: open for writing.
  Result<SaveTicket> save(WorldChanges changes, std::function<void(const Status&)> on_saved = {});
  /// Waits until that save is on disk. Errors: CannotWrite (a full disk ...): it is not, but kept.
  /// Requires: a ticket of this world.
  [[nodiscard]] Status wait(SaveTicket ticket);
  /// Waits for all that was saved before; of what failed it tries again. Errors: as `wait`.
  [[nodiscard]] Status flush();
  [[nodiscard]] WorldStats stats() const;

  [[nodiscard]] const std::filesystem::path& path() const;
  [[nodiscard]] bool is_writable() const;

 private:
  friend struct WorldParts;
  struct Impl;
  explicit WorldStore(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
