// Vertices are made one block at a time, one element after another, in memory that stays in the cache. The block is
// then copied to the caller's memory.

#include <quoin/mesh/vertex_writer.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <utility>

#include <glm/common.hpp>
#include <quoin/core/assert.h>

#include "core/srgb.h"

namespace quoin {
namespace {

constexpr std::size_t kBlockBytes = 16'384;
static_assert(kBlockBytes >= 4 * VertexLayout::kMaxStride);

// The address and stride of one element in a block's vertices.
struct Column {
  std::byte* at;
  std::size_t stride;
};

// The sources of one element of the vertices: a value per vertex, per quad, or per corner of a quad.
// `put<Value>(convert)` writes each value after conversion.
template <class ValueOf>
struct PerVertex {
  Column column;
  std::size_t count;
  ValueOf value_of;

  template <class Value, class Convert>
  void put(Convert&& convert) const {
    std::byte* at = column.at;
    for (std::size_t i = 0; i < count; ++i, at += column.stride) {
      const Value value = convert(value_of(i));
      std::memcpy(at, &value, sizeof value);
    }
  }
};
template <class ValueOf>
PerVertex(Column, std::size_t, ValueOf) -> PerVertex<ValueOf>;

// `Face`: Quad or ShapeFace.
template <class Face, class ValueOf>
struct PerQuad {
  Column column;
  std::span<const Face> quads;
  ValueOf value_of;

  template <class Value, class Convert>
  void put(Convert&& convert) const {
    std::byte* at = column.at;
    for (const Face& quad : quads) {
      const Value value = convert(value_of(quad));
      for (int corner = 0; corner < 4; ++corner, at += column.stride) std::memcpy(at, &value, sizeof value);
    }
  }
};
template <class Face, class ValueOf>
PerQuad(Column, std::span<const Face>, ValueOf) -> PerQuad<Face, ValueOf>;

template <class Face, class ValuesOf>
struct PerCorner {
  Column column;
  std::span<const Face> quads;
  ValuesOf values_of;  // four

  template <class Value, class Convert>
  void put(Convert&& convert) const {
    std::byte* at = column.at;
    for (const Face& quad : quads) {
      for (const auto& of_corner : values_of(quad)) {
        const Value value = convert(of_corner);
        std::memcpy(at, &value, sizeof value);
        at += column.stride;
      }
    }
  }
};
template <class Face, class ValuesOf>
PerCorner(Column, std::span<const Face>, ValuesOf) -> PerCorner<Face, ValuesOf>;

using Float3 = std::array<float, 3>;
using Float4 = std::array<float, 4>;
using Byte4 = std::array<std::uint8_t, 4>;
using SignedByte4 = std::array<std::int8_t, 4>;
using Short4 = std::array<std::int16_t, 4>;

std::int8_t snorm8(float value) {
  return static_cast<std::int8_t>(std::lround(std::clamp(value, -1.0F, 1.0F) * 127.0F));
}
std::uint8_t unorm8(float value) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0F, 1.0F) * 255.0F));
}

Float3 float3(Vec3 v) {
  return {v.x, v.y, v.z};
}
Float4 float4(Vec3 v, float w) {
  return {v.x, v.y, v.z, w};
}
SignedByte4 snorm8x4(Vec3 v) {
  return {snorm8(v.x), snorm8(v.y), snorm8(v.z), 0};
}

const std::array<Vec3, 6>& face_normals() {
  static const std::array<Vec3, 6> normals = [] {
    std::array<Vec3, 6> made{};
    for (const Direction d : kDirections) made[static_cast<std::size_t>(d)] = Vec3(normal_of(d));
    return made;
  }();
  return normals;
}

// Each of these takes one of the three sources above.
template <class Source>
void put_positions(VertexFormat format, const Source& positions) {
  if (format == VertexFormat::Float32x3) return positions.template put<Float3>([](Vec3 v) { return float3(v); });
  positions.template put<Float4>([](Vec3 position) { return float4(position, 1.0F); });
}

template <class Source>
void put_normals(VertexFormat format, const Source& normals) {
  switch (format) {
    case VertexFormat::Float32x3:
      return normals.template put<Float3>([](Vec3 v) { return float3(v); });
    case VertexFormat::Float32x4:
      return normals.template put<Float4>([](Vec3 normal) { return float4(normal, 0.0F); });
    default:
      return normals.template put<SignedByte4>([](Vec3 v) { return snorm8x4(v); });
  }
}

