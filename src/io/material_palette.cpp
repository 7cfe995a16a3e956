#include "io/material_palette.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <span>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <quoin/core/assert.h>

#include "io/mesh_parts.h"

namespace quoin {

namespace {

bool emits(SurfaceClass surface) {
  return surface == SurfaceClass::Emissive || surface == SurfaceClass::EmissiveTransparent;
}

/// Appends vertex `from` of `source`; returns its index in `target`.
std::uint32_t copy_vertex(const MeshView& source, std::size_t from, BlockyTriangles& target) {
  QUOIN_ASSERT(from < source.positions.size(), "a vertex of the surface");
  target.positions.push_back(source.positions[from]);
  target.directions.push_back(source.directions[from]);
  if (!source.block_occlusion.empty()) target.occlusion.push_back(source.block_occlusion[from]);
  target.types.push_back(source.types[from]);
  if (!source.looks.empty()) target.looks.push_back(source.looks[from]);
  return static_cast<std::uint32_t>(target.positions.size() - 1);
}

/// Returns true if any block has a look of its own (VertexLook).
bool have_looks(const SceneMeshes& meshes) {
  return std::ranges::any_of(meshes.parts, [](const MeshPart& part) {
    return std::ranges::any_of(part.surfaces, [](const MeshView& view) { return !view.looks.empty(); });
  });
}

/// Appends vertex `from` of a smooth surface; returns its index in `target`.
std::uint32_t copy_vertex(const MeshView& source, std::size_t from, SmoothMesh& target,
                          std::vector<LinearRgba16>& light) {
  QUOIN_ASSERT(from < source.positions.size() && from < source.types.size(), "a vertex with a type");
  target.positions.push_back(source.positions[from]);
  target.normals.push_back(source.normals[from]);
  target.albedo.push_back(source.albedo[from]);
  target.types.push_back(source.types[from]);
  if (!source.occlusion.empty()) target.occlusion.push_back(source.occlusion[from]);
  if (!source.materials.empty()) target.materials.push_back(source.materials[from]);
  if (!source.light.empty()) light.push_back(source.light[from]);
  return static_cast<std::uint32_t>(target.positions.size() - 1);
}

/// Clamps to the values of the file format: finite and not negative.
float clamped_emission(float emission) {
  return emission > 0.0F ? std::min(emission, std::numeric_limits<float>::max()) : 0.0F;
}

std::uint8_t byte_from_unit(double value) {
  if (!(value > 0.0)) return 0;
  return static_cast<std::uint8_t>(std::lround(std::min(value, 1.0) * 255.0));
}

/// The sRGB transfer functions of IEC 61966-2-1.
double linear_from_srgb(std::uint8_t value) {
  const double encoded = value / 255.0;
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

std::uint8_t srgb_from_linear(double linear) {
  return byte_from_unit(linear <= 0.0031308 ? linear * 12.92 : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055);
}

std::uint8_t scaled_in_linear_light(std::uint8_t srgb, double factor) {
  return factor == 1.0 ? srgb : srgb_from_linear(linear_from_srgb(srgb) * factor);
}

std::uint32_t number_of(Rgba8 tint) {
  return std::uint32_t{tint.r} << 16U | std::uint32_t{tint.g} << 8U | tint.b;
}

const char* material_name(SurfaceClass surface) {
  switch (surface) {
    case SurfaceClass::Opaque:
      return "voxels opaque";
    case SurfaceClass::Transparent:
      return "voxels transparent";
    case SurfaceClass::Emissive:
      return "voxels emissive";
    case SurfaceClass::EmissiveTransparent:
      return "voxels emissive transparent";
  }
  return "voxels";
}

}  // namespace

MaterialPalette::MaterialPalette(const SceneMeshes& meshes, FaceColours faces)
    : types_(meshes.types),
      faces_(faces),
      draws_textures_(faces != FaceColours::Means && (meshes.types.has_textures() || have_looks(meshes)) &&
                      meshes.atlas.rgb.empty()),
      face_writer_({2 * sizeof(float), {{VertexAttribute::TextureUv, VertexFormat::Float32x2, 0}}}, types_) {
  const auto rows = static_cast<std::uint32_t>((types_.size() + kPaletteWidth - 1) / kPaletteWidth);
  rows_ = std::bit_ceil(std::max(rows, 1U));
  row_height_ = 1.0F / static_cast<float>(rows_);
  Usage used;
  for (auto& types : used) types.resize(types_.size());
  for (const MeshPart& part : meshes.parts) {
    for (const MeshView& view : part.surfaces) {
      if (view.has_albedo()) continue;
      std::vector<bool>& of_class = used.at(static_cast<std::size_t>(view.surface));
      for (std::size_t i = 0; i < view.types.size(); ++i) {
        QUOIN_ASSERT(view.types[i] < types_.size(), "a type of the registry");
        if (face_of(view, i) == nullptr) of_class[view.types[i]] = true;
      }
      if (draws_textures_) add_textures_of(view);
    }
  }
  find_bands(used);
  make_materials(used);
  find_glass(meshes);
  make_smooth_materials(meshes);
  make_textured_materials();
  if (has_face_atlas()) fits_ = atlas_.place();
}

Status MaterialPalette::validate() const {
  if (fits_) return {};
  return make_error(ErrorCode::LimitExceeded, "the textures need an atlas larger than " +
                                                  std::to_string(FaceAtlas::kMaxEdge) +
                                                  " texels per side; write an image per texture");
}

std::size_t MaterialPalette::texture_of(const VoxelFace& face) const {
  const auto layer = texture_layers_.find(face.texture);
  QUOIN_ASSERT(layer.has_value(), "a texture that was added");
  return texture_by_layer_.at({layer->array, layer->layer});
}

const FaceAtlas::Tile& MaterialPalette::tile_of(const VoxelFace& face) const {
  const auto found = tile_by_texture_.find({texture_of(face), number_of(face.tint)});
  QUOIN_ASSERT(found != tile_by_texture_.end(), "a texture in the atlas");
  return atlas_.tiles()[found->second];
}

MaterialPalette::TexturedLook MaterialPalette::textured_look(const MeshView& view, std::size_t vertex) const {
  const VoxelFace* const shown = face_of(view, vertex);
  QUOIN_ASSERT(shown != nullptr, "a textured face");
  const VoxelFace& face = *shown;
  const VoxelProperties& type = types_[view.types[vertex]];
  const auto unit = [](float value, float otherwise) { return value >= 0.0F ? std::min(value, 1.0F) : otherwise; };
  TexturedLook look;
  look.surface = view.surface;
  const bool is_in_atlas = has_face_atlas() && !face.texture.is_null();
  if (!face.texture.is_null()) look.texture = is_in_atlas ? 0 : texture_of(face);
  look.alpha = face.alpha;
  if (!is_in_atlas) {
    look.red = face.tint.r;
    look.green = face.tint.g;
    look.blue = face.tint.b;
  }
  look.roughness = unit(type.roughness, 1.0F);
  look.metalness = unit(type.metalness, 0.0F);
  look.emission = emits(view.surface) ? clamped_emission(type.emission) * emission_factor(face) : 0.0F;
  return look;
}

void MaterialPalette::add_textures_of(const MeshView& view) {
  // Most vertices have the face of the one before.
  std::pair<VoxelType, const VoxelFace*> last{kAir, nullptr};
  for (std::size_t i = 0; i < view.types.size(); ++i) {
    const VoxelFace* const face = face_of(view, i);
    if (face == nullptr || std::pair(view.types[i], face) == last) continue;
    last = {view.types[i], face};
    if (!face->texture.is_null()) {
      const TextureLayer layer = texture_layers_.add(face->texture);
      if (texture_by_layer_.try_emplace({layer.array, layer.layer}, textures_.size()).second) {
        textures_.push_back(face->texture);
      }
      const std::pair tile(texture_of(*face), number_of(face->tint));
      if (has_face_atlas() && tile_by_texture_.try_emplace(tile, atlas_.tiles().size()).second) {
        atlas_.add(face->texture, face->tint);
      }
    }
    textured_by_look_.try_emplace(textured_look(view, i));
  }
}

void MaterialPalette::make_textured_materials() {
  UniqueNames names;
  for (const auto* const materials : {&materials_, &smooth_materials_}) {
    for (const SurfaceMaterial& material : *materials) (void)names.add(material.name, " ");
  }
  for (auto& [look, number] : textured_by_look_) {
    number = textured_materials_.size();
    SurfaceMaterial& material = textured_materials_.emplace_back();
    const bool has_texture = look.texture != kNoTexture;
    material.name = names.add(has_texture ? face_image_name(look.texture) : "tint", " ");
    material.surface = look.surface;
    material.emission = look.emission;
    material.roughness = look.roughness;
    material.metalness = look.metalness;
    if (has_texture) material.texture = look.texture;
    material.alpha = look.alpha;
    material.tint = linear_colour(Rgba8{look.red, look.green, look.blue});
  }
}

std::size_t MaterialPalette::material_of(const MeshView& view, std::size_t vertex) const {
  QUOIN_ASSERT(vertex < view.types.size(), "a vertex with a type");
  if (face_of(view, vertex) == nullptr) return material_of(view.surface, view.types[vertex]);
  const auto found = textured_by_look_.find(textured_look(view, vertex));
  QUOIN_ASSERT(found != textured_by_look_.end(), "a face that the meshes have");
  return materials_.size() + smooth_materials_.size() + found->second;
}

void MaterialPalette::find_bands(const Usage& used) {
  std::vector<float> strengths;
  const auto& opaque = used[static_cast<std::size_t>(SurfaceClass::Emissive)];
  const auto& transparent = used[static_cast<std::size_t>(SurfaceClass::EmissiveTransparent)];
  for (std::size_t type = 0; type < types_.size(); ++type) {
    const float emission = clamped_emission(types_[static_cast<VoxelType>(type)].emission);
    if ((opaque[type] || transparent[type]) && emission > 0.0F) strengths.push_back(emission);
  }
  std::sort(strengths.begin(), strengths.end(), std::greater<>());
  for (const float strength : strengths) {
    if (bands_.empty() || strength < bands_.back() / 2.0F) bands_.push_back(strength);
  }
  band_of_type_.assign(types_.size(), 0);
  for (std::size_t type = 0; type < types_.size() && !bands_.empty(); ++type) {
    const float emission = clamped_emission(types_[static_cast<VoxelType>(type)].emission);
    const auto weaker =
        std::partition_point(bands_.begin(), bands_.end(), [&](float band) { return band >= emission; });
    if (weaker != bands_.begin()) band_of_type_[type] = static_cast<std::uint16_t>(weaker - bands_.begin() - 1);
  }
}

// Returns the material's group: a transparent type, or a band of emission strengths of opaque types.
std::size_t MaterialPalette::group_of(SurfaceClass surface, VoxelType type) const {
  QUOIN_ASSERT(type < band_of_type_.size(), "a type of the registry");
  if (is_transparent(surface)) return type;
  return emits(surface) ? band_of_type_[type] : 0;
}

float MaterialPalette::strength_of(SurfaceClass surface, VoxelType type) const {
  QUOIN_ASSERT(type < band_of_type_.size(), "a type of the registry");
  return emits(surface) && !bands_.empty() ? bands_[band_of_type_[type]] : 0.0F;
}

void MaterialPalette::make_materials(const Usage& used) {
  for (std::size_t index = 0; index < kSurfaceClasses; ++index) {
    const auto surface = static_cast<SurfaceClass>(index);
    std::map<std::size_t, VoxelType> groups;
    for (std::size_t type = 0; type < types_.size(); ++type) {
      const auto id = static_cast<VoxelType>(type);
      if (used[index][type]) groups.try_emplace(group_of(surface, id), id);
    }
    int number = 0;
    for (const auto& [group, type] : groups) {
      SurfaceMaterial material;
      material.name = material_name(surface);
      material.surface = surface;
      material.emission = strength_of(surface, type);
      if (is_transparent(surface)) material.type = type;
      if (groups.size() > 1) material.name.append(1, ' ').append(std::to_string(++number));
      by_class_and_group_[{surface, group}] = materials_.size();
      materials_.push_back(std::move(material));
    }
  }
}

void MaterialPalette::find_glass(const SceneMeshes& meshes) {
  const GlassBodies bodies(meshes);
  const Surfaces looks(types_);
  for (SurfaceMaterial& material : materials_) {
    if (!material.is_transparent()) continue;
    const auto [thickness, unit] = bodies.typical(material.type);
    material.glass = glass_material(looks[material.type], thickness);
    material.unit = unit;
  }
}

MaterialPalette::SmoothLook MaterialPalette::smooth_look(const MeshView& view, std::uint32_t vertex) const {
  SmoothLook look;
  look.is_transparent = is_transparent(view.surface);
  QUOIN_ASSERT(vertex < view.positions.size(), "a vertex of the surface");
  const VoxelType type = view.types.empty() || has_light_ ? kAir : view.types[vertex];
  if (type == kAir || type >= types_.size()) return look;
  const VoxelProperties& properties = types_[type];
  if (look.is_transparent || clamped_emission(properties.emission) > 0.0F) look.type = type;
  look.roughness = properties.roughness;
  look.metalness = properties.metalness;
  return look;
}

SurfaceMaterial MaterialPalette::smooth_material_of(const SmoothLook& look) const {
  SurfaceMaterial material;
  material.surface = look.is_transparent ? SurfaceClass::Transparent : SurfaceClass::Opaque;
  material.name = look.is_transparent ? "smooth transparent" : "smooth";
  material.type = look.type;
  material.roughness = std::clamp(look.roughness, 0.0F, 1.0F);
  material.metalness = std::clamp(look.metalness, 0.0F, 1.0F);
  const VoxelProperties& properties = types_[look.type];
  // Textures are projected along three axes, so no share of a face (VoxelFace::emission_share) fits a triangle.
  const float emission = look.type == kAir ? 0.0F : clamped_emission(properties.emission);
  if (!(emission > 0.0F)) return material;
  material.surface = look.is_transparent ? SurfaceClass::EmissiveTransparent : SurfaceClass::Emissive;
  material.emission = emission;
  const Rgba8 colour = properties.colour;
  material.emission_colour = {linear_from_srgb(colour.r), linear_from_srgb(colour.g), linear_from_srgb(colour.b)};
  return material;
}

void MaterialPalette::make_smooth_materials(const SceneMeshes& meshes) {
  has_light_ = has_light(meshes);
  const GlassBodies bodies(meshes);
  smooth_thickness_ = bodies.thickness_of_smooth();
  for (const MeshPart& part : meshes.parts) {
    for (const MeshView& view : part.surfaces) {
      for (std::size_t i = 0; view.has_albedo() && i < view.indices.size(); i += 3) {
        smooth_by_look_.try_emplace(smooth_look(view, view.indices[i]));
      }
    }
  }
  const Surfaces looks(types_);
  std::array<std::size_t, 2> counts{};
  for (const auto& [look, number] : smooth_by_look_) ++counts[look.is_transparent ? 1 : 0];
  std::array<std::size_t, 2> numbers{};
  for (auto& [look, number] : smooth_by_look_) {
    number = smooth_materials_.size();
    SurfaceMaterial material = smooth_material_of(look);
    const std::size_t which = look.is_transparent ? 1 : 0;
    if (counts[which] > 1) material.name.append(1, ' ').append(std::to_string(++numbers[which]));
    if (look.is_transparent && look.type != kAir) {
      const auto [thickness, unit] = bodies.typical_of_smooth(look.type);
      material.glass = glass_material(looks[look.type], thickness);
      material.unit = unit;
    }
    smooth_materials_.push_back(std::move(material));
  }
}

std::size_t MaterialPalette::smooth_material(const MeshView& view, std::uint32_t vertex) const {
  const auto found = smooth_by_look_.find(smooth_look(view, vertex));
  QUOIN_ASSERT(found != smooth_by_look_.end(), "a triangle that the meshes have");
  return materials_.size() + found->second;
}

float MaterialPalette::smooth_thickness(std::size_t material) const {
  QUOIN_ASSERT(material >= materials_.size() && material - materials_.size() < smooth_materials_.size(),
               "a smooth material");
  const SurfaceMaterial& of = smooth_materials_[material - materials_.size()];
  return of.type == kAir ? smooth_thickness_ : of.glass.thickness;
}

std::size_t MaterialPalette::material_of(SurfaceClass surface, VoxelType type) const {
  const auto found = by_class_and_group_.find({surface, group_of(surface, type)});
  QUOIN_ASSERT(found != by_class_and_group_.end(), "a class and type that the meshes have");
  return found->second;
}

bool MaterialPalette::has_emission() const {
  return std::any_of(materials_.begin(), materials_.end(), [](const SurfaceMaterial& m) { return m.is_emissive(); });
}

PngImage MaterialPalette::blank(std::uint32_t channels) const {
  return {kPaletteWidth, rows_, channels, std::vector<std::uint8_t>(std::size_t{kPaletteWidth} * rows_ * channels)};
}

PngImage MaterialPalette::base_colour() const {
  PngImage image = opaque_colour();
  for (std::size_t type = 1; type < types_.size(); ++type) {
    const VoxelProperties& properties = types_[static_cast<VoxelType>(type)];
    if (properties.visibility == Visibility::Transparent) image.pixels[type * 4 + 3] = properties.colour.a;
  }
  for (const SurfaceMaterial& material : materials_) {
    if (material.is_transparent()) {
      QUOIN_ASSERT(material.type < types_.size(), "a type of the registry");
      image.pixels[std::size_t{material.type} * 4 + 3] = byte_from_unit(static_cast<double>(material.glass.alpha));
    }
  }
  return image;
}

PngImage MaterialPalette::opaque_colour() const {
  PngImage image = blank(4);
  for (std::size_t type = 1; type < types_.size(); ++type) {
    const Rgba8 colour = types_[static_cast<VoxelType>(type)].colour;
    std::uint8_t* texel = image.pixels.data() + type * 4;
    texel[0] = colour.r;
    texel[1] = colour.g;
    texel[2] = colour.b;
    texel[3] = 255;
  }
  return image;
}

PngImage MaterialPalette::metallic_roughness() const {
  PngImage image = blank(3);
  for (std::size_t type = 1; type < types_.size(); ++type) {
    const VoxelProperties& properties = types_[static_cast<VoxelType>(type)];
    image.pixels[type * 3 + 1] = byte_from_unit(properties.roughness);
    image.pixels[type * 3 + 2] = byte_from_unit(properties.metalness);
  }
  return image;
}

PngImage MaterialPalette::emissive() const {
  PngImage image = blank(3);
  for (std::size_t type = 1; type < types_.size() && !bands_.empty(); ++type) {
    const VoxelProperties& properties = types_[static_cast<VoxelType>(type)];
    const float emission = clamped_emission(properties.emission);
    const double factor =
        std::min(1.0, static_cast<double>(emission) / static_cast<double>(bands_[band_of_type_[type]]));
    std::uint8_t* texel = image.pixels.data() + type * 3;
    texel[0] = scaled_in_linear_light(properties.colour.r, factor);
    texel[1] = scaled_in_linear_light(properties.colour.g, factor);
    texel[2] = scaled_in_linear_light(properties.colour.b, factor);
  }
  return image;
}

std::vector<std::array<float, 2>> MaterialPalette::face_coordinates(const MeshView& view) const {
  QUOIN_ASSERT(view.positions.empty() || face_of(view, 0) != nullptr, "textured faces");
  std::vector<std::array<float, 2>> coordinates(view.positions.size());
  face_writer_.write(view, Vec3(0.0F), std::as_writable_bytes(std::span(coordinates)));
  if (has_face_atlas()) move_into_atlas(view, coordinates);
  return coordinates;
}

void MaterialPalette::move_into_atlas(const MeshView& view, std::vector<std::array<float, 2>>& coordinates) const {
  const Vec3 texel(1.0F / static_cast<float>(atlas_.width()), 1.0F / static_cast<float>(atlas_.height()), 0.0F);
  // Most vertices have the face of the one before.
  const VoxelFace* last = nullptr;
  const FaceAtlas::Tile* tile = nullptr;
  Vec3 first(0.0F);  // the coordinates at the lowest corner of the voxel's face
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    const VoxelFace* const face = face_of(view, i);
    QUOIN_ASSERT(face != nullptr, "a textured face");
    if (face->texture.is_null()) continue;
    if (face != last || view.directions[i] != view.directions[i - 1]) {
      last = face;
      const TextureFrame frame = texture_frame(*face, view.directions[i]);
      const auto is_negative = [](const IVec3& axis) { return axis.x + axis.y + axis.z < 0; };
      first = {is_negative(frame.right) ? 1.0F : 0.0F, is_negative(frame.down) ? 1.0F : 0.0F, 0.0F};
      tile = &tile_of(*face);
    }
    const auto size = static_cast<float>(tile->texture.size());
    const bool is_shape = !view.looks.empty() && view.looks[i].is_shape;  // its coordinates lie in the texture
    Vec3 inside = Vec3(coordinates[i][0], coordinates[i][1], 0.0F) + (is_shape ? Vec3(0.0F) : first);
    // Elements that reach outside their voxel show the texture's edge there.
    if (is_shape) inside = glm::clamp(inside, 0.0F, 1.0F);
    QUOIN_ASSERT(inside.x >= 0.0F && inside.x <= 1.0F && inside.y >= 0.0F && inside.y <= 1.0F, "faces of one voxel");
    const Vec3 at = (Vec3(tile->x, tile->y, 0) + inside * size) * texel;
    coordinates[i] = {at.x, at.y};
  }
}

std::size_t MaterialPalette::face_image_count() const {
  return has_face_atlas() ? std::min<std::size_t>(textures_.size(), 1) : textures_.size();
}

std::string MaterialPalette::face_image_name(std::size_t image) const {
  QUOIN_ASSERT(image < face_image_count(), "an image of textured faces");
  return has_face_atlas() ? "atlas" : textures_[image].name();
}

namespace {

/// Returns the texels of a texture, multiplied by a tint in linear light, 0 to 1.
std::vector<Rgba8> tinted(const Texture& texture, const Vec3& tint) {
  const AlphaImage image = texture.image();
  std::vector<Rgba8> texels;
  texels.reserve(image.rgba.size() / 4);
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    texels.push_back({image.rgba[i], image.rgba[i + 1], image.rgba[i + 2], image.rgba[i + 3]});
  }
  if (tint == Vec3(1.0F)) return texels;
  for (Rgba8& texel : texels) {
    const std::uint8_t alpha = texel.a;
    texel = quoin::srgb_colour(linear_colour(texel) * tint);
    texel.a = alpha;
  }
  return texels;
}

}  // namespace

