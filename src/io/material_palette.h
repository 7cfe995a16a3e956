#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/texture.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/mesh_file.h>
#include <quoin/mesh/mesh_view.h>
#include <quoin/mesh/vertex_writer.h>
#include <quoin/scene/scene_meshes.h>

#include "io/image/image_codecs.h"
#include "scene/surfaces.h"

namespace quoin {

/// Represents a body of glass or water in mesh files, whose materials have one alpha and no path length through voxels.
///
/// Behind a body of thickness L, Quoin's images show the fraction `passed` of each channel of the background and `own`,
/// the share of the body's colour c (GlassLook). Clients with alpha only show `1 - alpha` and `alpha`. Clients with
/// transmission show, by coverage and base colour, `1 - alpha + alpha * transmission * c * attenuation` and
/// `alpha * (1 - transmission)`. Therefore:
///
///   alpha         minimises the sum of the squared errors of both over the channels, for clients with alpha only;
///   transmission  gives the body's own share exactly;
///   attenuation   gives, with these, the exact `passed` if possible: it is at most 1, and at least `passed` and
///                 1/100. Blender's Cycles also attenuates the uncovered part: for a pale pane the remaining difference
///                 is small, and would make the pane violet there.
struct GlassMaterial {
  float thickness = 1.0F;  ///< voxels
  float alpha = 1.0F;
  float transmission = 0.0F;
  Vec3 attenuation{1.0F};  ///< per channel through the whole thickness; above 0
  Vec3 tint{1.0F};         ///< transmittance of each channel in the uncovered part
};

/// Requires: `thickness` is above 0.
[[nodiscard]] GlassMaterial glass_material(const Surface& surface, float thickness);

/// Returns the alpha of a smooth surface's vertex, 0 to 65,535, for bodies of that thickness. Requires: as above.
[[nodiscard]] std::uint16_t glass_alpha(const LinearRgba16& albedo, float thickness);

/// Estimates the thickness of closed bodies from their surface: the volume divided by the largest of its projected
/// areas along the axes. Returns 1 for open or empty surfaces. Cost: O(triangles).
[[nodiscard]] float thickness_of(const MeshView& view);

/// The thickness of transparent bodies in a scene's meshes: for each type the median over all placements, weighted by
/// surface area.
class GlassBodies {
 public:
  struct Typical {
    float thickness = 1.0F;  ///< voxels
    float unit = 1.0F;       ///< the world's length of a voxel, the mean by area
  };

  /// Cost: O(transparent triangles), plus another pass per type for parts without MeshPart::thickness.
  explicit GlassBodies(const SceneMeshes& meshes);

  [[nodiscard]] Typical typical(VoxelType type) const;
  /// As `typical`, for smooth surfaces of a type.
  [[nodiscard]] Typical typical_of_smooth(VoxelType type) const;
  [[nodiscard]] float thickness_of_smooth() const { return smooth_.empty() ? 1.0F : typical_of(smooth_).thickness; }

 private:
  struct Seen {
    float thickness = 1.0F;
    double unit = 1.0;
    double area = 0.0;  // in the world
  };

  using ByType = std::map<VoxelType, std::vector<Seen>>;

  /// `times`: the area of its placements in the world.
  static void add_by_type(const MeshPart& part, const MeshView& view, double unit, double times, ByType& all);
  static Typical typical_of(std::vector<Seen> seen);

  ByType by_type_;
  ByType smooth_by_type_;
  std::vector<Seen> smooth_;
};

inline constexpr std::uint32_t kPaletteWidth = 256;

/// One material of an exported file.
struct SurfaceMaterial {
  std::string name;  ///< unique in the file
  SurfaceClass surface = SurfaceClass::Opaque;
  float emission = 0.0F;  ///< emission of a full texel in the emissive palette; 0 without emission
  VoxelType type = kAir;  ///< the only type of a transparent material
  GlassMaterial glass{};
  float unit = 1.0F;  ///< its voxel size in the world, the mean over its placements
  // For smooth surfaces and textured faces, which do not use the palette:
  float roughness = 1.0F;
  float metalness = 0.0F;
  // For textured faces, and faces of shapes that have a tint only:
  std::optional<std::size_t> texture{};  ///< index into MaterialPalette::textures; none: a tint only
  FaceAlpha alpha = FaceAlpha::Opaque;
  Vec3 tint{1.0F};  ///< linear, multiplies the texture
  // For smooth surfaces:
  Vec3 emission_colour{0.0F};  ///< linear, times `emission`

