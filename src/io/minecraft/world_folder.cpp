#include "io/minecraft/world_folder.h"

#include <algorithm>
#include <array>
#include <system_error>
#include <tuple>
#include <utility>

#include "io/minecraft/nbt.h"
#include "io/minecraft/region_file.h"

namespace quoin::minecraft {

namespace {

namespace fs = std::filesystem;

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
