#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/memory.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/smooth.h>
#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

struct CellMaterial {
  LinearRgba16 albedo{};
  VoxelType type = kAir;
};

/// The surface material of cells: the materials of their solid samples.
class SurfaceMaterials {
 public:
  explicit SurfaceMaterials(const VoxelRegistry& types);

  /// Returns the material of a cell of the centre chunk or of a chunk before it. The cell starts at the sample `first`
  /// and is 2^level samples wide. Level 0: from its solid corners. Coarser levels: from the solid samples next to the
  /// surface along its crossed edges, since corners may be far below the surface; if none of its edges is crossed, from
  /// the solid samples of the coarsest lattice within the cell that has any. A cell of air gives air, white.
  [[nodiscard]] CellMaterial of_cell(const DensityNeighbourhood& chunks, IVec3 first, int level) const;
  /// As `of_cell`, for a vertex with this unit normal: textured materials have the colours of their textures there.
  /// Also sets `materials` if it is not null.
  [[nodiscard]] CellMaterial of_vertex(const DensityNeighbourhood& chunks, IVec3 first, int level, const Vec3& normal,
                                       VertexMaterials* materials) const;
  /// Returns the colour of a type; white if it is not registered.
  [[nodiscard]] LinearRgba16 albedo(VoxelType type) const;
  /// Returns the mean colour of materials on a surface with this unit normal.
  [[nodiscard]] LinearRgba16 albedo(const VertexMaterials& materials, const Vec3& normal) const;
  /// Returns true if any type has textures.
  [[nodiscard]] bool has_textures() const { return !textured_.empty(); }
  /// Returns true if any of the materials has textures.
  [[nodiscard]] bool has_textures(const VertexMaterials& materials) const;

 private:
  // The mean colours of a type's textures, by direction, in linear light.
  struct Textured {
    TriplanarRule rule;
    std::array<Vec3, 6> means{};
  };
  // The materials that of_cell blends, unsorted, in `solid`; or only one, of a uniform chunk.
  using Solid = std::array<VoxelType, 729>;  // as many as a cell can have: along three sides of 9
  [[nodiscard]] std::span<VoxelType> find_solid(const DensityNeighbourhood& chunks, IVec3 first, int level,
                                                Solid& solid) const;
  [[nodiscard]] CellMaterial blend(std::span<VoxelType> solid) const;
  [[nodiscard]] const Textured* textured(VoxelType type) const {
    return type < textured_of_.size() && textured_of_[type] != 0 ? &textured_[textured_of_[type] - 1] : nullptr;
  }

  std::vector<LinearRgba16> albedo_;        // by type
  std::vector<Textured> textured_;          // of types with textures
  std::vector<std::uint32_t> textured_of_;  // by type: index into `textured_` plus one, or 0; empty without textures
};

/// Returns materials with only one.
[[nodiscard]] constexpr VertexMaterials only_material(VoxelType type) {
  return {{type, kAir, kAir, kAir}, {255, 0, 0, 0}};
}

}  // namespace quoin

namespace quoin::smooth {

/// The voxel face that a triangle represents.
struct TriangleFace {
  IVec3 sample{0};  ///< the solid sample, in the field's coordinates; for coarse cells, a nearby one
  VoxelType type = kAir;
  Direction direction = Direction::PosX;  ///< from it into the air
};

/// Returns the blended materials of a chunk's vertices. A vertex of a cell before the chunk has the same material as
/// in that chunk's mesh.
/// `mixed`: if not null, gets the materials of each vertex too.
[[nodiscard]] BlockVector<CellMaterial> materials_of(const DensityNeighbourhood& chunks, const SmoothOptions& options,
                                                     const SurfaceMaterials& materials, const SmoothChunkMesh& mesh,
                                                     BlockVector<VertexMaterials>* mixed = nullptr);

/// Appends the materials of the samples that SurfaceMaterials::of_cell would blend for a vertex of an opaque body,
/// unsorted. `chunks` may contain transparent bodies too, whose samples count as air. `levels`: as
/// SmoothOptions::levels.
void append_opaque_materials(const DensityNeighbourhood& chunks, const VoxelRegistry& types,
                             const std::array<std::uint8_t, 27>& levels, SmoothCell name, std::vector<VoxelType>& out);

/// Returns the number of indices that are quads, six each, if all cells have one level. Each of the triangles after
/// them has a vertex in a bridge.
[[nodiscard]] std::size_t quad_indices_of(const SmoothChunkMesh& mesh);

/// Finds the faces of the triangles of a chunk's mesh, in the chunk's coordinates.
void find_faces(const DensityNeighbourhood& chunks, const SmoothOptions& options, const SurfaceMaterials& materials,
                const SmoothChunkMesh& mesh, std::vector<TriangleFace>& faces);

/// The attributes that distinguish the copies of a vertex, as far as requested.
struct FaceLook {
  VoxelType type = kAir;
  Direction direction = Direction::PosX;
  std::uint32_t group = 0;

  bool operator==(const FaceLook&) const = default;
};

/// Selects the face attributes that split a vertex shared by several triangles.
struct FaceDifferences {
  bool types = false;
  bool directions = false;
  std::span<const std::uint32_t> groups;  ///< by triangle; empty: all are one
};

/// A copy of a vertex, for triangles with the same materials.
struct AlignedVertex {
  std::uint32_t vertex = 0;
  VertexMaterials materials;
};

/// Copies vertices as quoin::align_materials does, and updates `indices`. Returns the copies. `materials`: by vertex.
BlockVector<AlignedVertex> align_materials(std::span<std::uint32_t> indices,
                                           std::span<const VertexMaterials> materials);

/// A copy of a vertex, for the triangles with equal attributes.
struct VertexCopy {
  std::uint32_t vertex = 0;
  FaceLook look;
};

/// Gives each of `vertices` vertices one copy per distinct look of its triangles' faces, and updates `indices`. Returns
/// the copies; copies of one vertex are adjacent, in the order in which triangles need them. Vertices without triangles
/// get no copy. `faces`: by triangle.
BlockVector<VertexCopy> split_by_faces(std::span<std::uint32_t> indices, std::size_t vertices,
                                       std::span<const TriangleFace> faces, const FaceDifferences& differences);

}  // namespace quoin::smooth
