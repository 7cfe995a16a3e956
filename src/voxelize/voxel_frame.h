#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/voxelize/voxelize.h>

namespace quoin::voxelizing {

using Corners = std::array<DVec3, 3>;

/// A mesh in voxels, relative to the corner of the first queried chunk.
class Frame {
 public:
  /// `margin`: voxels around the mesh to include. Errors: as check_mesh and voxelize.
  [[nodiscard]] static Result<Frame> make(const TriangleMesh& mesh, const VoxelLattice& lattice, double margin);

  [[nodiscard]] const TriangleMesh& mesh() const { return *mesh_; }
  [[nodiscard]] std::size_t triangle_count() const { return mesh_->triangles.size(); }
  [[nodiscard]] Corners corners(std::size_t triangle) const {
    QUOIN_ASSERT(triangle < triangle_count(), "a triangle of the mesh");
    const auto& t = mesh_->triangles[triangle];
    return {positions_[t[0]], positions_[t[1]], positions_[t[2]]};
  }
  /// Returns the number of chunks along each axis.
  [[nodiscard]] IVec3 chunks() const { return chunks_; }
  [[nodiscard]] std::size_t chunk_count() const {
    return static_cast<std::size_t>(chunks_.x) * static_cast<std::size_t>(chunks_.y) *
           static_cast<std::size_t>(chunks_.z);
  }
  /// x fastest, then y, then z.
  [[nodiscard]] std::size_t index_of(IVec3 chunk) const {
    QUOIN_ASSERT((IBox{IVec3(0), chunks_}.contains(chunk)), "a chunk of the frame");
    return static_cast<std::size_t>(chunk.x) +
           static_cast<std::size_t>(chunks_.x) *
               (static_cast<std::size_t>(chunk.y) +
                static_cast<std::size_t>(chunks_.y) * static_cast<std::size_t>(chunk.z));
  }
  [[nodiscard]] IVec3 chunk_at(std::size_t index) const {
    QUOIN_ASSERT(index < chunk_count(), "a chunk of the frame");
    const auto x = static_cast<std::size_t>(chunks_.x);
    const auto y = static_cast<std::size_t>(chunks_.y);
    return {static_cast<int>(index % x), static_cast<int>(index / x % y), static_cast<int>(index / x / y)};
  }
  /// Returns the grid coordinates of the frame's chunk 0.
  [[nodiscard]] IVec3 first_chunk() const { return first_chunk_; }

 private:
  const TriangleMesh* mesh_ = nullptr;
  std::vector<DVec3> positions_;
  IVec3 chunks_{0};
  IVec3 first_chunk_{0};
};

/// Lists the triangles near a chunk: those whose plane and box, grown by `margin`, overlap it.
class ChunkTriangles {
 public:
  ChunkTriangles(const Frame& frame, double margin);
  [[nodiscard]] std::span<const std::uint32_t> of(std::size_t chunk) const {
    QUOIN_ASSERT(chunk + 1 < begin_.size(), "a chunk of the frame");
    return {triangles_.data() + begin_[chunk], triangles_.data() + begin_[chunk + 1]};
  }

 private:
  std::vector<std::uint64_t> begin_;
  std::vector<std::uint32_t> triangles_;
};

/// The bits of a chunk's voxels: one word per row along x, y faster than z.
using ChunkBits = std::array<std::uint64_t, static_cast<std::size_t>(kChunkEdge) * kChunkEdge>;

inline std::size_t row_of(int y, int z) {
  QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
  return static_cast<std::size_t>(z) * kChunkEdge + static_cast<std::size_t>(y);
}

/// Returns the bits from `first` up to, but not including, `end`. Requires: 0 <= first < end <= 64.
inline std::uint64_t bits_between(int first, int end) {
  QUOIN_ASSERT(first >= 0 && first < end && end <= kChunkEdge, "0 <= first < end <= 64");
  return (~std::uint64_t{0} << static_cast<unsigned>(first)) & (~std::uint64_t{0} >> static_cast<unsigned>(64 - end));
}

inline constexpr std::int32_t kNoTriangle = -1;

/// The nearest triangle and its distance for each voxel centre of a chunk, x fastest. Reused by its thread.
struct Nearest {
  std::vector<float> squared;           ///< squared distances in voxels; `reach` squared without a triangle
  std::vector<std::int32_t> triangles;  ///< kNoTriangle if none is within reach
};

/// The centres to query.
struct Wanted {
  const ChunkBits* voxels = nullptr;  ///< null: all
  float reach = 0.0F;                 ///< triangles at this distance or beyond are ignored
};

/// Returns the nearest point of a triangle to a point, in barycentric coordinates.
///
/// Source: C. Ericson, "Real-Time Collision Detection" (2005), 5.1.5: the regions of the plane.
[[nodiscard]] DVec3 nearest_shares(const Corners& corners, DVec3 point);

/// Finds the nearest triangles. At ties the first wins.
///
/// `has_surface`: called if the nearest triangle may have holes; returns true if it has a surface there.
/// Space of `corners`: the frame.
/// Precision: single, relative to the chunk.
/// Cost: about 2 ns per triangle and voxel of its box, grown by the reach.
struct Holes {
  FunctionRef<bool(std::uint32_t triangle)> may_have_holes;
  FunctionRef<bool(std::uint32_t triangle, DVec3 shares)> has_surface;
};
void find_nearest(const Frame& frame, IVec3 chunk, std::span<const std::uint32_t> triangles, const Wanted& wanted,
                  const Holes& holes, Nearest& nearest);

}  // namespace quoin::voxelizing