  [[nodiscard]] bool is_transparent() const {
    return surface == SurfaceClass::Transparent || surface == SurfaceClass::EmissiveTransparent;
  }
  [[nodiscard]] bool is_emissive() const {
    return surface == SurfaceClass::Emissive || surface == SurfaceClass::EmissiveTransparent;
  }
};

/// The appearance of types with textures (VoxelProperties::faces) in a file.
enum class FaceColours : std::uint8_t {
  Means,     ///< the colour of the type
  Textures,  ///< a material per texture, tint and use of alpha; not in meshes with an atlas, which has their colours
  Atlas,     ///< as Textures, with one image of all textures and tints, and a material per use of alpha
};

/// Returns the appearance of textured faces in a format with textures.
[[nodiscard]] inline FaceColours face_colours_in(const MeshFileOptions& options) {
  return options.textures_in == TexturesIn::Atlas ? FaceColours::Atlas : FaceColours::Textures;
}

/// One image of many textures and tints. A margin around each repeats its edge:
///
///   +--------------+--------------+     Positions and sizes are multiples of 16. So a texel of the mipmap levels 0 to
///   | margin (16)  |              |     4, which covers up to 16 x 16 texels, has the colours of one texture, and
///   |   +------+   |   +------+   |     filters that read the next texel at an edge stay within the margin.
///   |   | tile |   |   | tile |   |
///   |   +------+   |   +------+   |
///   |              |              |
///   +--------------+--------------+
class FaceAtlas {
 public:
  static constexpr int kMargin = 16;
  /// The maximum image size that devices support.
  static constexpr int kMaxEdge = 16'384;

  struct Tile {
    Texture texture;
    Rgba8 tint;
    int x = 0;  ///< of the texture's upper left corner, without the margin
    int y = 0;
  };

  /// Adds a texture with a tint. Requires: it was not added before.
  void add(const Texture& texture, Rgba8 tint) { tiles_.push_back({texture, tint}); }
  /// Places all tiles in an image whose sides are powers of two, large textures first. Returns false beyond kMaxEdge.
  [[nodiscard]] bool place();

  [[nodiscard]] const std::vector<Tile>& tiles() const { return tiles_; }
  // The following require that `place` returned true.
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  /// Returns the image, without alpha if all textures are opaque. The space between tiles has their mean colour.
  [[nodiscard]] PngImage image() const;

 private:
  std::vector<Tile> tiles_;  // in the order of `add`
  int width_ = 0;
  int height_ = 0;
};

/// The voxel types of a scene's meshes in the form of mesh formats: textures with one texel per type, and the few
/// materials that use them.
///
/// Each transparent type has its own material, with the light transmission of glass of the type's typical thickness.
/// With FaceColours::Textures or Atlas, textured faces have materials of their own instead.
///
/// Emission: strengths are sorted into bands, each from its strongest down to half of it; a band is a material. Within
/// a band the emissive texel is the type's colour, scaled in linear light by strength / strongest. A file with one
/// strength, or with strengths more than a factor of two apart, has unscaled colours.
class MaterialPalette {
 public:
  /// Only types used by blocks of the meshes get materials; all registered types get texels.
  /// Requires: valid meshes, whose types outlive this object.
  explicit MaterialPalette(const SceneMeshes& meshes, FaceColours faces = FaceColours::Means);

  /// Returns LimitExceeded if the textures do not fit into an atlas. Then the palette must not be used.
  [[nodiscard]] Status validate() const;

