#include "io/packs/pack_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>

namespace quoin::packs {

namespace {

constexpr float kWhole = 16.0F;

std::size_t number_of(Direction direction) {
  return static_cast<std::size_t>(direction);
}

/// Returns the turn of a face's texture that the published format means by no turn.
std::uint8_t published_turn(Direction direction) {
  return direction == Direction::PosY ? 3 : 0;
}

/// Returns the turn that gives a texture these axes on a face. Requires: there is one.
std::uint8_t turn_of_frame(const TextureFrame& frame, Direction direction) {
  for (std::uint8_t turn = 0; turn < 4; ++turn) {
    if (texture_frame({.turn = turn}, direction) == frame) return turn;
  }
  QUOIN_ASSERT(false, "a rotation does not mirror textures");
  return 0;
}

TextureFrame published_frame(Direction direction) {
  return texture_frame({.turn = published_turn(direction)}, direction);
}

/// Returns the part of a texture that a face shows by default: the one at its place in the voxel.
std::array<float, 4> default_part(const PackElement& element, Direction direction) {
  const TextureFrame frame = published_frame(direction);
  const auto range = [&](const IVec3& axis) -> std::pair<float, float> {
    const int i = axis.x != 0 ? 0 : axis.y != 0 ? 1 : 2;
    if (axis[i] > 0) return {element.from[i], element.to[i]};
    return {kWhole - element.to[i], kWhole - element.from[i]};
  };
  const auto [left, right] = range(frame.right);
  const auto [top, bottom] = range(frame.down);
  return {left, top, right, bottom};
}

/// A face's texture by its axes in space, and the part that it shows.
struct PlacedPart {
  TextureFrame frame;
  std::array<float, 4> part{};
};

/// Turns a part by a quarter about the middle of the texture, clockwise, without moving it on the face.
PlacedPart turned_in_texture(const PlacedPart& placed) {
  const auto [left, top, right, bottom] = placed.part;
  return {{-placed.frame.down, placed.frame.right}, {kWhole - bottom, left, kWhole - top, right}};
}

}  // namespace

AxisOrientation orientation_of(const StateModel& state) {
  return AxisOrientation::quarter_turns(1, -state.y) * AxisOrientation::quarter_turns(0, -state.x);
}

PackElement turned_with_world(const PackElement& element, const AxisOrientation& turn) {
  QUOIN_ASSERT(!turn.is_mirrored(), "a rotation");
  const auto moved = [&](const Vec3& at) { return Vec3(turn.apply(DVec3(at) - DVec3(kWhole / 2))) + Vec3(kWhole / 2); };
  PackElement made;
  const Vec3 a = moved(element.from);
  const Vec3 b = moved(element.to);
  for (int axis = 0; axis < 3; ++axis) {
    made.from[axis] = std::min(a[axis], b[axis]);
    made.to[axis] = std::max(a[axis], b[axis]);
  }
  if (element.turn) {
    made.turn = element.turn;
    made.turn->origin = moved(element.turn->origin);
    IVec3 axis{0};
    axis[element.turn->axis] = 1;
    axis = turn.apply(axis);
    made.turn->axis = axis.x != 0 ? 0 : axis.y != 0 ? 1 : 2;
    if (axis[made.turn->axis] < 0) made.turn->degrees = -made.turn->degrees;
  }
  for (const Direction direction : kDirections) {
    const auto& face = element.faces[number_of(direction)];
    if (!face) continue;
    const Direction to = turn.apply(direction);
    // The texture of a face without a part or turn lies as the world's axes do, before and after.
    const TextureFrame before = published_frame(direction);
    const TextureFrame after = published_frame(to);
    const auto turns = static_cast<std::uint8_t>((published_turn(direction) + face->turn) % 4);
    PlacedPart placed{texture_frame({.turn = turns}, direction), face->uv.value_or(default_part(element, direction))};
    const IVec3 right = turn.apply(before.right);
    const int quarters = right == after.right ? 0 : right == after.down ? 1 : right == -after.right ? 2 : 3;
    for (int i = 0; i < quarters; ++i) placed = turned_in_texture(placed);
    const std::uint8_t made_turn = turn_of_frame({turn.apply(placed.frame.right), turn.apply(placed.frame.down)}, to);
    PackFace made_face = *face;
    made_face.uv = placed.part;
    made_face.turn = (made_turn + 4 - published_turn(to)) % 4;
    made.faces[number_of(to)] = std::move(made_face);
  }
  return made;
}

namespace {

/// Returns the layer of a face; nullopt if it shows the plain colour without a texture.
std::optional<FaceLayer> layer_of(const BlockModel& model, const PackElement& element, Direction direction,
                                  const FaceColours& colours, bool has_textures, TextureReader& textures) {
  const PackFace& face = *element.faces[number_of(direction)];
  FaceLayer layer;
  const PackTexture* texture = colours.texture(model, face);
  if (texture == nullptr && !has_textures) return std::nullopt;
  layer.look.tint = face.is_tinted && texture != nullptr ? colours.tint : Rgba8{255, 255, 255};
  if (texture == nullptr) texture = &textures.plain(colours.plain);
  layer.look.texture = texture->texture;
  layer.look.alpha = texture->alpha;
  layer.look.turn = static_cast<std::uint8_t>((published_turn(direction) + face.turn) % 4);
  layer.part = face.uv.value_or(default_part(element, direction));
  return layer;
}

bool lies_on(const ShapeElement& a, const PackElement& b) {
  return a.min == b.from && a.max == b.to && a.turn == b.turn;
}

/// Adds a face of an element: to `earlier`, blended with an equal face there, or to `made`.
void put_face(const std::optional<FaceLayer>& layer, Direction direction, const FaceColours& colours,
              ShapeElement* earlier, ShapeElement& made, TextureReader& textures) {
  const auto set = [](ElementFace& face, const FaceLayer& shown) {
    face.is_drawn = true;
    face.face = shown.look;
    face.part = shown.part;
  };
  if (earlier != nullptr) {
    ElementFace& lower = earlier->faces[number_of(direction)];
    const bool is_blended = layer && lower.is_drawn && lower.face && !lower.face->texture.is_null();
    if (is_blended && layer->look.alpha != FaceAlpha::Opaque) {
      set(lower, textures.blended({*lower.face, *lower.part}, &*layer));
      return;
    }
    if (lower.is_drawn) {
      if (layer) set(lower, *layer);
      return;
    }
  }
  ElementFace& face = made.faces[number_of(direction)];
  if (layer) {
    set(face, *layer);
  } else {
    face = {.face = VoxelFace{.tint = colours.plain}};
  }
}

}  // namespace

std::vector<ShapeElement> elements_of(const BlockModel& model, std::span<const PackElement> elements,
                                      const FaceColours& colours, bool has_textures, TextureReader& textures) {
  std::vector<ShapeElement> all;
  for (const PackElement& element : elements) {
    ShapeElement made{.min = element.from, .max = element.to, .turn = element.turn};
    for (ElementFace& face : made.faces) face.is_drawn = false;
    const auto known = std::ranges::find_if(all, [&](const ShapeElement& each) { return lies_on(each, element); });
    ShapeElement* const earlier = known == all.end() ? nullptr : &*known;
    for (const Direction direction : kDirections) {
      if (!element.faces[number_of(direction)]) continue;
      put_face(layer_of(model, element, direction, colours, has_textures, textures), direction, colours, earlier, made,
               textures);
    }
    const bool is_drawn = std::ranges::any_of(made.faces, &ElementFace::is_drawn);
    // Boxes without faces still fill their space, but a second box adds nothing.
    if (earlier == nullptr || is_drawn) all.push_back(std::move(made));
  }
  return all;
}

std::optional<std::array<VoxelFace, 6>> faces_of_cube(const std::vector<ShapeElement>& elements) {
  if (elements.size() != 1) return std::nullopt;
  const ShapeElement& box = elements.front();
  if (box.turn || box.min != Vec3(0.0F) || box.max != Vec3(kWhole)) return std::nullopt;
  std::array<VoxelFace, 6> faces;
  for (std::size_t i = 0; i < 6; ++i) {
    const ElementFace& face = box.faces[i];
    if (!face.is_drawn || !face.face || face.face->texture.is_null() || !face.part) return std::nullopt;
    faces[i] = *face.face;
    const auto [left, top, right, bottom] = *face.part;
    const auto is_range = [](float from, float to) {
      return (from == 0.0F && to == kWhole) || (from == kWhole && to == 0.0F);
    };
    if (!is_range(left, right) || !is_range(top, bottom)) return std::nullopt;
    // Exchanging top and bottom is a mirror after a half turn.
    if (top > bottom) faces[i].turn = static_cast<std::uint8_t>((faces[i].turn + 2) % 4);
    if ((left > right) != (top > bottom)) faces[i].mirrored = !faces[i].mirrored;
  }
  return faces;
}

}  // namespace quoin::packs
