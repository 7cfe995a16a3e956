#pragma once

#include <cstdint>
#include <map>

#include <quoin/grid/grid.h>
#include <quoin/trace/occupancy_tree.h>

#include "render_vk/device/memory.h"
#include "render_vk/march/tree_packing.h"

namespace quoin::vulkan {

/// One grid's voxels in device memory.
class DeviceGrid {
 public:
  /// Takes over what was edited since the last time, and everything of another grid; shaders may read it once the
  /// memory is flushed. After an error it is to be released.
  ///
  /// `transparent` may be null. Requires: both are the grid's trees as it is; it is not empty; the types' visibility is
  /// that of the last time.
  [[nodiscard]] Status update(DeviceMemory& memory, const Grid& grid, const OccupancyTree& opaque,
                              const OccupancyTree* transparent);
  void release(DeviceMemory& memory);

  [[nodiscard]] IVec3 origin() const { return origin_ * kChunkEdge; }  ///< of the trees' coordinates, in the grid
  [[nodiscard]] bool has_transparent() const { return transparent_.top.root.mask != 0; }
  /// What shaders know it by.
  [[nodiscard]] const ShaderGrid& shader_grid() const { return shader_grid_; }
  /// Of device memory.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  struct ByPlace {
    bool operator()(IVec3 a, IVec3 b) const { return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x; }
  };
  struct DeviceChunk {
    Place place;
    Node opaque;
    Node transparent;
  };
  struct DeviceTree {
    Place place;
    TopTree top;
  };
  Status put_chunk(DeviceMemory& memory, const Grid& grid, const OccupancyTree& opaque,
                   const OccupancyTree* transparent, IVec3 chunk);
  Status put_top(DeviceMemory& memory, DeviceTree& tree, Node DeviceChunk::*node);

  ChangeCursor followed_;
  std::map<IVec3, DeviceChunk, ByPlace> chunks_;
  IVec3 origin_{0};  // in chunks
  DeviceTree opaque_;
  DeviceTree transparent_;
  ShaderGrid shader_grid_;
};

}  // namespace quoin::vulkan
