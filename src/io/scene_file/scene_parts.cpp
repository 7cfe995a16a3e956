#include "io/scene_file/scene_parts.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <span>
#include <type_traits>
#include <utility>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "core/bytes/text.h"

namespace quoin::scene_json {

bool is_same(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

namespace {

bool is_same(DVec3 a, DVec3 b) {
  return scene_json::is_same(a.x, b.x) && scene_json::is_same(a.y, b.y) && scene_json::is_same(a.z, b.z);
}
bool is_same(const DQuat& a, const DQuat& b) {
  return scene_json::is_same(a.w, b.w) && scene_json::is_same(a.x, b.x) && scene_json::is_same(a.y, b.y) &&
         scene_json::is_same(a.z, b.z);
}

// Writes the position and rotation of an instance or a group, unless they are the defaults.
template <class Placed>
void put_frame(const Placed& placed, OrderedJson& json) {
  const Placed plain;
  if (!is_same(placed.position, plain.position)) json["position"] = triple(placed.position);
  const DQuat& q = placed.rotation;
  if (!is_same(q, plain.rotation)) json["rotation"] = {q.x, q.y, q.z, q.w};
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

// Reads a quaternion unchanged: that of a grid instance may have any length.
DQuat kept_rotation(const Object& instance, const Json& json) {
  if (!json.is_array()) return rotation_of(instance, json);
  const std::vector<double> q = instance.numbers(json, instance.place_of("rotation"), 4);
  return {q[3], q[0], q[1], q[2]};
}

// Reads an index into another list. Whether the entry exists is checked once everything is read.
std::optional<std::size_t> place_in(const Object& object, std::string_view key, std::string_view list) {
  const Json* json = object.find(key);
  if (json == nullptr) return std::nullopt;
  if (json->is_number_unsigned()) return json->get<std::size_t>();
  object.faults().add(object.place_of(key), "must be an index into " + std::string(list) + ", from 0");
  return 0;
}

/// Returns true if the axes are unit, perpendicular and right-handed, up to rounding.
bool is_frame(const Camera& camera) {
  constexpr double kRounding = 1e-6;
  const auto is_near = [](DVec3 a, DVec3 b) { return glm::distance(a, b) <= kRounding; };
  return std::abs(glm::length(camera.forward) - 1.0) <= kRounding &&
         std::abs(glm::length(camera.up) - 1.0) <= kRounding &&
         is_near(glm::cross(camera.forward, camera.up), camera.right);
}

/// Reads a camera of any kind, number by number.
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

// ---- environments ------------------------------------------------------------------------------------------------

constexpr std::array<std::pair<const char*, SkyModel>, 5> kSkies = {{{"fixed", SkyModel::Fixed},
                                                                     {"gradient", SkyModel::Gradient},
                                                                     {"physical", SkyModel::Physical},
                                                                     {"uniform", SkyModel::Uniform},
                                                                     {"image", SkyModel::Image}}};
constexpr std::array<std::pair<const char*, ToneCurve>, 4> kTones = {
    {{"clamp", ToneCurve::Clamp}, {"neutral", ToneCurve::Neutral}, {"agx", ToneCurve::Agx}, {"aces", ToneCurve::Aces}}};

// ---- writing settings

OrderedJson json_of_value(double value) {
  return value;
}
OrderedJson json_of_value(bool value) {
  return value;
}
OrderedJson json_of_value(Vec3 value) {
  return triple(value);
}
OrderedJson json_of_value(DVec3 value) {
  return triple(value);
}
OrderedJson json_of_value(SkyModel value) {
  return name_of(kSkies, value);
}
OrderedJson json_of_value(ToneCurve value) {
  return name_of(kTones, value);
}

template <class T>
bool is_usual(const T& value, const T& usual) {
  return value == usual;
}
// NaN is never usual: a part without a number is written, and reading it back fails.
bool is_usual(double value, double usual) {
  return !std::isnan(value) && scene_json::is_same(value, usual);
}
bool is_usual(Vec3 value, Vec3 usual) {
  return is_same(DVec3(value), DVec3(usual));
}
bool is_usual(DVec3 value, DVec3 usual) {
  return is_same(value, usual);
}

// Returns the usual settings of an optional part. A setting with NaN is always written.
template <class Part>
Part usual_part() {
  return {};
}
template <>
GroundPlane usual_part() {
  return {.height = std::numeric_limits<double>::quiet_NaN()};
}
template <>
Fog usual_part() {
  Fog fog;
  fog.density = fog.top = std::numeric_limits<double>::quiet_NaN();
  return fog;
}

// Writes the settings of an environment that differ from the usual ones.
class SettingsWriter {
 public:
  using WriteText = std::function<OrderedJson(const std::string&)>;
  explicit SettingsWriter(WriteText write_text) : write_text_(std::move(write_text)) {}

  template <EnvironmentPart Part>
  [[nodiscard]] OrderedJson json_of(const Part& part, const Part& usual) const {
    OrderedJson json = OrderedJson::object();
    visit_settings(std::type_identity<Part>{}, [&](const char* key, auto member, const SettingRange& /*range*/ = {}) {
      put(json, key, part.*member, usual.*member);
    });
    return json;
  }

 private:
  template <class T>
  void put(OrderedJson& json, const char* key, const T& value, const T& usual) const {
    if constexpr (EnvironmentPart<T>) {
      if (OrderedJson part = json_of(value, usual); !part.empty()) json[key] = std::move(part);
    } else {
      if (!is_usual(value, usual)) json[key] = json_of_value(value);
    }
  }
  void put(OrderedJson& json, const char* key, const std::string& value, const std::string& usual) const {
    if (value != usual) json[key] = write_text_(value);
  }
  template <class T>
  void put(OrderedJson& json, const char* key, const std::optional<T>& value, const std::optional<T>& /*usual*/) const {
    if (!value) return;
    if constexpr (EnvironmentPart<T>) {
      json[key] = json_of(*value, usual_part<T>());
    } else {
      json[key] = json_of_value(*value);
    }
  }

  WriteText write_text_;
};

// ---- reading settings

template <EnvironmentPart Part>
void read_settings(const Json& json, const Place& place, Faults& faults, Part& part);

template <class T>
void read_setting(const Object& object, const char* key, T& out) {
  if constexpr (EnvironmentPart<T>) {
    if (const Json* part = object.find(key)) read_settings(*part, object.place_of(key), object.faults(), out);
  } else {
    object.read(key, out);
  }
}
void read_setting(const Object& object, const char* key, Vec3& out) {
  DVec3 colour(out);
  object.read(key, colour);
  out = Vec3(colour);
}
void read_setting(const Object& object, const char* key, SkyModel& out) {
  read_name(object, key, kSkies, out);
}
void read_setting(const Object& object, const char* key, ToneCurve& out) {
  read_name(object, key, kTones, out);
}
void read_setting(const Object& object, const char* key, std::string& out) {
  object.read_text(key, out);
}
template <class T>
void read_setting(const Object& object, const char* key, std::optional<T>& out) {
  if (object.find(key) != nullptr) read_setting(object, key, out.emplace());
}

template <EnvironmentPart Part>
void read_settings(const Json& json, const Place& place, Faults& faults, Part& part) {
  std::vector<std::string_view> keys;
  visit_settings(std::type_identity<Part>{},
                 [&](const char* key, auto /*member*/, const SettingRange& /*range*/ = {}) { keys.emplace_back(key); });
  const Object object(json, place, keys, faults);
  visit_settings(std::type_identity<Part>{}, [&](const char* key, auto member, const SettingRange& /*range*/ = {}) {
    read_setting(object, key, part.*member);
  });
}

}  // namespace

OrderedJson PartWriter::json_of(const SceneGrid& grid) {
  OrderedJson json = OrderedJson::object();
  if (!grid.name.empty()) json["name"] = text(grid.name);
  if (!is_same(grid.pivot, DVec3(0.0))) json["pivot"] = triple(grid.pivot);
  const IBox& canvas = grid.canvas;
  if (canvas != IBox{}) {
    json["canvas"] = {canvas.min.x, canvas.min.y, canvas.min.z, canvas.max.x, canvas.max.y, canvas.max.z};
  }
  return json;
}

OrderedJson PartWriter::json_of(const SceneFile::Placement& placement) {
  const Instance& instance = placement.instance;
  const Instance plain;
  OrderedJson json = placement.grid ? OrderedJson{{"grid", *placement.grid}} : OrderedJson{{"file", placement.source}};
  if (!instance.name.empty()) json["name"] = text(instance.name);
  put_frame(instance, json);
  if (!is_same(instance.voxel_size, plain.voxel_size)) json["scale"] = instance.voxel_size;
  if (instance.mirrored) json["mirrored"] = true;
  if (!instance.visible) json["visible"] = false;
  if (placement.group) json["group"] = *placement.group;
  if (placement.layer) json["layer"] = *placement.layer;
  const bool has_categories = placement.grid ? instance.categories != plain.categories : placement.sets_categories;
  if (has_categories) json["categories"] = instance.categories;
  return json;
}

OrderedJson PartWriter::json_of(const SceneFile::Group& entry) {
  const SceneGroup& group = entry.group;
  OrderedJson json = OrderedJson::object();
  if (!group.name.empty()) json["name"] = text(group.name);
  if (entry.parent) json["parent"] = *entry.parent;
  if (entry.layer) json["layer"] = *entry.layer;
  put_frame(group, json);
  if (group.mirrored) json["mirrored"] = true;
  if (!group.visible) json["visible"] = false;
  return json;
}

OrderedJson PartWriter::json_of(const SceneLayer& layer) {
  OrderedJson json = OrderedJson::object();
  if (!layer.name.empty()) json["name"] = text(layer.name);
  if (!layer.visible) json["visible"] = false;
  return json;
}

OrderedJson PartWriter::json_of(const Lamp& lamp) {
  const Lamp plain;
  const bool is_spot = lamp.kind == Lamp::Kind::Spot;
  OrderedJson json = {{"kind", is_spot ? "spot" : "point"}};
  if (!lamp.name.empty()) json["name"] = text(lamp.name);
  json["position"] = triple(lamp.position);
  json["colour"] = {lamp.colour.x, lamp.colour.y, lamp.colour.z};
  json["intensity"] = lamp.intensity;
  const auto put = [&](const char* key, double value, double usual) {
    if (!is_same(value, usual)) json[key] = value;
  };
  put("range", lamp.range, plain.range);
  if (!is_same(lamp.direction, plain.direction)) json["direction"] = triple(lamp.direction);
  put("inner_angle", lamp.inner_angle_radians, plain.inner_angle_radians);
  put("outer_angle", lamp.outer_angle_radians, plain.outer_angle_radians);
  return json;
}

// An upright perspective camera is stored as a point to look at and an angle in degrees if these restore it bit for
// bit; any other camera is stored by its axes.
OrderedJson PartWriter::json_of(const Camera& camera) {
  // Far enough that rounding the sum does not rotate it.
  const DVec3 reach = glm::abs(camera.position);
  const DVec3 target = camera.position + camera.forward * std::max({1.0, reach.x, reach.y, reach.z});
  const double degrees = camera.vertical_fov_radians * 180.0 / std::numbers::pi;
  const auto again = look_at(camera.position, target, degrees * std::numbers::pi / 180.0);
  const bool is_flat = camera.projection == Camera::Projection::Orthographic;
  if (!is_flat && again && is_same(again->forward, camera.forward) && is_same(again->up, camera.up) &&
      is_same(again->right, camera.right) && is_same(again->vertical_fov_radians, camera.vertical_fov_radians)) {
    return {{"position", triple(camera.position)}, {"look_at", triple(target)}, {"fov", degrees}};
  }
  needs_second_ = true;
  OrderedJson json = {{"position", triple(camera.position)},
                      {"right", triple(camera.right)},
                      {"up", triple(camera.up)},
                      {"forward", triple(camera.forward)}};
  json[is_flat ? "view_height" : "fov_radians"] = is_flat ? camera.view_height : camera.vertical_fov_radians;
  return json;
}

OrderedJson PartWriter::json_of(const Environment& environment) {
  const SettingsWriter writer([this](const std::string& bytes) { return text(bytes); });
  return writer.json_of(environment, Environment::natural());
}

SceneFile::Placement placement_of(const Json& json, const Place& place, Faults& faults) {
  const Object object(
      json, place,
      {"file", "grid", "name", "position", "rotation", "scale", "mirrored", "visible", "group", "layer", "categories"},
      faults);
  SceneFile::Placement placement;
  Instance& instance = placement.instance;
  placement.grid = place_in(object, "grid", "grids");
  if (!placement.grid && object.need("file") != nullptr) {
    object.read("file", placement.source);
  }
  object.read_text("name", instance.name);
  object.read("position", instance.position);
  object.read("scale", instance.voxel_size);
  object.read("mirrored", instance.mirrored);
  object.read("visible", instance.visible);
  const auto categories = bits_in(object, "categories");
  placement.sets_categories = categories.has_value();
  instance.categories = categories.value_or(instance.categories);
  if (const Json* rotation = object.find("rotation")) {
    instance.rotation = placement.grid ? kept_rotation(object, *rotation) : rotation_of(object, *rotation);
  }
  if (!(instance.voxel_size > 0.0)) faults.add(object.place_of("scale"), "must be more than 0");
  placement.group = place_in(object, "group", "groups");
  placement.layer = place_in(object, "layer", "layers");
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
  SceneFile::Group entry;
  SceneGroup& group = entry.group;
  object.read_text("name", group.name);
  entry.parent = place_in(object, "parent", "groups");
  entry.layer = place_in(object, "layer", "layers");
  object.read("position", group.position);
  if (const Json* rotation = object.find("rotation")) group.rotation = kept_rotation(object, *rotation);
  object.read("mirrored", group.mirrored);
  object.read("visible", group.visible);
  return entry;
}

SceneLayer layer_of(const Json& json, const Place& place, Faults& faults) {
  const Object object(json, place, {"name", "visible"}, faults);
  SceneLayer layer;
  object.read_text("name", layer.name);
  object.read("visible", layer.visible);
  return layer;
}

Camera camera_of(const Json& json, const Place& place, Faults& faults) {
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

Environment environment_from(const Json& json, const Place& place, Faults& faults) {
  Environment environment = Environment::natural();
  read_settings(json, place, faults, environment);
  if (const Status valid = check(environment); !valid && !faults.error()) faults.add(place, valid.error().message);
  return environment;
}

namespace {

// Written before main only.
constinit SkyReader sky_reader = nullptr;

Result<RadianceImage> read_image(const std::filesystem::path& path) {
  if (sky_reader != nullptr) return sky_reader(path);
  return make_error(ErrorCode::Unsupported, "the program is linked without quoin::quoin, which reads images");
}

}  // namespace

bool register_sky_reader(SkyReader reader) {
  sky_reader = reader;
  return true;
}

std::string read_sky_image(const std::filesystem::path& from, const LoadOptions& options, Sky& sky) {
  if (!options.sky_image || !lacks_image(sky)) return "";
  std::string reason = "load the scene by path, not from bytes";
  if (!from.empty()) {
    const auto path = sidecar_path(from, sky.image_file, options.sidecar_files);
    auto image = path ? read_image(*path) : Result<RadianceImage>(path.error());
    if (image) {
      sky.image = std::make_shared<const RadianceImage>(std::move(*image));
      return "";
    }
    reason = image.error().message;
  }
  return "left out: the image of the sky \"" + printable(sky.image_file) + "\": " + reason;
}

void read_grid_header(const Object& object, SceneGrid& grid) {
  constexpr int kLeast = std::numeric_limits<int>::min();
  constexpr int kMost = std::numeric_limits<int>::max();
  object.read_text("name", grid.name);
  object.read("pivot", grid.pivot);
  if (const Json* canvas = object.find("canvas")) {
    const std::vector<int> c = object.whole_numbers(*canvas, object.place_of("canvas"), 6, kLeast, kMost);
    grid.canvas = {{c[0], c[1], c[2]}, {c[3], c[4], c[5]}};
  }
}

void read_band(const Object& object, SceneGrid& grid) {
  double band = static_cast<double>(grid.field.band());
  object.read("band", band);
  constexpr double kGreatest = 65'504.0;
  if (band > 0.0 && band <= kGreatest) {
    grid.field = DensityGrid(static_cast<float>(band));
  } else {
    object.faults().add(object.place_of("band"), "must be more than 0 and at most 65504");
  }
}

}  // namespace quoin::scene_json
