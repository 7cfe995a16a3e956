#include <quoin/mesh/blocky.h>

#include <algorithm>
#include <limits>
#include <memory>

#include <quoin/mesh/quad_triangles.h>

#include "core/progress_steps.h"
#include "mesh/blocky/watertight.h"

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

SurfaceClass surface_class(const VoxelProperties& properties) {
  const bool is_transparent = properties.visibility == Visibility::Transparent;
  if (properties.emission > 0.0F) return is_transparent ? SurfaceClass::EmissiveTransparent : SurfaceClass::Emissive;
  return is_transparent ? SurfaceClass::Transparent : SurfaceClass::Opaque;
}

std::int64_t BlockyMesh::triangle_count() const {
  std::size_t total = 0;
  for (const BlockyTriangles& surface : surfaces) total += surface.indices.size() / 3;
  return static_cast<std::int64_t>(total);
}

std::int64_t BlockyMesh::vertex_count() const {
  std::size_t total = 0;
  for (const BlockyTriangles& surface : surfaces) total += surface.positions.size();
  return static_cast<std::int64_t>(total);
}

namespace {

// The quads of all chunks; fewer where `reporter` was cancelled.
std::vector<QuadBuffer> quads_of(const Grid& grid, const std::vector<IVec3>& chunks, const VoxelRegistry& types,
                                 const BlockyMeshOptions& options, Threads threads, ProgressSteps& reporter) {
  std::vector<QuadBuffer> parts(chunks.size());
  // As many tasks as keep every thread busy; each keeps one mesher for the chunks it takes.
  const std::size_t tasks = std::min<std::size_t>(chunks.size(), std::size_t{8} * thread_count(threads));
  parallel_for(tasks, threads, [&](std::size_t task) {
    BlockyMesher mesher;
    QuadOptions quad_options;
    quad_options.merge = options.merge;
    quad_options.bake_occlusion = options.bake_occlusion;
    for (std::size_t i = task; i < chunks.size() && !reporter.cancelled(); i += tasks) {
      mesher.mesh(grid.neighbourhood(chunks[i]), types, quad_options, parts[i]);
      if (options.cut) options.cut(chunks[i], parts[i]);
      reporter.step();
    }
  });
  return parts;
}

}  // namespace

Result<BlockyMesh> build_blocky_mesh(const Grid& grid, const VoxelRegistry& types, const BlockyMeshOptions& options,
                                     Threads threads, const Progress& progress) {
  const std::vector<IVec3> chunks = grid.chunks();
  ProgressSteps reporter(progress, 2 * chunks.size());
  std::vector<QuadBuffer> parts = quads_of(grid, chunks, types, options, threads, reporter);
  if (reporter.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");

  std::vector<SurfaceClass> classes(types.size());
  for (std::size_t i = 0; i < classes.size(); ++i) classes[i] = surface_class(types[static_cast<VoxelType>(i)]);
  BlockyMesh mesh;
  mesh.faces_total = 6 * grid.voxel_count();
  OutlineFinder finder;
  std::vector<OutlinePoint> outline;
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    QuadBuffer& quads = parts[i];
    mesh.faces_visible += face_count(quads);
    mesh.quads += static_cast<std::int64_t>(quads.size());
    if (options.watertight) finder.prepare(quads);
    for (const Quad& quad : quads) {
      const SurfaceClass which = quad.type() < classes.size() ? classes[quad.type()] : SurfaceClass::Opaque;
      BlockyTriangles& out = mesh.surfaces[static_cast<std::size_t>(which)];
      if (out.positions.size() > std::numeric_limits<std::uint32_t>::max() - 1'024) {
        return make_error(ErrorCode::LimitExceeded, "the mesh needs more than 2^32 vertices");
      }
      if (options.watertight) {
        finder.outline(quad, outline);
        append_outline(quad, chunks[i] * kChunkEdge, outline, out);
      } else {
        append_quad(quad, chunks[i] * kChunkEdge, out);
      }
    }
    quads = {};
    reporter.step();
    if (reporter.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  return mesh;
}

}  // namespace quoin
