#pragma once

#include <array>
#include <map>
#include <memory>
#include <vector>

#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>

#include "render_vk/memory.h"
#include "render_vk/tree_packing.h"
#include "scene/instance_tree.h"
#include "scene/kept_trees.h"

namespace quoin::vulkan {

/// An instance and what frames need to know of it.
struct DevicePlaced {
  PlacedGrid placed;      ///< its pointers mean nothing
  std::int32_t grid = 0;  ///< index into the device's grids
  IVec3 origin{0};        ///< of the tree's coordinates, in the grid
  DVec3 low{0.0};         ///< tight bounds of all voxels, in the tree's coordinates
  DVec3 high{0.0};
};

/// A scene's voxels in device memory, and its instances.
class DeviceScene {
 public:
  explicit DeviceScene(DeviceMemory& memory) : memory_(&memory) {}

  /// As VulkanRenderer::update. After an error it holds nothing.
  [[nodiscard]] Status update(const Scene& scene, bool hidden, Threads threads);

  [[nodiscard]] const std::vector<DevicePlaced>& placed() const { return placed_; }
  [[nodiscard]] const InstanceTree& instances() const { return instances_; }
  [[nodiscard]] bool has_transparent() const { return has_transparent_; }
  [[nodiscard]] std::uint64_t grids_address() const { return grids_place_.address; }
  [[nodiscard]] std::uint64_t surfaces_address() const { return surfaces_place_.address; }
  [[nodiscard]] std::uint32_t last_surface() const { return last_surface_; }

 private:
  struct ByPlace {
    bool operator()(IVec3 a, IVec3 b) const { return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x; }
  };
  struct DeviceChunk {
    std::uint64_t version = 0;
    Place place;
    Node opaque;
    Node transparent;
  };
  struct DeviceTree {
    Place place;
    TopTree top;
  };
  struct DeviceGrid {
    std::uint64_t identity = 0;
    std::uint64_t version = 0;
    KeptTrees trees;
    std::map<IVec3, DeviceChunk, ByPlace> chunks;
    IVec3 origin{0};  // in chunks
    DeviceTree opaque;
    DeviceTree transparent;
    std::int32_t index = 0;
  };

  void clear();
  void release(DeviceGrid& grid);
  void forget_old_types(const VoxelRegistry& types);
  void place(const Scene& scene, bool hidden);
  void update_trees(const Scene& scene, Threads threads);
  void finish_placed(const Scene& scene);
  Status try_update(const Scene& scene, bool hidden, Threads threads);
  Status update_grid(DeviceGrid& known, const Grid& grid);
  Status put_chunk(DeviceGrid& known, const Grid& grid, IVec3 chunk);
  Status put_top(DeviceGrid& known, DeviceTree& tree, Node DeviceChunk::*node);
  Status put_table(Place& place, std::span<const std::byte> bytes);
  Status put_surfaces(const VoxelRegistry& types);
  Status put_grids();

  DeviceMemory* memory_;
  std::map<GridHandle, DeviceGrid> grids_;
  std::vector<Visibility> visibility_;
  std::vector<DevicePlaced> placed_;
  InstanceTree instances_;
  bool has_transparent_ = false;
  Place grids_place_;
  std::vector<ShaderGrid> grid_table_;
  Place surfaces_place_;
  std::vector<Vec4> surface_table_;
  std::uint32_t last_surface_ = 0;
};

}  // namespace quoin::vulkan
