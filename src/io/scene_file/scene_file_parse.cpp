#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <set>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <quoin/io/scene_file.h>

namespace quoin {

namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxBytes = std::size_t{64} << 20;
constexpr int kMaxDepth = 32;
constexpr std::size_t kMaxFiles = 65'536;
constexpr std::size_t kMaxInstances = std::size_t{1} << 22;
constexpr int kVersion = 1;

/// A place in the file: a key or an index below another place, the file itself without. Text is made of it only where
/// something is wrong.
struct Place {
  const Place* parent = nullptr;
  std::string_view key;
  std::optional<std::size_t> index;
};

std::string text_of(const Place& place) {
  const std::string above = place.parent != nullptr ? text_of(*place.parent) : std::string();
  if (place.index) return above + "[" + std::to_string(*place.index) + "]";
  if (above.empty()) return std::string(place.key);
  return above + "." + std::string(place.key);
}

// The first fault found, with its place; reading goes on after it, and nothing of it is used.
class Faults {
 public:
  void add(const Place& place, const std::string& what, ErrorCode code = ErrorCode::BadFormat) {
    if (error_) return;
    const std::string where = text_of(place);
    error_ = Error{code, where.empty() ? what : where + ": " + what, {}, std::nullopt};
  }
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

 private:
  std::optional<Error> error_;
};

// A piece of the file in a message.
std::string excerpt(std::string_view text) {
  constexpr std::size_t kMost = 60;
  std::string out;
  out.append(1, '"').append(text.substr(0, kMost)).append(1, '"');
  return out;
}

/// An object of the file, whose keys are asked for one by one.
class Object {
 public:
  Object(const Json& json, const Place& place, std::initializer_list<std::string_view> keys, Faults& faults)
      : json_(json), place_(place), faults_(faults) {
    if (!json.is_object()) {
      faults.add(place, "must be an object");
      return;
    }
    for (const auto& [key, value] : json.items()) {
      if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
        faults.add(place, excerpt(key) + " is not known here");
      }
    }
  }

  [[nodiscard]] const Json* find(std::string_view key) const {
    if (!json_.is_object()) return nullptr;
    const auto found = json_.find(key);
    return found == json_.end() ? nullptr : &*found;
  }
  [[nodiscard]] const Json* need(std::string_view key) const {
    const Json* found = find(key);
    if (found == nullptr && json_.is_object()) faults_.add(place_, excerpt(key) + " is missing");
    return found;
  }
  /// Requires: this object outlives it.
  [[nodiscard]] Place place_of(std::string_view key) const { return {&place_, key, std::nullopt}; }

  void read(std::string_view key, std::string& out) const {
    const Json* json = find(key);
    if (json == nullptr) return;
    if (json->is_string()) {
      out = json->get<std::string>();
    } else {
      faults_.add(place_of(key), "must be a string");
    }
  }
  void read(std::string_view key, bool& out) const {
    const Json* json = find(key);
    if (json == nullptr) return;
    if (json->is_boolean()) {
      out = json->get<bool>();
    } else {
      faults_.add(place_of(key), "must be true or false");
    }
  }
  void read(std::string_view key, double& out) const {
    const Json* json = find(key);
    if (json != nullptr) out = number(*json, place_of(key));
  }
  void read(std::string_view key, DVec3& out) const {
    const Json* json = find(key);
    if (json != nullptr) out = triple(*json, place_of(key));
  }
  [[nodiscard]] std::vector<double> numbers(const Json& json, const Place& place, std::size_t count) const {
    std::vector<double> values(count, 0.0);
    if (!json.is_array() || json.size() != count) {
      faults_.add(place, "must be a list of " + std::to_string(count) + " numbers");
      return values;
    }
    for (std::size_t i = 0; i < count; ++i) values[i] = number(json[i], {&place, {}, i});
    return values;
  }
  [[nodiscard]] DVec3 triple(const Json& json, const Place& place) const {
    const std::vector<double> v = numbers(json, place, 3);
    return {v[0], v[1], v[2]};
  }
  Faults& faults() const { return faults_; }

