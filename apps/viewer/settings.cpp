#include "settings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <span>

#include <nlohmann/json.hpp>

#include <quoin/io/file.h>

namespace quoin::viewer {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxRecent = 10;
constexpr std::size_t kMaxBytes = std::size_t{1} << 20;

const Json* find(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found == object.end() ? nullptr : &*found;
}

void read_flag(const Json& object, const char* key, bool& value) {
  const Json* found = find(object, key);
  if (found != nullptr && found->is_boolean()) value = found->get<bool>();
}

void read_number(const Json& object, const char* key, double least, double most, double& value) {
  const Json* found = find(object, key);
  if (found == nullptr || !found->is_number()) return;
  const auto number = found->get<double>();
  if (number >= least && number <= most) value = number;
}

void read_whole(const Json& object, const char* key, int least, int most, int& value) {
  double number = value;
  read_number(object, key, least, most, number);
  if (number == std::floor(number)) value = static_cast<int>(number);
}

void read_sun(const Json& object, DVec3& sun) {
  const Json* found = find(object, "sun");
  if (found == nullptr || !found->is_array() || found->size() != 3) return;
  DVec3 direction{0.0};
  for (int axis = 0; axis < 3; ++axis) {
    const Json& number = (*found)[static_cast<std::size_t>(axis)];
    if (!number.is_number()) return;
    direction[axis] = number.get<double>();
    if (!(std::abs(direction[axis]) <= 1e6)) return;
  }
  if (direction != DVec3{0.0}) sun = direction;
}

constexpr std::array kShadings = {"lit", "unlit", "unlit with occlusion", "occlusion", "normals"};
constexpr std::array kLightModels = {"rays", "propagated"};
constexpr std::array kOcclusionModes = {"off", "rays", "vertex", "smooth"};
constexpr std::array kForms = {"none", "share", "weighted", "weighted-published", "soft-share"};
constexpr std::array kModes = {"rays", "blocks", "smooth", "density", "paths"};
static_assert(kModes.size() == kDrawModes);
constexpr std::array kAxes = {"x", "y", "z"};

// Reads an enumerator by its name; `names` is in the order of the enumeration.
template <class Names, class Value>
void read_name(const Json& object, const char* key, const Names& names, Value& value) {
  const Json* found = find(object, key);
  if (found == nullptr || !found->is_string()) return;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (*found == names[i]) value = static_cast<Value>(i);
  }
}

void read_smooth_occlusion(const Json& object, SmoothOcclusionOptions& options) {
  const auto read = [&](const char* key, double least, double most, float& value) {
    double number = double{value};
    read_number(object, key, least, most, number);
    value = static_cast<float>(number);
  };
  read_name(object, "form", kForms, options.method);
  read("spread", 0.0625, 4.0, options.spread);
  read("offset", 0.0, 0.99, options.offset);
  read("power", 0.0625, 64.0, options.power);
}

void read_environment(const Json& object, Settings& settings) {
  Environment& environment = settings.environment;
  read_sun(object, environment.sun.direction);
  read_number(object, "exposure", 0.0, 100.0, settings.exposure);
  read_number(object, "sun_brightness", 0.0, 100.0, environment.sun.brightness);
  read_number(object, "sky_brightness", 0.0, 100.0, environment.sky.brightness);
  bool follows_sun = true;
  read_flag(object, "sky_follows_sun", follows_sun);
  environment.sky.model = follows_sun ? SkyModel::Gradient : SkyModel::Fixed;
  read_number(object, "lamp_brightness", 0.0, 1000.0, environment.lamp_brightness);
}

