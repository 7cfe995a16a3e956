#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/texture.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/mesh_view.h>
#include <quoin/mesh/quad.h>
#include <quoin/mesh/quad_triangles.h>
#include <quoin/mesh/smooth.h>

namespace [[gnu::visibility("default")]] quoin {

/// Vertex attribute.
enum class VertexAttribute : std::uint8_t {
  Position,  ///< position in the mesh's coordinates, plus the origin passed to `write`
  Normal,    ///< unit length, outwards
  Face,      ///< number of the Direction, 0 to 5
  /// Colour of the type, or albedo of a smooth mesh, without occlusion. White for unregistered types.
  Colour,
  Occlusion,  ///< occlusion level of a block face's corner, 0 (open) to 3 (dark)
  /// Brightness after occlusion: 1 - occlusion / 4 for blocks, 1 - occlusion for smooth meshes, 1 without occlusion.
  Brightness,
  Type,
  /// Voxels from the quad's corner 0, along its u and v: 0 to 64. For textures: see QuadVertex::u. Of shapes: from the
  /// lowest corner of the voxel, along u and v of the face's direction.
  Uv,
  /// Layer of the face's texture (VoxelProperties::faces) in a TextureSet: TextureLayer::layer, in Uint32 plus
  /// TextureLayer::array << 16. Faces without a texture have the greatest number of the format, as have faces whose
  /// layer or array the format cannot hold: in Uint16 layers from 65,535 and all arrays except the first, in Uint32
  /// layers or arrays from 65,536.
  Texture,
  /// Texture coordinates from the upper left corner, rightwards and downwards, with the face's turn and mirror:
  /// `texture_coordinates` relative to the quad's voxel, -64 to 64. They repeat with every voxel. Of blocks: relative
  /// to the lowest corner of the face, which all triangles that share vertices form.
  TextureUv,
  /// Tint of the face; for types without textures their colour. The face shows tint times texture. For these three,
  /// vertices of views with a look of their own (VertexLook) have the face that it names; vertices of shapes have the
  /// face from `look_of`, with the coordinates of `texture_uv`.
  Tint,
  Materials,  ///< VertexMaterials::types; of views without materials the vertex's type, else kAir, and kAir
  Weights,    ///< VertexMaterials::weights; of views without materials 1, 0, 0, 0
};

/// Memory format of an attribute: native byte order, no padding between components.
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
  Unorm8x4,      ///< for colours: linear
  Unorm8x4Srgb,  ///< for colours: sRGB-encoded, alpha linear
  Unorm16x4,     ///< 65,535 is 1
  Uint16x4,
};
/// Returns the size of a format in bytes, 1 to 16.
[[nodiscard]] std::size_t size_of(VertexFormat format);

struct VertexElement {
  VertexAttribute attribute = VertexAttribute::Position;
  VertexFormat format = VertexFormat::Float32x3;
  std::uint32_t offset = 0;  ///< bytes from the vertex's start; need not be aligned
};

/// Layout of an interleaved vertex, as graphics APIs describe it.
///
/// | attribute | formats | fourth component |
/// |---|---|---|
/// | Position | Float32x3, Float32x4; of quads, not of shapes, also Sint16x4, Uint8x4 | 1 |
/// | Normal | Float32x3, Float32x4, Snorm8x4 | 0 |
/// | Face | Uint8, Uint32 | |
/// | Colour | Float32x4, Unorm16x4, Unorm8x4 (linear), Unorm8x4Srgb | alpha |
/// | Occlusion | Uint8 | |
/// | Brightness | Float32, Unorm8 | |
/// | Type | Uint16, Uint32 | |
/// | Uv | Float32x2; of quads, not of shapes, also Uint8x2 | |
/// | Texture | Uint16, Uint32 | |
/// | TextureUv | Float32x2 | |
/// | Tint | as Colour | 1 for faces with textures, else alpha |
/// | Materials | Uint16x4 | |
/// | Weights | Unorm8x4, Float32x4 | |
struct VertexLayout {
  std::uint32_t stride = 0;  ///< bytes per vertex, 1 to kMaxStride
  std::vector<VertexElement> elements;

