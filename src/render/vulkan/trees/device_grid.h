#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include <quoin/grid/grid.h>
#include <quoin/trace/density_ray.h>
#include <quoin/trace/occupancy_tree.h>

#include "render/vulkan/trees/shader_memory.h"
#include "render/vulkan/trees/tree_packing.h"
#include "scene/tracer/tree_cache.h"

namespace quoin::vulkan {

/// Compares chunks in the order of grids' chunk lists.
struct ByPlace {
  bool operator()(IVec3 a, IVec3 b) const { return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x; }
};

/// The nodes above the chunks of a tree in device memory.
class DeviceTree {
 public:
  /// Writes the changed nodes.
  [[nodiscard]] Status put(ShaderMemory& memory, std::vector<ChunkNodeAt> chunks);
  void release(ShaderMemory& memory);

  [[nodiscard]] bool empty() const { return top_.root.mask == 0; }
  [[nodiscard]] std::uint64_t bytes() const { return place_.size; }
  /// Returns the shader form; `bounds` of the content, `origin` of its coordinates, in voxels.
  [[nodiscard]] ShaderTree shader_tree(const IBox& bounds, IVec3 origin) const;

 private:
  Place place_;
  TopTree top_;
};

/// Finds the models of shapes in device memory.
class ShapeModels {
 public:
  virtual ~ShapeModels() = default;
  /// Returns a shape's type and model for lists of shapes. Errors: LimitExceeded if the memory is full.
  [[nodiscard]] virtual Result<ShaderShape> shape_of(const PlacedShape& shape) = 0;
};

/// One grid's voxels, shapes and field in device memory.
class DeviceGrid {
 public:
  /// The content of a grid for rays: its voxels' trees, the opaque and transparent parts of its field, and its shapes
  /// with their models. Null: none.
  struct Content {
    const Grid* voxels = nullptr;
    const OccupancyTree* opaque = nullptr;
    const OccupancyTree* transparent = nullptr;
    const DensityTree* field = nullptr;
    const DensityGlass* glass = nullptr;
    const TracedShapes* shapes = nullptr;
    ShapeModels* models = nullptr;
    const VoxelRegistry* turned_types = nullptr;  ///< the types, if the state turns cubes of any; see pack_chunk
  };

  /// Applies the edits since the last call, or loads another grid completely. Shaders may read it after the memory is
  /// flushed. After an error it must be released.
  ///
  /// Requires: the types' visibility is unchanged since the last call, and so are the shaped types.
  [[nodiscard]] Status update(ShaderMemory& memory, const Content& content);
  void release(ShaderMemory& memory);

  [[nodiscard]] IVec3 origin() const { return origin_ * kChunkEdge; }  ///< of the trees' coordinates, in the grid
  [[nodiscard]] bool has_transparent() const {
    return !transparent_.empty() || has_field_glass() || !shape_glass_.empty();
  }
  [[nodiscard]] bool has_shapes() const { return !shapes_.empty(); }
  /// Returns true if the grid has an opaque or transparent field part.
  [[nodiscard]] bool has_field() const { return !field_.empty() || has_field_glass(); }
  [[nodiscard]] bool has_field_glass() const { return !glass_.empty(); }
  /// Returns the shader form.
  [[nodiscard]] const ShaderGrid& shader_grid() const { return shader_grid_; }
  [[nodiscard]] const ShaderShapes& shader_shapes() const { return shader_shapes_; }
  /// Returns the device memory in use.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  struct DeviceChunk {
    Place place;
    Node opaque;
    Node transparent;
    Node field;
    Node glass;
    Node shapes;
  };
  using Chunks = std::map<IVec3, DeviceChunk, ByPlace>;

  Status update_voxels(ShaderMemory& memory, const Content& content, std::span<const IVec3> with_other_shapes);
  template <class PutChunk>
  static Status update_field(ShaderMemory& memory, const DensityGrid* field, Chunks& chunks, ChangeCursor& followed,
                             const PutChunk& put_chunk);
  [[nodiscard]] std::vector<IVec3> chunks_with_other_shapes(const TracedShapes* shapes) const;
  Status put_shapes(ShaderMemory& memory, const Content& content, IVec3 chunk);
  Status update_tops(ShaderMemory& memory, const Content& content);
  Status put_voxels(ShaderMemory& memory, const Content& content, IVec3 chunk);
  static Status put_part(ShaderMemory& memory, Chunks& chunks, IVec3 chunk, ChunkRecord record);
  static Status put_record(ShaderMemory& memory, DeviceChunk& entry, ChunkRecord record);
  static void drop(ShaderMemory& memory, Chunks& chunks, IVec3 chunk);
  static void drop_all(ShaderMemory& memory, Chunks& chunks);
  Status put_top(ShaderMemory& memory, DeviceTree& tree, const Chunks& chunks, Node DeviceChunk::*node) const;

  ChangeCursor followed_;
  ChangeCursor followed_data_;  // unused unless the state turns cubes
  ChangeCursor followed_field_;
  ChangeCursor followed_glass_;
  Chunks chunks_;
  Chunks field_chunks_;
  Chunks glass_chunks_;
  Chunks shape_chunks_;
  Chunks shape_glass_chunks_;
  std::map<IVec3, std::shared_ptr<const void>, ByPlace> sent_shapes_;  // ShapeIndex::content, by chunk
  IVec3 origin_{0};                                                    // in chunks
  DeviceTree opaque_;
  DeviceTree transparent_;
  DeviceTree field_;
  DeviceTree glass_;
  DeviceTree shapes_;
  DeviceTree shape_glass_;
  ShaderGrid shader_grid_;
  ShaderShapes shader_shapes_;
};

}  // namespace quoin::vulkan
