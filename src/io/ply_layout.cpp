#include "io/ply_layout.h"

#include <bit>
#include <string>

#include <quoin/io/file.h>

namespace quoin {

namespace {

static_assert(std::endian::native == std::endian::little, "the format written is little-endian");

Status check_counts(const PlyCounts& counts) {
  constexpr std::uint64_t kMost = 0x7FFF'FFFF;
  if (counts.vertices <= kMost && counts.faces <= kMost) return {};
  return fail(ErrorCode::LimitExceeded, "the meshes have " + std::to_string(counts.vertices) + " vertices and " +
                                            std::to_string(counts.faces) +
                                            " triangles, and a PLY file holds 2147483647 of each");
}

std::string ply_header(const PlyCounts& counts) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment Quoin " QUOIN_VERSION "\n";
  text += "element vertex " + std::to_string(counts.vertices) + "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) text += "property float " + std::string(name) + "\n";
  for (const char* name : {"red", "green", "blue"}) text += "property uchar " + std::string(name) + "\n";
  text += "element face " + std::to_string(counts.faces) + "\n";
  return text + "property list uchar int vertex_indices\nend_header\n";
}

std::uint64_t ply_bytes(const PlyCounts& counts) {
  return ply_header(counts).size() + counts.vertices * kPlyVertexBytes + counts.faces * kPlyFaceBytes;
}

}  // namespace

Result<std::uint64_t> write_ply_file(const std::filesystem::path& path, const PlyCounts& counts,
                                     const Progress& progress, const std::function<void(BlockWriter&)>& write) {
  if (auto possible = check_counts(counts); !possible) return tl::unexpected<Error>(possible.error());
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected<Error>(file.error());
  BlockWriter out(*file, progress, ply_bytes(counts));
  out.put_text(ply_header(counts));
  write(out);
  if (auto written = out.finish(); !written) return tl::unexpected<Error>(written.error());
  if (auto done = file->commit(); !done) return tl::unexpected<Error>(done.error());
  return out.bytes();
}

}  // namespace quoin
