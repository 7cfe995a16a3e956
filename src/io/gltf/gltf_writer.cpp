#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include <quoin/core/assert.h>
#include <quoin/mesh/occlusion.h>

#include "io/gltf/gltf_layout.h"

#ifdef QUOIN_HAVE_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

namespace quoin {

namespace {

static_assert(std::endian::native == std::endian::little, "glTF buffers are little-endian");
static_assert(sizeof(Vec3) == 12 && sizeof(LinearRgba16) == 8);

/// Three integers, padded to a multiple of four bytes.
template <class Int>
std::array<Int, 4> integers_from(const DVec3& v) {
  return {static_cast<Int>(std::lround(v.x)), static_cast<Int>(std::lround(v.y)), static_cast<Int>(std::lround(v.z)),
          Int{0}};
}

template <class Int>
void write_positions_as(const VertexTransform& transform, const MeshView& view, BlockWriter& out) {
  for (const Vec3& position : view.positions) out.put(integers_from<Int>(transform.position(position)));
}

void write_positions(const VertexTransform& transform, const MeshView& view, GltfComponent component,
                     BlockWriter& out) {
  switch (component) {
    case GltfComponent::Byte:
      return write_positions_as<std::int8_t>(transform, view, out);
    case GltfComponent::Short:
      return write_positions_as<std::int16_t>(transform, view, out);
    default:
      for (const Vec3& position : view.positions) out.put(Vec3(transform.position(position)));
  }
}

/// Returns normals in the form that `put` writes.
template <class Put>
void for_normals(const VertexTransform& transform, const MeshView& view, const Put& put) {
  if (view.has_albedo()) {
    for (const Vec3& normal : view.normals) put(Vec3(transform.normal(normal)));
    return;
  }
  QUOIN_ASSERT(view.directions.size() == view.positions.size(), "a direction for each vertex");
  auto normals = transform.face_normals();
  for (Vec3& normal : normals) normal += 0.0F;  // no -0
  if (view.looks.empty()) {
    for (const Direction direction : view.directions) put(normals[static_cast<std::size_t>(direction)]);
    return;
  }
  for (std::size_t i = 0; i < view.directions.size(); ++i) {
    const Vec3& own = view.looks[i].normal;
    const Vec3& of_side = normals[static_cast<std::size_t>(view.directions[i])];
    put(own == Vec3(0.0F) ? of_side : Vec3(transform.normal(own)) + 0.0F);
  }
}

void write_normals(const VertexTransform& transform, const MeshView& view, GltfComponent component, BlockWriter& out) {
  switch (component) {
    case GltfComponent::Byte:
      return for_normals(transform, view,
                         [&](const Vec3& n) { out.put(integers_from<std::int8_t>(DVec3(n) * 127.0)); });
    case GltfComponent::Short:
      return for_normals(transform, view,
                         [&](const Vec3& n) { out.put(integers_from<std::int16_t>(DVec3(n) * 32767.0)); });
    default:
      return for_normals(transform, view, [&](const Vec3& n) { out.put(n); });
  }
}

void write_texture_coordinates(const MaterialPalette& palette, const MeshView& view, GltfComponent component,
                               BlockWriter& out) {
  for (const VoxelType type : view.types) {
    const std::array<float, 2> uv = palette.texel_centre(type);
    if (component == GltfComponent::Float) {
      out.put(uv);
      continue;
    }
    const auto share = [](float value) { return static_cast<std::uint16_t>(std::lround(value * 65535.0F)); };
    out.put(std::array<std::uint16_t, 2>{share(uv[0]), share(uv[1])});
  }
}

/// Writes linear colours, as glTF requires for COLOR_0.
std::uint8_t occlusion_grey(std::uint8_t occlusion) {
  return static_cast<std::uint8_t>(std::lround(occlusion_brightness(occlusion) * 255.0F));
}

/// Glass gets the alpha of its body.
void write_smooth_colours(float thickness, const MeshView& view, BlockWriter& out) {
  std::uint16_t alpha = 0;
  QUOIN_ASSERT(view.albedo.size() == view.positions.size(), "a colour for each vertex");
  for (std::size_t i = 0; i < view.positions.size(); ++i) {
    LinearRgba16 colour = linear_colour(view, i);
    if (is_transparent(view.surface)) {
      // Adjacent vertices mostly have the same type.
      if (i == 0 || view.albedo[i] != view.albedo[i - 1]) alpha = glass_alpha(view.albedo[i], thickness);
      colour[3] = alpha;
    }
    out.put(colour);
  }
}

/// Writes the light of blocky meshes, darkened by their occlusion.
void write_light(const MeshView& view, BlockWriter& out) {
  QUOIN_ASSERT(view.light.size() == view.positions.size(), "a light for each vertex");
  for (std::size_t i = 0; i < view.positions.size(); ++i) {
    LinearRgba16 light = view.light[i];
    const float open = openness_at(view, i);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      light[channel] = static_cast<std::uint16_t>(std::lround(static_cast<float>(light[channel]) * open));
    }
    light[3] = 65'535;
    out.put(light);
  }
}

void write_colours(const MaterialPalette& palette, std::size_t material, const MeshView& view, BlockWriter& out) {
  if (view.has_albedo()) return write_smooth_colours(palette.smooth_thickness(material), view, out);
  if (!view.light.empty()) return write_light(view, out);
  std::array<std::array<std::uint8_t, 4>, 4> greys;
  for (std::size_t i = 0; i < greys.size(); ++i) {
    const std::uint8_t grey = occlusion_grey(static_cast<std::uint8_t>(i));
    greys[i] = {grey, grey, grey, 255};
  }
  for (const std::uint8_t occlusion : view.block_occlusion) {
    QUOIN_ASSERT(occlusion < greys.size(), "occlusion < 4");
    out.put(greys[occlusion]);
  }
}

template <class Index>
void write_indices(const MeshView& view, bool turned, BlockWriter& out) {
  QUOIN_ASSERT(view.positions.size() - 1 <= std::numeric_limits<Index>::max(), "vertices that the indices can name");
  for (std::size_t i = 0; i < view.indices.size() && !out.failed(); i += 3) {
    const auto [a, b, c] = corners_of(view, i, turned);
    out.put(std::array<Index, 3>{static_cast<Index>(a), static_cast<Index>(b), static_cast<Index>(c)});
  }
}

bool has_array(const GltfPrimitive& primitive, GltfArrayKind kind) {
  return std::ranges::any_of(primitive.arrays, [&](const GltfArray& array) { return array.kind == kind; });
}

/// The bounds of all vertices.
struct StoredBox {
  DVec3 min{std::numeric_limits<double>::infinity()};
  DVec3 max{-std::numeric_limits<double>::infinity()};
};

/// Returns the centre of the integer lattice: the pivot, or the centre of the box if the pivot is outside of it.
DVec3 origin_for(const StoredBox& box) {
  const bool has_pivot =
      glm::all(glm::lessThanEqual(box.min, DVec3(0.0))) && glm::all(glm::greaterThanEqual(box.max, DVec3(0.0)));
  return has_pivot ? DVec3(0.0) : (box.min + box.max) * 0.5;
}

double farthest_from(const DVec3& origin, const StoredBox& box) {
  const DVec3 away = glm::max(glm::abs(box.min - origin), glm::abs(box.max - origin));
  return std::max({away.x, away.y, away.z});
}

/// Returns the lattice for blocks: whole voxels, with an origin less than one voxel from the pivot or, far from it,
/// from the centre of the box.
GltfQuantization quantize_blocks(const VertexTransform& transform, const StoredBox& box,
                                 std::span<const MaterialSurfaces::Surface> surfaces) {
  constexpr double kLargest = 32'767.0;
  constexpr double kLargestByte = 127.0;
  GltfQuantization stored;
  stored.origin = box.min - glm::floor(box.min);
  if (farthest_from(stored.origin, box) > kLargest) stored.origin += glm::floor((box.min + box.max) * 0.5);
  const double farthest = farthest_from(stored.origin, box);
  for (const auto& surface : surfaces) {
    for (const Vec3& position : surface.view.positions) {
      const DVec3 steps = transform.position(position) - stored.origin;
      if (steps != glm::round(steps)) return {};
    }
  }
  if (farthest > kLargest) return {};
  stored.component = farthest <= kLargestByte ? GltfComponent::Byte : GltfComponent::Short;
  return stored;
}

}  // namespace

