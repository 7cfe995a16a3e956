#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/bytes/text.h"
#include "core/srgb.h"
#include "io/vox/vox_reader.h"

namespace quoin::vox {
namespace {

/// A camera's keys, with MagicaVoxel's defaults.
struct Keys {
  DVec3 focus{0.0};
  DVec3 angle{0.0};  ///< pitch, yaw, roll, in degrees
  double radius = 0.0;
  double fov = 45.0;
  std::string_view mode = "pers";
};

std::optional<DVec3> parse_three(std::string_view text) {
  std::array<float, 3> numbers{};
  if (!parse_floats(text, numbers)) return std::nullopt;
  return DVec3(numbers[0], numbers[1], numbers[2]);
}

/// Reads a key if the camera has it; reports a fault if it is invalid.
template <class Parse, class Value>
void read_key(const Dict& attributes, std::string_view key, Parse parse, Value& value, std::string& fault) {
  const std::string_view text = attributes.get(key);
  if (text.empty()) return;
  if (const auto read = parse(text)) {
    value = static_cast<Value>(*read);
  } else if (fault.empty()) {
    fault = std::string(key) + " is \"" + printable(text) + "\"";
  }
}

Keys read_keys(const Dict& attributes, std::string& fault) {
  Keys keys;
  read_key(attributes, "_focus", parse_three, keys.focus, fault);
  read_key(attributes, "_angle", parse_three, keys.angle, fault);
  read_key(attributes, "_radius", parse_float, keys.radius, fault);
  read_key(attributes, "_fov", parse_float, keys.fov, fault);
  if (const std::string_view mode = attributes.get("_mode"); !mode.empty()) keys.mode = mode;
  return keys;
}

bool is_orthographic(const Keys& keys) {
  return keys.mode == "orth" || keys.mode == "iso";
}

/// Returns true for an unused camera: older versions write a radius of 1, newer ones 0.
bool was_never_set(const Keys& keys) {
  const bool is_near = keys.radius == 0.0 || keys.radius == 1.0;
  return is_near && keys.focus == DVec3(0.0) && keys.angle == DVec3(0.0);
}

std::string find_error(const Keys& keys) {
  const bool is_known = keys.mode == "pers" || keys.mode == "free" || is_orthographic(keys);
  if (!is_known) return "_mode \"" + printable(keys.mode) + "\" is not supported";
  if (!(keys.fov > 0.0 && keys.fov < 180.0)) return "_fov is not between 0 and 180";
  if (keys.radius < 0.0) return "_radius is below 0";
  if (is_orthographic(keys) && keys.radius == 0.0) return "_radius is 0";
  return {};
}

/// Returns the distance from `focus` of a plane across `forward` that has all of `bounds` in front of it.
double distance_before(const DBox& bounds, DVec3 focus, DVec3 forward) {
  if (bounds.empty()) return 0.0;
  double nearest = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    nearest +=
        std::min(forward[axis] * (bounds.min[axis] - focus[axis]), forward[axis] * (bounds.max[axis] - focus[axis]));
  }
  return 1.0 - nearest;
}

Camera camera_from(const Keys& keys, const DBox& bounds) {
  const DVec3 radians = keys.angle * (std::numbers::pi / 180.0);
  const double level = std::cos(radians.x);
  Camera camera;
  camera.forward = {-std::sin(radians.y) * level, std::sin(radians.x), -std::cos(radians.y) * level};
  const DVec3 right(std::cos(radians.y), 0.0, -std::sin(radians.y));
  const DVec3 up = glm::cross(right, camera.forward);
  camera.right = right * std::cos(radians.z) + up * std::sin(radians.z);
  camera.up = up * std::cos(radians.z) - right * std::sin(radians.z);
  camera.vertical_fov_radians = keys.fov * (std::numbers::pi / 180.0);
  const DVec3 focus(keys.focus.x, keys.focus.z, -keys.focus.y);
  double distance = keys.radius;
  if (is_orthographic(keys)) {
    camera.projection = Camera::Projection::Orthographic;
    camera.view_height = 2.0 * keys.radius * std::tan(camera.vertical_fov_radians / 2.0);
    distance = std::max(distance, distance_before(bounds, focus, camera.forward));
  }
  camera.position = focus - camera.forward * distance;
  return camera;
}

}  // namespace

