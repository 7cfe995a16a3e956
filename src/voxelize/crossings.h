// The crossings of a mesh with lines through the voxel centres, along each axis.
//
//  axis 0 (x): lines of (y, z)     a column is 64 x 64 lines: all lines through a row of chunks
//  axis 1 (y): lines of (x, z)     its lines' crossings are stored line by line, each sorted along the line
//  axis 2 (z): lines of (x, y)

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>

#include "voxelize/voxel_frame.h"

namespace quoin::voxelizing {

/// One crossing: the first voxel whose centre lies at or behind it, a flag if it lies in the previous voxel, and the
/// hit side. A crossing between two voxels belongs to the voxel on the inner side of the surface.
class Crossing {
 public:
  Crossing() = default;
  Crossing(int first_centre_behind, bool is_in_previous, bool enters)
      : bits_(first_centre_behind * 4 + (is_in_previous ? 0 : 2) + (enters ? 1 : 0)) {}
  /// Returns the first voxel behind the crossing.
  [[nodiscard]] int behind() const { return bits_ >> 2; }
  /// Returns the voxel that contains the crossing.
  [[nodiscard]] int voxel() const { return (bits_ >> 2) - ((bits_ & 2) != 0 ? 0 : 1); }
  /// Returns +1 into the mesh, -1 out of it.
  [[nodiscard]] int step() const { return (bits_ & 1) != 0 ? 1 : -1; }
  bool operator<(const Crossing& other) const { return bits_ < other.bits_; }

 private:
  std::int32_t bits_ = 0;
};

inline constexpr std::size_t kLines = static_cast<std::size_t>(kChunkEdge) * kChunkEdge;

/// 64 x 64 lines.
struct Column {
  std::vector<std::uint32_t> begin;  ///< of line u + 64 v in `crossings`, and one more; empty if there are no crossings
  std::vector<Crossing> crossings;
  /// By line: surface voxels where lines touch the border of a triangle without crossing it.
  std::vector<std::pair<std::uint16_t, int>> touched;

  [[nodiscard]] std::span<const Crossing> line(std::size_t index) const {
    if (begin.empty()) return {};
    QUOIN_ASSERT(index < kLines && begin.size() == kLines + 1, "a line of the column");
    return {crossings.data() + begin[index], crossings.data() + begin[index + 1]};
  }
};

/// The axes of the lines' plane.
inline constexpr std::array<std::array<int, 2>, 3> kPlane = {{{1, 2}, {0, 2}, {0, 1}}};

class Crossings {
 public:
  /// `rule`: determines the inner side of the surface; None counts as Winding.
  /// Errors: LimitExceeded, before anything is found; Cancelled.
  [[nodiscard]] static Result<Crossings> find(const Frame& frame, SolidVoxels rule, Threads threads,
                                              const Progress& progress);

  /// Returns the number of columns along `axis`.
  [[nodiscard]] std::span<const Column> columns(int axis) const {
    QUOIN_ASSERT(axis >= 0 && axis < 3, "0 <= axis < 3");
    return columns_[static_cast<std::size_t>(axis)];
  }
  /// Returns the index of the column along `axis` through a chunk of the frame.
  [[nodiscard]] std::size_t column_index(int axis, IVec3 chunk) const {
    QUOIN_ASSERT(axis >= 0 && axis < 3 && (IBox{IVec3(0), chunks_}.contains(chunk)),
                 "an axis and a chunk of the frame");
    const auto [u, v] = kPlane[static_cast<std::size_t>(axis)];
    return static_cast<std::size_t>(chunk[u]) +
           static_cast<std::size_t>(chunks_[u]) * static_cast<std::size_t>(chunk[v]);
  }
  [[nodiscard]] const Column& column(int axis, IVec3 chunk) const { return columns(axis)[column_index(axis, chunk)]; }
  /// Returns the number of chunks of the frame along each axis.
  [[nodiscard]] IVec3 chunks() const { return chunks_; }

 private:
  std::array<std::vector<Column>, 3> columns_;
  IVec3 chunks_{0};
};

/// Marks the voxels of a chunk that contain a crossing or are touched: the 6-separating surface.
void mark_crossed(const Crossings& crossings, IVec3 chunk, ChunkBits& bits);

/// The part of a chunk within a mesh.
enum class Filled : std::uint8_t { None, All, Some };

/// Memory that a thread reuses.
struct InsideScratch {
  std::vector<std::int16_t> votes;  ///< of every voxel, x fastest
};

/// The minimum and maximum votes of the lines along an axis in a chunk.
struct VoteRange {
  std::int16_t least = 0;
  std::int16_t most = 0;
};

/// Finds the voxels within a mesh.
///
/// Votes: with Winding, each of the six axis rays from a centre counts its exits from the mesh minus its entries; the
/// sum is six times the winding number. With Parity, each ray votes if it has an odd number of crossings. The minimum
/// and maximum votes of the lines of all axes decide most chunks, also in open meshes: `find` tests single voxels only
/// in the other chunks.
class Inside {
 public:
  /// Requires: `rule` is not None; `crossings` outlives it.
  Inside(const Crossings& crossings, SolidVoxels rule, Threads threads);

  /// Finds the voxels of a chunk whose centre is solid; sets `bits` only if it returns Some.
  [[nodiscard]] Filled find(IVec3 chunk, InsideScratch& scratch, ChunkBits& bits) const;

 private:
  const Crossings* crossings_;
  SolidVoxels rule_;
  std::array<std::vector<VoteRange>, 3> ranges_;  // of an axis: chunks along it, column after column
};

}  // namespace quoin::voxelizing
