#include "io/gltf_container.h"

#include <array>
#include <limits>

#include <quoin/io/file.h>

namespace quoin {

namespace {

constexpr std::uint32_t kMagic = 0x46546C67;  // "glTF"
constexpr std::uint32_t kVersion = 2;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004E4942;  // "BIN"

void write_chunk_header(std::uint64_t bytes, std::uint32_t kind, BlockWriter& out) {
  out.put(std::array<std::uint32_t, 2>{static_cast<std::uint32_t>(bytes), kind});
}

tl::unexpected<Error> with_path(Error error, const std::filesystem::path& path) {
  if (error.path.empty()) error.path = path.string();
  return tl::unexpected<Error>(std::move(error));
}

Status write_glb_parts(const std::string& json, const GltfContent& content, const std::filesystem::path& path,
                       const Progress& progress, std::uint64_t total) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected<Error>(file.error());
  BlockWriter out(*file, progress, total);
  out.put(std::array<std::uint32_t, 3>{kMagic, kVersion, static_cast<std::uint32_t>(total)});
  write_chunk_header(json.size(), kJsonChunk, out);
  out.put_text(json);
  if (content.buffer_bytes > 0) {
    write_chunk_header(content.buffer_bytes, kBinaryChunk, out);
    content.write_buffer(out);
  }
  if (auto written = out.finish(); !written) return written;
  return file->commit();
}

Result<std::uint64_t> write_pair(const std::string& json, const GltfContent& content, const std::filesystem::path& path,
                                 const std::filesystem::path& buffer_path, const Progress& progress) {
  auto text = AtomicFile::create(path);
  if (!text) return tl::unexpected<Error>(text.error());
  if (auto written = text->write(std::as_bytes(std::span(json))); !written) {
    return tl::unexpected<Error>(written.error());
  }
  if (content.buffer_bytes > 0) {
    auto buffer = AtomicFile::create(buffer_path);
    if (!buffer) return tl::unexpected<Error>(buffer.error());
    BlockWriter out(*buffer, progress, content.buffer_bytes);
    content.write_buffer(out);
    if (auto written = out.finish(); !written) return tl::unexpected<Error>(written.error());
    if (auto done = buffer->commit(); !done) return tl::unexpected<Error>(done.error());
  }
  if (auto done = text->commit(); !done) return tl::unexpected<Error>(done.error());
  return json.size() + content.buffer_bytes;
}

}  // namespace

Result<std::uint64_t> write_glb_file(const GltfContent& content, const std::filesystem::path& path,
                                     const Progress& progress) {
  auto json = content.json("");
  if (!json) return with_path(json.error(), path);
  json->append((4 - json->size() % 4) % 4, ' ');
  const auto total = glb_file_bytes(json->size(), content.buffer_bytes);
  if (!total) return with_path(total.error(), path);
  if (auto done = write_glb_parts(*json, content, path, progress, *total); !done) return with_path(done.error(), path);
  return *total;
}

Result<std::uint64_t> write_gltf_files(const GltfContent& content, const std::filesystem::path& path,
                                       const Progress& progress) {
  const std::filesystem::path buffer_path = gltf_buffer_path(path);
  const auto json = content.json(percent_encoded(buffer_path.filename().string()));
  if (!json) return with_path(json.error(), path);
  auto bytes = write_pair(*json, content, path, buffer_path, progress);
  if (!bytes) return with_path(bytes.error(), path);
  return bytes;
}

std::filesystem::path gltf_buffer_path(std::filesystem::path path) {
  return path.replace_extension(".bin");
}

std::string percent_encoded(std::string_view name) {
  constexpr std::string_view unreserved = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string encoded;
  for (const char c : name) {
    if (unreserved.find(c) != std::string_view::npos) {
      encoded += c;
      continue;
    }
    const auto byte = static_cast<unsigned char>(c);
    encoded += '%';
    encoded += digits[byte >> 4];
    encoded += digits[byte & 15];
  }
  return encoded;
}

Result<std::uint64_t> glb_file_bytes(std::uint64_t json_bytes, std::uint64_t buffer_bytes) {
  constexpr std::uint64_t kHeaderBytes = 12;
  constexpr std::uint64_t kChunkHeaderBytes = 8;
  std::uint64_t total = kHeaderBytes + kChunkHeaderBytes + json_bytes;
  if (buffer_bytes > 0) total += kChunkHeaderBytes + buffer_bytes;
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    return fail(ErrorCode::LimitExceeded,
                "the meshes take " + std::to_string(total) + " bytes, and a GLB holds 4294967295 at most");
  }
  return total;
}

}  // namespace quoin
