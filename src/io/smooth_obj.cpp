#include <quoin/io/file.h>
#include <quoin/io/smooth_files.h>

#include "io/obj_lines.h"
#include "io/smooth_parts.h"

namespace quoin {

namespace {

void write_vertices(const SmoothMesh& mesh, const VertexTransform& transform, bool occlusion, ObjLines& lines) {
  constexpr int kFloatDigits = 9;
  constexpr int kColourDigits = 4;
  for (std::size_t i = 0; i < mesh.positions.size() && !lines.out().failed(); ++i) {
    lines.triple("v", transform.position(mesh.positions[i]), kFloatDigits);
    const auto colour = srgb_colour(mesh, i, occlusion);
    lines.triple("", DVec3(colour[0], colour[1], colour[2]) / 255.0, kColourDigits);
    lines.character('\n');
  }
  for (std::size_t i = 0; i < mesh.normals.size() && !lines.out().failed(); ++i) {
    lines.triple("vn", transform.normal(mesh.normals[i]));
    lines.character('\n');
  }
}

/// `first`: the number of the mesh's first vertex, and of its normal.
void write_faces(const SmoothMesh& mesh, bool turned, std::uint64_t first, ObjLines& lines) {
  for (std::size_t i = 0; i < mesh.indices.size() / 3 && !lines.out().failed(); ++i) {
    lines.character('f');
    for (const std::uint32_t corner : corners_of(mesh, i, turned)) {
      lines.character(' ');
      lines.index(first + corner);
      lines.text("//");
      lines.index(first + corner);
    }
    lines.character('\n');
  }
}

void write_parts(std::span<const SmoothPart> parts, bool occlusion, ObjLines& lines) {
  lines.text("# Quoin " QUOIN_VERSION "\n");
  std::uint64_t first = 1;
  for (const SmoothPart& part : parts) {
    if (!is_drawn(part)) continue;
    for (const SmoothPlacement& placement : part.placements) {
      const VertexTransform transform(placement.world_from_mesh, part.pivot);
      lines.object(placement.name.empty() ? part.name : placement.name);
      write_vertices(part.mesh, transform, occlusion, lines);
      write_faces(part.mesh, transform.mirrors(), first, lines);
      first += part.mesh.positions.size();
    }
  }
}

/// A guess, for progress only.
std::uint64_t expected_bytes(std::span<const SmoothPart> parts) {
  constexpr std::uint64_t kVertexLines = 80;
  constexpr std::uint64_t kFaceLine = 42;
  std::uint64_t bytes = 1;
  for (const SmoothPart& part : parts) {
    const std::uint64_t once = part.mesh.positions.size() * kVertexLines + part.mesh.indices.size() / 3 * kFaceLine;
    bytes += once * part.placements.size();
  }
  return bytes;
}

Result<std::uint64_t> write_checked(std::span<const SmoothPart> parts, const std::filesystem::path& path,
                                    bool occlusion, const Progress& progress) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected<Error>(file.error());
  BlockWriter out(*file, progress, expected_bytes(parts));
  ObjLines lines(out);
  write_parts(parts, occlusion, lines);
  if (auto written = out.finish(); !written) return tl::unexpected<Error>(written.error());
  if (auto done = file->commit(); !done) return tl::unexpected<Error>(done.error());
  return out.bytes();
}

}  // namespace

Result<std::uint64_t> write_smooth_obj(std::span<const SmoothPart> parts, const std::filesystem::path& path,
                                       const SmoothFileOptions& options, const Progress& progress) {
  return write_sound_parts(parts, path, [&] { return write_checked(parts, path, options.occlusion, progress); });
}

}  // namespace quoin
