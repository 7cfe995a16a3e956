#include "terrain/landform.h"

#include <algorithm>

#include <quoin/core/assert.h>
#include <quoin/terrain/noise.h>

namespace quoin::terrain {
namespace {

// One stream of noise for each purpose.
constexpr std::uint32_t kWarpX = 0x100;
constexpr std::uint32_t kWarpZ = 0x200;
constexpr std::uint32_t kRegion = 0x300;
constexpr std::uint32_t kHills = 0x400;
constexpr std::uint32_t kRidges = 0x500;
constexpr std::uint32_t kRivers = 0x600;
constexpr std::uint32_t kForest = 0x700;
constexpr std::uint32_t kCover = 0x800;
constexpr std::uint32_t kSpeckle = 0x900;

// Levels in parts of the height that ground may take.
constexpr double kSea = 0.24;
constexpr double kSnow = 0.74;
constexpr double kKnee = 0.70;

// Compresses levels above the knee smoothly, so that 1.3 maps to 1.
double compress(double level) {
  if (level <= kKnee) return std::max(0.0, level);
  const double u = std::min(1.0, (level - kKnee) * (1.0 / (1.3 - kKnee)));
  return kKnee + (1.0 - kKnee) * u * (2.0 - u);
}

}  // namespace

Landform::Landform(const TerrainOptions& options)
    : seed_(mix_bits(static_cast<std::uint32_t>(options.seed) ^
                     mix_bits(static_cast<std::uint32_t>(options.seed >> 32)))),
      top_(options.size.y * kTerrainUnit),
      sea_(static_cast<int>(kSea * top_)),
      snow_line_(static_cast<int>(kSnow * top_)),
      has_water_(options.water),
      frequency_(1.0 / (0.95 * top_)) {
  QUOIN_ASSERT(top_ > 0, "a positive height");
}

double Landform::elevation(double x, double z) const {
  const double px = x * frequency_;
  const double pz = z * frequency_;
  const double wx = px + 0.40 * fractal2(seed_ + kWarpX, 1.1 * px, 1.1 * pz, 2);
  const double wz = pz + 0.40 * fractal2(seed_ + kWarpZ, 1.1 * px, 1.1 * pz, 2);
  const double region = fractal2(seed_ + kRegion, 0.75 * wx, 0.75 * wz, 2);
  const double hills = fractal2(seed_ + kHills, 1.9 * px, 1.9 * pz, 4);
  const double ridges = ridged2(seed_ + kRidges, 0.95 * wx, 0.95 * wz, 4);
  const double mountains = smooth_step(-0.35, 0.45, region);
  const double land = 0.39 + 0.11 * region + 0.08 * hills + (0.16 + 0.60 * mountains) * ridges;
  // Rivers run where a low-frequency noise is zero, and cut the land to just below sea level.
  const double flow = fractal2(seed_ + kRivers, 0.55 * wx, 0.55 * wz, 2);
  const double away = flow < 0.0 ? -flow : flow;
  const double valley = smooth_step(0.015, 0.24, away);
  const double bed = kSea - 0.055 + 0.02 * hills;
  return compress(bed + (land - bed) * valley);
}

double Landform::rise(int x, int z) const {
  const int headroom = std::min(10, top_ / 6);
  const double level = elevation(static_cast<double>(x), static_cast<double>(z));
  return level * static_cast<double>(top_ - 2 - headroom);
}

int Landform::height(int x, int z) const {
  return 1 + static_cast<int>(rise(x, z));
}

Column Landform::describe(int x, int z, const int* heights, std::size_t stride) const {
  QUOIN_ASSERT(heights != nullptr && stride >= 3, "rows of at least three heights");
  Column column;
  column.height = heights[stride + 1];
  column.lowest = column.height;
  int highest = column.height;
  for (std::size_t i = 0; i < 9; ++i) {
    const int height = heights[i / 3 * stride + i % 3];
    column.lowest = std::min(column.lowest, height);
    highest = std::max(highest, height);
  }
  const int slope = highest - column.lowest;
  column.is_steep = slope >= 5;
  const std::uint32_t speckle = hash_of(seed_ + kSpeckle, x, z);
  const auto dither = static_cast<int>(speckle & 3U) - 1;
  const double cover = fractal2(seed_ + kCover, 0.035 * x, 0.035 * z, 2);
  column.soil = column.is_steep ? 0 : std::max(1, 4 - slope / 2);
  column.surface = cover + 0.06 * dither > 0.16 ? Surface::Meadow : Surface::Grass;
  if (column.is_steep) {
    column.surface = Surface::Stone;
  } else if (slope >= 4 && dither > 0) {
    column.surface = Surface::Gravel;
  }
  const int tilt = static_cast<int>((cover + 2.0) * 8.0) + (x >> 4) + (z >> 3);
  column.stratum = (tilt % kStrata + kStrata) % kStrata;
  const int fringe = dither * std::max(1, top_ / 64);
  if (column.height > snow_line_ + fringe && slope < 7) {
    column.surface = Surface::Snow;
    column.soil = 0;
  } else if (column.height > snow_line_ - top_ / 10 + fringe) {
    column.surface = column.is_steep || cover < 0.1 ? Surface::Stone : Surface::Gravel;
    column.soil = 0;
  }
  if (column.height <= sea_ + 1 + (cover > 0.0 ? 1 : 0) && !column.is_steep) {
    column.is_sandy = column.height >= sea_ - 5;
    column.surface = column.is_sandy ? Surface::Sand : Surface::Gravel;
  }
  return column;
}

Column Landform::column(int x, int z) const {
  int heights[9];
  for (int i = 0; i < 9; ++i) heights[i] = height(x + i % 3 - 1, z + i / 3 - 1);
  return describe(x, z, heights, 3);
}

std::vector<Column> Landform::columns(int first_x, int first_z, int edge) const {
  QUOIN_ASSERT(edge > 0, "a positive edge");
  const auto stride = static_cast<std::size_t>(edge) + 2;
  std::vector<int> heights(stride * stride);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    heights[i] = height(first_x + static_cast<int>(i % stride) - 1, first_z + static_cast<int>(i / stride) - 1);
  }
  std::vector<Column> all;
  all.reserve(static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge));
  for (int z = 0; z < edge; ++z) {
    for (int x = 0; x < edge; ++x) {
      const int* corner = heights.data() + static_cast<std::size_t>(z) * stride + static_cast<std::size_t>(x);
      all.push_back(describe(first_x + x, first_z + z, corner, stride));
    }
  }
  return all;
}

double Landform::forest(int x, int z) const {
  return 0.35 + 1.6 * fractal2(seed_ + kForest, 0.022 * x, 0.022 * z, 2);
}

}  // namespace quoin::terrain
