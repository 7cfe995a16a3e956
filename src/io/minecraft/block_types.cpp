#include "io/minecraft/block_types.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin::minecraft {

namespace {

// Properties whose values are words, the commonest first. Booleans and numbers need no line.
struct Words {
  std::string_view key;
  std::vector<std::string_view> values;
};

const std::vector<Words>& word_tables() {
  static const std::vector<std::string_view> side = {"none", "low", "tall", "false", "true", "side", "up"};
  static const std::vector<Words> tables = {
      {"attachment", {"floor", "ceiling", "single_wall", "double_wall"}},
      {"axis", {"y", "x", "z"}},
      {"candles", {"1", "2", "3", "4"}},
      {"delay", {"1", "2", "3", "4"}},
      {"east", side},
      {"eggs", {"1", "2", "3", "4"}},
      {"face", {"wall", "floor", "ceiling"}},
      {"facing", {"north", "south", "west", "east", "up", "down"}},
      {"flower_amount", {"1", "2", "3", "4"}},
      {"half", {"bottom", "top", "lower", "upper"}},
      {"hinge", {"left", "right"}},
      {"instrument", {"harp",       "basedrum", "snare",           "hat",       "bass",           "flute",
                      "bell",       "guitar",   "chime",           "xylophone", "iron_xylophone", "cow_bell",
                      "didgeridoo", "bit",      "banjo",           "pling",     "zombie",         "skeleton",
                      "creeper",    "dragon",   "wither_skeleton", "piglin",    "custom_head"}},
      {"layers", {"1", "2", "3", "4", "5", "6", "7", "8"}},
      {"leaves", {"none", "small", "large"}},
      {"mode", {"compare", "subtract", "save", "load", "corner", "data"}},
      {"north", side},
      {"orientation",
       {"down_east", "down_north", "down_south", "down_west", "up_east", "up_north", "up_south", "up_west", "west_up",
        "east_up", "north_up", "south_up"}},
      {"part", {"foot", "head"}},
      {"pickles", {"1", "2", "3", "4"}},
      {"sculk_sensor_phase", {"inactive", "active", "cooldown"}},
      {"segment_amount", {"1", "2", "3", "4"}},
      {"shape",
       {"straight", "inner_left", "inner_right", "outer_left", "outer_right", "north_south", "east_west",
        "ascending_east", "ascending_west", "ascending_north", "ascending_south", "south_east", "south_west",
        "north_west", "north_east"}},
      {"south", side},
      {"thickness", {"tip", "tip_merge", "frustum", "middle", "base"}},
      {"tilt", {"none", "unstable", "partial", "full"}},
      {"trial_spawner_state",
       {"inactive", "waiting_for_players", "active", "waiting_for_reward_ejection", "ejecting_reward", "cooldown"}},
      {"type", {"bottom", "top", "double", "single", "left", "right", "normal", "sticky"}},
      {"vault_state", {"inactive", "active", "unlocking", "ejecting"}},
      {"vertical_direction", {"up", "down"}},
      {"west", side},
  };
  return tables;
}

const Words* words_of(std::string_view key) {
  const std::vector<Words>& tables = word_tables();
  const auto found = std::ranges::lower_bound(tables, key, {}, &Words::key);
  return found != tables.end() && found->key == key ? &*found : nullptr;
}

constexpr int kNumberBits = 5;

std::optional<std::uint32_t> number_of(std::string_view text) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_plain = error == std::errc() && end == text.data() + text.size() && number < (1U << kNumberBits) &&
                        std::to_string(number) == text;
  return is_plain ? std::optional(number) : std::nullopt;
}

/// Returns a property's value as bits; nullopt if it has no code.
struct Coded {
  std::uint32_t code = 0;
  int bits = 0;
  char kind = 'w';  // 'w': words, 'b': true or false, 'n': a number
};

std::optional<Coded> coded(const Property& property) {
  const auto& [key, value] = property;
  if (const Words* const words = words_of(key)) {
    const auto found = std::ranges::find(words->values, value);
    if (found == words->values.end()) return std::nullopt;
    return Coded{static_cast<std::uint32_t>(found - words->values.begin()),
                 static_cast<int>(std::bit_width(words->values.size() - 1)), 'w'};
  }
  if (value == "false" || value == "true") return Coded{value == "true" ? 1U : 0U, 1, 'b'};
  if (const auto number = number_of(value)) return Coded{*number, kNumberBits, 'n'};
  return std::nullopt;
}

std::string value_of(std::string_view key, std::uint32_t code, char kind) {
  if (kind == 'b') return code != 0 ? "true" : "false";
  const Words* const words = kind == 'w' ? words_of(key) : nullptr;
  if (words == nullptr) return std::to_string(code);
  return code < words->values.size() ? std::string(words->values[code]) : std::to_string(code);
}

}  // namespace

