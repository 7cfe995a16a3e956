#include <algorithm>
#include <array>
#include <bit>
#include <ctime>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <tuple>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/io/file.h>

#include "core/rows/packed_row.h"
#include "io/format_driver.h"
#include "io/minecraft/block_types.h"
#include "io/minecraft/minecraft.h"
#include "io/minecraft/nbt.h"
#include "io/minecraft/region_file.h"
#include "io/minecraft/sections.h"
#include "io/minecraft/signs.h"

namespace quoin::minecraft {
namespace {

namespace fs = std::filesystem;

constexpr int kChunksOfColumn = kChunkEdge / kSectionEdge;       // game chunks along the edge of a chunk column
constexpr int kColumnsOfRegion = kRegionEdge / kChunksOfColumn;  // along an edge
// Section heights are signed bytes.
constexpr int kLowestChunk = -32;
constexpr int kHighestChunk = 32;
constexpr int kTopOfWorld = kHighestChunk * kChunkEdge;
/// Regions beyond this would have block coordinates outside int32, or too close to its limits for border reads.
constexpr int kMaxRegion = 1 << 21;

struct Region {
  fs::path path;
  RegionName name;
  std::shared_ptr<const RegionFile> file = nullptr;  // for files whose name has no region
};

bool is_too_far(RegionName name) {
  return std::max(std::abs(std::int64_t{name.x}), std::abs(std::int64_t{name.z})) > kMaxRegion;
}

std::vector<Region> regions_in(const fs::path& folder, std::vector<Error>& broken) {
  std::vector<Region> regions;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const auto name = parse_region_name(entry->path());
    if (!name) continue;
    if (is_too_far(*name)) {
      broken.push_back(make_error(ErrorCode::Unsupported, "its position is out of range", entry->path().string()));
      continue;
    }
    regions.push_back({.path = entry->path(), .name = *name});
  }
  const auto place = [](const Region& r) { return std::tuple(r.name.z, r.name.x, r.name.kind, r.path.string()); };
  std::ranges::sort(regions, {}, place);
  // The game leaves the old region file next to its Anvil conversion.
  for (std::size_t i = 1; i < regions.size();) {
    const bool is_same = regions[i].name.x == regions[i - 1].name.x && regions[i].name.z == regions[i - 1].name.z;
    if (!is_same) {
      ++i;
      continue;
    }
    broken.push_back(make_error(ErrorCode::Unsupported,
                                "has the same region as " + regions[i - 1].path.filename().string(),
                                regions[i].path.string()));
    regions.erase(regions.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return regions;
}

/// Keeps a few regions open.
class OpenRegions {
 public:
  explicit OpenRegions(std::vector<Region> regions) : regions_(std::move(regions)) {}
  [[nodiscard]] const Region& operator[](std::size_t i) const { return regions_[i]; }
  [[nodiscard]] std::size_t size() const { return regions_.size(); }

  Result<std::shared_ptr<const RegionFile>> open(std::size_t i) {
    constexpr std::size_t kMaxOpen = 16;
    constexpr std::size_t kMaxExpanded = 3;
    if (regions_[i].file != nullptr) return regions_[i].file;
    const std::scoped_lock lock(mutex_);
    const auto known = std::ranges::find(open_, i, &Open::index);
    if (known != open_.end()) {
      open_.splice(open_.begin(), open_, known);
      return known->file;
    }
    auto file = RegionFile::open(regions_[i].path, regions_[i].name);
    if (!file) return file.error();
    open_.push_front({i, std::move(*file)});
    const std::size_t most = open_.front().file->is_expanded_whole() ? kMaxExpanded : kMaxOpen;
    while (open_.size() > most) open_.pop_back();
    return open_.front().file;
  }

 private:
  struct Open {
    std::size_t index;
    std::shared_ptr<const RegionFile> file;
  };
  std::vector<Region> regions_;
  std::mutex mutex_;
  std::list<Open> open_;
};

/// The columns of 4 x 4 game chunks in a region.
std::vector<IBox> columns_of(const RegionFile& file, RegionName name) {
  std::vector<IBox> columns;
  for (int cz = 0; cz < kColumnsOfRegion; ++cz) {
    for (int cx = 0; cx < kColumnsOfRegion; ++cx) {
      bool is_there = false;
      for (int i = 0; i < kChunksOfColumn * kChunksOfColumn; ++i) {
        is_there |= file.has(cx * kChunksOfColumn + i % kChunksOfColumn, cz * kChunksOfColumn + i / kChunksOfColumn);
      }
      if (!is_there) continue;
      const bool is_old = name.kind == RegionKind::McRegion;
      const IVec3 place{name.x * kColumnsOfRegion + cx, is_old ? 0 : kLowestChunk, name.z * kColumnsOfRegion + cz};
      columns.push_back({place, {place.x + 1, is_old ? 2 : kHighestChunk, place.z + 1}});
    }
  }
  return columns;
}

class MinecraftSource final : public ChunkSource {
 public:
  MinecraftSource(ChunkSourceInfo info, std::vector<IBox> parts, std::vector<std::uint32_t> region_of,
                  std::vector<Region> regions)
      : ChunkSource(std::move(info), std::move(parts)),
        region_of_(std::move(region_of)),
        regions_(std::move(regions)) {}

  VoxelRegistry types() const override { return types_.types(); }

  Result<SourcePart> read_part(std::size_t part) const override {
    SourcePart result;
    ColumnBuilder builder(types_);
    SectionReader reader(types_);
    const Status read = for_each_chunk(part, result.broken, [&](const RegionFile& file, RegionName name, IVec3 chunk) {
      return read_chunk(file, name, chunk, result.broken, [&](nbt::Value root, IVec3 place, auto report) {
        Status put;
        Status sections = reader.read(
            root, SectionOrder::AsStored, kTopOfWorld,
            [&](const Section& section) {
              put = builder.put(section, corner_of(place, section));
              return put.has_value();
            },
            report);
        return put ? sections : put;
      });
    });
    if (!read) return read.error();
    result.chunks = builder.take();
    builder.take_invisible(result);
    return result;
  }

  Result<VisitedColumns> visit_columns(std::size_t part, int top,
                                       FunctionRef<bool(IVec3 voxel, VoxelType type)> visit) const override {
    VisitedColumns result;
    SectionReader reader(types_);
    SectionTypes types;
    const Status read = for_each_chunk(part, result.broken, [&](const RegionFile& file, RegionName name, IVec3 chunk) {
      return read_chunk(file, name, chunk, result.broken, [&](nbt::Value root, IVec3 place, auto report) {
        ++result.chunks;
        add_signs(root, result.signs);
        std::array<std::uint16_t, kSectionEdge> open{};  // columns that go on, by z
        open.fill(0xFFFF);
        Status found;
        Status sections = reader.read(
            root, SectionOrder::Downwards, top,
            [&](const Section& section) {
              found = types.find(section, types_);
              if (!found) return false;
              visit_section(section, types, corner_of(place, section), top, open, visit);
              return std::ranges::any_of(open, [](std::uint16_t columns) { return columns != 0; });
            },
            report);
        return found ? sections : found;
      });
    });
    if (!read) return read.error();
    return result;
  }

  Result<std::uint64_t> part_stamp(std::size_t part) const override {
    std::uint64_t stamp = kHashSeed;
    bool is_sure = true;
    std::vector<Error> broken;
    const Status read = for_each_chunk(part, broken, [&](const RegionFile& file, RegionName, IVec3 chunk) -> Status {
      // The game's times are whole seconds: a chunk can be saved again within the one in which it is read.
      constexpr std::time_t kUnsureSeconds = 2;
      is_sure &= std::time_t{file.time(chunk.x, chunk.z)} + kUnsureSeconds < std::time(nullptr);
      stamp = mixed_with(stamp, static_cast<std::uint64_t>(chunk.z * kRegionEdge + chunk.x));
      stamp = mixed_with(stamp, file.stamp(chunk.x, chunk.z));
      return {};
    });
    if (!read) return read.error();
    if (!broken.empty() || !is_sure) return std::uint64_t{0};
    return stamp == 0 ? 1 : stamp;
  }

 private:
  /// Reads one of the game's chunks: `use(root, place, report)`, with its position in chunks of the game. Reports
  /// broken data. Errors: those of `use`, except BadFormat, which is broken data too.
  template <class Use>
  Status read_chunk(const RegionFile& file, RegionName name, IVec3 chunk, std::vector<Error>& broken, Use use) const {
    const IVec3 place{name.x * kRegionEdge + chunk.x, 0, name.z * kRegionEdge + chunk.z};
    const auto report = [&](const Error& error) {
      Error located = error;
      const std::string where = "chunk (" + std::to_string(place.x) + ", " + std::to_string(place.z) + "): ";
      located.message = where + located.message;
      if (located.byte_offset)
        located.message += " (byte " + std::to_string(*located.byte_offset) + " of the expanded data)";
      located.path = file.path().string();
      located.byte_offset = file.offset(chunk.x, chunk.z);
      broken.push_back(std::move(located));
    };
    auto bytes = file.read(chunk.x, chunk.z);
    constexpr std::size_t kMaxValues = std::size_t{1} << 20;
    constexpr nbt::Limits kLimits{.depth = 512, .nodes = kMaxValues};
    auto document = bytes ? nbt::Document::parse(*bytes, kLimits) : Result<nbt::Document>(bytes.error());
    if (!document || !is_at(document->root(), place)) {
      // The game may have moved the chunk since the region's table was read.
      if (auto moved = read_moved(file, name, chunk)) {
        bytes = std::move(*moved);
        document = nbt::Document::parse(*bytes, kLimits);
      }
    }
    if (!bytes) {
      broken.push_back(bytes.error());
      return {};
    }
    if (!document) {
      report(document.error());
      return {};
    }
    const Status used = use(document->root(), place, report);
    if (!used && used.error().code == ErrorCode::BadFormat) {
      report(used.error());
      return {};
    }
    return used;
  }

  /// Returns false if a chunk says that it belongs elsewhere. Programs that copy chunks may not care.
  static bool is_at(nbt::Value root, IVec3 place) {
    const nbt::Value level = chunk_content(root);
    const auto x = level["xPos"].integer();
    const auto z = level["zPos"].integer();
    return !x || !z || (*x == place.x && *z == place.z);
  }

  /// Reads a chunk by the region's present table, if its entry has changed.
  static std::optional<std::vector<std::byte>> read_moved(const RegionFile& file, RegionName name, IVec3 chunk) {
    if (file.path().empty() || file.is_expanded_whole()) return std::nullopt;
    const auto present = RegionFile::open(file.path(), name);
    const bool has_moved = present && (*present)->has(chunk.x, chunk.z) &&
                           (*present)->stamp(chunk.x, chunk.z) != file.stamp(chunk.x, chunk.z);
    if (!has_moved) return std::nullopt;
    auto bytes = (*present)->read(chunk.x, chunk.z);
    return bytes ? std::optional(std::move(*bytes)) : std::nullopt;
  }

  static IVec3 corner_of(IVec3 place, const Section& section) {
    return IVec3{place.x, section.y, place.z} * kSectionEdge;
  }

  static void visit_section(const Section& section, const SectionTypes& types, IVec3 corner, int top,
                            std::array<std::uint16_t, kSectionEdge>& open,
                            FunctionRef<bool(IVec3 voxel, VoxelType type)> visit) {
    const std::int64_t below = std::int64_t{top} - corner.y;
    for (auto y = static_cast<int>(std::clamp<std::int64_t>(below, -1, kSectionEdge - 1)); y >= 0; --y) {
      for (int z = 0; z < kSectionEdge; ++z) {
        std::uint16_t& columns = open[static_cast<std::size_t>(z)];
        for (unsigned rest = columns; rest != 0; rest &= rest - 1) {
          const int x = std::countr_zero(rest);
          const VoxelType type = types.at(section, x, y, z);
          if (type == kAir || visit(corner + IVec3(x, y, z), type)) continue;
          columns = static_cast<std::uint16_t>(columns & ~(1U << x));
        }
      }
    }
  }

  /// Calls `use(file, name, chunk)` for the game's chunks of a part that exist, while it returns no error; `chunk` is
  /// the position in the region. Does nothing for a region that cannot be opened, and reports it.
  template <class Use>
  Status for_each_chunk(std::size_t part, std::vector<Error>& broken, Use use) const {
    QUOIN_ASSERT(part < parts().size(), "a part of the source");
    QUOIN_ASSERT(region_of_.size() == parts().size(), "one region per part");
    const std::size_t region = region_of_[part];
    const auto file = regions_.open(region);
    if (!file) {
      broken.push_back(file.error());
      return {};
    }
    const IVec3 column = parts()[part].min;
    const RegionName name = regions_[region].name;
    const int first_x = (column.x - name.x * kColumnsOfRegion) * kChunksOfColumn;
    const int first_z = (column.z - name.z * kColumnsOfRegion) * kChunksOfColumn;
    for (int i = 0; i < kChunksOfColumn * kChunksOfColumn; ++i) {
      const IVec3 chunk{first_x + i % kChunksOfColumn, 0, first_z + i / kChunksOfColumn};
      if (!(*file)->has(chunk.x, chunk.z)) continue;
      if (Status used = use(**file, name, chunk); !used) return used;
    }
    return {};
  }

  std::vector<std::uint32_t> region_of_;  // by part
  mutable OpenRegions regions_;
  mutable BlockTypes types_;
};

void read_level(const fs::path& path, ChunkSourceInfo& info) {
  const auto bytes = read_file_beginning(path, std::size_t{16} << 20);
  auto level = bytes ? parse_level_file(*bytes) : Result<LevelFile>(bytes.error());
  if (!level) {
    level.error().path = path.string();
    info.broken.push_back(level.error());
    return;
  }
  info.name = level->name;
  info.version = level->version;
  if (level->spawn_dimension == info.dimension) info.spawn = level->spawn;
}

/// Returns the requested dimension, or the first one.
Result<Dimension> choose_dimension(const WorldFolder& world, std::string_view wanted, const fs::path& path) {
  QUOIN_ASSERT(!world.dimensions.empty(), "a world with regions");
  if (wanted.empty()) return world.dimensions.front();
  const std::string name = dimension_name(wanted);
  const auto found = std::ranges::find(world.dimensions, name, &Dimension::name);
  if (found != world.dimensions.end()) return *found;
  std::string names;
  for (const Dimension& each : world.dimensions) {
    names += (names.empty() ? "" : ", ") + (each.name.empty() ? std::string("one without a name") : each.name);
  }
  return make_error(ErrorCode::InvalidArgument, "cannot read the dimension " + name + ": the world has " + names,
                    path.string());
}

/// Rejects regions of entities and points of interest, which the game stores separately from blocks.
Status check_holds_blocks(const RegionFile& file) {
  for (int i = 0; i < kRegionEdge * kRegionEdge; ++i) {
    const int x = i % kRegionEdge;
    const int z = i / kRegionEdge;
    const auto bytes = file.has(x, z) ? file.read(x, z) : Result<std::vector<std::byte>>(Error{});
    const auto document = bytes ? nbt::Document::parse(*bytes) : Result<nbt::Document>(Error{});
    if (!document) continue;
    const nbt::Value root = document->root();
    const bool is_entities = root["Entities"] && root["Position"] && !root["sections"] && !root["Level"];
    const bool is_points = root["Sections"].tag() == nbt::Tag::Compound;
    if (!is_entities && !is_points) return {};
    return make_error(ErrorCode::Unsupported,
                      std::string("a region file of ") + (is_entities ? "entities" : "points of interest") +
                          ", not blocks; blocks are in the folder \"region\" next to it: name that folder or the world",
                      file.path().string());
  }
  return {};
}

struct WorldRegions {
  ChunkSourceInfo info;
  std::vector<Region> regions;
};

Result<WorldRegions> find_regions(const fs::path& path, std::string_view dimension) {
  WorldRegions found;
  found.info.format = "minecraft";
  std::error_code error;
  if (const auto name = parse_region_name(path); name && fs::is_regular_file(path, error)) {
    if (is_too_far(*name)) return make_error(ErrorCode::Unsupported, "its position is out of range", path.string());
    if (!dimension.empty()) {
      return make_error(ErrorCode::InvalidArgument,
                        "cannot choose a dimension of one region file; name the world's folder", path.string());
    }
    found.regions.push_back({.path = path, .name = *name});
    return found;
  }
  const WorldFolder world = find_dimensions(path);
  const bool is_renamed = fs::is_regular_file(path, error) && path.filename() != "level.dat" && dimension.empty();
  if (is_renamed) {
    found.regions.push_back({.path = path, .name = {}});
    found.info.warnings.emplace_back("the name is not r.X.Z.mca, so the region is placed as r.0.0.mca");
    return found;
  }
  if (world.dimensions.empty()) return no_regions(path);
  const auto chosen = choose_dimension(world, dimension, path);
  if (!chosen) return chosen.error();
  found.info.dimension = chosen->name;
  for (const Dimension& each : world.dimensions) found.info.dimensions.push_back(each.name);
  found.info.warnings = world.warnings;
  found.regions = regions_in(chosen->regions, found.info.broken);
  if (world.level) read_level(*world.level, found.info);
  return found;
}

}  // namespace

bool is_minecraft_folder(const fs::path& path) {
  return !find_dimensions(path).dimensions.empty();
}

Result<std::unique_ptr<ChunkSource>> open_minecraft(const fs::path& path, std::string_view dimension) {
  auto found = find_regions(path, dimension);
  if (!found) return found.error();
  ChunkSourceInfo& info = found->info;
  std::vector<Region>& regions = found->regions;
  std::vector<IBox> parts;
  std::vector<std::uint32_t> region_of;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const auto file = RegionFile::open(regions[i].path, regions[i].name);
    if (!file) {
      if (regions.size() == 1) return file.error();
      info.broken.push_back(file.error());
      continue;
    }
    const std::vector<IBox> columns = columns_of(**file, regions[i].name);
    if (parts.empty() && !columns.empty()) {
      if (auto holds_blocks = check_holds_blocks(**file); !holds_blocks) return holds_blocks.error();
    }
    for (const IBox& column : columns) {
      info.chunks = unite(info.chunks, column);
      parts.push_back(column);
      region_of.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return std::unique_ptr<ChunkSource>(
      new MinecraftSource(std::move(info), std::move(parts), std::move(region_of), std::move(regions)));
}

Result<std::unique_ptr<ChunkSource>> open_minecraft(std::span<const std::byte> region) {
  auto file = RegionFile::of(region);
  if (!file) return file.error();
  if (auto holds_blocks = check_holds_blocks(**file); !holds_blocks) return holds_blocks.error();
  ChunkSourceInfo info;
  info.format = "minecraft";
  std::vector<IBox> parts = columns_of(**file, {});
  for (const IBox& column : parts) info.chunks = unite(info.chunks, column);
  std::vector<std::uint32_t> region_of(parts.size(), 0);
  std::vector<Region> regions;
  regions.push_back({{}, {}, std::move(*file)});
  return std::unique_ptr<ChunkSource>(
      new MinecraftSource(std::move(info), std::move(parts), std::move(region_of), std::move(regions)));
}

namespace {

constexpr std::string_view kOverworld = "minecraft:overworld";

/// The game's own dimensions: short name, name, folder of the older layout.
struct OwnDimension {
  std::string_view short_name;
  std::string_view name;
  std::string_view folder;
};
constexpr std::array<OwnDimension, 3> kOwn = {
    {{"overworld", kOverworld, ""}, {"nether", "minecraft:the_nether", "DIM-1"}, {"end", "minecraft:the_end", "DIM1"}}};

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

std::vector<fs::path> folders_in(const fs::path& folder) {
  std::vector<fs::path> folders;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (is_folder(entry->path())) folders.push_back(entry->path());
  }
  std::ranges::sort(folders);
  return folders;
}

/// Names of dimensions may contain slashes: nested folders. `folders_left` stops at cycles of links.
void add_nested(const fs::path& folder, const std::string& name, int depth, int& folders_left,
                std::vector<Dimension>& found) {
  constexpr int kMaxDepth = 16;
  if (depth >= 2 && has_regions(folder / "region")) found.push_back({name, folder / "region"});
  if (depth == kMaxDepth) return;
  for (const fs::path& inner : folders_in(folder)) {
    const std::string part = inner.filename().string();
    if (part == "region" || --folders_left < 0) continue;
    std::string nested = name;
    if (depth > 0) nested += depth == 1 ? ':' : '/';
    nested += part;
    add_nested(inner, nested, depth + 1, folders_left, found);
  }
}

/// Returns the dimension of a folder "DIM-1", "DIM1", or "DIM7" (mods before 1.16).
std::optional<std::string> name_of_old_folder(const std::string& folder) {
  for (const OwnDimension& own : kOwn) {
    if (!own.folder.empty() && folder == own.folder) return std::string(own.name);
  }
  if (!folder.starts_with("DIM") || folder.size() == 3) return std::nullopt;
  return folder;
}

std::vector<Dimension> all_dimensions(const fs::path& world) {
  std::vector<Dimension> found;
  int folders_left = 10'000;
  add_nested(world / "dimensions", "", 0, folders_left, found);
  if (has_regions(world / "region")) found.push_back({std::string(kOverworld), world / "region"});
  for (const fs::path& folder : folders_in(world)) {
    const auto name = name_of_old_folder(folder.filename().string());
    if (name && has_regions(folder / "region")) found.push_back({*name, folder / "region"});
  }
  return found;
}

/// Returns the level.dat of a world, or of the world that a dimension belongs to.
std::optional<fs::path> level_file_of(const fs::path& path) {
  std::error_code error;
  const fs::path whole = fs::absolute(path, error).lexically_normal();
  fs::path folder = whole.has_filename() ? whole : whole.parent_path();
  constexpr int kMaxLevels = 20;  // WORLD/dimensions/NAMESPACE/NAME/.../region
  for (int i = 0; i < kMaxLevels && folder.has_relative_path(); ++i, folder = folder.parent_path()) {
    if (is_file(folder / "level.dat")) return folder / "level.dat";
  }
  return std::nullopt;
}

/// Returns the name of the dimension whose regions are in a world's subfolder; empty if unknown.
std::string name_of_regions(const fs::path& regions, const std::optional<fs::path>& level) {
  std::error_code error;
  if (level) {
    for (const Dimension& each : all_dimensions(level->parent_path())) {
      if (fs::equivalent(each.regions, regions, error)) return each.name;
    }
  }
  const fs::path folder = fs::absolute(regions, error).lexically_normal().parent_path();
  return name_of_old_folder(folder.filename().string()).value_or("");
}

void sort_dimensions(WorldFolder& world) {
  // The newer layout comes first.
  const auto place = [](const Dimension& each) { return std::tuple(each.name != kOverworld, each.name); };
  std::ranges::stable_sort(world.dimensions, {}, place);
  std::vector<Dimension> unique;
  for (Dimension& each : world.dimensions) {
    if (!unique.empty() && unique.back().name == each.name) {
      world.warnings.push_back("left out: " + each.regions.string() + ": " + unique.back().regions.string() +
                               " holds the same dimension in the newer layout");
    } else {
      unique.push_back(std::move(each));
    }
  }
  world.dimensions = std::move(unique);
}

}  // namespace

std::string dimension_name(std::string_view text) {
  for (const OwnDimension& own : kOwn) {
    if (text == own.short_name) return std::string(own.name);
  }
  const bool is_whole = text.find(':') != std::string_view::npos || text.starts_with("DIM");
  return (is_whole ? "" : "minecraft:") + std::string(text);
}

bool has_regions(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (parse_region_name(entry->path())) return true;
  }
  return false;
}

WorldFolder find_dimensions(const fs::path& path) {
  WorldFolder world;
  const bool is_level = path.filename() == "level.dat" && is_file(path);
  const fs::path folder = is_level ? (path.has_parent_path() ? path.parent_path() : fs::path(".")) : path;
  world.level = level_file_of(folder);
  if (has_regions(folder)) {
    world.dimensions.push_back({name_of_regions(folder, world.level), folder});
    return world;
  }
  const fs::path regions = folder / "region";
  if (!is_file(folder / "level.dat") && has_regions(regions)) {
    if (std::string name = name_of_regions(regions, world.level); !name.empty()) {
      world.dimensions.push_back({std::move(name), regions});
      return world;
    }
  }
  world.dimensions = all_dimensions(folder);
  sort_dimensions(world);
  return world;
}

Error no_regions(const fs::path& path) {
  const fs::path folder = is_file(path) ? path.parent_path() : path;
  if (is_folder(folder / "db")) {
    return make_error(ErrorCode::Unsupported,
                      "a Minecraft Bedrock world, which is not supported; convert it to the Java edition",
                      path.string());
  }
  return make_error(
      ErrorCode::BadFormat,
      "a Minecraft world without region files (region/r.X.Z.mca, or since 26.1 "
      "dimensions/minecraft/overworld/region/r.X.Z.mca): no chunk was saved yet, or the files are missing",
      path.string());
}

Result<LevelFile> parse_level_file(std::span<const std::byte> bytes) {
  constexpr std::size_t kMaxBytes = std::size_t{16} << 20;
  const auto expanded = decompress_file(bytes, kMaxBytes);
  if (!expanded) return expanded.error();
  const auto document = nbt::Document::parse(*expanded);
  if (!document) return document.error();
  const nbt::Value data = document->root()["Data"];
  if (!data) return make_error(ErrorCode::BadFormat, "level.dat has no compound Data");
  LevelFile level;
  level.name = data["LevelName"].text().value_or("");
  level.version = data["Version"]["Name"].text().value_or("");
  const nbt::Value place = data["spawn"]["pos"];
  if (place.is_integers() && place.count() == 3) {
    level.spawn = DVec3(place.integer(0), place.integer(1), place.integer(2));
    if (const auto name = data["spawn"]["dimension"].text()) level.spawn_dimension = *name;
  } else if (const auto x = data["SpawnX"].integer(), y = data["SpawnY"].integer(), z = data["SpawnZ"].integer();
             x && y && z) {
    level.spawn = DVec3(*x, *y, *z);
  }
  return level;
}

}  // namespace quoin::minecraft