std::vector<FileCamera> cameras_of(const Document& document, const DBox& bounds, std::vector<std::string>& warnings) {
  std::vector<FileCamera> cameras;
  for (const CameraChunk& chunk : document.cameras) {
    std::string fault;
    const Keys keys = read_keys(chunk.attributes, fault);
    if (fault.empty() && was_never_set(keys)) continue;
    if (fault.empty()) fault = find_error(keys);
    if (fault.empty() && chunk.id < 0) fault = "its id is below 0";
    if (fault.empty() && std::ranges::find(cameras, chunk.id, &FileCamera::number) != cameras.end()) {
      fault = "its id is a duplicate";
    }
    if (fault.empty()) {
      cameras.push_back({chunk.id, camera_from(keys, bounds), keys.radius});
    } else {
      warnings.push_back("camera " + std::to_string(chunk.id) + " skipped: " + fault);
    }
  }
  return cameras;
}

namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr double kUsualAir = 0.4;                            // _ray_d, _mie_d and _o3_d of the Earth
constexpr std::array kUsualRayleigh = {45.0, 104.0, 255.0};  // default of _ray_k
constexpr std::array kUsualOzone = {105.0, 255.0, 110.0};
constexpr double kBloomRadius = 0.05;  // for a _scale of 1

// The default of a key that Quoin does not support.
struct Usual {
  std::string_view group, key, value;
};
constexpr std::array kUsual = {
    Usual{"_bounce", "_energy", "3"},     Usual{"_lens", "_proj", "0"},    Usual{"_lens", "_fov", "45"},
    Usual{"_setting", "_scale", "1 1 1"}, Usual{"_setting", "_cell", "1"}, Usual{"_setting", "_aa", "1"},
    Usual{"_setting", "_sw", "1"},        Usual{"_setting", "_grid", "0"}, Usual{"_setting", "_edge", "0"},
    Usual{"_grid", "_enable", "0"},       Usual{"_edge", "_enable", "0"}};

// The values of all groups, and which of them were read.
class Settings {
 public:
  explicit Settings(const std::vector<SettingChunk>& chunks) {
    for (const SettingChunk& chunk : chunks) {
      const std::string_view group = chunk.attributes.get("_type");
      for (const auto& [key, value] : chunk.attributes.entries) {
        if (key != "_type") values_[{group, key}] = {value, false};
      }
    }
  }

  // Returns the numbers of a key. Invalid text stays unread.
  template <std::size_t kCount>
  [[nodiscard]] std::optional<std::array<double, kCount>> numbers(std::string_view group, std::string_view key) {
    const auto found = values_.find({group, key});
    if (found == values_.end()) return std::nullopt;
    std::array<float, kCount> read{};
    if (!parse_floats(found->second.text, read)) return std::nullopt;
    std::array<double, kCount> out{};
    std::ranges::copy(read, out.begin());
    found->second.is_read = true;
    return out;
  }
  [[nodiscard]] std::optional<double> number(std::string_view group, std::string_view key) {
    const auto one = numbers<1>(group, key);
    return one ? std::optional((*one)[0]) : std::nullopt;
  }
  void put(std::string_view group, std::string_view key, double least, double most, double& out) {
    if (const auto value = number(group, key)) out = std::clamp(*value, least, most);
  }
  void put_colour(std::string_view group, std::string_view key, Vec3& out) {
    const auto value = numbers<3>(group, key);
    if (!value) return;
    for (int i = 0; i < 3; ++i) {
      const double channel = std::clamp((*value)[static_cast<std::size_t>(i)], 0.0, 255.0);
      out[i] = linear_from_srgb(static_cast<float>(channel / 255.0));
    }
  }
  // Stores the values as multiples of the defaults.
  void put_ratio(std::string_view group, std::string_view key, const std::array<double, 3>& usual, Vec3& out) {
    const auto value = numbers<3>(group, key);
    if (!value) return;
    for (std::size_t i = 0; i < 3; ++i) {
      out[static_cast<int>(i)] = static_cast<float>(std::clamp((*value)[i] / usual[i], 0.0, kMaxAir));
    }
  }
  [[nodiscard]] bool is_on(std::string_view group, std::string_view key, bool otherwise) {
    const auto value = number(group, key);
    return value ? *value != 0.0 : otherwise;
  }
  [[nodiscard]] std::string text(std::string_view group, std::string_view key) {
    const auto found = values_.find({group, key});
    if (found == values_.end()) return {};
    found->second.is_read = true;
    return std::string(found->second.text);
  }
  // Marks a group's keys as read, to ignore them.
  void pass(std::string_view group) {
    for (auto& [name, value] : values_) {
      if (name.first == group && name.second != "_enable") value.is_read = true;
    }
  }
  [[nodiscard]] std::vector<std::string> unread() const {
    std::vector<std::string> out;
    for (const auto& [name, value] : values_) {
      const bool is_usual = std::ranges::any_of(kUsual, [&, &n = name, &v = value](const Usual& usual) {
        return usual.group == n.first && usual.key == n.second && usual.value == v.text;
      });
      if (value.is_read || is_usual) continue;
      out.push_back(printable(name.first) + " " + printable(name.second) + " " + printable(value.text));
    }
    return out;
  }

