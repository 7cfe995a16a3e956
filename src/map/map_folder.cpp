#include "map/map_folder.h"

#include <algorithm>
#include <cctype>
#include <limits>
#include <map>
#include <span>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

#include <nlohmann/json.hpp>
#include <quoin/core/assert.h>
#include <quoin/io/file.h>

#include "core/bytes/text.h"
#include "core/rows/packed_row.h"
#include "map/map_tile.h"

namespace quoin::map {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// The page's parts, embedded by cmake/QuoinEmbed.cmake.
constexpr std::string_view kIndex =
#include "map_page_index.html.inc"
    ;
constexpr std::string_view kMapStyle =
#include "map_page_map.css.inc"
    ;
constexpr std::string_view kMapScript =
#include "map_page_map.js.inc"
    ;
// Empty in builds without Leaflet.
constexpr std::string_view kLeafletStyle =
#include "map_page_leaflet.css.inc"
    ;
constexpr std::string_view kLeafletScript =
#include "map_page_leaflet.min.js.inc"
    ;

constexpr std::string_view kOverworld = "minecraft:overworld";
constexpr std::string_view kNether = "minecraft:the_nether";
constexpr std::string_view kEnd = "minecraft:the_end";

/// The name of a dimension in files and addresses, and for people.
std::pair<std::string, std::string> names_of(const std::string& dimension) {
  if (dimension.empty() || dimension == kOverworld) return {"overworld", "Overworld"};
  if (dimension == kNether) return {"nether", "Nether"};
  if (dimension == kEnd) return {"end", "The End"};
  // Never a name that leaves the folder, or that of another dimension: other bytes become a dot and their number.
  std::string key;
  for (const char c : dimension) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-') {
      key += c;
    } else {
      constexpr std::string_view kDigits = "0123456789abcdef";
      const auto byte = static_cast<unsigned char>(c);
      key += {'.', kDigits[byte >> 4], kDigits[byte & 15]};
    }
  }
  constexpr std::size_t kMaxName = 200;
  if (key.size() > kMaxName) {
    const std::uint64_t hash = hash_of_bytes(kHashSeed, std::as_bytes(std::span(key)));
    key = key.substr(0, kMaxName) + "-" + std::to_string(hash);
  }
  return {"dimension-" + key, printable(dimension)};
}

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Status write_text(const std::string& text, const fs::path& path) {
  return write_file(std::as_bytes(std::span(text)), path);
}

Status make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return make_error(ErrorCode::CannotWrite, error.message(), folder.string());
  return {};
}

void replace(std::string& text, std::string_view name, std::string_view by) {
  const std::string mark = "{" + std::string(name) + "}";
  const std::size_t at = text.find(mark);
  QUOIN_ASSERT(at != std::string::npos, "a part of the page");
  text.replace(at, mark.size(), by);
}

Result<std::string> index_page() {
  if (kLeafletScript.empty()) {
    return make_error(ErrorCode::Unsupported,
                      "the map has no index.html: Quoin was built without Leaflet (Debian: libjs-leaflet)");
  }
  std::string page(kIndex);
  // From the end, so that marks within the parts are not replaced.
  replace(page, "map.js", kMapScript);
  replace(page, "leaflet.js", kLeafletScript);
  replace(page, "map.css", kMapStyle);
  replace(page, "leaflet.css", kLeafletStyle);
  return page;
}

Json layer_of(const ChunkSource& source, const MapLayer& layer, const MapLog& log) {
  int first_zoom = kMapZoom;
  constexpr int kMost = std::numeric_limits<int>::max();
  int x0 = kMost;
  int z0 = kMost;
  int x1 = -kMost;
  int z1 = -kMost;
  for (const auto& [place, record] : log.tiles()) {
    first_zoom = std::min(first_zoom, place.z);
    if (place.z != kMapZoom || !record.has_file) continue;
    x0 = std::min(x0, place.x);
    z0 = std::min(z0, place.y);
    x1 = std::max(x1, place.x + 1);
    z1 = std::max(z1, place.y + 1);
  }
  if (x0 == kMost) return nullptr;
  const ChunkSourceInfo& info = source.info();
  Json json;
  json["key"] = layer.key;
  json["name"] = names_of(info.dimension).second;
  json["dimension"] = info.dimension;
  json["world"] = info.name;
  json["tiles"] = layer.tiles_name;
  json["extension"] = layer.extension;
  json["zooms"] = {first_zoom, kMapZoom};
  json["bounds"] = {std::int64_t{x0} * kTileEdge, std::int64_t{z0} * kTileEdge, std::int64_t{x1} * kTileEdge,
                    std::int64_t{z1} * kTileEdge};
  const IBox& chunks = info.chunks;
  json["content"] = {std::int64_t{chunks.min.x} * kChunkEdge, std::int64_t{chunks.min.z} * kChunkEdge,
                     std::int64_t{chunks.max.x} * kChunkEdge, std::int64_t{chunks.max.z} * kChunkEdge};
  if (info.spawn) json["spawn"] = {info.spawn->x, info.spawn->y, info.spawn->z};
  return json;
}

