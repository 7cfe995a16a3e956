#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/changes.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/chunk_surface.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>

#include "render/chunks/surface_source.h"
#include "render/vulkan/device/device_memory.h"
#include "render/vulkan/march/device_scene.h"
#include "scene/tracer/placed_grid.h"

namespace quoin::vulkan {

/// A face of a shape that may be glass, to be sorted for each image.
struct GlassShape {
  Vec3 centre{0.0F};  ///< in chunk coordinates, voxels
  Vec3 normal{0.0F};
  std::uint32_t number = 0;  ///< of the face
  VoxelType type = kAir;
  std::uint8_t look = 0;  ///< the face of the type that it shows; 6: glass of its own look
};

/// The faces of a chunk's shapes in device memory.
struct StoredShapes {
  std::uint64_t records = 0;  ///< address of the models' faces
  std::uint64_t faces = 0;    ///< address
  std::uint32_t count = 0;
  std::uint32_t opaque = 0;  ///< the first ones are of opaque material
  std::vector<GlassShape> glass;
  std::vector<std::shared_ptr<const DeviceTexels>> texels;  ///< of their own looks
};

/// The surface of a chunk in device memory.
struct StoredMesh {
  SurfaceStyle style = SurfaceStyle::Blocky;
  Place place;
  /// Blocky: start of each direction's opaque quads, and end of the last; transparent quads follow.
  std::array<std::uint32_t, 7> opaque{};
  bool is_by_direction = true;  ///< false: only the first and the last entry are valid
  /// Smooth: the number of indices, the number of transparent ones at their end, and their offset in `place`.
  std::uint32_t indices = 0;
  std::uint32_t glass_indices = 0;
  VkDeviceSize first_index = 0;
  std::uint32_t with_materials = 0;  ///< number of vertices that materials follow; 0: without materials
  std::vector<Quad> glass;           ///< the transparent quads, to be sorted for each image
  StoredShapes shapes;               ///< blocky
  /// The types of `glass` and of `shapes.glass`, each once.
  std::vector<VoxelType> glass_types;

  [[nodiscard]] std::int64_t triangles() const {
    return std::int64_t{2} * (std::int64_t{opaque.back()} + shapes.count) +
           2 * static_cast<std::int64_t>(glass.size()) + indices / 3;
  }
  /// Returns true if it has surfaces of transparent types.
  [[nodiscard]] bool has_glass() const { return !glass.empty() || glass_indices > 0 || shapes.count > shapes.opaque; }
};

/// Identifies meshes: of a grid's voxels, of its halved voxels at a level, or of its field.
struct MeshKey {
  GridHandle grid;
  int level = 0;
  SurfaceContent content = SurfaceContent::Voxels;
  bool operator<(const MeshKey& other) const {
    if (grid != other.grid) return grid < other.grid;
    return content != other.content ? content < other.content : level < other.level;
  }
};

/// Surfaces of chunks in device memory: 8 bytes per quad and face of a shape, and 112 per different face of the chunk's
/// models; or 28 per vertex and 4 per index. Vertices of textured fields have 12 bytes more.
class MeshStore {
 public:
  static constexpr std::size_t kVertexWords = 7;
  static constexpr std::size_t kMaterialWords = 3;  ///< per vertex, after all vertices

  struct ByPlace {
    bool operator()(IVec3 a, IVec3 b) const { return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x; }
  };
  struct StoredGrid {
    std::map<IVec3, StoredMesh, ByPlace> chunks;
    IVec3 low{0};  ///< of the chunk coordinates, once `bounds_known`
    IVec3 high{0};
    std::int64_t opaque_quads = 0;  ///< of all, once `bounds_known`
    std::uint64_t bytes = 0;        ///< of all, once `bounds_known`
    bool bounds_known = false;
  };

