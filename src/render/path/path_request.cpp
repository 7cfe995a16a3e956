#include "render/path/path_request.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "render/image_request.h"
#include "render/path/path_math.h"

namespace quoin::path {
namespace {

constexpr int kMaxBounces = 1'024;

Status refuse(const std::string& message) {
  return make_error(ErrorCode::InvalidArgument, message);
}

bool is_brightness(double value) {
  return value >= 0.0 && value <= kMaxBrightness;
}

bool is_colour(Vec3 colour, float most) {
  return std::min({colour.x, colour.y, colour.z}) >= 0.0F && std::max({colour.x, colour.y, colour.z}) <= most &&
         is_finite(DVec3(colour));
}

bool is_anisotropy(double value) {
  return value >= -kMaxAnisotropy && value <= kMaxAnisotropy;
}

Status check_air(const AirOptions& air) {
  for (const double part : {air.rayleigh, air.mie, air.ozone}) {
    if (!(part >= 0.0 && part <= kMaxAir)) return refuse("air: each factor must be 0 to 100");
  }
  for (const Vec3& colour : {air.rayleigh_colour, air.mie_colour, air.ozone_colour}) {
    if (!is_colour(colour, static_cast<float>(kMaxAir))) return refuse("air: each colour component must be 0 to 100");
  }
  return is_anisotropy(air.mie_anisotropy) ? Status() : refuse("air: its mie_anisotropy must be -0.99 to 0.99");
}

Status check_ground(const GroundPlane& ground) {
  if (!std::isfinite(ground.height)) return refuse("ground: its height must be finite");
  if (!is_colour(ground.colour, 1.0F)) return refuse("ground: each colour component must be 0 to 1");
  return ground.fade >= 0.0 && ground.fade <= 1.0 ? Status() : refuse("ground: its fade must be 0 to 1");
}

Status check_fog(const Fog& fog) {
  if (!(fog.density >= 0.0 && fog.density <= kMaxFogDensity)) return refuse("fog: its density must be 0 to 1e6");
  if (!is_colour(fog.colour, 1.0F)) return refuse("fog: each colour component must be 0 to 1");
  if (!is_anisotropy(fog.anisotropy)) return refuse("fog: its anisotropy must be -0.99 to 0.99");
  return std::isfinite(fog.top) ? Status() : refuse("fog: its top must be finite");
}

Status check_lens(const Look& look) {
  if (!(look.lens_radius >= 0.0) || !std::isfinite(look.lens_radius)) {
    return refuse("lens_radius: must be finite and at least 0");
  }
  if (!(look.focus_distance > 0.0) || !std::isfinite(look.focus_distance)) {
    return refuse("focus_distance: must be finite and more than 0");
  }
  if (look.lens_blades != 0 && (look.lens_blades < 3 || look.lens_blades > kMaxLensBlades)) {
    return refuse("lens_blades: must be 0, or 3 to 64");
  }
  return std::isfinite(look.lens_turn_radians) ? Status() : refuse("lens_turn_radians: must be finite");
}

Status check_sky(const Look& options) {
  if (!is_finite(options.sun) || options.sun == DVec3(0.0)) return refuse("sun: must be finite and not 0");
  if (!(options.sun_angle_radians >= 0.0 && options.sun_angle_radians <= kMaxSunAngleRadians)) {
    return refuse("sun_angle_radians: must be 0 to 3");
  }
  if (!is_brightness(options.sun_brightness)) return refuse("sun_brightness: must be 0 to 1e9");
  if (!is_brightness(options.sky_brightness)) return refuse("sky_brightness: must be 0 to 1e9");
  if (!is_brightness(options.lamp_brightness)) return refuse("lamp_brightness: must be 0 to 1e9");
  if (!is_colour(options.sky_colour, static_cast<float>(kMaxBrightness))) {
    return refuse("sky_colour: must be 0 to 1e9 each");
  }
  if (!is_colour(options.sun_colour, static_cast<float>(kMaxBrightness))) {
    return refuse("sun_colour: must be 0 to 1e9 each");
  }
  if (options.background && !is_colour(*options.background, static_cast<float>(kMaxBrightness))) {
    return refuse("background: must be 0 to 1e9 each");
  }
  if (Status air = check_air(options.air); !air) return air;
  if (!std::isfinite(options.environment_turn_radians)) return refuse("environment_turn_radians: must be finite");
  if (options.sky != SkyModel::Environment) return {};
  const RadianceImage* const image = options.environment.get();
  const bool is_whole =
      image != nullptr && image->width > 0 && image->height > 0 &&
      image->rgb.size() == 3 * static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height);
  return is_whole ? Status() : refuse("environment: must be an image of at least one pixel");
}

}  // namespace

Status check(const Camera& camera, const PathOptions& options) {
  QUOIN_ASSERT(std::abs(glm::dot(camera.right, camera.up)) < 1e-3 &&
                   std::abs(glm::dot(camera.right, camera.forward)) < 1e-3 &&
                   std::abs(glm::dot(camera.up, camera.forward)) < 1e-3,
               "the camera's axes are perpendicular");
  if (Status image = check_image(camera, options.width, options.height); !image) return image;
  if (options.samples < 1 || options.samples > kMaxPathSamples) return refuse("samples: must be 1 to 65536");
  if (options.max_bounces < 0 || options.max_bounces > kMaxBounces) return refuse("max_bounces: must be 0 to 1024");
  if (options.max_scatterings < 0 || options.max_scatterings > kMaxBounces) {
    return refuse("max_scatterings: must be 0 to 1024");
  }
  if (Status ground = options.ground ? check_ground(*options.ground) : Status(); !ground) return ground;
  if (Status fog = options.fog ? check_fog(*options.fog) : Status(); !fog) return fog;
  if (Status lens = check_lens(options); !lens) return lens;
  return check_sky(options);
}

PathImage empty_image(const PathOptions& options) {
  QUOIN_ASSERT(options.width > 0 && options.height > 0, "a positive image size");
  const auto pixels = static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
  PathImage image;
  image.width = options.width;
  image.height = options.height;
  image.radiance.resize(pixels);
  image.scene.resize(pixels);
  image.alpha.resize(pixels);
  if (!options.layers) return image;
  image.albedo.resize(pixels);
  image.normal.resize(pixels);
  image.depth = {options.width, options.height, std::vector<float>(pixels)};
  image.types.resize(pixels);
  image.instances.resize(pixels);
  return image;
}

void PixelSums::write_to(PathImage& image, std::size_t pixel, int samples) const {
  QUOIN_ASSERT(pixel < image.radiance.size() && samples > 0, "a pixel of the image, with samples");
  const auto count = static_cast<float>(samples);
  Vec3 passed(1.0F);
  for (int channel = 0; channel < 3; ++channel) {
    if (open[channel] > 0.0F) passed[channel] = std::min(lit[channel] / open[channel], 1.0F);
  }
  image.scene[pixel] = scene / count;
  image.radiance[pixel] = (scene + background + caught * passed) / count;
  image.alpha[pixel] = std::min((scene_share + caught_share * (1.0F - luminance(passed))) / count, 1.0F);
  if (image.depth.values.empty()) return;
  image.albedo[pixel] = albedo / count;
  image.normal[pixel] = normal / count;
  image.depth.values[pixel] = depth;
  image.types[pixel] = type;
  image.instances[pixel] = instance;
}

}  // namespace quoin::path
