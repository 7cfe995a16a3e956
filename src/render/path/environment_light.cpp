#include "render/path/environment_light.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <quoin/core/assert.h>

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

}  // namespace quoin::path
