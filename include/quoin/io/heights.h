#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// How a picture (PNG) says heights.
enum class HeightEncoding : std::uint8_t {
  Grey,       ///< one channel of up to 16 bits: a height is its level times `metres_per_level`
  Mapbox,     ///< terrain-RGB: (65,536 R + 256 G + B) / 10 - 10,000 metres
  Terrarium,  ///< 256 R + G + B / 256 - 32,768 metres
};

/// What becomes of heights.
struct HeightOptions {
  /// Of a picture. Nothing: the file is no picture but .hgt.
  std::optional<HeightEncoding> encoding = std::nullopt;
  double metres_per_level = 1.0;  ///< of HeightEncoding::Grey
  /// Between neighbouring samples. Nothing: of .hgt what its size says, at the equator; of pictures, which do not say,
  /// 1 metre, with a warning.
  std::optional<double> metres_per_pixel = std::nullopt;
  /// Along a voxel's edge. Nothing: metres_per_pixel.
  std::optional<double> metres_per_voxel = std::nullopt;
  double vertical_exaggeration = 1.0;  ///< heights are multiplied by it
  int depth = 8;                       ///< voxels of ground below the lowest height
  bool as_field = false;               ///< densities, whose surface is smooth, rather than voxels
};

/// Heights on a regular lattice.
struct HeightMap {
  int width = 0;                  ///< samples from west to east
  int height = 0;                 ///< rows from north to south
  std::vector<float> metres;      ///< row by row from the north; NaN where none is known (a void)
  double metres_per_pixel = 1.0;  ///< between neighbours
  std::string format;             ///< "hgt", "grey", "mapbox" or "terrarium"
  std::vector<std::string> warnings;
};

/// Reads a picture of heights, or .hgt (SRTM: big-endian int16, 1201 x 1201 or 3601 x 3601, -32,768 a void).
///
/// Sources: the SRTM user's guide; Mapbox's "Terrain-RGB v1"; Tilezen's "Terrain tiles in all formats".
/// Errors: BadFormat, with the byte offset where there is one, also for a picture of colours with HeightEncoding::Grey
///         and of greys with the others; LimitExceeded beyond 2^28 pixels; InvalidArgument for options out of range.
[[nodiscard]] Result<HeightMap> read_height_map(std::span<const std::byte> bytes, const HeightOptions& options);

/// The landscape as one grid: x to the east, y upwards from height 0, z to the south, the north-west corner at x = z =
/// 0; a world unit is a metre. Between samples heights are interpolated (bilinear).
///
/// Types:   those of add_terrain_types: grass, with earth below and stone below that; stone where it is steeper than 45
///          degrees, sand within 2 metres of height 0, snow above 3,000 metres.
/// Voids:   have no ground.
/// Density: distances to the surface, of which the slope is the local one; sides and bottom are closed.
/// Order:   the same scene at any thread count.
/// Errors:  InvalidArgument for options out of range; LimitExceeded where it would have more than 2^26 columns, or one
///          higher than 2^16 voxels; Cancelled.
[[nodiscard]] Result<Scene> scene_from_heights(const HeightMap& map, const HeightOptions& options, Threads threads = {},
                                               const Progress& progress = {});

}  // namespace quoin
