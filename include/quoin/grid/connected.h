#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/function_ref.h>
#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/mass.h>
#include <quoin/grid/voxel_registry.h>

namespace [[gnu::visibility("default")]] quoin {

/// Defines connected voxels: sharing a face, or sharing at least a face, an edge or a corner.
enum class Connectivity : std::uint8_t { Faces6, Corners26 };

struct ConnectedOptions {
  Connectivity connectivity = Connectivity::Faces6;
  /// Predicate that returns true if voxels of a type belong to pieces. If empty, all types except air belong. Called
  /// for each type of a chunk whenever the chunk is analysed, possibly on several threads, but never for air. Must
  /// always return the same result for a type.
  std::function<bool(VoxelType)> belongs{};
};

/// A set of connected voxels.
struct ConnectedPiece {
  IBox box;
  std::int64_t voxels = 0;
  IVec3 first{0};  ///< the first voxel by z, then y, then x
  /// True if the piece touches a chunk that is not loaded (Grid::is_loaded). It may continue there, or be supported
  /// there.
  bool touches_unloaded = false;
};

/// Tracks the connected pieces of a grid across edits, for example to find the parts that an explosion broke off.
///
///   pieces.update(world);                                  // once, and after each edit
///   for (std::size_t i : pieces.not_touching(ground)) {
///     Grid fallen = pieces.extract(i);                      // as a separate body
///     pieces.remove_from(world, i);
///   }
///
/// Order:    pieces are numbered by their first voxel (z, then y, then x), independent of threads and edit history. An
///           update may renumber them.
/// Cost:     first update O(rows of 64 voxels). Later updates O(rows of the changed chunks + rows on the touching
///           sides of their neighbours + parts in all chunks). A part is a connected component within one chunk. A
///           uniform chunk costs no time per voxel.
/// Partial:  in a partial grid, pieces cover only loaded chunks. An update handles loaded and unloaded chunks like
///           edits.
/// Memory:   about 0.3 KiB per chunk and 110 bytes per part. A chunk with several parts adds 8 KiB, and 1 to 4 bytes
///           per run of voxels along x. Measured: 9 KiB per chunk of terrain full of caves; 1.3 MB for a noise chunk
///           with 12,000 parts. It also shares the grid's chunks as of the last update, so later edits cost the same as
///           after a snapshot (Grid::snapshot).
/// Threads:  any number may read at once; an update needs exclusive access.
/// Source:   runs and union-find: L. He, Y. Chao, K. Suzuki, "A Run-Based Two-Scan Labeling Algorithm" (2008).
class ConnectedPieces {
 public:
  explicit ConnectedPieces(ConnectedOptions options = {});
  ConnectedPieces(ConnectedPieces&&) noexcept;
  ConnectedPieces& operator=(ConnectedPieces&&) noexcept;
  ~ConnectedPieces();

  /// Updates the pieces to the present state of `grid`. The first update, or an update with another grid, analyses
  /// all of it. If the update throws (bad_alloc), call it again before any other function.
  void update(const Grid& grid, Threads threads = {});

  /// Returns the pieces as of the last update. All functions identify a piece by its index here.
  /// Lifetime: until the next update.
  [[nodiscard]] std::span<const ConnectedPiece> pieces() const;
  [[nodiscard]] std::size_t size() const { return pieces().size(); }

  /// Returns the piece that contains a voxel, or nullopt. Cost: O(log chunks).
  [[nodiscard]] std::optional<std::size_t> piece_at(IVec3 voxel) const;
  /// Returns the pieces with a voxel in the box, ascending. Cost: O(chunks + rows of 64 voxels in the box).
  [[nodiscard]] std::vector<std::size_t> touching(const IBox& box) const;
  /// Returns the pieces without a voxel in the box, ascending, except those that touch an unloaded chunk. With the
  /// ground as the box, these are the unsupported pieces. For ground at y = 0, the box is {{INT_MIN, 0, INT_MIN},
  /// {INT_MAX, 1, INT_MAX}}. Cost: same as `touching`, plus O(pieces).
  [[nodiscard]] std::vector<std::size_t> not_touching(const IBox& box) const;

  /// Calls `visit(row, voxels)` for each row of 64 voxels that contains voxels of a piece. `row` is the first voxel of
  /// the row; its x is a multiple of 64. Bit i of `voxels` is voxel i of the row.
  /// Order: chunks by z, y, x, then rows by z, y. Requires: piece < size().
  void for_each_row(std::size_t piece, FunctionRef<void(IVec3 row, std::uint64_t voxels)> visit) const;
  /// Copies a piece into a new grid, at the same position. A chunk that contains only this piece is shared, not copied.
  /// Requires: piece < size().
  [[nodiscard]] Grid extract(std::size_t piece) const;
  /// Sets the voxels of a piece to air in a grid, usually the grid of the last update. Returns the number of changed
  /// voxels.
  /// Requires: piece < size().
  std::int64_t remove_from(Grid& grid, std::size_t piece) const;

  /// Returns the memory in use, in bytes, except the chunks shared with the grid.
  [[nodiscard]] std::size_t bytes() const;

 private:
  friend MassProperties mass_properties(const ConnectedPieces& pieces, std::size_t piece, DensityOfType density);
  struct [[gnu::visibility("hidden")]] Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
