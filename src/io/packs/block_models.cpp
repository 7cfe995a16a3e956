#include "io/packs/block_models.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <nlohmann/json.hpp>
#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"

namespace quoin::packs {

namespace {

using Json = nlohmann::json;

constexpr int kMaxJsonDepth = 64;
constexpr int kMaxReferences = 32;
// Models inherit the textures of their parents, so each one keeps a copy.
constexpr std::size_t kMaxModelTextures = 1'024;
constexpr std::size_t kMaxTextureText = 600;  // a namespace and a path of at most 512 bytes, or a reference
constexpr float kMaxPart = 1'024.0F;          // of textures, in sixteenths: the limit of shapes

/// An error of a file, made where the fault is found; callers add the file.
Error wrong_model(const std::string& reason) {
  return make_error(ErrorCode::BadFormat, reason);
}

Error too_many_parents(const std::string& path) {
  return make_error(ErrorCode::LimitExceeded, "more than " + std::to_string(kMaxModelParents) + " parents", path);
}

std::string text_in(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// Reads an array of finite numbers from `least` to `most`. Returns false if it is none.
template <std::size_t kCount>
bool read_numbers(const Json& json, float least, float most, std::array<float, kCount>& out) {
  if (!json.is_array() || json.size() != kCount) return false;
  for (std::size_t i = 0; i < kCount; ++i) {
    if (!json[i].is_number()) return false;
    const double number = json[i].get<double>();
    if (!(number >= double{least} && number <= double{most})) return false;
    out[i] = static_cast<float>(number);
  }
  return true;
}

/// Reads a point. Errors: BadFormat, naming the key.
Result<Vec3> point_in(const Json& object, const char* key, float least, float most) {
  const auto found = object.find(key);
  std::array<float, 3> numbers{};
  if (found == object.end() || !read_numbers(*found, least, most, numbers)) {
    return wrong_model(std::string("\"") + key + "\" is not three numbers from " + to_text(least) + " to " +
                       to_text(most));
  }
  return Vec3(numbers[0], numbers[1], numbers[2]);
}

/// Returns the turn by angles about x, y and z; nullopt if there is none. Errors: BadFormat.
Result<std::optional<ElementTurn>> turn_of(const Json& json) {
  if (!json.is_object()) return wrong_model("\"rotation\" is not an object");
  ElementTurn turn;
  if (json.contains("origin")) {
    const auto origin = point_in(json, "origin", -kMaxPart, kMaxPart);
    if (!origin) return origin.error();
    turn.origin = *origin;
  }
  const auto rescale = json.find("rescale");
  turn.rescales = rescale != json.end() && rescale->is_boolean() && rescale->get<bool>();
  constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
  const std::string axis = text_in(json, "axis");
  int turns = 0;
  for (int i = 0; i < 3; ++i) {
    const char* const name = kAxes[static_cast<std::size_t>(i)];
    const auto angle = json.find(axis.empty() ? name : "angle");
    if (angle == json.end() || (!axis.empty() && axis != name)) continue;
    if (!angle->is_number() || !(std::abs(angle->get<double>()) <= 360.0)) {
      return wrong_model("the angle of \"rotation\" is not a number from -360 to 360");
    }
    if (angle->get<double>() == 0.0) continue;
    turn.axis = i;
    turn.degrees = static_cast<float>(angle->get<double>());
    ++turns;
  }
  if (!axis.empty() && axis != "x" && axis != "y" && axis != "z") {
    return wrong_model("the axis of \"rotation\" is not x, y or z");
  }
  if (turns > 1) return make_error(ErrorCode::Unsupported, "an element is turned about more than one axis");
  return turns == 0 ? std::optional<ElementTurn>() : std::optional(turn);
}

Result<PackFace> face_of(const Json& json) {
  if (!json.is_object()) return wrong_model("a face is not an object");
  PackFace face;
  face.texture = text_in(json, "texture");
  if (face.texture.size() > kMaxTextureText) return wrong_model("the texture of a face has a name that is too long");
  if (const auto uv = json.find("uv"); uv != json.end()) {
    std::array<float, 4> part{};
    if (!read_numbers(*uv, -kMaxPart, kMaxPart, part)) return wrong_model("\"uv\" is not four numbers");
    face.uv = part;
  }
  if (const auto turn = json.find("rotation"); turn != json.end()) {
    const double degrees = turn->is_number() ? turn->get<double>() : -1.0;
    if (degrees != 0.0 && degrees != 90.0 && degrees != 180.0 && degrees != 270.0) {
      return wrong_model("the rotation of a face is not 0, 90, 180 or 270");
    }
    face.turn = static_cast<int>(degrees) / 90;
  }
  const auto tint = json.find("tintindex");
  face.is_tinted = tint != json.end() && tint->is_number() && tint->get<double>() >= 0.0;
  return face;
}

Result<PackElement> element_of(const Json& json) {
  if (!json.is_object()) return wrong_model("an element is not an object");
  PackElement element;
  const auto from = point_in(json, "from", static_cast<float>(kMinShapeUnit), static_cast<float>(kMaxShapeUnit));
  if (!from) return from.error();
  const auto to = point_in(json, "to", static_cast<float>(kMinShapeUnit), static_cast<float>(kMaxShapeUnit));
  if (!to) return to.error();
  for (int axis = 0; axis < 3; ++axis) {
    element.from[axis] = std::min((*from)[axis], (*to)[axis]);
    element.to[axis] = std::max((*from)[axis], (*to)[axis]);
  }
  if (const auto rotation = json.find("rotation"); rotation != json.end()) {
    const auto turn = turn_of(*rotation);
    if (!turn) return turn.error();
    element.turn = *turn;
  }
  if (const auto light = json.find("light_emission"); light != json.end()) {
    const double level = light->is_number() ? light->get<double>() : -1.0;
    if (!(level >= 0.0 && level <= 15.0) || std::floor(level) != level) {
      return wrong_model("\"light_emission\" is not a whole number from 0 to 15");
    }
    element.light_emission = static_cast<int>(level);
  }
  constexpr std::array<const char*, 6> kNames = {"east", "west", "up", "down", "south", "north"};
  const auto faces = json.find("faces");
  if (faces == json.end() || !faces->is_object()) return element;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const auto one = faces->find(kNames[i]);
    if (one == faces->end()) continue;
    auto face = face_of(*one);
    if (!face) return face.error();
    element.faces[i] = std::move(*face);
  }
  return element;
}

/// Reads the model's own elements and textures over those of its parent.
Status read_model(const Json& json, BlockModel& model) {
  if (const auto textures = json.find("textures"); textures != json.end() && textures->is_object()) {
    for (const auto& [key, value] : textures->items()) {
      // Since 26.1, a texture can be an object with options.
      const std::string text = value.is_object()   ? text_in(value, "sprite")
                               : value.is_string() ? value.get<std::string>()
                                                   : "";
      if (key.size() > kMaxTextureText || text.size() > kMaxTextureText) {
        return wrong_model("a texture has a name that is too long");
      }
      model.textures.insert_or_assign(key, text);
      if (model.textures.size() > kMaxModelTextures) {
        return make_error(ErrorCode::LimitExceeded,
                          "the model has more than " + std::to_string(kMaxModelTextures) + " textures");
      }
    }
  }
  const auto elements = json.find("elements");
  if (elements == json.end()) return {};
  if (!elements->is_array()) return wrong_model("\"elements\" is not an array");
  if (elements->size() > kMaxModelElements) {
    return make_error(ErrorCode::LimitExceeded, "the model has " + std::to_string(elements->size()) +
                                                    " elements: at most " + std::to_string(kMaxModelElements));
  }
  auto own = std::make_shared<std::vector<PackElement>>();
  for (std::size_t i = 0; i < elements->size(); ++i) {
    auto element = element_of((*elements)[i]);
    if (!element) {
      Error error = element.error();
      error.message = "element " + std::to_string(i) + ": " + error.message;
      return error;
    }
    const Vec3 size = element->to - element->from;
    const int plates = int{size.x == 0.0F} + int{size.y == 0.0F} + int{size.z == 0.0F};
    if (plates < 2) own->push_back(std::move(*element));
  }
  model.shared_elements = std::move(own);
  return {};
}

}  // namespace

Result<std::optional<Json>> read_pack_json(const PackFiles& pack, const std::string& path) {
  const auto bytes = pack.read(path, kMaxJsonBytes);
  const auto named = [&](Error error) {
    if (error.path.empty()) error.path = path;
    return error;
  };
  if (!bytes) return named(bytes.error());
  if (!*bytes) return std::optional<Json>();
  std::string_view text = text_of(**bytes);
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (json_extent(text, JsonComments::Allowed).depth > kMaxJsonDepth)
    return named(wrong_model("more than 64 levels of brackets"));
  Json json = Json::parse(text, nullptr, false, true);
  if (json.is_discarded()) return named(wrong_model("not valid JSON"));
  if (!json.is_object()) return named(wrong_model("not a JSON object"));
  return std::optional(std::move(json));
}

std::optional<ResourceName> BlockModel::texture(std::string_view text) const {
  for (int i = 0; i < kMaxReferences; ++i) {
    const bool is_reference = text.starts_with('#');
    if (is_reference) text.remove_prefix(1);
    const auto found = textures.find(text);
    // Before 1.8.8, references of faces had no '#'.
    if (found == textures.end() || found->second == text) return is_reference ? std::nullopt : resource_name(text);
    text = found->second;
  }
  return std::nullopt;
}

Result<std::shared_ptr<const BlockModel>> ModelReader::model(std::string_view name) {
  auto resource = resource_name(name);
  if (!resource) return wrong_model("\"" + printable(name.substr(0, 100)) + "\" is not the name of a model");
  if (resource->path.find('/') == std::string::npos) resource->path.insert(0, "block/");
  return read(*resource);
}

/// A model on the way from the wanted one to its first known ancestor.
struct ModelReader::Link {
  std::string key;
  std::string path;
  Result<std::optional<Json>> json;
  std::optional<ResourceName> parent;  // nullopt: none, or the game draws the model by code
};

/// Reads the models from the wanted one upwards, then makes them from the last one downwards.
Result<std::shared_ptr<const BlockModel>> ModelReader::read(const ResourceName& name) {
  std::vector<Link> links;
  Known parent = std::shared_ptr<const BlockModel>();
  for (std::optional<ResourceName> next = name; next;) {
    std::string key = to_string(*next);
    if (const auto known = known_.find(key); known != known_.end()) {
      parent = known->second;
      break;
    }
    std::string path = "assets/" + next->space + "/models/" + next->path + ".json";
    if (const auto same = std::ranges::find(links, key, &Link::key); same != links.end()) {
      parent = make_error(ErrorCode::BadFormat, "the model is its own ancestor", path);
      break;
    }
    // Only the wanted model is known to have too many: those above it may have fewer.
    if (links.size() > kMaxModelParents) {
      return known_.insert_or_assign(links.front().key, Known(too_many_parents(links.front().path))).first->second;
    }
    links.push_back({std::move(key), path, read_pack_json(pack_, path), std::nullopt});
    next.reset();
    if (!links.back().json || !*links.back().json) continue;
    next = resource_name(text_in(**links.back().json, "parent"));
    if (next && next->path.starts_with("builtin/")) next.reset();
    links.back().parent = next;
  }
  for (auto link = links.rbegin(); link != links.rend(); ++link) {
    parent = made(*link, parent);
    if (!parent && parent.error().path.empty()) parent.error().path = link->path;
    known_.insert_or_assign(link->key, parent);
  }
  return parent;
}

Result<std::shared_ptr<const BlockModel>> ModelReader::made(const Link& link, const Known& parent) const {
  if (!link.json) return link.json.error();
  if (!*link.json) return std::shared_ptr<const BlockModel>();
  const Json& json = **link.json;
  const std::string name = text_in(json, "parent");
  if (!name.empty() && !resource_name(name)) {
    return wrong_model("\"" + printable(name.substr(0, 100)) + "\" is not the name of a model");
  }
  BlockModel model;
  if (link.parent) {
    if (!parent) return parent.error();
    if (*parent == nullptr) return wrong_model("there is no model " + to_string(*link.parent) + ", its parent");
    model = **parent;
    if (++model.parents > kMaxModelParents) return too_many_parents(link.path);
  }
  if (auto done = read_model(json, model); !done) return done.error();
  return std::make_shared<const BlockModel>(std::move(model));
}

}  // namespace quoin::packs