PngImage MaterialPalette::face_image(std::size_t image, const Vec3& tint) const {
  QUOIN_ASSERT(image < face_image_count() && fits_, "an image of textured faces");
  if (has_face_atlas()) return atlas_.image();
  const Texture& of = textures_[image];
  const auto size = static_cast<std::uint32_t>(of.size());
  PngImage made{size, size, of.is_opaque() ? 3U : 4U, {}};
  made.pixels.reserve(made.channels * of.level(0).size());
  for (const Rgba8 shown : tinted(of, tint)) {
    made.pixels.insert(made.pixels.end(), {shown.r, shown.g, shown.b});
    if (!of.is_opaque()) made.pixels.push_back(shown.a);
  }
  return made;
}

bool FaceAtlas::place() {
  std::vector<Tile*> order;
  order.reserve(tiles_.size());
  for (Tile& tile : tiles_) order.push_back(&tile);
  std::ranges::stable_sort(order, std::greater<>(), [](const Tile* tile) { return tile->texture.size(); });
  for (int edge = 4 * kMargin; edge <= kMaxEdge; edge *= 2) {
    // In rows as high as their first tile.
    int x = 0;
    int y = 0;
    int end = 0;
    for (Tile* const tile : order) {
      const int size = tile->texture.size() + 2 * kMargin;
      if (x + size > edge) {
        x = 0;
        y = end;
      }
      if (x == 0) end = y + size;
      tile->x = x + kMargin;
      tile->y = y + kMargin;
      x += size;
      if (size > edge || end > edge) break;
    }
    width_ = edge;
    height_ = static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::max(end, 1))));
    const bool is_wide_enough = order.empty() || order.front()->texture.size() + 2 * kMargin <= edge;
    if (is_wide_enough && end <= edge) return true;
  }
  return false;
}

