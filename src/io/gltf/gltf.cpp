#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <string_view>

#include <quoin/core/assert.h>
#include <quoin/mesh/occlusion.h>

#include "io/gltf/gltf_layout.h"

namespace quoin {

namespace {

static_assert(std::endian::native == std::endian::little, "glTF buffers are little-endian");
static_assert(sizeof(Vec3) == 12 && sizeof(LinearRgba16) == 8);

constexpr std::uint32_t kMagic = 0x46546C67;  // "glTF"
constexpr std::uint32_t kVersion = 2;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004E4942;  // "BIN"

/// Linear, as glTF says of COLOR_0.
std::uint8_t occlusion_grey(std::uint8_t occlusion) {
  return static_cast<std::uint8_t>(std::lround(occlusion_brightness(occlusion) * 255.0F));
}

void write_normals(const VertexTransform& transform, const MeshView& view, BlockWriter& out) {
  if (view.has_albedo()) {
    for (const Vec3& normal : view.normals) out.put(Vec3(transform.normal(normal)));
    return;
  }
  auto normals = transform.face_normals();
  for (Vec3& normal : normals) normal += 0.0F;  // no -0
  for (const Direction direction : view.directions) out.put(normals[static_cast<std::size_t>(direction)]);
}

/// Glass has the alpha of its body.
void write_smooth_colours(const GltfLayout& layout, const MeshView& view, BlockWriter& out) {
  const float thickness = layout.palette.smooth_thickness();
  std::uint16_t alpha = 0;
  for (std::size_t i = 0; i < view.positions.size(); ++i) {
    LinearRgba16 colour = linear_colour(view, i);
    if (is_transparent(view.surface)) {
      // Neighbours are mostly of one type.
      if (i == 0 || view.albedo[i] != view.albedo[i - 1]) alpha = glass_alpha(view.albedo[i], thickness);
      colour[3] = alpha;
    }
    out.put(colour);
  }
}

void write_colours(const GltfLayout& layout, const MeshView& view, BlockWriter& out) {
  if (view.has_albedo()) write_smooth_colours(layout, view, out);
  std::array<std::array<std::uint8_t, 4>, 4> greys;
  for (std::size_t i = 0; i < greys.size(); ++i) {
    const std::uint8_t grey = occlusion_grey(static_cast<std::uint8_t>(i));
    greys[i] = {grey, grey, grey, 255};
  }
  for (const std::uint8_t occlusion : view.block_occlusion) out.put(greys[occlusion]);
}

template <class Index>
void write_indices(const MeshView& view, bool turned, BlockWriter& out) {
  for (std::size_t i = 0; i < view.indices.size() && !out.failed(); i += 3) {
    const auto [a, b, c] = corners_of(view, i, turned);
    out.put(std::array<Index, 3>{static_cast<Index>(a), static_cast<Index>(b), static_cast<Index>(c)});
  }
}

void write_primitive(const GltfLayout& layout, const VertexTransform& transform, const GltfPrimitive& primitive,
                     BlockWriter& out) {
  const MeshView& view = primitive.view;
  for (const Vec3& position : view.positions) out.put(Vec3(transform.position(position)));
  write_normals(transform, view, out);
  if (!view.has_albedo()) {
    for (const VoxelType type : view.types) out.put(layout.palette.texel_centre(type));
  }
  if (primitive.occlusion.bytes == 0) {
    write_colours(layout, view, out);
  } else {
    write_colours(layout, without_occlusion(view), out);
    for (std::size_t i = 0; i < view.positions.size(); ++i) out.put(openness_at(view, i));
  }
  if (primitive.wide_indices) {
    write_indices<std::uint32_t>(view, transform.mirrors(), out);
  } else {
    write_indices<std::uint16_t>(view, transform.mirrors(), out);
  }
  out.align('\0');
}

/// Writes the buffer that `layout` describes, converting vertex by vertex; ends on a multiple of four.
///
/// Requires: the writer stands at a multiple of four.
void write_buffer(const GltfLayout& layout, BlockWriter& out) {
  QUOIN_ASSERT(out.bytes() % 4 == 0);
  for (const GltfMesh& mesh : layout.meshes) {
    for (const GltfPrimitive& primitive : mesh.primitives) write_primitive(layout, mesh.transform, primitive, out);
  }
  for (const GltfImage& image : layout.images) {
    out.put(std::span<const std::byte>(image.png));
    out.align('\0');
  }
}

void write_chunk_header(std::uint64_t bytes, std::uint32_t kind, BlockWriter& out) {
  out.put(std::array<std::uint32_t, 2>{static_cast<std::uint32_t>(bytes), kind});
}

std::filesystem::path buffer_path(std::filesystem::path path) {
  return path.replace_extension(".bin");
}

/// A file name as a relative URI reference (RFC 3986): everything but unreserved characters percent-encoded.
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

Result<SharedLayout> shared_layout(const SceneMeshes& meshes, OcclusionIn occlusion) {
  auto layout = lay_out_gltf(meshes, occlusion);
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
                      "the meshes take " + std::to_string(total) + " bytes, and a GLB holds 4294967295 at most");
  }
  return total;
}

Result<std::vector<MeshFile>> plan_glb(const SceneMeshes& meshes, const std::filesystem::path& path,
                                       OcclusionIn occlusion) {
  const auto shared = shared_layout(meshes, occlusion);
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
                                        OcclusionIn occlusion) {
  const auto shared = shared_layout(meshes, occlusion);
  if (!shared) return shared.error();
  std::vector<MeshFile> files;
  const std::filesystem::path beside = buffer_path(path);
  const std::uint64_t bytes = (*shared)->buffer_bytes;
  if (bytes > 0) {
    files.push_back({beside, bytes, [layout = *shared](BlockWriter& out) { write_buffer(*layout, out); }});
  }
  std::string json = gltf_json(**shared, percent_encoded(beside.filename().string()));
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
