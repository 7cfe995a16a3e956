// Types of voxels: properties, textures, orientations and shapes.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include <quoin/grid/voxel_registry.h>
#include <quoin/grid/voxel_shape.h>

#include "handles.h"

namespace quoin::c {
namespace {

constexpr const char* kNoType = "no type has this number";
constexpr const char* kNoOrientation = "an orientation must be 0 to 47";
constexpr const char* kNoDirection = "a direction must be 0 to 5";

bool is_orientation(std::int32_t number) {
  return number >= 0 && number < AxisOrientation::kCount;
}
bool is_direction(std::int32_t number) {
  return number >= 0 && number < std::ssize(kDirections);
}

const char* validate_face(const quoin_face& face) {
  if (face.turn < 0 || face.turn > 3) return "the turn of a face must be 0 to 3";
  if (face.alpha < QUOIN_FACE_OPAQUE || face.alpha > QUOIN_FACE_TRANSLUCENT)
    return "the alpha of a face is not a QUOIN_FACE value";
  if (face.has_emission_share != 0 && (face.emission_share < 0 || face.emission_share > 255))
    return "the emission_share of a face must be 0 to 255";
  return nullptr;
}

const char* validate_texels(const quoin_face& face) {
  if (face.rgba == nullptr) return "the texels of a face are null";
  if (face.texels < kMinTextureSize || face.texels > kMaxTextureSize ||
      !std::has_single_bit(static_cast<unsigned>(face.texels)))
    return "the texels per side of a face must be 16, 32, 64, 128, 256, 512 or 1024";
  return nullptr;
}

Status invalid(std::string why) {
  return make_error(ErrorCode::InvalidArgument, std::move(why));
}

Result<Texture> texture_of(const quoin_face& given) {
  if (const char* wrong = validate_texels(given)) return make_error(ErrorCode::InvalidArgument, wrong);
  const std::size_t bytes = std::size_t{4} * given.texels * given.texels;
  return Texture::from_image(text_in(given.name), {given.texels, given.texels, {given.rgba, given.rgba + bytes}});
}

enum class Texels : std::uint8_t { Required, Optional };

Result<VoxelFace> face_of(const quoin_face& given, Texels texels) {
  if (const char* wrong = validate_face(given)) return make_error(ErrorCode::InvalidArgument, wrong);
  VoxelFace face;
  if (texels == Texels::Required || given.rgba != nullptr || given.texels != 0) {
    auto texture = texture_of(given);
    if (!texture) return texture.error();
    face.texture = std::move(*texture);
  }
  face.turn = static_cast<std::uint8_t>(given.turn);
  face.mirrored = given.mirrored != 0;
  face.alpha = static_cast<FaceAlpha>(given.alpha);
  if (given.has_tint != 0) face.tint = {given.tint[0], given.tint[1], given.tint[2], 255};
  if (given.has_emission_share != 0) face.emission_share = static_cast<std::uint8_t>(given.emission_share);
  return face;
}

// Calls `visit(struct, index)` for each struct of an array; the `size` of each one gives the position of the next.
// `noun`: names one of them in errors.
template <class Struct, class Visit>
Status visit_array(const Struct* array, std::size_t count, const char* noun, Visit&& visit) {
  const auto* at = reinterpret_cast<const std::byte*>(array);
  for (std::size_t i = 0; i < count; ++i) {
    const auto given = taken(reinterpret_cast<const Struct*>(at));
    if (!given) return invalid("the " + std::string(noun) + " " + std::to_string(i) + " is null, or its size");
    if (Status visited = visit(*given, i); !visited) return visited;
    at += given->size;
  }
  return {};
}

// Writes structs to a caller's array, as much of each as `out->size` says.
template <class Struct>
void write_array(std::vector<Struct> structs, Struct* out) {
  const std::size_t size = out->size;
  for (std::size_t i = 0; i < structs.size(); ++i) {
    structs[i].size = size;
    std::memcpy(reinterpret_cast<std::byte*>(out) + i * size, &structs[i], size);
  }
}

Result<VoxelFaces> faces_of(const quoin_face* faces) {
  std::array<VoxelFace, 6> made;
  const Status visited = visit_array(faces, made.size(), "face", [&](const quoin_face& given, std::size_t i) -> Status {
    auto face = face_of(given, Texels::Required);
    if (!face) return face.error();
    made[i] = std::move(*face);
    return {};
  });
  if (!visited) return visited.error();
  return VoxelFaces(made);
}

quoin_face described(const VoxelFace& face, const TextureSet& set) {
  quoin_face made{};
  made.turn = face.turn;
  made.mirrored = face.mirrored ? 1 : 0;
  made.alpha = static_cast<std::int32_t>(face.alpha);
  made.has_tint = face.tint.r == 255 && face.tint.g == 255 && face.tint.b == 255 ? 0 : 1;
  const std::uint8_t tint[] = {face.tint.r, face.tint.g, face.tint.b, 255};
  std::memcpy(made.tint, tint, sizeof tint);
  made.has_emission_share = face.emission_share == VoxelFace{}.emission_share ? 0 : 1;
  made.emission_share = face.emission_share;
  made.texture = QUOIN_NO_TEXTURE;
  if (face.texture.is_null()) return made;
  copy_text(face.texture.name(), made.name);
  made.rgba = reinterpret_cast<const std::uint8_t*>(face.texture.level(0).data());
  made.texels = face.texture.size();
  const auto layer = set.find(face.texture);
  const bool is_numbered = layer && layer->array <= 0xFFFFU && layer->layer <= 0xFFFFU;
  if (is_numbered) made.texture = layer->array << 16U | layer->layer;
  return made;
}

// Runs `work` with textures, which never change.
template <class Work>
quoin_status with_textures(quoin_textures handle, Work&& work) noexcept {
  return guarded([&] {
    const auto textures = handles().find<const TexturesBody>(handle);
    if (textures == nullptr) return fail(QUOIN_BAD_HANDLE, "no textures have this handle");
    return work(*textures);
  });
}

// Looks up one type of a scene; `out` is a result that must not be null.
template <class Work>
quoin_status with_type(quoin_scene scene, std::size_t type, const void* out, Work&& work) noexcept {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    if (out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "out is null");
    if (type >= body.loaded.scene.types.size()) return fail(QUOIN_INVALID_ARGUMENT, kNoType);
    return work(body.loaded.scene.types[static_cast<VoxelType>(type)]);
  });
}

