#include "io/minecraft/block_types.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin::minecraft {

namespace {

VoxelProperties properties_of(const BlockState& state, const BlockLook& look) {
  VoxelProperties type;
  type.name = state.name;
  type.colour = look.colour;
  type.visibility = look.colour.a < 255 ? Visibility::Transparent : Visibility::Opaque;
  type.collides = look.collides;
  type.emission = look.emission;
  type.roughness = look.roughness;
  type.ior = look.ior;
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
  return add(key, block_state(name, properties), light);
}

Result<Block> BlockTypes::add(const std::string& key, const BlockState& state, std::uint8_t light) {
  const std::string_view name = std::string_view(state.name).substr(0, state.name.find('['));
  const BlockLook look = look_of_block(name, state.is_lit, state.is_snowy);
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
