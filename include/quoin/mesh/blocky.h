#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/quad.h>
#include <quoin/mesh/visible_faces.h>

namespace [[gnu::visibility("default")]] quoin {

struct QuadOptions {
  bool merge = true;           ///< false: one quad per visible unit face
  bool bake_occlusion = true;  ///< false: occlusion is 0 everywhere and does not limit merging
  IBox region = kWholeChunk;   ///< voxels to mesh, in chunk coordinates; clipped to the chunk
};

/// Turns chunks into quads by greedy meshing. Holds about 1.5 MiB of scratch memory: keep one mesher per thread.
class BlockyMesher {
 public:
  BlockyMesher();
  BlockyMesher(BlockyMesher&&) noexcept;
  BlockyMesher& operator=(BlockyMesher&&) noexcept;
  ~BlockyMesher();

  /// Replaces `out` with the quads of the centre chunk's visible faces.
  ///
  /// Space:    voxels, origin at the chunk's minimum corner.
  /// Border:   reads one voxel past each side; the chunk that owns the voxel emits the face. A null centre chunk is air
  ///           and gives no quads.
  /// Lossless: exactly one quad of the right type covers each visible unit face of the region, and its interpolated
  ///           occlusion equals the face's own. Faces merge only if they have the same type and the same occlusion at
  ///           all four corners, and only along directions in which the occlusion is constant.
  /// Order:    direction, layer, row, column; the same bytes on every machine.
  /// Cost:     O(rows of 64 voxels + visible faces); no allocation once `out` has grown.
  void mesh(const Neighbourhood& chunks, const VoxelRegistry& types, const QuadOptions& options, QuadBuffer& out);

  /// Finds the visible faces of the centre chunk's voxels in `region` (chunk coordinates). Reads one voxel past the
  /// region.
  ///
  /// Cost: O(rows of 64 voxels); `out` is reused.
  void find_faces(const Neighbourhood& chunks, const VoxelRegistry& types, const IBox& region, FaceRows& out);

  /// Returns the number of visible unit faces of the centre chunk: as many as the quads of `mesh` cover.
  ///
  /// Cost: O(rows of 64 voxels), less than `find_faces`.
  [[nodiscard]] std::int64_t count_faces(const Neighbourhood& chunks, const VoxelRegistry& types);

 private:
  struct [[gnu::visibility("hidden")]] Scratch;
  std::unique_ptr<Scratch> scratch_;
};

/// Material class of a triangle, from its type's visibility and emission. Each class becomes a separate primitive in
/// mesh files.
enum class SurfaceClass : std::uint8_t { Opaque, Transparent, Emissive, EmissiveTransparent };
inline constexpr std::size_t kSurfaceClasses = 4;
/// Returns the class of the triangles of a type. Transparent: its visibility is Transparent; Air and Opaque count as
/// opaque. Emissive: its emission exceeds 0; NaN does not. Any properties are valid.
[[nodiscard]] SurfaceClass surface_class(const VoxelProperties& properties);

/// Triangles of one surface class. The vertex arrays have one entry per vertex; faces share no vertices.
struct BlockyTriangles {
  std::vector<Vec3> positions;          ///< grid coordinates, voxels
  std::vector<Direction> directions;    ///< normal of the face
  std::vector<std::uint8_t> occlusion;  ///< 0 (open) to 3 (dark)
  std::vector<VoxelType> types;
  std::vector<std::uint32_t> indices;  ///< three per triangle, counter-clockwise seen from outside
};

/// The mesh of a whole grid.
struct BlockyMesh {
  std::array<BlockyTriangles, kSurfaceClasses> surfaces;  ///< indexed by SurfaceClass
  std::int64_t faces_total = 0;                           ///< 6 x non-air voxels
  std::int64_t faces_visible = 0;
  std::int64_t quads = 0;

  [[nodiscard]] std::int64_t triangle_count() const;
  [[nodiscard]] std::int64_t vertex_count() const;
};

struct BlockyMeshOptions {
  bool merge = true;           ///< as QuadOptions::merge
  bool bake_occlusion = true;  ///< as QuadOptions::bake_occlusion
  bool watertight = false;     ///< subdivide outlines so that no vertex lies inside another triangle's edge
  /// Called with the quads of each chunk before they become triangles; may replace a quad with parts of it
  /// (`quad_part`). Optional. Called from several threads at once.
  std::function<void(IVec3 chunk, QuadBuffer& quads)> cut{};
};

/// Meshes a whole grid, chunk by chunk.
///
/// Space:    grid coordinates: voxel (i, j, k) spans i to i + 1 and so on. Coordinates beyond 2^24 lose precision; for
///           those, use BlockyMesher chunk by chunk.
/// Order:    chunks as in Grid::chunks; the same bytes at any thread count.
/// Progress: reported once per chunk while faces are found (first half) and once per chunk while they become triangles
///           (second half).
/// Types:    unregistered types count as opaque.
/// Errors:   Cancelled; LimitExceeded if a surface class needs more than about 2^32 vertices.
[[nodiscard]] Result<BlockyMesh> build_blocky_mesh(const Grid& grid, const VoxelRegistry& types,
                                                   const BlockyMeshOptions& options = {}, Threads threads = {},
                                                   const Progress& progress = {});

/// Appends the triangles of some chunks to `mesh`, and counts their faces and quads. build_blocky_mesh does it for all
/// chunks of a grid; this function meshes grids that do not fit in memory.
///
/// `quads`:  of each chunk, from BlockyMesher. `chunks`: their coordinates; vertices are relative to chunk 0's corner.
/// Errors:   LimitExceeded if a surface class needs more than about 2^32 vertices; `mesh` then has some of the chunks.
/// Requires: `quads` and `chunks` have one length.
[[nodiscard]] Status append_triangles(std::span<const QuadBuffer> quads, std::span<const IVec3> chunks,
                                      const VoxelRegistry& types, bool watertight, BlockyMesh& mesh);

/// Distance that vertices move apart where the surface would touch itself, in voxels.
inline constexpr float kSheetOffset = 0.01F;

/// Meshes all non-air voxels as one printable surface: closed, manifold and without T-junctions. After vertices of
/// equal position are welded, each edge has two triangles, one in each direction, and each vertex has a single fan of
/// triangles.
///
/// Space:    voxels. Vertices are as in build_blocky_mesh: one per face corner, with direction and type, without
///           occlusion. Faces are not merged: two triangles each.
/// Touching: where voxels meet only at an edge or a corner, the surface is separated. Each sheet gets its own vertices,
///           moved by kSheetOffset into its voxel (where two cavities meet, into the cavities), and the edge gets a
///           midpoint vertex per sheet. A face with five to eight outline vertices is triangulated around its centre.
/// Order:    as Grid::for_each, then by direction.
/// Cost:     about 0.2 microseconds per surface voxel, on one thread.
/// Errors:   LimitExceeded beyond 2^32 vertices or for voxel coordinates beyond 65,536; Cancelled.
[[nodiscard]] Result<BlockyTriangles> closed_surface(const Grid& grid, const Progress& progress = {});

}  // namespace quoin
