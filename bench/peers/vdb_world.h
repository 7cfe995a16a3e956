#pragma once

#include <cstdint>

#include <openvdb/openvdb.h>

#include <tbb/global_control.h>

#include <quoin/grid/grid.h>

namespace quoin::peers {

/// One byte per voxel, its type, in OpenVDB's default tree.
using ByteTree = openvdb::tree::Tree4<std::uint8_t, 5, 4, 3>::Type;
using ByteGrid = openvdb::Grid<ByteTree>;

/// Limits OpenVDB's and NanoVDB's parallel loops to one thread during its lifetime.
class OneThread {
 private:
  tbb::global_control limit_{tbb::global_control::max_allowed_parallelism, 1};
};

/// Converts every voxel that is not air to an active value, and uniform regions to tiles.
template <class VdbGrid>
typename VdbGrid::Ptr vdb_from_grid(const Grid& grid) {
  openvdb::initialize();
  auto made = VdbGrid::create(typename VdbGrid::ValueType(0));
  auto writer = made->getAccessor();
  using Value = typename VdbGrid::ValueType;
  grid.for_each([&](IVec3 v, VoxelType type) { writer.setValueOn({v.x, v.y, v.z}, static_cast<Value>(type)); });
  made->pruneGrid();
  return made;
}

}  // namespace quoin::peers
