#include <quoin/map/world_map.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <mutex>
#include <span>
#include <system_error>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/thousands.h>
#include <quoin/io/file.h>
#include <quoin/io/image_files.h>

#include "core/rows/packed_row.h"
#include "core/work/progress_steps.h"
#include "map/column_surface.h"
#include "map/map_folder.h"
#include "map/map_log.h"
#include "map/map_tile.h"

namespace quoin {

namespace {

namespace fs = std::filesystem;
using map::kTileSquares;
using map::MapLog;
using map::Square;
using map::SurfaceCache;
using map::TilePlace;
using map::TileRecord;
using map::TileSurfaces;

/// Part of each stamp: raise it when tiles of the same world look different.
constexpr std::uint64_t kLookVersion = 1;
constexpr int kRing = kTileSquares + 2;  // squares along the edge of a tile and its surroundings

TilePlace tile_of(const Square& square) {
  const auto tile = [](int at) { return at >= 0 ? at / kTileSquares : (at + 1) / kTileSquares - 1; };
  return {kMapZoom, tile(square.x), tile(square.z)};
}

/// Interleaves the bits of both coordinates, so that neighbours are drawn soon after each other.
std::uint64_t morton_of(TilePlace place) {
  const auto spread = [](int at) {
    std::uint64_t bits = static_cast<std::uint32_t>(at) ^ 0x8000'0000U;
    bits = (bits | bits << 16) & 0x0000'FFFF'0000'FFFFU;
    bits = (bits | bits << 8) & 0x00FF'00FF'00FF'00FFU;
    bits = (bits | bits << 4) & 0x0F0F'0F0F'0F0F'0F0FU;
    bits = (bits | bits << 2) & 0x3333'3333'3333'3333U;
    return (bits | bits << 1) & 0x5555'5555'5555'5555U;
  };
  return spread(place.x) | spread(place.y) << 1;
}

/// The stamps of all tiles that a map has, by place.
using Stamps = std::map<TilePlace, std::uint64_t>;

/// Draws the tiles of one map.
class MapDrawer {
 public:
  MapDrawer(const ChunkSource& source, map::MapLayer layer, MapLog& log, const MapOptions& options,
            const Progress& progress)
      : source_(source),
        layer_(std::move(layer)),
        log_(log),
        options_(options),
        progress_(progress),
        cache_(source, layer_.ceiling) {}

  Result<DrawnMap> draw() {
    auto wanted = find_stamps();
    if (!wanted) return wanted.error();
    if (auto done = remove_others(*wanted); !done) return done.error();
    std::vector<std::vector<TilePlace>> levels = changed_tiles(*wanted);
    std::size_t count = 0;
    for (const auto& level : levels) count += level.size();
    drawn_.tiles_kept = wanted->size() - count;
    // A tile of the last zoom takes most of the time.
    constexpr double kParentSteps = 0.05;
    ProgressSteps steps(progress_, levels.empty() ? 1 : levels.front().size() + count / 8);
    for (std::size_t i = 0; i < levels.size(); ++i) {
      const Status done = draw_level(levels[i], *wanted, i == 0 ? 1.0 : kParentSteps, steps);
      if (!done) return done.error();
    }
    if (auto done = log_.compact(); !done) return done.error();
    add_counts();
    return drawn_;
  }

 private:
  /// Returns the stamps of all tiles: of those of the last zoom from the parts that they show or that darken them, of
  /// others from the four that they are made of.
  Result<Stamps> find_stamps() {
    const std::vector<Square>& squares = cache_.squares();
    std::vector<std::uint64_t> of_square(squares.size());
    std::mutex mutex;
    std::optional<Error> error;
    const auto now = static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count());
    parallel_for(squares.size(), options_.threads, [&](std::size_t i) {
      std::uint64_t stamp = kHashSeed;
      for (const std::size_t part : squares[i].parts) {
        const auto own = source_.part_stamp(part);
        if (!own) {
          const std::scoped_lock lock(mutex);
          error = own.error();
          return;
        }
        // An unknown stamp never equals a later one.
        stamp = mixed_with(stamp, *own == 0 ? mixed_with(now, part) : *own);
      }
      of_square[i] = stamp;
    });
    if (error) return *error;
    Stamps stamps;
    for (std::size_t i = 0; i < squares.size(); ++i) stamps.try_emplace(tile_of(squares[i]), 0);
    for (auto& [place, stamp] : stamps) stamp = stamp_of_tile(place, of_square);
    add_parents(stamps);
    return stamps;
  }

