#include "scene/surfaces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "core/srgb.h"
#include "grid/shapes/shape_index.h"

namespace quoin {

std::optional<float> glass_ior(const VoxelProperties& properties) {
  if (!(properties.ior >= 1.0F) || !std::isfinite(properties.ior)) return std::nullopt;
  return properties.ior;
}

float emission_of(const VoxelProperties& properties) {
  return properties.emission > 0.0F ? std::min(properties.emission, std::numeric_limits<float>::max() / 4.0F) : 0.0F;
}

void set_absorption(float alpha, Surface& surface) {
  QUOIN_ASSERT(alpha >= 0.0F && alpha <= 1.0F, "0 <= alpha <= 1");
  // One voxel covers `alpha` of the background and tints the rest. The tint increases with `alpha`.
  surface.log_clarity = std::log(1.0F - alpha);
  for (int channel = 0; channel < 3; ++channel) {
    surface.log_transmittance[channel] = std::log((1.0F - alpha) * (1.0F - alpha * (1.0F - surface.colour[channel])));
  }
}

namespace {

// Mirrors all but four thousandths, and its square is a number.
constexpr float kLargestIor = 1e3F;
constexpr float kMostScattering = 1e6F;

Surface surface_of(const VoxelProperties& properties, Clouds clouds) {
  Surface surface;
  const Rgba8 c = properties.colour;
  surface.colour = linear_colour(c);
  surface.emission = emission_of(properties);
  surface.emitted = surface.colour * surface.emission;
  surface.roughness = properties.roughness >= 0.0F ? std::min(properties.roughness, 1.0F) : 1.0F;
  surface.metalness = properties.metalness >= 0.0F ? std::min(properties.metalness, 1.0F) : 0.0F;
  if (properties.visibility != Visibility::Transparent) return surface;
  set_absorption(static_cast<float>(c.a) / 255.0F, surface);
  surface.ior = std::min(glass_ior(properties).value_or(1.0F), kLargestIor);
  if (clouds == Clouds::AsGlass || !(properties.scattering > 0.0F)) return surface;
  surface.scattering = std::min(properties.scattering, kMostScattering);
  if (!std::isnan(properties.anisotropy)) surface.anisotropy = std::clamp(properties.anisotropy, -0.99F, 0.99F);
  surface.ior = 1.0F;
  surface.log_clarity = -surface.scattering;
  surface.log_transmittance = Vec3(-surface.scattering);
  return surface;
}

CellContent content_of(const VoxelProperties& properties, Clouds clouds) {
  if (properties.visibility != Visibility::Transparent) return CellContent::Glass;
  const bool is_glass = std::ranges::all_of(
      kDirections, [&](Direction each) { return properties.faces[each].alpha == FaceAlpha::Translucent; });
  if (!is_glass) return CellContent::Faces;
  // A cloud has no surface to show a texture on.
  const bool is_cloud = clouds == Clouds::Scatter && properties.scattering > 0.0F;
  return is_cloud ? CellContent::Glass : CellContent::TexturedGlass;
}

// The shares of three neighbouring samples of an axis at a place. `off`: from the middle sample to the place, -0.5 to
// 0.5.
std::array<float, 3> shares_along(float off) {
  return {0.25F - 0.5F * off, 0.5F, 0.25F + 0.5F * off};
}

// The materials of the solid samples around a point, each once, with the sum of its samples' shares.
class MaterialShares {
 public:
  MaterialShares(const DensityGrid& field, IVec3 cell, const DVec3& inside) {
    std::array<std::array<float, 3>, 3> along;
    IVec3 first{0};
    for (int axis = 0; axis < 3; ++axis) {
      const int nearer = inside[axis] < 0.5 ? 0 : 1;
      first[axis] = cell[axis] + nearer - 1;
      along[static_cast<std::size_t>(axis)] = shares_along(static_cast<float>(inside[axis] - nearer));
    }
    for (int i = 0; i < 27; ++i) {
      const IVec3 step{i % 3, i / 3 % 3, i / 9};
      const IVec3 sample = first + step;
      if (i == 0 || chunk_of(sample) != at_) find_chunk(field, chunk_of(sample));
      if (chunk_ == nullptr) continue;
      const IVec3 local = local_of(sample);
      if (step.x == 0 || local.x == 0) solid_ = chunk_->solid_row(local.y, local.z);
      if ((solid_ >> local.x & 1U) == 0) continue;
      const auto share_of = [&](int axis) {
        return along[static_cast<std::size_t>(axis)][static_cast<std::size_t>(step[axis])];
      };
      add(only_ ? *only_ : chunk_->materials().get(local), share_of(0) * share_of(1) * share_of(2));
    }
  }

