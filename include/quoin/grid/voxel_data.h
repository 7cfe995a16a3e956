#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include <quoin/core/changes.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/vec.h>

namespace quoin {

class Grid;

/// Bytes that one voxel can hold.
inline constexpr std::size_t kMaxVoxelDataBytes = std::size_t{1} << 16;

/// What a voxel holds besides its type: how a stair is turned, how high water stands, what is in a chest.
///
///   world.set(at, stairs, {.state = 3});                    // type and data in one
///   world.set_data(at, {.state = world.data(at).state ^ 1});
///   world.set_data(chest, {.bytes = inventory});            // copied
///
/// A word for what many voxels have, whose bits the type declares (VoxelProperties::state_bits), and bytes for what
/// few have. Neither has a meaning to the engine; it is stored where it is not empty, and takes no types.
struct VoxelData {
  std::uint32_t state = 0;             ///< 0 is what a voxel has of which nothing was said
  std::span<const std::byte> bytes{};  ///< at most kMaxVoxelDataBytes. Lifetime: of a grid's until its next edit

  [[nodiscard]] bool empty() const { return state == 0 && bytes.empty(); }
  bool operator==(const VoxelData& other) const {
    return state == other.state && std::ranges::equal(bytes, other.bytes);
  }
};

/// Voxels of one chunk whose data changed, because it was set or because they became another type.
struct DataChange {
  IVec3 chunk{0};
  IBox box;  ///< around them, in the chunk's coordinates
};
using DataChanges = Changes<DataChange>;

/// What edits did to the data of single voxels: calls `visit` for every voxel whose data differs between two states of
/// a grid, chunks by z, y, x, in each the voxels by z, y, x. `before` is a snapshot of when the cursor was read
/// for the last time, `changes` what `now.data_changes_since` told since then; when all has changed, all of both is
/// compared.
///
/// Cost: O(voxels with data of the slabs, of 4x4 rows, in which some changed); what the two share costs nothing.
void visit_data_changes(const Grid& before, const Grid& now, const DataChanges& changes,
                        FunctionRef<void(IVec3 voxel, const VoxelData& before, const VoxelData& now)> visit);

}  // namespace quoin
