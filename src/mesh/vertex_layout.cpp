#include <quoin/mesh/vertex_writer.h>

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <vector>

namespace quoin {
namespace {

using enum VertexFormat;

bool is_one_of(VertexFormat format, std::initializer_list<VertexFormat> formats) {
  return std::find(formats.begin(), formats.end(), format) != formats.end();
}

bool can_write(const VertexElement& element, VertexSource source) {
  const VertexFormat format = element.format;
  const bool is_smooth = source == VertexSource::SmoothChunk || source == VertexSource::Smooth;
  switch (element.attribute) {
    case VertexAttribute::Position:
      return is_one_of(format, {Float32x3, Float32x4}) ||
             (source == VertexSource::Quads && is_one_of(format, {Sint16x4, Uint8x4}));
    case VertexAttribute::Normal:
      return is_one_of(format, {Float32x3, Float32x4, Snorm8x4});
    case VertexAttribute::Face:
      return !is_smooth && is_one_of(format, {Uint8, Uint32});
    case VertexAttribute::Colour:
      return source != VertexSource::SmoothChunk && is_one_of(format, {Float32x4, Unorm16x4, Unorm8x4, Unorm8x4Srgb});
    case VertexAttribute::Occlusion:
      return !is_smooth && format == Uint8;
    case VertexAttribute::Brightness:
      return is_one_of(format, {Float32, Unorm8});
    case VertexAttribute::Type:
      return !is_smooth && is_one_of(format, {Uint16, Uint32});
    case VertexAttribute::Uv:
      return (source == VertexSource::Quads && is_one_of(format, {Float32x2, Uint8x2})) ||
             (source == VertexSource::Shapes && format == Float32x2);
    case VertexAttribute::Texture:
      return !is_smooth && is_one_of(format, {Uint16, Uint32});
    case VertexAttribute::TextureUv:
      return !is_smooth && format == Float32x2;
    case VertexAttribute::Tint:
      return !is_smooth && is_one_of(format, {Float32x4, Unorm16x4, Unorm8x4, Unorm8x4Srgb});
    case VertexAttribute::Materials:
      return source == VertexSource::Smooth && format == Uint16x4;
    case VertexAttribute::Weights:
      return source == VertexSource::Smooth && is_one_of(format, {Unorm8x4, Float32x4});
  }
  return false;
}

}  // namespace

std::size_t size_of(VertexFormat format) {
  switch (format) {
    case Uint8:
    case Unorm8:
      return 1;
    case Uint8x2:
    case Uint16:
      return 2;
    case Float32x2:
    case Sint16x4:
    case Unorm16x4:
    case Uint16x4:
      return 8;
    case Float32x3:
      return 12;
    case Float32x4:
      return 16;
    case Float32:
    case Uint8x4:
    case Uint32:
    case Snorm8x4:
    case Unorm8x4:
    case Unorm8x4Srgb:
      return 4;
  }
  return 0;
}

bool can_write(const VertexLayout& layout, VertexSource source) {
  if (layout.stride < 1 || layout.stride > VertexLayout::kMaxStride) return false;
  std::vector<bool> is_taken(layout.stride);
  for (const VertexElement& element : layout.elements) {
    const std::size_t size = size_of(element.format);
    if (!can_write(element, source) || element.offset > layout.stride || size > layout.stride - element.offset) {
      return false;
    }
    for (std::size_t i = element.offset; i < element.offset + size; ++i) {
      if (is_taken[i]) return false;
      is_taken[i] = true;
    }
  }
  return true;
}

}  // namespace quoin
