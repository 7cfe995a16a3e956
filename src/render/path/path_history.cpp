#include <quoin/core/assert.h>
#include <quoin/render/path_history.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "render/path/path_math.h"

namespace quoin {
namespace {

using path::pack_light;
using path::unpack_light;

constexpr int kReach = 2;  // radius in pixels of the area that determines a pixel's share

std::size_t index_of(int x, int y, int width) {
  QUOIN_ASSERT(x >= 0 && x < width && y >= 0, "a pixel of the image");
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

std::size_t pixel_count(int width, int height) {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

/// The position of a pixel among the pixels of a smaller image along one axis.
struct Between {
  int low = 0;
  int high = 0;
  float share = 0.0F;  ///< of `high`
};

Between between(int at, int size, int of_size) {
  QUOIN_ASSERT(at >= 0 && at < size && of_size > 0, "a pixel of the larger image");
  if (size == of_size) return {at, at, 0.0F};
  const double place = (at + 0.5) * of_size / size - 0.5;
  const int low = static_cast<int>(std::floor(place));
  const auto bounded = [of_size](int i) { return std::clamp(i, 0, of_size - 1); };
  return {bounded(low), bounded(low + 1), static_cast<float>(place - low)};
}

/// The values of a smaller image at one row of pixels of a larger image.
template <typename At>
auto value_at(const Between& x, const Between& y, int width, const At& at) {
  if (x.low == x.high && y.low == y.high) return at(index_of(x.low, y.low, width));
  const auto along = [&](int row) {
    return at(index_of(x.low, row, width)) * (1.0F - x.share) + at(index_of(x.high, row, width)) * x.share;
  };
  return along(y.low) * (1.0F - y.share) + along(y.high) * y.share;
}

enum class Along : std::uint8_t { Rows, Columns };

/// Returns, for each pixel, the sum over the pixels within `kReach` along one axis.
std::vector<float> sums_along(Along axis, const std::vector<float>& values, int width, int height, Threads threads) {
  const bool is_row = axis == Along::Rows;
  const int last = (is_row ? width : height) - 1;
  std::vector<float> sums(values.size());
  parallel_for(static_cast<std::size_t>(height), threads, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < width; ++x) {
      const int at = is_row ? x : y;
      float sum = 0.0F;
      for (int i = std::max(at - kReach, 0); i <= std::min(at + kReach, last); ++i)
        sum += values[is_row ? index_of(i, y, width) : index_of(x, i, width)];
      sums[index_of(x, y, width)] = sum;
    }
  });
  return sums;
}

/// Returns, for each pixel, the sum over the pixels within `kReach` along both axes.
std::vector<float> sums_around(const std::vector<float>& values, int width, int height, Threads threads) {
  return sums_along(Along::Columns, sums_along(Along::Rows, values, width, height, threads), width, height, threads);
}

/// Returns an image's mean over the area of a pixel of a smaller image.
Vec3 mean_over(const std::vector<std::uint32_t>& light, int width, int height, int x, int y, int of_width,
               int of_height) {
  const auto first = [](int at, int size, int of_size) {
    return static_cast<int>(static_cast<std::int64_t>(at) * size / of_size);
  };
  const int left = first(x, width, of_width);
  const int right = std::max(first(x + 1, width, of_width), left + 1);
  const int top = first(y, height, of_height);
  const int bottom = std::max(first(y + 1, height, of_height), top + 1);
  Vec3 sum(0.0F);
  for (int row = top; row < bottom; ++row)
    for (int i = left; i < right; ++i) sum += unpack_light(light[index_of(i, row, width)]);
  return sum / static_cast<float>((right - left) * (bottom - top));
}

float square(Vec3 difference) {
  return glm::dot(difference, difference);
}

}  // namespace

bool PathHistory::is_finer(const Taken& a, const Taken& b) {
  const std::size_t pixels_a = pixel_count(a.width, a.height);
  const std::size_t pixels_b = pixel_count(b.width, b.height);
  return pixels_a != pixels_b ? pixels_a > pixels_b : a.samples > b.samples;
}

void PathHistory::clear() {
  earlier_.clear();
  now_.clear();
}

void PathHistory::note_edit() {
  // Images of earlier scenes are finer than all later images: see `refine`.
  if (earlier_.empty()) earlier_ = std::move(now_);
  now_.clear();
}

const PathHistory::Taken* PathHistory::find_earlier(int width, int height, int samples) const {
  const auto found = std::find_if(earlier_.begin(), earlier_.end(), [&](const Taken& taken) {
    return taken.width == width && taken.height == height && taken.samples == samples;
  });
  return found != earlier_.end() ? &*found : nullptr;
}

std::size_t PathHistory::bytes() const {
  std::size_t all = 0;
  for (const std::vector<Taken>* taken : {&earlier_, &now_})
    for (const Taken& image : *taken) all += image.light.capacity() * sizeof(std::uint32_t);
  return all;
}

void PathHistory::refine(PathImage& image, int samples, Threads threads) {
  QUOIN_ASSERT(image.width > 0 && image.height > 0 && samples > 0, "an image with samples");
  QUOIN_ASSERT(image.radiance.size() == pixel_count(image.width, image.height) &&
                   image.scene.size() == image.radiance.size() && image.alpha.size() == image.radiance.size(),
               "one value per pixel");
  Taken taken{image.width, image.height, samples, std::vector<std::uint32_t>(image.radiance.size())};
  std::transform(image.radiance.begin(), image.radiance.end(), taken.light.begin(), pack_light);
  if (!earlier_.empty() && !is_finer(earlier_.back(), taken)) earlier_.clear();
  // A restart from few samples without an edit continues from these images.
  while (!now_.empty() && !is_finer(taken, now_.back())) now_.pop_back();
  now_.push_back(std::move(taken));
  const Taken* before = find_earlier(image.width, image.height, samples);
  if (before == nullptr) return;
  const Taken& best = earlier_.back();
  combine(*before, best, shares(now_.back(), *before, best, threads), threads, image);
}

// If two images of the same light with equal noise have a share of samples in common, the mean square of their
// difference is 2 * (1 - share) times the noise variance.
std::vector<float> PathHistory::shares(const Taken& now, const Taken& before, const Taken& best, Threads threads) {
  std::vector<float> change(now.light.size());
  std::vector<float> noise(now.light.size());
  parallel_for(static_cast<std::size_t>(now.height), threads, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < now.width; ++x) {
      const std::size_t i = index_of(x, y, now.width);
      const Vec3 known = unpack_light(before.light[i]);
      change[i] = square(unpack_light(now.light[i]) - known);
      noise[i] = square(mean_over(best.light, best.width, best.height, x, y, now.width, now.height) - known);
    }
  });
  std::vector<float> shares = sums_around(change, now.width, now.height, threads);
  const std::vector<float> noises = sums_around(noise, now.width, now.height, threads);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    if (shares[i] == 0.0F) {
      shares[i] = 1.0F;
    } else {
      shares[i] = noises[i] > 0.0F ? std::max(1.0F - shares[i] / (2.0F * noises[i]), 0.0F) : 0.0F;
    }
  }
  return shares;
}

