#pragma once

#include <vector>

#include <quoin/mesh/blocky.h>

#include "mesh/blocky/watertight.h"

namespace quoin {

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
