#include "render/path/sky_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "render/light/light_model.h"
#include "render/path/path_math.h"

namespace quoin::path {
namespace {

constexpr float kLeastShare = 1e-3F;  // of the mean: also samples black pixels, which interpolation can brighten

// Computes cumulative sums of weights, normalised to 1.
void accumulate(std::span<const float> weights, std::span<float> sums) {
  QUOIN_ASSERT(sums.size() == weights.size() + 1, "one more sum than weights");
  double sum = 0.0;
  sums[0] = 0.0F;
  for (const float weight : weights) sum += static_cast<double>(weight);
  QUOIN_ASSERT(sum > 0.0, "a positive sum of weights");
  double so_far = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    so_far += static_cast<double>(weights[i]);
    sums[i + 1] = static_cast<float>(so_far / sum);
  }
  sums.back() = 1.0F;
}

struct Found {
  std::size_t index = 0;
  float within = 0.0F;
};

Found find(std::span<const float> sums, float u) {
  QUOIN_ASSERT(sums.size() >= 2, "the sums of at least one weight");
  const auto above = std::upper_bound(sums.begin() + 1, sums.end() - 1, u);
  const auto index = static_cast<std::size_t>(above - sums.begin()) - 1;
  const float width = sums[index + 1] - sums[index];
  return {index, width > 0.0F ? std::min((u - sums[index]) / width, 0x1.fffffep-1F) : 0.5F};
}

}  // namespace

EnvironmentLight::EnvironmentLight(RadianceImage image) : image_(std::move(image)) {
  QUOIN_ASSERT(image_.width > 0 && image_.height > 0, "at least one pixel");
  QUOIN_ASSERT(
      image_.rgb.size() == 3 * static_cast<std::size_t>(image_.width) * static_cast<std::size_t>(image_.height),
      "three values per pixel");
  for (float& value : image_.rgb) value = value > 0.0F && std::isfinite(value) ? std::min(value, 1e30F) : 0.0F;
  const auto width = static_cast<std::size_t>(image_.width);
  const auto height = static_cast<std::size_t>(image_.height);
  std::vector<float> light(width * height);
  double sum = 0.0;
  for (int y = 0; y < image_.height; ++y) {
    for (int x = 0; x < image_.width; ++x) {
      const float here = luminance(pixel(x, y));
      light[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] = here;
      sum += static_cast<double>(here);
    }
  }
  const auto least = static_cast<float>(std::max(sum / static_cast<double>(light.size()) * double{kLeastShare}, 1e-30));
  std::vector<float> of_rows(height);
  rows_.resize(height + 1);
  columns_.resize(height * (width + 1));
  for (std::size_t y = 0; y < height; ++y) {
    const std::span<float> row = std::span(light).subspan(y * width, width);
    double all = 0.0;
    for (float& weight : row) all += static_cast<double>(weight = std::max(weight, least));
    accumulate(row, std::span(columns_).subspan(y * (width + 1), width + 1));
    const float turns = (static_cast<float>(y) + 0.5F) / static_cast<float>(height) * 0.5F;
    of_rows[y] = static_cast<float>(all) * of_turns(turns).sine;
  }
  accumulate(of_rows, rows_);
}

Vec3 EnvironmentLight::pixel(int x, int y) const {
  QUOIN_ASSERT(x >= 0 && x < image_.width && y >= 0 && y < image_.height, "a pixel of the image");
  const float* const rgb = &image_.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) +
                                            static_cast<std::size_t>(x))];
  return {rgb[0], rgb[1], rgb[2]};
}

EnvironmentLight::Place EnvironmentLight::place_of(Vec3 direction) const {
  const double turns =
      arc_tangent(static_cast<double>(direction.x), static_cast<double>(-direction.z)) / (2.0 * std::numbers::pi) + 0.5;
  const double down = arc_cosine(static_cast<double>(direction.y)) / std::numbers::pi;
  return {static_cast<float>(turns * image_.width), static_cast<float>(down * image_.height)};
}

