#pragma once

#include <cstdint>
#include <vector>

#include <quoin/trace/occupancy_tree.h>

#include "render_vk/device/memory.h"
#include "render_vk/trees/tree_packing.h"

namespace quoin::vulkan {

/// In the order in which grids list their chunks.
struct ByPlace {
  bool operator()(IVec3 a, IVec3 b) const { return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x; }
};

/// What lies above the chunks of a tree in device memory.
class DeviceTree {
 public:
  /// Writes the nodes that changed.
  [[nodiscard]] Status put(DeviceMemory& memory, std::vector<ChunkNodeAt> chunks);
  void release(DeviceMemory& memory);

  [[nodiscard]] bool empty() const { return top_.root.mask == 0; }
  [[nodiscard]] std::uint64_t bytes() const { return place_.size; }
  /// As shaders know it; `bounds` of what it holds, `origin` of its coordinates, in voxels.
  [[nodiscard]] ShaderTree shader_tree(const IBox& bounds, IVec3 origin) const;

 private:
  Place place_;
  TopTree top_;
};

}  // namespace quoin::vulkan
