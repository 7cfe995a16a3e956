#include <cstdint>
#include <string>

#include <quoin/io/smooth_files.h>

#include "io/block_writer.h"
#include "io/ply_layout.h"
#include "io/smooth_parts.h"

namespace quoin {

namespace {

PlyCounts count(std::span<const SmoothPart> parts) {
  PlyCounts counts;
  for (const SmoothPart& part : parts) {
    if (!is_drawn(part)) continue;
    counts.vertices += part.mesh.positions.size() * part.placements.size();
    counts.faces += part.mesh.indices.size() / 3 * part.placements.size();
  }
  return counts;
}

/// Calls `write(part, transform)` for every placement that is drawn.
template <class Write>
void for_each_placement(std::span<const SmoothPart> parts, const BlockWriter& out, Write write) {
  for (const SmoothPart& part : parts) {
    if (!is_drawn(part)) continue;
    for (const SmoothPlacement& placement : part.placements) {
      if (out.failed()) return;
      write(part.mesh, VertexTransform(placement.world_from_mesh, part.pivot));
    }
  }
}

void write_vertices(const SmoothMesh& mesh, const VertexTransform& transform, bool occlusion, BlockWriter& out) {
  for (std::size_t i = 0; i < mesh.positions.size() && !out.failed(); ++i) {
    out.put(Vec3(transform.position(mesh.positions[i])));
    out.put(Vec3(transform.normal(mesh.normals[i])));
    out.put(srgb_colour(mesh, i, occlusion));
  }
}

void write_faces(const SmoothMesh& mesh, bool turned, std::uint64_t first, BlockWriter& out) {
  for (std::size_t i = 0; i < mesh.indices.size() / 3 && !out.failed(); ++i) {
    out.put(std::uint8_t{3});
    for (const std::uint32_t corner : corners_of(mesh, i, turned)) out.put(static_cast<std::int32_t>(first + corner));
  }
}

Result<std::uint64_t> write_checked(std::span<const SmoothPart> parts, const std::filesystem::path& path,
                                    bool occlusion, const Progress& progress) {
  return write_ply_file(path, count(parts), progress, [&](BlockWriter& out) {
    for_each_placement(parts, out, [&](const SmoothMesh& mesh, const VertexTransform& transform) {
      write_vertices(mesh, transform, occlusion, out);
    });
    std::uint64_t first = 0;
    for_each_placement(parts, out, [&](const SmoothMesh& mesh, const VertexTransform& transform) {
      write_faces(mesh, transform.mirrors(), first, out);
      first += mesh.positions.size();
    });
  });
}

}  // namespace

Result<std::uint64_t> write_ply(std::span<const SmoothPart> parts, const std::filesystem::path& path,
                                const SmoothFileOptions& options, const Progress& progress) {
  return write_sound_parts(parts, path, [&] { return write_checked(parts, path, options.occlusion, progress); });
}

}  // namespace quoin