void read_light(const Json& object, LightOptions& light) {
  bool is_lit = true;
  read_flag(object, "lit", is_lit);  // written by earlier versions
  if (!is_lit) light.shading = Shading::Unlit;
  read_name(object, "shading", kShadings, light.shading);
  // Debug shadings are not restored, because the next start would look broken.
  if (light.shading == Shading::Occlusion || light.shading == Shading::Normals) light.shading = Shading::Lit;
  read_name(object, "model", kLightModels, light.model);
  read_number(object, "least_light", 0.0, 100.0, light.least_light);
  read_flag(object, "shadows", light.shadows);
  read_flag(object, "glass_surfaces", light.glass_surfaces);
  read_whole(object, "lamps", 0, 1024, light.max_lamps);
  bool has_occlusion = true;
  read_flag(object, "occlusion", has_occlusion);  // written by earlier versions
  if (!has_occlusion) light.occlusion_mode = OcclusionMode::Off;
  read_name(object, "occlusion", kOcclusionModes, light.occlusion_mode);
  if (const Json* smooth = find(object, "smooth_occlusion"); smooth != nullptr && smooth->is_object()) {
    read_smooth_occlusion(*smooth, light.smooth_occlusion);
  }
  read_number(object, "occlusion_distance", 0.0, 4096.0, light.occlusion_distance_voxels);
  read_number(object, "shadow_distance", 0.0, 4096.0, light.shadow_distance_voxels);
  bool is_all = light.occlusion_affects == OcclusionAffects::All;
  read_flag(object, "occlusion_darkens_all", is_all);
  light.occlusion_affects = is_all ? OcclusionAffects::All : OcclusionAffects::Ambient;
}

void read_recent(const Json& object, std::vector<std::string>& recent) {
  const Json* found = find(object, "recent");
  if (found == nullptr || !found->is_array()) return;
  for (const Json& file : *found) {
    if (file.is_string() && !file.get<std::string>().empty() && recent.size() < kMaxRecent) recent.push_back(file);
  }
}

std::string environment_variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

void Settings::note_recent(const std::filesystem::path& file) {
  std::error_code ignored;
  const std::string name = std::filesystem::absolute(file, ignored).lexically_normal().string();
  if (name.empty()) return;
  std::erase(recent, name);
  recent.insert(recent.begin(), name);
  if (recent.size() > kMaxRecent) recent.resize(kMaxRecent);
}

std::filesystem::path settings_path() {
  // The XDG specification ignores relative paths.
  const std::filesystem::path config = environment_variable("XDG_CONFIG_HOME");
  if (config.is_absolute()) return config / "quoin" / "viewer.json";
  const std::filesystem::path home = environment_variable("HOME");
  return home.is_absolute() ? home / ".config" / "quoin" / "viewer.json" : std::filesystem::path();
}

