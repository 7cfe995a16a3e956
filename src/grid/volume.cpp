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

struct TypeInfo {
  std::string_view name;
  std::size_t bytes;
};

/// In the order of ScalarType.
constexpr std::array<TypeInfo, 10> kTypes = {{{"uint8", 1},
                                              {"int8", 1},
                                              {"uint16", 2},
                                              {"int16", 2},
                                              {"uint32", 4},
                                              {"int32", 4},
                                              {"uint64", 8},
                                              {"int64", 8},
                                              {"float32", 4},
                                              {"float64", 8}}};

constexpr std::size_t kBins = 1024;

using Histogram = std::array<double, kBins>;

Histogram histogram_of(const Volume& volume) {
  QUOIN_ASSERT(volume.min < volume.max, "a range of values");
  const double min = volume.min;
  const double bins_per_value = kBins / (static_cast<double>(volume.max) - min);
  Histogram counts{};
  for (const float value : volume.values) {
    if (!std::isfinite(value)) continue;
    const double bin = (static_cast<double>(value) - min) * bins_per_value;
    counts[std::min(kBins - 1, static_cast<std::size_t>(std::max(bin, 0.0)))] += 1.0;
  }
  return counts;
}

/// Returns, up to a constant factor, the variance between the values in the bins up to each bin and the values after
/// it.
std::array<double, kBins> variance_between(const Histogram& counts) {
  double all = 0.0;
  double moment = 0.0;
  for (std::size_t i = 0; i < kBins; ++i) {
    all += counts[i];
    moment += counts[i] * static_cast<double>(i);
  }
  std::array<double, kBins> variance{};
  double below = 0.0;
  double moment_below = 0.0;
  for (std::size_t i = 0; i + 1 < kBins; ++i) {
    below += counts[i];
    moment_below += counts[i] * static_cast<double>(i);
    const double above = all - below;
    if (below == 0.0 || above == 0.0) continue;
    const double difference = moment_below / below - (moment - moment_below) / above;
    variance[i] = below * above * difference * difference;
  }
  return variance;
}

// Returns the value that best separates the finite values into two groups, as surface_value describes.
float volume_threshold(const Volume& volume) {
  if (!(volume.min < volume.max)) return volume.min;
  const auto variance = variance_between(histogram_of(volume));
  const double* const begin = variance.data();
  const double* const end = begin + variance.size();
  const double* const first = std::max_element(begin, end);
  // Empty bins do not change the variance: the threshold is in the middle of them.
  const double* last = first;
  while (last + 1 != end && *(last + 1) == *first) ++last;
  const double bins = (static_cast<double>(first - begin) + static_cast<double>(last - begin)) / 2;
  const double min = volume.min;
  const auto threshold = static_cast<float>(min + (bins + 1.0) * ((static_cast<double>(volume.max) - min) / kBins));
  // There is no float between two consecutive values, and no value is above the greater one.
  return std::min(threshold, std::nextafter(volume.max, volume.min));
}

}  // namespace

std::string_view name_of(ScalarType type) {
  QUOIN_ASSERT(static_cast<std::size_t>(type) < kTypes.size(), "a known type");
  return kTypes[static_cast<std::size_t>(type)].name;
}

std::size_t size_of(ScalarType type) {
  QUOIN_ASSERT(static_cast<std::size_t>(type) < kTypes.size(), "a known type");
  return kTypes[static_cast<std::size_t>(type)].bytes;
}

Result<float> surface_value(const Volume& volume, std::optional<float> iso) {
  const auto all = static_cast<std::int64_t>(volume.values.size());
  if (all > 0 && volume.nan_count == all) {
    return make_error(ErrorCode::InvalidArgument, "cannot find a surface: all values are NaN");
  }
  if (iso) return *iso;
  if (all > 0 && volume.nan_count + volume.infinite_count == all) {
    return make_error(ErrorCode::InvalidArgument, "cannot choose a surface value: no value is finite");
  }
  return volume_threshold(volume);
}

std::optional<double> metres_of_unit(std::string_view unit) {
  struct Unit {
    std::string_view symbol, name, plural;
    double metres;
  };
  constexpr std::array kUnits = {Unit{"m", "meter", "meters", 1.0},
                                 Unit{"m", "metre", "metres", 1.0},
                                 Unit{"cm", "centimeter", "centimeters", 1e-2},
                                 Unit{"cm", "centimetre", "centimetres", 1e-2},
                                 Unit{"mm", "millimeter", "millimeters", 1e-3},
                                 Unit{"mm", "millimetre", "millimetres", 1e-3},
                                 Unit{"um", "micrometer", "micrometers", 1e-6},
                                 Unit{"um", "micrometre", "micrometres", 1e-6},
                                 Unit{"\u00B5m", "micron", "microns", 1e-6},
                                 Unit{"nm", "nanometer", "nanometers", 1e-9},
                                 Unit{"nm", "nanometre", "nanometres", 1e-9}};
  for (const Unit& known : kUnits) {
    if (unit == known.symbol || unit == known.name || unit == known.plural) return known.metres;
  }
  return std::nullopt;
}

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