// Lets `change` edit the properties of a type. If they are then not valid, nothing changes.
template <class Change>
quoin_status change_type(quoin_scene scene, std::size_t type, Change&& change) noexcept {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    VoxelRegistry& types = body.loaded.scene.types;
    if (type == kAir || type >= types.size()) return fail(QUOIN_INVALID_ARGUMENT, kNoType);
    const auto number = static_cast<VoxelType>(type);
    VoxelProperties changed = types[number];
    if (Status made = change(changed); !made) return fail(made.error());
    if (Status valid = quoin::validate_type(changed); !valid) return fail(valid.error());
    types.replace(number, std::move(changed));
    return QUOIN_OK;
  });
}

// Replaces a member of a type's properties by `read(given)`, or by its default if `given` is null.
template <class Member, class Given>
quoin_status set_member(quoin_scene scene, std::size_t type, Member VoxelProperties::*member, const Given* given,
                        Result<Member> (*read)(const Given*)) noexcept {
  return change_type(scene, type, [&](VoxelProperties& changed) -> Status {
    changed.*member = {};
    if (given == nullptr) return {};
    Result<Member> made = read(given);
    if (!made) return made.error();
    changed.*member = std::move(*made);
    return {};
  });
}

StateOrientations preset_of(std::int32_t kind, std::uint8_t first_bit) {
  switch (kind) {
    case QUOIN_ORIENTATIONS_ABOUT_Y:
      return StateOrientations::about_y(first_bit);
    case QUOIN_ORIENTATIONS_ALONG_AXES:
      return StateOrientations::along_axes(first_bit);
    case QUOIN_ORIENTATIONS_TO_DIRECTIONS:
      return StateOrientations::to_directions(first_bit);
    case QUOIN_ORIENTATIONS_ABOUT_Y_AND_UPSIDE_DOWN:
      return StateOrientations::about_y_and_upside_down(first_bit);
    default:
      return {.first_bit = first_bit};
  }
}

