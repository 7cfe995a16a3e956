#include "io/packs/pack_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>
#include <quoin/core/assert.h>
#include <quoin/core/direction.h>

#include "core/bytes/text.h"

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

/// Cuts an element into the parts below and above a plane across an axis. Requires: the plane lies inside.
std::array<PackElement, 2> cut(const PackElement& element, int axis, float at) {
  QUOIN_ASSERT(at > element.from[axis] && at < element.to[axis], "a plane inside the element");
  std::array<PackElement, 2> parts{element, element};
  parts[0].to[axis] = at;
  parts[1].from[axis] = at;
  const float share = (at - element.from[axis]) / (element.to[axis] - element.from[axis]);
  for (const Direction direction : kDirections) {
    const std::size_t number = number_of(direction);
    if (!element.faces[number]) continue;
    const IVec3 normal = normal_of(direction);
    if (normal[axis] != 0) {
      parts[normal[axis] > 0 ? 0 : 1].faces[number].reset();
      continue;
    }
    const PackFace& face = *element.faces[number];
    const auto turn = static_cast<std::uint8_t>((published_turn(direction) + face.turn) % 4);
    const TextureFrame frame = texture_frame({.turn = turn}, direction);
    const std::array<float, 4> whole = face.uv.value_or(default_part(element, direction));
    const bool is_across = frame.right[axis] != 0;
    const bool is_along = (is_across ? frame.right : frame.down)[axis] > 0;
    const std::size_t first = is_across ? 0 : 1;
    const float middle = whole[first] + (whole[first + 2] - whole[first]) * (is_along ? share : 1.0F - share);
    for (std::size_t i = 0; i < 2; ++i) {
      std::array<float, 4> part = whole;
      part[(i == 0) == is_along ? first + 2 : first] = middle;
      parts[i].faces[number]->uv = part;
    }
  }
  return parts;
}

/// Appends the parts of an element inside and outside of a box, and calls `inside` for those inside.
void cut_by_box(PackElement element, const std::array<Vec3, 2>& box, std::vector<PackElement>& all,
                FunctionRef<void(PackElement& part)> inside) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto is_cut = [&](float at) { return at > element.from[axis] && at < element.to[axis]; };
    if (is_cut(box[0][axis])) {
      std::array<PackElement, 2> parts = cut(element, axis, box[0][axis]);
      all.push_back(std::move(parts[0]));
      element = std::move(parts[1]);
    }
    if (is_cut(box[1][axis])) {
      std::array<PackElement, 2> parts = cut(element, axis, box[1][axis]);
      all.push_back(std::move(parts[1]));
      element = std::move(parts[0]);
    }
  }
  const Vec3 middle = (element.from + element.to) * 0.5F;
  bool is_inside = true;
  for (int axis = 0; axis < 3; ++axis) is_inside &= middle[axis] >= box[0][axis] && middle[axis] <= box[1][axis];
  if (is_inside) inside(element);
  all.push_back(std::move(element));
}

}  // namespace

std::vector<PackElement> with_emission(const BlockModel& model, const EmittingFaces& rule) {
  std::vector<PackElement> all;
  const auto shows = [&](const PackFace& face) {
    if (rule.textures.empty()) return true;
    const auto name = model.texture(face.texture);
    if (!name) return false;
    const std::string_view path = name->path;
    const std::string_view last = path.substr(path.rfind('/') + 1);
    return std::ranges::any_of(rule.textures,
                               [&](const std::string& each) { return match_name(each, last).has_value(); });
  };
  const auto light_up = [&](PackElement& element) {
    for (auto& face : element.faces) {
      if (face && shows(*face)) face->emission_share = rule.share;
    }
  };
  for (PackElement element : model.elements()) {
    for (auto& face : element.faces) {
      if (face) face->emission_share = 0;
    }
    const Vec3 size = element.to - element.from;
    const bool is_plate = size.x == 0.0F || size.y == 0.0F || size.z == 0.0F;
    const bool is_of_kind =
        rule.elements == EmittingFaces::Elements::All || is_plate == (rule.elements == EmittingFaces::Elements::Plates);
    if (is_of_kind && rule.within) {
      cut_by_box(std::move(element), *rule.within, all, light_up);
      continue;
    }
    if (is_of_kind) light_up(element);
    all.push_back(std::move(element));
  }
  return all;
}