GltfQuantization quantize_positions(const VertexTransform& transform,
                                    std::span<const MaterialSurfaces::Surface> surfaces) {
  StoredBox box;
  for (const auto& surface : surfaces) {
    for (const Vec3& position : surface.view.positions) {
      const DVec3 p = transform.position(position);
      box.min = glm::min(box.min, p);
      box.max = glm::max(box.max, p);
    }
  }
  if (surfaces.empty()) return {};
  if (!surfaces.front().view.has_albedo()) return quantize_blocks(transform, box, surfaces);
  constexpr double kLargest = 32'767.0;
  GltfQuantization stored;
  stored.component = GltfComponent::Short;
  stored.origin = origin_for(box);
  stored.step = farthest_from(stored.origin, box) / kLargest;
  return stored.step > 0.0 ? stored : GltfQuantization{};
}

void write_gltf_array(const MaterialPalette& palette, const GltfMesh& mesh, const GltfPrimitive& primitive,
                      const GltfArray& array, BlockWriter& out) {
  const MeshView& view = primitive.view;
  switch (array.kind) {
    case GltfArrayKind::Position:
      return write_positions(mesh.transform, view, array.component, out);
    case GltfArrayKind::Normal:
      return write_normals(mesh.transform, view, array.component, out);
    case GltfArrayKind::AtlasCoordinate:
      for (const std::array<float, 2>& uv : view.atlas) out.put(uv);
      return;
    case GltfArrayKind::PaletteCoordinate:
      return write_texture_coordinates(palette, view, array.component, out);
    case GltfArrayKind::FaceCoordinate:
      for (const std::array<float, 2>& uv : palette.face_coordinates(view)) out.put(uv);
      return;
    case GltfArrayKind::Colour:
      return write_colours(palette, primitive.material,
                           has_array(primitive, GltfArrayKind::Occlusion) ? without_occlusion(view) : view, out);
    case GltfArrayKind::Occlusion:
      for (std::size_t i = 0; i < view.positions.size(); ++i) out.put(openness_at(view, i));
      return;
    case GltfArrayKind::Materials:
      for (const VertexMaterials& each : view.materials) out.put(each.types);
      return;
    case GltfArrayKind::Weights:
      for (const VertexMaterials& each : view.materials) out.put(each.weights);
      return;
    case GltfArrayKind::Index:
      if (array.component == GltfComponent::UnsignedInt) {
        return write_indices<std::uint32_t>(view, mesh.transform.mirrors(), out);
      }
      return write_indices<std::uint16_t>(view, mesh.transform.mirrors(), out);
  }
}

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

std::vector<std::filesystem::path> gltf_companions(const SceneMeshes& meshes, const std::filesystem::path& path,
                                                   const MeshFileOptions& /*options*/) {
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
