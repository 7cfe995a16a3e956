#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/io/chunk_source.h>
#include <quoin/map/world_map.h>

#include "map/map_log.h"

namespace quoin::map {

/// One map of a folder: a dimension. The page switches between them.
struct MapLayer {
  /// "overworld", "nether", "end", "dimension-NAMESPACE.3aNAME": names files, and the layer in the page's address.
  std::string key;
  std::filesystem::path log;
  std::string tiles_name;  ///< of the folder of tiles, from the map's folder
  std::filesystem::path tiles;
  std::string extension;
  std::optional<int> ceiling;
  [[nodiscard]] std::filesystem::path tile(TilePlace place) const;
};

/// The folder of a world's maps: tiles, the log of each layer, and the page.
class MapFolder {
 public:
  /// Makes the folder if it does not exist. Errors: CannotWrite.
  [[nodiscard]] static Result<MapFolder> open(const std::filesystem::path& folder, const ChunkSource& source,
                                              const MapOptions& options);

  [[nodiscard]] const MapLayer& layer() const { return layer_; }
  /// Returns the world and the options that the layer's tiles depend on, on one line.
  [[nodiscard]] const std::string& identity() const { return identity_; }
  /// Writes index.html; the data of this layer, state/KEY.json; and layers.js and markers.js with those of all layers.
  /// Removes the layers of dimensions that the world no longer has.
  /// Errors: CannotRead, CannotWrite; Unsupported in builds without Leaflet, when all but index.html is written.
  [[nodiscard]] Status write_page(const ChunkSource& source, const MapLog& log) const;

 private:
  std::filesystem::path folder_;
  MapLayer layer_;
  std::string identity_;
};

/// Returns signs as a JSON list of [x, y, z, "text"], sorted by place, at most 1,000; empty if there are none.
[[nodiscard]] std::string text_of_signs(std::vector<SourceSign> signs);

}  // namespace quoin::map
