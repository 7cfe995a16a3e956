#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/grid/voxel_shape.h>
#include <quoin/mesh/quad.h>
#include <quoin/mesh/smooth_mesh.h>
#include <quoin/render/propagated_light.h>
#include <quoin/render/surface_light.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

enum class SurfaceStyle : std::uint8_t { Blocky, Smooth };

/// Part of a SceneGrid that a surface comes from.
enum class SurfaceContent : std::uint8_t {
  Voxels,  ///< its `grid`, blocky or smooth
  Field,   ///< its `field`; always smooth
};

/// The quads of one region of a chunk. Regions are cubes of LiveMeshOptions::region_edge voxels, aligned to their size.
struct SurfaceRegion {
  IVec3 region{0};  ///< the region starts at voxel `region` * region_edge of the chunk
  /// Ranges in the surface's quads: opaque quads that face Direction d are [opaque[d], opaque[d + 1]), transparent
  /// quads are [transparent[d], transparent[d + 1]). A renderer can skip directions that face away from the camera.
  std::array<std::uint32_t, 7> opaque{};
  std::array<std::uint32_t, 7> transparent{};
  std::uint64_t hash = 0;  ///< hash of the region's quads, faces of shapes, and light
};

/// The faces of shapes of one region: the opaque ones are [opaque[0], opaque[1]) of the surface's shapes, the
/// transparent ones [transparent[0], transparent[1]).
struct RegionShapes {
  std::array<std::uint32_t, 2> opaque{};
  std::array<std::uint32_t, 2> transparent{};
};

/// The renderable surface of one chunk. Immutable.
struct ChunkSurface {
  SurfaceStyle style = SurfaceStyle::Blocky;
  /// Level of detail of a field, 0 to kMaxSmoothLevel; its cells are 2^level samples wide.
  int level = 0;
  /// Blocky: voxels, origin at the chunk's minimum corner. Opaque quads come before transparent quads; each group is
  ///         sorted by region, then direction, layer, row, column. No quad crosses a region border.
  QuadBuffer quads;
  std::size_t opaque_quads = 0;
  BlockVector<FaceLight> light;        ///< one per quad if LiveMeshes uses light; otherwise empty
  BlockVector<SurfaceRegion> regions;  ///< blocky: regions with quads or shapes, sorted by z, then y, then x
  /// Blocky: visible faces of types with shapes, in the space of `quads`; see BlockyMesher::mesh. Faces of opaque
  ///         material come before those of transparent material; each group is sorted by region, then voxel (z, y, x),
  ///         then the order of the model. A face belongs to the region of its voxel, and may reach one voxel outside.
  ShapeFaceBuffer shapes;
  std::size_t opaque_shapes = 0;
  /// Light at the corners of each face of `shapes`, in the order of ModelFace::corners (SurfaceLight::read), if
  /// LiveMeshes uses light; otherwise empty.
  BlockVector<FaceLight> shape_light;
  BlockVector<RegionShapes> region_shapes;   ///< one per element of `regions` if there are shapes; otherwise empty
  BlockVector<VoxelShapes> shapes_of_types;  ///< keep the models of `shapes`, also after types have changed
  /// Smooth: mesh point p is grid point p + 64 * chunk; for voxels p + 0.5 + 64 * chunk, because samples are voxel
  ///         centres. Each vertex has a linear colour and a type. Each transparent type is a closed body of its own.
  ///         Thin voxel features are kept (SmoothMeshOptions::keep_thin), as in mesh_scene_smoothly. Instances are not
  ///         united.
  SmoothChunkMesh smooth;
  std::size_t glass_indices = 0;  ///< number of indices of transparent bodies, which come last
  BlockVector<LinearRgba16> albedo;
  BlockVector<VoxelType> types;
  /// Fields: the materials of each vertex, aligned (align_materials). Empty if none of them has textures.
  BlockVector<VertexMaterials> materials;
  /// Result of LiveMeshOptions::convert; null without `convert`.
  std::shared_ptr<const void> converted;
  std::size_t converted_bytes = 0;  ///< ConvertedSurface::bytes; 0: unknown