  std::uint64_t stamp_of_tile(TilePlace place, const std::vector<std::uint64_t>& of_square) const {
    std::uint64_t stamp = mixed_with(kHashSeed, kLookVersion);
    for (int i = 0; i < kRing * kRing; ++i) {
      const auto square = cache_.find(place.x * kTileSquares - 1 + i % kRing, place.y * kTileSquares - 1 + i / kRing);
      if (square) stamp = mixed_with(mixed_with(stamp, static_cast<std::uint64_t>(i)), of_square[*square]);
    }
    return stamp;
  }

  /// Adds the tiles of lower zooms, until tiles -1 and 0 cover the map.
  static void add_parents(Stamps& stamps) {
    std::vector<TilePlace> level;
    for (const auto& [place, stamp] : stamps) level.push_back(place);
    const auto is_at_middle = [](TilePlace place) {
      return place.x >= -1 && place.x <= 0 && place.y >= -1 && place.y <= 0;
    };
    while (!level.empty() && level.front().z > 0 && !std::ranges::all_of(level, is_at_middle)) {
      std::vector<TilePlace> parents;
      for (const TilePlace place : level) parents.push_back(place.parent());
      std::ranges::sort(parents);
      parents.erase(std::unique(parents.begin(), parents.end()), parents.end());
      for (const TilePlace parent : parents) {
        std::uint64_t stamp = mixed_with(kHashSeed, kLookVersion);
        for (int i = 0; i < 4; ++i) {
          const auto child = stamps.find(parent.child(i));
          if (child != stamps.end())
            stamp = mixed_with(mixed_with(stamp, static_cast<std::uint64_t>(i)), child->second);
        }
        stamps[parent] = stamp;
      }
      level = std::move(parents);
    }
  }

  /// Removes the tiles of the last run that the map no longer has.
  Status remove_others(const Stamps& wanted) {
    std::vector<TilePlace> gone;
    for (const auto& [place, record] : log_.tiles()) {
      if (!wanted.contains(place)) gone.push_back(place);
    }
    for (const TilePlace place : gone) {
      std::error_code error;
      if (log_.tiles().at(place).has_file) fs::remove(layer_.tile(place), error);
      if (error) return make_error(ErrorCode::CannotWrite, error.message(), layer_.tile(place).string());
      if (auto done = log_.remove(place); !done) return done;
      ++drawn_.tiles_removed;
    }
    return {};
  }

  /// Returns the tiles to draw, by zoom from the last one up, neighbours after each other.
  std::vector<std::vector<TilePlace>> changed_tiles(const Stamps& wanted) const {
    std::map<int, std::vector<TilePlace>, std::greater<>> by_zoom;
    for (const auto& [place, stamp] : wanted) {
      const auto known = log_.tiles().find(place);
      if (known == log_.tiles().end() || known->second.stamp != stamp) by_zoom[place.z].push_back(place);
    }
    std::vector<std::vector<TilePlace>> levels;
    for (auto& [zoom, places] : by_zoom) {
      std::ranges::sort(places, {}, morton_of);
      levels.push_back(std::move(places));
    }
    return levels;
  }

  Status draw_level(const std::vector<TilePlace>& places, const Stamps& wanted, double weight, ProgressSteps& steps) {
    std::mutex mutex;
    std::optional<Error> error;
    std::atomic<bool> has_failed{false};
    // The log changes while tiles are drawn, but not the level below.
    parallel_for(places.size(), options_.threads, [&](std::size_t i) {
      if (has_failed || steps.cancelled()) return;
      const TilePlace place = places[i];
      Status done = place.z == kMapZoom ? draw_last(place, wanted.at(place)) : draw_parent(place, wanted.at(place));
      if (done) {
        steps.add(weight);
        return;
      }
      const std::scoped_lock lock(mutex);
      if (!error) error = done.error();
      has_failed = true;
    });
    if (error) return *error;
    if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
    return {};
  }

