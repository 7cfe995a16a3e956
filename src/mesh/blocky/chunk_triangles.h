#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/quad.h>

namespace quoin {

struct OutlinePoint {
  IVec3 position;  ///< chunk coordinates, 0..64
  std::uint8_t occlusion;
};

/// Finds, for the quads of one chunk, the vertices that must be on their outlines so that no vertex is inside another
/// quad's edge.
///
/// Inside the chunk, these are the corners of its other quads. An edge in a border plane of the chunk is shared with a
/// chunk that may be meshed separately, so it is divided at every voxel: both sides follow this rule.
class OutlineFinder {
 public:
  /// Records the corners of all quads of a chunk.
  void prepare(const QuadBuffer& quads);

  /// Computes the outline of one of these quads, counter-clockwise from outside, starting at corner 0. Includes all
  /// corners.
  void outline(const Quad& quad, std::vector<OutlinePoint>& out) const;

 private:
  [[nodiscard]] bool is_vertex(IVec3 p) const;

  std::vector<std::uint64_t> corners_;  // one bit for each of 65^3 lattice points
};

/// Appends triangles that cover a quad's outline. Uses all points of the outline and no triangle of zero area.
///
/// Order of `outline`: as OutlineFinder returns it. An outline of four points is split along the quad's diagonal.
void triangulate_outline(const std::vector<OutlinePoint>& outline, bool flipped, std::uint32_t base,
                         std::vector<std::uint32_t>& indices);

/// Returns the class of a type, from its visibility and emission.
[[nodiscard]] SurfaceClass surface_class(const VoxelProperties& properties);

/// Converts the quads of consecutive chunks to triangles.
class ChunkTriangles {
 public:
  ChunkTriangles(const VoxelRegistry& types, bool watertight);

  /// Appends the triangles of one chunk, and counts its faces and quads. Errors: LimitExceeded if a surface class needs
  /// more than about 2^32 vertices.
  [[nodiscard]] Status append(const QuadBuffer& quads, IVec3 chunk, BlockyMesh& mesh);

 private:
  [[nodiscard]] SurfaceClass class_of(const Quad& quad) const;
  [[nodiscard]] Status append_outlines(const QuadBuffer& quads, IVec3 origin, BlockyMesh& mesh);

  std::vector<SurfaceClass> classes_;  // [VoxelType]
  bool watertight_;
  OutlineFinder finder_;
  std::vector<OutlinePoint> outline_;
};

}  // namespace quoin