  [[nodiscard]] const VoxelRegistry& types() const { return types_; }
  [[nodiscard]] const std::vector<SurfaceMaterial>& materials() const { return materials_; }
  /// Returns the material of a class and type without textures. Requires: the meshes have such a triangle.
  [[nodiscard]] std::size_t material_of(SurfaceClass surface, VoxelType type) const;
  /// Returns the material of a block's vertex. Requires: the meshes have a triangle with this vertex.
  [[nodiscard]] std::size_t material_of(const MeshView& view, std::size_t vertex) const;
  [[nodiscard]] bool has_emission() const;
  /// Returns the materials of smooth surfaces, which come after all others: one per roughness and metalness, and one
  /// per type that emits or is transparent.
  [[nodiscard]] const std::vector<SurfaceMaterial>& smooth_materials() const { return smooth_materials_; }
  /// Returns the materials of textured faces, which come after those of smooth surfaces.
  [[nodiscard]] const std::vector<SurfaceMaterial>& textured_materials() const { return textured_materials_; }
  /// Returns true if the material with this number is one of textured faces.
  [[nodiscard]] bool is_textured(std::size_t material) const {
    return material >= materials_.size() + smooth_materials_.size();
  }
  /// Returns the number of images that the materials of textured faces use: one per texture, or the atlas.
  [[nodiscard]] std::size_t face_image_count() const;
  /// Returns the name of the texture, or "atlas". Requires: an image of textured faces.
  [[nodiscard]] std::string face_image_name(std::size_t image) const;
  /// Returns a texture or the atlas as an image, without alpha if it is opaque. `tint`: multiplies it in linear light,
  /// 0 to 1; not for the atlas. Requires: an image of textured faces.
  [[nodiscard]] PngImage face_image(std::size_t image, const Vec3& tint = Vec3(1.0F)) const;
  /// Returns the alpha of a texture or the atlas as a grey image. Requires: an image of textured faces.
  [[nodiscard]] PngImage face_alpha_image(std::size_t image) const;
  /// Returns true if textured faces use an atlas, which does not repeat.
  [[nodiscard]] bool has_face_atlas() const { return faces_ == FaceColours::Atlas; }
  /// Returns the texture coordinates of each vertex of textured faces, from the upper left corner. Textures repeat, so
  /// each face has coordinates relative to its own lowest corner, which are small; those of looks are given. In an
  /// atlas, they lie within the texture. Requires: all faces are textured or have a look and, for an atlas, cover one
  /// voxel each.
  [[nodiscard]] std::vector<std::array<float, 2>> face_coordinates(const MeshView& view) const;
  /// Returns true if blocks may have textured faces.
  [[nodiscard]] bool draws_textures() const { return draws_textures_; }
  /// Returns the material number of a smooth triangle, by its first vertex.
  /// Requires: the meshes have such a triangle.
  [[nodiscard]] std::size_t smooth_material(const MeshView& view, std::uint32_t vertex) const;

  /// Rows of every texture, a power of two.
  [[nodiscard]] std::uint32_t rows() const { return rows_; }
  /// Returns the centre of a type's texel, from the top left; exact in float.
  [[nodiscard]] std::array<float, 2> texel_centre(VoxelType type) const {
    QUOIN_ASSERT(type < std::size_t{kPaletteWidth} * rows_, "a texel of the palette");
    const std::uint32_t column = type % kPaletteWidth;
    const std::uint32_t row = type / kPaletteWidth;
    // Both sizes are powers of two, so multiplying is as exact as dividing.
    return {(static_cast<float>(column) + 0.5F) * (1.0F / static_cast<float>(kPaletteWidth)),
            (static_cast<float>(row) + 0.5F) * row_height_};
  }

  /// Returns the thickness of the bodies of a smooth transparent material, in voxels or samples.
  [[nodiscard]] float smooth_thickness(std::size_t material) const;

  /// Returns sRGB colours with linear alpha: the glass colour for transparent types used by blocks of the meshes, alpha
  /// 255 for opaque types.
  [[nodiscard]] PngImage base_colour() const;
  /// As above, without alpha.
  [[nodiscard]] PngImage opaque_colour() const;
  /// Returns roughness in green and metalness in blue, both linear.
  [[nodiscard]] PngImage metallic_roughness() const;
  /// Returns sRGB colours; black without emission.
  [[nodiscard]] PngImage emissive() const;

 private:
  using Usage = std::array<std::vector<bool>, kSurfaceClasses>;
  /// The key of a smooth material: the type if it emits or is transparent, else its roughness and metalness.
  struct SmoothLook {
    bool is_transparent = false;
    VoxelType type = kAir;
    float roughness = 1.0F;
    float metalness = 0.0F;
    auto operator<=>(const SmoothLook&) const = default;
  };

  static constexpr std::size_t kNoTexture = ~std::size_t{0};

