#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/ref.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/chunk.h>

#include "grid/chunk/chunk_storage.h"

namespace quoin {

/// The data of a slab's voxels.
///
///   stateful [z % 4][y % 4]   bit x: that voxel's state is not 0
///   states                    of these voxels, in that order, x ascending
///   bytes                     of voxels with bytes, by position: (row in the slab) * 64 + x
class SlabData : public RefCounted {
 public:
  [[nodiscard]] bool empty() const { return states_.empty() && bytes_.empty(); }
  /// Returns the voxels of a row that have a state, bytes, or either.
  [[nodiscard]] std::uint64_t voxels(int row) const;
  [[nodiscard]] VoxelData get(int row, int x) const;
  [[nodiscard]] RowStates states(int row) const;
  /// Sets the data of a voxel. Requires: the data is not empty. If it throws, nothing has changed.
  void put(int row, int x, const VoxelData& data);
  /// Removes the data of the row's voxels in `mask`.
  void clear(int row, std::uint64_t mask);
  [[nodiscard]] std::size_t allocated() const;

 private:
  struct Bytes : RefCounted {
    std::vector<std::byte> all;
  };
  struct Placed {
    std::uint32_t place = 0;
    Ref<Bytes> bytes;
  };
  static std::uint32_t place_of(int row, int x) { return static_cast<std::uint32_t>(row * kChunkEdge + x); }
  [[nodiscard]] std::size_t rank(int row, int x) const;
  [[nodiscard]] std::size_t first_from(std::uint32_t place) const;
  void put_state(int row, int x, std::uint32_t state);
  void put_bytes(int row, int x, Ref<Bytes> bytes);

  std::array<std::uint64_t, kSlabRows> stateful_{};
  std::vector<std::uint32_t> states_;
  std::vector<Placed> bytes_;
};

/// The data of a chunk's voxels, by slabs. A copy shares them until one is written.
class ChunkData : public RefCounted {
 public:
  /// Returns the number of voxels with data.
  [[nodiscard]] int count() const { return count_; }
  /// Returns the data of a slab; null if no voxel of it has any.
  [[nodiscard]] const SlabData* slab(std::size_t index) const {
    QUOIN_ASSERT(index < slabs_.size(), "a slab of the chunk");
    return slabs_[index].get();
  }
  [[nodiscard]] std::uint64_t voxels(int y, int z) const {
    const SlabData* const slab = slabs_[ChunkStorage::slab_index(y, z)].get();
    return slab == nullptr ? 0 : slab->voxels(ChunkStorage::row_in_slab(y, z));
  }
  [[nodiscard]] VoxelData get(int x, int y, int z) const {
    const SlabData* const slab = slabs_[ChunkStorage::slab_index(y, z)].get();
    return slab == nullptr ? VoxelData{} : slab->get(ChunkStorage::row_in_slab(y, z), x);
  }
  /// Sets a slab's data. Requires: it is not empty.
  void put(int x, int y, int z, const VoxelData& data);
  void clear(int y, int z, std::uint64_t mask);
  [[nodiscard]] bool operator==(const ChunkData& other) const;
  [[nodiscard]] std::size_t allocated() const;

  /// Returns the data of a chunk; null if no voxel has any.
  [[nodiscard]] static const ChunkData* of(const Chunk& chunk) { return chunk.data_.get(); }

 private:
  std::array<Ref<SlabData>, 256> slabs_;  // indexed as ChunkStorage::slabs
  int count_ = 0;
};

/// Chunk::data_count, inline, for callers where the call would dominate the cost.
[[nodiscard]] inline int data_count(const Chunk& chunk) {
  const ChunkData* const data = ChunkData::of(chunk);
  return data == nullptr ? 0 : data->count();
}

/// Calls `visit(local voxel, data before, data after)` for the voxels whose data differs between two states of a chunk,
/// by z, y, x; null means a chunk of air.
void visit_other_data(const Chunk* before, const Chunk* after,
                      FunctionRef<void(IVec3 local, const VoxelData& before, const VoxelData& after)> visit);

}  // namespace quoin