Result<StateOrientations> orientations_of(const quoin_orientations* orientations) {
  const auto refuse = [](const char* why) { return make_error(ErrorCode::InvalidArgument, why); };
  const auto given = taken(orientations);
  if (!given) return refuse("invalid size of the orientations");
  if (given->kind < QUOIN_ORIENTATIONS_LISTED || given->kind > QUOIN_ORIENTATIONS_ABOUT_Y_AND_UPSIDE_DOWN)
    return refuse("kind is not a QUOIN_ORIENTATIONS value");
  if (given->first_bit < 0 || given->first_bit >= kMaxStateBits) return refuse("first_bit must be 0 to 31");
  if (!is_direction(given->front)) return refuse(kNoDirection);
  StateOrientations made = preset_of(given->kind, static_cast<std::uint8_t>(given->first_bit));
  made.front = static_cast<Direction>(given->front);
  if (given->kind != QUOIN_ORIENTATIONS_LISTED) return made;
  if (given->count < 0 || given->count > AxisOrientation::kCount) return refuse("count must be 0 to 48");
  for (int value = 0; value < given->count; ++value) {
    if (!is_orientation(given->by_value[value])) return refuse(kNoOrientation);
    made.by_value.push_back(AxisOrientation::at(given->by_value[value]));
  }
  return made;
}

quoin_orientations described(const StateOrientations& orientations) {
  quoin_orientations made{};
  made.first_bit = orientations.first_bit;
  made.front = static_cast<std::int32_t>(orientations.front);
  made.count = static_cast<std::int32_t>(orientations.by_value.size());
  for (std::size_t value = 0; value < orientations.by_value.size(); ++value)
    made.by_value[value] = static_cast<std::uint8_t>(orientations.by_value[value].index());
  for (std::int32_t kind = QUOIN_ORIENTATIONS_ABOUT_Y; kind <= QUOIN_ORIENTATIONS_ABOUT_Y_AND_UPSIDE_DOWN; ++kind) {
    if (preset_of(kind, orientations.first_bit).by_value == orientations.by_value) made.kind = kind;
  }
  return made;
}

Result<ShapeElement> element_of(const quoin_shape_element& given, std::span<const VoxelFace> looks) {
  ShapeElement element;
  for (int axis = 0; axis < 3; ++axis) {
    element.min[axis] = given.min[axis];
    element.max[axis] = given.max[axis];
  }
  if (given.has_turn != 0) {
    element.turn = ElementTurn{.origin = {given.turn_origin[0], given.turn_origin[1], given.turn_origin[2]},
                               .axis = given.turn_axis,
                               .degrees = given.turn_degrees,
                               .rescales = given.turn_rescales != 0};
  }
  element.collides = given.passable == 0;
  for (std::size_t side = 0; side < element.faces.size(); ++side) {
    ElementFace& face = element.faces[side];
    const std::int32_t look = given.looks[side];
    if (look < QUOIN_LOOK_NONE || look > std::ssize(looks))
      return make_error(ErrorCode::InvalidArgument, "no look has the number " + std::to_string(look));
    face.is_drawn = look != QUOIN_LOOK_NONE;
    if (look > 0) face.face = looks[static_cast<std::size_t>(look) - 1];
    if ((given.has_parts >> side & 1U) == 0) continue;
    face.part.emplace();
    std::copy_n(given.parts[side], 4, face.part->begin());
  }
  return element;
}

Result<ShapeCondition> condition_of(const quoin_shape_condition& given) {
  constexpr std::uint32_t kAll = 0b11'1111;
  if ((given.connected | given.unconnected) > kAll)
    return make_error(ErrorCode::InvalidArgument, "connected and unconnected have a bit per direction");
  if (given.corner < QUOIN_CORNER_ANY || given.corner > QUOIN_CORNER_INNER_RIGHT)
    return make_error(ErrorCode::InvalidArgument, "the corner is not a QUOIN_CORNER value");
  ShapeCondition condition{.state_mask = given.state_mask,
                           .state = given.state,
                           .connected = DirectionSet::from_bits(static_cast<std::uint8_t>(given.connected)),
                           .unconnected = DirectionSet::from_bits(static_cast<std::uint8_t>(given.unconnected))};
  if (given.position_count > kMaxPositionCount || given.position_first > kMaxPositionCount ||
      given.position_end > kMaxPositionCount)
    return make_error(ErrorCode::InvalidArgument, "a number of positions is above 4096");
  condition.positions = {static_cast<std::uint16_t>(given.position_count),
                         static_cast<std::uint16_t>(given.position_first),
                         static_cast<std::uint16_t>(given.position_end)};
  if (given.corner != QUOIN_CORNER_ANY)
    condition.corner = static_cast<StairCorner>(given.corner - QUOIN_CORNER_STRAIGHT);
  return condition;
}