  /// The key of a material of textured faces.
  struct TexturedLook {
    SurfaceClass surface = SurfaceClass::Opaque;
    std::size_t texture = kNoTexture;
    FaceAlpha alpha = FaceAlpha::Opaque;
    // The tint, sRGB. Not as an array: those of libc++ 16 have no order.
    std::uint8_t red = 255;
    std::uint8_t green = 255;
    std::uint8_t blue = 255;
    float roughness = 1.0F;
    float metalness = 0.0F;
    float emission = 0.0F;
    auto operator<=>(const TexturedLook&) const = default;
  };

  [[nodiscard]] std::size_t texture_of(const VoxelFace& face) const;
  [[nodiscard]] const FaceAtlas::Tile& tile_of(const VoxelFace& face) const;
  void move_into_atlas(const MeshView& view, std::vector<std::array<float, 2>>& coordinates) const;
  /// Returns the face of a block's vertex if it is drawn with a material of its own.
  [[nodiscard]] const VoxelFace* face_of(const MeshView& view, std::size_t vertex) const {
    return draws_textures_ ? face_at(view, vertex, types_) : nullptr;
  }
  [[nodiscard]] TexturedLook textured_look(const MeshView& view, std::size_t vertex) const;
  void add_textures_of(const MeshView& view);
  void make_textured_materials();
  void find_bands(const Usage& used);
  void make_materials(const Usage& used);
  void add_material(SurfaceClass surface, std::size_t group, std::string name);
  void find_glass(const SceneMeshes& meshes);
  void make_smooth_materials(const SceneMeshes& meshes);
  [[nodiscard]] SmoothLook smooth_look(const MeshView& view, std::uint32_t vertex) const;
  [[nodiscard]] SurfaceMaterial smooth_material_of(const SmoothLook& look) const;
  [[nodiscard]] float strength_of(SurfaceClass surface, VoxelType type) const;
  [[nodiscard]] std::size_t group_of(SurfaceClass surface, VoxelType type) const;
  [[nodiscard]] PngImage blank(std::uint32_t channels) const;

  const VoxelRegistry& types_;
  std::uint32_t rows_ = 1;
  float row_height_ = 1.0F;   // of a texture row
  std::vector<float> bands_;  ///< strongest of each, descending
  std::vector<std::uint16_t> band_of_type_;
  std::vector<SurfaceMaterial> materials_;
  std::vector<SurfaceMaterial> smooth_materials_;
  std::map<SmoothLook, std::size_t> smooth_by_look_;
  bool has_light_ = false;         ///< vertex colours include all light, so types do not matter
  float smooth_thickness_ = 1.0F;  ///< the material of all transparent surfaces without types
  std::map<std::pair<SurfaceClass, std::size_t>, std::size_t> by_class_and_group_;
  FaceColours faces_;
  bool draws_textures_ = false;
  VertexWriter face_writer_;  // of texture coordinates
  TextureSet texture_layers_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> texture_by_layer_;  // by array and layer
  std::vector<Texture> textures_;
  std::vector<SurfaceMaterial> textured_materials_;
  std::map<TexturedLook, std::size_t> textured_by_look_;
  FaceAtlas atlas_;
  bool fits_ = true;
  std::map<std::pair<std::size_t, std::uint32_t>, std::size_t> tile_by_texture_;  // and tint
};

/// The surfaces of a part, one per material. A surface with a single material is borrowed, not copied.
///
/// Requires: the part's arrays outlive this object.
class MaterialSurfaces {
 public:
  struct Surface {
    MeshView view;
    std::size_t material = 0;
  };

  MaterialSurfaces(const MeshPart& part, const MaterialPalette& palette);

  [[nodiscard]] const std::vector<Surface>& surfaces() const { return surfaces_; }

 private:
  void add(const MeshView& view, const MaterialPalette& palette);
  void add_smooth(const MeshView& view, const MaterialPalette& palette);

  std::vector<Surface> surfaces_;
  struct Owned {
    BlockyTriangles triangles;
    std::vector<LinearRgba16> light;
  };
  std::vector<std::unique_ptr<Owned>> owned_;
  struct OwnedSmooth {
    SmoothMesh mesh;
    std::vector<LinearRgba16> light;
    std::vector<std::uint32_t> moved_to;  ///< by vertex of the whole surface
  };
  std::vector<std::unique_ptr<OwnedSmooth>> owned_smooth_;
};

}  // namespace quoin