std::vector<PackElement> with_light_emission(std::span<const PackElement> elements, float emission) {
  QUOIN_ASSERT(emission > 0.0F, "a type that emits");
  std::vector<PackElement> all(elements.begin(), elements.end());
  for (PackElement& element : all) {
    const float share = std::min(static_cast<float>(element.light_emission) / (15.0F * emission), 1.0F);
    for (auto& face : element.faces) {
      if (face) face->emission_share = static_cast<std::uint8_t>(std::lround(255.0F * share));
    }
  }
  return all;
}

namespace {

/// Reads one condition of a rule: "texture=NAMES", "elements=KIND", "within=CORNERS" or "share=NUMBER". Returns false
/// if it is none.
bool read_condition(const std::string& text, EmittingFaces& rule) {
  const std::size_t equals = std::min(text.find('='), text.size() - 1);
  const std::string key = text.substr(0, equals);
  const std::string value = text.substr(equals + 1);
  if (key == "texture") {
    rule.textures = words(value, ',');
    return !rule.textures.empty();
  }
  if (key == "elements") {
    rule.elements = value == "plates" ? EmittingFaces::Elements::Plates : EmittingFaces::Elements::Boxes;
    return value == "plates" || value == "boxes";
  }
  std::vector<float> numbers;
  for (const std::string& each : words(value, ',')) {
    const auto number = parse_float(each);
    if (!number || !std::isfinite(*number)) return false;
    numbers.push_back(*number);
  }
  if (key == "within" && numbers.size() == 6) {
    rule.within = {Vec3(numbers[0], numbers[1], numbers[2]), Vec3(numbers[3], numbers[4], numbers[5])};
    return true;
  }
  if (key != "share" || numbers.size() != 1 || numbers[0] < 0.0F || numbers[0] > 255.0F) return false;
  rule.share = static_cast<std::uint8_t>(numbers[0]);
  return true;
}

}  // namespace

Result<EmissionRules> EmissionRules::from_text(std::string_view table) {
  const auto rows = nlohmann::json::parse(table, nullptr, false);
  if (!rows.is_array()) return make_error(ErrorCode::BadFormat, "the table of emission is no JSON list");
  EmissionRules made;
  for (const auto& row : rows) {
    const auto fault = [&](const std::string& reason) {
      return make_error(ErrorCode::BadFormat, "emission " + row.dump().substr(0, 60) + ": " + reason);
    };
    if (!row.is_array() || row.size() != 2 || !row[0].is_string() || !row[1].is_string()) {
      return fault("must be two texts");
    }
    EmittingFaces rule;
    for (const std::string& condition : words(row[1].get<std::string>())) {
      if (!read_condition(condition, rule)) return fault("unknown condition " + condition);
    }
    if (auto status = made.names_.add(row[0].get<std::string>(), made.rows_.size()); !status) {
      return fault(status.error().message);
    }
    made.rows_.push_back(std::move(rule));
  }
  return made;
}

const EmittingFaces* EmissionRules::find(std::string_view name) const {
  const auto found = names_.find(name);
  return found ? &rows_[found->row] : nullptr;
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
  layer.look.emission_share = face.emission_share;
  layer.part = face.uv.value_or(default_part(element, direction));
  return layer;
}

bool lies_on(const ShapeElement& a, const PackElement& b) {
  return a.min == b.from && a.max == b.to && a.turn == b.turn;
}

/// Adds a face of an element: to `earlier`, blended with an equal face there, or to `made`.
void put_face(const std::optional<FaceLayer>& layer, Direction direction, const FaceColours& colours,
              std::uint8_t emission_share, ShapeElement* earlier, ShapeElement& made, TextureReader& textures) {
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
    face = {.face = VoxelFace{.tint = colours.plain, .emission_share = emission_share}};
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
      const PackFace& face = *element.faces[number_of(direction)];
      put_face(layer_of(model, element, direction, colours, has_textures, textures), direction, colours,
               face.emission_share, earlier, made, textures);
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
