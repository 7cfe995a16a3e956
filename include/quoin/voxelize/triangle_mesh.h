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

namespace quoin {

/// What a texture has beyond its sides.
enum class TextureWrap : std::uint8_t { Repeat, Mirror, Clamp };

/// A picture that materials look their colours up in.
struct MeshTexture {
  AlphaImage image;  ///< sRGB, alpha linear
  TextureWrap wrap_u = TextureWrap::Repeat;
  TextureWrap wrap_v = TextureWrap::Repeat;
  bool is_smooth = true;  ///< between pixels bilinear; else the nearest pixel's colour
};

/// What becomes of a surface's alpha, as glTF says it.
enum class AlphaMode : std::uint8_t {
  Opaque,  ///< alpha means nothing
  Mask,    ///< where alpha is below the cut-off there is no surface
  Blend,   ///< alpha is the voxels' alpha; 0 is no surface
};

struct MeshMaterial {
  std::string name{};
  glm::vec4 colour{1.0F};  ///< linear light and alpha, times the texture's and the vertices'
  std::optional<std::size_t> texture{};
  AlphaMode alpha_mode = AlphaMode::Opaque;
  float alpha_cutoff = 0.5F;
  float roughness = 1.0F;
  float metalness = 0.0F;
  float emission = 0.0F;  ///< as VoxelProperties::emission
  /// Emission is multiplied by the brightest channel of this texture times the tint (linear light), relative to the
  /// colour, at most 1: voxels emit their own colour.
  std::optional<std::size_t> emissive_texture{};
  glm::vec3 emissive_tint{1.0F};

  bool operator==(const MeshMaterial&) const = default;
};

/// Triangles with colours: what is voxelised. Any soup will do: open, self-crossing, with flat triangles.
///
/// Space: the mesh's own unit, right-handed, +Y up as grids; counter-clockwise triangles face outwards.
struct TriangleMesh {
  std::vector<DVec3> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of positions
  std::vector<glm::vec4> colours;                       ///< linear light and alpha, one a position; empty: white
  std::vector<glm::vec2> texture_places;   ///< three a triangle, (0, 0) is the picture's top left corner; or empty
  std::vector<glm::vec2> emissive_places;  ///< the same in the emissive texture; empty: materials with one emit nothing
  std::vector<std::uint32_t> material_of;  ///< one a triangle; empty: all of material 0
  std::vector<MeshMaterial> materials;     ///< empty: one that is light grey
  std::vector<MeshTexture> textures;

  /// The smallest box around all corners of triangles; empty without any.
  [[nodiscard]] DBox bounds() const;
};

/// What is wrong with a mesh, if anything: an index of nothing, arrays of other lengths, a position that triangles use
/// and that is not finite, a number of a material's that is not, a picture of another size than it says. Errors:
/// InvalidArgument.
[[nodiscard]] Status check_mesh(const TriangleMesh& mesh);

}  // namespace quoin
