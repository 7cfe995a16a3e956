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

namespace [[gnu::visibility("default")]] quoin {

/// The encoding of heights in an image (PNG).
enum class HeightEncoding : std::uint8_t {
  Grey,       ///< one channel of up to 16 bits: height = level * `metres_per_level`
  Mapbox,     ///< terrain-RGB: (65,536 R + 256 G + B) / 10 - 10,000 metres
  Terrarium,  ///< 256 R + G + B / 256 - 32,768 metres
};

/// Options for converting heights to voxels.
struct HeightOptions {
  /// For images; nullopt: the file is .hgt, not an image.
  std::optional<HeightEncoding> encoding = std::nullopt;
  double metres_per_level = 1.0;  ///< for HeightEncoding::Grey
  /// Distance between neighbouring samples. Default: for .hgt, from its size, at the equator; for images, which do not
  /// store it, 1 metre, with a warning.
  std::optional<double> metres_per_pixel = std::nullopt;
  /// Edge length of a voxel. Default: metres_per_pixel.
  std::optional<double> metres_per_voxel = std::nullopt;
  double vertical_exaggeration = 1.0;  ///< factor on heights
  int depth = 8;                       ///< voxels of ground below the lowest height
  bool as_field = false;               ///< makes a density field with a smooth surface instead of voxels
};

/// Heights on a regular grid.
struct HeightMap {
  int width = 0;                  ///< samples from west to east
  int height = 0;                 ///< rows from north to south
  std::vector<float> metres;      ///< row by row from the north; NaN: unknown (a void)
  double metres_per_pixel = 1.0;  ///< between neighbouring samples
  std::string format;             ///< "hgt", "grey", "mapbox" or "terrarium"
  std::vector<std::string> warnings;
};

/// Reads a height map image, or .hgt (SRTM: big-endian int16, 1201 x 1201 or 3601 x 3601, -32,768 is a void).
///
/// Sources: the SRTM user's guide; Mapbox's "Terrain-RGB v1"; Tilezen's "Terrain tiles in all formats".
/// Errors: BadFormat, with the byte offset where there is one, also for a colour image with HeightEncoding::Grey and a
///         grey image with the others; LimitExceeded beyond 2^28 pixels; InvalidArgument for options out of range.
[[nodiscard]] Result<HeightMap> read_height_map(std::span<const std::byte> bytes, const HeightOptions& options);

/// Converts heights to a scene with one grid. x points east, y up from height 0, z south; the north-west corner is at x
/// = z = 0. A world unit is a metre. Heights between samples are interpolated bilinearly.
///
/// Types:   those of add_terrain_types: grass above earth above stone; stone on slopes steeper than 45 degrees, sand
///          within 2 metres of height 0, snow above 3,000 metres.
/// Voids:   have no ground.
/// Density: distance to the surface, from the local slope; sides and bottom are closed.
/// Order:   the same scene at any thread count.
/// Errors:  InvalidArgument for options out of range; LimitExceeded for more than 2^26 columns, or a column higher than
///          2^16 voxels; Cancelled.
[[nodiscard]] Result<Scene> scene_from_heights(const HeightMap& map, const HeightOptions& options, Threads threads = {},
                                               const Progress& progress = {});

}  // namespace quoin
