#include "render/shell/shell.h"

#include <bit>
#include <cstddef>

#include <quoin/core/assert.h>

#include "trace/tree_view.h"

namespace quoin {
namespace {

constexpr int kCellsAChunk = 16;
constexpr int kCellsABrick = 4;

// Returns the number of cells along each axis that touch the box or adjoin such a cell.
IVec3 cells_around(const IBox& box) {
  return ((box.max - 1) >> 2) - (box.min >> 2) + 3;
}

}  // namespace

bool comes_before(const VoxelFace& a, const VoxelFace& b) {
  if (a.direction != b.direction) return a.direction < b.direction;
  for (int axis = 2; axis >= 0; --axis) {
    const int cell_a = a.voxel[axis] >> 2;
    const int cell_b = b.voxel[axis] >> 2;
    if (cell_a != cell_b) return cell_a < cell_b;
  }
  for (int axis = 2; axis >= 0; --axis) {
    if (a.voxel[axis] != b.voxel[axis]) return a.voxel[axis] < b.voxel[axis];
  }
  return false;
}

std::uint64_t exposed_bits(std::uint64_t own, std::uint64_t next, Direction direction) {
  std::uint64_t neighbours = 0;
  switch (direction) {
    case Direction::PosX:
      neighbours = (own >> 1 & 0x7777'7777'7777'7777U) | (next << 3 & 0x8888'8888'8888'8888U);
      break;
    case Direction::NegX:
      neighbours = (own << 1 & 0xEEEE'EEEE'EEEE'EEEEU) | (next >> 3 & 0x1111'1111'1111'1111U);
      break;
    case Direction::PosY:
      neighbours = (own >> 4 & 0x0FFF'0FFF'0FFF'0FFFU) | (next << 12 & 0xF000'F000'F000'F000U);
      break;
    case Direction::NegY:
      neighbours = (own << 4 & 0xFFF0'FFF0'FFF0'FFF0U) | (next >> 12 & 0x000F'000F'000F'000FU);
      break;
    case Direction::PosZ:
      neighbours = own >> 16 | next << 48;
      break;
    case Direction::NegZ:
      neighbours = own << 16 | next >> 48;
      break;
  }
  return own & ~neighbours;
}

ImpostorShell::ImpostorShell(const IBox& box) : origin_(((box.min >> 2) - 1) * 4), size_(cells_around(box)) {
  cells_.resize(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y) *
                static_cast<std::size_t>(size_.z));
}

std::optional<ImpostorShell> ImpostorShell::build(const OccupancyTree& tree, std::int64_t max_voxels,
                                                  std::int64_t max_faces) {
  const IBox box = tree.bounds();
  const IVec3 size = cells_around(box);
  std::int64_t max_cells = max_voxels / 64;
  for (int axis = 0; axis < 3; ++axis) max_cells /= size[axis];
  if (max_cells == 0) return std::nullopt;
  ImpostorShell shell(box);
  const IVec3 low = box.min >> 6;
  const IVec3 high = (box.max - 1) >> 6;
  for (int z = low.z; z <= high.z; ++z) {
    for (int y = low.y; y <= high.y; ++y) {
      for (int x = low.x; x <= high.x; ++x) shell.copy_chunk(tree, {x, y, z});
    }
  }
  if (shell.count_faces() > max_faces) return std::nullopt;
  return shell;
}

void ImpostorShell::copy_chunk(const OccupancyTree& tree, IVec3 chunk) {
  const trace::TreeNodes nodes(tree);
  const trace::ChunkNode* node = nodes.find_chunk(chunk);
  if (node == nullptr) return;
  const IVec3 first = chunk * kCellsAChunk - (origin_ >> 2);
  for (int brick = 0; brick < 64; ++brick) {
    const trace::BrickCode at = node->bricks[static_cast<std::size_t>(brick)];
    if (at == trace::kEmptyBrick) continue;
    const trace::BrickWords words = nodes.brick(at);
    const IVec3 corner = first + IVec3{brick & 3, brick >> 2 & 3, brick >> 4} * kCellsABrick;
    for (int word = 0; word < 64; ++word) {
      const std::uint64_t bits = words[static_cast<std::size_t>(word)];
      if (bits == 0) continue;  // may lie outside the box
      const IVec3 cell = corner + IVec3{word & 3, word >> 2 & 3, word >> 4};
      QUOIN_ASSERT((IBox{IVec3{0}, size_}.contains(cell)), "voxels within the tree's bounds");
      cells_[cell_of(cell * 4)] = bits;
    }
  }
}

std::uint64_t ImpostorShell::exposed(Direction direction, std::size_t cell) const {
  const IVec3 towards = normal_of(direction);
  const std::ptrdiff_t step = (std::ptrdiff_t{towards.z} * size_.y + towards.y) * size_.x + towards.x;
  const auto next = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(cell) + step);
  QUOIN_ASSERT(cell < cells_.size() && next < cells_.size(), "a cell within the margin");
  return exposed_bits(cells_[cell], cells_[next], direction);
}

std::int64_t ImpostorShell::count_faces() const {
  std::int64_t count = 0;
  for (std::size_t cell = 0; cell < cells_.size(); ++cell) {
    if (cells_[cell] == 0) continue;
    for (const Direction direction : kDirections) count += std::popcount(exposed(direction, cell));
  }
  return count;
}

std::vector<VoxelFace> ImpostorShell::faces() const {
  std::vector<VoxelFace> all;
  const auto count = static_cast<std::size_t>(count_faces());
  all.reserve(count);
  for (const Direction direction : kDirections) {
    std::size_t cell = 0;
    for (int z = 0; z < size_.z; ++z) {
      for (int y = 0; y < size_.y; ++y) {
        for (int x = 0; x < size_.x; ++x, ++cell) {
          if (cells_[cell] == 0) continue;
          const IVec3 corner = origin_ + IVec3{x, y, z} * 4;
          for (std::uint64_t left = exposed(direction, cell); left != 0; left &= left - 1) {
            const int bit = std::countr_zero(left);
            all.push_back({corner + IVec3{bit & 3, bit >> 2 & 3, bit >> 4}, direction});
          }
        }
      }
    }
  }
  QUOIN_ASSERT(all.size() == count, "the counted faces");
  return all;
}

}  // namespace quoin