PngImage FaceAtlas::image() const {
  QUOIN_ASSERT(width_ > 0 && height_ > 0, "placed tiles");
  const bool is_opaque = std::ranges::all_of(tiles_, [](const Tile& tile) { return tile.texture.is_opaque(); });
  const std::size_t channels = is_opaque ? 3 : 4;
  const auto width = static_cast<std::size_t>(width_);
  Vec3 mean(0.0F);
  float alpha = 0.0F;
  for (const Tile& tile : tiles_) {
    mean += tile.texture.mean() * linear_colour(tile.tint) / static_cast<float>(tiles_.size());
    alpha += tile.texture.mean_alpha() / static_cast<float>(tiles_.size());
  }
  const Rgba8 between = quoin::srgb_colour(mean);
  const std::array<std::uint8_t, 4> filling = {between.r, between.g, between.b,
                                               byte_from_unit(static_cast<double>(alpha))};
  PngImage image{static_cast<std::uint32_t>(width_),
                 static_cast<std::uint32_t>(height_),
                 static_cast<std::uint32_t>(channels),
                 {}};
  image.pixels.resize(channels * width * static_cast<std::size_t>(height_));
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = filling[i % channels];
  for (const Tile& tile : tiles_) {
    const int size = tile.texture.size();
    const std::vector<Rgba8> texels = tinted(tile.texture, linear_colour(tile.tint));
    for (int y = -kMargin; y < size + kMargin; ++y) {
      const auto row = static_cast<std::size_t>(std::clamp(y, 0, size - 1) * size);
      const auto first = static_cast<std::size_t>(tile.y + y) * width + static_cast<std::size_t>(tile.x - kMargin);
      std::uint8_t* out = image.pixels.data() + channels * first;
      for (int x = -kMargin; x < size + kMargin; ++x) {
        const Rgba8 texel = texels[row + static_cast<std::size_t>(std::clamp(x, 0, size - 1))];
        const std::array<std::uint8_t, 4> bytes = {texel.r, texel.g, texel.b, texel.a};
        out = std::copy_n(bytes.begin(), channels, out);
      }
    }
  }
  return image;
}

