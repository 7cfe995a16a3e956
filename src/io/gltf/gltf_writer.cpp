#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include <quoin/core/assert.h>

#include "io/gltf/gltf_layout.h"

#ifdef QUOIN_HAVE_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

namespace quoin {

#ifdef QUOIN_HAVE_MESHOPTIMIZER

namespace {

/// Sets the codec versions that EXT_meshopt_compression requires. meshoptimizer keeps them in global variables.
void choose_versions() {
  static std::once_flag chosen;
  std::call_once(chosen, [] {
    meshopt_encodeVertexVersion(0);
    meshopt_encodeIndexVersion(1);
  });
}

template <class Index>
std::vector<std::uint32_t> indices_from(std::span<const std::byte> bytes) {
  std::vector<Index> narrow(bytes.size() / sizeof(Index));
  std::memcpy(narrow.data(), bytes.data(), narrow.size() * sizeof(Index));
  return {narrow.begin(), narrow.end()};
}

}  // namespace

bool can_compress_gltf() {
  return true;
}

std::vector<std::byte> compress_gltf_array(const GltfArray& array, std::span<const std::byte> bytes) {
  QUOIN_ASSERT(array.stride > 0 && bytes.size() % array.stride == 0, "whole elements");
  choose_versions();
  std::vector<std::byte> packed;
  const auto data = [&] { return reinterpret_cast<unsigned char*>(packed.data()); };
  if (array.kind == GltfArrayKind::Index) {
    const auto indices = array.component == GltfComponent::UnsignedInt ? indices_from<std::uint32_t>(bytes)
                                                                       : indices_from<std::uint16_t>(bytes);
    std::uint32_t vertices = 0;
    for (const std::uint32_t index : indices) vertices = std::max(vertices, index + 1);
    packed.resize(meshopt_encodeIndexBufferBound(indices.size(), vertices));
    packed.resize(meshopt_encodeIndexBuffer(data(), packed.size(), indices.data(), indices.size()));
  } else {
    const std::size_t count = bytes.size() / array.stride;
    packed.resize(meshopt_encodeVertexBufferBound(count, array.stride));
    packed.resize(meshopt_encodeVertexBuffer(data(), packed.size(), bytes.data(), count, array.stride));
  }
  QUOIN_ASSERT(!packed.empty(), "the codec takes it");
  packed.shrink_to_fit();
  return packed;
}

#else

bool can_compress_gltf() {
  return false;
}

std::vector<std::byte> compress_gltf_array(const GltfArray&, std::span<const std::byte>) {
  QUOIN_ASSERT(can_compress_gltf(), "the build has meshoptimizer");
  return {};
}

#endif

namespace {

constexpr std::uint32_t kMagic = 0x46546C67;  // "glTF"
constexpr std::uint32_t kVersion = 2;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004E4942;  // "BIN"

/// Writes the buffer that `layout` describes, converting vertex by vertex. Pads the end to a multiple of four.
/// Requires: the writer's position is a multiple of four.
void write_buffer(const GltfLayout& layout, BlockWriter& out) {
  QUOIN_ASSERT(out.bytes() % 4 == 0);
  for (const GltfMesh& mesh : layout.meshes) {
    for (const GltfPrimitive& primitive : mesh.primitives) {
      for (const GltfArray& array : primitive.arrays) {
        if (layout.is_compressed()) {
          QUOIN_ASSERT(array.packed.size() == array.packed_view.bytes, "as large as its view");
          out.put(std::span<const std::byte>(array.packed));
        } else {
          write_gltf_array(layout.palette, mesh, primitive, array, out);
        }
        out.align('\0');
      }
    }
  }
  for (const GltfImage& image : layout.images) {
    QUOIN_ASSERT(image.png.size() == image.view.bytes, "as large as its view");
    out.put(std::span<const std::byte>(image.png));
    out.align('\0');
  }
  for (const GltfChannel& channel : layout.channels) {
    out.put(std::as_bytes(std::span(channel.seconds)));
    out.put(std::as_bytes(std::span(channel.values)));
  }
}

void write_chunk_header(std::uint64_t bytes, std::uint32_t kind, BlockWriter& out) {
  QUOIN_ASSERT(bytes % 4 == 0 && bytes <= std::numeric_limits<std::uint32_t>::max(), "a size of 32 bits");
  out.put(std::array<std::uint32_t, 2>{static_cast<std::uint32_t>(bytes), kind});
}

std::filesystem::path buffer_path(std::filesystem::path path) {
  return path.replace_extension(".bin");
}

/// Returns a file name as a relative URI reference (RFC 3986): all characters except unreserved ones are
/// percent-encoded.
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

using SharedLayout = std::shared_ptr<const GltfLayout>;

Result<SharedLayout> shared_layout(const SceneMeshes& meshes, const MeshFileOptions& options) {
  auto layout = lay_out_gltf(meshes, options);
  if (!layout) return layout.error();
  return std::make_shared<const GltfLayout>(std::move(*layout));
}

}  // namespace

Result<std::uint64_t> glb_file_bytes(std::uint64_t json_bytes, std::uint64_t buffer_bytes) {
  constexpr std::uint64_t kHeaderBytes = 12;
  constexpr std::uint64_t kChunkHeaderBytes = 8;
  std::uint64_t total = kHeaderBytes + kChunkHeaderBytes + json_bytes;
  if (buffer_bytes > 0) total += kChunkHeaderBytes + buffer_bytes;
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    return make_error(ErrorCode::LimitExceeded,
                      "the meshes take " + std::to_string(total) + " bytes, more than the 4294967295 of a GLB");
  }
  return total;
}