 private:
  [[nodiscard]] double number(const Json& json, const Place& place) const {
    if (!json.is_number()) {
      faults_.add(place, "must be a number");
      return 0.0;
    }
    const auto value = json.get<double>();
    if (!std::isfinite(value)) faults_.add(place, "is too large");
    return value;
  }

  const Json& json_;
  const Place& place_;
  Faults& faults_;
};

// A vector made unit; scaled first, since the square of a very small or large number is 0 or infinite.
std::vector<double> unit(std::vector<double> v, const Place& place, Faults& faults) {
  double largest = 0.0;
  for (const double x : v) largest = std::max(largest, std::abs(x));
  if (!(largest > 0.0)) {
    faults.add(place, "must not be all 0");
    return v;
  }
  double squared = 0.0;
  for (double& x : v) squared += (x / largest) * (x / largest);
  for (double& x : v) x = x / largest / std::sqrt(squared);
  return v;
}

DQuat rotation_of(const Object& instance, const Json& json) {
  const Place place = instance.place_of("rotation");
  Faults& faults = instance.faults();
  if (json.is_array()) {
    const std::vector<double> q = unit(instance.numbers(json, place, 4), place, faults);
    return {q[3], q[0], q[1], q[2]};
  }
  if (!json.is_object()) {
    faults.add(place, "must be a quaternion [x, y, z, w] or an axis with degrees");
    return {1.0, 0.0, 0.0, 0.0};
  }
  const Object turn(json, place, {"axis", "degrees"}, faults);
  double degrees = 0.0;
  const Json* axis = turn.need("axis");
  if (turn.need("degrees") == nullptr || axis == nullptr) return {1.0, 0.0, 0.0, 0.0};
  turn.read("degrees", degrees);
  const std::vector<double> a = unit(turn.numbers(*axis, turn.place_of("axis"), 3), turn.place_of("axis"), faults);
  const double half = std::fmod(degrees, 720.0) * std::numbers::pi / 360.0;
  return {std::cos(half), a[0] * std::sin(half), a[1] * std::sin(half), a[2] * std::sin(half)};
}

SceneFile::Placement placement_of(const Json& json, const Place& place, Faults& faults) {
  const Object instance(json, place, {"file", "name", "position", "rotation", "scale", "mirrored", "visible"}, faults);
  SceneFile::Placement placement;
  if (instance.need("file") != nullptr) instance.read("file", placement.source);
  instance.read("name", placement.name);
  instance.read("position", placement.position);
  instance.read("scale", placement.scale);
  instance.read("mirrored", placement.mirrored);
  instance.read("visible", placement.visible);
  if (const Json* rotation = instance.find("rotation")) placement.rotation = rotation_of(instance, *rotation);
  if (!(placement.scale > 0.0)) faults.add(instance.place_of("scale"), "must be more than 0");
  return placement;
}

SceneFile::Source source_of(const Json& json, const Place& place, Faults& faults) {
  const Object object(json, place, {"id", "path"}, faults);
  SceneFile::Source source;
  if (object.need("id") != nullptr) object.read("id", source.id);
  if (object.need("path") != nullptr) object.read("path", source.file);
  if (source.file.empty() || source.file.find('\0') != std::string::npos) {
    faults.add(object.place_of("path"), "must name a file");
  }
  return source;
}

Camera camera_of(const Json& json, Faults& faults) {
  const Place place{nullptr, "camera", std::nullopt};
  const Object object(json, place, {"position", "look_at", "fov"}, faults);
  DVec3 position(0.0);
  DVec3 target(0.0);
  double fov = 50.0;
  if (object.need("position") != nullptr) object.read("position", position);
  if (object.need("look_at") != nullptr) object.read("look_at", target);
  object.read("fov", fov);
  const auto camera = look_at(position, target, fov * std::numbers::pi / 180.0);
  if (!camera) faults.add(place, camera.error().message);
  return camera.value_or(Camera{});
}

