#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/changes.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/vec.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace [[gnu::visibility("default")]] quoin {

class DensityChunk;
class DensityGrid;

/// A voxel position and the type to set there.
struct PlacedVoxel {
  IVec3 voxel{0};
  VoxelType type = kAir;
  bool operator==(const PlacedVoxel&) const = default;
};

/// A sparse, unbounded voxel grid in chunks of 64^3. Voxels that were never set are air.
///
/// Space:    voxel (i, j, k) fills the unit cube from (i, j, k) to (i + 1, j + 1, k + 1). All int32 coordinates are
///           valid, except that the outermost chunk on each side stays air.
/// Edits:    an edit that sets a voxel to its present type changes nothing. A chunk that is all air is removed. If an
///           edit throws (bad_alloc or an exception from a callback), or `progress` cancels it, the changes made so far
///           stay and are recorded. `changes_since` reports changes to any number of consumers; `visit_changes` also
///           reports old and new types.
/// Data:     voxels other than air can hold VoxelData. An edit that changes a voxel's type removes its data; an
///           edit that sets the same type keeps it. Whole chunks, snapshots, `copy_box` and extracted pieces include
///           the data. Halved grids keep only states that turn types (`downsample`); density fields have none.
/// Partial:  a partial grid (`make_partial`) holds some chunks of a world that is larger than memory. Unloaded chunks
///           read as air, but their real content is unknown. Edits do not change them. A chunk is meshed only if all
///           chunks around it are loaded. Scene queries report unloaded chunks (UnloadedChunks). Functions that count
///           or read voxels see only loaded chunks; `is_loaded_within` returns true if a box is complete. Chunks
///           outside of the extent (`set_extent`) are loaded air.
/// Sharing:  a `snapshot` is a copy-on-write copy and costs a pointer. An edit of either copies the shared memory that
///           it changes, about 4 KiB of a chunk at a time.
/// Threads:  any number may read or take snapshots at once; an edit needs exclusive access. A snapshot is independent:
///           it may be read and destroyed on another thread while this grid is edited.
/// Moving:   a moved-from grid can only be assigned to or destroyed.
class Grid {
 public:
  Grid();
  /// Moves the voxels and the change journal.
  Grid(Grid&&) noexcept;
  Grid& operator=(Grid&&) noexcept;
  ~Grid();
  /// Returns a copy-on-write copy of the present voxels. Later edits of either grid do not affect the other. A
  /// cursor of this grid also works with the snapshot, and the reverse, until the snapshot itself is edited.
  /// Cost: less than a microsecond. Afterwards, the first edit of each region copies about 4 KiB around it, and the
  /// first edit of each chunk about 3 KiB more, as long as a snapshot shares them.
  [[nodiscard]] Grid snapshot() const;

  /// Returns the type of a voxel; kAir if never set.
  // Hot functions take coordinates one by one. A vector argument is stored in memory for the call, which stalls the
  // load.
  [[nodiscard]] VoxelType get(IVec3 voxel) const { return get(voxel.x, voxel.y, voxel.z); }
  [[nodiscard]] VoxelType get(int x, int y, int z) const;
  template <std::floating_point T>
  VoxelType get(Point<T> point) const = delete;  // get(voxel_of(point))

