#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/neighbourhood.h>

namespace quoin {

/// A sparse, unbounded field of voxels in chunks of 64^3. What was never set is air.
///
/// Space:    voxel (i, j, k) fills the unit cube from (i, j, k) to (i + 1, j + 1, k + 1). Any int32 coordinates, except
///           the outermost chunk on each side, which stays air.
/// Edits:    an edit raises the version of every chunk in which a voxel changed, and the neighbourhood version of
///           every existing chunk whose mesh it can change: those that hold one of the 26 neighbours of a changed
///           voxel. Setting a voxel to what it is changes nothing. A chunk that is all air is dropped.
///           When an edit throws (bad_alloc, or what a callback threw), what it did until then stays done and booked.
/// Threads:  any number may read at once; an edit needs the grid to itself.
/// Moving:   a grid that was moved from may only be assigned to or destroyed.
class Grid {
 public:
  Grid();
  Grid(Grid&&) noexcept;
  Grid& operator=(Grid&&) noexcept;
  ~Grid();
  /// A copy of voxels and versions; copying is explicit because it is dear.
  [[nodiscard]] Grid clone() const;

  // Coordinates go one by one where a call is often made: a vector is stored in memory for it, and waited for.
  [[nodiscard]] VoxelType get(IVec3 voxel) const { return get(voxel.x, voxel.y, voxel.z); }
  [[nodiscard]] VoxelType get(int x, int y, int z) const;

  /// True when the voxel had another type before.
  bool set(IVec3 voxel, VoxelType type) { return set(voxel.x, voxel.y, voxel.z, type); }
  bool set(int x, int y, int z, VoxelType type);
  /// Sets those of the 64 voxels of the row in which `row` lies whose bits are set in `mask`, from the row's own array;
  /// one edit. Answers how many changed.
  std::int64_t set_row(IVec3 row, std::uint64_t mask, std::span<const VoxelType, kChunkEdge> types);
  /// Sets all voxels from `first` to `last`, both included, in any order of corners. Answers how many changed.
  /// Cost: O(chunks of the box + rows of 64 voxels at its rim); uniform chunks take no memory per voxel. It cannot be
  /// cancelled: a box of millions of chunks is better filled piece by piece.
  std::int64_t fill_box(IVec3 first, IVec3 last, VoxelType type);
  /// Sets the voxels whose centre (i + 0.5) is at most `radius` from `centre`. Answers how many changed.
  /// A negative or NaN radius or centre changes nothing.
  std::int64_t fill_sphere(DVec3 centre, double radius, VoxelType type);
  /// Asks `pick(voxel, current type)` for the new type of every voxel of the box, x fastest, then y, then z within a
  /// chunk, chunks likewise. Answers how many changed. Requires: `pick` changes nothing in the grid. It may read it by
  /// `get`, not by a GridReader, and finds what was picked for earlier rows, of 64 voxels along x, but not its own.
  std::int64_t edit(const IBox& box, const std::function<VoxelType(IVec3 voxel, VoxelType current)>& pick);
  /// Puts a whole chunk in place; counts as an edit of whatever differs. The outermost chunks are ignored.
  void put_chunk(IVec3 chunk, Chunk voxels);
  void clear();

  /// Null where all is air.
  [[nodiscard]] const Chunk* find_chunk(IVec3 chunk) const { return find_chunk(chunk.x, chunk.y, chunk.z); }
  [[nodiscard]] const Chunk* find_chunk(int x, int y, int z) const;
  /// Coordinates of all chunks that hold a voxel, sorted by z, then y, then x.
  [[nodiscard]] std::vector<IVec3> chunks() const;
  [[nodiscard]] std::size_t chunk_count() const;
  [[nodiscard]] Neighbourhood neighbourhood(IVec3 chunk) const;

  /// Raised by every edit that changed a voxel of this chunk; 0 for a chunk that is not there.
  [[nodiscard]] std::uint64_t version(IVec3 chunk) const;
  /// Raised by every edit within one voxel of this chunk: what a mesh of it depends on. 0 for a chunk that is not
  /// there.
  [[nodiscard]] std::uint64_t neighbourhood_version(IVec3 chunk) const;
  /// Raised by every edit that changed anything.
  [[nodiscard]] std::uint64_t version() const;
  /// Tells this field of voxels from every other of the process, also from one whose place it has taken: it moves along
  /// with the voxels, and a clone has its own. Together with the versions it says whether anything has changed.
  [[nodiscard]] std::uint64_t identity() const;
  /// The chunks whose mesh may have changed since the last call, sorted as `chunks`; dropped ones are among them.
  std::vector<IVec3> take_dirty();

  /// The smallest box around all non-air voxels; empty when there are none. Cost: O(chunks).
  [[nodiscard]] IBox bounds() const;
  [[nodiscard]] std::int64_t voxel_count() const;
  /// Types that occur, ascending.
  [[nodiscard]] std::vector<VoxelType> types() const;
  /// Calls `visit(voxel, type)` for every non-air voxel: chunks as in `chunks`, then z, y, x.
  void for_each(const std::function<void(IVec3 voxel, VoxelType type)>& visit) const;
  /// Bytes held.
  [[nodiscard]] std::size_t bytes() const;
  /// Gives back memory that edits left unused.
  void compact();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads many voxels that lie near each other: remembers the chunk of the last one, and unpacks a row that is
/// read along x.
///
/// Requires: the grid is not edited meanwhile.
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
  // One number, which who reads along x makes once a row.
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
  const Chunk::Mixed* voxels_ = nullptr;  // its voxels; null where they are all of `uniform_`
  VoxelType uniform_ = kAir;
  std::uint32_t unknown_ = ~std::uint32_t{0};  // 0 from the first read on
  int last_x_ = 0;
  int last_y_ = 0;
  int last_z_ = 0;
  int reads_of_row_ = 0;
};

inline VoxelType GridReader::get_elsewhere(int x, int y, int z) {
  const auto other_yz = static_cast<std::uint32_t>((y ^ last_y_) | (z ^ last_z_));
  const std::uint32_t other = other_yz | static_cast<std::uint32_t>(x ^ last_x_) | unknown_;
  if (other >= kChunkEdge) return get_in_other_chunk(x, y, z);
  if (other_yz != 0) {
    if (goes_on(x)) return get_in_new_row(x, y, z);
    last_y_ = y;
    last_z_ = z;
    reads_of_row_ = 0;
  } else if (++reads_of_row_ == kReadsAlongX) {
    return get_in_new_row(x, y, z);
  }
  if (voxels_ == nullptr) return uniform_;
  return voxels_->type(x & (kChunkEdge - 1), y & (kChunkEdge - 1), z & (kChunkEdge - 1));
}

/// Sets many voxels that lie near each other: collects those of a row of 64 along x and sets them in one edit when it
/// comes to another row, when it is flushed, and at its end. Until then the grid is as it was.
///
/// Requires: the grid outlives the writer; nobody reads it before a flush and expects what was set.
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
