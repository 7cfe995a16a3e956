#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/chunk_source.h>
#include <quoin/io/formats.h>

namespace [[gnu::visibility("default")]] quoin {

/// The highest zoom of a map, where a pixel is a voxel. Each lower one halves its size.
inline constexpr int kMapZoom = 18;

/// The file format of a map's tiles. Both are lossless.
enum class MapTiles : std::uint8_t { WebP, Png };

struct MapOptions {
  MapTiles tiles = MapTiles::WebP;
  /// Cuts the world at this height. Where it is solid there, the map shows the first surface below the next air.
  /// nullopt: 100 in Minecraft's nether, which has a roof; other dimensions are not cut.
  std::optional<int> ceiling{};
  Threads threads{};
};

/// The result of drawing a map.
struct DrawnMap {
  std::uint64_t tiles_written = 0;
  std::uint64_t tiles_kept = 0;     ///< tiles of the map whose content has not changed
  std::uint64_t tiles_removed = 0;  ///< tiles of deleted chunks
  std::uint64_t chunks = 0;         ///< chunks that were read; 16 x 16 blocks in Minecraft
  std::uint64_t bytes = 0;          ///< of the written tiles
  std::vector<std::string> warnings{};
};

/// Opens a world to draw: of Minecraft or Luanti, as open_chunk_source; the largest grid of a .quoin world; or the
/// scene of any other file with voxels, which is loaded whole (load_scene).
///
/// Errors: those of open_chunk_source, WorldStore and load_scene; Unsupported for scenes with density fields, voxels of
///         different sizes, or rotations other than by multiples of 90 degrees.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_map_source(const std::filesystem::path& path,
                                                                   const LoadOptions& options = {},
                                                                   Threads threads = {}, const Progress& progress = {});

/// Draws a world as seen from straight above, or brings its map up to date: tiles for a map viewer, a page that shows
/// them, and markers.
///
///   auto source = quoin::open_map_source("saves/New World");
///   quoin::draw_map(**source, "map");  // then open map/index.html
///
/// Tiles:   FOLDER/tiles/Z/X/Y.webp, of 256 x 256 pixels. At zoom kMapZoom the pixel (0, 0) of tile (0, 0) is the
///          column of voxels at x = 0, z = 0; x grows to the right (east), z downwards (south). Four tiles of zoom
///          Z + 1 make one of zoom Z, until tiles -1 and 0 cover the world. Dimensions other than the overworld are in
///          FOLDER/tiles/NAME.
/// Look:    the mean colours of the types' upper faces, darkened by relief (light from the north-west), by higher
///          ground around (the share of the sky that is seen), and in water by depth.
/// Updates: FOLDER/state has a stamp of each tile's sources. Tiles with unchanged sources are kept, and those without
///          chunks are removed. A run that was interrupted, also by a power cut, continues. Files appear whole or not
///          at all.
/// Live:    Minecraft may save chunks meanwhile; the next run draws them. Other sources must not change.
/// Damage:  an unreadable chunk is a hole in the map; warnings name and count them.
/// Order:   the same world gives the same files, on any number of threads and however it was interrupted.
/// Memory:  about 100 MB, and 2 kB per tile of zoom kMapZoom.
/// Errors:  CannotRead, CannotWrite; InvalidArgument if the folder holds a map of another world or with other options,
///          or another process draws it; Unsupported for WebP in builds without it; Cancelled.
[[nodiscard]] Result<DrawnMap> draw_map(const ChunkSource& source, const std::filesystem::path& folder,
                                        const MapOptions& options = {}, const Progress& progress = {});

}  // namespace quoin