  /// Sets a voxel. Returns true if its type changed. For many voxels, `edit` or GridWriter is faster.
  bool set(IVec3 voxel, VoxelType type) { return set(voxel.x, voxel.y, voxel.z, type); }
  bool set(int x, int y, int z, VoxelType type);
  template <std::floating_point T>
  bool set(Point<T> point, VoxelType type) = delete;  // set(voxel_of(point), type)
  /// Sets many voxels at any positions. If a position occurs several times, the last entry counts. Returns the
  /// number of changes. Edits the chunks of a long list on several threads; its result is the same at any thread count.
  /// Cost: per voxel a third of the time of `set`, if consecutive voxels lie in the same chunk; lists in another order
  /// are copied. Below 1,024 voxels, or in one chunk, uses the calling thread only.
  std::int64_t set(std::span<const PlacedVoxel> voxels, Threads threads = {});
  /// Sets voxels in the row of 64 voxels along x that contains `row`, as one edit. Voxel i becomes `types[i]` if bit
  /// i of `mask` is set. Returns the number of changed voxels.
  std::int64_t write_row(IVec3 row, std::uint64_t mask, std::span<const VoxelType, kChunkEdge> types);
  template <std::floating_point T>
  std::int64_t write_row(Point<T> row, std::uint64_t mask, std::span<const VoxelType, kChunkEdge> types) = delete;
  /// Sets all voxels of a box (half-open: `max` excluded; an empty box changes nothing). Returns the number of changed
  /// voxels.
  /// Cost: O(chunks of the box + rows of 64 voxels at its rim). A uniform chunk takes a few hundred bytes and no
  /// memory per voxel. If users choose the box, cancel oversized edits with `progress`.
  std::int64_t fill_box(const IBox& box, VoxelType type, const Progress& progress = {});
  /// Sets the voxels whose centre (i + 0.5) lies within `radius` of `centre`. Returns the number of changed voxels. A
  /// negative or non-finite radius, or a non-finite centre, changes nothing.
  /// Cost: O(voxels of the box around the sphere); for air, only in existing chunks.
  std::int64_t fill_sphere(DVec3 centre, double radius, VoxelType type, const Progress& progress = {});
  /// Calls `pick(IVec3 voxel, VoxelType current)` for every voxel of the box and sets the returned type. The box is
  /// half-open (`max` excluded). The order is x fastest, then y, then z within a chunk; chunks in the same order.
  /// Returns the number of changed voxels.
  /// Requires: `pick` does not edit the grid. It may call `get`, but must not use a GridReader. It sees the new
  /// types of earlier rows of 64 voxels along x, and the old types of its own row.
  template <class Pick>
  std::int64_t edit(const IBox& box, Pick&& pick, const Progress& progress = {}) {
    return edit_rows(
        box,
        [&pick](IVec3 first, std::span<VoxelType> row) {
          for (VoxelType& type : row) {
            type = pick(first, type);
            ++first.x;
          }
        },
        progress);
  }
  /// Edits a box row by row. `change(IVec3 first, std::span<VoxelType> types)` receives the types of the box along x in
  /// one chunk, starting at `first`, and changes them in place. Returns the number of changed voxels.
  std::int64_t edit_rows(const IBox& box, FunctionRef<void(IVec3 first, std::span<VoxelType> types)> change,
                         const Progress& progress = {});
  /// Replaces the types and data of a whole chunk. Recorded as an edit of the voxels that differ. Returns the number of
  /// voxels that changed type. Does nothing for an outermost chunk.
  std::int64_t put_chunk(IVec3 chunk, Chunk voxels);
  /// Sets all voxels to air, as an edit. In a partial grid, this applies to the loaded chunks.
  void clear();

