#include <quoin/grid/volume.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/hash.h>

#include "grid/density/density_storage.h"

namespace quoin {
namespace {

constexpr float kBand = 8.0F;
constexpr Half kSolidSign = 0x8000;

// Positive sizes whose product is the number of values, without overflow.
bool is_consistent(const Volume& volume) {
  const IVec3 size = volume.size;
  if (size.x <= 0 || size.y <= 0 || size.z <= 0) return false;
  const auto plane = static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y);
  const std::uint64_t values = volume.values.size();
  return values % plane == 0 && values / plane == static_cast<std::uint64_t>(size.z);
}

/// A volume's values by place.
class Samples {
 public:
  explicit Samples(const Volume& volume)
      : volume_(volume),
        row_(static_cast<std::size_t>(volume.size.x)),
        plane_(row_ * static_cast<std::size_t>(volume.size.y)) {}

  [[nodiscard]] IVec3 size() const { return volume_.size; }
  [[nodiscard]] const float* row(int y, int z) const {
    QUOIN_ASSERT(y >= 0 && y < volume_.size.y && z >= 0 && z < volume_.size.z, "a row of the volume");
    return volume_.values.data() + static_cast<std::size_t>(z) * plane_ + static_cast<std::size_t>(y) * row_;
  }
  [[nodiscard]] float at(IVec3 p) const {
    QUOIN_ASSERT(p.x >= 0 && p.x < volume_.size.x, "a sample of the volume");
    return row(p.y, p.z)[p.x];
  }
  /// Returns the gradient length at the surface between a sample and the next on `axis`.
  [[nodiscard]] double steepness(IVec3 p, int axis) const {
    IVec3 next = p;
    ++next[axis];
    const double along = double{at(next)} - at(p);
    double sum = along * along;
    for (int other = 0; other < 3; ++other) {
      if (other == axis) continue;
      const double across = 0.5 * (change(p, other) + change(next, other));
      sum += across * across;
    }
    return std::sqrt(sum);
  }

 private:
  // Difference between the previous and the next sample, or fewer at the border.
  [[nodiscard]] double change(IVec3 p, int axis) const {
    IVec3 low = p;
    IVec3 high = p;
    low[axis] = std::max(low[axis] - 1, 0);
    high[axis] = std::min(high[axis] + 1, volume_.size[axis] - 1);
    return low[axis] == high[axis] ? 0.0 : (double{at(high)} - at(low)) / (high[axis] - low[axis]);
  }

  const Volume& volume_;
  std::size_t row_;
  std::size_t plane_;
};

// Finds the edges that the surface crosses, among those that start at the samples of a row: bit `axis` of each entry.
void find_crossings(const Samples& samples, float iso, int y, int z, std::vector<std::uint8_t>& crossed) {
  const IVec3 size = samples.size();
  const auto width = static_cast<std::size_t>(size.x);
  crossed.assign(width, 0);
  const float* row = samples.row(y, z);
  const auto add = [&](const float* next, std::size_t count, unsigned axis) {
    std::uint8_t* out = crossed.data();
    for (std::size_t x = 0; x < count; ++x) {
      const auto differs = static_cast<std::uint8_t>((row[x] > iso) != (next[x] > iso));
      out[x] = static_cast<std::uint8_t>(out[x] | differs << axis);
    }
  };
  add(row + 1, width - 1, 0);
  if (y + 1 < size.y) add(samples.row(y + 1, z), width, 1);
  if (z + 1 < size.z) add(samples.row(y, z + 1), width, 2);
}

// Appends the steepness wherever the surface crosses an edge that starts in a row; `crossed` is room to work in.
void measure_row(const Samples& samples, float iso, int y, int z, std::vector<std::uint8_t>& crossed,
                 std::vector<double>& out) {
  find_crossings(samples, iso, y, z, crossed);
  for (std::size_t x = 0; x < crossed.size(); ++x) {
    if (crossed[x] == 0) continue;
    for (int axis = 0; axis < 3; ++axis) {
      if ((crossed[x] >> axis & 1) == 0) continue;
      const double steepness = samples.steepness({static_cast<int>(x), y, z}, axis);
      if (steepness > 0.0 && std::isfinite(steepness)) out.push_back(steepness);
    }
  }
}

// Steepness where the surface crosses edges, of about one row in `stride`, spread evenly.
std::vector<double> steepness_at_surface(const Samples& samples, float iso, std::uint32_t stride, Threads threads) {
  QUOIN_ASSERT(stride > 0, "a positive stride");
  const IVec3 size = samples.size();
  std::vector<std::vector<double>> found(static_cast<std::size_t>(size.z));
  parallel_for(found.size(), threads, [&](std::size_t i) {
    const int z = static_cast<int>(i);
    std::vector<std::uint8_t> crossed;
    for (int y = 0; y < size.y; ++y) {
      const std::uint32_t shuffled = mix_bits(mix_bits(static_cast<std::uint32_t>(z)) ^ static_cast<std::uint32_t>(y));
      if (shuffled % stride == 0) measure_row(samples, iso, y, z, crossed, found[i]);
    }
  });
  std::vector<double> all;
  for (const std::vector<double>& plane : found) all.insert(all.end(), plane.begin(), plane.end());
  return all;
}

// The change of the value over one sample, straight through the surface.
double slope_of(const Samples& samples, const Volume& volume, float iso, Threads threads) {
  // A few million samples suffice for a median.
  constexpr std::size_t kEnough = std::size_t{1} << 22;
  const auto stride = static_cast<std::uint32_t>(std::min(volume.values.size() / kEnough + 1, kEnough));
  std::vector<double> all = steepness_at_surface(samples, iso, stride, threads);
  if (all.empty() && stride > 1) all = steepness_at_surface(samples, iso, 1, threads);
  if (!all.empty()) {
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
    std::nth_element(all.begin(), middle, all.end());
    return *middle;
  }
  const double range = double{volume.max} - double{volume.min};
  return range > 0.0 && std::isfinite(range) ? range / double{kBand} : 1.0;
}

/// Makes chunks of density from values.
class ChunkMaker {
 public:
  ChunkMaker(const Samples& samples, const VolumeFieldOptions& options, double slope)
      : samples_(samples), options_(options), scale_(1.0 / slope), far_(largest_within(kBand)) {}