namespace quoin {

extern constinit const FormatDriver kMinecraftFormat = {
    .info = {FileFormat::Minecraft, ".mca", "Minecraft world (Java): its folder or one region file",
             FormatCapability::Read | FormatCapability::Chunks},
    .detect_path =
        [](const std::filesystem::path& path) {
          std::error_code error;
          return std::filesystem::is_directory(path, error)
                     ? minecraft::is_minecraft_folder(path)
                     : path.filename() == "level.dat" && std::filesystem::is_regular_file(path, error);
        },
    .detect = minecraft::is_region_file,
    // The reader reports the missing regions of a world that has none.
    .detect_name =
        [](const std::filesystem::path& path, std::span<const std::byte>) {
          std::error_code error;
          return std::filesystem::is_directory(path, error)
                     ? std::filesystem::is_regular_file(path / "level.dat", error)
                     : minecraft::parse_region_name(path).has_value();
        },
    .source = FormatDriver::Source::Path,
    .open_chunks = [](const std::filesystem::path& path, std::span<const std::byte> bytes,
                      std::string_view dimension) -> Result<std::unique_ptr<ChunkSource>> {
      return path.empty() ? minecraft::open_minecraft(bytes) : minecraft::open_minecraft(path, dimension);
    },
};

}  // namespace quoin
