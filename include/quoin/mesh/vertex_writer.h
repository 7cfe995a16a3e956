#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/mesh_view.h>
#include <quoin/mesh/quad.h>
#include <quoin/mesh/quad_triangles.h>
#include <quoin/mesh/smooth.h>

namespace quoin {

/// What a vertex has.
enum class VertexAttribute : std::uint8_t {
  Position,    ///< the mesh's coordinates and the origin that is given when writing
  Normal,      ///< unit, outwards
  Face,        ///< the Direction's number, 0 to 5
  Colour,      ///< of the type, or the albedo of a smooth mesh; without occlusion. White where a type is not registered
  Occlusion,   ///< of blocks, 0 (open) to 3 (dark)
  Brightness,  ///< that occlusion leaves: of blocks 1 - occlusion / 4, of smooth meshes 1 - occlusion; 1 without any
  Type,
  Uv,  ///< voxels from the quad's corner 0, along its u and v: 0 to 64
};

/// How it lies in memory: the machine's byte order, no padding within.
enum class VertexFormat : std::uint8_t {
  Float32,
  Float32x2,
  Float32x3,
  Float32x4,
  Sint16x4,
  Uint8,
  Uint8x2,
  Uint8x4,
  Uint16,
  Uint32,
  Snorm8x4,      ///< -127 is -1, 127 is 1
  Unorm8,        ///< 255 is 1
  Unorm8x4,      ///< of colours: linear light
  Unorm8x4Srgb,  ///< of colours: encoded as sRGB, but for alpha
  Unorm16x4,     ///< 65,535 is 1
};
/// Bytes: 1 to 16.
[[nodiscard]] std::size_t size_of(VertexFormat format);

struct VertexElement {
  VertexAttribute attribute = VertexAttribute::Position;
  VertexFormat format = VertexFormat::Float32x3;
  std::uint32_t offset = 0;  ///< bytes from the vertex's start; need not be aligned
};

/// An interleaved vertex, as graphics APIs describe it.
///
/// | attribute | formats | a fourth component |
/// |---|---|---|
/// | Position | Float32x3, Float32x4; of quads also Sint16x4, Uint8x4 | 1 |
/// | Normal | Float32x3, Float32x4, Snorm8x4 | 0 |
/// | Face | Uint8, Uint32 | |
/// | Colour | Float32x4, Unorm16x4, Unorm8x4 (linear), Unorm8x4Srgb | alpha |
/// | Occlusion | Uint8 | |
/// | Brightness | Float32, Unorm8 | |
/// | Type | Uint16, Uint32 | |
/// | Uv | Float32x2, Uint8x2 | |
struct VertexLayout {
  std::uint32_t stride = 0;  ///< bytes a vertex, 1 to kMaxStride
  std::vector<VertexElement> elements;

  static constexpr std::uint32_t kMaxStride = 2'048;
};

/// What vertices are made from.
enum class VertexSource : std::uint8_t {
  Quads,        ///< has all attributes
  Blocks,       ///< a MeshView of blocks: all but Uv; positions as floats
  SmoothChunk,  ///< a SmoothChunkMesh: Position as floats, Normal, Brightness
  Smooth,       ///< a MeshView of a smooth mesh: these and Colour
};

/// Whether vertices of this source can be written so: a stride in its range, elements that lie within it and do not
/// overlap, attributes that the source has, in formats of the table.
[[nodiscard]] bool can_write(const VertexLayout& layout, VertexSource source);

/// Writes vertices as a caller's buffer has them, for one to be uploaded or mapped device memory: out is written from
/// front to back, each byte once, and never read. Bytes of a vertex that no element names become 0.
///
/// Usage:    std::byte* mapped = map(writer.bytes_needed(vertices_needed(quads.size())));
///           writer.write(quads, Vec3(DVec3(chunk * kChunkEdge) - eye), {mapped, ...});
///           write_indices<std::uint16_t>(quads, 0, mapped_indices);
/// Order:    the vertices' order is that of `write_indices` (quad_triangles.h): four a quad, or those of the mesh.
/// Threads:  any number may write with one writer.
/// Faster:   a layout known to the compiler, by `for_each_vertex`.
class VertexWriter {
 public:
  /// Takes the colours of the types as they are now: after a type has changed, make another.
  /// Requires: some source can be written in this layout.
  VertexWriter(VertexLayout layout, const VoxelRegistry& types);

  [[nodiscard]] const VertexLayout& layout() const { return layout_; }
  [[nodiscard]] std::size_t bytes_needed(std::size_t vertices) const { return vertices * layout_.stride; }

  /// Four vertices a quad. `origin`, in voxels, is added to positions (chunk coordinates).
  /// Every layout that a writer takes can be written of quads.
  /// Requires: room for the bytes needed; where positions are whole numbers, `origin` is, and their sums are within the
  ///           format's range.
  void write(std::span<const Quad> quads, Vec3 origin, std::span<std::byte> out) const;
  /// The mesh's vertices; `origin`, in samples, is added to positions.
  /// Requires: can_write(layout, VertexSource::SmoothChunk); room for the bytes needed.
  void write(const SmoothChunkMesh& mesh, Vec3 origin, std::span<std::byte> out) const;
  /// The view's vertices; `origin`, in its coordinates, is added to positions.
  /// Requires: can_write(layout, source), where `has_albedo` tells Smooth from Blocks; room for the bytes needed.
  void write(const MeshView& mesh, Vec3 origin, std::span<std::byte> out) const;

 private:
  using Colour = std::array<std::byte, 16>;

  void write_element(std::size_t index, std::span<const Quad> quads, Vec3 origin, std::byte* block) const;
  void write_view(const MeshView& mesh, Vec3 origin, std::span<std::byte> out) const;
  void write_element(std::size_t index, const MeshView& mesh, std::size_t first, std::size_t count, Vec3 origin,
                     std::byte* block) const;
  void write_shading(VertexFormat format, const MeshView& mesh, std::size_t first, std::size_t count,
                     std::byte* at) const;
  [[nodiscard]] const Colour& colour(std::size_t element, VoxelType type) const {
    const std::vector<Colour>& colours = colours_[element];
    return type + std::size_t{1} < colours.size() ? colours[type] : colours.back();
  }

  VertexLayout layout_;
  std::vector<std::vector<Colour>> colours_;  // [element][type]; one more for those that are not registered
};

}  // namespace quoin