  struct Share {
    VoxelType material = kAir;
    float share = 0.0F;
  };
  [[nodiscard]] std::span<const Share> all() const { return {shares_.data(), count_}; }

 private:
  void find_chunk(const DensityGrid& field, IVec3 at) {
    at_ = at;
    chunk_ = field.find_chunk(at);
    only_ = chunk_ == nullptr ? std::nullopt : chunk_->materials().uniform();
  }
  void add(VoxelType material, float share) {
    std::size_t i = 0;
    while (i < count_ && shares_[i].material != material) ++i;
    QUOIN_ASSERT(i < shares_.size(), "one material per sample");
    if (i == count_) shares_[count_++].material = material;
    shares_[i].share += share;
  }

  IVec3 at_{0};  // of the chunk
  const DensityChunk* chunk_ = nullptr;
  std::optional<VoxelType> only_;  // the material of all its samples
  std::uint64_t solid_ = 0;        // of the row read last
  std::array<Share, 27> shares_;
  std::size_t count_ = 0;
};

}  // namespace

Vec3 mean_colour(const VoxelFace& face) {
  const Vec3 tint = linear_colour(face.tint);
  if (face.texture.is_null()) return tint;
  return linear_colour(srgb_colour(face.texture.mean())) * tint;  // as the last level
}

FaceTexels face_texels(const VoxelFace& face, Direction direction, float emission) {
  const Texture& texture = face.texture;
  FaceTexels found;
  found.texels = texture.level(0).data();
  found.log_size = static_cast<std::uint8_t>(texture.level_count() - 1);
  found.alpha = face.alpha;
  found.last = static_cast<std::uint32_t>(texture.size() - 1);
  const TextureFrame frame = texture_frame(face, direction);
  for (std::size_t i = 0; i < 2; ++i) {
    const IVec3& along = i == 0 ? frame.right : frame.down;
    const int axis = along.x != 0 ? 0 : along.y != 0 ? 1 : 2;
    found.axis[i] = static_cast<std::uint8_t>(axis);
    const auto size = static_cast<double>(texture.size());
    found.scale[i] = along[axis] < 0 ? -size : size;
    found.offset[i] = along[axis] < 0 ? size : 0.0;
  }
  found.linear = linear_bytes().data();
  found.tint = linear_colour(face.tint);
  found.emission = emission * emission_factor(face);
  return found;
}

bool is_emitting_side(const ModelFace& side, const VoxelFace* look, const VoxelProperties& type) {
  if (side.is_inner || !(emission_of(type) > 0.0F) || (look != nullptr && look->emission_share == 0)) return false;
  const bool has_texels = look != nullptr && !look->texture.is_null();
  return type.visibility == Visibility::Opaque || (has_texels && look->alpha != FaceAlpha::Translucent);
}

bool is_lamp_side(const ModelFace& side, const VoxelFace* look, const VoxelProperties& type) {
  if (!is_emitting_side(side, look, type)) return false;
  constexpr float kRounding = 1e-4F;
  const auto& at = side.corners;
  const Vec3 u = at[1] - at[0];
  const Vec3 v = at[3] - at[0];
  const float size_u = glm::length(u);
  const float size_v = glm::length(v);
  return size_u > 0.0F && size_v > 0.0F && glm::length(at[2] - at[1] - v) < kRounding &&
         std::abs(glm::dot(u, v)) < kRounding * size_u * size_v;
}

void show_triplanar(const TypeFaces& faces, const FieldPoint& point, Surface& surface) {
  const Vec3& n = point.normal;
  const std::array<float, 3> weights = faces.on_fields.weights(n);
  const double scale = faces.on_fields.textures_per_voxel;
  const DVec3 position = point.position * scale;
  const DVec3 inside = position - glm::floor(position);
  const double square = point.square_spacing * scale * scale;
  surface.colour = surface.emitted = Vec3(0.0F);
  for (int axis = 0; axis < 3; ++axis) {
    const float weight = weights[static_cast<std::size_t>(axis)];
    if (!(weight > 0.0F)) continue;
    const FaceTexels& side = faces.sides[static_cast<std::size_t>(2 * axis + (n[axis] < 0.0F ? 1 : 0))];
    const Vec3 colour = weight * side.colour(side.texel(inside, IVec3(0), mipmap_level(square, side.log_size)));
    surface.colour += colour;
    surface.emitted += colour * side.emission;
  }
}

Surface Surfaces::field_surface(VoxelType material, const FieldPoint* point) const {
  Surface surface = of_field(material);
  const TypeFaces* const textured = point == nullptr ? nullptr : faces(material);
  if (textured != nullptr) show_triplanar(*textured, *point, surface);
  return surface;
}

Surface Surfaces::blend_of_field(const DensityGrid& field, IVec3 cell, const DVec3& inside, VoxelType nearest,
                                 const FieldPoint* point) const {
  const MaterialShares shares(field, cell, inside);
  float total = 0.0F;
  for (const MaterialShares::Share& each : shares.all()) total += each.share;
  if (shares.all().size() < 2 || !(total > 0.0F)) return field_surface(nearest, point);
  Surface blend = of_field(nearest);
  blend.colour = blend.emitted = Vec3(0.0F);
  blend.roughness = blend.metalness = 0.0F;
  for (const MaterialShares::Share& each : shares.all()) {
    const Surface surface = field_surface(each.material, point);
    const float share = each.share / total;
    blend.colour += share * surface.colour;
    blend.emitted += share * surface.emitted;
    blend.roughness += share * surface.roughness;
    blend.metalness += share * surface.metalness;
  }
  return blend;
}

const Surface& Surfaces::of_field(VoxelType material) const {
  static const Surface white{Vec3(1.0F)};
  return material == kAir ? white : (*this)[material];
}

void Surfaces::put(VoxelType type, const VoxelProperties& properties) {
  QUOIN_ASSERT(type + std::size_t{1} < surfaces_.size(), "a registered type");
  surfaces_[type] = surface_of(properties, clouds_);
  is_opaque_[type] = properties.visibility == Visibility::Opaque ? 1 : 0;
  if (!properties.shapes.empty()) {
    const float emission = surfaces_[type].emission * emission_share_of_shapes(properties);
    shape_means_[type] = glm::vec4(quoin::mean_of_shapes(properties), emission);
  }
  if (faces_.empty()) return;
  faces_[type] = nullptr;
  if (properties.faces.empty()) return;
  const auto made = std::make_shared<TypeFaces>();
  made->kept = properties.faces;
  made->content = content_of(properties, clouds_);
  made->on_fields = TriplanarRule(properties.field_textures);
  for (const Direction each : kDirections) {
    made->sides[static_cast<std::size_t>(each)] = face_texels(properties.faces[each], each, emission_of(properties));
  }
  faces_[type] = made;
}

bool Surfaces::update(const VoxelRegistry& types) {
  PendingChanges changes(followed_, types);
  if (changes->empty()) return false;
  surfaces_.resize(types.size() + 1);
  surfaces_.back() = {};
  surfaces_.back().colour = {1.0F, 0.0F, 1.0F};
  is_opaque_.resize(types.size());
  if (types.has_textures() || !faces_.empty()) faces_.resize(types.size());
  if (types.has_shapes()) shape_means_.resize(types.size());
  for (std::size_t type = 0; changes->all && type < types.size(); ++type) {
    put(static_cast<VoxelType>(type), types[static_cast<VoxelType>(type)]);
  }
  for (const TypeChange& change : changes->items_unless_all()) put(change.type, types[change.type]);
  fluids_.resize(types.has_fluids() ? types.size() : 0);
  for (std::size_t type = 0; type < fluids_.size(); ++type) {
    fluids_[type] = types.first_fluid(types.fluid_groups(static_cast<VoxelType>(type)));
  }
  has_textures_ = types.has_textures();
  has_textured_glass_ = has_cells_of_faces_ = has_tinted_cells_ = false;
  for (std::size_t type = 0; type < faces_.size(); ++type) {
    if (faces_[type] == nullptr) continue;
    const CellContent content = faces_[type]->content;
    has_textured_glass_ |= content == CellContent::TexturedGlass;
    // Types with shapes are never such cells.
    if (content != CellContent::Faces || types.is_shaped(static_cast<VoxelType>(type))) continue;
    has_cells_of_faces_ = true;
    has_tinted_cells_ |= std::ranges::any_of(
        faces_[type]->sides, [](const FaceTexels& side) { return side.alpha == FaceAlpha::Translucent; });
  }
  changes.commit();
  return true;
}

namespace {

// Appends the texel of a side at `met.t`, if it is visible. Returns false if it ends the ray.
bool meet_side(const FaceTexels& side, const Ray& ray, IVec3 cell, MetFace& met, std::vector<MetFace>& out) {
  const Rgba8 texel = side.texel(ray.origin + ray.direction * met.t, cell, 0);
  met.cover = side.cover(texel);
  if (met.cover == 0.0F) return true;
  met.colour = side.colour(texel);
  out.push_back(met);
  return met.cover < 1.0F;
}

}  // namespace

bool meet_cell(const Surfaces& surfaces, GridReader& voxels, const ShapeIndex* shapes, std::int32_t placed,
               VoxelType type, const Ray& ray_in_grid, const CellSpan& span, double max_t, std::vector<MetFace>& out) {
  const TypeFaces* const faces = surfaces.faces(type);
  QUOIN_ASSERT(faces != nullptr && faces->content == CellContent::Faces, "a type with faces");
  // `outward`: from the cell to `front`.
  const auto is_hidden = [&](IVec3 front, Direction outward) {
    const VoxelType other = voxels.get(front);
    if (other == type) return true;
    if (!surfaces.is_opaque(other)) return false;
    const ShapesAtVoxel here = shapes == nullptr ? ShapesAtVoxel() : shapes->at(front);
    return !here.has_own() || here[0].model->covers_side[static_cast<std::size_t>(opposite(outward))];
  };
  MetFace met;
  met.placed = placed;
  met.type = type;
  if (!span.starts_inside && span.t_enter <= max_t && !is_hidden(span.first + normal_of(span.face), span.face)) {
    met.voxel = span.first;
    met.face = span.face;
    met.side = static_cast<std::uint16_t>(span.face);
    met.t = span.t_enter;
    if (!meet_side(faces->sides[met.side], ray_in_grid, span.first, met, out)) return false;
  }
  const FaceTexels& far_side = faces->sides[static_cast<std::size_t>(span.exit_face)];
  if (far_side.alpha == FaceAlpha::Translucent || !(span.t_exit <= max_t)) return true;
  if (is_hidden(span.behind, span.exit_face)) return true;
  met.voxel = span.behind;
  met.face = opposite(span.exit_face);
  met.side = static_cast<std::uint16_t>(span.exit_face);
  met.t = span.t_exit;
  return meet_side(far_side, ray_in_grid, span.behind - normal_of(span.exit_face), met, out);
}

}  // namespace quoin
