#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/terrain/terrain.h>

namespace quoin::terrain {

/// The cover of a ground column.
enum class Surface : std::uint8_t { Grass, Meadow, Earth, Stone, Sand, Gravel, Snow };
inline constexpr int kSurfaces = 7;
/// Number of layers between bands of darker stone in bare rock.
inline constexpr int kStrata = 11;

/// Returns 0 up to `low`, 1 from `high` on, and a smooth cubic in between.
inline double smooth_step(double low, double high, double x) {
  QUOIN_ASSERT(low < high, "low < high");
  const double t = std::clamp((x - low) * (1.0 / (high - low)), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// A column of ground before caves, plants and rocks.
struct Column {
  int height = 0;   ///< y of the topmost voxel of ground
  int soil = 0;     ///< voxels of earth or sand between it and the stone
  int lowest = 0;   ///< the minimum height of the column and its eight neighbours
  int stratum = 0;  ///< shift of the stone bands, 0 to kStrata - 1
  Surface surface = Surface::Grass;
  bool is_sandy = false;  ///< the soil is sand
  bool is_steep = false;
};

/// The terrain's shape: a function of seed, world height, x and z.
class Landform {
 public:
  explicit Landform(const TerrainOptions& options);

  /// Returns y of the topmost voxel of ground. Cost: 18 evaluations of noise, about half a microsecond.
  [[nodiscard]] int height(int x, int z) const;
  /// As `height`, before rounding down, for smooth ground.
  [[nodiscard]] double exact_height(int x, int z) const { return 1.0 + rise(x, z); }
  /// Cost: nine times `height`.
  [[nodiscard]] Column column(int x, int z) const;
  /// Returns the columns of a square, x fastest. Cost: little more than one `height` each.
  [[nodiscard]] std::vector<Column> columns(int first_x, int first_z, int edge) const;
  /// Returns the forest density: below 0 is bare, 1 is a dense forest.
  [[nodiscard]] double forest(int x, int z) const;

  /// Returns y of the water's topmost voxel; -1 in a dry world.
  [[nodiscard]] int water_level() const { return has_water_ ? sea_ : -1; }
  [[nodiscard]] int sea() const { return sea_; }
  [[nodiscard]] int snow_line() const { return snow_line_; }
  [[nodiscard]] std::uint32_t seed() const { return seed_; }
  /// Returns the world's height in voxels.
  [[nodiscard]] int top() const { return top_; }

 private:
  [[nodiscard]] double elevation(double x, double z) const;
  // Returns the height of the ground's top above the lowest layer.
  [[nodiscard]] double rise(int x, int z) const;
  // `heights` is 3x3, x fastest.
  [[nodiscard]] Column describe(int x, int z, const int* heights, std::size_t stride) const;

  std::uint32_t seed_;
  int top_;
  int sea_;
  int snow_line_;
  bool has_water_;
  double frequency_;  // of the main ridges, per voxel
};

}  // namespace quoin::terrain
