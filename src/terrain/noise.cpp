#include <quoin/terrain/noise.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <quoin/core/assert.h>

#include "terrain/noise_lattice.h"

namespace quoin {
namespace {

// A coordinate as a lattice cell and a position in it.
struct Lattice {
  std::int32_t cell;
  double in_cell;

  explicit Lattice(double x) : cell(static_cast<std::int32_t>(x)) {
    if (x < static_cast<double>(cell)) --cell;
    in_cell = x - static_cast<double>(cell);
  }
};

constexpr double kWidest = 1 << 30;

double fade(double t) {
  return t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
}

double mix(double a, double b, double t) {
  return a + t * (b - a);
}

struct Gradient2 {
  double x, y;
};

// Every 22.5 degrees, none along an axis.
constexpr double kNear = 0.98078528040323044913;
constexpr double kFar = 0.19509032201612826785;
constexpr double kMore = 0.83146961230254523708;
constexpr double kLess = 0.55557023301960222474;
constexpr std::array<Gradient2, 16> kGradients2 = {{{kNear, kFar},
                                                    {kMore, kLess},
                                                    {kLess, kMore},
                                                    {kFar, kNear},
                                                    {-kFar, kNear},
                                                    {-kLess, kMore},
                                                    {-kMore, kLess},
                                                    {-kNear, kFar},
                                                    {-kNear, -kFar},
                                                    {-kMore, -kLess},
                                                    {-kLess, -kMore},
                                                    {-kFar, -kNear},
                                                    {kFar, -kNear},
                                                    {kLess, -kMore},
                                                    {kMore, -kLess},
                                                    {kNear, -kFar}}};

double corner2(std::uint32_t seed, std::int32_t x, std::int32_t y, double dx, double dy) {
  const Gradient2 g = kGradients2[hash_of(seed, x, y) >> 28];
  return g.x * dx + g.y * dy;
}

struct Gradient3 {
  double x, y, z;
};

// The middles of a cube's edges; four of them twice, so that there are 16.
constexpr std::array<Gradient3, 16> kGradients3 = {{{1, 1, 0},
                                                    {-1, 1, 0},
                                                    {1, -1, 0},
                                                    {-1, -1, 0},
                                                    {1, 0, 1},
                                                    {-1, 0, 1},
                                                    {1, 0, -1},
                                                    {-1, 0, -1},
                                                    {0, 1, 1},
                                                    {0, -1, 1},
                                                    {0, 1, -1},
                                                    {0, -1, -1},
                                                    {1, 1, 0},
                                                    {-1, 1, 0},
                                                    {0, -1, 1},
                                                    {0, -1, -1}}};

double corner3(std::uint32_t seed, std::int32_t x, std::int32_t y, std::int32_t z, double dx, double dy, double dz) {
  const Gradient3 g = kGradients3[hash_of(seed, x, y, z) >> 28];
  return g.x * dx + g.y * dy + g.z * dz;
}

}  // namespace

double noise2(std::uint32_t seed, double x, double y) {
  QUOIN_ASSERT(std::abs(x) < kWidest && std::abs(y) < kWidest, "|x|, |y| < 2^30");
  const Lattice lx(x);
  const Lattice ly(y);
  const double u = fade(lx.in_cell);
  const double near = mix(corner2(seed, lx.cell, ly.cell, lx.in_cell, ly.in_cell),
                          corner2(seed, lx.cell + 1, ly.cell, lx.in_cell - 1.0, ly.in_cell), u);
  const double far = mix(corner2(seed, lx.cell, ly.cell + 1, lx.in_cell, ly.in_cell - 1.0),
                         corner2(seed, lx.cell + 1, ly.cell + 1, lx.in_cell - 1.0, ly.in_cell - 1.0), u);
  return mix(near, far, fade(ly.in_cell));
}

double noise3(std::uint32_t seed, double x, double y, double z) {
  QUOIN_ASSERT(std::abs(x) < kWidest && std::abs(y) < kWidest && std::abs(z) < kWidest, "|x|, |y|, |z| < 2^30");
  // A rotation by 60 degrees about (1, 1, 1): all nine entries are thirds.
  constexpr double kThird = 1.0 / 3.0;
  const Lattice lx((2.0 * x - y + 2.0 * z) * kThird);
  const Lattice ly((2.0 * x + 2.0 * y - z) * kThird);
  const Lattice lz((2.0 * y + 2.0 * z - x) * kThird);
  const double u = fade(lx.in_cell);
  const auto along_x = [&](std::int32_t j, std::int32_t k) {
    const double dy = ly.in_cell - static_cast<double>(j);
    const double dz = lz.in_cell - static_cast<double>(k);
    return mix(corner3(seed, lx.cell, ly.cell + j, lz.cell + k, lx.in_cell, dy, dz),
               corner3(seed, lx.cell + 1, ly.cell + j, lz.cell + k, lx.in_cell - 1.0, dy, dz), u);
  };
  const double v = fade(ly.in_cell);
  return mix(mix(along_x(0, 0), along_x(1, 0), v), mix(along_x(0, 1), along_x(1, 1), v), fade(lz.in_cell));
}

namespace {

// Twice the frequency, and rotated by the angle of the 3-4-5 triangle.
void next_octave(double& x, double& y) {
  const double turned_x = 1.6 * x - 1.2 * y;
  y = 1.2 * x + 1.6 * y;
  x = turned_x;
}

// Each octave has twice the frequency; the last octave uses noise2's coordinates.
[[maybe_unused]] bool are_within(double x, double y, int octaves) {
  return octaves >= 0 && octaves <= 29 && std::abs(x) < std::ldexp(1.0, 29 - octaves) &&
         std::abs(y) < std::ldexp(1.0, 29 - octaves);
}

}  // namespace

double fractal2(std::uint32_t seed, double x, double y, int octaves) {
  QUOIN_ASSERT(are_within(x, y, octaves), "|x|, |y| < 2^(29 - octaves)");
  double sum = 0.0;
  double amplitude = 1.0;
  for (int octave = 0; octave < octaves; ++octave) {
    sum += amplitude * noise2(seed + static_cast<std::uint32_t>(octave), x, y);
    amplitude *= 0.5;
    next_octave(x, y);
  }
  return sum;
}

double ridged2(std::uint32_t seed, double x, double y, int octaves) {
  QUOIN_ASSERT(are_within(x, y, octaves), "|x|, |y| < 2^(29 - octaves)");
  double sum = 0.0;
  double amplitude = 0.55;
  double weight = 1.0;
  for (int octave = 0; octave < octaves; ++octave) {
    const double noise = noise2(seed + static_cast<std::uint32_t>(octave), x, y);
    const double crest = 1.0 - std::min(1.0, 1.4 * (noise < 0.0 ? -noise : noise));
    const double ridge = crest * crest * weight;
    sum += amplitude * ridge;
    amplitude *= 0.45;
    weight = std::min(1.0, 1.6 * ridge);
    next_octave(x, y);
  }
  return sum;
}

}  // namespace quoin

