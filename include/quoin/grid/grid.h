#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/changes.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/progress.h>
#include <quoin/core/vec.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// A voxel and what it is to be.
struct PlacedVoxel {
  IVec3 voxel{0};
  VoxelType type = kAir;
  bool operator==(const PlacedVoxel&) const = default;
};

/// A sparse, unbounded field of voxels in chunks of 64^3. What was never set is air.
///
/// Space:    voxel (i, j, k) fills the unit cube from (i, j, k) to (i + 1, j + 1, k + 1). Any int32 coordinates, except
///           the outermost chunk on each side, which stays air.
/// Edits:    setting a voxel to what it is changes nothing. A chunk that is all air is dropped. When an edit throws
///           (bad_alloc, or what a callback threw), or is cancelled by its `progress`, what it did until then stays
///           done and booked. `changes_since` tells any number of consumers what edits changed, `visit_changes` from
///           which type to which.
/// Data:     voxels that are not air may hold VoxelData. It follows its voxel: an edit that gives it another type takes
///           it away, one that gives it the type it has leaves it; whole chunks, snapshots, `copy_box` and extracted
///           pieces carry it along. Halved grids and fields have none.
/// Partial:  of a world that is larger than memory a grid holds some chunks (`make_partial`). Those that are not loaded
///           read as air, which is not what they are: edits leave them as they are, no mesh is made of a chunk unless
///           all around it are loaded, and queries of a scene know of them (UnloadedChunks). What counts or reads
///           voxels here tells of what is loaded: `is_loaded_within` says whether that is all.
/// Sharing:  `snapshot` is a copy that costs a pointer. What the two share is copied when one of them is edited, some
///           4 KiB of a chunk at a time.
/// Threads:  any number may read at once, and take snapshots; an edit needs the grid to itself. A snapshot is a grid of
///           its own: it may be read and destroyed on another thread while this one is edited.
/// Moving:   a grid that was moved from may only be assigned to or destroyed.
class Grid {
 public:
  Grid();
  /// Takes the other's voxels and its journal of changes along.
  Grid(Grid&&) noexcept;
  Grid& operator=(Grid&&) noexcept;
  ~Grid();
  /// The voxels as they are now; later edits of either do not reach the other. A cursor that read this grid's changes
  /// reads on in the snapshot, and the other way round, until the snapshot is edited itself.
  /// Cost: a fraction of a microsecond. The first edit of each place afterwards copies what lies around it, some 4 KiB,
  /// and of its chunk the rest of some 3 KiB, as long as a snapshot shares it.
  [[nodiscard]] Grid snapshot() const;

  /// The voxel's type; kAir where nothing was set.
  // Coordinates go one by one where a call is often made: a vector is stored in memory for it, and waited for.
  [[nodiscard]] VoxelType get(IVec3 voxel) const { return get(voxel.x, voxel.y, voxel.z); }
  [[nodiscard]] VoxelType get(int x, int y, int z) const;
  template <std::floating_point T>
  VoxelType get(Point<T> point) const = delete;  // get(voxel_of(point))