constexpr std::size_t kMostElements = 4 * kMaxShapeElements;

const char* validate_shapes(const quoin_shapes& given) {
  if (given.part_count > kMaxShapeParts) return "a type has at most 64 parts of shapes";
  if (given.element_count > kMostElements) return "a type has at most 512 elements of shapes";
  if (given.look_count > 6 * kMostElements) return "a type has at most 3,072 looks of shapes";
  if ((given.parts == nullptr && given.part_count > 0) || (given.elements == nullptr && given.element_count > 0) ||
      (given.conditions == nullptr && given.condition_count > 0) || (given.looks == nullptr && given.look_count > 0))
    return "an array of the shapes is null, but has a count";
  if (given.fluid_condition_count > given.condition_count) return "the fluid has more conditions than the array";
  if (given.fluid_groups == 0 && given.fluid_condition_count > 0) return "the fluid has conditions, but no groups";
  if (given.neighbours < QUOIN_NEIGHBOURS_NONE || given.neighbours > QUOIN_NEIGHBOURS_FLUID)
    return "neighbours is not a QUOIN_NEIGHBOURS value";
  return nullptr;
}

// Returns the error of a part's content, with the part's number.
Status error_of_part(std::size_t part, const std::string& why) {
  return invalid("part " + std::to_string(part) + " of the shapes: " + why);
}

// Takes the next `count` of a list for a part.
template <class T>
std::vector<T> next_of(std::vector<T>& all, std::size_t& taken_so_far, std::size_t count) {
  const auto first = all.begin() + static_cast<std::ptrdiff_t>(taken_so_far);
  taken_so_far += count;
  return {std::make_move_iterator(first), std::make_move_iterator(first + static_cast<std::ptrdiff_t>(count))};
}

// Divides elements and conditions among the parts.
Result<std::vector<ShapePart>> parts_of(const quoin_shapes& given, std::vector<ShapeElement> elements,
                                        std::vector<ShapeCondition> conditions) {
  std::vector<ShapePart> parts;
  std::size_t element = 0;
  std::size_t condition = 0;
  const Status visited = visit_array(
      given.parts, given.part_count, "part", [&](const quoin_shape_part& part, std::size_t number) -> Status {
        if (part.element_count > elements.size() - element || part.condition_count > conditions.size() - condition)
          return error_of_part(number, "it has more elements or conditions than the arrays");
        if (!is_orientation(part.orientation)) return error_of_part(number, kNoOrientation);
        auto shape = VoxelShape::from_elements(next_of(elements, element, part.element_count));
        if (!shape) return error_of_part(number, shape.error().message);
        parts.push_back({.shape = std::move(*shape),
                         .orientation = AxisOrientation::at(part.orientation),
                         .when = next_of(conditions, condition, part.condition_count)});
        return {};
      });
  if (!visited) return visited.error();
  // Structs of older headers have no fluids: programs that write back such shapes leave the fluid's conditions over.
  const bool takes_all = condition == conditions.size() || given.size == kFirstSize<quoin_shapes>;
  if (element != elements.size() || !takes_all)
    return make_error(ErrorCode::InvalidArgument, "the shapes have elements or conditions that no part counts");
  return parts;
}

Result<VoxelShapes> shapes_of(const quoin_shapes* shapes) {
  const auto given = taken(shapes);
  if (!given) return make_error(ErrorCode::InvalidArgument, "invalid size of the shapes");
  if (const char* wrong = validate_shapes(*given)) return make_error(ErrorCode::InvalidArgument, wrong);
  // Adds the result of `convert` for each struct of an array; errors name the struct's number.
  const auto convert_all = [](const auto* array, std::size_t count, const char* noun, auto& out, auto&& convert) {
    return visit_array(array, count, noun, [&](const auto& one, std::size_t number) -> Status {
      auto made = convert(one);
      if (!made) return invalid(std::string(noun) + " " + std::to_string(number) + ": " + made.error().message);
      out.push_back(std::move(*made));
      return {};
    });
  };
  std::vector<VoxelFace> looks;
  std::vector<ShapeElement> elements;
  std::vector<ShapeCondition> conditions;
  Status read = convert_all(given->looks, given->look_count, "look", looks,
                            [](const quoin_face& one) { return face_of(one, Texels::Optional); });
  if (read) {
    read = convert_all(given->elements, given->element_count, "element", elements,
                       [&](const quoin_shape_element& one) { return element_of(one, looks); });
  }
  if (read) read = convert_all(given->conditions, given->condition_count, "condition", conditions, condition_of);
  if (!read) return read.error();
  std::optional<ContainedFluid> fluid;
  if (given->fluid_groups != 0) {
    const auto first = conditions.end() - static_cast<std::ptrdiff_t>(given->fluid_condition_count);
    fluid = ContainedFluid{.groups = given->fluid_groups, .when = {first, conditions.end()}};
    conditions.erase(first, conditions.end());
  }
  auto parts = parts_of(*given, std::move(elements), std::move(conditions));
  if (!parts) return parts.error();
  return VoxelShapes::from_rules({.parts = std::move(*parts),
                                  .neighbours = static_cast<ShapeNeighbours>(given->neighbours),
                                  .groups = given->groups,
                                  .connects_to_full_sides = given->ignores_full_sides == 0,
                                  .fluid = std::move(fluid)});
}