Vec3 EnvironmentLight::at(Vec3 direction) const {
  const Place place = place_of(direction);
  const float x = place.x - 0.5F;
  const float y = std::clamp(place.y - 0.5F, 0.0F, static_cast<float>(image_.height - 1));
  const auto left = static_cast<int>(std::floor(x));
  const auto top = static_cast<int>(y);
  const float fx = x - static_cast<float>(left);
  const float fy = y - static_cast<float>(top);
  const int below = std::min(top + 1, image_.height - 1);
  const auto wrapped = [this](int column) { return (column + image_.width) % image_.width; };
  const int a = wrapped(left);
  const int b = wrapped(left + 1);
  return (pixel(a, top) * (1.0F - fx) + pixel(b, top) * fx) * (1.0F - fy) +
         (pixel(a, below) * (1.0F - fx) + pixel(b, below) * fx) * fy;
}

float EnvironmentLight::density_at(int x, int y, float sine) const {
  QUOIN_ASSERT(x >= 0 && x < image_.width && y >= 0 && y < image_.height, "a pixel of the image");
  const auto row = static_cast<std::size_t>(y);
  const float* const sums = &columns_[row * (static_cast<std::size_t>(image_.width) + 1) + static_cast<std::size_t>(x)];
  const float share = (rows_[row + 1] - rows_[row]) * (sums[1] - sums[0]);
  const float angle = 2.0F * kPi * kPi * sine / (static_cast<float>(image_.width) * static_cast<float>(image_.height));
  return angle > 0.0F ? share / angle : 0.0F;
}

SkySample EnvironmentLight::sample(Pair u) const {
  const Found row = find(rows_, u.y);
  const auto width = static_cast<std::size_t>(image_.width);
  const Found column = find(std::span(columns_).subspan(row.index * (width + 1), width + 1), u.x);
  const float down = (static_cast<float>(row.index) + row.within) / static_cast<float>(image_.height);
  const float around = (static_cast<float>(column.index) + column.within) / static_cast<float>(image_.width);
  const SineCosine latitude = of_turns(0.5F * down);
  const SineCosine longitude = of_turns(around);
  SkySample sample;
  // Half a turn back: the image's centre is -z.
  sample.direction = {-latitude.sine * longitude.sine, latitude.cosine, latitude.sine * longitude.cosine};
  sample.density = density_at(static_cast<int>(column.index), static_cast<int>(row.index), latitude.sine);
  sample.radiance = at(sample.direction);
  return sample;
}

float EnvironmentLight::density(Vec3 direction) const {
  const Place place = place_of(direction);
  const int x = std::clamp(static_cast<int>(place.x), 0, image_.width - 1);
  const int y = std::clamp(static_cast<int>(place.y), 0, image_.height - 1);
  return density_at(x, y, std::sqrt(std::max(0.0F, 1.0F - direction.y * direction.y)));
}

namespace {

// Kilometres.
constexpr float kGround = 6360.0F;
constexpr float kTop = 6460.0F;
constexpr float kEye = kGround + 0.2F;
constexpr Vec3 kRayleigh{5.802e-3F, 13.558e-3F, 33.1e-3F};
constexpr float kRayleighHeight = 8.0F;
constexpr float kMieScattering = 3.996e-3F;
constexpr float kMieAbsorption = 4.4e-3F;
constexpr float kMieHeight = 1.2F;
constexpr Vec3 kOzone{0.650e-3F, 1.881e-3F, 0.085e-3F};
constexpr float kGroundAlbedo = 0.3F;
constexpr Vec3 kNight{0.0006F, 0.0009F, 0.0016F};  // of stars and air: never black

constexpr int kWidth = 512;  // of the image
constexpr int kHeight = 256;

struct Medium {
  Vec3 rayleigh{0.0F};
  Vec3 mie{0.0F};
  Vec3 extinction{0.0F};
};

Medium medium_at(float radius, const AirOptions& air) {
  const float height = std::max(radius - kGround, 0.0F);
  Medium medium;
  medium.rayleigh =
      kRayleigh * air.rayleigh_colour * (exponential(-height / kRayleighHeight) * static_cast<float>(air.rayleigh));
  const float haze = exponential(-height / kMieHeight) * static_cast<float>(air.mie);
  medium.mie = air.mie_colour * (kMieScattering * haze);
  const float layer = std::max(0.0F, 1.0F - std::abs(height - 25.0F) / 15.0F) * static_cast<float>(air.ozone);
  medium.extinction =
      medium.rayleigh + air.mie_colour * ((kMieScattering + kMieAbsorption) * haze) + kOzone * air.ozone_colour * layer;
  return medium;
}

Vec3 through(Vec3 depth) {
  return {exponential(-depth.x), exponential(-depth.y), exponential(-depth.z)};
}

// Returns the distance from a point at `radius` along a ray whose cosine with the vertical is `cosine`, to a sphere
// around the Earth's centre; negative: no intersection.
float distance_to(float radius, float cosine, float sphere, bool is_entered) {
  const float b = radius * cosine;
  const float c = radius * radius - sphere * sphere;
  const float under = b * b - c;
  if (under < 0.0F) return -1.0F;
  const float root = std::sqrt(under);
  return is_entered ? -b - root : -b + root;
}

bool meets_ground(float radius, float cosine) {
  return cosine < 0.0F && distance_to(radius, cosine, kGround, true) >= 0.0F;
}

float along(float radius, float cosine, float t) {
  return std::sqrt(radius * radius + t * t + 2.0F * radius * cosine * t);
}

// A table of the transmittance from the top of the atmosphere, by height and angle above the ground.
class Transmittance {
 public:
  explicit Transmittance(const AirOptions& air) : table_(std::size_t{kAngles} * kHeights) {
    for (int j = 0; j < kHeights; ++j) {
      for (int i = 0; i < kAngles; ++i) {
        const float radius = radius_of(static_cast<float>(j) / (kHeights - 1));
        const float least = -std::sqrt(std::max(0.0F, 1.0F - square(kGround / radius)));
        const float share = static_cast<float>(i) / (kAngles - 1);
        table_[static_cast<std::size_t>(j * kAngles + i)] =
            integrate(radius, least + (1.0F - least) * share * share, air);
      }
    }
  }

