#include "io/packs/node_pack.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>
#include <quoin/core/assert.h>
#include <quoin/core/axis_orientation.h>
#include <quoin/io/file.h>

#include "core/bytes/bytes.h"
#include "core/bytes/files.h"
#include "core/bytes/text.h"
#include "io/image/image_codecs.h"
#include "io/luanti/luanti.h"
#include "io/packs/pack_own.h"
#include "io/packs/patterns/pack_patterns.h"

namespace quoin::packs {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using FileBytes = std::optional<std::vector<std::byte>>;

constexpr char kNodeFamilyTable[] =
#include "block_pack_node_families.json.inc"
    ;
constexpr char kNodeRuleTable[] =
#include "block_pack_node_rules.json.inc"
    ;
constexpr char kTileTable[] =
#include "block_pack_node_tiles.json.inc"
    ;

constexpr std::string_view kTileFolder = "assets/luanti/textures/block/";
constexpr std::string_view kTileEnd = ".png";

/// Returns NAME of "assets/luanti/textures/block/NAME.png"; empty for other paths.
std::string_view tile_of(std::string_view path) {
  if (!path.starts_with(kTileFolder) || !path.ends_with(kTileEnd)) return {};
  path.remove_prefix(kTileFolder.size());
  path.remove_suffix(kTileEnd.size());
  return path.find('/') == std::string_view::npos ? path : std::string_view();
}

/// The textures of tiles: the own pack's textures by other names ("=stone"), and recipes.
struct Tiles {
  NamePatterns names;
  std::vector<std::string> own;  // by row: the name of the own pack's texture, or empty for a recipe
  TextureRecipes recipes;
};

/// Returns a layer with "#RRGGBB" instead of "@default:stone", the colour of that node.
std::string with_node_colour(const std::string& layer) {
  std::vector<std::string> parts = words(layer);
  for (std::string& part : parts) {
    if (!part.starts_with('@')) continue;
    const auto node = models::node_properties(std::string_view(part).substr(1));
    QUOIN_ASSERT(node, "a node other than air");
    constexpr std::string_view kDigits = "0123456789ABCDEF";
    part = "#";
    for (const std::uint8_t byte : {node->colour.r, node->colour.g, node->colour.b}) {
      part += kDigits[byte >> 4U];
      part += kDigits[byte & 15U];
    }
  }
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : " ") + part;
  return text;
}

Tiles parse_tiles() {
  const Json rows = Json::parse(kTileTable, nullptr, false);
  Tiles tiles;
  Json recipes = Json::array();
  for (const Json& row : rows) {
    const auto names = row[0].get<std::string>();
    const auto first = row[1].get<std::string>();
    const Status added = tiles.names.add(names, tiles.own.size());
    QUOIN_ASSERT(added, "tiles of one row");
    tiles.own.push_back(first.starts_with('=') ? first.substr(1) : "");
    if (first.starts_with('=')) continue;
    Json recipe = {names};
    for (std::size_t i = 1; i < row.size(); ++i) recipe.push_back(with_node_colour(row[i].get<std::string>()));
    recipes.push_back(std::move(recipe));
  }
  auto made = TextureRecipes::from_text(recipes.dump());
  QUOIN_ASSERT(made, "valid recipes, which tests check");
  tiles.recipes = std::move(*made);
  return tiles;
}

const Tiles& tiles() {
  static const Tiles parsed = parse_tiles();
  return parsed;
}

/// Draws a tile: by its row, else by the words of its name.
Result<FileBytes> draw_tile(std::string_view name, std::size_t max_bytes) {
  const auto own = [&](const std::string& path) { return OwnPack::instance()->read(path, max_bytes); };
  if (const auto match = tiles().names.find(name)) {
    const std::string& other = tiles().own[match->row];
    if (!other.empty()) return own("assets/minecraft/textures/block/" + with_stars(other, match->stars) + ".png");
    const auto image = tiles().recipes.draw({"minecraft", "block/" + std::string(name)});
    if (image) {
      auto png = encode_png(PngImage{kPatternSize, kPatternSize, 4, image->rgba}, PngEffort::Quick);
      if (!png) return png.error();
      return FileBytes(std::move(*png));
    }
  }
  // "moreblocks_oak_planks" may be a texture of the own pack without the name of the mod.
  for (std::size_t at = name.find('_'); at != std::string_view::npos; at = name.find('_', at + 1)) {
    auto found = own("assets/minecraft/textures/block/" + std::string(name.substr(at + 1)) + ".png");
    if (!found || *found) return found;
  }
  return own("assets/quoin/textures/block/luanti/" + std::string(name) + ".png");
}

