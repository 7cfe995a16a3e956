#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>

#include "render/impostor/raster/impostor_faces.h"
#include "render/light/lamp_table.h"
#include "render/light/surface/light_bricks.h"
#include "render/vulkan/trees/device_grid.h"
#include "scene/surfaces.h"
#include "scene/tracer/instance_tree.h"
#include "scene/tracer/placed_grid.h"
#include "scene/tracer/tree_cache.h"

namespace quoin::vulkan {

/// An instance and its data for frames.
struct DevicePlaced {
  PlacedGrid placed;      ///< only `voxels` of a halved grid is a valid pointer, until the next image
  std::int32_t grid = 0;  ///< index into the device's grids
  IVec3 origin{0};        ///< of the tree's coordinates, in the grid
  DVec3 low{0.0};         ///< tight bounds of all voxels and the field, in the tree's coordinates
  DVec3 high{0.0};
  bool is_far = false;                      ///< drawn from its impostor: camera rays skip it
  const ImpostorFaces* impostor = nullptr;  ///< its impostor, valid until the next image
  std::size_t impostor_level = 0;           ///< the finest level drawn
};

/// Returns an instance's position among those from `begin` on, sorted by handle, or the next position if it is missing.
template <class Iterator>
[[nodiscard]] Iterator find_placed(Iterator begin, Iterator end, InstanceHandle instance) {
  return std::lower_bound(begin, end, instance, [](const DevicePlaced& each, InstanceHandle handle) {
    return each.placed.instance < handle;
  });
}

/// The content that rays traverse: instances, and the table of their grids.
struct Placement {
  std::vector<DevicePlaced> placed;  ///< in the order of their handles
  InstanceTree instances;            ///< their boxes in the world
  std::uint64_t grids = 0;           ///< the table's address
  bool has_transparent = false;
  bool has_fields = false;
  bool has_field_glass = false;  ///< any field has a transparent part
  bool has_shapes = false;
  std::vector<ShaderFar> far;  ///< visible faces of impostors, in the order of the instances
};
/// Writes a table to its place, or to a larger place.
[[nodiscard]] Status put_table(ShaderMemory& memory, Place& place, std::span<const std::byte> bytes);
[[nodiscard]] bool is_same(const std::vector<ShaderGrid>& a, const std::vector<ShaderGrid>& b);

/// Appends a type's surface in shader form: three vectors; the last number is `last`.
void add_surface(const Surface& surface, float last, std::vector<Vec4>& table);
/// Returns the surfaces of all types in the form of shaders/data.glsl: three vectors each; the last entry is for types
/// out of range. Requires: a frame with it has kUnoccluding if any of the types does not occlude, or has shapes.
[[nodiscard]] std::vector<Vec4> surface_table(const VoxelRegistry& types);
/// Returns `shape_means` of shaders/data.glsl for all types; the last two vectors are for types out of range.
[[nodiscard]] std::vector<Vec4> shape_means(const VoxelRegistry& types);

/// The texels of a texture in device memory, of all mipmap levels.
class DeviceTexels {
 public:
  explicit DeviceTexels(ShaderMemory& memory, Texture texture) : memory_(&memory), texture_(std::move(texture)) {}
  ~DeviceTexels() { memory_->release(place_); }
  DeviceTexels(const DeviceTexels&) = delete;
  DeviceTexels& operator=(const DeviceTexels&) = delete;

  /// Queues the texels for the next `flush`. Called once. Errors: LimitExceeded if the memory is full.
  [[nodiscard]] Status send();
  [[nodiscard]] std::uint64_t address() const { return place_.address; }

 private:
  ShaderMemory* memory_;
  Texture texture_;  // keeps the texels, whose address identifies them
  Place place_;
};

/// Finds textures in device memory, so that a renderer and its mesh renderers hold each texture once.
using KnownTexels = std::map<const Rgba8*, std::weak_ptr<const DeviceTexels>>;
/// Returns the address of a texture's texels, and adds them to `used`. Queues them for the next `flush` unless they are
/// known. Errors: as DeviceTexels::send.
[[nodiscard]] Result<std::uint64_t> send_texels(ShaderMemory& memory, KnownTexels& all, const Texture& texture,
                                                std::vector<std::shared_ptr<const DeviceTexels>>& used);

/// Returns the size and axes of a face's texels, as in TexturedFace (data.glsl).
[[nodiscard]] std::uint32_t axes_of(const FaceTexels& face);

/// The textures of types' faces in device memory: texels, and a table of faces. Shaders follow the addresses of texels,
/// so there are no limits of layers, sizes or numbers, except the memory.
class DeviceTextures {
 public:
  /// Lifetime: `memory` and `known` must outlive it.
  DeviceTextures(ShaderMemory& memory, KnownTexels& known) : memory_(&memory), known_(&known) {}
  ~DeviceTextures() { clear(); }
  DeviceTextures(const DeviceTextures&) = delete;
  DeviceTextures& operator=(const DeviceTextures&) = delete;

