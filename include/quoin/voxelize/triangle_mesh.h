#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>

namespace [[gnu::visibility("default")]] quoin {

/// The texture addressing mode outside [0, 1].
enum class TextureWrap : std::uint8_t { Repeat, Mirror, Clamp };

/// A texture that materials sample colours from.
struct MeshTexture {
  AlphaImage image;  ///< sRGB, alpha linear
  TextureWrap wrap_u = TextureWrap::Repeat;
  TextureWrap wrap_v = TextureWrap::Repeat;
  bool is_smooth = true;  ///< bilinear filter; else nearest pixel
};

/// The use of a surface's alpha, as in glTF.
enum class AlphaMode : std::uint8_t {
  Opaque,  ///< alpha is ignored
  Mask,    ///< no surface below the cut-off
  Blend,   ///< alpha becomes the voxels' alpha; 0 is no surface
};

struct MeshMaterial {
  std::string name{};
  glm::vec4 colour{1.0F};  ///< linear light and alpha; factor on texture and vertex colours
  std::optional<std::size_t> texture{};
  AlphaMode alpha_mode = AlphaMode::Opaque;
  float alpha_cutoff = 0.5F;
  float roughness = 1.0F;
  float metalness = 0.0F;
  float emission = 0.0F;  ///< see VoxelProperties::emission
  /// Scales emission by the brightest channel of (this texture * emissive_tint) in linear light, relative to the base
  /// colour, at most 1. Voxels emit their own colour.
  std::optional<std::size_t> emissive_texture{};
  glm::vec3 emissive_tint{1.0F};

  bool operator==(const MeshMaterial&) const = default;
};

/// A triangle mesh with colours, the input of voxelisation. Any triangle soup is valid: open, self-intersecting, with
/// degenerate triangles.
///
/// Space: the mesh's own unit, right-handed, +Y up like grids; counter-clockwise triangles face outwards.
struct TriangleMesh {
  std::vector<DVec3> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into positions
  std::vector<glm::vec4> colours;                       ///< linear light and alpha, one per position; empty: white
  /// Texture coordinates, three per triangle; (0, 0) is the image's top left corner; may be empty.
  std::vector<glm::vec2> uvs;
  /// Coordinates in the emissive texture; empty: materials with an emissive texture emit no light.
  std::vector<glm::vec2> emissive_uvs;
  std::vector<std::uint32_t> material_of;  ///< one per triangle; empty: all use material 0
  std::vector<MeshMaterial> materials;     ///< empty: a single light grey material
  std::vector<MeshTexture> textures;

  /// Returns the smallest box around all triangle corners; empty if there are no triangles.
  [[nodiscard]] DBox bounds() const;
};

/// Validates a mesh. Errors: InvalidArgument for an index out of range, an array length that does not match, a used
/// position or a material value that is not finite, or an image whose data does not match its size.
[[nodiscard]] Status check_mesh(const TriangleMesh& mesh);

}  // namespace quoin