 private:
  struct Value {
    std::string_view text;
    bool is_read = false;
  };
  std::map<std::pair<std::string_view, std::string_view>, Value> values_;
};

// The tangent of half the disc's angle.
double angle_of_area(double area) {
  constexpr double kWidest = 3.0;
  return std::min(2.0 * std::atan(std::max(area, 0.0)), kWidest);
}

void read_sun(Settings& settings, Sun& sun) {
  settings.put("_inf", "_i", 0.0, kMaxBrightness, sun.brightness);
  settings.put_colour("_inf", "_k", sun.colour);
  if (const auto angle = settings.numbers<2>("_inf", "_angle")) {
    const double pitch = (*angle)[0] * kRadians;
    const double yaw = (*angle)[1] * kRadians;
    sun.direction = {std::sin(yaw) * std::cos(pitch), std::sin(pitch), std::cos(yaw) * std::cos(pitch)};
  }
  if (const auto area = settings.number("_inf", "_area")) sun.angle_radians = angle_of_area(*area);
  sun.is_visible = settings.is_on("_inf", "_disk", sun.is_visible);
}

void read_air(Settings& settings, AirOptions& air) {
  const auto density = [&](const char* key, double& out) {
    if (const auto value = settings.number("_atm", key)) out = std::clamp(*value / kUsualAir, 0.0, kMaxAir);
  };
  density("_ray_d", air.rayleigh);
  density("_mie_d", air.mie);
  density("_o3_d", air.ozone);
  settings.put_ratio("_atm", "_ray_k", kUsualRayleigh, air.rayleigh_colour);
  settings.put_ratio("_atm", "_mie_k", {255.0, 255.0, 255.0}, air.mie_colour);
  settings.put_ratio("_atm", "_o3_k", kUsualOzone, air.ozone_colour);
  settings.put("_atm", "_mie_g", -kMaxAnisotropy, kMaxAnisotropy, air.mie_anisotropy);
}

void read_sky(Settings& settings, double sun_brightness, Sky& sky) {
  const int mode = static_cast<int>(std::clamp(settings.number("_env", "_mode").value_or(0.0), 0.0, 2.0));
  if (mode == 1) {
    sky.model = SkyModel::Physical;
    sky.brightness = sun_brightness;
    read_air(settings, sky.air);
  } else if (mode == 2) {
    sky.model = SkyModel::Image;
    sky.image_file = settings.text("_ibl", "_path");
    settings.put("_ibl", "_i", 0.0, kMaxBrightness, sky.brightness);
    if (const auto turn = settings.number("_ibl", "_rot")) sky.image_turn_radians = *turn * kRadians;
    if (const auto angle = settings.numbers<2>("_ibl", "_angle")) {
      sky.image_turn_radians = (*angle)[1] * kRadians;
    }
  } else {
    sky.model = SkyModel::Uniform;
    settings.put("_uni", "_i", 0.0, kMaxBrightness, sky.brightness);
    settings.put_colour("_uni", "_k", sky.colour);
  }
  for (const char* of_others : {"_uni", "_atm", "_ibl"}) settings.pass(of_others);
}

