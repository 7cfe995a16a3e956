#include "io/packs/pack_own.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>

#include <nlohmann/json.hpp>
#include <quoin/core/assert.h>
#include <quoin/grid/texture.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "io/image/image_codecs.h"
#include "io/minecraft/block_looks.h"
#include "io/packs/block_models.h"
#include "io/packs/block_states.h"
#include "io/packs/pack_shapes.h"
#include "io/packs/patterns/pack_patterns.h"
#include "io/zip.h"

namespace quoin::packs {

namespace {

constexpr std::size_t kMaxLayers = 8;

constexpr char kFamilyTable[] =
#include "block_pack_families.json.inc"
    ;
constexpr char kRuleTable[] =
#include "block_pack_rules.json.inc"
    ;
constexpr char kTextureTable[] =
#include "block_pack_textures.json.inc"
    ;

constexpr char kEmissionTable[] =
#include "block_pack_emission.json.inc"
    ;

std::optional<std::uint32_t> parse_colour(std::string_view text) {
  if (text.size() != 7 || text[0] != '#') return std::nullopt;
  std::uint32_t rgb = 0;
  const auto [end, error] = std::from_chars(text.data() + 1, text.data() + text.size(), rgb, 16);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return rgb;
}

/// Returns the colour of a block; `name` may be a texture's, such as "furnace_side".
Rgba8 colour_of_block(const ResourceName& block) {
  constexpr std::array<std::string_view, 8> kEnds = {"_top",  "_side", "_front", "_bottom",
                                                     "_back", "_end",  "_inner", "_on"};
  std::string name = block.path;
  for (const std::string_view end : kEnds) {
    if (name.ends_with(end) && name.size() > end.size()) name.resize(name.size() - end.size());
  }
  const minecraft::BlockLook whole = minecraft::look_of_block(block.space + ":" + block.path, false, false);
  if (whole.knowledge == minecraft::Knowledge::Table || name == block.path) return whole.colour;
  return minecraft::look_of_block(block.space + ":" + name, false, false).colour;
}

/// Returns the gain that gives the greys, clamped to 1, this weighted mean.
float gain_for(const std::vector<std::pair<float, float>>& greys_and_weights, float mean) {
  float low = 0.0F;
  float high = 1'024.0F;
  constexpr int kSteps = 40;
  for (int i = 0; i < kSteps; ++i) {
    const float gain = std::sqrt(std::max(low, 1e-6F) * high);
    float sum = 0.0F;
    float weights = 0.0F;
    for (const auto& [grey, weight] : greys_and_weights) {
      sum += weight * std::min(1.0F, gain * grey);
      weights += weight;
    }
    (sum < mean * weights ? low : high) = gain;
  }
  return high;
}

/// Draws a pattern in a colour over an image. The mean of the layer's visible texels is the colour, in linear light.
void add_layer(const Pattern& pattern, Vec3 colour, float opacity, std::array<Vec3, 256>& image,
               std::array<float, 256>& alpha) {
  std::array<float, 256> light{};
  std::vector<std::pair<float, float>> weighted;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    const auto grey = static_cast<std::uint8_t>(std::lround(std::clamp(pattern[i].grey, 0.0F, 1.0F) * 255.0F));
    light[i] = linear_colour({grey, grey, grey}).x;
    if (pattern[i].alpha > 0.0F) weighted.emplace_back(light[i], pattern[i].alpha);
  }
  Vec3 gain{0.0F};
  for (int channel = 0; channel < 3; ++channel) gain[channel] = gain_for(weighted, colour[channel]);
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    const float over = pattern[i].alpha * opacity;
    if (over <= 0.0F) continue;
    Vec3 texel{0.0F};
    for (int channel = 0; channel < 3; ++channel) texel[channel] = std::min(1.0F, gain[channel] * light[i]);
    const float sum = over + alpha[i] * (1.0F - over);
    image[i] = (texel * over + image[i] * (alpha[i] * (1.0F - over))) * (1.0F / sum);
    alpha[i] = sum;
  }
}

}  // namespace

std::optional<ResourceName> pack_file_name(std::string_view path, std::string_view folder, std::string_view end) {
  constexpr std::string_view kTop = "assets/";
  if (!path.starts_with(kTop) || !path.ends_with(end)) return std::nullopt;
  path = path.substr(kTop.size(), path.size() - kTop.size() - end.size());
  const std::size_t slash = path.find('/');
  if (slash == std::string_view::npos || !path.substr(slash + 1).starts_with(folder)) return std::nullopt;
  ResourceName name{std::string(path.substr(0, slash)), std::string(path.substr(slash + 1 + folder.size()))};
  return name.path.empty() ? std::nullopt : std::optional(std::move(name));
}