Json markers_of(const ChunkSource& source, const MapLog& log) {
  Json markers = Json::array();
  if (const auto& spawn = source.info().spawn) {
    const IVec3 voxel = voxel_of(*spawn);
    markers.push_back({{"x", voxel.x}, {"y", voxel.y}, {"z", voxel.z}, {"kind", "spawn"}, {"text", "Spawn"}});
  }
  for (const auto& [place, record] : log.tiles()) {
    if (record.signs.empty()) continue;
    const Json signs = Json::parse(record.signs, nullptr, false);
    if (!signs.is_array()) continue;
    for (const Json& sign : signs) {
      if (!sign.is_array() || sign.size() != 4) continue;
      markers.push_back({{"x", sign[0]}, {"y", sign[1]}, {"z", sign[2]}, {"kind", "sign"}, {"text", sign[3]}});
    }
  }
  return markers;
}

}  // namespace

fs::path MapLayer::tile(TilePlace place) const {
  return tiles / std::to_string(place.z) / std::to_string(place.x) / (std::to_string(place.y) + "." + extension);
}

Result<MapFolder> MapFolder::open(const fs::path& folder, const ChunkSource& source, const MapOptions& options) {
  const ChunkSourceInfo& info = source.info();
  MapFolder opened;
  opened.folder_ = folder;
  MapLayer& layer = opened.layer_;
  layer.key = names_of(info.dimension).first;
  layer.log = folder / "state" / (layer.key + ".log");
  layer.tiles_name = layer.key == "overworld" ? "tiles" : "tiles/" + layer.key;
  layer.tiles = folder / layer.tiles_name;
  layer.extension = options.tiles == MapTiles::WebP ? "webp" : "png";
  layer.ceiling = options.ceiling;
  constexpr int kNetherCeiling = 100;
  if (!layer.ceiling && info.dimension == kNether) layer.ceiling = kNetherCeiling;
  Json identity;
  identity["format"] = info.format;
  identity["world"] = info.name;
  identity["dimension"] = info.dimension;
  identity["packs"] = info.packs;
  identity["tiles"] = layer.extension;
  if (layer.ceiling) identity["ceiling"] = *layer.ceiling;
  opened.identity_ = text_of(identity);
  if (auto made = make_folder(folder / "state"); !made) return made.error();
  return opened;
}

Status MapFolder::write_page(const ChunkSource& source, const MapLog& log) const {
  const Json layer = layer_of(source, layer_, log);
  const fs::path file = folder_ / "state" / (layer_.key + ".json");
  if (auto done = write_text(text_of({{"layer", layer}, {"markers", markers_of(source, log)}}) + "\n", file); !done) {
    return done;
  }
  // All layers: the overworld first, then by name.
  std::vector<std::pair<std::string, Json>> all;
  std::vector<std::string> gone;
  std::error_code error;
  for (fs::directory_iterator entry(folder_ / "state", error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().extension() != ".json") continue;
    const auto bytes = read_file(entry->path());
    if (!bytes) return bytes.error();
    const Json json =
        Json::parse(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()), nullptr, false);
    if (!json.is_object() || !json.contains("layer") || !json["layer"].is_object()) continue;
    const std::string key = entry->path().stem().string();
    const auto dimension = json["layer"].value("dimension", std::string());
    const std::vector<std::string>& present = source.info().dimensions;
    const bool is_gone = key != layer_.key && !present.empty() && !dimension.empty() &&
                         std::ranges::find(present, dimension) == present.end() && key != "overworld";
    if (is_gone) {
      gone.push_back(key);
    } else {
      all.emplace_back(key, json);
    }
  }
  for (const std::string& key : gone) {
    fs::remove_all(folder_ / "tiles" / key, error);
    fs::remove(folder_ / "state" / (key + ".log"), error);
    fs::remove(folder_ / "state" / (key + ".json"), error);
  }
  std::ranges::sort(all, {}, [](const auto& each) { return std::tuple(each.first != "overworld", each.first); });
  Json layers = Json::array();
  Json markers = Json::object();
  for (const auto& [key, json] : all) {
    layers.push_back(json["layer"]);
    if (json.contains("markers")) markers[key] = json["markers"];
  }
  if (auto done = write_text("window.quoinLayers = " + text_of(layers) + ";\n", folder_ / "layers.js"); !done)
    return done;
  if (auto done = write_text("window.quoinMarkers = " + text_of(markers) + ";\n", folder_ / "markers.js"); !done) {
    return done;
  }
  const auto page = index_page();
  if (!page) return page.error();
  return write_text(*page, folder_ / "index.html");
}

std::string text_of_signs(std::vector<SourceSign> signs) {
  if (signs.empty()) return {};
  std::ranges::sort(signs, {}, [](const SourceSign& sign) {
    return std::tuple(sign.voxel.z, sign.voxel.x, sign.voxel.y, sign.text);
  });
  // A tile of a game has a few; its record in the log must stay far below MapLog's limit.
  constexpr std::size_t kMaxSigns = 1'000;
  if (signs.size() > kMaxSigns) signs.resize(kMaxSigns);
  Json list = Json::array();
  for (const SourceSign& sign : signs) list.push_back({sign.voxel.x, sign.voxel.y, sign.voxel.z, sign.text});
  return text_of(list);
}

}  // namespace quoin::map