// The shapes of a type as the arrays of quoin_shapes.
struct ListedShapes {
  quoin_shapes whole{};
  std::vector<quoin_shape_part> parts;
  std::vector<quoin_shape_element> elements;
  std::vector<quoin_shape_condition> conditions;
  std::vector<quoin_face> looks;

  ListedShapes(const TexturesBody& body, VoxelType type) : body_(&body) {
    const VoxelShapes& shapes = body.types[type].shapes;
    if (shapes.empty()) return;
    const ShapeRules& rules = shapes.rules();
    for (const ShapePart& part : rules.parts) add(part);
    if (rules.fluid) {
      for (const ShapeCondition& condition : rules.fluid->when) add(condition);
      whole.fluid_groups = rules.fluid->groups;
      whole.fluid_condition_count = rules.fluid->when.size();
    }
    whole.part_count = parts.size();
    whole.element_count = elements.size();
    whole.condition_count = conditions.size();
    whole.look_count = looks.size();
    whole.neighbours = static_cast<std::int32_t>(rules.neighbours);
    whole.groups = rules.groups;
    whole.ignores_full_sides = rules.connects_to_full_sides ? 0 : 1;
  }

 private:
  void add(const ShapePart& part) {
    quoin_shape_part made{};
    made.element_count = part.shape.elements().size();
    made.condition_count = part.when.size();
    made.orientation = part.orientation.index();
    parts.push_back(made);
    for (const ShapeElement& element : part.shape.elements()) add(element);
    for (const ShapeCondition& condition : part.when) add(condition);
  }
  void add(const ShapeCondition& condition) {
    quoin_shape_condition made{};
    made.state_mask = condition.state_mask;
    made.state = condition.state;
    made.connected = condition.connected.bits();
    made.unconnected = condition.unconnected.bits();
    if (condition.corner) made.corner = QUOIN_CORNER_STRAIGHT + static_cast<std::int32_t>(*condition.corner);
    made.position_count = condition.positions.count;
    made.position_first = condition.positions.first;
    made.position_end = condition.positions.end;
    conditions.push_back(made);
  }
  void add(const ShapeElement& element) {
    quoin_shape_element made{};
    for (int axis = 0; axis < 3; ++axis) {
      made.min[axis] = element.min[axis];
      made.max[axis] = element.max[axis];
      if (element.turn) made.turn_origin[axis] = element.turn->origin[axis];
    }
    if (element.turn) {
      made.has_turn = 1;
      made.turn_axis = element.turn->axis;
      made.turn_degrees = element.turn->degrees;
      made.turn_rescales = element.turn->rescales ? 1 : 0;
    }
    made.passable = element.collides ? 0 : 1;
    for (std::size_t side = 0; side < element.faces.size(); ++side) {
      const ElementFace& face = element.faces[side];
      made.looks[side] = face.is_drawn ? number_of(face.face) : QUOIN_LOOK_NONE;
      if (!face.part) continue;
      made.has_parts |= 1U << side;
      std::copy(face.part->begin(), face.part->end(), made.parts[side]);
    }
    elements.push_back(made);
  }
  std::int32_t number_of(const std::optional<VoxelFace>& look) {
    if (!look) return QUOIN_LOOK_OF_TYPE;
    const auto known = std::ranges::find(known_, *look);
    const auto number = static_cast<std::int32_t>(known - known_.begin()) + 1;
    if (known == known_.end()) {
      known_.push_back(*look);
      looks.push_back(described(*look, body_->set));
    }
    return number;
  }