  /// Lifetime: `memory` and `known` must outlive it.
  MeshStore(DeviceMemory& memory, KnownTexels& known) : memory_(&memory), known_(&known) {}
  ~MeshStore();
  MeshStore(const MeshStore&) = delete;
  MeshStore& operator=(const MeshStore&) = delete;

  /// As VulkanMeshRenderer::put. `level`: the number of halvings of the surfaces' grids.
  [[nodiscard]] Status put(std::span<const SurfaceUpdate> surfaces, int level = 0);
  void drop(MeshKey key);
  void clear();

  /// Returns null if no mesh of the grid is stored. Computes its bounds if needed.
  [[nodiscard]] const StoredGrid* find(MeshKey key);

  [[nodiscard]] std::size_t chunks() const { return chunks_; }
  [[nodiscard]] std::int64_t triangles() const { return triangles_; }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] bool has_glass() const { return chunks_with_glass_ > 0; }
  /// As `has_glass`, for types that have glass (`is_glass`). Cost: O(chunks).
  template <class IsGlass>
  [[nodiscard]] bool has_glass(const IsGlass& is_glass) const {
    return std::ranges::any_of(grids_, [&](const auto& grid) {
      return std::ranges::any_of(grid.second.chunks, [&](const auto& chunk) {
        const StoredMesh& mesh = chunk.second;
        return mesh.glass_indices > 0 || std::ranges::any_of(mesh.glass_types, is_glass);
      });
    });
  }

 private:
  struct Change {
    MeshKey key;
    IVec3 chunk{0};
    StoredMesh mesh;  // of size 0: removed
  };

  Status put_all(std::span<const SurfaceUpdate> surfaces, int level, std::vector<Change>& changes);
  Status upload(const ChunkSurface& surface, StoredMesh& mesh);
  Status add_shapes(const ChunkSurface& surface, std::vector<std::uint32_t>& words, StoredMesh& mesh);
  Status finish(std::vector<Change>& changes);
  void replace(Change& change);
  void give_back(StoredMesh& mesh);

  DeviceMemory* memory_;
  KnownTexels* known_;
  std::map<MeshKey, StoredGrid> grids_;
  std::size_t chunks_ = 0;
  std::size_t chunks_with_glass_ = 0;
  std::int64_t triangles_ = 0;
  std::size_t bytes_ = 0;
};

/// The meshes of halved grids and halved fields. Created when an image first requests them, and kept. After edits only
/// the chunks that can have changed are rebuilt.
class LevelMeshes {
 public:
  /// Its meshes live in `store` and are destroyed with it.
  explicit LevelMeshes(MeshStore& store) : store_(&store) {}

  /// Drops the meshes of removed grids, and marks meshes for rebuilding that changed types may affect.
  void look_at(const Scene& scene);
  void clear();

  /// Begins an image.
  void begin() { ++image_; }
  /// Puts the meshes of a grid halved `key.level` times into the store, placed as `placed`. Called once per image.
  /// Errors: as MeshStore::put; also throws bad_alloc. The level is then empty.
  [[nodiscard]] Status put(MeshKey key, const PlacedGrid& placed, const VoxelRegistry& types, Threads threads);
  /// Drops the least recently used meshes not used by the last image, until at most `max_bytes` are held.
  void drop_unused(std::uint64_t max_bytes);

 private:
  struct Level {
    std::unique_ptr<GridSurfaces> surfaces;
    std::uint64_t last_use = 0;
  };
  Status put_updates(MeshKey key, Level& level, const PlacedGrid& placed, const VoxelRegistry& types, Threads threads);
  [[nodiscard]] SurfaceStyle style_of(MeshKey key);
  void drop(std::map<MeshKey, Level>::iterator level);

  MeshStore* store_;
  std::map<MeshKey, Level> levels_;
  ChangeCursor followed_types_;
  std::optional<VoxelRegistry> cubes_;  // the types without shapes; made when a level first needs it
  std::uint64_t image_ = 0;
};

}  // namespace quoin::vulkan
