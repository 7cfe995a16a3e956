#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/quad.h>

namespace quoin {

// What of voxels is solid, as shapes for a physics engine. Solid are types that collide (VoxelProperties::collides),
// and what is not registered. Boxes have an inside, so that fast bodies do not pass them; triangles have none, and such
// bodies need the engine's continuous detection.

/// Appends boxes that hold exactly the solid voxels of a chunk, each once: half boxes are what a compound of Jolt
/// (StaticCompoundShapeSettings) or Bullet (btCompoundShape) takes.
///
/// Space: voxels, origin at the chunk's minimum corner. Order: by their lowest voxel, z, then y, then x.
/// Cost:  O(rows of 64 voxels + boxes * rows of each). Terrain full of caves, 1,800 boxes a chunk: 0.15 ms.
void append_solid_boxes(const Chunk& chunk, const VoxelRegistry& types, std::vector<IBox>& out);

/// Appends the faces of a chunk's solid voxels towards what is not solid, in its neighbours too, as rectangles that
/// hold each face once, of whatever types. They have type 0 and no occlusion, and corners as any Quad.
///
/// Border: a missing chunk is not solid. Order: by direction and layer; the same for the same voxels.
/// Cost:   0.35 ms for the same chunk, 6,800 quads.
void append_solid_faces(const Grid& grid, IVec3 chunk, const VoxelRegistry& types, QuadBuffer& out);

/// Triangles in the layout that physics engines take: `positions` are three floats each (Jolt's Float3, Bullet's vertex
/// base with a stride of 12 bytes), `indices` three a triangle, counter-clockwise seen from outside.
struct SolidMesh {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
};

/// The triangles of solid faces: four positions and two triangles a quad, in the quads' space.
[[nodiscard]] SolidMesh solid_mesh(const QuadBuffer& faces);

struct SolidShapesOptions {
  bool boxes = true;
  bool faces = false;
};

/// The solid shapes of a grid's chunks, kept up to date while it is edited.
///
///   SolidShapes shapes;
///   for (const IVec3 chunk : shapes.update(grid, types)) {  // all the first time, then those that changed
///     replace_body(chunk, shapes.boxes(chunk));             // none where nothing is solid any more
///   }
///
/// Pieces that lose their support are ConnectedPieces'; a piece that was extracted is a grid with shapes of its own.
/// Cost:    of an update what `append_solid_boxes` and `append_solid_faces` cost, for the chunks that changed;
///          O(chunks) where types came to collide or no longer do.
/// Threads: any number may read at once; an update needs it to itself.
class SolidShapes {
 public:
  explicit SolidShapes(const SolidShapesOptions& options = {});
  SolidShapes(SolidShapes&&) noexcept;
  SolidShapes& operator=(SolidShapes&&) noexcept;
  ~SolidShapes();

  /// Takes over what was edited since the last update, or all of another grid. Returns the chunks whose shapes are
  /// others than before, sorted by z, then y, then x, those included that have none any more.
  /// When it throws (bad_alloc), the next update begins anew.
  std::vector<IVec3> update(const Grid& grid, const VoxelRegistry& types, Threads threads = {});

  /// As of the last update; empty for a chunk without. Lifetime: until the next update.
  [[nodiscard]] const std::vector<IBox>& boxes(IVec3 chunk) const;
  [[nodiscard]] const QuadBuffer& faces(IVec3 chunk) const;

  /// Bytes held.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
