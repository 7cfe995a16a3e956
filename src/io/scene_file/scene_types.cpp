// The types of a scene file: their properties, textures, orientations and shapes (docs/scene-files.md).
#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include <quoin/core/assert.h>

#include "core/bytes/text.h"
#include "io/scene_file/scene_parts.h"

namespace quoin::scene_json {
namespace {

constexpr std::array<std::pair<const char*, FaceAlpha>, 3> kFaceAlphas = {
    {{"opaque", FaceAlpha::Opaque}, {"cutout", FaceAlpha::Cutout}, {"translucent", FaceAlpha::Translucent}}};

constexpr std::array<std::pair<const char*, ShapeNeighbours>, 4> kShapeNeighbours = {
    {{"none", ShapeNeighbours::None},
     {"connected", ShapeNeighbours::Connected},
     {"stairs", ShapeNeighbours::Stairs},
     {"fluid", ShapeNeighbours::Fluid}}};
constexpr std::array<std::pair<const char*, StairCorner>, 5> kStairCorners = {
    {{"straight", StairCorner::Straight},
     {"outer_left", StairCorner::OuterLeft},
     {"outer_right", StairCorner::OuterRight},
     {"inner_left", StairCorner::InnerLeft},
     {"inner_right", StairCorner::InnerRight}}};

}  // namespace

OrderedJson PartWriter::text(const std::string& bytes) {
  if (is_utf8(bytes)) return bytes;
  needs_second_ = true;
  return {{"base64", to_base64(std::as_bytes(std::span(bytes)))}};
}

OrderedJson PartWriter::json_of(const Texture& texture, std::size_t index) {
  const auto [first, last] = written_.equal_range(texture.hash());
  const auto same = std::find_if(first, last, [&](const auto& each) { return each.second.texture == texture; });
  if (same != last) return {{"type", same->second.type}, {"texture", same->second.index}};
  written_.emplace(texture.hash(), WrittenTexture{texture, types_, index});
  const std::size_t channels = texture.is_opaque() ? 3 : 4;
  const AlphaImage image = texture.image();
  std::vector<std::byte> bytes;
  bytes.reserve(channels * image.rgba.size() / 4);
  for (std::size_t i = 0; i < image.rgba.size(); ++i) {
    if (i % 4 < channels) bytes.push_back(std::byte{image.rgba[i]});
  }
  return {{"name", text(texture.name())}, {"size", texture.size()}, {"texels", to_base64(bytes)}};
}

// Writes a face, and its texture to `list` unless the type's textures have it.
OrderedJson PartWriter::json_of(const VoxelFace& face, TypeTextures& textures, OrderedJson& list) {
  OrderedJson json = OrderedJson::object();
  if (!face.texture.is_null()) {
    auto known = std::ranges::find(textures, face.texture);
    if (known == textures.end()) {
      list.push_back(json_of(face.texture, textures.size()));
      known = textures.insert(textures.end(), face.texture);
    }
    json["texture"] = known - textures.begin();
  }
  if (face.turn != 0) json["turn"] = face.turn;
  if (face.mirrored) json["mirrored"] = true;
  const Rgba8 tint = face.tint;
  if (!(tint == VoxelFace{}.tint)) json["tint"] = {tint.r, tint.g, tint.b, tint.a};
  if (face.alpha != FaceAlpha::Opaque) json["alpha"] = name_of(kFaceAlphas, face.alpha);
  if (face.emission_share != VoxelFace{}.emission_share) json["emission_share"] = face.emission_share;
  return json;
}

OrderedJson PartWriter::json_of(const VoxelFaces& faces, TypeTextures& textures) {
  QUOIN_ASSERT(!faces.empty(), "textured faces");
  OrderedJson list = OrderedJson::array();
  OrderedJson sides = OrderedJson::array();
  for (const Direction direction : kDirections) sides.push_back(json_of(faces[direction], textures, list));
  return {{"textures", std::move(list)}, {"sides", std::move(sides)}};
}

OrderedJson PartWriter::json_of(const ShapeElement& element, TypeTextures& textures, OrderedJson& list) {
  OrderedJson json = {{"min", triple(element.min)}, {"max", triple(element.max)}};
  if (element.turn) {
    OrderedJson& turn = json["turn"];
    turn = {{"origin", triple(element.turn->origin)}, {"axis", element.turn->axis}, {"degrees", element.turn->degrees}};
    if (element.turn->rescales) turn["rescales"] = true;
  }
  if (!element.collides) json["collides"] = false;
  if (element.faces == ShapeElement{}.faces) return json;
  for (const ElementFace& face : element.faces) {
    OrderedJson each = OrderedJson::object();
    if (!face.is_drawn) each["drawn"] = false;
    if (face.face) each["face"] = json_of(*face.face, textures, list);
    if (face.part) each["part"] = *face.part;
    json["faces"].push_back(std::move(each));
  }
  return json;
}

namespace {

OrderedJson names_of(DirectionSet directions) {
  OrderedJson names = OrderedJson::array();
  for (const Direction direction : directions) names.push_back(name_of(direction));
  return names;
}

OrderedJson json_of(const ShapeCondition& condition) {
  OrderedJson json = OrderedJson::object();
  if (condition.state_mask != 0) json["state_mask"] = condition.state_mask;
  if (condition.state != 0) json["state"] = condition.state;
  if (!condition.connected.empty()) json["connected"] = names_of(condition.connected);
  if (!condition.unconnected.empty()) json["unconnected"] = names_of(condition.unconnected);
  if (condition.corner) json["corner"] = name_of(kStairCorners, *condition.corner);
  const PositionShare& positions = condition.positions;
  if (!(positions == PositionShare{})) json["positions"] = {positions.count, positions.first, positions.end};
  return json;
}

OrderedJson json_of(const StateOrientations& orientations) {
  OrderedJson json = OrderedJson::object();
  if (orientations.first_bit != 0) json["first_bit"] = orientations.first_bit;
  if (orientations.front != Direction::PosX) json["front"] = name_of(orientations.front);
  for (const AxisOrientation& orientation : orientations.by_value) json["by_value"].push_back(orientation.index());
  return json;
}

}  // namespace

OrderedJson PartWriter::json_of(const VoxelShapes& shapes, TypeTextures& textures) {
  const ShapeRules& rules = shapes.rules();
  OrderedJson json = OrderedJson::object();
  if (rules.neighbours != ShapeNeighbours::None) json["neighbours"] = name_of(kShapeNeighbours, rules.neighbours);
  if (rules.groups != ShapeRules{}.groups) json["groups"] = rules.groups;
  if (!rules.connects_to_full_sides) json["connects_to_full_sides"] = false;
  if (rules.fluid) {
    OrderedJson& fluid = json["fluid"];
    fluid["groups"] = rules.fluid->groups;
    for (const ShapeCondition& condition : rules.fluid->when) fluid["when"].push_back(scene_json::json_of(condition));
  }
  OrderedJson list = OrderedJson::array();
  for (const ShapePart& part : rules.parts) {
    OrderedJson each = OrderedJson::object();
    if (part.orientation.index() != 0) each["orientation"] = part.orientation.index();
    for (const ShapeCondition& condition : part.when) each["when"].push_back(scene_json::json_of(condition));
    for (const ShapeElement& element : part.shape.elements()) {
      each["elements"].push_back(json_of(element, textures, list));
    }
    json["parts"].push_back(std::move(each));
  }
  if (!list.empty()) json["textures"] = std::move(list);
  return json;
}

OrderedJson PartWriter::json_of(const VoxelProperties& type) {
  ++types_;
  const VoxelProperties plain;
  OrderedJson json = OrderedJson::object();
  if (!type.name.empty()) json["name"] = text(type.name);
  json["colour"] = {type.colour.r, type.colour.g, type.colour.b, type.colour.a};
  if (type.visibility == Visibility::Transparent) json["visibility"] = "transparent";
  if (!type.collides) json["collides"] = false;
  const auto put = [&](const char* key, float value, float usual) {
    if (!is_same(value, usual)) json[key] = value;
  };
  put("roughness", type.roughness, plain.roughness);
  put("metalness", type.metalness, plain.metalness);
  put("emission", type.emission, plain.emission);
  put("ior", type.ior, plain.ior);
  put("scattering", type.scattering, plain.scattering);
  put("anisotropy", type.anisotropy, plain.anisotropy);
  if (type.state_bits != 0) json["state_bits"] = type.state_bits;
  if (type.blocks_light) json["blocks_light"] = *type.blocks_light;
  if (type.occludes) json["occludes"] = *type.occludes;
  if (type.light_cost != 0) json["light_cost"] = type.light_cost;
  if (type.remesh_on_data) json["remesh_on_data"] = true;
  TypeTextures textures;
  if (!type.faces.empty()) json["faces"] = json_of(type.faces, textures);
  if (!(type.field_textures == plain.field_textures)) {
    OrderedJson& field = json["field_textures"];
    field["voxels"] = type.field_textures.voxels;
    field["flat_degrees"] = type.field_textures.flat_degrees;
    field["steep_degrees"] = type.field_textures.steep_degrees;
  }
  if (!type.orientations.empty()) json["orientations"] = scene_json::json_of(type.orientations);
  if (!type.shapes.empty()) json["shapes"] = json_of(type.shapes, textures);
  for (const auto& [key, value] : type.attributes) json["attributes"].push_back({text(key), text(value)});
  return json;
}

namespace {

// The textures of a type: six of its faces, and those of all faces of its shapes.
constexpr std::size_t kMostTextures = 6 + 6 * 4 * kMaxShapeElements;

// Reads a texture that an earlier type has.
Texture shared_texture(const Json& json, const Place& place, const TexturesOfTypes& earlier, Faults& faults) {
  const Object object(json, place, {"type", "texture"}, faults);
  const std::size_t type = small_number(object, "type", kMaxVoxelTypes, 0);
  const std::size_t texture = small_number(object, "texture", kMostTextures - 1, 0);
  if (object.need("texture") == nullptr || faults.error()) return {};
  if (type == 0 || type > earlier.size()) {
    faults.add(object.place_of("type"), "type " + std::to_string(type) + " does not come before this type");
    return {};
  }
  if (const std::vector<Texture>& of_type = earlier[type - 1]; texture < of_type.size()) return of_type[texture];
  faults.add(object.place_of("texture"),
             "type " + std::to_string(type) + " has no texture " + std::to_string(texture) + " in its list");
  return {};
}

Texture texture_of(const Json& json, const Place& place, const TexturesOfTypes& earlier, Faults& faults) {
  if (json.is_object() && json.contains("type")) return shared_texture(json, place, earlier, faults);
  const Object object(json, place, {"name", "size", "texels"}, faults);
  std::string name;
  object.read_text("name", name);
  const auto size = static_cast<int>(small_number(object, "size", kMaxTextureSize, 0));
  const Json* texels = object.need("texels");
  if (texels == nullptr || object.need("size") == nullptr || faults.error()) return {};
  const auto bytes = from_base64(object.text(*texels, object.place_of("texels")));
  if (!bytes) {
    faults.add(object.place_of("texels"), bytes.error().message);
    return {};
  }
  const std::size_t count = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  const std::size_t channels = bytes->size() == 3 * count ? 3 : 4;
  const bool is_complete = bytes->size() == channels * count;
  AlphaImage image{size, size, std::vector<std::uint8_t>(4 * count, 255)};
  for (std::size_t i = 0; is_complete && i < image.rgba.size(); ++i) {
    if (i % 4 < channels) image.rgba[i] = std::to_integer<std::uint8_t>((*bytes)[i / 4 * channels + i % 4]);
  }
  auto texture = Texture::from_image(std::move(name), image);
  if (!texture) {
    faults.add(place, texture.error().message);
  } else if (!is_complete) {
    const std::string side = std::to_string(size);
    faults.add(object.place_of("texels"), "must have 3 or 4 bytes for each of the " + side + " x " + side +
                                              " texels, not " + std::to_string(bytes->size()) + " bytes");
  }
  return texture ? *texture : Texture();
}

// Reads a face. `needs_texture`: a face without a texture has texture 0; else it has none.
VoxelFace face_of(const Json& json, const Place& place, const std::vector<Texture>& textures, bool needs_texture,
                  Faults& faults) {
  const Object object(json, place, {"texture", "turn", "mirrored", "tint", "alpha", "emission_share"}, faults);
  VoxelFace face;
  const std::size_t texture = small_number(object, "texture", kMostTextures - 1, 0);
  if (!needs_texture && object.find("texture") == nullptr) {
    face.texture = {};
  } else if (texture < textures.size()) {
    face.texture = textures[texture];
  } else {
    faults.add(object.place_of("texture"), "must be an index into textures, from 0");
  }
  face.turn = static_cast<std::uint8_t>(small_number(object, "turn", 3, 0));
  object.read("mirrored", face.mirrored);
  if (const Json* tint = object.find("tint")) {
    const std::vector<int> c = object.whole_numbers(*tint, object.place_of("tint"), 4, 0, 255);
    const auto channel = [&](std::size_t i) { return static_cast<std::uint8_t>(c[i]); };
    face.tint = {channel(0), channel(1), channel(2), channel(3)};
  }
  read_name(object, "alpha", kFaceAlphas, face.alpha);
  face.emission_share = static_cast<std::uint8_t>(small_number(object, "emission_share", 255, face.emission_share));
  return face;
}

// Reads the faces of the next type, and appends its textures to `textures`.
VoxelFaces faces_of(const Json& json, const Place& place, const TexturesOfTypes& earlier,
                    std::vector<Texture>& textures, Faults& faults) {
  const Object object(json, place, {"textures", "sides"}, faults);
  read_list(object, "textures", 6,
            [&](const Json& each, const Place& at) { textures.push_back(texture_of(each, at, earlier, faults)); });
  std::array<VoxelFace, 6> sides;
  std::size_t count = 0;
  read_list(object, "sides", sides.size(),
            [&](const Json& each, const Place& at) { sides[count++] = face_of(each, at, textures, true, faults); });
  if (count != sides.size() && !faults.error()) faults.add(object.place_of("sides"), "must be a list of 6 faces");
  return VoxelFaces(sides);
}

Vec3 corner_of(const Object& object, std::string_view key, Vec3 usual) {
  DVec3 corner(usual);
  object.read(key, corner);
  return Vec3(corner);
}

ElementFace element_face_of(const Json& json, const Place& place, const std::vector<Texture>& textures,
                            Faults& faults) {
  const Object object(json, place, {"drawn", "face", "part"}, faults);
  ElementFace face;
  object.read("drawn", face.is_drawn);
  if (const Json* look = object.find("face")) {
    face.face = face_of(*look, object.place_of("face"), textures, false, faults);
  }
  if (const Json* part = object.find("part")) {
    const std::vector<double> edges = object.numbers(*part, object.place_of("part"), 4);
    std::array<float, 4>& to = face.part.emplace();
    for (std::size_t i = 0; i < to.size(); ++i) to[i] = static_cast<float>(edges[i]);
  }
  return face;
}

ShapeElement element_of(const Json& json, const Place& place, const std::vector<Texture>& textures, Faults& faults) {
  const Object object(json, place, {"min", "max", "turn", "collides", "faces"}, faults);
  ShapeElement element;
  element.min = corner_of(object, "min", element.min);
  element.max = corner_of(object, "max", element.max);
  object.read("collides", element.collides);
  if (const Json* json_of_turn = object.find("turn")) {
    const Place at = object.place_of("turn");
    const Object turn(*json_of_turn, at, {"origin", "axis", "degrees", "rescales"}, faults);
    ElementTurn& to = element.turn.emplace();
    to.origin = corner_of(turn, "origin", to.origin);
    to.axis = static_cast<int>(small_number(turn, "axis", 2, 1));
    turn.read("degrees", to.degrees);
    turn.read("rescales", to.rescales);
  }
  if (object.find("faces") == nullptr) return element;
  std::size_t count = 0;
  read_list(object, "faces", element.faces.size(), [&](const Json& each, const Place& at) {
    element.faces[count++] = element_face_of(each, at, textures, faults);
  });
  if (count != element.faces.size() && !faults.error()) {
    faults.add(object.place_of("faces"), "must be a list of 6 faces");
  }
  return element;
}

// Reads the name of a direction.
Direction direction_of(const Json& json, const Place& place, Faults& faults) {
  const auto found = std::ranges::find_if(
      kDirections, [&](Direction direction) { return json.is_string() && json == name_of(direction); });
  if (found != kDirections.end()) return *found;
  faults.add(place, "must be one of +X, -X, +Y, -Y, +Z, -Z");
  return Direction::PosX;
}

// Reads a list of names of directions.
DirectionSet directions_of(const Object& object, std::string_view key) {
  DirectionSet directions;
  if (object.find(key) == nullptr) return directions;
  read_list(object, key, kDirections.size(), [&](const Json& each, const Place& place) {
    directions.insert(direction_of(each, place, object.faults()));
  });
  return directions;
}

ShapeCondition condition_of(const Json& json, const Place& place, Faults& faults) {
  const Object object(json, place, {"state_mask", "state", "connected", "unconnected", "corner", "positions"}, faults);
  ShapeCondition condition;
  condition.state_mask = bits_in(object, "state_mask").value_or(0);
  condition.state = bits_in(object, "state").value_or(0);
  condition.connected = directions_of(object, "connected");
  condition.unconnected = directions_of(object, "unconnected");
  if (object.find("corner") != nullptr) {
    read_name(object, "corner", kStairCorners, condition.corner.emplace(StairCorner::Straight));
  }
  if (const Json* positions = object.find("positions")) {
    constexpr int kMost = static_cast<int>(kMaxPositionCount);
    const std::vector<int> share = object.whole_numbers(*positions, object.place_of("positions"), 3, 0, kMost);
    const auto number = [&](std::size_t i) { return static_cast<std::uint16_t>(share[i]); };
    condition.positions = {number(0), number(1), number(2)};
    if (condition.positions.count == 0) faults.add(object.place_of("positions"), "the count must be at least 1");
  }
  return condition;
}

AxisOrientation orientation_of(std::size_t index) {
  return AxisOrientation::at(static_cast<int>(index));
}

StateOrientations orientations_of(const Json& json, const Place& place, Faults& faults) {
  const Object object(json, place, {"first_bit", "front", "by_value"}, faults);
  StateOrientations orientations;
  orientations.first_bit = static_cast<std::uint8_t>(small_number(object, "first_bit", kMaxStateBits - 1, 0));
  if (const Json* front = object.find("front")) {
    orientations.front = direction_of(*front, object.place_of("front"), faults);
  }
  read_list(object, "by_value", AxisOrientation::kCount, [&](const Json& each, const Place& at) {
    if (each.is_number_unsigned() && each < AxisOrientation::kCount) {
      orientations.by_value.push_back(orientation_of(each.get<std::size_t>()));
    } else {
      faults.add(at, "must be the number of an orientation, 0 to 47");
    }
  });
  return orientations;
}

ShapePart part_of(const Json& json, const Place& place, const std::vector<Texture>& textures, Faults& faults) {
  const Object object(json, place, {"orientation", "when", "elements"}, faults);
  ShapePart part;
  part.orientation = orientation_of(small_number(object, "orientation", AxisOrientation::kCount - 1, 0));
  const auto add = [&](const Json& each, const Place& at) { part.when.push_back(condition_of(each, at, faults)); };
  if (object.find("when") != nullptr) read_list(object, "when", std::numeric_limits<std::size_t>::max(), add);
  std::vector<ShapeElement> elements;
  read_list(object, "elements", kMaxShapeElements,
            [&](const Json& each, const Place& at) { elements.push_back(element_of(each, at, textures, faults)); });
  if (faults.error()) return part;
  if (auto shape = VoxelShape::from_elements(std::move(elements))) {
    part.shape = *shape;
  } else {
    faults.add(object.place_of("elements"), shape.error().message);
  }
  return part;
}

ContainedFluid contained_fluid_of(const Json& json, const Place& place, Faults& faults) {
  const Object object(json, place, {"groups", "when"}, faults);
  ContainedFluid fluid;
  if (object.need("groups") != nullptr) fluid.groups = bits_in(object, "groups").value_or(0);
  const auto add = [&](const Json& each, const Place& at) { fluid.when.push_back(condition_of(each, at, faults)); };
  if (object.find("when") != nullptr) read_list(object, "when", std::numeric_limits<std::size_t>::max(), add);
  return fluid;
}

// Reads the shapes of the next type, and appends their textures to `textures`.
VoxelShapes shapes_of(const Json& json, const Place& place, const TexturesOfTypes& earlier,
                      std::vector<Texture>& textures, Faults& faults) {
  const Object object(json, place, {"neighbours", "groups", "connects_to_full_sides", "fluid", "parts", "textures"},
                      faults);
  const auto add = [&](const Json& each, const Place& at) {
    textures.push_back(texture_of(each, at, earlier, faults));
  };
  if (object.find("textures") != nullptr) read_list(object, "textures", kMostTextures, add);
  ShapeRules rules;
  read_name(object, "neighbours", kShapeNeighbours, rules.neighbours);
  rules.groups = bits_in(object, "groups").value_or(rules.groups);
  object.read("connects_to_full_sides", rules.connects_to_full_sides);
  if (const Json* fluid = object.find("fluid")) {
    rules.fluid = contained_fluid_of(*fluid, object.place_of("fluid"), faults);
  }
  if (rules.neighbours != ShapeNeighbours::Fluid || object.find("parts") != nullptr) {
    read_list(object, "parts", kMaxShapeParts,
              [&](const Json& each, const Place& at) { rules.parts.push_back(part_of(each, at, textures, faults)); });
  }
  if (faults.error()) return {};
  auto shapes = VoxelShapes::from_rules(std::move(rules));
  if (!shapes) faults.add(place, shapes.error().message);
  return shapes ? *shapes : VoxelShapes();
}

// Reads textures, orientations and shapes of the next type, and appends its textures to `earlier`.
void read_looks(const Object& type, TexturesOfTypes& earlier, VoxelProperties& properties) {
  Faults& faults = type.faults();
  std::vector<Texture> textures;
  std::optional<std::string_view> last;
  if (const Json* faces = type.find("faces")) {
    last = "faces";
    properties.faces = faces_of(*faces, type.place_of("faces"), earlier, textures, faults);
  }
  if (const Json* json = type.find("field_textures")) {
    last = "field_textures";
    const Place place = type.place_of("field_textures");
    const Object field(*json, place, {"voxels", "flat_degrees", "steep_degrees"}, faults);
    field.read("voxels", properties.field_textures.voxels);
    field.read("flat_degrees", properties.field_textures.flat_degrees);
    field.read("steep_degrees", properties.field_textures.steep_degrees);
  }
  if (const Json* orientations = type.find("orientations")) {
    last = "orientations";
    properties.orientations = orientations_of(*orientations, type.place_of("orientations"), faults);
  }
  if (const Json* shapes = type.find("shapes")) {
    last = "shapes";
    properties.shapes = shapes_of(*shapes, type.place_of("shapes"), earlier, textures, faults);
  }
  earlier.push_back(std::move(textures));
  if (faults.error()) {
    properties.faces = {};
    properties.orientations = {};
    properties.shapes = {};
  } else if (const Status valid = validate_type(properties); last && !valid) {
    faults.add(type.place_of(*last), valid.error().message);
  }
}

/// Reads a list "attributes" of pairs.
void read_attributes(const Object& object, std::map<std::string, std::string>& attributes) {
  read_list(object, "attributes", std::numeric_limits<std::size_t>::max(), [&](const Json& pair, const Place& place) {
    if (!pair.is_array() || pair.size() != 2) {
      object.faults().add(place, "must be a key and a value");
      return;
    }
    std::string key = object.text(pair[0], {&place, {}, 0});
    const bool is_new = attributes.emplace(std::move(key), object.text(pair[1], {&place, {}, 1})).second;
    if (!is_new) object.faults().add(place, "is a duplicate key");
  });
}

}  // namespace

VoxelProperties properties_of(const Json& json, const Place& place, TexturesOfTypes& earlier, Faults& faults) {
  const Object type(json, place,
                    {"name",         "colour",     "visibility",     "collides",   "roughness",  "metalness",
                     "emission",     "ior",        "scattering",     "anisotropy", "state_bits", "blocks_light",
                     "occludes",     "light_cost", "remesh_on_data", "attributes", "faces",      "field_textures",
                     "orientations", "shapes"},
                    faults);
  VoxelProperties properties;
  type.read_text("name", properties.name);
  if (const Json* colour = type.need("colour")) {
    const std::vector<int> c = type.whole_numbers(*colour, type.place_of("colour"), 4, 0, 255);
    const auto channel = [&](std::size_t i) { return static_cast<std::uint8_t>(c[i]); };
    properties.colour = {channel(0), channel(1), channel(2), channel(3)};
  }
  std::string visibility = "opaque";
  type.read("visibility", visibility);
  if (visibility == "transparent") {
    properties.visibility = Visibility::Transparent;
  } else if (visibility != "opaque") {
    faults.add(type.place_of("visibility"), "must be \"opaque\" or \"transparent\"");
  }
  type.read("collides", properties.collides);
  type.read("roughness", properties.roughness);
  type.read("metalness", properties.metalness);
  type.read("emission", properties.emission);
  type.read("ior", properties.ior);
  type.read("scattering", properties.scattering);
  type.read("anisotropy", properties.anisotropy);
  properties.state_bits = static_cast<std::uint8_t>(small_number(type, "state_bits", kMaxStateBits, 0));
  properties.light_cost = static_cast<std::uint8_t>(small_number(type, "light_cost", kMaxLightCost, 0));
  const auto read_own = [&](const char* key, std::optional<bool>& out) {
    if (type.find(key) == nullptr) return;
    out = false;
    type.read(key, *out);
  };
  read_own("blocks_light", properties.blocks_light);
  read_own("occludes", properties.occludes);
  if (properties.visibility == Visibility::Transparent && properties.occludes.value_or(false)) {
    faults.add(type.place_of("occludes"), "must be false for a transparent type");
  }
  type.read("remesh_on_data", properties.remesh_on_data);
  if (type.find("attributes") != nullptr) read_attributes(type, properties.attributes);
  read_looks(type, earlier, properties);
  return properties;
}

}  // namespace quoin::scene_json