PngImage MaterialPalette::face_alpha_image(std::size_t image) const {
  const PngImage made = face_image(image);
  PngImage grey{made.width, made.height, 3, {}};
  for (std::size_t i = made.channels - 1; i < made.pixels.size(); i += made.channels) {
    grey.pixels.insert(grey.pixels.end(), 3, made.channels == 4 ? made.pixels[i] : std::uint8_t{255});
  }
  return grey;
}

MaterialSurfaces::MaterialSurfaces(const MeshPart& part, const MaterialPalette& palette) {
  for (const MeshView& view : part.surfaces) {
    if (!view.indices.empty()) add(view, palette);
  }
}

void MaterialSurfaces::add(const MeshView& view, const MaterialPalette& palette) {
  if (view.has_albedo()) return add_smooth(view, palette);
  QUOIN_ASSERT(!view.types.empty(), "blocks have types");
  std::vector<std::size_t> materials;  // by vertex, if there may be several
  std::map<std::size_t, Owned*> by_material;
  if (emits(view.surface) || is_transparent(view.surface) || palette.draws_textures()) {
    materials.resize(view.types.size());
    for (std::size_t i = 0; i < materials.size(); ++i) {
      const bool is_as_before = i > 0 && view.types[i] == view.types[i - 1] &&
                                view.directions[i] == view.directions[i - 1] &&
                                (view.looks.empty() || view.looks[i].face == view.looks[i - 1].face);
      materials[i] = is_as_before ? materials[i - 1] : palette.material_of(view, i);
      if (!is_as_before) by_material.try_emplace(materials[i]);
    }
  }
  if (by_material.size() < 2) return surfaces_.push_back({view, palette.material_of(view, 0)});
  for (auto& [material, owned] : by_material) owned = owned_.emplace_back(std::make_unique<Owned>()).get();
  // A triangle lies in one face, so its three vertices have the same type and move together.
  std::vector<std::uint32_t> moved_to(view.positions.size());
  for (std::size_t i = 0; i < view.positions.size(); ++i) {
    Owned& owned = *by_material.at(materials[i]);
    moved_to[i] = copy_vertex(view, i, owned.triangles);
    if (!view.light.empty()) owned.light.push_back(view.light[i]);
  }
  for (const std::uint32_t index : view.indices) {
    by_material.at(materials[index])->triangles.indices.push_back(moved_to[index]);
  }
  for (const auto& [material, owned] : by_material) {
    surfaces_.push_back({view_of(owned->triangles, view.surface), material});
    surfaces_.back().view.light = owned->light;
    surfaces_.back().view.faces = view.faces;
  }
}

