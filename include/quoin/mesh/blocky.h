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

/// The use of voxels whose types have shapes.
enum class ShapeUse : std::uint8_t {
  /// They have no quads, and their faces are in a ShapeFaceBuffer. Faces of cubes that they cover are left out, and
  /// their content darkens corners (ShapeModel::filled_octants).
  Faces,
  /// They are cubes of transparent types, for renderers that do not draw shapes.
  Cubes,
};

struct QuadOptions {
  bool merge = true;           ///< false: one quad per visible unit face
  bool bake_occlusion = true;  ///< false: occlusion is 0 everywhere and does not limit merging
  IBox region = kWholeChunk;   ///< voxels to mesh, in chunk coordinates; clipped to the chunk
  ShapeUse shapes = ShapeUse::Faces;
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
  /// Turned:   faces of types that their state turns (VoxelProperties::orientations) merge only if they look alike.
  /// Order:    direction, layer, row, column; the same bytes on every machine. In each direction, quads of cubes whose
  ///           corners shapes may darken come last; they merge along columns only.
  /// Cost:     O(rows of 64 voxels + visible faces); no allocation once `out` has grown. A shaped voxel costs as much
  ///           as a few quads.
  void mesh(const Neighbourhood& chunks, const VoxelRegistry& types, const QuadOptions& options, QuadBuffer& out);
  /// As above; also replaces `shapes` with the visible faces of the region's shapes. With ShapeUse::Cubes there are
  /// none.
  ///
  /// Hidden:    a face on a side of its voxel, if the neighbour covers it; inside a voxel, a face that its own shape
  ///            covers (ModelFace::is_inner).
  /// Occlusion: of a corner by the four eighths of voxels that touch it in front of the face, by the rule of
  ///            `vertex_occlusion`. The corner counts at the nearest half of a voxel; an eighth is filled in cubes that
  ///            occlude, and in opaque shapes that fill at least half of it. Inclined faces are not darkened.
  /// Lifetime:  of the models: the types' shapes.
  void mesh(const Neighbourhood& chunks, const VoxelRegistry& types, const QuadOptions& options, QuadBuffer& out,
            ShapeFaceBuffer& shapes);

  /// Finds the visible faces of the centre chunk's voxels in `region` (chunk coordinates), without those of shapes.
  /// Reads one voxel past the region.
  ///
  /// Cost: O(rows of 64 voxels); `out` is reused.
  void find_faces(const Neighbourhood& chunks, const VoxelRegistry& types, const IBox& region, FaceRows& out);

  /// Returns the number of visible unit faces of the centre chunk: as many as the quads of `mesh` cover.
  ///
  /// Cost: O(rows of 64 voxels), less than `find_faces`.
  [[nodiscard]] std::int64_t count_faces(const Neighbourhood& chunks, const VoxelRegistry& types);

 private:
  struct [[gnu::visibility("hidden")]] Scratch;
  void mesh(const Neighbourhood& chunks, const VoxelRegistry& types, const QuadOptions& options, QuadBuffer& out,
            ShapeFaceBuffer* shapes);
  std::unique_ptr<Scratch> scratch_;
};

/// Material class of a triangle, from its type's visibility and its face's emission. Each class becomes a separate
/// primitive in mesh files.
enum class SurfaceClass : std::uint8_t { Opaque, Transparent, Emissive, EmissiveTransparent };
inline constexpr std::size_t kSurfaceClasses = 4;
/// Returns the class of the triangles of a type. Transparent: its visibility is Transparent; Air and Opaque count as
/// opaque. Emissive: its emission exceeds 0; NaN does not. Any properties are valid.
[[nodiscard]] SurfaceClass surface_class(const VoxelProperties& properties);
/// Returns the class of a face of the type: as above, but a face without a share of the emission
/// (VoxelFace::emission_share) does not emit. `look`: null if the face has the type's colour.
[[nodiscard]] SurfaceClass surface_class(const VoxelProperties& properties, const VoxelFace* look);

