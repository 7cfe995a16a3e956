#include "map/type_looks.h"

#include <algorithm>

#include <quoin/core/assert.h>
#include <quoin/grid/texture.h>
#include <quoin/grid/voxel_shape.h>

#include "grid/shapes/shape_index.h"

namespace quoin::map {

namespace {

Vec3 colour_of(const VoxelFace& face) {
  const Vec3 tint = linear_colour(face.tint);
  return face.texture.is_null() ? tint : face.texture.mean() * tint;
}

float coverage_of(const VoxelFace& face) {
  if (face.alpha == FaceAlpha::Opaque || face.texture.is_null()) return 1.0F;
  return face.alpha == FaceAlpha::Cutout ? face.texture.coverage() : face.texture.mean_alpha();
}

float area_of(const ModelFace& face) {
  return 0.5F * glm::length(glm::cross(face.corners[2] - face.corners[0], face.corners[3] - face.corners[1]));
}

TypeLook look_of_shape(const VoxelProperties& type) {
  const ShapeModel& model = type.shapes.model(0, type.orientations.of(0), {});
  TypeLook look;
  look.is_fluid = type.shapes.rules().neighbours == ShapeNeighbours::Fluid;
  const Vec3 seen = quoin::coverage_of(model, type.faces);
  // Plants are upright plates: seen from above at the height of a map's viewer, they cover a part of the ground.
  constexpr float kUpright = 0.35F;
  look.coverage = std::clamp(std::max(seen.y, kUpright * std::max(seen.x, seen.z)), 0.0F, 1.0F);
  Vec3 colour{0.0F};
  float area = 0.0F;
  for (const ModelFace& face : model.faces) {
    if (face.direction != Direction::PosY || face.is_inner) continue;
    const VoxelFace* const own = quoin::look_of(model, face, type.faces);
    const float weight = area_of(face) * (own != nullptr ? coverage_of(*own) : 1.0F);
    colour += weight * (own != nullptr ? colour_of(*own) : linear_colour(type.colour));
    area += weight;
  }
  look.colour = area > 0.0F ? colour / area : mean_of_shapes(type);
  // A fluid covers its voxel; how much it hides depends on its material.
  if (look.is_fluid) look.coverage = type.visibility == Visibility::Opaque ? 1.0F : 0.0F;
  return look;
}

}  // namespace

TypeLook look_from_above(const VoxelRegistry& types, VoxelType type) {
  QUOIN_ASSERT(type < types.size(), "a registered type");
  const VoxelProperties& properties = types[type];
  TypeLook look;
  if (!properties.shapes.empty()) {
    look = look_of_shape(properties);
  } else if (!properties.faces.empty()) {
    const VoxelFace& upper = properties.faces[Direction::PosY];
    look.colour = colour_of(upper);
    look.coverage = coverage_of(upper);
  } else {
    look.colour = linear_colour(properties.colour);
    if (properties.visibility == Visibility::Transparent) {
      constexpr float kAlpha = 255.0F;
      look.coverage = static_cast<float>(properties.colour.a) / kAlpha;
    }
  }
  look.glows = properties.emission > 0.0F;
  // Without a pack, fluids are plain transparent types.
  const bool is_plain = properties.shapes.empty() && properties.faces.empty();
  look.is_fluid |=
      is_plain && properties.visibility == Visibility::Transparent && properties.light_cost > 0 && look.coverage < 1.0F;
  return look;
}

void TypeLooks::update() {
  const VoxelRegistry types = source_->types();
  for (std::size_t type = looks_.size(); type < types.size(); ++type) {
    looks_.push_back(look_from_above(types, static_cast<VoxelType>(type)));
  }
}

}  // namespace quoin::map