  // Returns 0 if the ground is in between.
  [[nodiscard]] Vec3 at(float radius, float cosine) const {
    const float least = -std::sqrt(std::max(0.0F, 1.0F - square(kGround / radius)));
    if (cosine < least) return Vec3(0.0F);
    const float x = std::sqrt((cosine - least) / (1.0F - least)) * (kAngles - 1);
    const float height = std::clamp((radius - kGround) / (kTop - kGround), 0.0F, 1.0F);
    const float y = std::sqrt(height) * (kHeights - 1);
    const int i = std::clamp(static_cast<int>(x), 0, kAngles - 2);
    const int j = std::clamp(static_cast<int>(y), 0, kHeights - 2);
    const float fx = x - static_cast<float>(i);
    const float fy = y - static_cast<float>(j);
    const auto entry = [&](int column, int row) { return table_[static_cast<std::size_t>(row * kAngles + column)]; };
    return (entry(i, j) * (1.0F - fx) + entry(i + 1, j) * fx) * (1.0F - fy) +
           (entry(i, j + 1) * (1.0F - fx) + entry(i + 1, j + 1) * fx) * fy;
  }

 private:
  static constexpr int kAngles = 128;
  static constexpr int kHeights = 24;
  static float radius_of(float share) { return kGround + (kTop - kGround) * share * share; }
  static Vec3 integrate(float radius, float cosine, const AirOptions& air) {
    constexpr int kSteps = 40;
    const float length = std::max(distance_to(radius, cosine, kTop, false), 0.0F);
    Vec3 depth(0.0F);
    for (int i = 0; i < kSteps; ++i) {
      const float t = length * (static_cast<float>(i) + 0.5F) / kSteps;
      depth += medium_at(along(radius, cosine, t), air).extinction * (length / kSteps);
    }
    return through(depth);
  }

  std::vector<Vec3> table_;
};

// A table of multiply scattered light for an irradiance of 1, by height and the sun's angle.
class MultipleScattering {
 public:
  MultipleScattering(const AirOptions& air, const Transmittance& transmittance) {
    for (int j = 0; j < kEdge; ++j) {
      const float share = (static_cast<float>(j) + 0.5F) / kEdge;
      const float radius = kGround + (kTop - kGround) * share * share;
      Rings rings;
      for (int ring = 0; ring < kRings; ++ring) rings[static_cast<std::size_t>(ring)] = ring_of(ring, radius, air);
      for (int i = 0; i < kEdge; ++i) {
        table_[static_cast<std::size_t>(j * kEdge + i)] =
            integrate(rings, radius, static_cast<float>(i) / (kEdge - 1) * 2.0F - 1.0F, transmittance);
      }
    }
  }