  const TexturesBody* body_;
  std::vector<VoxelFace> known_;  // as `looks`
};

}  // namespace

const char* validate_type(const quoin_type& type) {
  const auto is_share = [](float x) { return x >= 0.0F && x <= 1.0F; };
  const auto is_amount = [](float x) { return x >= 0.0F && std::isfinite(x); };
  if (!is_share(type.metalness) || !is_share(type.roughness) || !is_amount(type.emission))
    return "emission, metalness or roughness out of range";
  if (!is_amount(type.ior) || !is_amount(type.scattering) || !is_share(std::abs(type.anisotropy)))
    return "index of refraction, scattering or anisotropy out of range";
  const auto is_sign = [](std::int32_t x) { return x >= -1 && x <= 1; };
  if (type.light_cost < 0 || type.light_cost > kMaxLightCost || !is_sign(type.blocks_light) || !is_sign(type.occludes))
    return "light_cost, blocks_light or occludes out of range";
  if (type.state_bits < 0 || type.state_bits > kMaxStateBits) return "state_bits must be 0 to 32";
  if (type.occludes > 0 && (type.transparent != 0 || type.rgba[3] < 255)) return "a transparent type cannot occlude";
  return nullptr;
}

// Conversions of 1 (yes), -1 (no) and 0 (default).
std::optional<bool> own_flag(std::int32_t sign) {
  return sign == 0 ? std::nullopt : std::optional(sign > 0);
}
std::int32_t sign_of(std::optional<bool> flag) {
  return !flag ? 0 : *flag ? 1 : -1;
}

VoxelProperties properties_of(const quoin_type& type) {
  VoxelProperties properties;
  properties.colour = {type.rgba[0], type.rgba[1], type.rgba[2], type.rgba[3]};
  if (type.rgba[3] < 255 || type.transparent != 0) properties.visibility = Visibility::Transparent;
  properties.emission = type.emission;
  properties.metalness = type.metalness;
  properties.roughness = type.roughness;
  if (type.ior != 0.0F) properties.ior = type.ior;
  properties.scattering = type.scattering;
  properties.anisotropy = type.anisotropy;
  properties.light_cost = static_cast<std::uint8_t>(type.light_cost);
  properties.blocks_light = own_flag(type.blocks_light);
  properties.occludes = own_flag(type.occludes);
  properties.state_bits = static_cast<std::uint8_t>(type.state_bits);
  properties.collides = type.passable == 0;
  properties.name = text_in(type.name);
  return properties;
}

}  // namespace quoin::c

using namespace quoin;
using namespace quoin::c;

quoin_status quoin_type_count(quoin_scene scene, std::size_t* out) {
  return report_count(scene, out, [](SceneBody& body) { return body.loaded.scene.types.size(); });
}

quoin_status quoin_type_get(quoin_scene scene, std::size_t index, quoin_type* out) {
  const auto count = [](SceneBody& body) { return body.loaded.scene.types.size(); };
  return report_item(scene, index, out, count, [&](SceneBody& body, quoin_type& type) {
    const VoxelProperties& found = body.loaded.scene.types[static_cast<VoxelType>(index)];
    const bool is_opaque = found.visibility == Visibility::Opaque;
    const std::uint8_t alpha = index == kAir ? 0 : is_opaque ? 255 : found.colour.a;
    const std::uint8_t rgba[] = {found.colour.r, found.colour.g, found.colour.b, alpha};
    std::memcpy(type.rgba, rgba, sizeof rgba);
    type.emission = found.emission;
    type.metalness = found.metalness;
    type.roughness = found.roughness;
    type.transparent = found.visibility == Visibility::Transparent ? 1 : 0;
    type.ior = found.ior;
    type.scattering = found.scattering;
    type.anisotropy = found.anisotropy;
    type.light_cost = found.light_cost;
    type.blocks_light = sign_of(found.blocks_light);
    type.occludes = sign_of(found.occludes);
    type.state_bits = found.state_bits;
    type.passable = found.collides ? 0 : 1;
    copy_text(found.name, type.name);
  });
}

