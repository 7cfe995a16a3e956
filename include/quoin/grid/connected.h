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
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// Which voxels hold together: those with a common face, or also those with a common edge or corner.
enum class Connectivity : std::uint8_t { Faces6, Corners26 };

struct ConnectedOptions {
  Connectivity connectivity = Connectivity::Faces6;
  /// Whether voxels of a type belong to pieces; empty: all do. Asked for each type of a chunk whenever that is looked
  /// at, possibly on several threads, so it has to say the same each time; never for air, which belongs to none.
  std::function<bool(VoxelType)> belongs{};
};

/// Voxels that hold together.
struct ConnectedPiece {
  IBox box;
  std::int64_t voxels = 0;
  IVec3 first{0};  ///< the one that comes first by z, then y, then x
  /// Whether it touches a chunk that is not loaded (Grid::is_loaded): it may go on there, and be held by what is there.
  bool touches_unloaded = false;
};

/// The connected pieces of a grid, kept up to date while it is edited: whether a blow has broken something off, and
/// what.
///
/// Usage:   pieces.update(world);                                  // once, and after each edit
///          for (std::size_t i : pieces.apart_from(ground)) {
///            Grid fallen = pieces.extract(i);                      // as a body of its own
///            pieces.remove_from(world, i);
///          }
/// Order:   pieces are numbered by their first voxel (z, then y, then x), whatever the threads or the edits that led
///          there. An update may number them anew.
/// Cost:    of the first update O(rows of 64 voxels), of later ones O(rows of the chunks that changed and of the sides
///          of those next to them + parts of pieces in all chunks). Chunks of one type take no time by the voxel.
///          A part is what of a piece lies connected in one chunk.
/// Partial: of a grid that is not all in memory pieces are those of what is loaded. Chunks that come or go are taken
///          over by updates like edits.
/// Memory:  about 0.3 KiB a chunk and 110 bytes a part; of chunks with several parts also 8 KiB and 1 to 4 bytes a run
///          of voxels along x. Measured: 9 KiB a chunk of terrain full of caves, 1.3 MB for a chunk of noise of 12,000
///          parts. Beside that it shares the chunks of the grid as it was at the last update, as a snapshot does, so
///          that the first edit of each afterwards copies it.
/// Threads: any number may read at once; an update needs it to itself.
/// Source:  runs and union-find: L. He, Y. Chao, K. Suzuki, "A Run-Based Two-Scan Labeling Algorithm" (2008).
class ConnectedPieces {
 public:
  explicit ConnectedPieces(ConnectedOptions options = {});
  ConnectedPieces(ConnectedPieces&&) noexcept;
  ConnectedPieces& operator=(ConnectedPieces&&) noexcept;
  ~ConnectedPieces();

  /// Takes over what `grid` has become since the last update; all of it the first time or where it is another grid.
  /// When it throws (bad_alloc), call it again before anything else.
  void update(const Grid& grid, Threads threads = {});

  /// As of the last update; the index of a piece is its number in all calls. Lifetime: until the next update.
  [[nodiscard]] std::span<const ConnectedPiece> pieces() const;
  [[nodiscard]] std::size_t size() const { return pieces().size(); }

  /// The piece to which a voxel belongs. Cost: O(log chunks).
  [[nodiscard]] std::optional<std::size_t> piece_at(IVec3 voxel) const;
  /// The pieces that have a voxel in the box, ascending. Cost: O(chunks + rows of 64 voxels of the box).
  [[nodiscard]] std::vector<std::size_t> touching(const IBox& box) const;
  /// All others, ascending, but for those that touch what is not loaded: with the ground as the box (y = 0: {{INT_MIN,
  /// 0, INT_MIN}, {INT_MAX, 1, INT_MAX}}) those that nothing holds any more. Cost: as `touching`, and O(pieces).
  [[nodiscard]] std::vector<std::size_t> apart_from(const IBox& box) const;

  /// Calls `visit(row, voxels)` for the rows of 64 voxels in which a piece has some: `row` is the row's first voxel,
  /// whose x is a multiple of 64, bit i of `voxels` stands for its voxel i. Chunks by z, y, x, then rows by z, y.
  /// Requires: piece < size().
  void for_each_row(std::size_t piece, FunctionRef<void(IVec3 row, std::uint64_t voxels)> visit) const;
  /// A piece as a grid of its own, where it was. Chunks that hold nothing else are shared. Requires: piece < size().
  [[nodiscard]] Grid extract(std::size_t piece) const;
  /// Makes the piece's voxels air in a grid, usually the one of the last update. Returns how many changed.
  /// Requires: piece < size().
  std::int64_t remove_from(Grid& grid, std::size_t piece) const;

  /// Bytes held, but for the chunks that it shares.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
