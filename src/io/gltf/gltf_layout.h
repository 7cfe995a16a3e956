#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/scene/scene_meshes.h>

#include "io/material_palette.h"
#include "io/mesh_parts.h"

namespace quoin {

/// A range of a glTF buffer; `offset` and `bytes` are multiples of four except for images and short indices.
struct GltfView {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
};

/// The content of a primitive's array.
enum class GltfArrayKind : std::uint8_t {
  Position,
  Normal,
  AtlasCoordinate,
  PaletteCoordinate,  ///< the first coordinate set, except for the atlas coordinates
  FaceCoordinate,     ///< of textured faces, instead of PaletteCoordinate
  Colour,
  Occlusion,
  Materials,  ///< VertexMaterials::types
  Weights,
  Index,
};

/// glTF 2.0 component types, which equal OpenGL's constants.
enum class GltfComponent : std::uint16_t {
  Byte = 5120,
  UnsignedByte = 5121,
  Short = 5122,
  UnsignedShort = 5123,
  UnsignedInt = 5125,
  Float = 5126,
};

/// One array of a primitive: its storage format and its position in the buffer.
struct GltfArray {
  GltfArrayKind kind{};
  GltfComponent component = GltfComponent::Float;
  int components = 3;
  bool normalized = false;
  std::uint32_t stride = 0;         ///< bytes from one element to the next, a multiple of four except for indices
  GltfView view{};                  ///< compressed files: the view in the buffer that clients decode into
  GltfView packed_view{};           ///< compressed files: the view in the file's buffer
  std::vector<std::byte> packed{};  ///< the encoded content (EXT_meshopt_compression)

  [[nodiscard]] std::uint64_t count() const {
    QUOIN_ASSERT(stride > 0, "a positive stride");
    return view.bytes / stride;
  }
};

/// The arrays of one primitive, in writing order.
struct GltfPrimitive {
  MeshView view;
  std::size_t material = 0;
  Vec3 min{0.0F};  ///< bounds of the positions as written
  Vec3 max{0.0F};
  std::vector<GltfArray> arrays{};
};

/// The storage of a mesh's positions: `(position - origin) / step`, as floats or rounded to integers.
struct GltfQuantization {
  GltfComponent component = GltfComponent::Float;
  DVec3 origin{0.0};
  double step = 1.0;
};

/// A part's mesh in the file, with the transforms that nodes cannot represent baked in.
struct GltfMesh {
  std::string name;
  VertexTransform transform;  ///< from the part to the stored positions
  GltfQuantization stored{};
  std::vector<GltfPrimitive> primitives{};
};

/// A node's translation, rotation and scale, applied after the part baked into its mesh: a reflection or a shear.
struct GltfTransform {
  DVec3 translation{0.0};
  DQuat rotation{1.0, 0.0, 0.0, 0.0};
  DVec3 scale{1.0};
  glm::dmat3 baked{1.0};
};

struct GltfNode {
  std::string name;
  std::optional<std::size_t> mesh;  ///< nullopt for nodes without geometry
  GltfTransform transform;          ///< from the node above, or the world
  std::string layer{};
  std::vector<std::size_t> children{};
  bool is_group = false;
  bool is_at_top = true;
};

/// The animation of a node property; each value applies from its time on.
struct GltfChannel {
  enum class Path : std::uint8_t { Translation, Rotation, Scale };