quoin_status quoin_type_add(quoin_scene scene, const quoin_type* type, std::uint16_t* out) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    const auto given = taken(type);
    if (!given || out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "type or out is null, or the type's size");
    if (const char* wrong = validate_type(*given)) return fail(QUOIN_INVALID_ARGUMENT, wrong);
    const auto added = body.loaded.scene.types.add(properties_of(*given));
    if (!added) return fail(added.error());
    *out = *added;
    return QUOIN_OK;
  });
}

quoin_status quoin_type_set(quoin_scene scene, std::size_t index, const quoin_type* type) {
  return change_type(scene, index, [&](VoxelProperties& changed) -> Status {
    const auto given = taken(type);
    if (!given) return invalid("type is null, or its size");
    if (const char* wrong = validate_type(*given)) return invalid(wrong);
    VoxelProperties made = properties_of(*given);
    made.attributes = std::move(changed.attributes);
    made.remesh_on_data = changed.remesh_on_data;
    made.faces = std::move(changed.faces);
    made.field_textures = changed.field_textures;
    made.orientations = std::move(changed.orientations);
    made.shapes = std::move(changed.shapes);
    changed = std::move(made);
    return {};
  });
}

quoin_status quoin_type_set_faces(quoin_scene scene, std::size_t type, const quoin_face* faces) {
  return set_member(scene, type, &VoxelProperties::faces, faces, faces_of);
}

quoin_status quoin_type_get_orientations(quoin_scene scene, std::size_t type, quoin_orientations* out) {
  const auto count = [](SceneBody& body) { return body.loaded.scene.types.size(); };
  return report_item(scene, type, out, count, [&](SceneBody& body, quoin_orientations& orientations) {
    orientations = described(body.loaded.scene.types[static_cast<VoxelType>(type)].orientations);
  });
}

quoin_status quoin_type_set_orientations(quoin_scene scene, std::size_t type, const quoin_orientations* orientations) {
  return set_member(scene, type, &VoxelProperties::orientations, orientations, orientations_of);
}

quoin_status quoin_orientation_turn(std::int32_t orientation, std::int32_t axis, std::int32_t quarter_turns,
                                    std::int32_t* out) {
  return guarded([&] {
    if (out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "out is null");
    if (!is_orientation(orientation)) return fail(QUOIN_INVALID_ARGUMENT, kNoOrientation);
    if (axis < 0 || axis > 2) return fail(QUOIN_INVALID_ARGUMENT, "the axis must be 0, 1 or 2");
    *out = (AxisOrientation::quarter_turns(axis, quarter_turns % 4) * AxisOrientation::at(orientation)).index();
    return QUOIN_OK;
  });
}

quoin_status quoin_type_turned_state(quoin_scene scene, std::size_t type, std::uint32_t state, std::int32_t orientation,
                                     std::uint32_t* out) {
  return with_type(scene, type, out, [&](const VoxelProperties& properties) {
    if (!is_orientation(orientation)) return fail(QUOIN_INVALID_ARGUMENT, kNoOrientation);
    *out = properties.orientations.turned(state, AxisOrientation::at(orientation));
    return QUOIN_OK;
  });
}

quoin_status quoin_type_placed_state(quoin_scene scene, std::size_t type, const quoin_placing* placing,
                                     std::uint32_t state, std::uint32_t* out) {
  return with_type(scene, type, out, [&](const VoxelProperties& properties) {
    const auto given = taken(placing);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "placing is null, or its size");
    if (!is_direction(given->face)) return fail(QUOIN_INVALID_ARGUMENT, kNoDirection);
    if (given->front < QUOIN_FRONT_BY_SHAPE || given->front > QUOIN_FRONT_AWAY_FROM_WALL)
      return fail(QUOIN_INVALID_ARGUMENT, "front is not a QUOIN_FRONT value");
    PlacingHit hit{.face = static_cast<Direction>(given->face),
                   .point = {given->point[0], given->point[1], given->point[2]},
                   .look = {given->look[0], given->look[1], given->look[2]}};
    if (given->front != QUOIN_FRONT_BY_SHAPE)
      hit.front = static_cast<PlacedFront>(given->front - QUOIN_FRONT_TOWARDS_PLAYER);
    *out = placed_state(properties, hit, state);
    return QUOIN_OK;
  });
}

quoin_status quoin_type_set_shapes(quoin_scene scene, std::size_t type, const quoin_shapes* shapes) {
  return set_member(scene, type, &VoxelProperties::shapes, shapes, shapes_of);
}