  /// Sends the changes since the last call. After an error it is empty and sends everything at the next call.
  /// Cost: O(types), if any type changed.
  [[nodiscard]] Status put(const VoxelRegistry& types);

  /// Returns true if no type has textures. Images then need no shaders for textures.
  [[nodiscard]] bool empty() const { return texels_.empty(); }
  /// Returns true if transparent types without shapes have textures. Images of them need shaders for such voxels.
  [[nodiscard]] bool has_cells() const { return has_cells_; }
  /// Sets the addresses of a frame. Requires: the frame's types are those of the last `put`.
  void put_in(ShaderFrame& frame) const;

 private:
  void clear();
  Status try_put(const VoxelRegistry& types);

  ShaderMemory* memory_;
  KnownTexels* known_;
  ChangeCursor followed_;
  std::vector<std::shared_ptr<const DeviceTexels>> texels_;
  Place numbers_;
  Place faces_;
  bool has_cells_ = false;
};

/// The models of shapes in device memory: boxes, free sides, and the looks of all sides with their texels. A model is
/// sent once per type that uses it, and stays until `clear`.
class DeviceShapes final : public ShapeModels {
 public:
  /// Lifetime: `memory` and `known` must outlive it.
  DeviceShapes(ShaderMemory& memory, KnownTexels& known) : memory_(&memory), known_(&known) {}
  ~DeviceShapes() override { clear(); }
  DeviceShapes(const DeviceShapes&) = delete;
  DeviceShapes& operator=(const DeviceShapes&) = delete;

  /// Sets the types of the shapes to come. Lifetime: `types` must outlive the calls of `shape_of`.
  /// Requires: the shaped types are those of the last call; else call `clear`.
  void use(const VoxelRegistry& types) { types_ = &types; }
  [[nodiscard]] Result<ShaderShape> shape_of(const PlacedShape& shape) override;
  /// Returns the index of a side of a model in the table of vectors. `owner`: the shapes of the type, which have the
  /// model. Errors: as `shape_of`.
  [[nodiscard]] Result<std::uint32_t> side_of(const ShapeModel& model, VoxelType type, const VoxelShapes& owner,
                                              std::size_t face);
  /// Sends the models since the last call, with everything that is queued. If the memory is full, the models that were
  /// sent before stay at their address.
  [[nodiscard]] Status send();
  void clear();
  /// Returns the address of the table of vectors.
  [[nodiscard]] std::uint64_t address() const { return place_.address; }

 private:
  struct KnownModel {
    std::uint32_t first = 0;  // of its vectors
    VoxelShapes owner;        // keeps the model, whose address identifies it
  };
  [[nodiscard]] Result<std::uint32_t> index_of(const ShapeModel& model, VoxelType type, const VoxelShapes& owner);
  [[nodiscard]] Result<std::uint32_t> add(const ShapeModel& model, const VoxelProperties& type);
  void add_boxes(const ShapeModel& model);
  Status add_side(const ModelFace& face, const ShapeModel& model, const VoxelProperties& type);

  ShaderMemory* memory_;
  KnownTexels* known_;
  const VoxelRegistry* types_ = nullptr;
  std::map<std::pair<const ShapeModel*, VoxelType>, KnownModel> models_;
  std::vector<Vec4> vectors_;
  std::size_t sent_ = 0;  // vectors
  Place place_;
  std::vector<std::shared_ptr<const DeviceTexels>> texels_;
};

/// A table of lamps, its bricks and lists in device memory.
struct DeviceLamps {
  std::shared_ptr<const LampTable> table;  ///< null: no lamps
  Place bricks;
  Place lists;

