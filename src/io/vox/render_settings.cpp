#include "io/vox/render_settings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>

#include "core/bytes/text.h"
#include "core/srgb.h"

namespace quoin::vox {
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