  [[nodiscard]] Vec3 at(float radius, float cosine_of_sun) const {
    const float x = std::clamp(cosine_of_sun * 0.5F + 0.5F, 0.0F, 1.0F) * (kEdge - 1);
    const float height = std::sqrt(std::clamp((radius - kGround) / (kTop - kGround), 0.0F, 1.0F));
    const float y = std::clamp(height * kEdge - 0.5F, 0.0F, static_cast<float>(kEdge - 1));
    const int i = std::min(static_cast<int>(x), kEdge - 2);
    const int j = std::min(static_cast<int>(y), kEdge - 2);
    const float fx = x - static_cast<float>(i);
    const float fy = y - static_cast<float>(j);
    const auto entry = [&](int column, int row) { return table_[static_cast<std::size_t>(row * kEdge + column)]; };
    return (entry(i, j) * (1.0F - fx) + entry(i + 1, j) * fx) * (1.0F - fy) +
           (entry(i, j + 1) * (1.0F - fx) + entry(i + 1, j + 1) * fx) * fy;
  }

 private:
  static constexpr int kEdge = 20;
  static constexpr int kRings = 6;
  static constexpr int kTurns = 6;
  static constexpr int kSteps = 16;

  // Rays of one height and elevation, without the sun.
  struct Ring {
    float cosine = 0.0F;
    float sine = 0.0F;
    float length = 0.0F;
    bool on_ground = false;
    std::array<float, kSteps> t{};       // distances of the steps' middles
    std::array<float, kSteps> radius{};  // their distances from the Earth's centre
    std::array<Vec3, kSteps> part{};     // the share of each step in the light of the ray
    Vec3 passed{1.0F};                   // the transmittance of the ray
  };
  using Rings = std::array<Ring, kRings>;

  static Ring ring_of(int number, float radius, const AirOptions& air) {
    Ring ring;
    ring.cosine = 1.0F - 2.0F * (static_cast<float>(number) + 0.5F) / kRings;
    ring.sine = std::sqrt(1.0F - ring.cosine * ring.cosine);
    ring.on_ground = meets_ground(radius, ring.cosine);
    ring.length = std::max(ring.on_ground ? distance_to(radius, ring.cosine, kGround, true)
                                          : distance_to(radius, ring.cosine, kTop, false),
                           0.0F);
    const float step = ring.length / kSteps;
    for (std::size_t i = 0; i < kSteps; ++i) {
      ring.t[i] = step * (static_cast<float>(i) + 0.5F);
      ring.radius[i] = along(radius, ring.cosine, ring.t[i]);
      const Medium medium = medium_at(ring.radius[i], air);
      const Vec3 scattering = medium.rayleigh + Vec3(medium.mie);
      const Vec3 step_passes = through(medium.extinction * step);
      ring.part[i] = ring.passed * scattering * (Vec3(1.0F) - step_passes) / glm::max(medium.extinction, Vec3(1e-9F));
      ring.passed *= step_passes;
    }
    return ring;
  }

  static Vec3 integrate(const Rings& rings, float radius, float cosine_of_sun, const Transmittance& transmittance) {
    const float sine_of_sun = std::sqrt(std::max(0.0F, 1.0F - cosine_of_sun * cosine_of_sun));
    Vec3 second(0.0F);
    Vec3 again(0.0F);
    for (const Ring& ring : rings) {
      for (int turn = 0; turn < kTurns; ++turn) {
        const float to_sun_across = ring.sine * of_turns((static_cast<float>(turn) + 0.5F) / kTurns).cosine;
        const auto sun_at = [&](float t, float here) {
          // The vertical there, and the sun's angle with it.
          return (radius * cosine_of_sun + t * (ring.cosine * cosine_of_sun + to_sun_across * sine_of_sun)) / here;
        };
        for (std::size_t i = 0; i < kSteps; ++i) {
          second += ring.part[i] * transmittance.at(ring.radius[i], sun_at(ring.t[i], ring.radius[i])) *
                    (1.0F / (4.0F * kPi));
          again += ring.part[i];
        }
        if (ring.on_ground) {
          const float angle = sun_at(ring.length, kGround);
          second += ring.passed * transmittance.at(kGround, angle) * (std::max(angle, 0.0F) * kGroundAlbedo / kPi);
        }
      }
    }
    constexpr float kDirections = kRings * kTurns;
    return second / kDirections / (Vec3(1.0F) - glm::min(again / kDirections, Vec3(0.95F)));
  }

