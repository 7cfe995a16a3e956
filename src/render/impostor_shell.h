#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/trace/occupancy_tree.h>

namespace quoin {

/// A face of a voxel.
struct VoxelFace {
  IVec3 voxel{0};
  Direction direction = Direction::PosX;
  bool operator==(const VoxelFace&) const = default;
};

/// The face beside another at the edge towards `sign` along `axis`: in the same plane, or around the edge.
template <class IsOccupied>
[[nodiscard]] VoxelFace face_beside(const VoxelFace& face, int axis, int sign, IsOccupied&& is_occupied) {
  IVec3 beside = face.voxel;
  beside[axis] += sign;
  const IVec3 front = beside + normal_of(face.direction);
  const auto towards = [&](int along) { return static_cast<Direction>(2 * axis + (along > 0 ? 0 : 1)); };
  if (is_occupied(front)) return {front, towards(-sign)};
  if (is_occupied(beside)) return {beside, face.direction};
  return {face.voxel, towards(sign)};
}

/// The faces between the voxels of a tree and what is not of them, as bits over the box around these voxels.
///
/// Memory: 0.5 bytes a voxel of the box.
class ImpostorShell {
 public:
  /// None where the box has more than `most_voxels`, or more than `most_faces` lie in it.
  static std::optional<ImpostorShell> build(const OccupancyTree& tree, std::int64_t most_voxels,
                                            std::int64_t most_faces);

  /// By direction, then by cell of 4^3 voxels.
  [[nodiscard]] std::vector<VoxelFace> faces() const;
  /// Its place in `faces`. Requires: it is one of them.
  [[nodiscard]] std::uint32_t index_of(const VoxelFace& face) const;
  /// Requires: `voxel` is at most one beside the box.
  [[nodiscard]] bool is_occupied(IVec3 voxel) const {
    const IVec3 local = voxel - origin_;
    return (cells_[cell_of(local)] >> bit_of(local) & 1U) != 0;
  }

 private:
  explicit ImpostorShell(const IBox& box);
  [[nodiscard]] std::size_t cell_of(IVec3 local) const {
    return static_cast<std::size_t>(((local.z >> 2) * size_.y + (local.y >> 2)) * size_.x + (local.x >> 2));
  }
  [[nodiscard]] static int bit_of(IVec3 local) { return (local.x & 3) + 4 * (local.y & 3) + 16 * (local.z & 3); }
  void copy_chunk(const OccupancyTree& tree, IVec3 chunk);
  // The voxels of a cell that have a face in that direction.
  [[nodiscard]] std::uint64_t exposed(Direction direction, std::size_t cell) const;
  [[nodiscard]] std::int64_t count_faces();

  IVec3 origin_{0};  // the voxel at the least corner, a multiple of 4
  IVec3 size_{0};    // cells; one empty cell around everything
  std::vector<std::uint64_t> cells_;
  std::array<std::vector<std::uint32_t>, 6> first_;  // by direction and cell: the place of its first face
};

}  // namespace quoin