  /// Makes the grid partial, with no chunk loaded. Removes its previous content, as an edit.
  void make_partial();
  [[nodiscard]] bool is_partial() const;
  /// Limits the content of a partial grid to a box of chunks (half open) and to `others`, chunks outside of the box.
  /// All chunks elsewhere are known to be air: they count as loaded without `load_chunk`, edits can fill them, and
  /// `unload_chunk` makes them one of the others. Loaded chunks stay loaded; `changes_since` reports them as loaded
  /// again, because the chunks around them may now be known. If it throws, nothing has changed.
  /// Requires: the grid is partial. Cost: O(loaded chunks and others).
  void set_extent(const IBox& chunks, std::span<const IVec3> others = {});
  /// Returns a box of all chunks that can be unloaded: of the whole world before `set_extent`, empty if the grid is not
  /// partial.
  [[nodiscard]] IBox extent() const;
  /// Loads a chunk, which may be all air. `changes_since` reports it as a load, not an edit (ChunkChange::is_edit).
  /// Returns false, without a change, if the chunk is loaded or outermost, or if the grid is not partial.
  bool load_chunk(IVec3 chunk, Chunk voxels);
  /// Unloads a chunk. `changes_since` reports it as in `load_chunk`. Returns false if the chunk is not loaded or the
  /// grid is not partial.
  bool unload_chunk(IVec3 chunk);
  /// Returns true if the chunk's content is known: it is in memory, or outside of the extent. Always true if the grid
  /// is not partial.
  [[nodiscard]] bool is_loaded(IVec3 chunk) const;
  template <std::floating_point T>
  bool is_loaded(Point<T> point) const = delete;  // is_loaded(chunk_of(voxel_of(point)))
  /// Returns true if the chunk and all chunks within `distance` of it along each axis are loaded.
  [[nodiscard]] bool is_loaded_around(IVec3 chunk, int distance = 1) const;
  /// Returns true if all chunks that overlap a box of voxels (half-open: `max` excluded) are loaded. Reads, counts and
  /// copies of the box are then complete. Cost: O(1) if the grid is not partial, else O(log chunks) per chunk.
  [[nodiscard]] bool is_loaded_within(const IBox& voxels) const;
  /// Returns the loaded chunks of a partial grid, including air chunks of the extent, or `chunks` if the grid is not
  /// partial. Sorted by z, then y, then x.
  [[nodiscard]] std::vector<IVec3> loaded_chunks() const;

  /// Returns the data of a voxel; empty if never set. Lifetime: until the grid's next edit.
  [[nodiscard]] VoxelData data(IVec3 voxel) const;
  template <std::floating_point T>
  VoxelData data(Point<T> point) const = delete;  // data(voxel_of(point))
  /// Replaces the data of a voxel. Returns true if it changed. Does nothing and returns false for air. The change is
  /// reported by `data_changes_since` but not by `changes_since`, because no type changes.
  /// Requires: at most kMaxVoxelDataBytes bytes, which are copied.
  bool set_data(IVec3 voxel, const VoxelData& data);
  template <std::floating_point T>
  bool set_data(Point<T> point, const VoxelData& data) = delete;
  /// Sets type and data of a voxel. Returns true if either changed. The data may come from this grid:
  /// `set(at, opened_door, world.data(at))`.
  bool set(IVec3 voxel, VoxelType type, const VoxelData& data);
  template <std::floating_point T>
  bool set(Point<T> point, VoxelType type, const VoxelData& data) = delete;
  /// Returns the number of voxels with data. Cost: O(1).
  [[nodiscard]] std::int64_t data_count() const;
  /// Calls `visit` for each voxel with data: chunks in the order of `chunks`, then z, y, x. Requires: `visit` does not
  /// edit the grid.
  void for_each_data(FunctionRef<void(IVec3 voxel, VoxelType type, const VoxelData& data)> visit) const;

  /// Returns the chunk, or null if all its voxels are air. Lifetime: the grid owns the chunk, and the next edit may
  /// invalidate the pointer. A copy of the chunk costs a pointer and stays valid.
  [[nodiscard]] const Chunk* find_chunk(IVec3 chunk) const { return find_chunk(chunk.x, chunk.y, chunk.z); }
  [[nodiscard]] const Chunk* find_chunk(int x, int y, int z) const;
  template <std::floating_point T>
  const Chunk* find_chunk(Point<T> point) const = delete;  // find_chunk(chunk_of(voxel_of(point)))
  /// Returns the coordinates of all chunks with a voxel that is not air, sorted by z, then y, then x.
  [[nodiscard]] std::vector<IVec3> chunks() const;
  [[nodiscard]] std::size_t chunk_count() const;
  /// Returns the chunk and its 26 neighbours, for meshers. If any of them is not loaded, all 27 are null and read as
  /// air. Call `is_loaded_around` first. Lifetime: the grid must outlive it, and an edit invalidates it.
  [[nodiscard]] Neighbourhood neighbourhood(IVec3 chunk) const;
  template <std::floating_point T>
  Neighbourhood neighbourhood(Point<T> point) const = delete;

