#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
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

namespace quoin {

struct QuadOptions {
  bool merge = true;           ///< false: one quad a visible unit face
  bool bake_occlusion = true;  ///< false: 0 everywhere, and faces merge whatever stands in front of them
  IBox region = kWholeChunk;   ///< of the voxels whose faces are wanted: chunk coordinates, clipped to the chunk
};

/// Turns chunks into quads; holds the scratch memory that this takes (about 1.5 MiB), so keep one a thread.
class BlockyMesher {
 public:
  BlockyMesher();
  BlockyMesher(BlockyMesher&&) noexcept;
  BlockyMesher& operator=(BlockyMesher&&) noexcept;
  ~BlockyMesher();

  /// Replaces `out` by the quads of the centre chunk's visible faces.
  ///
  /// Space:    voxels, origin at the chunk's minimum corner.
  /// Border:   reads one voxel past each side; the chunk that owns the voxel emits the face. A null centre is air and
  ///           gives no quads.
  /// Lossless: every visible unit face of the region is covered by exactly one quad, of its type, whose occlusion
  ///           interpolates to that face's own; faces merge only where type and occlusion of all four corners agree,
  ///           and along directions in which the occlusion does not change.
  /// Order:    direction, layer, row, column; the same bytes on every machine.
  /// Cost:     O(rows of 64 voxels + visible faces); no allocation once `out` has grown.
  void mesh(const Neighbourhood& chunks, const VoxelRegistry& types, const QuadOptions& options, QuadBuffer& out);

  /// Finds the visible faces of the centre chunk's voxels in `region` (chunk coordinates); reads one voxel past it.
  ///
  /// Cost: O(rows of 64 voxels); `out` is reused.
  void find_faces(const Neighbourhood& chunks, const VoxelRegistry& types, const IBox& region, FaceRows& out);

  /// How many faces of the centre chunk's voxels show: as many unit faces as `mesh` covers.
  ///
  /// Cost: O(rows of 64 voxels), less than `find_faces`.
  [[nodiscard]] std::int64_t count_faces(const Neighbourhood& chunks, const VoxelRegistry& types);

 private:
  struct Scratch;
  std::unique_ptr<Scratch> scratch_;
};

/// What a triangle is drawn with; each class becomes a primitive of its own.
enum class SurfaceClass : std::uint8_t { Opaque, Transparent, Emissive, EmissiveTransparent };
inline constexpr std::size_t kSurfaceClasses = 4;

/// The class of a type: by its visibility and whether it emits.
[[nodiscard]] SurfaceClass surface_class(const VoxelProperties& properties);

/// Triangles of one surface class. The vertex arrays have one entry a vertex; no vertex is shared between faces.
struct BlockyTriangles {
  std::vector<Vec3> positions;          ///< grid coordinates, voxels
  std::vector<Direction> directions;    ///< the face's normal
  std::vector<std::uint8_t> occlusion;  ///< 0 (open) to 3 (dark)
  std::vector<VoxelType> types;
  std::vector<std::uint32_t> indices;  ///< three a triangle, counter-clockwise from outside
};

/// The mesh of a whole grid.
struct BlockyMesh {
  std::array<BlockyTriangles, kSurfaceClasses> surfaces;  ///< [SurfaceClass]
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
  /// Cuts the quads of a chunk further before they become triangles, if given. From several threads at once.
  std::function<void(IVec3 chunk, QuadBuffer& quads)> cut{};
};

/// Meshes a whole grid, chunk by chunk.
///
/// Space:    grid coordinates (voxel (i,j,k) spans i..i+1 and so on). Coordinates beyond 2^24 lose precision; use
///           BlockyMesher chunk by chunk for those.
/// Order:    chunks as in Grid::chunks; the same bytes at any thread count.
/// Progress: once a chunk while faces are found, and once more while they become triangles; each is half of the whole.
/// Types:    those that are not registered count as opaque.
/// Errors:   Cancelled; LimitExceeded when a surface class needs more than about 2^32 vertices.
[[nodiscard]] Result<BlockyMesh> build_blocky_mesh(const Grid& grid, const VoxelRegistry& types,
                                                   const BlockyMeshOptions& options = {}, Threads threads = {},
                                                   const Progress& progress = {});

}  // namespace quoin