void MaterialSurfaces::add_smooth(const MeshView& view, const MaterialPalette& palette) {
  constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();
  std::map<std::size_t, OwnedSmooth*> by_material;
  for (std::size_t i = 0; i < view.indices.size(); i += 3) {
    by_material.try_emplace(palette.smooth_material(view, view.indices[i]));
  }
  if (by_material.size() == 1) return surfaces_.push_back({view, by_material.begin()->first});
  for (auto& [material, owned] : by_material) {
    owned = owned_smooth_.emplace_back(std::make_unique<OwnedSmooth>()).get();
    owned->moved_to.assign(view.positions.size(), kNowhere);
  }
  for (std::size_t i = 0; i < view.indices.size(); ++i) {
    OwnedSmooth& owned = *by_material.at(palette.smooth_material(view, view.indices[i / 3 * 3]));
    std::uint32_t& vertex = owned.moved_to[view.indices[i]];
    if (vertex == kNowhere) vertex = copy_vertex(view, view.indices[i], owned.mesh, owned.light);
    owned.mesh.indices.push_back(vertex);
  }
  for (const auto& [material, owned] : by_material) {
    owned->moved_to = {};
    surfaces_.push_back({view_of(owned->mesh), material});
    surfaces_.back().view.surface = view.surface;
    surfaces_.back().view.types = owned->mesh.types;
    surfaces_.back().view.light = owned->light;
  }
}