void PathHistory::combine(const Taken& before, const Taken& best, const std::vector<float>& shares, Threads threads,
                          PathImage& image) {
  const int of_width = image.width;
  const int of_height = image.height;
  QUOIN_ASSERT(shares.size() == pixel_count(of_width, of_height), "one share per pixel");
  QUOIN_ASSERT(best.light.size() == pixel_count(best.width, best.height), "one value per pixel");
  // An image of the same size is changed in place: a pixel is read only for itself, before it is written.
  PathImage smaller;
  const bool is_as_large = of_width == best.width && of_height == best.height;
  if (!is_as_large) {
    smaller = std::exchange(image, PathImage());
    const std::size_t count = pixel_count(best.width, best.height);
    image.width = best.width;
    image.height = best.height;
    image.radiance.resize(count);
    image.scene.resize(count);
    image.alpha.resize(count);
    image.rays = smaller.rays;
    image.pixels_hit = smaller.pixels_hit;
  }
  const PathImage& taken = is_as_large ? image : smaller;
  parallel_for(static_cast<std::size_t>(best.height), threads, [&](std::size_t row) {
    const Between y = between(static_cast<int>(row), best.height, of_height);
    for (int column = 0; column < best.width; ++column) {
      const Between x = between(column, best.width, of_width);
      const auto seen = [&](const auto& at) { return value_at(x, y, of_width, at); };
      const std::size_t i = index_of(column, static_cast<int>(row), best.width);
      const Vec3 light = seen([&](std::size_t of) { return taken.radiance[of]; });
      const Vec3 scene = seen([&](std::size_t of) { return taken.scene[of]; });
      const Vec3 known = seen([&](std::size_t of) { return unpack_light(before.light[of]); });
      const float share = seen([&](std::size_t of) { return shares[of]; });
      const Vec3 shown = glm::max(light + share * (unpack_light(best.light[i]) - known), Vec3(0.0F));
      image.radiance[i] = shown;
      image.scene[i] = glm::max(shown - (light - scene), Vec3(0.0F));
      image.alpha[i] = seen([&](std::size_t of) { return taken.alpha[of]; });
    }
  });
}

}  // namespace quoin