void read_fog(Settings& settings, std::optional<Fog>& out) {
  Fog fog;
  fog.density = 0.0;
  settings.put("_fog_uni", "_d", 0.0, kMaxFogDensity, fog.density);
  settings.put_colour("_fog_uni", "_k", fog.colour);
  settings.put("_fog_uni", "_g", -kMaxAnisotropy, kMaxAnisotropy, fog.anisotropy);
  if (fog.density > 0.0) out = fog;
}

void read_lens(Settings& settings, Lens& lens) {
  constexpr double kMostBlades = kMaxLensBlades;
  settings.put("_lens", "_aperture", 0.0, kMaxBrightness, lens.radius);
  if (const auto blades = settings.number("_lens", "_blade_n")) {
    lens.blades = *blades < 3.0 ? 0 : static_cast<int>(std::min(*blades, kMostBlades));
  }
  if (const auto turn = settings.number("_lens", "_blade_r")) lens.turn_radians = *turn * kRadians;
}

void read_film(Settings& settings, Environment& environment) {
  settings.put("_film", "_expo", 0.0, kMaxBrightness, environment.exposure.emplace(1.0));
  settings.put("_film", "_vig", 0.0, 1.0, environment.vignette);
  settings.put("_film", "_gam", 0.1, 10.0, environment.gamma);
  environment.tone = settings.is_on("_film", "_aces", true) ? ToneCurve::Aces : ToneCurve::Clamp;
  Bloom& bloom = environment.bloom;
  settings.put("_bloom", "_mix", 0.0, 1.0, bloom.mix);
  settings.put("_bloom", "_aspect", -1.0, 1.0, bloom.aspect);
  settings.put("_bloom", "_threshold", 0.0, kMaxBrightness, bloom.threshold);
  double scale = 0.0;
  settings.put("_bloom", "_scale", 0.0, 1.0 / kBloomRadius, scale);
  bloom.radius = scale * kBloomRadius;
  if (bloom.radius == 0.0) bloom = {};
}

void read_ground(Settings& settings, FileRenderSettings& out) {
  GroundPlane ground;
  settings.put_colour("_ground", "_color", ground.colour);
  settings.put("_ground", "_hor", 0.0, 1.0, ground.fade);
  const bool has_ground = settings.is_on("_setting", "_ground", settings.is_on("_ground", "_enable", false));
  if (has_ground) out.environment.ground = ground;
  Vec3 colour(0.0F);
  settings.put_colour("_bg", "_color", colour);
  if (settings.is_on("_setting", "_bg_c", settings.is_on("_bg", "_enable", false)))
    out.environment.sky.background = colour;
  out.is_transparent = settings.is_on("_setting", "_bg_a", false);
}

}  // namespace

std::optional<FileRenderSettings> render_settings_of(const Document& document) {
  if (document.settings.empty()) return std::nullopt;
  Settings settings(document.settings);
  FileRenderSettings out;
  Environment& environment = out.environment;
  read_sun(settings, environment.sun);
  read_sky(settings, environment.sun.brightness, environment.sky);
  read_fog(settings, environment.fog);
  read_lens(settings, out.lens);
  read_film(settings, environment);
  read_ground(settings, out);
  constexpr double kMostBounces = 1'023.0;
  double diffuse = 0.0;
  double specular = 0.0;
  double scatter = out.max_scatterings;
  settings.put("_bounce", "_diffuse", 0.0, kMostBounces, diffuse);
  settings.put("_bounce", "_specular", 0.0, kMostBounces, specular);
  settings.put("_bounce", "_scatter", 0.0, kMostBounces, scatter);
  const double bounces = std::max(diffuse, specular);
  if (bounces > 0.0) out.max_bounces = 1 + static_cast<int>(bounces);
  out.max_scatterings = static_cast<int>(scatter);
  // Keys of edges and grids only matter if these are drawn, which _setting or _enable say.
  settings.pass("_grid");
  settings.pass("_edge");
  out.not_drawn = settings.unread();
  return out;
}

}  // namespace quoin::vox