namespace {

constexpr float kLeastAttenuation = 0.01F;  // glTF colours may be 0, but some clients take logarithms of them

}  // namespace

GlassMaterial glass_material(const Surface& surface, float thickness) {
  QUOIN_ASSERT(thickness > 0.0F, "a body that has a thickness");
  GlassMaterial glass;
  glass.thickness = thickness;
  if (!std::isfinite(surface.log_clarity)) {
    glass.tint = Vec3(0.0F);
    return glass;
  }
  const float own = 1.0F - std::exp(surface.log_clarity * thickness);
  Vec3 passed;
  float wanted = 0.0F;
  float weight = 0.0F;
  for (int channel = 0; channel < 3; ++channel) {
    glass.tint[channel] = std::exp((surface.log_transmittance[channel] - surface.log_clarity) * thickness);
    passed[channel] = std::exp(surface.log_transmittance[channel] * thickness);
    const float square = surface.colour[channel] * surface.colour[channel];
    wanted += 1.0F - passed[channel] + own * square;
    weight += 1.0F + square;
  }
  glass.alpha = std::clamp(wanted / weight, own, 1.0F);
  if (!(glass.alpha > 0.0F)) return glass;
  glass.transmission = 1.0F - own / glass.alpha;
  for (int channel = 0; channel < 3; ++channel) {
    const float untinted = glass.alpha * glass.transmission * surface.colour[channel];
    if (!(untinted > 0.0F)) continue;
    // The remaining attenuation, after one alpha for all channels, may have any hue, and some clients apply it to the
    // uncovered part too.
    const float least = std::max(passed[channel], kLeastAttenuation);
    glass.attenuation[channel] =
        std::clamp((passed[channel] - (1.0F - glass.alpha)) / untinted, least, std::max(least, 1.0F));
  }
  return glass;
}