  std::array<Vec3, std::size_t{kEdge} * kEdge> table_{};
};

// The tables of an atmosphere, for any sun.
struct Atmosphere {
  explicit Atmosphere(const AirOptions& options)
      : air(options), transmittance(options), scattering(options, transmittance) {}

  AirOptions air;
  Transmittance transmittance;
  MultipleScattering scattering;
};

// Returns the tables. The default atmosphere's are made once per process.
std::shared_ptr<const Atmosphere> atmosphere_of(const AirOptions& air) {
  if (air != AirOptions{}) return std::make_shared<const Atmosphere>(air);
  static const auto usual = std::make_shared<const Atmosphere>(AirOptions{});
  return usual;
}

// The rays from the eye of one elevation, for a sun of irradiance 1.
class SkyRow {
 public:
  // `up`: the y of the rays.
  SkyRow(const Atmosphere& atmosphere, float up, float sun_up) : atmosphere_(atmosphere), sun_up_(sun_up) {
    const bool on_ground = meets_ground(kEye, up);
    const float length =
        std::max(on_ground ? distance_to(kEye, up, kGround, true) : distance_to(kEye, up, kTop, false), 0.0F);
    Vec3 passed(1.0F);
    float before = 0.0F;
    for (int i = 0; i < kSteps; ++i) {
      const float share = static_cast<float>(i + 1) / kSteps;
      const float end = length * share * share;  // shorter steps first, in dense air
      Step& step = steps_[static_cast<std::size_t>(i)];
      step.t = (before + end) * 0.5F;
      step.radius = along(kEye, up, step.t);
      step.medium = medium_at(step.radius, atmosphere.air);
      const Vec3 step_passes = through(step.medium.extinction * (end - before));
      step.passed = passed;
      step.absorbed = Vec3(1.0F) - step_passes;
      passed *= step_passes;
      before = end;
    }
  }

  // Returns the radiance. `towards`: the cosine of the ray with the sun's direction.
  [[nodiscard]] Vec3 radiance(float towards) const {
    const float rayleigh_phase = 3.0F / (16.0F * kPi) * (1.0F + towards * towards);
    const auto g = static_cast<float>(atmosphere_.air.mie_anisotropy);
    const float gg = g * g;
    const float under = std::max(1.0F + gg - 2.0F * g * towards, 1e-4F);
    const float mie_phase =
        3.0F / (8.0F * kPi) * (1.0F - gg) * (1.0F + towards * towards) / ((2.0F + gg) * under * std::sqrt(under));
    Vec3 sum(0.0F);
    for (const Step& step : steps_) {
      const Medium& medium = step.medium;
      const float sun_here = (kEye * sun_up_ + step.t * towards) / step.radius;
      const Vec3 direct = atmosphere_.transmittance.at(step.radius, sun_here) *
                          (medium.rayleigh * rayleigh_phase + medium.mie * mie_phase);
      const Vec3 all = direct + atmosphere_.scattering.at(step.radius, sun_here) * (medium.rayleigh + medium.mie);
      sum += step.passed * all * step.absorbed / glm::max(medium.extinction, Vec3(1e-9F));
    }
    return sum;
  }

 private:
  static constexpr int kSteps = 32;
  struct Step {
    float t = 0.0F;       // the distance of its middle
    float radius = 0.0F;  // from the Earth's centre
    Medium medium;
    Vec3 passed{1.0F};  // the transmittance from the eye
    Vec3 absorbed{0.0F};
  };

  const Atmosphere& atmosphere_;
  float sun_up_;
  std::array<Step, kSteps> steps_{};
};

// A table of the sky above the horizon, by elevation and by azimuth from the sun. Steps are finer near the horizon and
// near the sun.
class Dome {
 public:
  Dome(const Atmosphere& atmosphere, float sun_up, float irradiance) {
    const float sun_across = std::sqrt(std::max(0.0F, 1.0F - sun_up * sun_up));
    for (int j = 0; j < kUps; ++j) {
      const float up = std::max(square(static_cast<float>(j) / (kUps - 1)), 1e-5F);
      const float across = std::sqrt(std::max(0.0F, 1.0F - up * up));
      const SkyRow row(atmosphere, up, sun_up);
      for (int i = 0; i < kTurns; ++i) {
        const float turns = 0.5F * square(static_cast<float>(i) / (kTurns - 1));
        const float towards = std::clamp(up * sun_up + across * sun_across * of_turns(turns).cosine, -1.0F, 1.0F);
        entries_[index(i, j)] = row.radiance(towards) * irradiance + kNight;
      }
    }
  }