// Calls `read(element, place)` for each element of a list.
template <class Read>
void read_list(const Object& file, std::string_view key, std::size_t most, Read read) {
  const Json* list = file.need(key);
  const Place place = file.place_of(key);
  if (list == nullptr) return;
  if (!list->is_array()) {
    file.faults().add(place, "must be a list");
    return;
  }
  if (list->size() > most) {
    file.faults().add(place, "more than " + std::to_string(most) + " entries", ErrorCode::LimitExceeded);
    return;
  }
  for (std::size_t i = 0; i < list->size() && !file.faults().error(); ++i) {
    read((*list)[i], {&place, {}, i});
  }
}

// Sources' ids differ, and placements name one of them.
void check_ids(const SceneFile& scene, Faults& faults) {
  std::set<std::string_view> ids;
  const auto add = [&](std::string_view list, std::size_t i, std::string_view key, const std::string& what) {
    const Place whole{nullptr, list, std::nullopt};
    const Place entry{&whole, {}, i};
    faults.add({&entry, key, std::nullopt}, what);
  };
  for (std::size_t i = 0; i < scene.sources.size(); ++i) {
    if (!ids.insert(scene.sources[i].id).second) {
      add("files", i, "id", excerpt(scene.sources[i].id) + " was given before");
    }
  }
  for (std::size_t i = 0; i < scene.placements.size(); ++i) {
    if (!ids.contains(scene.placements[i].source)) {
      add("instances", i, "file", "no file has the id " + excerpt(scene.placements[i].source));
    }
  }
}

void read_file_object(const Json& json, SceneFile& scene, Faults& faults) {
  const Place root;
  const Object file(json, root, {"quoin_scene", "files", "instances", "sun", "camera"}, faults);
  const Json* version = file.need("quoin_scene");
  if (version != nullptr && !version->is_number_unsigned())
    faults.add(file.place_of("quoin_scene"), "must be a version, a whole number");
  if (version != nullptr && version->is_number_unsigned() && *version != kVersion) {
    faults.add(file.place_of("quoin_scene"), "version " + version->dump() + " is not known; 1 is",
               ErrorCode::Unsupported);
  }
  read_list(file, "files", kMaxFiles,
            [&](const Json& each, const Place& place) { scene.sources.push_back(source_of(each, place, faults)); });
  read_list(file, "instances", kMaxInstances, [&](const Json& each, const Place& place) {
    scene.placements.push_back(placement_of(each, place, faults));
  });
  if (const Json* sun = file.find("sun")) {
    const std::vector<double> v = unit(file.numbers(*sun, file.place_of("sun"), 3), file.place_of("sun"), faults);
    scene.sun = DVec3(v[0], v[1], v[2]);
  }
  if (const Json* camera = file.find("camera")) scene.camera = camera_of(*camera, faults);
  if (!faults.error()) check_ids(scene, faults);
}

// Brackets outside of strings, so that nesting is known before anything is built.
int depth_of(std::string_view text) {
  int depth = 0;
  int deepest = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      deepest = std::max(deepest, ++depth);
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return deepest;
}

}  // namespace

Result<SceneFile> parse_scene_file(std::span<const std::byte> text) {
  if (text.size() > kMaxBytes) return make_error(ErrorCode::LimitExceeded, "a scene file of more than 64 MiB");
  const std::string_view chars(reinterpret_cast<const char*>(text.data()), text.size());
  if (depth_of(chars) > kMaxDepth) {
    return make_error(ErrorCode::LimitExceeded, "nested more than " + std::to_string(kMaxDepth) + " levels deep");
  }
  SceneFile scene;
  Faults faults;
  try {
    read_file_object(Json::parse(chars), scene, faults);
  } catch (const Json::parse_error& error) {
    return make_error(ErrorCode::BadFormat, "not valid JSON", {}, error.byte == 0 ? 0 : error.byte - 1);
  } catch (const Json::exception&) {
    return make_error(ErrorCode::BadFormat, "a number too large for any computer");
  }
  if (faults.error()) return *faults.error();
  return scene;
}

bool is_scene_file(std::span<const std::byte> beginning) {
  const std::string_view text(reinterpret_cast<const char*>(beginning.data()),
                              std::min<std::size_t>(beginning.size(), 4096));
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '{' &&
         text.find("\"quoin_scene\"") != std::string_view::npos;
}

}  // namespace quoin
