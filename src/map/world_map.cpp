#include <quoin/map/world_map.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <span>
#include <system_error>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/thousands.h>
#include <quoin/io/file.h>
#include <quoin/io/image_files.h>
#include <quoin/version.h>

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

/// Begins each stamp: another version of Quoin, or of its own block pack, draws all tiles.
std::uint64_t first_stamp() {
  return hash_of_bytes(kHashSeed, std::as_bytes(std::span(version())));
}
constexpr int kRing = kTileSquares + 2;  // squares along the edge of a tile and its surroundings

TilePlace tile_of(const Square& square) {
  const auto tile = [](int at) { return at >= 0 ? at / kTileSquares : (at + 1) / kTileSquares - 1; };
  return {kMapZoom, tile(square.x), tile(square.z)};
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::file_size(path, error) > 0 && !error;
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
    // Finding changes takes the first part of the time: long in worlds whose files have no times.
    constexpr double kStampsEnd = 0.1;
    const Progress of_stamps = part_of(progress_, 0.0, kStampsEnd);
    const Progress of_tiles = part_of(progress_, kStampsEnd, 1.0);
    auto wanted = find_stamps(of_stamps);
    if (!wanted) return wanted.error();
    if (auto done = remove_others(*wanted); !done) return done.error();
    std::vector<std::vector<TilePlace>> levels = changed_tiles(*wanted);
    std::size_t count = 0;
    for (const auto& level : levels) count += level.size();
    drawn_.tiles_kept = wanted->size() - count;
    // A tile of the last zoom takes most of the time.
    constexpr double kParentSteps = 0.05;
    ProgressSteps steps(of_tiles, levels.empty() ? 1 : levels.front().size() + count / 8);
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
  Result<Stamps> find_stamps(const Progress& progress) {
    const std::vector<Square>& squares = cache_.squares();
    std::vector<std::uint64_t> of_square(squares.size());
    std::mutex mutex;
    std::optional<Error> error;
    ProgressSteps steps(progress, squares.size());
    const auto now = static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count());
    parallel_for(squares.size(), options_.threads, [&](std::size_t i) {
      if (steps.cancelled()) return;
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
      steps.step();
    });
    if (error) return *error;
    if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
    Stamps stamps;
    for (std::size_t i = 0; i < squares.size(); ++i) stamps.try_emplace(tile_of(squares[i]), 0);
    for (auto& [place, stamp] : stamps) stamp = stamp_of_tile(place, of_square);
    add_parents(stamps);
    return stamps;
  }

  std::uint64_t stamp_of_tile(TilePlace place, const std::vector<std::uint64_t>& of_square) const {
    std::uint64_t stamp = first_stamp();
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
        std::uint64_t stamp = first_stamp();
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

  /// Returns the tiles to draw, by zoom from the last one up, neighbours after each other: those whose sources have
  /// changed, and those whose file is missing, with the tiles of lower zooms that they are part of.
  std::vector<std::vector<TilePlace>> changed_tiles(const Stamps& wanted) const {
    std::map<int, std::set<TilePlace>, std::greater<>> by_zoom;
    for (const auto& [place, stamp] : wanted) {
      const auto known = log_.tiles().find(place);
      const bool is_there = known != log_.tiles().end() && known->second.stamp == stamp &&
                            (!known->second.has_file || is_file(layer_.tile(place)));
      if (is_there) continue;
      for (TilePlace each = place; wanted.contains(each) && by_zoom[each.z].insert(each).second;) each = each.parent();
    }
    std::vector<std::vector<TilePlace>> levels;
    for (auto& [zoom, chosen] : by_zoom) {
      std::vector<TilePlace> places(chosen.begin(), chosen.end());
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
      const bool is_tile = image && image->width == map::kTileEdge && image->height == map::kTileEdge;
      if (!is_tile) {
        return make_error(ErrorCode::BadFormat, "a damaged tile; delete it, and the next run draws it again",
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
  auto drawn = MapDrawer(source, opened->layer(), *log, options, progress).draw();
  // The page shows the tiles that exist, also after an error or a cancelled run.
  const Status written = opened->write_page(source, *log);
  if (!drawn) return drawn;
  if (!written && written.error().code != ErrorCode::Unsupported) return written.error();
  if (!written) drawn->warnings.push_back(to_string(written.error()));
  drawn->warnings.insert(drawn->warnings.begin(), source.info().warnings.begin(), source.info().warnings.end());
  for (const Error& error : source.info().broken) drawn->warnings.push_back("left out: " + to_string(error));
  return drawn;
}

}  // namespace quoin