std::uint16_t glass_alpha(const LinearRgba16& albedo, float thickness) {
  constexpr float kFull = 65535.0F;
  Surface surface;
  surface.colour = Vec3(albedo[0], albedo[1], albedo[2]) / kFull;
  set_absorption(static_cast<float>(albedo[3]) / kFull, surface);
  return static_cast<std::uint16_t>(std::lround(glass_material(surface, thickness).alpha * kFull));
}

float thickness_of(const MeshView& view) {
  constexpr double kOpen = 1e-3;
  if (view.positions.empty()) return 1.0F;
  const DVec3 origin(view.positions.front());
  double volume = 0.0;
  DVec3 sum(0.0);
  DVec3 shown(0.0);
  for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
    const DVec3 a = DVec3(view.positions[view.indices[i]]) - origin;
    const DVec3 b = DVec3(view.positions[view.indices[i + 1]]) - origin;
    const DVec3 c = DVec3(view.positions[view.indices[i + 2]]) - origin;
    volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    const DVec3 area = glm::cross(b - a, c - a) / 2.0;
    sum += area;
    shown += glm::abs(area) / 2.0;
  }
  const double largest = std::max({shown.x, shown.y, shown.z});
  if (!(volume > 0.0) || !(largest > 0.0) || glm::length(sum) > kOpen * largest) return 1.0F;
  return static_cast<float>(volume / largest);
}

