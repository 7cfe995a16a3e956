#include <array>
#include <bit>
#include <cstdint>
#include <string>

#include <quoin/io/file.h>
#include <quoin/io/smooth_files.h>

#include "io/block_writer.h"
#include "io/smooth_parts.h"

namespace quoin {

namespace {

static_assert(std::endian::native == std::endian::little, "the format written is little-endian");

constexpr std::uint64_t kVertexBytes = 6 * 4 + 3;
constexpr std::uint64_t kFaceBytes = 1 + 3 * 4;

struct Counts {
  std::uint64_t vertices = 0;
  std::uint64_t faces = 0;
};

Counts count(std::span<const SmoothPart> parts) {
  Counts counts;
  for (const SmoothPart& part : parts) {
    if (!is_drawn(part)) continue;
    counts.vertices += part.mesh.positions.size() * part.placements.size();
    counts.faces += part.mesh.indices.size() / 3 * part.placements.size();
  }
  return counts;
}

std::string header_of(const Counts& counts) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment Quoin " QUOIN_VERSION "\n";
  text += "element vertex " + std::to_string(counts.vertices) + "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) text += "property float " + std::string(name) + "\n";
  for (const char* name : {"red", "green", "blue"}) text += "property uchar " + std::string(name) + "\n";
  text += "element face " + std::to_string(counts.faces) + "\n";
  return text + "property list uchar int vertex_indices\nend_header\n";
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
  const Counts counts = count(parts);
  constexpr std::uint64_t kMost = 0x7FFF'FFFF;
  if (counts.vertices > kMost || counts.faces > kMost) {
    return fail(ErrorCode::LimitExceeded, "the meshes have " + std::to_string(counts.vertices) + " vertices and " +
                                              std::to_string(counts.faces) +
                                              " triangles, and a PLY file holds 2147483647 of each");
  }
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected<Error>(file.error());
  const std::string header = header_of(counts);
  BlockWriter out(*file, progress, header.size() + counts.vertices * kVertexBytes + counts.faces * kFaceBytes);
  out.put_text(header);
  for_each_placement(parts, out, [&](const SmoothMesh& mesh, const VertexTransform& transform) {
    write_vertices(mesh, transform, occlusion, out);
  });
  std::uint64_t first = 0;
  for_each_placement(parts, out, [&](const SmoothMesh& mesh, const VertexTransform& transform) {
    write_faces(mesh, transform.mirrors(), first, out);
    first += mesh.positions.size();
  });
  if (auto written = out.finish(); !written) return tl::unexpected<Error>(written.error());
  if (auto done = file->commit(); !done) return tl::unexpected<Error>(done.error());
  return out.bytes();
}

}  // namespace

Result<std::uint64_t> write_ply(std::span<const SmoothPart> parts, const std::filesystem::path& path,
                                const SmoothFileOptions& options, const Progress& progress) {
  return write_sound_parts(parts, path, [&] { return write_checked(parts, path, options.occlusion, progress); });
}

}  // namespace quoin