BlockState block_state(std::string_view name, std::vector<Property> properties) {
  BlockState block;
  std::ranges::sort(properties);
  std::string in_name;
  const bool is_leaves = name.ends_with("leaves");
  for (const Property& property : properties) {
    const auto& [key, value] = property;
    if (is_leaves && (key == "distance" || key == "persistent")) continue;
    const bool is_look = key == "lit" || key == "snowy";
    block.is_lit |= key == "lit" && value == "true";
    block.is_snowy |= key == "snowy" && value == "true";
    const auto code = is_look ? std::nullopt : coded(property);
    if (!code || block.bits + code->bits > kMaxStateBits) {
      if (is_look && value == "false") continue;  // like blocks without this property
      in_name.append(in_name.empty() ? "[" : ",").append(key).append("=").append(value);
      continue;
    }
    block.layout += (block.layout.empty() ? "" : ",") + key + ":" + code->kind + std::to_string(code->bits);
    block.state |= code->code << block.bits;
    block.bits = static_cast<std::uint8_t>(block.bits + code->bits);
  }
  block.name = std::string(name) + in_name + (in_name.empty() ? "" : "]");
  return block;
}

std::optional<BlockText> parse_block(std::string_view text) {
  BlockText block;
  const std::size_t open = text.find('[');
  block.name = std::string(text.substr(0, open));
  if (open == std::string_view::npos) return block;
  if (!text.ends_with(']')) return std::nullopt;
  std::string_view rest = text.substr(open + 1, text.size() - open - 2);
  while (!rest.empty()) {
    const std::size_t comma = rest.find(',');
    const std::string_view one = rest.substr(0, comma);
    const std::size_t equals = one.find('=');
    if (equals == std::string_view::npos) return std::nullopt;
    block.properties.emplace_back(one.substr(0, equals), one.substr(equals + 1));
    rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
  }
  return block;
}

std::vector<StateField> state_fields(const VoxelProperties& type) {
  std::vector<StateField> fields;
  const auto layout = type.attributes.find(kStatesAttribute);
  if (layout == type.attributes.end()) return fields;
  std::string_view rest = layout->second;
  int first_bit = 0;
  while (!rest.empty()) {
    const std::size_t comma = rest.find(',');
    const std::string_view one = rest.substr(0, comma);
    rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
    const std::size_t colon = one.find(':');
    if (colon == std::string_view::npos || colon + 2 >= one.size()) break;  // written by another program
    const auto bits = number_of(one.substr(colon + 2));
    if (!bits || *bits == 0 || first_bit + static_cast<int>(*bits) > kMaxStateBits) break;
    fields.push_back({std::string(one.substr(0, colon)), one[colon + 1], first_bit, static_cast<int>(*bits)});
    first_bit += static_cast<int>(*bits);
  }
  return fields;
}

std::optional<std::uint32_t> code_of_value(const StateField& field, std::string_view value) {
  const auto code = coded({field.key, std::string(value)});
  if (!code || code->kind != field.kind || code->code >> field.bits != 0) return std::nullopt;
  return code->code;
}

std::string value_of_code(const StateField& field, std::uint32_t code) {
  QUOIN_ASSERT(std::uint64_t{code} >> field.bits == 0, "a code of the field");
  return value_of(field.key, code, field.kind);
}

std::string_view commonest_value(std::string_view key) {
  const Words* const words = words_of(key);
  return words == nullptr ? std::string_view() : words->values.front();
}

std::string_view commonest_value(std::string_view key, std::span<const std::string_view> values) {
  QUOIN_ASSERT(!values.empty(), "at least one value");
  if (const Words* const words = words_of(key)) {
    for (const std::string_view word : words->values) {
      if (std::ranges::find(values, word) != values.end()) return word;
    }
  }
  return values.front();
}

BlockText block_text(const VoxelProperties& type, std::uint32_t state) {
  const bool is_block = type.attributes.contains(kStatesAttribute);
  auto parsed = is_block ? parse_block(type.name) : std::nullopt;
  if (!parsed) return {type.name, {}};
  BlockText block = std::move(*parsed);
  for (const StateField& field : state_fields(type)) {
    const auto mask = static_cast<std::uint32_t>((std::uint64_t{1} << field.bits) - 1U);
    block.properties.emplace_back(field.key, value_of_code(field, state >> field.first_bit & mask));
  }
  std::ranges::sort(block.properties);
  return block;
}

std::string to_string(const BlockText& block) {
  std::string text = block.name;
  for (const auto& [key, value] : block.properties) {
    text.append(&key == &block.properties.front().first ? "[" : ",").append(key).append("=").append(value);
  }
  return block.properties.empty() ? text : text + "]";
}