/// The look of a vertex of a shape's face, or of a cube's that its state turns.
struct VertexLook {
  /// 0: the look follows from the vertex's type, direction and position. Else 1 + an index into BlockyTriangles::faces.
  std::uint32_t face = 0;
  /// Texture coordinates, rightwards and downwards, if `face` is not 0. Textures repeat.
  std::array<float, 2> uv{};
  Vec3 normal{0.0F};      ///< of an inclined face, unit length; 0: that of the direction
  bool is_shape = false;  ///< the vertex is one of a shape, at any position

  bool operator==(const VertexLook&) const = default;
};

/// Triangles of one surface class. The vertex arrays have one entry per vertex; faces share no vertices.
struct BlockyTriangles {
  std::vector<Vec3> positions;          ///< grid coordinates, voxels
  std::vector<Direction> directions;    ///< normal of the face
  std::vector<std::uint8_t> occlusion;  ///< 0 (open) to 3 (dark)
  std::vector<VoxelType> types;
  std::vector<std::uint32_t> indices;  ///< three per triangle, counter-clockwise seen from outside
  /// One per vertex if any vertex needs one, else empty: see VertexLook.
  std::vector<VertexLook> looks;
  /// The faces that `looks` names, each once. A face without a texture has the colour of its tint.
  std::vector<VoxelFace> faces;
};

/// The mesh of a whole grid.
struct BlockyMesh {
  std::array<BlockyTriangles, kSurfaceClasses> surfaces;  ///< indexed by SurfaceClass
  std::int64_t faces_total = 0;                           ///< 6 x non-air voxels
  std::int64_t faces_visible = 0;                         ///< of cubes and shapes
  std::int64_t quads = 0;                                 ///< of cubes and shapes

  [[nodiscard]] std::int64_t triangle_count() const;
  [[nodiscard]] std::int64_t vertex_count() const;
};

struct BlockyMeshOptions {
  bool merge = true;           ///< as QuadOptions::merge
  bool bake_occlusion = true;  ///< as QuadOptions::bake_occlusion
  /// Subdivide outlines so that no vertex lies inside another triangle's edge. Faces of shapes stay whole: they meet
  /// neither each other nor cubes in common vertices (`closed_surface` does).
  bool watertight = false;
  /// Called with the quads of each chunk before they become triangles; may replace a quad with parts of it
  /// (`quad_part`). Faces of shapes are not cut. Optional. Called from several threads at once.
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
/// `shapes`: faces of each chunk's shapes, from BlockyMesher; empty: of none.
/// Errors:   LimitExceeded if a surface class needs more than about 2^32 vertices; `mesh` then has some of the chunks.
/// Requires: `quads` and `chunks` have one length, and `shapes` the same or none.
[[nodiscard]] Status append_triangles(std::span<const QuadBuffer> quads, std::span<const IVec3> chunks,
                                      const VoxelRegistry& types, bool watertight, BlockyMesh& mesh,
                                      std::span<const ShapeFaceBuffer> shapes = {});

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

/// As above, with the shapes of types: the surface of the union of all cubes and of the sixteenths of a voxel whose
/// centres lie in a box of a shape, also outside of its voxel. Without shapes, both functions return the same.
///
/// Shapes:    their faces, and those of cubes next to them, consist of squares of a sixteenth of a voxel. Faces of
///            cubes that only touch shapes at an edge get more outline vertices.
/// Left out:  plates without thickness, such as plants. If `flat_shapes` is not null, it receives the number of their
///            voxels.
/// Cost:      about a microsecond per square of a sixteenth, on one thread, and 4 KiB per two shaped voxels.
[[nodiscard]] Result<BlockyTriangles> closed_surface(const Grid& grid, const VoxelRegistry& types,
                                                     const Progress& progress = {},
                                                     std::int64_t* flat_shapes = nullptr);

}  // namespace quoin
