#pragma once

#include <memory>
#include <span>

#include <quoin/core/assert.h>
#include <quoin/core/axis_orientation.h>
#include <quoin/grid/chunk.h>

namespace quoin {

/// The voxels of one chunk in a plain array, copied from chunks in another orientation.
///
///   types()[(z * 64 + y) * 64 + x]    x, y, z in the chunk
///
/// A row of a chunk lies along the block's x, y or z. Along x it is copied, forwards or backwards. Otherwise a
/// plane's rows are read one below the other, and the block's rows are its columns.
class TurnedBlock {
 public:
  // Not initialised: every voxel is written before it is read.
  TurnedBlock() : types_(new VoxelType[kChunkVoxels]) {}

  /// Starts a box that, once turned, fills `part` of the chunk.
  void begin(AxisOrientation orientation, const IBox& part);
  /// Sets the whole chunk to air.
  void clear();
  /// Puts the voxels of a part of a chunk (null: air) at their turned positions. `offset`: the part's least corner in
  /// the box, before it is turned.
  void put(const Chunk* chunk, const IBox& part, IVec3 offset);

  /// Replaces the type of each put voxel by `change(type)`.
  template <class Change>
  void change_types(Change&& change) {
    for (int z = part_.min.z; z < part_.max.z; ++z) {
      for (int y = part_.min.y; y < part_.max.y; ++y) {
        VoxelType* row = types_.get() + (z * kChunkEdge + y) * kChunkEdge;
        for (int x = part_.min.x; x < part_.max.x; ++x) row[x] = change(row[x]);
      }
    }
  }
  /// Returns the types of the chunk. Positions that were neither put nor cleared are undefined.
  [[nodiscard]] std::span<const VoxelType, kChunkVoxels> types() const {
    return std::span<const VoxelType, kChunkVoxels>(types_.get(), kChunkVoxels);
  }
  [[nodiscard]] const VoxelType* at(int x, int y, int z) const {
    QUOIN_ASSERT((x | y | z) >= 0 && (x | y | z) < kChunkEdge, "0 <= x, y, z < 64");
    return types_.get() + (z * kChunkEdge + y) * kChunkEdge + x;
  }

 private:
  [[nodiscard]] VoxelType* place(IVec3 in_box) const;
  void put_rows(const Chunk& chunk, const IBox& part, IVec3 offset);
  void put_columns(const Chunk& chunk, const IBox& part, IVec3 offset);
  void fill(VoxelType type, IVec3 offset, IVec3 size);

  AxisOrientation orientation_;
  IBox part_;         // part of the chunk that the turned box fills
  int first_ = 0;     // index of the box's lowest voxel
  IVec3 strides_{0};  // from a voxel to the next along each of the box's axes
  std::unique_ptr<VoxelType[]> types_;
};

}  // namespace quoin