  [[nodiscard]] bool is_empty() const { return quads.empty() && smooth.indices.empty() && shapes.empty(); }
  [[nodiscard]] std::int64_t triangles() const;
  [[nodiscard]] std::size_t bytes() const;  ///< excludes `converted`
  /// Returns the size of the data that a renderer uploads: `converted_bytes` if known, otherwise `bytes`.
  [[nodiscard]] std::size_t upload_bytes() const { return converted_bytes != 0 ? converted_bytes : bytes(); }
};

/// A new surface of a chunk. It replaces the former one of the same grid, content and chunk. Draw it once for each
/// shown instance of the grid, at world_from_grid(instance, grid); its chunk starts at grid point 64 * `chunk`.
struct SurfaceUpdate {
  GridHandle grid;
  IVec3 chunk{0};
  std::shared_ptr<const ChunkSurface> surface;  ///< null: the chunk has no surface now; delete its buffers
  SurfaceContent content = SurfaceContent::Voxels;
  /// Bit mask of changed regions. Bit x + n (y + n z), with n = 64 / region_edge, is set if the quads of region
  /// (x, y, z) differ from the previous surface, are new or were removed. Smooth surfaces have one region.
  std::uint64_t changed_regions = ~std::uint64_t{0};
};

/// A material of a vertex and its share.
struct MaterialWeight {
  VoxelType type = kAir;
  float weight = 0.0F;  ///< above 0, at most 1

  bool operator==(const MaterialWeight&) const = default;
};

/// The content that the surface of a chunk was made from, at one moment: see LiveMeshOptions::convert.
///
/// Space:    positions are relative to the chunk: its first voxel or sample is (0, 0, 0). -64 to 127 on each axis reach
///           the 26 neighbours.
/// Followed: a chunk is meshed again if a voxel of it, or one of their 26 neighbours, changes its type or light, or its
///           data if the type has VoxelProperties::remesh_on_data; with types that have shapes, voxels and their states
///           up to kShapeReach away, and light up to 3 voxels away. Smooth surfaces and fields: if the densities or
///           materials that its mesh reads change. Content farther away can differ from the neighbours' surfaces.
/// Lifetime: valid only during the call that receives it, with all pointers in it. Do not keep copies.
/// Threads:  only the thread that receives it.
struct SurfaceContext {
  IVec3 chunk{0};
  const VoxelRegistry* types = nullptr;  ///< not null
  /// Surfaces of voxels: types (`get`) and data (`data`) of the chunk and its neighbours. All null for fields.
  Neighbourhood voxels;
  /// Smooth surfaces: the densities (`get`) and materials (`material`) that were meshed. All null for blocky surfaces.
  /// In smooth surfaces of voxels, a sample is the centre of the voxel with the same position.
  DensityNeighbourhood densities;
  std::array<std::uint8_t, 27> levels{};  ///< fields: levels of detail, by Neighbourhood::index
  /// Blocky surfaces, with LiveMeshes::use_light: the light that ChunkSurface::light contains. Otherwise null.
  const PropagatedLight* light = nullptr;
  SurfaceLight* corners = nullptr;  ///< reads `light` at the corners of faces; null without light

  /// Returns the light at a voxel, as PropagatedLight::at. Requires: `light` is not null.
  [[nodiscard]] LightLevels light_at(IVec3 local) const {
    QUOIN_ASSERT(light != nullptr, "a surface with light");
    return light->at(chunk * kChunkEdge + local);
  }
  /// Returns the light at the corners of a voxel's face, as SurfaceLight::face. Requires: `light` is not null.
  [[nodiscard]] FaceLight light_of_face(IVec3 local, Direction direction) const {
    QUOIN_ASSERT(corners != nullptr, "a surface with light");
    return corners->face(chunk * kChunkEdge + local, direction);
  }
  /// Replaces `out` with the materials around a vertex of a smooth surface and their shares: of the solid samples whose
  /// mean colour is `albedo`, if colours are blended. The greatest share comes first, of equal ones the lowest type.
  /// The sum is 1. Vertices of a transparent body have one material.
  /// Requires: a vertex of the surface of this context. Cost: O(samples of the vertex's cell next to the surface).
  void material_weights(const ChunkSurface& surface, std::size_t vertex, std::vector<MaterialWeight>& out) const;
};

}  // namespace quoin