namespace quoin::terrain {
namespace {

constexpr float kParts = 1.0F / kLatticeStep;

// Sample -1 lies in the lattice's first cell, three quarters along.
int cell_of(int i) {
  return (i + kLatticeStep - 1) / kLatticeStep;
}

float place_in_cell(int i) {
  return static_cast<float>((i + kLatticeStep - 1) % kLatticeStep) * kParts;
}

}  // namespace

void Field::upsample(const Lattice& lattice) {
  std::array<float, kLatticeEdge> between;
  for (int z = 0; z < kFieldEdge; ++z) {
    const float tz = place_in_cell(z);
    for (int y = 0; y < kFieldEdge; ++y) {
      const float ty = place_in_cell(y);
      const float* v00 = lattice.row(cell_of(y), cell_of(z));
      const float* v10 = lattice.row(cell_of(y) + 1, cell_of(z));
      const float* v01 = lattice.row(cell_of(y), cell_of(z) + 1);
      const float* v11 = lattice.row(cell_of(y) + 1, cell_of(z) + 1);
      for (std::size_t i = 0; i < between.size(); ++i) {
        const float low = v00[i] + ty * (v10[i] - v00[i]);
        const float high = v01[i] + ty * (v11[i] - v01[i]);
        between[i] = low + tz * (high - low);
      }
      float* out = row(y, z);
      for (int x = 0; x < kFieldEdge; ++x) {
        const auto cell = static_cast<std::size_t>(cell_of(x));
        out[x] = between[cell] + place_in_cell(x) * (between[cell + 1] - between[cell]);
      }
    }
  }
}

}  // namespace quoin::terrain