  /// Sets one voxel. Returns true when it had another type before. Of many, `edit` or a GridWriter is faster.
  bool set(IVec3 voxel, VoxelType type) { return set(voxel.x, voxel.y, voxel.z, type); }
  bool set(int x, int y, int z, VoxelType type);
  template <std::floating_point T>
  bool set(Point<T> point, VoxelType type) = delete;  // set(voxel_of(point), type)
  /// Sets many voxels wherever they lie; of several for one place the last counts. Returns how many changed.
  /// Cost: of those that lie in one chunk one after the other a third of `set`.
  std::int64_t set(std::span<const PlacedVoxel> voxels);
  /// Of the row of 64 voxels along x in which `row` lies, sets those whose bits are set in `mask`: voxel i to
  /// `types[i]`; one edit. Returns how many changed.
  std::int64_t write_row(IVec3 row, std::uint64_t mask, std::span<const VoxelType, kChunkEdge> types);
  template <std::floating_point T>
  std::int64_t write_row(Point<T> row, std::uint64_t mask, std::span<const VoxelType, kChunkEdge> types) = delete;
  /// Sets all voxels of a box (half open: `max` excluded; an empty one changes nothing). Returns how many changed.
  /// Cost: O(chunks of the box + rows of 64 voxels at its rim); uniform chunks take no memory per voxel, but each some
  /// hundred bytes: where a box is a user's own choice, say how much is too much by `progress`.
  std::int64_t fill_box(const IBox& box, VoxelType type, const Progress& progress = {});
  /// Sets the voxels whose centre (i + 0.5) is at most `radius` from `centre`. Returns how many changed.
  /// A radius that is negative or not finite, or a centre that is not finite, changes nothing.
  /// Cost: O(voxels of the box around the sphere); of air, of those in chunks that there are.
  std::int64_t fill_sphere(DVec3 centre, double radius, VoxelType type, const Progress& progress = {});
  /// Asks `pick(IVec3 voxel, VoxelType current)` for the new type of every voxel of the box (half open: `max`
  /// excluded), x fastest, then y, then z within a chunk, and chunks in that order too. Returns how many changed.
  /// Requires: `pick` changes nothing in the grid. It may read it by `get`, not by a GridReader, and finds what was
  /// picked for earlier rows, of 64 voxels along x, but not its own.
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
  /// `edit`, a row at a time: `change(IVec3 first, std::span<VoxelType> types)` gets the types of the voxels of the
  /// box along x in one chunk, from `first` on, and changes them in place. Returns how many changed.
  std::int64_t edit_rows(const IBox& box, FunctionRef<void(IVec3 first, std::span<VoxelType> types)> change,
                         const Progress& progress = {});
  /// Puts a whole chunk in place, its data too; counts as an edit of whatever differs. Returns how many types changed.
  /// The outermost chunks are ignored.
  std::int64_t put_chunk(IVec3 chunk, Chunk voxels);
  /// Makes everything air, as an edit; of a partial grid, what is loaded.
  void clear();

  /// Makes it a partial grid of which nothing is loaded; what it held is gone, as an edit.
  void make_partial();
  [[nodiscard]] bool is_partial() const;
  /// Brings a chunk into memory, which may be air: `changes_since` tells of it, as no edit (ChunkChange::is_edit).
  /// False, and nothing is done, where it is loaded, the grid is not partial, or the chunk is an outermost one.
  bool load_chunk(IVec3 chunk, Chunk voxels);
  /// Takes a chunk out of memory, likewise. False where it is not loaded, or the grid is not partial.
  bool unload_chunk(IVec3 chunk);
  /// Whether a chunk's voxels are in memory: always, unless the grid is partial.
  [[nodiscard]] bool is_loaded(IVec3 chunk) const;
  template <std::floating_point T>
  bool is_loaded(Point<T> point) const = delete;  // is_loaded(chunk_of(voxel_of(point)))
  /// Whether it and all that are at most so many chunks from it along each axis are.
  [[nodiscard]] bool is_loaded_around(IVec3 chunk, int distance = 1) const;
  /// Whether all chunks are that a box of voxels meets (half open: `max` excluded): whether what is read, counted or
  /// copied there is all that there is. Cost: O(1) unless the grid is partial; else O(log chunks) for each chunk.
  [[nodiscard]] bool is_loaded_within(const IBox& voxels) const;
  /// Of a partial grid the chunks that are loaded, air too; else as `chunks`. Sorted likewise.
  [[nodiscard]] std::vector<IVec3> loaded_chunks() const;