  [[nodiscard]] Vec3 at(float up, float turns) const {
    const float y = std::sqrt(std::clamp(up, 0.0F, 1.0F)) * (kUps - 1);
    const float x = std::sqrt(std::clamp(2.0F * turns, 0.0F, 1.0F)) * (kTurns - 1);
    const int i = std::min(static_cast<int>(x), kTurns - 2);
    const int j = std::min(static_cast<int>(y), kUps - 2);
    const float fx = x - static_cast<float>(i);
    const float fy = y - static_cast<float>(j);
    return (entries_[index(i, j)] * (1.0F - fx) + entries_[index(i + 1, j)] * fx) * (1.0F - fy) +
           (entries_[index(i, j + 1)] * (1.0F - fx) + entries_[index(i + 1, j + 1)] * fx) * fy;
  }

  // Returns the irradiance on level ground.
  [[nodiscard]] Vec3 on_level_ground() const {
    Vec3 level(0.0F);
    for (int j = 0; j < kHeight / 2; ++j) {
      const SineCosine down = of_turns((static_cast<float>(j) + 0.5F) / kHeight * 0.5F);
      Vec3 row(0.0F);
      for (int i = 0; i < 16; ++i) row += at(down.cosine, (static_cast<float>(i) + 0.5F) / 32.0F);
      level += row * (down.sine * down.cosine / 16.0F * 2.0F * kPi * kPi / kHeight);
    }
    return level;
  }

 private:
  static constexpr int kUps = 96;
  static constexpr int kTurns = 64;
  static std::size_t index(int turn, int up) { return static_cast<std::size_t>(up * kTurns + turn); }

  std::vector<Vec3> entries_ = std::vector<Vec3>(std::size_t{kUps} * kTurns);
};

}  // namespace

AtmosphericSky atmospheric_sky(DVec3 to_sun, float irradiance, const AirOptions& air) {
  const std::shared_ptr<const Atmosphere> atmosphere = atmosphere_of(air);
  const auto sun_up = static_cast<float>(to_sun.y);
  AtmosphericSky made;
  made.sunlight = atmosphere->transmittance.at(kEye, sun_up) * irradiance;
  made.radiance = {kWidth, kHeight, std::vector<float>(std::size_t{3} * kWidth * kHeight)};
  const Dome dome(*atmosphere, sun_up, irradiance);
  // The colour of the ground below the horizon.
  const Vec3 ground = (dome.on_level_ground() + made.sunlight * std::max(sun_up, 0.0F)) * (kGroundAlbedo / kPi);
  const double sun_turns = arc_tangent(to_sun.x, -to_sun.z) / (2.0 * std::numbers::pi) + 0.5;
  for (int y = 0; y < kHeight; ++y) {
    const float up = of_turns((static_cast<float>(y) + 0.5F) / kHeight * 0.5F).cosine;
    for (int x = 0; x < kWidth; ++x) {
      double turns = std::abs((x + 0.5) / kWidth - sun_turns);
      if (turns > 0.5) turns = 1.0 - turns;
      Vec3 light = dome.at(up, static_cast<float>(turns));
      if (up < 0.0F) {
        const float s = std::clamp(-up / 0.12F, 0.0F, 1.0F);
        light += (ground - light) * (s * s * (3.0F - 2.0F * s));
      }
      float* const rgb = &made.radiance.rgb[3 * (static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x))];
      for (int channel = 0; channel < 3; ++channel) rgb[channel] = light[channel];
    }
  }
  return made;
}

namespace {

// Rotates about the vertical: -z turns towards +x.
Vec3 turned(Vec3 v, SineCosine by) {
  return {v.x * by.cosine - v.z * by.sine, v.y, v.x * by.sine + v.z * by.cosine};
}

Vec3 turned_back(Vec3 v, SineCosine by) {
  return turned(v, {-by.sine, by.cosine});
}

}  // namespace

bool is_same_sky(const Environment& a, const Environment& b) {
  quoin::Sky sky = a.sky;
  sky.background = b.sky.background;
  Sun sun = a.sun;
  sun.is_visible = b.sun.is_visible;
  return sky == b.sky && sun == b.sun;
}