Result<std::vector<MeshFile>> plan_glb(const SceneMeshes& meshes, const std::filesystem::path& path,
                                       const MeshFileOptions& options) {
  const auto shared = shared_layout(meshes, options);
  if (!shared) return shared.error();
  std::string json = gltf_json(**shared, "");
  json.append((4 - json.size() % 4) % 4, ' ');
  const auto total = glb_file_bytes(json.size(), (*shared)->buffer_bytes);
  if (!total) return total.error();
  const auto write = [layout = *shared, json = std::move(json), total = *total](BlockWriter& out) {
    out.put(std::array<std::uint32_t, 3>{kMagic, kVersion, static_cast<std::uint32_t>(total)});
    write_chunk_header(json.size(), kJsonChunk, out);
    out.put_text(json);
    if (layout->buffer_bytes == 0) return;
    write_chunk_header(layout->buffer_bytes, kBinaryChunk, out);
    write_buffer(*layout, out);
  };
  return std::vector<MeshFile>{{path, *total, write}};
}

Result<std::vector<MeshFile>> plan_gltf(const SceneMeshes& meshes, const std::filesystem::path& path,
                                        const MeshFileOptions& options) {
  const auto shared = shared_layout(meshes, options);
  if (!shared) return shared.error();
  std::vector<MeshFile> files;
  const std::filesystem::path buffer_file = buffer_path(path);
  const std::uint64_t bytes = (*shared)->buffer_bytes;
  if (bytes > 0) {
    files.push_back({buffer_file, bytes, [layout = *shared](BlockWriter& out) { write_buffer(*layout, out); }});
  }
  std::string json = gltf_json(**shared, percent_encoded(buffer_file.filename().string()));
  files.push_back({path, 0, [json = std::move(json)](BlockWriter& out) { out.put_text(json); }});
  return files;
}

std::vector<std::filesystem::path> gltf_companions(const SceneMeshes& meshes, const std::filesystem::path& path) {
  for (const MeshPlacement& placement : meshes.placements) {
    if (placement.part >= meshes.parts.size()) continue;
    const auto& surfaces = meshes.parts[placement.part].surfaces;
    if (std::ranges::any_of(surfaces, [](const MeshView& view) { return !view.indices.empty(); })) {
      return {buffer_path(path)};
    }
  }
  return {};
}

}  // namespace quoin