  /// What the voxel holds besides its type; empty where nothing was put. Lifetime: until the grid's next edit.
  [[nodiscard]] VoxelData data(IVec3 voxel) const;
  template <std::floating_point T>
  VoxelData data(Point<T> point) const = delete;  // data(voxel_of(point))
  /// Puts that in the place of what there was; true when it was another. False, and nothing is put, where the voxel is
  /// air. No type changes: `changes_since` tells nothing of it, `data_changes_since` does.
  /// Requires: at most kMaxVoxelDataBytes bytes, which are copied.
  bool set_data(IVec3 voxel, const VoxelData& data);
  template <std::floating_point T>
  bool set_data(Point<T> point, const VoxelData& data) = delete;
  /// Type and data, which may be this grid's own: `set(at, opened_door, world.data(at))`. True when either changed.
  bool set(IVec3 voxel, VoxelType type, const VoxelData& data);
  template <std::floating_point T>
  bool set(Point<T> point, VoxelType type, const VoxelData& data) = delete;
  /// Voxels with data. Cost: O(1).
  [[nodiscard]] std::int64_t data_count() const;
  /// Calls `visit` for them: chunks as in `chunks`, then z, y, x; it must not edit the grid.
  void for_each_data(FunctionRef<void(IVec3 voxel, VoxelType type, const VoxelData& data)> visit) const;

  /// Null where all is air. Lifetime: the grid owns the chunk, and its next edit may end it; a copy of the chunk costs
  /// no more than the pointer and is the caller's own.
  [[nodiscard]] const Chunk* find_chunk(IVec3 chunk) const { return find_chunk(chunk.x, chunk.y, chunk.z); }
  [[nodiscard]] const Chunk* find_chunk(int x, int y, int z) const;
  template <std::floating_point T>
  const Chunk* find_chunk(Point<T> point) const = delete;  // find_chunk(chunk_of(voxel_of(point)))
  /// Coordinates of all chunks that hold a voxel, sorted by z, then y, then x.
  [[nodiscard]] std::vector<IVec3> chunks() const;
  [[nodiscard]] std::size_t chunk_count() const;
  /// The chunk and the 26 around it, for meshers. Where not all of them are loaded, all 27 are null, as of air: ask
  /// `is_loaded_around` first. Lifetime: the grid must outlive it, and an edit ends it.
  [[nodiscard]] Neighbourhood neighbourhood(IVec3 chunk) const;
  template <std::floating_point T>
  Neighbourhood neighbourhood(Point<T> point) const = delete;

  /// What edits changed since the cursor's last time, exactly; moves the cursor to the present.
  /// Cost: O(chunks that changed), whatever the size of the grid. See ChangeCursor.
  [[nodiscard]] GridChanges changes_since(ChangeCursor& cursor) const;
  /// Whether that would tell of anything. Cost: O(1).
  [[nodiscard]] bool has_changed_since(const ChangeCursor& cursor) const;
  /// Where voxels' data changed since the cursor's last time; moves the cursor to the present, so that whoever asks
  /// for both has a cursor for each. Cost: as `changes_since`.
  [[nodiscard]] DataChanges data_changes_since(ChangeCursor& cursor) const;
  /// Whether that would tell of anything. Cost: O(1).
  [[nodiscard]] bool has_data_changed_since(const ChangeCursor& cursor) const;
  /// A cursor at the present: it will be told what changes from now on.
  [[nodiscard]] ChangeCursor cursor() const;

  /// The smallest box around all non-air voxels; empty when there are none. Cost: O(chunks) the first time, and after
  /// edits at its sides; otherwise O(chunks that changed).
  [[nodiscard]] IBox bounds() const;
  /// Voxels that are not air. Cost: O(1).
  [[nodiscard]] std::int64_t voxel_count() const;
  /// Types that occur, ascending. Cost: O(chunks).
  [[nodiscard]] std::vector<VoxelType> types() const;
  /// Calls `visit(IVec3 voxel, VoxelType type)` for every non-air voxel: chunks as in `chunks`, then z, y, x.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for_each_row([&visit](IVec3 first, std::span<const VoxelType> row) {
      for (const VoxelType type : row) {
        if (type != kAir) visit(first, type);
        ++first.x;
      }
    });
  }
  /// Calls `visit(first voxel, types)` for the rows along x of the tight bounds of each chunk, in the same order; there
  /// may be air among the types. Valid only during the call.
  void for_each_row(FunctionRef<void(IVec3 first, std::span<const VoxelType> types)> visit) const;
  /// Bytes held, also those that snapshots share.
  [[nodiscard]] std::size_t bytes() const;
  /// Gives back memory that edits left unused, but for what snapshots share.
  void compact();

 private:
  friend class Scene;
  struct Impl;
  explicit Grid(std::unique_ptr<Impl> impl);
  [[nodiscard]] inline Impl& impl() const;

  std::unique_ptr<Impl> impl_;
  mutable EditNotice notice_;  // a scene that follows it is no part of it
};