SkyLight::SkyLight(const Environment& environment)
    : model_(environment.sky.model == SkyModel::Fixed ? SkyModel::Gradient : environment.sky.model),
      brightness_(static_cast<float>(environment.sky.brightness)),
      uniform_(environment.sky.colour) {
  const Sun& sun = environment.sun;
  const DVec3 to_sun = sun.unit_direction();
  to_sun_ = glm::normalize(Vec3(to_sun));
  const float sine = of_turns(static_cast<float>(sun.angle_radians / 4.0 / std::numbers::pi / 2.0)).sine;
  one_less_cos_ = 2.0F * sine * sine;
  const float irradiance = kPi * static_cast<float>(sun.brightness);
  switch (model_) {
    case SkyModel::Uniform:
      sunlight_ = Vec3(irradiance) * sun.colour;
      break;
    case SkyModel::Fixed:
    case SkyModel::Gradient: {
      const Daylight day = daylight_of(environment);
      gradient_ = day.sky;
      sunlight_ = day.sun * (kPi * static_cast<float>(day.sun_brightness));
      break;
    }
    case SkyModel::Physical: {
      AtmosphericSky made = atmospheric_sky(to_sun, kPi, environment.sky.air);
      sunlight_ = made.sunlight * static_cast<float>(sun.brightness) * sun.colour;
      air_.emplace(EnvironmentLight(std::move(made.radiance)));
      break;
    }
    case SkyModel::Image: {
      QUOIN_ASSERT(environment.sky.image != nullptr, "an image of the sky");
      sunlight_ = Vec3(irradiance) * sun.colour;
      image_.emplace(*environment.sky.image);
      is_uneven_ = true;
      double turns = environment.sky.image_turn_radians / (2.0 * std::numbers::pi);
      turns -= std::floor(turns);
      turn_ = of_turns(static_cast<float>(turns));
      break;
    }
  }
}

Vec3 SkyLight::sky(Vec3 direction) const {
  if (model_ == SkyModel::Uniform) return uniform_ * brightness_;
  if (model_ == SkyModel::Gradient) return sky_colour(direction.y, gradient_) * brightness_;
  if (model_ == SkyModel::Physical) return air_->at(direction) * brightness_;
  return image_->at(turned_back(direction, turn_)) * brightness_;
}

Vec3 SkyLight::sun(Vec3 direction) const {
  const float density = sun_density(direction);
  return density > 0.0F ? sunlight_ * density : Vec3(0.0F);
}

float SkyLight::sun_density(Vec3 direction) const {
  if (!(one_less_cos_ > 0.0F) || !has_sun()) return 0.0F;
  // 1 - cos from a squared distance: in single precision a small angle's cosine is 1.
  const Vec3 difference = direction - to_sun_;
  return 0.5F * glm::dot(difference, difference) <= one_less_cos_ ? 1.0F / (2.0F * kPi * one_less_cos_) : 0.0F;
}

SkySample SkyLight::sample_sun(Pair u) const {
  if (!(one_less_cos_ > 0.0F)) return sun_sample(to_sun_);
  const float down = u.x * one_less_cos_;
  const float across = std::sqrt(down * (2.0F - down));
  const SineCosine turn = of_turns(u.y);
  const Vec3 direction = Frame(to_sun_).to_world({across * turn.cosine, across * turn.sine, 1.0F - down});
  return sun_sample(glm::normalize(direction));
}

SkySample SkyLight::sun_sample(Vec3 direction) const {
  if (!(one_less_cos_ > 0.0F)) return {direction, sunlight_, std::numeric_limits<float>::infinity()};
  const float density = 1.0F / (2.0F * kPi * one_less_cos_);
  return {direction, sunlight_ * density, density};
}

SkySample SkyLight::sample_sky(Pair u) const {
  QUOIN_ASSERT(image_.has_value(), "an uneven sky");
  SkySample sample = image_->sample(u);
  sample.direction = turned(sample.direction, turn_);
  sample.radiance *= brightness_;
  return sample;
}

float SkyLight::sky_density(Vec3 direction) const {
  QUOIN_ASSERT(image_.has_value(), "an uneven sky");
  return image_->density(turned_back(direction, turn_));
}

}  // namespace quoin::path