  Status draw_last(TilePlace place, std::uint64_t stamp) {
    TileSurfaces surfaces;
    std::vector<SourceSign> signs;
    for (int i = 0; i < kRing * kRing; ++i) {
      const int x = place.x * kTileSquares - 1 + i % kRing;
      const int z = place.y * kTileSquares - 1 + i / kRing;
      auto surface = cache_.read(x, z);
      if (!surface) return surface.error();
      surfaces[static_cast<std::size_t>(i)] = std::move(*surface);
      const auto square = cache_.find(x, z);
      if (!square || tile_of(cache_.squares()[*square]) != place) continue;
      for (SourceSign& sign : cache_.signs_of(*square)) signs.push_back(std::move(sign));
    }
    return write(place, stamp, map::draw_tile(surfaces), map::text_of_signs(std::move(signs)));
  }

  Status draw_parent(TilePlace place, std::uint64_t stamp) {
    std::array<std::optional<AlphaImage>, 4> children;
    for (int i = 0; i < 4; ++i) {
      const TilePlace child = place.child(i);
      const auto record = log_.find(child);
      if (!record || !record->has_file) continue;
      auto image = read_alpha_image(layer_.tile(child));
      if (!image) return image.error();
      if (image->width != map::kTileEdge || image->height != map::kTileEdge) {
        return make_error(ErrorCode::BadFormat, "not a tile of this map; delete the folder to draw it again",
                          layer_.tile(child).string());
      }
      children[static_cast<std::size_t>(i)] = std::move(*image);
    }
    return write(place, stamp, map::draw_parent(children), {});
  }

  /// Writes a tile, or removes the old one if all of it is transparent.
  Status write(TilePlace place, std::uint64_t stamp, const std::optional<AlphaImage>& image, std::string signs) {
    const fs::path file = layer_.tile(place);
    std::uint64_t bytes = 0;
    std::error_code error;
    if (image) {
      fs::create_directories(file.parent_path(), error);
      if (error) return make_error(ErrorCode::CannotWrite, error.message(), file.parent_path().string());
      const auto written =
          options_.tiles == MapTiles::WebP ? write_webp(*image, file, WebPEffort::Quick) : write_png(*image, file);
      if (!written) return written.error();
      bytes = *written;
    } else {
      fs::remove(file, error);
    }
    if (auto done = log_.put(place, {stamp, image.has_value(), std::move(signs)}); !done) return done;
    const std::scoped_lock lock(mutex_);
    ++drawn_.tiles_written;
    drawn_.bytes += bytes;
    return {};
  }

  void add_counts() {
    const SurfaceCache::Counts counts = cache_.counts();
    drawn_.chunks = counts.chunks;
    constexpr std::size_t kMostLines = 5;
    for (std::size_t i = 0; i < std::min(counts.broken.size(), kMostLines); ++i) {
      drawn_.warnings.push_back("a hole in the map: " + to_string(counts.broken[i]));
    }
    if (counts.broken.size() > kMostLines) {
      drawn_.warnings.push_back(with_thousands(static_cast<std::int64_t>(counts.broken.size() - kMostLines)) +
                                " more holes of unreadable content");
    }
  }

  const ChunkSource& source_;
  map::MapLayer layer_;
  MapLog& log_;
  const MapOptions& options_;
  const Progress& progress_;
  SurfaceCache cache_;
  std::mutex mutex_;
  DrawnMap drawn_;
};

}  // namespace

Result<DrawnMap> draw_map(const ChunkSource& source, const fs::path& folder, const MapOptions& options,
                          const Progress& progress) {
  if (options.tiles == MapTiles::WebP && !has_webp()) {
    return make_error(ErrorCode::Unsupported, "cannot write WebP tiles: Quoin was built without libwebp; choose PNG");
  }
  auto opened = map::MapFolder::open(folder, source, options);
  if (!opened) return opened.error();
  auto log = MapLog::open(opened->layer().log, opened->identity());
  if (!log) return log.error();
  // The page first: it shows the tiles that exist already.
  if (auto done = opened->write_page(source, *log); !done) return done.error();
  auto drawn = MapDrawer(source, opened->layer(), *log, options, progress).draw();
  if (!drawn) return drawn;
  if (auto done = opened->write_page(source, *log); !done) return done.error();
  drawn->warnings.insert(drawn->warnings.begin(), source.info().warnings.begin(), source.info().warnings.end());
  for (const Error& error : source.info().broken) drawn->warnings.push_back("left out: " + to_string(error));
  return drawn;
}

}  // namespace quoin