/// The PNG files of a folder, by name.
class NodeFolder final : public PackFiles {
 public:
  /// Requires: an absolute folder without links.
  NodeFolder(fs::path folder, std::map<std::string, fs::path, std::less<>> files)
      : folder_(std::move(folder)), files_(std::move(files)) {}

  [[nodiscard]] bool has_tiles() const override { return true; }
  [[nodiscard]] std::string identity() const override { return "folder " + folder_.string(); }

  [[nodiscard]] Result<FileBytes> read(std::string_view path, std::size_t max_bytes) const override {
    constexpr std::string_view kAnimationEnd = ".mcmeta";
    const bool is_animation = path.ends_with(kAnimationEnd);
    if (is_animation) path.remove_suffix(kAnimationEnd.size());
    const auto found = files_.find(tile_of(path));
    if (found == files_.end()) return FileBytes();
    const fs::path& file = found->second;
    if (const auto inside = check_inside(folder_, file); !inside) return inside.error();
    if (is_animation) return animation_of(file);
    auto bytes = read_file_beginning(file, max_bytes + 1);
    if (!bytes) return bytes.error();
    if (bytes->size() > max_bytes) {
      return make_error(ErrorCode::LimitExceeded, "a file of more than " + std::to_string(max_bytes) + " bytes",
                        file.string());
    }
    return FileBytes(std::move(*bytes));
  }

  [[nodiscard]] bool has(std::string_view path) const override {
    return path.ends_with(kTileEnd) ? files_.contains(tile_of(path)) : PackFiles::has(path);
  }

 private:
  /// Returns the text of an animation if the image is higher than wide, a whole number of times.
  [[nodiscard]] static Result<FileBytes> animation_of(const fs::path& file) {
    constexpr std::size_t kHeader = 24;
    const auto bytes = read_file_beginning(file, kHeader);
    if (!bytes) return bytes.error();
    if (bytes->size() < kHeader) return FileBytes();
    const auto width = load<std::uint32_t>(bytes->data() + 16, std::endian::big);
    const auto height = load<std::uint32_t>(bytes->data() + 20, std::endian::big);
    if (width == 0 || height <= width || height % width != 0) return FileBytes();
    constexpr std::string_view kText = "{\"animation\": {}}";
    const auto text = std::as_bytes(std::span(kText));
    return FileBytes(std::vector<std::byte>(text.begin(), text.end()));
  }

  fs::path folder_;
  std::map<std::string, fs::path, std::less<>> files_;
};

}  // namespace

std::string tile_path(std::string_view name) {
  if (name.ends_with(kTileEnd)) name.remove_suffix(kTileEnd.size());
  return std::string(kTileFolder).append(name).append(kTileEnd);
}

std::string tile_without_end(std::string_view path) {
  const std::string_view tile = tile_of(path);
  for (const std::string_view end : {"_top", "_bottom", "_side", "_front"}) {
    if (tile.size() > end.size() && tile.ends_with(end)) return tile_path(tile.substr(0, tile.size() - end.size()));
  }
  return {};
}

StateOrientations node_orientations(std::string_view turn) {
  // A facedir is an axis for the top, then quarter turns about the node's own vertical axis, in left-handed axes.
  const auto facedir = [](int value) {
    constexpr std::array<std::pair<int, int>, 6> kTops = {{{1, 0}, {0, -1}, {0, 1}, {2, -1}, {2, 1}, {2, 2}}};
    const auto [axis, quarters] = kTops[static_cast<std::size_t>(value / 4 % 6)];
    return AxisOrientation::quarter_turns(axis, quarters) * AxisOrientation::quarter_turns(1, -(value % 4));
  };
  StateOrientations made{.front = Direction::NegZ};
  if (turn == "facedir") {
    for (int value = 0; value < 32; ++value) made.by_value.push_back(facedir(value % 24));
  } else if (turn == "4dir") {
    for (int value = 0; value < 4; ++value) made.by_value.push_back(facedir(value));
  } else if (turn == "wallmounted") {
    // The facedir that turns the floor to the wall: at +y, -y, +x, -x, +z, -z, and twice more at +y and -y.
    for (const int value : {20, 0, 17, 15, 8, 6, 21, 1}) made.by_value.push_back(facedir(value));
  }
  return made;
}