template <class Source>
void put_block_occlusion(VertexFormat format, const Source& occlusion) {
  const std::array<float, 4> brightness = {occlusion_brightness(0), occlusion_brightness(1), occlusion_brightness(2),
                                           occlusion_brightness(3)};
  std::array<std::uint8_t, 4> bytes{};
  std::transform(brightness.begin(), brightness.end(), bytes.begin(), unorm8);
  switch (format) {
    case VertexFormat::Float32:
      return occlusion.template put<float>([&](std::uint8_t value) { return brightness[value & 3U]; });
    case VertexFormat::Unorm8:
      return occlusion.template put<std::uint8_t>([&](std::uint8_t value) { return bytes[value & 3U]; });
    default:
      return occlusion.template put<std::uint8_t>([](std::uint8_t value) { return value; });
  }
}

// Writes numbers, in as many bytes as the format has. Numbers above 16 bits (of textures) become the greatest one.
template <class Source>
void put_numbers(VertexFormat format, const Source& numbers) {
  switch (format) {
    case VertexFormat::Uint8:
      return numbers.template put<std::uint8_t>([](auto number) { return static_cast<std::uint8_t>(number); });
    case VertexFormat::Uint16:
      return numbers.template put<std::uint16_t>([](auto number) {
        return static_cast<std::uint16_t>(std::min(static_cast<std::uint32_t>(number), std::uint32_t{0xFFFF}));
      });
    default:
      return numbers.template put<std::uint32_t>([](auto number) { return static_cast<std::uint32_t>(number); });
  }
}

// Returns the materials of a smooth vertex.
VertexMaterials materials_at(const MeshView& mesh, std::size_t vertex) {
  if (!mesh.materials.empty()) return mesh.materials[vertex];
  VertexMaterials only;
  only.types[0] = mesh.types.empty() ? kAir : mesh.types[vertex];
  only.weights[0] = 255;
  return only;
}

template <class Source>
void put_weights(VertexFormat format, const Source& materials) {
  if (format == VertexFormat::Unorm8x4) {
    return materials.template put<Byte4>([](const VertexMaterials& each) { return each.weights; });
  }
  materials.template put<Float4>([](const VertexMaterials& each) {
    const auto share = [&](std::size_t i) { return static_cast<float>(each.weights[i]) / 255.0F; };
    return Float4{share(0), share(1), share(2), share(3)};
  });
}

// Returns the first bytes of an encoded colour.
template <std::size_t kSize>
std::array<std::byte, kSize> first_bytes(const std::array<std::byte, 16>& bytes) {
  std::array<std::byte, kSize> first;
  std::memcpy(first.data(), bytes.data(), kSize);
  return first;
}

template <class Source>
void put_encoded(VertexFormat format, const Source& colours) {
  switch (size_of(format)) {
    case 4:
      return colours.template put<std::array<std::byte, 4>>([](const auto& bytes) { return first_bytes<4>(bytes); });
    case 8:
      return colours.template put<std::array<std::byte, 8>>([](const auto& bytes) { return first_bytes<8>(bytes); });
    default:
      return colours.template put<std::array<std::byte, 16>>([](const auto& bytes) { return first_bytes<16>(bytes); });
  }
}