  static constexpr std::uint32_t kMaxStride = 2'048;
};

/// Source of vertices.
enum class VertexSource : std::uint8_t {
  Quads,        ///< has all attributes except Materials and Weights
  Blocks,       ///< MeshView of blocks: as Quads except Uv; positions as floats
  SmoothChunk,  ///< SmoothChunkMesh: Position as floats, Normal, Brightness
  Smooth,       ///< MeshView of a smooth mesh: as SmoothChunk, plus Colour, Materials, Weights
  Shapes,       ///< faces of shapes: as Quads, with fractions of voxels
};

/// Returns true if vertices of this source can be written in the layout: the stride is in range, the elements lie
/// within it without overlap, and the source has each attribute in its format (see VertexLayout).
[[nodiscard]] bool can_write(const VertexLayout& layout, VertexSource source);

/// Writes vertices in a custom layout, for upload or into mapped device memory. Writes `out` front to back, each byte
/// once, and never reads it. Bytes of a vertex outside all elements become 0.
///
/// Usage:    std::byte* mapped = map(writer.bytes_needed(vertices_needed(quads.size())));
///           writer.write(quads, Vec3(DVec3(chunk * kChunkEdge) - eye), {mapped, ...});
///           write_indices<std::uint16_t>(quads, 0, mapped_indices);
///           // Behind them, in the same layout, the faces of shapes:
///           writer.write(shapes, Vec3(DVec3(chunk * kChunkEdge) - eye), {mapped + ..., ...});
/// Order:    vertices are in the order of `write_indices` (quad_triangles.h): four per quad or face of a shape, or the
///           mesh's order.
/// Threads:  any number of threads can write with one writer.
/// Faster:   for a layout known at compile time, use `for_each_vertex`.
class VertexWriter {
 public:
  /// Copies the types' colours and faces. After a type has changed, make another writer. `textures` has the layers for
  /// VertexAttribute::Texture; faces whose texture it lacks count as faces without one.
  /// Requires: at least one source can be written in this layout.
  VertexWriter(VertexLayout layout, const VoxelRegistry& types, const TextureSet& textures = TextureSet());

  [[nodiscard]] const VertexLayout& layout() const { return layout_; }
  [[nodiscard]] std::size_t bytes_needed(std::size_t vertices) const { return vertices * layout_.stride; }

  /// Writes four vertices per quad. `origin`, in voxels, is added to positions (chunk coordinates). Supports every
  /// layout that the constructor accepts.
  /// Requires: `out` has at least `bytes_needed` bytes. For integer position formats, `origin` is whole and the sums
  ///           are in the format's range.
  void write(std::span<const Quad> quads, Vec3 origin, std::span<std::byte> out) const;
  /// Writes four vertices per face of a shape, the corners in their order: the last two of a triangle are equal.
  /// `origin`, in voxels, is added to positions (chunk coordinates).
  /// Requires: can_write(layout, VertexSource::Shapes); `out` has at least `bytes_needed` bytes.
  void write(std::span<const ShapeFace> faces, Vec3 origin, std::span<std::byte> out) const;
  /// Writes the mesh's vertices. `origin`, in samples, is added to positions.
  /// Requires: can_write(layout, VertexSource::SmoothChunk); `out` has at least `bytes_needed` bytes.
  void write(const SmoothChunkMesh& mesh, Vec3 origin, std::span<std::byte> out) const;
  /// Writes the view's vertices. `origin`, in the view's coordinates, is added to positions.
  /// Requires: can_write(layout, source), where source is Smooth if `has_albedo`, else Blocks; `out` has at least
  ///           `bytes_needed` bytes.
  void write(const MeshView& mesh, Vec3 origin, std::span<std::byte> out) const;

 private:
  using Colour = std::array<std::byte, 16>;