  std::size_t node = 0;
  Path path{};
  std::vector<float> seconds{};
  std::vector<float> values{};  ///< three or, for rotations, four per time
  GltfView seconds_view{};
  GltfView values_view{};
};

/// The purpose of a file's image.
enum class GltfImageKind : std::uint8_t { Palette, MetallicRoughness, Emissive, Atlas, Face, Field };

struct GltfImage {
  GltfImageKind kind{};
  std::string name;
  std::vector<std::byte> png;
  GltfView view;
};

/// The layout of a glTF file's buffer; borrows the meshes' arrays.
struct GltfLayout {
  MaterialPalette palette;
  std::vector<GltfNode> nodes;  ///< the placements in their order, then the groups
  std::vector<GltfMesh> meshes;
  std::vector<GltfImage> images;  ///< textures of blocks; MaterialPalette::face_image; `field_textures` come last
  std::vector<MaterialSurfaces> surfaces;  ///< by part
  std::vector<GltfChannel> channels{};     ///< the animation's times and values; after the images
  std::vector<Lamp> lamps{};               ///< lamps that give light; their nodes come after `nodes`
  std::vector<MeshCamera> cameras{};       ///< their nodes come last
  std::uint64_t buffer_bytes = 0;
  std::uint64_t decoded_bytes = 0;  ///< compressed files: size of the buffer that arrays are decoded into; else 0

  bool is_unlit = false;  ///< vertex colours include all light
  /// The types that vertices of smooth surfaces name as materials, ascending; empty if none has textures. And their
  /// distinct textures.
  std::vector<VoxelType> field_types{};
  std::vector<Texture> field_textures{};

  [[nodiscard]] bool is_compressed() const { return decoded_bytes > 0; }
  /// Returns the index of the texture, of faces the first; nullopt if the file has none of that kind.
  [[nodiscard]] std::optional<std::size_t> texture(GltfImageKind kind) const;
};

/// Requires: valid meshes that outlive the layout. Errors: LimitExceeded from the PNG encoder; Unsupported for
/// compression in builds without meshoptimizer.
[[nodiscard]] Result<GltfLayout> lay_out_gltf(const SceneMeshes& meshes, const MeshFileOptions& options = {});

/// Writes the stored elements of one array, without padding to a multiple of four.
void write_gltf_array(const MaterialPalette& palette, const GltfMesh& mesh, const GltfPrimitive& primitive,
                      const GltfArray& array, BlockWriter& out);

/// Returns the integer quantization of surface positions after `transform`. Positions of blocks are exact; floats are
/// used if no lattice of whole voxels holds them all. The error of other positions is at most half of 1/32,767 of the
/// mesh's extent, or of 1/65,534 if its pivot lies outside.
[[nodiscard]] GltfQuantization quantize_positions(const VertexTransform& transform,
                                                  std::span<const MaterialSurfaces::Surface> surfaces);

/// Compresses the stored bytes of an array. Requires: can_compress_gltf().
[[nodiscard]] std::vector<std::byte> compress_gltf_array(const GltfArray& array, std::span<const std::byte> bytes);

/// Returns true if the build has meshoptimizer.
[[nodiscard]] bool can_compress_gltf();

/// Returns the JSON of a glTF file: compact, in a fixed order, with names as valid UTF-8. `buffer_uri`: the
/// percent-encoded name of the buffer's file; empty for the GLB's own buffer.
[[nodiscard]] std::string gltf_json(const GltfLayout& layout, std::string_view buffer_uri);

/// Returns the size of a GLB with chunks of these sizes. Errors: LimitExceeded if it does not fit the header's 32 bits.
[[nodiscard]] Result<std::uint64_t> glb_file_bytes(std::uint64_t json_bytes, std::uint64_t buffer_bytes);

/// Returns the files of valid meshes, which must outlive them. Errors: LimitExceeded beyond 4 GiB of GLB.
[[nodiscard]] Result<std::vector<MeshFile>> plan_glb(const SceneMeshes& meshes, const std::filesystem::path& path,
                                                     const MeshFileOptions& options);
[[nodiscard]] Result<std::vector<MeshFile>> plan_gltf(const SceneMeshes& meshes, const std::filesystem::path& path,
                                                      const MeshFileOptions& options);
/// Returns the files that plan_gltf writes next to `path`.
[[nodiscard]] std::vector<std::filesystem::path> gltf_companions(const SceneMeshes& meshes,
                                                                 const std::filesystem::path& path,
                                                                 const MeshFileOptions& options);

}  // namespace quoin