  /// Returns the exact changes since the cursor's last read, and moves the cursor to the present.
  /// Cost: O(changed chunks), independent of the grid's size. See ChangeCursor.
  [[nodiscard]] GridChanges changes_since(ChangeCursor& cursor) const;
  /// As above. Replaces `changes`, and keeps its memory.
  void changes_since(ChangeCursor& cursor, GridChanges& changes) const;
  /// Returns true if voxel types have changed since the cursor. Cost: O(1).
  [[nodiscard]] bool has_changed_since(const ChangeCursor& cursor) const;
  /// Returns the changes of voxel data since the cursor's last read, and moves the cursor to the present. A consumer of
  /// both types and data needs a cursor for each. Cost: same as `changes_since`.
  [[nodiscard]] DataChanges data_changes_since(ChangeCursor& cursor) const;
  /// Returns true if voxel data has changed since the cursor. Cost: O(1).
  [[nodiscard]] bool has_data_changed_since(const ChangeCursor& cursor) const;
  /// Returns a cursor at the present. It reports changes from now on.
  [[nodiscard]] ChangeCursor cursor() const;

  /// Returns the smallest box around all voxels that are not air; empty if there are none.
  /// Cost: O(chunks) the first time and after edits at its sides, otherwise O(changed chunks).
  [[nodiscard]] IBox bounds() const;
  /// Returns the number of voxels that are not air. Cost: O(1).
  [[nodiscard]] std::int64_t voxel_count() const;
  /// Returns the types in use except air, ascending. Cost: O(chunks).
  [[nodiscard]] std::vector<VoxelType> types() const;
  /// Calls `visit(IVec3 voxel, VoxelType type)` for every voxel that is not air: chunks in the order of `chunks`, then
  /// z, y, x.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for_each_row([&visit](IVec3 first, std::span<const VoxelType> row) {
      for (const VoxelType type : row) {
        if (type != kAir) visit(first, type);
        ++first.x;
      }
    });
  }
  /// Calls `visit(first voxel, types)` for each row along x within the tight bounds of each chunk, in the same order.
  /// The types can include air. The span is valid only during the call.
  void for_each_row(FunctionRef<void(IVec3 first, std::span<const VoxelType> types)> visit) const;
  /// Returns the memory in use, in bytes, including memory shared with snapshots.
  [[nodiscard]] std::size_t bytes() const;
  /// Frees memory that edits left unused, except memory shared with snapshots.
  void compact();

  // For Quoin's own sources: a grid and the field of the same scene grid, whose loaded chunks are the same. Both share
  // one list of them, so that a chunk that comes or goes changes one list.

  /// Loads a chunk of both, far air without `samples`. Returns true if it was not loaded in this grid.
  [[gnu::visibility("hidden")]] bool load_chunk(IVec3 chunk, Chunk voxels, DensityGrid& field,
                                                std::optional<DensityChunk> samples);
  /// Unloads a chunk of both. Returns true if it was loaded in this grid.
  [[gnu::visibility("hidden")]] bool unload_chunk(IVec3 chunk, DensityGrid& field);
  /// Lets the field share the list if both have the same loaded chunks. Cost: O(loaded chunks).
  [[gnu::visibility("hidden")]] void share_loaded(DensityGrid& field) const;

 private:
  friend class Scene;
  struct [[gnu::visibility("hidden")]] Impl;
  explicit Grid(std::unique_ptr<Impl> impl);
  [[nodiscard]] Grid snapshot(BulkMemory& memory) const;
  [[nodiscard]] inline Impl& impl() const;

  std::unique_ptr<Impl> impl_;
  mutable ChangeNotifier notifier_;  // mutable: a scene that follows the grid is not part of its value
};

/// Reads many voxels that lie near each other. Caches the chunk of the last voxel, and unpacks a row when reads run
/// along x.
///
/// Lifetime: the grid must outlive the reader and must not be edited.
class GridReader {
 public:
  explicit GridReader(const Grid& grid) : grid_(&grid) {}

  [[nodiscard]] VoxelType get(IVec3 voxel) { return get(voxel.x, voxel.y, voxel.z); }
  [[nodiscard]] VoxelType get(int x, int y, int z) {
    const std::uint32_t along = static_cast<std::uint32_t>(x) - row_x_;
    if (along < row_length_ && both(y, z) == row_yz_) [[likely]]
      return row_[along];
    return get_elsewhere(x, y, z);
  }

