#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
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

}  // namespace quoin::voxelizing