std::optional<std::uint32_t> turned_node_state(const VoxelProperties& type, std::uint32_t state,
                                               const AxisOrientation& turn) {
  const BlockFamilies::Traits traits = NodePack::families().traits(split_resource_name(type.name));
  const bool is_upright = turn.apply(Direction::PosY) == Direction::PosY;
  if (traits.turn.empty()) return is_upright || traits.is_full ? std::optional(state) : std::nullopt;
  const StateOrientations orientations = node_orientations(traits.turn);
  AxisOrientation wanted = turn * orientations.of(state);
  if (wanted.is_mirrored()) {
    // A mirror that leaves the node as it is turns the orientation into a rotation.
    wanted = wanted * (traits.mirror == "diagonal" ? AxisOrientation::mirror(2) * AxisOrientation::quarter_turns(1, 1)
                                                   : AxisOrientation::mirror(0));
  }
  const auto found = std::ranges::find(orientations.by_value, wanted);
  if (found == orientations.by_value.end()) return std::nullopt;
  return orientations.with_value(state, static_cast<std::size_t>(found - orientations.by_value.begin()));
}

const BlockFamilies& NodePack::families() {
  static const BlockFamilies parsed = [] {
    auto made = BlockFamilies::from_text(kNodeFamilyTable, kNodeRuleTable, "luanti");
    QUOIN_ASSERT(made, "valid tables, which tests check");
    return std::move(*made);
  }();
  return parsed;
}

Result<FileBytes> NodePack::read(std::string_view path, std::size_t max_bytes) const {
  if (!is_pack_path(path)) return FileBytes();
  FileBytes bytes;
  const auto use = [&](const std::string& text) {
    bytes.emplace(text.size());
    std::memcpy(bytes->data(), text.data(), text.size());
  };
  if (const auto node = pack_file_name(path, "blockstates/", ".json")) {
    use(families().block_state(*node));
  } else if (const auto model = pack_file_name(path, "models/", ".json")) {
    if (const auto text = families().model(*model)) use(*text);
  } else if (const std::string_view tile = tile_of(path); draws_tiles_ && !tile.empty()) {
    return draw_tile(tile, max_bytes);
  }
  if (bytes && bytes->size() > max_bytes) {
    return make_error(ErrorCode::LimitExceeded, "a file of more than " + std::to_string(max_bytes) + " bytes",
                      std::string(path));
  }
  return bytes;
}

bool is_node_folder(const fs::path& folder) {
  constexpr std::array kFiles = {"game.conf",   "mod.conf",          "modpack.conf",
                                 "modpack.txt", "texture_pack.conf", "init.lua"};
  std::error_code error;
  return std::ranges::any_of(kFiles, [&](const char* name) { return fs::is_regular_file(folder / name, error); }) ||
         fs::is_directory(folder / "mods", error) || fs::is_directory(folder / "textures", error);
}

Result<std::map<std::string, fs::path, std::less<>>> tiles_of_folder(const fs::path& folder) {
  constexpr int kMaxDepth = 8;
  constexpr std::size_t kMaxFiles = 100'000;
  std::error_code error;
  const bool is_texture_pack = fs::is_regular_file(folder / "texture_pack.conf", error);
  std::vector<fs::path> found;
  std::size_t seen = 0;
  fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (++seen > kMaxFiles) {
      return make_error(ErrorCode::LimitExceeded, "a Luanti folder with more than 100,000 files", folder.string());
    }
    if (entry.depth() >= kMaxDepth) entry.disable_recursion_pending();
    const fs::path& path = entry->path();
    if (path.extension() != ".png") continue;
    const fs::path below = path.lexically_relative(folder);
    const bool is_tile = is_texture_pack || std::ranges::find(below, fs::path("textures")) != below.end();
    std::error_code ignored;
    if (is_tile && entry->is_regular_file(ignored)) found.push_back(path);
  }
  if (error) {
    return make_error(ErrorCode::CannotRead, "cannot list the folder: " + error.message(), folder.string());
  }
  std::ranges::sort(found);
  std::map<std::string, fs::path, std::less<>> files;
  for (fs::path& path : found) {
    std::string name = path.stem().string();
    files.insert_or_assign(std::move(name), std::move(path));
  }
  return files;
}

Result<std::shared_ptr<const PackFiles>> open_node_folder(const fs::path& folder) {
  std::error_code error;
  fs::path real = fs::canonical(folder, error);
  if (error) return make_error(ErrorCode::CannotRead, "cannot find the folder: " + error.message(), folder.string());
  auto files = tiles_of_folder(real);
  if (!files) return files.error();
  return std::shared_ptr<const PackFiles>(std::make_shared<NodeFolder>(std::move(real), std::move(*files)));
}

}  // namespace quoin::packs
