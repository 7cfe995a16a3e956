#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
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

  [[nodiscard]] VoxelType get(IVec3 voxel) const;

  /// True when the voxel had another type before.
  bool set(IVec3 voxel, VoxelType type);
  /// Sets all voxels from `first` to `last`, both included, in any order of corners. Answers how many changed.
  /// Cost: O(chunks of the box + rows of 64 voxels at its rim); uniform chunks take no memory per voxel. It cannot be
  /// cancelled: a box of millions of chunks is better filled piece by piece.
  std::int64_t fill_box(IVec3 first, IVec3 last, VoxelType type);
  /// Sets the voxels whose centre (i + 0.5) is at most `radius` from `centre`. Answers how many changed.
  /// A negative or NaN radius or centre changes nothing.
  std::int64_t fill_sphere(DVec3 centre, double radius, VoxelType type);
  /// Asks `pick(voxel, current type)` for the new type of every voxel of the box, x fastest, then y, then z within a
  /// chunk, chunks likewise. Answers how many changed. Requires: `pick` leaves the grid alone.
  std::int64_t edit(const IBox& box, const std::function<VoxelType(IVec3 voxel, VoxelType current)>& pick);
  /// Puts a whole chunk in place; counts as an edit of whatever differs. The outermost chunks are ignored.
  void put_chunk(IVec3 chunk, Chunk voxels);
  void clear();

  /// Null where all is air.
  [[nodiscard]] const Chunk* find_chunk(IVec3 chunk) const;
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

/// Reads many voxels that lie near each other: remembers the chunk of the last one.
///
/// Requires: the grid is not edited meanwhile.
class GridReader {
 public:
  explicit GridReader(const Grid& grid) : grid_(&grid) {}

  [[nodiscard]] VoxelType get(IVec3 voxel) {
    const IVec3 chunk = chunk_of(voxel);
    if (chunk != coords_ || !known_) {
      coords_ = chunk;
      known_ = true;
      chunk_ = grid_->find_chunk(chunk);
    }
    return chunk_ == nullptr ? kAir : chunk_->get(local_of(voxel));
  }

 private:
  const Grid* grid_;
  const Chunk* chunk_ = nullptr;
  IVec3 coords_{0};
  bool known_ = false;
};

}  // namespace quoin
