#include <quoin/grid/volume.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <quoin/core/assert.h>

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

}  // namespace quoin