namespace {

VoxelProperties properties_of(const BlockState& state, const BlockLook& look) {
  VoxelProperties type;
  type.name = state.name;
  set_look(look, type);
  type.state_bits = state.bits;
  type.attributes[kStatesAttribute] = state.layout;
  if (look.knowledge != Knowledge::Table) {
    type.attributes[kGuessAttribute] = look.knowledge == Knowledge::Words ? "words" : "nothing";
  }
  return type;
}

/// Returns the light level of the property "level"; 15 if it is absent.
std::uint8_t level_of(const std::vector<Property>& properties) {
  constexpr int kMaxLevel = 15;
  const auto found = std::ranges::find(properties, "level", &Property::first);
  if (found == properties.end()) return kMaxLevel;
  int level = kMaxLevel;
  std::from_chars(found->second.data(), found->second.data() + found->second.size(), level);
  return static_cast<std::uint8_t>(std::clamp(level, 0, kMaxLevel));
}

bool is_light_block(std::string_view name) {
  return name == "minecraft:light" || name == "light";
}

}  // namespace

Result<Block> BlockTypes::block(std::string_view name, const std::vector<Property>& properties) {
  std::string key(name);
  for (const auto& [property, value] : properties) key.append(1, '\0').append(property).append(1, '\0').append(value);
  {
    const std::shared_lock lock(mutex_);
    if (const auto known = blocks_.find(key); known != blocks_.end()) return known->second;
  }
  const std::uint8_t light = is_light_block(name) ? level_of(properties) : std::uint8_t{0};
  return add(key, block_state(name, properties), light, light_level_of_block(name, properties));
}

Result<Block> BlockTypes::add(const std::string& key, const BlockState& state, std::uint8_t light,
                              std::optional<int> emitted) {
  const std::string_view name = std::string_view(state.name).substr(0, state.name.find('['));
  BlockLook look = look_of_block(name, state.is_lit, state.is_snowy);
  // Propagated light of this emission has the block's level.
  if (emitted) look.emission = static_cast<float>(*emitted) / 15.0F;
  Block block;
  block.state = state.state;
  const std::unique_lock lock(mutex_);
  if (!look.is_air && look.tint == Tint::None) {
    const auto type = types_.find_or_add(properties_of(state, look));
    if (!type) return type.error();
    block.type = *type;
  } else if (look.is_invisible) {
    const auto known = std::ranges::find(invisible_, name);
    QUOIN_ASSERT(invisible_.size() < 0xFFFF, "a number of 16 bits");
    block.invisible = static_cast<std::uint16_t>(known - invisible_.begin() + 1);
    block.light = light;
    if (known == invisible_.end()) invisible_.emplace_back(name);
  } else if (!look.is_air) {
    block.tint = look.tint;
    VoxelProperties type = properties_of(state, look);
    std::size_t number = 0;
    while (number < tinted_.size() && !(tinted_[number] == type)) ++number;
    if (number == tinted_.size()) tinted_.push_back(std::move(type));
    block.number = static_cast<std::uint32_t>(number);
  }
  blocks_.emplace(key, block);
  return block;
}

Result<VoxelType> BlockTypes::tinted(const Block& block, const BiomeTints& tints) {
  const std::uint32_t colour = colour_of(block.tint, tints);
  const std::uint64_t key = std::uint64_t{block.number} << 32 | colour;
  {
    const std::shared_lock lock(mutex_);
    if (const auto known = tinted_types_.find(key); known != tinted_types_.end()) return known->second;
  }
  const std::unique_lock lock(mutex_);
  QUOIN_ASSERT(block.tint != Tint::None && block.number < tinted_.size(), "a tinted block");
  VoxelProperties type = tinted_[block.number];
  type.colour = tinted_colour(type.colour, colour);
  constexpr std::array kNames = {"", "grass", "foliage", "water"};
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string digits;
  for (int shift = 20; shift >= 0; shift -= 4) digits += kDigits[colour >> shift & 0xFU];
  type.attributes[kTintColourAttribute] = digits;
  type.attributes[kTintAttribute] = kNames[static_cast<std::size_t>(block.tint)];
  auto added = types_.find_or_add(type);
  if (added) tinted_types_[key] = *added;
  return added;
}

std::string BlockTypes::invisible_name(std::uint16_t number) const {
  const std::shared_lock lock(mutex_);
  QUOIN_ASSERT(number > 0 && number <= invisible_.size(), "an invisible block");
  return invisible_[number - 1U];
}

VoxelRegistry BlockTypes::types() const {
  const std::shared_lock lock(mutex_);
  return types_;
}

}  // namespace quoin::minecraft