namespace {

std::vector<std::byte> bytes_of(const std::string& text) {
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

}  // namespace

Result<TextureRecipes> TextureRecipes::from_text(std::string_view table) {
  using Json = nlohmann::json;
  const Json rows = Json::parse(table, nullptr, false);
  if (!rows.is_array()) return make_error(ErrorCode::BadFormat, "the table of textures is no JSON list");
  TextureRecipes made;
  for (const Json& row : rows) {
    const auto fault = [&](const std::string& reason) {
      return make_error(ErrorCode::BadFormat, "texture " + row.dump().substr(0, 60) + ": " + reason);
    };
    if (!row.is_array() || row.size() < 2 || row.size() > kMaxLayers + 1) {
      return fault("must have names and 1 to " + std::to_string(kMaxLayers) + " layers");
    }
    std::vector<Layer> layers;
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (!row[i].is_string()) return fault("must be texts");
      if (i == 0) continue;
      const auto text = row[i].get<std::string>();
      const std::vector<std::string> parts = words(text);
      if (parts.size() < 2 || parts.size() > 4) return fault("a layer is a pattern, a colour and factors: " + text);
      if (!has_pattern(parts[0])) return fault("no pattern " + parts[0]);
      if (parts[1][0] == '#' && !parse_colour(parts[1])) return fault("invalid colour " + parts[1]);
      Layer layer{parts[0], parts[1]};
      for (std::size_t k = 2; k < parts.size(); ++k) {
        const auto number = parse_float(std::string_view(parts[k]).substr(1));
        const bool is_factor = parts[k][0] == 'x' || parts[k][0] == 'a';
        if (!is_factor || !number || *number < 0.0F || *number > 8.0F) return fault("invalid factor " + parts[k]);
        (parts[k][0] == 'x' ? layer.brightness : layer.alpha) = *number;
      }
      layers.push_back(std::move(layer));
    }
    for (const std::string& name : words(row[0].get<std::string>())) {
      NamePatterns& names = name.find('/') == std::string::npos ? made.names_ : made.names_in_folders_;
      if (auto status = names.add(name, made.rows_.size()); !status) return fault(status.error().message);
    }
    made.rows_.push_back(std::move(layers));
  }
  return made;
}

std::optional<AlphaImage> TextureRecipes::draw(const ResourceName& texture) const {
  constexpr std::string_view kFolder = "block/";
  if (!texture.path.starts_with(kFolder)) return std::nullopt;
  ResourceName name{texture.space, texture.path.substr(kFolder.size())};
  const bool is_in_folder = name.path.find('/') != std::string::npos;
  auto match = is_in_folder ? names_in_folders_.find(name.path) : names_.find(name.path);
  if (!match && texture.space == "quoin") {  // "quoin:block/SPACE/NAME": of an unknown block
    const std::size_t slash = name.path.find('/');
    if (slash != std::string::npos) name = {name.path.substr(0, slash), name.path.substr(slash + 1)};
    match = names_.find(name.path);
    if (!match) match = names_.find("unknown");
  }
  if (!match) return std::nullopt;
  if (name.space == "quoin") name.space = "minecraft";
  std::array<Vec3, 256> image{};
  std::array<float, 256> alpha{};
  for (const Layer& layer : rows_[match->row]) {
    Rgba8 colour{};
    if (const auto fixed = parse_colour(layer.colour)) {
      colour = minecraft::colour_of_rgb(*fixed);
    } else {
      std::string block = with_stars(replaced(layer.colour, "self", name.path), match->stars);
      colour = colour_of_block({name.space, std::move(block)});
    }
    add_layer(*draw_pattern(layer.pattern), linear_colour(colour) * layer.brightness, layer.alpha, image, alpha);
  }
  AlphaImage made{kPatternSize, kPatternSize, std::vector<std::uint8_t>(image.size() * 4)};
  for (std::size_t i = 0; i < image.size(); ++i) {
    const Rgba8 texel = srgb_colour(image[i]);
    const auto a = static_cast<std::uint8_t>(std::lround(std::clamp(alpha[i], 0.0F, 1.0F) * 255.0F));
    const std::array<std::uint8_t, 4> bytes = {texel.r, texel.g, texel.b, a};
    std::ranges::copy(bytes, made.rgba.begin() + static_cast<std::ptrdiff_t>(i * 4));
  }
  return made;
}

const EmissionRules& EmissionRules::instance() {
  static const EmissionRules rules = [] {
    auto made = EmissionRules::from_text(kEmissionTable);
    QUOIN_ASSERT(made, "a valid table in the library");
    return std::move(*made);
  }();
  return rules;
}

