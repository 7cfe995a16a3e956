#include "mesh/blocky/chunk_triangles.h"

#include <limits>

#include <quoin/mesh/quad_triangles.h>

namespace quoin {
namespace {

void append_quad(const Quad& quad, IVec3 origin, BlockyTriangles& out) {
  const auto base = static_cast<std::uint32_t>(out.positions.size());
  for_each_vertex({&quad, 1}, [&](std::size_t, const QuadVertex& vertex) {
    out.positions.emplace_back(origin + vertex.position);
    out.directions.push_back(vertex.direction);
    out.occlusion.push_back(vertex.occlusion);
    out.types.push_back(vertex.type);
  });
  for (const std::uint8_t corner : triangle_corners(quad.flipped())) out.indices.push_back(base + corner);
}

void append_outline(const Quad& quad, IVec3 origin, const std::vector<OutlinePoint>& outline, BlockyTriangles& out) {
  const auto base = static_cast<std::uint32_t>(out.positions.size());
  for (const OutlinePoint& point : outline) {
    out.positions.emplace_back(origin + point.position);
    out.directions.push_back(quad.direction());
    out.occlusion.push_back(point.occlusion);
    out.types.push_back(quad.type());
  }
  triangulate_outline(outline, quad.flipped(), base, out.indices);
}

}  // namespace

ChunkTriangles::ChunkTriangles(const VoxelRegistry& types, bool watertight)
    : classes_(types.size()), watertight_(watertight) {
  for (std::size_t i = 0; i < classes_.size(); ++i) classes_[i] = surface_class(types[static_cast<VoxelType>(i)]);
}

Status ChunkTriangles::append(const QuadBuffer& quads, IVec3 chunk, BlockyMesh& mesh) {
  mesh.faces_visible += face_count(quads);
  mesh.quads += static_cast<std::int64_t>(quads.size());
  if (watertight_) finder_.prepare(quads);
  for (const Quad& quad : quads) {
    const SurfaceClass which = quad.type() < classes_.size() ? classes_[quad.type()] : SurfaceClass::Opaque;
    BlockyTriangles& out = mesh.surfaces[static_cast<std::size_t>(which)];
    if (out.positions.size() > std::numeric_limits<std::uint32_t>::max() - 1'024) {
      return make_error(ErrorCode::LimitExceeded, "the mesh needs more than 2^32 vertices");
    }
    if (watertight_) {
      finder_.outline(quad, outline_);
      append_outline(quad, chunk * kChunkEdge, outline_, out);
    } else {
      append_quad(quad, chunk * kChunkEdge, out);
    }
  }
  return {};
}

}  // namespace quoin