  [[nodiscard]] DensityChunk make(IVec3 chunk) const {
    DensityChunk made(far_, options_.material);
    const IVec3 origin = chunk * kChunkEdge;
    const IVec3 count = glm::min(samples_.size() - origin, IVec3(kChunkEdge));
    std::array<Half, kChunkEdge> row;
    for (int z = 0; z < count.z; ++z) {
      for (int y = 0; y < count.y; ++y) {
        const float* values = samples_.row(origin.y + y, origin.z + z) + origin.x;
        row.fill(far_);
        for (int x = 0; x < count.x; ++x) row[static_cast<std::size_t>(x)] = density(values[x]);
        made.write_row(y, z, row);
      }
    }
    made.unite_slabs();
    made.compact();
    return made;
  }

 private:
  [[nodiscard]] Half density(float value) const {
    const double exact = (double{options_.iso} - value) * scale_;
    // Most samples are far from the surface.
    if (exact >= double{kBand}) return far_;
    if (exact <= -double{kBand}) return static_cast<Half>(far_ | kSolidSign);
    if (std::isnan(value)) return far_;
    // Equal infinities have no difference; the value of the surface is air.
    if (value == options_.iso) return stored_within(kDensityAtSurface, far_);
    const auto scaled = static_cast<float>(exact);
    if (scaled != 0.0F) return stored_within(scaled, far_);
    constexpr float kLeast = std::numeric_limits<float>::min();
    return stored_within(value > options_.iso ? -kLeast : kLeast, far_);
  }

  const Samples& samples_;
  const VolumeFieldOptions& options_;
  double scale_;
  Half far_;
};

}  // namespace

Result<DensityGrid> field_from_volume(const Volume& volume, const VolumeFieldOptions& options, Threads threads,
                                      const Progress& progress) {
  if (std::isnan(options.iso)) return make_error(ErrorCode::InvalidArgument, "the surface value must not be NaN");
  if (!is_consistent(volume)) {
    return make_error(ErrorCode::InvalidArgument, "the number of values does not match the volume's size");
  }
  const Samples samples(volume);
  const ChunkMaker maker(samples, options, slope_of(samples, volume, options.iso, threads));
  const IVec3 across = (volume.size - 1) / kChunkEdge + 1;
  const std::size_t row = static_cast<std::size_t>(across.x);
  const std::size_t plane = row * static_cast<std::size_t>(across.y);
  const std::size_t count = plane * static_cast<std::size_t>(across.z);
  // Works in batches, to report progress and to store chunks in a fixed order.
  constexpr std::size_t kBatch = 32;
  DensityGrid field(kBand);
  std::vector<std::optional<DensityChunk>> made(std::min(kBatch, count));
  for (std::size_t first = 0; first < count; first += kBatch) {
    if (progress && !progress(static_cast<double>(first) / static_cast<double>(count))) {
      return make_error(ErrorCode::Cancelled, "cancelled");
    }
    const auto place = [&](std::size_t i) {
      return IVec3{static_cast<int>(i % row), static_cast<int>(i % plane / row), static_cast<int>(i / plane)};
    };
    const std::size_t batch = std::min(kBatch, count - first);
    parallel_for(batch, threads, [&](std::size_t i) { made[i] = maker.make(place(first + i)); });
    for (std::size_t i = 0; i < batch; ++i) field.put_chunk(place(first + i), std::move(*made[i]));
  }
  if (progress) progress(1.0);
  return field;
}

}  // namespace quoin