/// Reads many voxels that lie near each other: remembers the chunk of the last one, and unpacks a row that is
/// read along x.
///
/// Lifetime: the grid must outlive the reader, unedited.
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
  // One key, computed once a row by whoever reads along x.
  static std::uint64_t both(int y, int z) {
    return std::uint64_t{static_cast<std::uint32_t>(y)} << 32 | static_cast<std::uint32_t>(z);
  }
  // Coordinates one by one: a vector would be stored in memory for the call, at every read.
  VoxelType get_elsewhere(int x, int y, int z);
  VoxelType get_in_other_chunk(int x, int y, int z);
  VoxelType get_in_new_row(int x, int y, int z);
  // Who read the last row along x and begins another at its start goes on like that.
  [[nodiscard]] bool goes_on(int x) const { return reads_of_row_ >= kReadsAlongX && (x & (kChunkEdge - 1)) == 0; }

  static constexpr int kReadsAlongX = 4;  // so many in one row, and the next ones are expected there too
  const Grid* grid_;
  std::uint32_t row_x_ = 0;
  std::uint32_t row_length_ = 0;  // of what is unpacked: nothing, or a row
  std::uint64_t row_yz_ = 0;
  std::array<VoxelType, kChunkEdge> row_{};
  const Chunk* chunk_ = nullptr;          // that of the last voxel read elsewhere than in the row
  const ChunkStorage* voxels_ = nullptr;  // its voxels; null where they are all of `uniform_`
  VoxelType uniform_ = kAir;
  std::uint32_t unknown_ = ~std::uint32_t{0};  // 0 from the first read on
  int last_x_ = 0;
  int last_y_ = 0;
  int last_z_ = 0;
  int reads_of_row_ = 0;
};

/// Sets many voxels that lie near each other: collects those of a row of 64 along x and sets them in one edit when it
/// comes to another row, when it is flushed, and at its end. Until then the grid is as it was.
///
/// Lifetime: the grid must outlive the writer.
/// Requires: nothing reads the grid before a flush and expects what was set.
/// Cost:     where voxels come in rows, a tenth of `Grid::set`; where every voxel lies in another row, more than that.
class GridWriter {
 public:
  explicit GridWriter(Grid& grid) : grid_(&grid) {}
  GridWriter(const GridWriter&) = delete;
  GridWriter& operator=(const GridWriter&) = delete;
  /// Flushes. A failed allocation ends the process here; flush before to have it thrown.
  ~GridWriter() { flush(); }

  void set(IVec3 voxel, VoxelType type) { set(voxel.x, voxel.y, voxel.z, type); }
  void set(int x, int y, int z, VoxelType type) {
    if ((x & ~(kChunkEdge - 1)) != row_x_ || y != row_y_ || z != row_z_) [[unlikely]]
      go_to(x, y, z);
    const int local = x & (kChunkEdge - 1);
    types_[static_cast<std::size_t>(local)] = type;
    is_set_[static_cast<std::size_t>(local)] = 1;
  }
  /// Sets what was collected. Errors: bad_alloc; that row is then not set.
  void flush();

 private:
  void go_to(int x, int y, int z);

  Grid* grid_;
  int row_x_ = 0;
  int row_y_ = 0;
  int row_z_ = 0;
  std::array<VoxelType, kChunkEdge> types_{};
  std::array<std::uint8_t, kChunkEdge> is_set_{};  // bytes: one mask would have each write wait for the one before
};

}  // namespace quoin