const std::shared_ptr<const OwnPack>& OwnPack::instance() {
  static const std::shared_ptr<const OwnPack> pack = [] {
    auto families = BlockFamilies::from_text(kFamilyTable, kRuleTable);
    auto recipes = TextureRecipes::from_text(kTextureTable);
    QUOIN_ASSERT(families && recipes, "valid tables, which tests check");
    return std::make_shared<const OwnPack>(std::move(*families), std::move(*recipes));
  }();
  return pack;
}

Result<std::optional<std::vector<std::byte>>> OwnPack::read(std::string_view path, std::size_t max_bytes) const {
  using Found = std::optional<std::vector<std::byte>>;
  if (!is_pack_path(path)) return Found();
  Found bytes;
  if (const auto block = pack_file_name(path, "blockstates/", ".json")) {
    bytes = bytes_of(families_.block_state(*block));
  } else if (const auto model = pack_file_name(path, "models/", ".json")) {
    if (const auto text = families_.model(*model)) bytes = bytes_of(*text);
  } else if (const auto texture = pack_file_name(path, "textures/", ".png")) {
    if (const auto image = recipes_.draw(*texture)) {
      auto png = encode_png(PngImage{kPatternSize, kPatternSize, 4, image->rgba}, PngEffort::Quick);
      if (!png) return png.error();
      bytes = std::move(*png);
    }
  }
  if (bytes && bytes->size() > max_bytes) {
    return make_error(ErrorCode::LimitExceeded, "a file of more than " + std::to_string(max_bytes) + " bytes",
                      std::string(path));
  }
  return bytes;
}

namespace {

constexpr std::size_t kMaxZipFiles = 65'535;

/// Adds the files of a block by path: the block states, their models, and the textures that these name.
Status add_files(const OwnPack& pack, ModelReader& models, const ResourceName& block,
                 std::map<std::string, std::vector<std::byte>>& files) {
  // Blocks of mods may name textures that no recipe draws.
  const auto add = [&](const std::string& path) -> Status {
    if (files.contains(path)) return {};
    auto bytes = pack.read(path, kMaxImageBytes);
    if (!bytes) return bytes.error();
    if (*bytes) files.emplace(path, std::move(**bytes));
    return {};
  };
  const std::string path = "assets/" + block.space + "/blockstates/" + block.path + ".json";
  if (auto done = add(path); !done) return done;
  const auto found = files.find(path);
  if (found == files.end()) {
    return make_error(ErrorCode::InvalidArgument,
                      "the name of a block is too long: " + std::to_string(to_string(block).size()) + " letters");
  }
  const auto states = parse_block_states(nlohmann::json::parse(text_of(found->second)));
  if (!states) return states.error();
  for (const StateCase& each : states->cases) {
    for (const StateModel& shown : each.models) {
      const auto name = resource_name(shown.model);
      const auto model = models.model(shown.model);
      if (!model) return model.error();
      if (!name || *model == nullptr) {
        return make_error(ErrorCode::InvalidArgument, to_string(block) + " has no model " + shown.model);
      }
      if (auto done = add("assets/" + name->space + "/models/" + name->path + ".json"); !done) return done;
      for (const auto& [variable, text] : (*model)->textures) {
        const auto texture = (*model)->texture(text);
        if (!texture) continue;
        auto done = add("assets/" + texture->space + "/textures/" + texture->path + ".png");
        if (!done) return done;
      }
    }
  }
  return {};
}

}  // namespace

Result<std::vector<std::byte>> OwnPack::zip(std::span<const std::string> blocks) const {
  std::map<std::string, std::vector<std::byte>> files;
  // Format 46 is that of version 1.21.4; later versions read it with a warning.
  files["pack.mcmeta"] = bytes_of(R"({"pack": {"pack_format": 46, "description": "The block pack of Quoin"}})");
  ModelReader models(*this);
  for (const std::string& block : blocks) {
    const auto name = resource_name(block);
    if (!name) {
      return make_error(ErrorCode::InvalidArgument,
                        "\"" + printable(block.substr(0, 100)) + "\" is not the name of a block");
    }
    if (auto done = add_files(*this, models, *name, files); !done) return done.error();
    if (files.size() > kMaxZipFiles) {
      return make_error(ErrorCode::LimitExceeded, "the pack has more than " + std::to_string(kMaxZipFiles) + " files");
    }
  }
  ZipFile zip;
  for (const auto& [path, bytes] : files) {
    zip.begin(path);
    zip.put(text_of(bytes));
  }
  return zip.take();
}

}  // namespace quoin::packs
