#include "mesh/blocky/chunk_triangles.h"

#include <limits>

#include <quoin/core/assert.h>
#include <quoin/mesh/quad_triangles.h>

namespace quoin {
namespace {

constexpr std::size_t kMaxVertices = std::numeric_limits<std::uint32_t>::max() - 1'024;

Error too_large() {
  return {ErrorCode::LimitExceeded, "the mesh needs more than 2^32 vertices", {}, {}};
}

// Reserves room for `quads` more quads.
void grow(std::size_t quads, BlockyTriangles& out) {
  const std::size_t vertices = out.positions.size() + vertices_needed(quads);
  out.positions.resize(vertices);
  out.directions.resize(vertices);
  out.occlusion.resize(vertices);
  out.types.resize(vertices);
  out.indices.resize(out.indices.size() + indices_needed(quads));
}

// Writes the quad with index `number`.
void put_quad(const Quad& quad, IVec3 origin, std::size_t number, BlockyTriangles& out) {
  const std::size_t first = 4 * number;
  QUOIN_ASSERT(first + 4 <= out.positions.size() && 6 * (number + 1) <= out.indices.size(), "a quad that was counted");
  for_each_vertex({&quad, 1}, [&](std::size_t i, const QuadVertex& vertex) {
    out.positions[first + i] = Vec3(origin + vertex.position);
    out.directions[first + i] = vertex.direction;
    out.occlusion[first + i] = vertex.occlusion;
    out.types[first + i] = vertex.type;
  });
  std::uint32_t* index = out.indices.data() + 6 * number;
  for (const std::uint8_t corner : triangle_corners(quad.flipped()))
    *index++ = static_cast<std::uint32_t>(first) + corner;
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

SurfaceClass surface_class(const VoxelProperties& properties) {
  const bool is_transparent = properties.visibility == Visibility::Transparent;
  if (properties.emission > 0.0F) return is_transparent ? SurfaceClass::EmissiveTransparent : SurfaceClass::Emissive;
  return is_transparent ? SurfaceClass::Transparent : SurfaceClass::Opaque;
}

ChunkTriangles::ChunkTriangles(const VoxelRegistry& types, bool watertight)
    : classes_(types.size()), watertight_(watertight) {
  for (std::size_t i = 0; i < classes_.size(); ++i) classes_[i] = surface_class(types[static_cast<VoxelType>(i)]);
}

SurfaceClass ChunkTriangles::class_of(const Quad& quad) const {
  return quad.type() < classes_.size() ? classes_[quad.type()] : SurfaceClass::Opaque;
}

Status ChunkTriangles::append(const QuadBuffer& quads, IVec3 chunk, BlockyMesh& mesh) {
  mesh.faces_visible += face_count(quads);
  mesh.quads += static_cast<std::int64_t>(quads.size());
  const IVec3 origin = chunk * kChunkEdge;
  if (watertight_) return append_outlines(quads, origin, mesh);
  std::array<std::size_t, kSurfaceClasses> counts{};
  for (const Quad& quad : quads) ++counts[static_cast<std::size_t>(class_of(quad))];
  std::array<std::size_t, kSurfaceClasses> next{};
  for (std::size_t i = 0; i < kSurfaceClasses; ++i) {
    BlockyTriangles& out = mesh.surfaces[i];
    next[i] = out.positions.size() / 4;
    if (next[i] + counts[i] > kMaxVertices / 4) return too_large();
    grow(counts[i], out);
  }
  for (const Quad& quad : quads) {
    const auto which = static_cast<std::size_t>(class_of(quad));
    put_quad(quad, origin, next[which]++, mesh.surfaces[which]);
  }
  return {};
}

Status ChunkTriangles::append_outlines(const QuadBuffer& quads, IVec3 origin, BlockyMesh& mesh) {
  finder_.prepare(quads);
  for (const Quad& quad : quads) {
    BlockyTriangles& out = mesh.surfaces[static_cast<std::size_t>(class_of(quad))];
    if (out.positions.size() > kMaxVertices) return too_large();
    finder_.outline(quad, outline_);
    append_outline(quad, origin, outline_, out);
  }
  return {};
}

}  // namespace quoin