  void write_element(std::size_t index, std::span<const Quad> quads, Vec3 origin, std::byte* block) const;
  // The textures and tints of faces that are in no table: those that a view names (MeshView::faces), or those of models
  // (ShapeModel::looks).
  struct OwnFaces {
    std::vector<std::uint32_t> textures;     // [face]
    std::vector<std::vector<Colour>> tints;  // [element][face]
  };
  struct [[gnu::visibility("hidden")]] ShapeBlock;
  [[gnu::visibility("hidden")]] void add_face(const VoxelFace& face, OwnFaces& to) const;
  [[nodiscard, gnu::visibility("hidden")]] OwnFaces faces_of(const MeshView& mesh) const;
  [[nodiscard, gnu::visibility("hidden")]] OwnFaces faces_of(std::span<const ShapeFace> shapes,
                                                             std::vector<std::uint32_t>& numbers) const;
  [[gnu::visibility("hidden")]] void write_element(std::size_t index, const ShapeBlock& shapes, Vec3 origin,
                                                   std::byte* block) const;
  void write_view(const MeshView& mesh, Vec3 origin, std::span<std::byte> out) const;
  void write_element(std::size_t index, const MeshView& mesh, const OwnFaces& faces, std::size_t first,
                     std::size_t count, Vec3 origin, std::byte* block) const;
  void write_shading(VertexFormat format, const MeshView& mesh, std::size_t first, std::size_t count,
                     std::byte* at) const;
  // Returns the entry of a type or face; the last one for unregistered types.
  [[nodiscard]] const Colour& colour(std::size_t element, std::size_t number) const {
    const std::vector<Colour>& colours = colours_[element];
    return number + 1 < colours.size() ? colours[number] : colours.back();
  }
  // Returns the number of a face in tables of faces.
  [[nodiscard]] std::size_t face_number(VoxelType type, Direction direction) const {
    constexpr std::size_t kNone = ~std::size_t{0} / 2;  // beyond all tables
    if (!turned_.empty() && type >= turned_.size()) return kNone;
    return std::size_t{6} * type + static_cast<std::size_t>(direction);
  }
  // Those of a type that its state turns follow behind the faces of all types.
  [[nodiscard]] std::size_t face_number(const Quad& quad) const {
    const std::size_t orientation = quad.bits >> Quad::kOrientationShift;
    const std::size_t number = face_number(quad.type(), quad.direction());
    if (orientation == 0 || quad.type() >= turned_.size() || turned_[quad.type()] == 0) return number;
    return turned_[quad.type()] + 6 * orientation + static_cast<std::size_t>(quad.direction());
  }
  [[nodiscard]] std::uint32_t texture(std::size_t face) const {
    return face < textures_.size() ? textures_[face] : ~std::uint32_t{0};
  }
  [[nodiscard]] std::uint8_t turn(std::size_t number) const {
    return number < turns_.size() ? turns_[number] : std::uint8_t{0};
  }
  [[nodiscard]] std::array<std::array<float, 2>, 4> texture_uvs(const Quad& quad) const;
  [[nodiscard, gnu::visibility("hidden")]] std::array<std::array<float, 2>, 4> texture_uvs(const ShapeFace& face) const;
  [[nodiscard, gnu::visibility("hidden")]] std::vector<std::array<float, 2>> texture_uvs(const MeshView& mesh) const;
  void read_faces(const VoxelRegistry& types, const TextureSet& textures);
  // Calls `visit(face, type's properties)` for each number of a face; face is null for types without textures.
  template <class Visit>
  static void for_each_face(const VoxelRegistry& types, const Visit& visit);

  VertexLayout layout_;
  // [element][type], of tints [element][face_number]; the last entry is for unregistered types
  std::vector<std::vector<Colour>> colours_;
  std::vector<std::size_t> turned_;      // by type: the number of its first face with an orientation, or 0
  std::vector<std::uint32_t> textures_;  // [face_number]; empty if no element needs them
  std::vector<std::uint8_t> turns_;      // [face_number]: turn + 4 * mirrored; empty if no element needs them
  TextureSet layers_;                    // for OwnFaces; empty if types or elements need none
};

}  // namespace quoin
