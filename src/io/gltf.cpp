#include <quoin/io/gltf.h>

#include <array>

#include <quoin/io/file.h>

#include "io/block_writer.h"
#include "io/gltf_buffer.h"
#include "io/gltf_document.h"
#include "io/gltf_layout.h"

namespace quoin {

namespace {

constexpr std::uint32_t kMagic = 0x46546C67;  // "glTF"
constexpr std::uint32_t kVersion = 2;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004E4942;  // "BIN"

void write_chunk_header(std::uint64_t bytes, std::uint32_t kind, BlockWriter& out) {
  out.put(std::array<std::uint32_t, 2>{static_cast<std::uint32_t>(bytes), kind});
}

std::filesystem::path buffer_path_of(std::filesystem::path path) {
  return path.replace_extension(".bin");
}

tl::unexpected<Error> with_path(Error error, const std::filesystem::path& path) {
  if (error.path.empty()) error.path = path.string();
  return tl::unexpected<Error>(std::move(error));
}

Status write_glb_parts(std::string& json, const GltfLayout& layout, const std::filesystem::path& path,
                       const Progress& progress, std::uint64_t total) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected<Error>(file.error());
  BlockWriter out(*file, progress, total);
  out.put(std::array<std::uint32_t, 3>{kMagic, kVersion, static_cast<std::uint32_t>(total)});
  write_chunk_header(json.size(), kJsonChunk, out);
  out.put_text(json);
  if (layout.buffer_bytes > 0) {
    write_chunk_header(layout.buffer_bytes, kBinaryChunk, out);
    write_gltf_buffer(layout, out);
  }
  if (auto written = out.finish(); !written) return written;
  return file->commit();
}

Result<std::uint64_t> write_gltf_pair(const std::string& json, const GltfLayout& layout,
                                      const std::filesystem::path& path, const std::filesystem::path& buffer_path,
                                      const Progress& progress) {
  auto text = AtomicFile::create(path);
  if (!text) return tl::unexpected<Error>(text.error());
  if (auto written = text->write(std::as_bytes(std::span(json))); !written) {
    return tl::unexpected<Error>(written.error());
  }
  if (layout.buffer_bytes > 0) {
    auto buffer = AtomicFile::create(buffer_path);
    if (!buffer) return tl::unexpected<Error>(buffer.error());
    BlockWriter out(*buffer, progress, layout.buffer_bytes);
    write_gltf_buffer(layout, out);
    if (auto written = out.finish(); !written) return tl::unexpected<Error>(written.error());
    if (auto done = buffer->commit(); !done) return tl::unexpected<Error>(done.error());
  }
  if (auto done = text->commit(); !done) return tl::unexpected<Error>(done.error());
  return json.size() + layout.buffer_bytes;
}

}  // namespace

Result<std::uint64_t> write_glb(const Scene& scene, const SceneMeshes& meshes, const std::filesystem::path& path,
                                const Progress& progress) {
  const auto layout = lay_out_gltf(scene, meshes);
  if (!layout) return with_path(layout.error(), path);
  auto json = gltf_json(scene, meshes, *layout, "");
  if (!json) return with_path(json.error(), path);
  json->append((4 - json->size() % 4) % 4, ' ');
  const auto total = glb_file_bytes(json->size(), layout->buffer_bytes);
  if (!total) return with_path(total.error(), path);
  if (auto done = write_glb_parts(*json, *layout, path, progress, *total); !done) return with_path(done.error(), path);
  return *total;
}

Result<std::uint64_t> write_gltf(const Scene& scene, const SceneMeshes& meshes, const std::filesystem::path& path,
                                 const Progress& progress) {
  const auto layout = lay_out_gltf(scene, meshes);
  if (!layout) return with_path(layout.error(), path);
  const std::filesystem::path buffer_path = buffer_path_of(path);
  const auto json = gltf_json(scene, meshes, *layout, percent_encoded(buffer_path.filename().string()));
  if (!json) return with_path(json.error(), path);
  auto bytes = write_gltf_pair(*json, *layout, path, buffer_path, progress);
  if (!bytes) return with_path(bytes.error(), path);
  return bytes;
}

std::vector<std::filesystem::path> gltf_files(const SceneMeshes& meshes, const std::filesystem::path& path) {
  if (meshes.triangles == 0) return {path};
  return {path, buffer_path_of(path)};
}

}  // namespace quoin