namespace {

double area_of(const MeshView& view, std::size_t i) {
  QUOIN_ASSERT(i + 2 < view.indices.size(), "a triangle of the surface");
  const Vec3 a = view.positions[view.indices[i]];
  return glm::length(glm::cross(DVec3(view.positions[view.indices[i + 1]] - a),
                                DVec3(view.positions[view.indices[i + 2]] - a))) /
         2.0;
}

double area_of(const MeshView& view) {
  double area = 0.0;
  for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) area += area_of(view, i);
  return area;
}

/// Returns the world length of a unit of the part.
double unit_of(const MeshPlacement& placement) {
  return std::cbrt(std::abs(glm::determinant(glm::dmat3(placement.matrix()))));
}

float thickness_of(const MeshPart& part, const MeshView& view, VoxelType type) {
  for (const GlassThickness& known : part.thickness) {
    if (known.type == type && known.voxels > 0.0F) return known.voxels;
  }
  std::vector<std::uint32_t> indices;
  for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
    QUOIN_ASSERT(view.indices[i] < view.types.size(), "a vertex with a type");
    if (view.types[view.indices[i]] == type) indices.insert(indices.end(), &view.indices[i], &view.indices[i] + 3);
  }
  MeshView own = view;
  own.indices = indices;
  return thickness_of(own);
}

}  // namespace

GlassBodies::GlassBodies(const SceneMeshes& meshes) {
  std::vector<double> squares(meshes.parts.size());
  std::vector<double> cubes(meshes.parts.size());
  for (const MeshPlacement& placement : meshes.placements) {
    QUOIN_ASSERT(placement.part < meshes.parts.size(), "a part of the meshes");
    const double unit = unit_of(placement);
    squares[placement.part] += unit * unit;
    cubes[placement.part] += unit * unit * unit;
  }
  for (std::size_t i = 0; i < meshes.parts.size(); ++i) {
    if (!(squares[i] > 0.0)) continue;
    const double unit = cubes[i] / squares[i];
    for (const MeshView& view : meshes.parts[i].surfaces) {
      if (!is_transparent(view.surface) || view.indices.empty()) continue;
      if (view.has_albedo()) {
        smooth_.push_back({quoin::thickness_of(view), unit, area_of(view) * squares[i]});
        if (!view.types.empty()) add_by_type({}, view, unit, squares[i], smooth_by_type_);
      } else {
        add_by_type(meshes.parts[i], view, unit, squares[i], by_type_);
      }
    }
  }
}

void GlassBodies::add_by_type(const MeshPart& part, const MeshView& view, double unit, double times, ByType& all) {
  std::map<VoxelType, double> areas;
  for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
    areas[view.types[view.indices[i]]] += area_of(view, i) * times;
  }
  for (const auto& [type, area] : areas) all[type].push_back({thickness_of(part, view, type), unit, area});
}

GlassBodies::Typical GlassBodies::typical(VoxelType type) const {
  const auto found = by_type_.find(type);
  return found == by_type_.end() ? Typical{} : typical_of(found->second);
}

GlassBodies::Typical GlassBodies::typical_of_smooth(VoxelType type) const {
  const auto found = smooth_by_type_.find(type);
  return found == smooth_by_type_.end() ? Typical{} : typical_of(found->second);
}

GlassBodies::Typical GlassBodies::typical_of(std::vector<Seen> seen) {
  std::ranges::sort(seen, {}, &Seen::thickness);
  double area = 0.0;
  double units = 0.0;
  for (const Seen& each : seen) {
    area += each.area;
    units += each.area * each.unit;
  }
  QUOIN_ASSERT(!seen.empty(), "at least one body");
  Typical typical{seen.back().thickness, area > 0.0 ? static_cast<float>(units / area) : 1.0F};
  double before = 0.0;
  for (const Seen& each : seen) {
    before += each.area;
    if (before < area / 2.0) continue;
    typical.thickness = each.thickness;
    break;
  }
  return typical;
}

}  // namespace quoin
