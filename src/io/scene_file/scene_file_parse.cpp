#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <set>

#include <glm/geometric.hpp>
#include <quoin/io/scene_file.h>

#include "io/scene_file/grids_parse.h"
#include "io/scene_file/json_reader.h"
#include "io/scene_file/voxel_data.h"
#include "io/whole_file.h"

namespace quoin {

namespace {

using namespace scene_json;

// Outside of strings, where every byte may become a value of some tens of bytes.
constexpr std::size_t kMaxBytes = std::size_t{64} << 20;
constexpr int kMaxDepth = 32;
constexpr std::size_t kMaxFiles = 65'536;
constexpr std::size_t kMaxInstances = std::size_t{1} << 22;
constexpr int kVersion = 5;

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

// A quaternion as it is: of a grid's instance, which may have any length.
DQuat kept_rotation(const Object& instance, const Json& json) {
  if (!json.is_array()) return rotation_of(instance, json);
  const std::vector<double> q = instance.numbers(json, instance.place_of("rotation"), 4);
  return {q[3], q[0], q[1], q[2]};
}

// A place in another list; whether there is one is known once all is read.
std::optional<std::size_t> place_in(const Object& object, std::string_view key, std::string_view list) {
  const Json* json = object.find(key);
  if (json == nullptr) return std::nullopt;
  if (json->is_number_unsigned()) return json->get<std::size_t>();
  object.faults().add(object.place_of(key), "must be a place in the list of " + std::string(list) + ", from 0");
  return 0;
}

// Bits of 32.
std::optional<std::uint32_t> bits_in(const Object& object, std::string_view key) {
  const Json* json = object.find(key);
  if (json == nullptr) return std::nullopt;
  if (json->is_number_unsigned() && json->get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max()) {
    return json->get<std::uint32_t>();
  }
  object.faults().add(object.place_of(key), "must be a whole number from 0 to 4294967295");
  return std::nullopt;
}

SceneFile::Placement placement_of(const Json& json, const Place& place, Faults& faults) {
  const Object instance(
      json, place,
      {"file", "grid", "name", "position", "rotation", "scale", "mirrored", "visible", "group", "layer", "categories"},
      faults);
  SceneFile::Placement placement;
  placement.grid = place_in(instance, "grid", "grids");
  if (!placement.grid && instance.need("file") != nullptr) {
    instance.read("file", placement.source);
  }
  instance.read_text("name", placement.name);
  instance.read("position", placement.position);
  instance.read("scale", placement.scale);
  instance.read("mirrored", placement.mirrored);
  instance.read("visible", placement.visible);
  placement.categories = bits_in(instance, "categories");
  if (const Json* rotation = instance.find("rotation")) {
    placement.rotation = placement.grid ? kept_rotation(instance, *rotation) : rotation_of(instance, *rotation);
  }
  if (!(placement.scale > 0.0)) faults.add(instance.place_of("scale"), "must be more than 0");
  placement.group = place_in(instance, "group", "groups");
  placement.layer = place_in(instance, "layer", "layers");
  return placement;
}

Lamp lamp_of(const Json& json, const Place& place, Faults& faults) {
  const Object object(
      json, place,
      {"kind", "name", "position", "direction", "colour", "intensity", "range", "inner_angle", "outer_angle"}, faults);
  Lamp lamp;
  std::string kind = "point";
  object.read("kind", kind);
  if (kind == "spot") {
    lamp.kind = Lamp::Kind::Spot;
  } else if (kind != "point") {
    faults.add(object.place_of("kind"), "must be point or spot");
  }
  object.read_text("name", lamp.name);
  if (object.need("position") != nullptr) object.read("position", lamp.position);
  object.read("direction", lamp.direction);
  if (const Json* colour = object.find("colour")) {
    const std::vector<double> v = object.numbers(*colour, object.place_of("colour"), 3);
    lamp.colour = Vec3(v[0], v[1], v[2]);
    if (!is_finite(DVec3(lamp.colour))) faults.add(object.place_of("colour"), "is too large");
  }
  object.read("intensity", lamp.intensity);
  object.read("range", lamp.range);
  object.read("inner_angle", lamp.inner_angle_radians);
  object.read("outer_angle", lamp.outer_angle_radians);
  return lamp;
}

SceneFile::Group group_of(const Json& json, const Place& place, Faults& faults) {
  const Object object(json, place, {"name", "parent", "layer", "position", "rotation", "mirrored", "visible"}, faults);
  SceneFile::Group group;
  object.read_text("name", group.name);
  group.parent = place_in(object, "parent", "groups");
  group.layer = place_in(object, "layer", "layers");
  object.read("position", group.position);
  if (const Json* rotation = object.find("rotation")) group.rotation = kept_rotation(object, *rotation);
  object.read("mirrored", group.mirrored);
  object.read("visible", group.visible);
  return group;
}

SceneLayer layer_of(const Json& json, const Place& place, Faults& faults) {
  const Object object(json, place, {"name", "visible"}, faults);
  SceneLayer layer;
  object.read_text("name", layer.name);
  object.read("visible", layer.visible);
  return layer;
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

/// Whether axes are unit, perpendicular and right-handed, to the rounding of sums of them.
bool is_frame(const Camera& camera) {
  constexpr double kRounding = 1e-6;
  const auto is_near = [](DVec3 a, DVec3 b) { return glm::distance(a, b) <= kRounding; };
  return std::abs(glm::length(camera.forward) - 1.0) <= kRounding &&
         std::abs(glm::length(camera.up) - 1.0) <= kRounding &&
         is_near(glm::cross(camera.forward, camera.up), camera.right);
}

/// A camera of any kind, number by number.
Camera kept_camera(const Json& json, const Place& place, Faults& faults) {
  const Object object(json, place, {"position", "right", "up", "forward", "fov_radians", "view_height"}, faults);
  Camera camera;
  for (const char* key : {"position", "right", "up"}) static_cast<void>(object.need(key));
  object.read("position", camera.position);
  object.read("right", camera.right);
  object.read("up", camera.up);
  object.read("forward", camera.forward);
  object.read("fov_radians", camera.vertical_fov_radians);
  object.read("view_height", camera.view_height);
  const bool is_flat = object.find("view_height") != nullptr;
  if (is_flat == (object.find("fov_radians") != nullptr)) faults.add(place, "needs fov_radians or view_height");
  if (is_flat) camera.projection = Camera::Projection::Orthographic;
  if (!is_frame(camera)) faults.add(place, "right, up and forward must be unit and perpendicular");
  if (!(camera.vertical_fov_radians > 0.0 && camera.vertical_fov_radians < std::numbers::pi)) {
    faults.add(object.place_of("fov_radians"), "must be more than 0 and less than pi");
  }
  if (!(camera.view_height > 0.0)) faults.add(object.place_of("view_height"), "must be more than 0");
  return camera;
}

Camera camera_of(const Json& json, Faults& faults) {
  const Place place{nullptr, "camera", std::nullopt};
  if (json.is_object() && json.contains("forward")) return kept_camera(json, place, faults);
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

// Faults of what names entries of other lists.
class NameCheck {
 public:
  NameCheck(const SceneFile& scene, Faults& faults) : scene_(scene), faults_(faults) {}

  // Sources' ids differ, and placements name one of them; groups and layers are there.
  void check() {
    for (std::size_t i = 0; i < scene_.sources.size(); ++i) {
      if (!ids_.insert(scene_.sources[i].id).second) {
        add("files", i, "id", excerpt(scene_.sources[i].id) + " was given before");
      }
    }
    for (std::size_t i = 0; i < scene_.groups.size(); ++i) {
      const SceneFile::Group& group = scene_.groups[i];
      if (group.parent && *group.parent >= i) {
        add("groups", i, "parent", "there is no group " + std::to_string(*group.parent) + " before it");
      }
      check_layer("groups", i, group.layer);
    }
    for (std::size_t i = 0; i < scene_.placements.size(); ++i) check_placement(i, scene_.placements[i]);
  }

 private:
  void check_placement(std::size_t i, const SceneFile::Placement& placement) {
    if (const auto& grid = placement.grid) {
      if (*grid >= scene_.grids.size()) add("instances", i, "grid", "there is no grid " + std::to_string(*grid));
    } else if (!ids_.contains(placement.source)) {
      add("instances", i, "file", "no file has the id " + excerpt(placement.source));
    }
    if (placement.group && *placement.group >= scene_.groups.size()) {
      add("instances", i, "group", "there is no group " + std::to_string(*placement.group));
    }
    check_layer("instances", i, placement.layer);
  }
  void check_layer(std::string_view list, std::size_t i, const std::optional<std::size_t>& layer) {
    if (layer && *layer >= scene_.layers.size()) add(list, i, "layer", "there is no layer " + std::to_string(*layer));
  }
  void add(std::string_view list, std::size_t i, std::string_view key, const std::string& what) {
    const Place whole{nullptr, list, std::nullopt};
    const Place entry{&whole, {}, i};
    faults_.add({&entry, key, std::nullopt}, what);
  }

  const SceneFile& scene_;
  Faults& faults_;
  std::set<std::string_view> ids_;
};

void read_file_object(const Json& json, std::size_t file_bytes, Threads threads, SceneFile& scene, Faults& faults) {
  const Place root;
  const Object file(
      json, root, {"quoin_scene", "types", "grids", "files", "layers", "groups", "instances", "lamps", "sun", "camera"},
      faults);
  const Json* version = file.need("quoin_scene");
  if (version != nullptr && !version->is_number_unsigned())
    faults.add(file.place_of("quoin_scene"), "must be a version, a whole number");
  if (version != nullptr && version->is_number_unsigned() && (*version < 1 || *version > kVersion)) {
    faults.add(file.place_of("quoin_scene"), "version " + version->dump() + " is not known; 1 to 5 are",
               ErrorCode::Unsupported);
  }
  scene.types = read_types(file);
  scene.grids = read_grids(file, scene.types, file_bytes, threads);
  if (file.find("grids") == nullptr || file.find("files") != nullptr) {
    read_list(file, "files", kMaxFiles,
              [&](const Json& each, const Place& place) { scene.sources.push_back(source_of(each, place, faults)); });
  }
  if (file.find("layers") != nullptr) {
    read_list(file, "layers", kMaxInstances,
              [&](const Json& each, const Place& place) { scene.layers.push_back(layer_of(each, place, faults)); });
  }
  if (file.find("groups") != nullptr) {
    read_list(file, "groups", kMaxInstances,
              [&](const Json& each, const Place& place) { scene.groups.push_back(group_of(each, place, faults)); });
  }
  read_list(file, "instances", kMaxInstances, [&](const Json& each, const Place& place) {
    scene.placements.push_back(placement_of(each, place, faults));
  });
  if (file.find("lamps") != nullptr) {
    read_list(file, "lamps", kMaxInstances,
              [&](const Json& each, const Place& place) { scene.lamps.push_back(lamp_of(each, place, faults)); });
  }
  if (const Json* sun = file.find("sun")) {
    const std::vector<double> v = unit(file.numbers(*sun, file.place_of("sun"), 3), file.place_of("sun"), faults);
    scene.sun = DVec3(v[0], v[1], v[2]);
  }
  if (const Json* camera = file.find("camera")) scene.camera = camera_of(*camera, faults);
  if (!faults.error()) NameCheck(scene, faults).check();
}

/// What a text has outside of its strings.
struct Outside {
  int deepest = 0;        ///< brackets within each other
  std::size_t bytes = 0;  ///< and strings, each as one
};

// So that what it would take is known before anything is built.
Outside outside_strings(std::string_view text) {
  int depth = 0;
  int deepest = 0;
  std::size_t bytes = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    bytes += in_string ? 0 : 1;
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
  return {deepest, bytes};
}

}  // namespace

Result<SceneFile> parse_scene_file(std::span<const std::byte> text, Threads threads) {
  if (text.size() > kMaxSceneFileBytes) {
    return make_error(ErrorCode::LimitExceeded, "a scene file of more than 2 GiB");
  }
  const std::string_view chars(reinterpret_cast<const char*>(text.data()), text.size());
  const Outside outside = outside_strings(chars);
  if (outside.bytes > kMaxBytes) {
    return make_error(ErrorCode::LimitExceeded, "a scene file of more than 64 MiB, not counting what is in strings");
  }
  if (outside.deepest > kMaxDepth) {
    return make_error(ErrorCode::LimitExceeded, "nested more than " + std::to_string(kMaxDepth) + " levels deep");
  }
  SceneFile scene;
  Faults faults;
  try {
    read_file_object(Json::parse(chars), chars.size(), threads, scene, faults);
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

Result<SceneFile> parse_scene_file(const std::filesystem::path& path, Threads threads) {
  return read_whole(path, [&](std::span<const std::byte> text) { return parse_scene_file(text, threads); });
}

}  // namespace quoin