 private:
  // Combines y and z into one key. A caller that reads along x computes it once per row.
  static std::uint64_t both(int y, int z) {
    return std::uint64_t{static_cast<std::uint32_t>(y)} << 32 | static_cast<std::uint32_t>(z);
  }
  // Takes coordinates one by one, because a vector would be stored in memory for the call at every read.
  VoxelType get_elsewhere(int x, int y, int z);
  VoxelType get_in_other_chunk(int x, int y, int z);
  VoxelType get_in_new_row(int x, int y, int z);
  // Predicts that the next row will be read along x too: the last row was, and the new row starts at its beginning.
  [[nodiscard]] bool goes_on(int x) const { return reads_of_row_ >= kReadsAlongX && (x & (kChunkEdge - 1)) == 0; }

  static constexpr int kReadsAlongX = 4;  // after this many reads in a row, unpack it
  const Grid* grid_;
  std::uint32_t row_x_ = 0;
  std::uint32_t row_length_ = 0;  // of the unpacked row; 0 if there is none
  std::uint64_t row_yz_ = 0;
  std::array<VoxelType, kChunkEdge> row_{};
  const Chunk* chunk_ = nullptr;          // chunk of the last read outside the unpacked row
  const ChunkStorage* voxels_ = nullptr;  // its voxels; null if all are `uniform_`
  VoxelType uniform_ = kAir;
  std::uint32_t unknown_ = ~std::uint32_t{0};  // all ones until the first read, then 0
  int last_x_ = 0;
  int last_y_ = 0;
  int last_z_ = 0;
  int reads_of_row_ = 0;
};

/// Sets many voxels that lie near each other. Collects the voxels of a row of 64 along x and writes them as one edit:
/// when another row begins, on flush, and on destruction. The grid does not change before that.
///
/// Lifetime: the grid must outlive the writer.
/// Requires: call `flush` before reading voxels that were set.
/// Cost:     per voxel a tenth of the time of `Grid::set` if voxels come in order along x; slower than `Grid::set` if
///           every voxel lies in another row.
class GridWriter {
 public:
  explicit GridWriter(Grid& grid) : grid_(&grid) {}
  GridWriter(const GridWriter&) = delete;
  GridWriter& operator=(const GridWriter&) = delete;
  /// Flushes. A failed allocation here ends the process; call `flush` first to get the exception.
  ~GridWriter() { flush(); }

  void set(IVec3 voxel, VoxelType type) { set(voxel.x, voxel.y, voxel.z, type); }
  void set(int x, int y, int z, VoxelType type) {
    if ((x & ~(kChunkEdge - 1)) != row_x_ || y != row_y_ || z != row_z_) [[unlikely]]
      go_to(x, y, z);
    const int local = x & (kChunkEdge - 1);
    types_[static_cast<std::size_t>(local)] = type;
    is_set_[static_cast<std::size_t>(local)] = 1;
  }
  /// Writes the collected voxels. Errors: bad_alloc; the row is then not written.
  void flush();

 private:
  void go_to(int x, int y, int z);

  Grid* grid_;
  int row_x_ = 0;
  int row_y_ = 0;
  int row_z_ = 0;
  std::array<VoxelType, kChunkEdge> types_{};
  std::array<std::uint8_t, kChunkEdge> is_set_{};  // bytes, because writes to one mask would depend on each other
};

/// Returns the shape of a voxel, as its state and its neighbours select it; null if its type has no shapes. Lifetime:
/// until the type is replaced. Cost: a few lookups.
[[nodiscard]] const ShapeModel* shape_at(const Grid& grid, const VoxelRegistry& types, IVec3 voxel);
/// Returns the fluid next to the shape of a voxel. Lifetime and cost: as `shape_at`.
[[nodiscard]] InnerFluid fluid_at(const Grid& grid, const VoxelRegistry& types, IVec3 voxel);

}  // namespace quoin