Settings parse_settings(std::string_view json) {
  Settings settings;
  const Json object = Json::parse(json, nullptr, false);
  if (!object.is_object()) return settings;
  read_whole(object, "width", 320, 16'384, settings.width);
  read_whole(object, "height", 240, 16'384, settings.height);
  read_flag(object, "panel", settings.is_panel_shown);
  bool is_fly = false;
  read_flag(object, "fly", is_fly);
  settings.camera_mode = is_fly ? CameraMode::Fly : CameraMode::Orbit;
  if (find(object, "ui_scale") != nullptr) read_number(object, "ui_scale", 0.5, 4.0, settings.ui_scale);
  read_whole(object, "samples", 1, 256, settings.samples);
  read_flag(object, "detail_by_pixels", settings.detail_by_pixels);
  read_name(object, "mode", kModes, settings.mode);
  if (const Json* slice = find(object, "slice"); slice != nullptr && slice->is_object()) {
    read_name(*slice, "axis", kAxes, settings.slice.axis);
    read_number(*slice, "at", 0.0, 1.0, settings.slice.at);
  }
  if (const Json* light = find(object, "light"); light != nullptr && light->is_object()) {
    read_light(*light, settings.light);
    read_environment(*light, settings);
  }
  read_recent(object, settings.recent);
  const Json* pack = find(object, "pack");
  if (pack != nullptr && pack->is_string() && !pack->get<std::string>().empty()) settings.pack = *pack;
  return settings;
}

std::string to_json(const Settings& settings) {
  const LightOptions& light = settings.light;
  const Environment& environment = settings.environment;
  const DVec3 sun = environment.sun.direction;
  Json object = {{"width", settings.width},
                 {"height", settings.height},
                 {"panel", settings.is_panel_shown},
                 {"fly", settings.camera_mode != CameraMode::Orbit},
                 {"samples", settings.samples},
                 {"detail_by_pixels", settings.detail_by_pixels},
                 {"mode", kModes[static_cast<std::size_t>(settings.mode)]},
                 {"slice", {{"axis", kAxes[static_cast<std::size_t>(settings.slice.axis)]}, {"at", settings.slice.at}}},
                 {"light",
                  {{"sun", {sun.x, sun.y, sun.z}},
                   {"shading", kShadings[static_cast<std::size_t>(light.shading)]},
                   {"model", kLightModels[static_cast<std::size_t>(light.model)]},
                   {"least_light", light.least_light},
                   {"shadows", light.shadows},
                   {"occlusion", kOcclusionModes[static_cast<std::size_t>(light.occlusion_mode)]},
                   {"smooth_occlusion",
                    {{"form", kForms[static_cast<std::size_t>(light.smooth_occlusion.method)]},
                     {"spread", light.smooth_occlusion.spread},
                     {"offset", light.smooth_occlusion.offset},
                     {"power", light.smooth_occlusion.power}}},
                   {"occlusion_distance", light.occlusion_distance_voxels},
                   {"occlusion_darkens_all", light.occlusion_affects == OcclusionAffects::All},
                   {"sun_brightness", environment.sun.brightness},
                   {"sky_brightness", environment.sky.brightness},
                   {"sky_follows_sun", environment.sky.model != SkyModel::Fixed},
                   {"glass_surfaces", light.glass_surfaces},
                   {"lamps", light.max_lamps},
                   {"lamp_brightness", environment.lamp_brightness},
                   {"exposure", settings.exposure}}},
                 {"recent", settings.recent},
                 {"pack", settings.pack}};
  if (std::isfinite(light.shadow_distance_voxels)) object["light"]["shadow_distance"] = light.shadow_distance_voxels;
  if (settings.ui_scale > 0.0) object["ui_scale"] = settings.ui_scale;
  return object.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Settings read_settings(const std::filesystem::path& path) {
  const auto bytes = read_file_beginning(path, kMaxBytes);
  if (!bytes) return {};
  return parse_settings({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
}

Status write_settings(const Settings& settings, const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  if (error) return make_error(ErrorCode::CannotWrite, "cannot create the folder: " + error.message(), path.string());
  const std::string text = to_json(settings);
  return write_file(std::as_bytes(std::span(text)), path);
}

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kDegreesPerPixel = 0.4;
constexpr double kLowest = 2.0;  // a sun at the horizon lights nothing from above
constexpr double kNight = -20.0;
constexpr double kHighest = 89.0;  // the azimuth is still defined

}  // namespace

SunAngles sun_angles(DVec3 sun) {
  return {std::atan2(sun.x, sun.z) / kDegree, std::atan2(sun.y, std::hypot(sun.x, sun.z)) / kDegree};
}

DVec3 sun_direction(const SunAngles& angles) {
  const double level = std::cos(angles.elevation * kDegree);
  return {std::sin(angles.azimuth * kDegree) * level, std::sin(angles.elevation * kDegree),
          std::cos(angles.azimuth * kDegree) * level};
}

double lowest_sun(const Environment& environment) {
  return environment.sky.model == SkyModel::Fixed ? kLowest : kNight;
}

DVec3 drag_sun(const Environment& environment, double dx, double dy) {
  SunAngles angles = sun_angles(environment.sun.direction);
  angles.azimuth = std::remainder(angles.azimuth + dx * kDegreesPerPixel, 360.0);
  angles.elevation = std::clamp(angles.elevation - dy * kDegreesPerPixel, lowest_sun(environment), kHighest);
  return sun_direction(angles);
}

}  // namespace quoin::viewer