quoin_status quoin_scene_textures(quoin_scene scene, std::size_t max_layers, quoin_textures* out) {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    if (out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "out is null");
    TexturesBody made{body.loaded.scene.types, max_layers == 0 ? TextureSet() : TextureSet(max_layers)};
    made.set.add(made.types);
    *out = handles().put(std::make_shared<const TexturesBody>(std::move(made)));
    return QUOIN_OK;
  });
}

quoin_status quoin_textures_array_count(quoin_textures textures, std::size_t* out) {
  return with_textures(textures, [&](const TexturesBody& body) {
    if (out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "out is null");
    *out = body.set.arrays().size();
    return QUOIN_OK;
  });
}

quoin_status quoin_textures_array_get(quoin_textures textures, std::size_t index, quoin_texture_array* out) {
  return with_textures(textures, [&](const TexturesBody& body) {
    if (index >= body.set.arrays().size()) return fail(QUOIN_INVALID_ARGUMENT, "no array has this number");
    const TextureSet::Array& found = body.set.arrays()[index];
    quoin_texture_array array{};
    array.texels = found.size;
    array.levels = found.layers.front().level_count();
    array.layers = found.layers.size();
    return report(array, out);
  });
}

quoin_status quoin_textures_read(quoin_textures textures, std::size_t array, std::int32_t level, std::uint8_t* rgba,
                                 std::size_t capacity) {
  return with_textures(textures, [&](const TexturesBody& body) {
    if (rgba == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "rgba is null");
    if (array >= body.set.arrays().size()) return fail(QUOIN_INVALID_ARGUMENT, "no array has this number");
    const std::vector<Texture>& layers = body.set.arrays()[array].layers;
    if (level < 0 || level >= layers.front().level_count())
      return fail(QUOIN_INVALID_ARGUMENT, "no mipmap level has this number");
    const std::size_t bytes = layers.front().level(level).size_bytes();
    if (capacity / bytes < layers.size())
      return fail(QUOIN_INVALID_ARGUMENT, "the array is too small for the textures");
    for (const Texture& layer : layers) {
      std::memcpy(rgba, layer.level(level).data(), bytes);
      rgba += bytes;
    }
    return QUOIN_OK;
  });
}

quoin_status quoin_textures_faces(quoin_textures textures, std::size_t type, quoin_face* out, std::size_t* count) {
  return with_textures(textures, [&](const TexturesBody& body) {
    if (count == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "count is null");
    if (!has_fit_size(out)) return fail(QUOIN_INVALID_ARGUMENT, "out is null, or its size");
    if (type >= body.types.size()) return fail(QUOIN_INVALID_ARGUMENT, kNoType);
    const VoxelFaces& faces = body.types[static_cast<VoxelType>(type)].faces;
    std::vector<quoin_face> made;
    if (!faces.empty()) {
      for (const Direction direction : kDirections) made.push_back(described(faces[direction], body.set));
    }
    *count = made.size();
    write_array(std::move(made), out);
    return QUOIN_OK;
  });
}

quoin_status quoin_textures_shapes(quoin_textures textures, std::size_t type, quoin_shapes* out) {
  return with_textures(textures, [&](const TexturesBody& body) {
    if (type >= body.types.size()) return fail(QUOIN_INVALID_ARGUMENT, kNoType);
    return report(ListedShapes(body, static_cast<VoxelType>(type)).whole, out);
  });
}

quoin_status quoin_textures_read_shapes(quoin_textures textures, std::size_t type, quoin_shape_part* parts,
                                        quoin_shape_element* elements, quoin_shape_condition* conditions,
                                        quoin_face* looks) {
  return with_textures(textures, [&](const TexturesBody& body) {
    if (type >= body.types.size()) return fail(QUOIN_INVALID_ARGUMENT, kNoType);
    const auto is_fit = [](const auto* array) { return array == nullptr || has_fit_size(array); };
    if (!is_fit(parts) || !is_fit(elements) || !is_fit(conditions) || !is_fit(looks))
      return fail(QUOIN_INVALID_ARGUMENT, "invalid size of the first element of an array");
    ListedShapes listed(body, static_cast<VoxelType>(type));
    if (parts != nullptr) write_array(std::move(listed.parts), parts);
    if (elements != nullptr) write_array(std::move(listed.elements), elements);
    if (conditions != nullptr) write_array(std::move(listed.conditions), conditions);
    if (looks != nullptr) write_array(std::move(listed.looks), looks);
    return QUOIN_OK;
  });
}