std::array<std::byte, 16> encoded(const LinearRgba16& linear, VertexFormat format) {
  std::array<std::byte, 16> bytes{};
  const auto share = [&](std::size_t i) { return static_cast<float>(linear[i]) / 65'535.0F; };
  const auto put = [&](const auto& value) { std::memcpy(bytes.data(), &value, sizeof value); };
  if (format == VertexFormat::Float32x4) {
    put(Float4{share(0), share(1), share(2), share(3)});
  } else if (format == VertexFormat::Unorm16x4) {
    put(linear);
  } else if (format == VertexFormat::Unorm8x4) {
    put(Byte4{unorm8(share(0)), unorm8(share(1)), unorm8(share(2)), unorm8(share(3))});
  } else {
    const SrgbEncoder& encode = SrgbEncoder::shared();
    put(Byte4{encode(share(0)), encode(share(1)), encode(share(2)), unorm8(share(3))});
  }
  return bytes;
}

std::array<std::byte, 16> encoded(Rgba8 colour, VertexFormat format) {
  std::array<std::byte, 16> bytes{};
  const Float4 linear = {linear_from_srgb(colour.r), linear_from_srgb(colour.g), linear_from_srgb(colour.b),
                         static_cast<float>(colour.a) / 255.0F};
  const auto put = [&](const auto& value) { std::memcpy(bytes.data(), &value, sizeof value); };
  if (format == VertexFormat::Float32x4) {
    put(linear);
  } else if (format == VertexFormat::Unorm8x4Srgb) {
    put(Byte4{colour.r, colour.g, colour.b, colour.a});
  } else if (format == VertexFormat::Unorm8x4) {
    put(Byte4{unorm8(linear[0]), unorm8(linear[1]), unorm8(linear[2]), colour.a});
  } else {
    LinearRgba16 wide{};
    for (std::size_t i = 0; i < 4; ++i) wide[i] = static_cast<std::uint16_t>(std::lround(linear[i] * 65'535.0F));
    put(wide);
  }
  return bytes;
}

constexpr std::uint32_t kNoTexture = ~std::uint32_t{0};

// Returns the number of a face's texture, which may be null.
std::uint32_t number_in(const TextureSet& textures, const VoxelFace& face) {
  if (face.texture.is_null()) return kNoTexture;
  const auto layer = textures.find(face.texture);
  const bool fits = layer && layer->array <= 0xFFFFU && layer->layer <= 0xFFFFU;
  return fits ? layer->array << 16 | layer->layer : kNoTexture;
}

std::size_t face_of(Direction direction) {
  return static_cast<std::size_t>(direction);
}

// Returns the axes of textures by [direction][turn + 4 * mirrored].
const std::array<std::array<TextureFrame, 8>, 6>& texture_frames() {
  static const std::array<std::array<TextureFrame, 8>, 6> frames = [] {
    std::array<std::array<TextureFrame, 8>, 6> made{};
    for (const Direction direction : kDirections) {
      for (std::uint8_t i = 0; i < 8; ++i) {
        VoxelFace face;
        face.turn = i % 4;
        face.mirrored = i >= 4;
        made[face_of(direction)][i] = texture_frame(face, direction);
      }
    }
    return made;
  }();
  return frames;
}

// Calls `make(first, count, block)` for blocks of at most `per_block` items with `vertices` vertices each.
template <class Make>
void by_blocks(std::size_t count, std::size_t vertices, std::size_t stride, std::byte* out, Make&& make) {
  QUOIN_ASSERT(stride != 0 && vertices * stride <= kBlockBytes, "at least one item per block");
  alignas(64) std::array<std::byte, kBlockBytes> block{};
  const std::size_t per_block = kBlockBytes / (vertices * stride);
  for (std::size_t first = 0; first < count; first += per_block) {
    const std::size_t here = std::min(per_block, count - first);
    make(first, here, block.data());
    std::memcpy(out, block.data(), here * vertices * stride);
    out += here * vertices * stride;
  }
}

void put_quad_positions(VertexFormat format, std::span<const Quad> quads, Vec3 origin, const Column& column) {
  const PerCorner corners{column, quads, [](Quad quad) { return corners_of(quad); }};
  switch (format) {
    case VertexFormat::Sint16x4:
      return corners.put<Short4>([whole = IVec3(origin)](IVec3 corner) {
        const IVec3 at = corner + whole;
        return Short4{static_cast<std::int16_t>(at.x), static_cast<std::int16_t>(at.y), static_cast<std::int16_t>(at.z),
                      1};
      });
    case VertexFormat::Uint8x4:
      return corners.put<Byte4>([whole = IVec3(origin)](IVec3 corner) {
        const IVec3 at = corner + whole;
        return Byte4{static_cast<std::uint8_t>(at.x), static_cast<std::uint8_t>(at.y), static_cast<std::uint8_t>(at.z),
                     1};
      });
    case VertexFormat::Float32x3:
      return corners.put<Float3>([&](IVec3 corner) { return float3(Vec3(corner) + origin); });
    default:
      return corners.put<Float4>([&](IVec3 corner) { return float4(Vec3(corner) + origin, 1.0F); });
  }
}

// Voxels from corner 0 along u and v.
std::array<std::array<int, 2>, 4> uvs_of(const Quad& quad) {
  const int u = quad.size_u();
  const int v = quad.size_v();
  return {{{0, 0}, {u, 0}, {u, v}, {0, v}}};
}

void put_uvs(VertexFormat format, std::span<const Quad> quads, const Column& column) {
  const PerCorner uvs{column, quads, [](Quad quad) { return uvs_of(quad); }};
  if (format == VertexFormat::Float32x2) {
    return uvs.put<std::array<float, 2>>([](const std::array<int, 2>& uv) {
      return std::array<float, 2>{static_cast<float>(uv[0]), static_cast<float>(uv[1])};
    });
  }
  uvs.put<std::array<std::uint8_t, 2>>([](const std::array<int, 2>& uv) {
    return std::array<std::uint8_t, 2>{static_cast<std::uint8_t>(uv[0]), static_cast<std::uint8_t>(uv[1])};
  });
}

// Returns for each vertex of blocks the lowest corner of the face that contains it: of all triangles that share
// vertices with its own. Coordinates relative to it are small, and exact in the samplers of clients.
std::vector<Vec3> corners_of_faces(const MeshView& view) {
  std::vector<std::uint32_t> face(view.positions.size());  // a vertex of the same face, at most its own index
  std::iota(face.begin(), face.end(), 0U);
  const auto first_of = [&](std::uint32_t vertex) {
    for (; face[vertex] != vertex; vertex = face[vertex]) face[vertex] = face[face[vertex]];
    return vertex;
  };
  for (std::size_t i = 0; i < view.indices.size(); i += 3) {
    const std::array<std::uint32_t, 3> first = {first_of(view.indices[i]), first_of(view.indices[i + 1]),
                                                first_of(view.indices[i + 2])};
    for (const std::uint32_t each : first) face[first_of(each)] = std::min({first[0], first[1], first[2]});
  }
  std::vector<Vec3> corners(view.positions.begin(), view.positions.end());
  const auto vertices = static_cast<std::uint32_t>(face.size());
  for (std::uint32_t i = 0; i < vertices; ++i) {
    const std::uint32_t first = first_of(i);
    corners[first] = glm::min(corners[first], view.positions[i]);
  }
  for (std::uint32_t i = 0; i < vertices; ++i) corners[i] = glm::floor(corners[first_of(i)]);
  return corners;
}

bool is_whole(Vec3 origin, float low, float high) {
  const auto fits = [&](float c) { return c == std::floor(c) && c >= low && c <= high; };
  return fits(origin.x) && fits(origin.y) && fits(origin.z);
}

// Corners are at 0 to 64.
[[maybe_unused]] bool origin_fits(const VertexLayout& layout, Vec3 origin) {
  return std::all_of(layout.elements.begin(), layout.elements.end(), [&](const VertexElement& element) {
    if (element.format == VertexFormat::Sint16x4) return is_whole(origin, -32'768.0F, 32'767.0F - kChunkEdge);
    if (element.format == VertexFormat::Uint8x4) return is_whole(origin, 0.0F, 255.0F - kChunkEdge);
    return true;
  });
}

[[maybe_unused]] bool some_source_has(const VertexLayout& layout) {
  using enum VertexSource;
  return can_write(layout, Quads) || can_write(layout, Blocks) || can_write(layout, SmoothChunk) ||
         can_write(layout, Smooth);
}

}  // namespace

VertexWriter::VertexWriter(VertexLayout layout, const VoxelRegistry& types, const TextureSet& textures)
    : layout_(std::move(layout)) {
  QUOIN_ASSERT(some_source_has(layout_), "a layout that can be written");
  colours_.resize(layout_.elements.size());
  for (std::size_t i = 0; i < colours_.size(); ++i) {
    const VertexElement& element = layout_.elements[i];
    const bool is_tint = element.attribute == VertexAttribute::Tint;
    if (element.attribute != VertexAttribute::Colour && !is_tint) continue;
    colours_[i].reserve((is_tint ? 6 : 1) * types.size() + 1);
    if (is_tint) {
      for_each_face(types, [&](const VoxelFace* face, const VoxelProperties& type) {
        colours_[i].push_back(encoded(face == nullptr ? type.colour : face->tint, element.format));
      });
    } else {
      for (std::size_t type = 0; type < types.size(); ++type) {
        colours_[i].push_back(encoded(types[static_cast<VoxelType>(type)].colour, element.format));
      }
    }
    colours_[i].push_back(encoded(Rgba8{255, 255, 255, 255}, element.format));
  }
  read_faces(types, textures);
}

template <class Visit>
void VertexWriter::for_each_face(const VoxelRegistry& types, const Visit& visit) {
  for (std::size_t type = 0; type < types.size(); ++type) {
    const VoxelProperties& properties = types[static_cast<VoxelType>(type)];
    for (const Direction direction : kDirections) {
      visit(properties.faces.empty() ? nullptr : &properties.faces[direction], properties);
    }
  }
  for (std::size_t type = 0; type < types.size(); ++type) {
    const VoxelProperties& properties = types[static_cast<VoxelType>(type)];
    if (properties.orientations.empty() || properties.faces.empty()) continue;
    for (int i = 0; i < AxisOrientation::kCount; ++i) {
      for (const Direction direction : kDirections) {
        const VoxelFace face = turned_face(properties.faces, direction, AxisOrientation::at(i));
        visit(&face, properties);
      }
    }
  }
}

void VertexWriter::read_faces(const VoxelRegistry& types, const TextureSet& textures) {
  const auto has = [&](VertexAttribute attribute) {
    return std::ranges::any_of(layout_.elements,
                               [&](const VertexElement& each) { return each.attribute == attribute; });
  };
  if (has(VertexAttribute::Texture) && (types.has_shapes() || types.has_turned_by_state())) layers_ = textures;
  if (!types.has_textures()) return;
  if (types.has_turned_by_state()) {
    turned_.assign(types.size(), 0);
    std::size_t next = 6 * types.size();
    for (std::size_t type = 1; type < types.size(); ++type) {
      const VoxelProperties& properties = types[static_cast<VoxelType>(type)];
      if (properties.orientations.empty() || properties.faces.empty()) continue;
      turned_[type] = next;
      next += std::size_t{6} * AxisOrientation::kCount;
    }
  }
  const bool has_textures = has(VertexAttribute::Texture);
  const bool has_turns = has(VertexAttribute::TextureUv);
  for_each_face(types, [&](const VoxelFace* face, const VoxelProperties& /*type*/) {
    if (has_turns) {
      turns_.push_back(face == nullptr ? std::uint8_t{0}
                                       : static_cast<std::uint8_t>(face->turn + (face->mirrored ? 4 : 0)));
    }
    if (!has_textures) return;
    textures_.push_back(face == nullptr ? kNoTexture : number_in(textures, *face));
  });
}

std::array<std::array<float, 2>, 4> VertexWriter::texture_uvs(const Quad& quad) const {
  const TextureFrame& frame = texture_frames()[face_of(quad.direction())][turn(face_number(quad))];
  const std::array<IVec3, 4> corners = corners_of(quad);
  std::array<std::array<float, 2>, 4> coordinates{};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    coordinates[i] = texture_coordinates(frame, Vec3(corners[i] - quad.voxel()));
  }
  return coordinates;
}

std::vector<std::array<float, 2>> VertexWriter::texture_uvs(const MeshView& mesh) const {
  const std::vector<Vec3> corners = corners_of_faces(mesh);
  std::vector<std::array<float, 2>> coordinates(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (!mesh.looks.empty() && mesh.looks[i].face != 0) {
      coordinates[i] = mesh.looks[i].uv;
      continue;
    }
    const Direction direction = mesh.directions[i];
    const TextureFrame& frame = texture_frames()[face_of(direction)][turn(face_number(mesh.types[i], direction))];
    coordinates[i] = texture_coordinates(frame, mesh.positions[i] - corners[i]);
  }
  return coordinates;
}

void VertexWriter::write(std::span<const Quad> quads, Vec3 origin, std::span<std::byte> out) const {
  QUOIN_ASSERT(out.size() >= bytes_needed(vertices_needed(quads.size())), "out holds 4 vertices per quad");
  QUOIN_ASSERT(origin_fits(layout_, origin), "positions are integers within the format's range");
  by_blocks(quads.size(), 4, layout_.stride, out.data(), [&](std::size_t first, std::size_t count, std::byte* block) {
    for (std::size_t i = 0; i < layout_.elements.size(); ++i)
      write_element(i, quads.subspan(first, count), origin, block);
  });
}

void VertexWriter::write_element(std::size_t index, std::span<const Quad> quads, Vec3 origin, std::byte* block) const {
  QUOIN_ASSERT(index < layout_.elements.size(), "an element of the layout");
  const VertexElement& element = layout_.elements[index];
  const Column column{block + element.offset, layout_.stride};
  const VertexFormat format = element.format;
  switch (element.attribute) {
    case VertexAttribute::Position:
      return put_quad_positions(format, quads, origin, column);
    case VertexAttribute::Normal: {
      const std::array<Vec3, 6>& normals = face_normals();
      return put_normals(format, PerQuad{column, quads, [&](Quad quad) { return normals[face_of(quad.direction())]; }});
    }
    case VertexAttribute::Face:
      return put_numbers(format, PerQuad{column, quads, [](Quad quad) { return quad.direction(); }});
    case VertexAttribute::Colour:
      return put_encoded(
          format, PerQuad{column, quads, [&](Quad quad) -> const Colour& { return colour(index, quad.type()); }});
    case VertexAttribute::Occlusion:
    case VertexAttribute::Brightness:
      return put_block_occlusion(format, PerCorner{column, quads, [](Quad quad) { return quad.occlusion(); }});
    case VertexAttribute::Type:
      return put_numbers(format, PerQuad{column, quads, [](Quad quad) { return quad.type(); }});
    case VertexAttribute::Uv:
      return put_uvs(format, quads, column);
    case VertexAttribute::Texture:
      return put_numbers(format, PerQuad{column, quads, [&](Quad quad) { return texture(face_number(quad)); }});
    case VertexAttribute::TextureUv:
      return PerCorner{column, quads, [&](Quad quad) { return texture_uvs(quad); }}.put<std::array<float, 2>>(
          [](const std::array<float, 2>& uv) { return uv; });
    case VertexAttribute::Tint:
      return put_encoded(
          format, PerQuad{column, quads, [&](Quad quad) -> const Colour& { return colour(index, face_number(quad)); }});
    case VertexAttribute::Materials:  // quads have none
    case VertexAttribute::Weights:
      return;
  }
}

void VertexWriter::write(const SmoothChunkMesh& mesh, Vec3 origin, std::span<std::byte> out) const {
  QUOIN_ASSERT(can_write(layout_, VertexSource::SmoothChunk), "a layout for smooth chunks");
  MeshView view;
  view.positions = {mesh.positions.data(), mesh.positions.size()};
  view.normals = {mesh.normals.data(), mesh.normals.size()};
  view.occlusion = {mesh.occlusion.data(), mesh.occlusion.size()};
  write_view(view, origin, out);
}

void VertexWriter::write(const MeshView& mesh, Vec3 origin, std::span<std::byte> out) const {
  QUOIN_ASSERT(can_write(layout_, mesh.has_albedo() ? VertexSource::Smooth : VertexSource::Blocks),
               "a layout for this kind of mesh");
  write_view(mesh, origin, out);
}

void VertexWriter::add_face(const VoxelFace& face, OwnFaces& to) const {
  to.tints.resize(layout_.elements.size());
  bool has_texture = false;
  for (std::size_t i = 0; i < layout_.elements.size(); ++i) {
    const VertexElement& element = layout_.elements[i];
    has_texture |= element.attribute == VertexAttribute::Texture;
    if (element.attribute == VertexAttribute::Tint) to.tints[i].push_back(encoded(face.tint, element.format));
  }
  if (has_texture) to.textures.push_back(number_in(layers_, face));
}

VertexWriter::OwnFaces VertexWriter::faces_of(const MeshView& mesh) const {
  OwnFaces faces;
  if (mesh.looks.empty()) return faces;
  for (const VoxelFace& face : mesh.faces) add_face(face, faces);
  return faces;
}

// Sets `numbers` to the number of each face's look in the result: 1 + an index, or 0 for looks of types.
VertexWriter::OwnFaces VertexWriter::faces_of(std::span<const ShapeFace> shapes,
                                              std::vector<std::uint32_t>& numbers) const {
  OwnFaces faces;
  std::unordered_map<const VoxelFace*, std::uint32_t> known;
  numbers.reserve(shapes.size());
  for (const ShapeFace& shape : shapes) {
    const ModelFace& face = shape.model_face();
    if (face.look < 6) {
      numbers.push_back(0);
      continue;
    }
    const VoxelFace& look = shape.model->looks[face.look - std::size_t{6}];
    const auto [number, is_new] = known.try_emplace(&look, static_cast<std::uint32_t>(known.size() + 1));
    if (is_new) add_face(look, faces);
    numbers.push_back(number->second);
  }
  return faces;
}

// Faces of shapes that are written together.
struct VertexWriter::ShapeBlock {
  std::span<const ShapeFace> shapes;
  std::span<const std::uint32_t> numbers;  // of their looks in `faces`, as `faces_of` sets them; empty if not needed
  const OwnFaces* faces;

  [[nodiscard]] std::uint32_t number_of(const ShapeFace& shape) const {
    return numbers[static_cast<std::size_t>(&shape - shapes.data())];
  }
};

void VertexWriter::write(std::span<const ShapeFace> faces, Vec3 origin, std::span<std::byte> out) const {
  QUOIN_ASSERT(can_write(layout_, VertexSource::Shapes), "a layout for faces of shapes");
  QUOIN_ASSERT(out.size() >= bytes_needed(vertices_needed(faces.size())), "out holds 4 vertices per face");
  const bool has_looks = std::ranges::any_of(layout_.elements, [](const VertexElement& each) {
    return each.attribute == VertexAttribute::Texture || each.attribute == VertexAttribute::Tint;
  });
  std::vector<std::uint32_t> numbers;
  const OwnFaces own = has_looks ? faces_of(faces, numbers) : OwnFaces();
  by_blocks(faces.size(), 4, layout_.stride, out.data(), [&](std::size_t first, std::size_t count, std::byte* block) {
    const auto of_block =
        has_looks ? std::span<const std::uint32_t>(numbers).subspan(first, count) : std::span<const std::uint32_t>();
    const ShapeBlock shapes{faces.subspan(first, count), of_block, &own};
    for (std::size_t i = 0; i < layout_.elements.size(); ++i) write_element(i, shapes, origin, block);
  });
}

std::array<std::array<float, 2>, 4> VertexWriter::texture_uvs(const ShapeFace& face) const {
  const ModelFace& shown = face.model_face();
  if (shown.look >= 6) return shown.uv;
  const std::uint8_t packed = turn(face_number(face.type, static_cast<Direction>(shown.look)));
  VoxelFace look;
  look.turn = packed % 4;
  look.mirrored = packed >= 4;
  std::array<std::array<float, 2>, 4> coordinates{};
  for (std::size_t i = 0; i < 4; ++i) coordinates[i] = texture_uv(shown, look, shown.uv[i]);
  return coordinates;
}

namespace {

// Positions of the corners of shapes' faces.
std::array<Vec3, 4> corners_of(const ShapeFace& face, Vec3 origin) {
  return {face.corner(0) + origin, face.corner(1) + origin, face.corner(2) + origin, face.corner(3) + origin};
}

// Voxels from the voxel's lowest corner along u and v.
std::array<std::array<float, 2>, 4> uvs_of(const ShapeFace& face) {
  const ModelFace& shown = face.model_face();
  const FaceFrame& frame = frame_of(shown.direction);
  std::array<std::array<float, 2>, 4> uvs{};
  for (std::size_t i = 0; i < 4; ++i) uvs[i] = {shown.corners[i][frame.u], shown.corners[i][frame.v]};
  return uvs;
}

}  // namespace

void VertexWriter::write_element(std::size_t index, const ShapeBlock& block, Vec3 origin, std::byte* out) const {
  const VertexElement& element = layout_.elements[index];
  const Column column{out + element.offset, layout_.stride};
  const VertexFormat format = element.format;
  const std::span<const ShapeFace> faces = block.shapes;
  const auto number_of = [](const ShapeFace& face) {
    return std::pair(face.type, static_cast<Direction>(face.model_face().look));
  };
  const auto same = [](const std::array<float, 2>& uv) { return uv; };
  switch (element.attribute) {
    case VertexAttribute::Position:
      return put_positions(format,
                           PerCorner{column, faces, [&](const ShapeFace& face) { return corners_of(face, origin); }});
    case VertexAttribute::Normal:
      return put_normals(format,
                         PerQuad{column, faces, [](const ShapeFace& face) { return face.model_face().normal; }});
    case VertexAttribute::Face:
      return put_numbers(format,
                         PerQuad{column, faces, [](const ShapeFace& face) { return face.model_face().direction; }});
    case VertexAttribute::Colour:
      return put_encoded(format, PerQuad{column, faces, [&](const ShapeFace& face) -> const Colour& {
                                           return colour(index, face.type);
                                         }});
    case VertexAttribute::Occlusion:
    case VertexAttribute::Brightness:
      return put_block_occlusion(format,
                                 PerCorner{column, faces, [](const ShapeFace& face) { return face.occlusion(); }});
    case VertexAttribute::Type:
      return put_numbers(format, PerQuad{column, faces, [](const ShapeFace& face) { return face.type; }});
    case VertexAttribute::Uv:
      return PerCorner{column, faces, [](const ShapeFace& face) { return uvs_of(face); }}.put<std::array<float, 2>>(
          same);
    case VertexAttribute::Texture:
      return put_numbers(format, PerQuad{column, faces, [&](const ShapeFace& face) {
                                           const std::uint32_t own = block.number_of(face);
                                           if (own != 0) return block.faces->textures[own - 1];
                                           const auto [type, direction] = number_of(face);
                                           return texture(face_number(type, direction));
                                         }});
    case VertexAttribute::TextureUv:
      return PerCorner{column, faces, [&](const ShapeFace& face) { return texture_uvs(face); }}
          .put<std::array<float, 2>>(same);
    case VertexAttribute::Tint:
      return put_encoded(format, PerQuad{column, faces, [&](const ShapeFace& face) -> const Colour& {
                                           const std::uint32_t own = block.number_of(face);
                                           if (own != 0) return block.faces->tints[index][own - 1];
                                           const auto [type, direction] = number_of(face);
                                           return colour(index, face_number(type, direction));
                                         }});
    case VertexAttribute::Materials:  // faces of shapes have none
    case VertexAttribute::Weights:
      return;
  }
}

void VertexWriter::write_view(const MeshView& mesh, Vec3 origin, std::span<std::byte> out) const {
  QUOIN_ASSERT(out.size() >= bytes_needed(mesh.positions.size()), "room for the vertices");
  const auto has_uvs = [](const VertexElement& each) { return each.attribute == VertexAttribute::TextureUv; };
  // A vertex's face is found by its triangles, so for all vertices at once.
  std::vector<std::array<float, 2>> uvs;
  if (std::ranges::any_of(layout_.elements, has_uvs)) uvs = texture_uvs(mesh);
  const OwnFaces faces = faces_of(mesh);
  by_blocks(mesh.positions.size(), 1, layout_.stride, out.data(),
            [&](std::size_t first, std::size_t count, std::byte* block) {
              for (std::size_t i = 0; i < layout_.elements.size(); ++i) {
                const VertexElement& element = layout_.elements[i];
                if (!has_uvs(element)) {
                  write_element(i, mesh, faces, first, count, origin, block);
                  continue;
                }
                const Column column{block + element.offset, layout_.stride};
                PerVertex{column, count, [&](std::size_t k) { return uvs[first + k]; }}.put<std::array<float, 2>>(
                    [](const std::array<float, 2>& uv) { return uv; });
              }
            });
}

void VertexWriter::write_element(std::size_t index, const MeshView& mesh, const OwnFaces& faces, std::size_t first,
                                 std::size_t count, Vec3 origin, std::byte* block) const {
  const VertexElement& element = layout_.elements[index];
  const Column column{block + element.offset, layout_.stride};
  const VertexFormat format = element.format;
  const auto vertices = [&](auto value_of) { return PerVertex{column, count, value_of}; };
  const auto look_of = [&](std::size_t i) { return mesh.looks.empty() ? 0U : mesh.looks[i].face; };
  switch (element.attribute) {
    case VertexAttribute::Position:
      return put_positions(format, vertices([&](auto i) { return mesh.positions[first + i] + origin; }));
    case VertexAttribute::Normal:
      if (!mesh.normals.empty()) return put_normals(format, vertices([&](auto i) { return mesh.normals[first + i]; }));
      if (!mesh.looks.empty()) return put_normals(format, vertices([&](auto i) { return normal_at(mesh, first + i); }));
      return put_normals(format, vertices([&](auto i) { return face_normals()[face_of(mesh.directions[first + i])]; }));
    case VertexAttribute::Face:
      return put_numbers(format, vertices([&](auto i) { return mesh.directions[first + i]; }));
    case VertexAttribute::Colour:
      if (mesh.has_albedo()) {
        return put_encoded(format, vertices([&](auto i) { return encoded(mesh.albedo[first + i], format); }));
      }
      return put_encoded(format,
                         vertices([&](auto i) -> const Colour& { return colour(index, mesh.types[first + i]); }));
    case VertexAttribute::Occlusion:
    case VertexAttribute::Brightness:
      return write_shading(format, mesh, first, count, column.at);
    case VertexAttribute::Type:
      return put_numbers(format, vertices([&](auto i) { return mesh.types[first + i]; }));
    case VertexAttribute::Texture:
      return put_numbers(format, vertices([&](auto i) {
                           const std::uint32_t look = look_of(first + i);
                           if (look != 0) return faces.textures[look - 1];
                           return texture(face_number(mesh.types[first + i], mesh.directions[first + i]));
                         }));
    case VertexAttribute::Tint:
      return put_encoded(format, vertices([&](auto i) -> const Colour& {
                           const std::uint32_t look = look_of(first + i);
                           if (look != 0) return faces.tints[index][look - 1];
                           return colour(index, face_number(mesh.types[first + i], mesh.directions[first + i]));
                         }));
    case VertexAttribute::Materials:
      return vertices([&](auto i) { return materials_at(mesh, first + i); })
          .template put<std::array<VoxelType, 4>>([](const VertexMaterials& each) { return each.types; });
    case VertexAttribute::Weights:
      return put_weights(format, vertices([&](auto i) { return materials_at(mesh, first + i); }));
    case VertexAttribute::Uv:         // no view has any
    case VertexAttribute::TextureUv:  // written by write_view
      return;
  }
}

void VertexWriter::write_shading(VertexFormat format, const MeshView& mesh, std::size_t first, std::size_t count,
                                 std::byte* at) const {
  const Column column{at, layout_.stride};
  if (mesh.occlusion.empty()) {
    const auto occlusion_of = [&](auto i) {
      return mesh.block_occlusion.empty() ? std::uint8_t{0} : mesh.block_occlusion[first + i];
    };
    return put_block_occlusion(format, PerVertex{column, count, occlusion_of});
  }
  const auto brightness_of = [&](auto i) { return 1.0F - mesh.occlusion[first + i]; };
  const PerVertex brightness{column, count, brightness_of};
  if (format == VertexFormat::Float32) return brightness.put<float>([](float share) { return share; });
  brightness.put<std::uint8_t>([](float share) { return unorm8(share); });
}

}  // namespace quoin
