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

namespace [[gnu::visibility("default")]] quoin {

// Collision shapes of solid voxels for physics engines. Types that collide (VoxelProperties::collides) and unregistered
// types are solid. Voxels whose type has shapes (VoxelProperties::shapes) consist of the boxes of their shape.
// Boxes have an inside, so fast bodies do not tunnel through them. Triangles do not, so fast bodies
// need the engine's continuous collision detection.

/// Triangles in the layout of physics engines. `positions` has three floats per vertex (Jolt's Float3, Bullet's vertex
/// base with a stride of 12 bytes). `indices` has three per triangle, counter-clockwise seen from outside.
struct SolidMesh {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
};

/// Returns the triangles of solid faces: four positions and two triangles per quad, in the quads' space.
[[nodiscard]] SolidMesh solid_mesh(const QuadBuffer& faces);

struct SolidShapesOptions {
  bool boxes = true;
  bool faces = false;
};

/// The solid shapes of a grid's chunks, kept up to date during edits.
///
///   SolidShapes shapes;
///   for (const IVec3 chunk : shapes.update(grid, types)) {  // all chunks the first time, then changed ones
///     replace_body(chunk, shapes.boxes(chunk));             // empty if the chunk has no solid voxels
///   }
///
/// To find pieces that lose their support, use ConnectedPieces. An extracted piece is a grid with its own shapes.
/// Space:   voxels, origin at the chunk's minimum corner.
/// Boxes:   cover each solid voxel of a chunk exactly once, except voxels with shapes. Half of a box's size is the half
///          extent that Jolt (StaticCompoundShapeSettings) and Bullet (btCompoundShape) take.
/// Shapes:  `shape_boxes` has the boxes of voxels with shapes; they may overlap, and reach up to a voxel outside their
///          own. A tilted box is replaced by its bounds, and so is a fluid with an inclined surface. Elements that
///          bodies pass (ShapeElement::collides) have none. They are made if `boxes` or `faces` are, and have no faces.
/// Faces:   lie between a chunk's solid voxels and non-solid voxels, also across chunk borders; a missing chunk is not
///          solid. Each face is covered once; rectangles merge different types. Quads have type 0, no occlusion, and
///          the usual corners.
/// Order:   boxes by their lowest voxel (z, then y, then x); boxes of shapes by their voxel, then in the shape's order;
///          faces by direction and layer. The same voxels have the same shapes.
/// Cost:    an update processes the changed chunks: 0.15 ms for the 1,800 boxes of a chunk of cave terrain, 0.35 ms for
///          its 6,800 quads. O(chunks) if a type's `collides` or shapes changed. Changes of data count only if types
///          have shapes.
/// Threads: any number of threads may read at once; an update needs exclusive access.
class SolidShapes {
 public:
  explicit SolidShapes(const SolidShapesOptions& options = {});
  SolidShapes(SolidShapes&&) noexcept;
  SolidShapes& operator=(SolidShapes&&) noexcept;
  ~SolidShapes();

  /// Applies the edits since the last update, or all chunks of another grid. Returns the chunks whose shapes changed,
  /// including chunks that became empty, sorted by z, then y, then x. If it throws bad_alloc, the next update starts
  /// from scratch.
  std::vector<IVec3> update(const Grid& grid, const VoxelRegistry& types, Threads threads = {});

  /// Returns a chunk's shapes as of the last update; empty if it has none. Lifetime: until the next update.
  [[nodiscard]] const std::vector<IBox>& boxes(IVec3 chunk) const;
  [[nodiscard]] const QuadBuffer& faces(IVec3 chunk) const;
  [[nodiscard]] const std::vector<DBox>& shape_boxes(IVec3 chunk) const;

  /// Returns the bytes held.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