  /// After an error it is empty.
  [[nodiscard]] Status put(ShaderMemory& memory, std::shared_ptr<const LampTable> now);
};

/// Light levels around surfaces in device memory.
struct DeviceLevels {
  const LightBricks* table = nullptr;  ///< null: images use another light model
  Place bricks;
  Place numbers;

  /// Sends the changes since the last call. After an error it is empty and sends everything at the next call.
  [[nodiscard]] Status put(ShaderMemory& memory, LightBricks& now);

 private:
  [[nodiscard]] Status put_changes(ShaderMemory& memory, const LightBricks& now, const LightBricks::Changed& changed);
};

/// The lookup data for the light of an image.
struct DeviceLight {
  DeviceLamps lamps;
  DeviceLevels levels;
};

/// Returns true if any type that has or had shapes has changed: DeviceShapes must then be cleared.
[[nodiscard]] bool has_other_shaped_types(const TypeChanges& changes, const VoxelRegistry& types);

/// A scene's voxels in device memory, and its instances.
class DeviceScene {
 public:
  /// Makes a scene whose voxels with shapes are cubes.
  explicit DeviceScene(ShaderMemory& memory) : memory_(&memory) {}
  /// Makes a scene with shapes. Lifetime: `texels` must outlive it.
  DeviceScene(ShaderMemory& memory, KnownTexels& texels)
      : memory_(&memory), shapes_(std::make_unique<DeviceShapes>(memory, texels)) {}

  /// As VulkanRenderer::update. After an error it is empty.
  [[nodiscard]] Status update(const Scene& scene, InstanceFilter filter, Threads threads);
  /// Removes the scene.
  void clear();

  [[nodiscard]] const Placement& placement() const { return placement_; }
  /// Returns the lamps of the last update's scene. Requires: the scene has not been edited since.
  [[nodiscard]] std::vector<LampPlace> lamp_places(const Scene& scene) const;
  [[nodiscard]] const std::vector<ShaderGrid>& grid_table() const { return grid_table_; }
  [[nodiscard]] std::uint64_t surfaces_address() const { return surfaces_place_.address; }
  [[nodiscard]] std::uint32_t last_surface() const { return last_surface_; }
  /// Returns the models of shapes. Requires: it was made with `texels`.
  [[nodiscard]] DeviceShapes& shapes() { return *shapes_; }
  /// Sets the addresses of the shapes in a frame.
  void put_shapes_in(ShaderFrame& frame) const;
  /// Returns true if some opaque types do not darken corners.
  [[nodiscard]] bool has_unoccluding() const { return has_unoccluding_; }

 private:
  struct KnownGrid {
    explicit KnownGrid(ShapedVoxels shaped) : trees(shaped) {}

    IBox bounds;  // of the content, and of voxels that shapes may reach
    DVec3 pivot{0.0};
    bool is_used = false;  // by an instance
    TreeCache trees;
    DeviceGrid voxels;
    std::int32_t index = 0;
  };

  void place(const Scene& scene, InstanceFilter filter);
  [[nodiscard]] std::vector<GridHandle> changed_grids(const Scene& scene, InstanceFilter filter, bool& places);
  Status update_grids(const Scene& scene, const std::vector<GridHandle>& changed, Threads threads);
  void finish_placed(const Scene& scene);
  Status try_update(const Scene& scene, InstanceFilter filter, Threads threads);
  Status put_surfaces(const VoxelRegistry& types);
  Status put_grids();
  Status put_shape_table();
  [[nodiscard]] IBox bounds_of(const SceneGrid& grid) const;

  ShaderMemory* memory_;
  std::unique_ptr<DeviceShapes> shapes_;  // null: shaped voxels are cubes
  int shape_reach_ = 0;                   // how far shapes reach outside their voxels, in voxels, rounded up
  std::map<GridHandle, KnownGrid> grids_;
  ChangeCursor followed_types_;
  ChangeCursor followed_visibility_;
  ChangeCursor followed_scene_;
  InstanceFilter filter_ = InstanceFilter::Visible;
  Placement placement_;
  Place grids_place_;
  std::vector<ShaderGrid> grid_table_;
  Place shapes_place_;
  std::vector<ShaderShapes> shape_table_;  // empty without shapes
  Place surfaces_place_;
  std::vector<Vec4> surface_table_;
  Place means_place_;  // of shapes
  std::vector<Vec4> mean_table_;
  std::uint32_t last_surface_ = 0;
  bool has_unoccluding_ = false;
};

}  // namespace quoin::vulkan
