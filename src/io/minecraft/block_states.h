#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/grid/voxel_registry.h>

// The properties of a Minecraft block apart from its name ("facing=east,half=top") as a bit field, VoxelData::state.
// Blocks that differ only in these are one type. docs/formats/minecraft.md documents the bits.

namespace quoin::minecraft {

using Property = std::pair<std::string, std::string>;

/// The attribute of a type that lists the fields of its state bits, from the lowest up: "facing:3,half:2".
inline constexpr const char* kStatesAttribute = "minecraft.states";
/// The attribute of a type with a guessed look: "words" or "nothing".
inline constexpr const char* kGuessAttribute = "minecraft.look";
/// The attribute with the tint of a biome-coloured type.
inline constexpr const char* kTintAttribute = "minecraft.tint";

/// A block as a type and a state.
struct BlockState {
  std::string name;         ///< "minecraft:furnace[lit=true]": with the properties that change the look, which have no
                            ///< bits
  std::string layout;       ///< in the form of kStatesAttribute
  std::uint32_t state = 0;  ///< 0 where all properties have their commonest value
  std::uint8_t bits = 0;
  bool is_lit = false;
  bool is_snowy = false;
};

/// Splits a block's properties into a part of its type's name and a state. Drops the properties of leaves that only
/// control decay ("distance", "persistent").
[[nodiscard]] BlockState block_state(std::string_view name, std::vector<Property> properties);

/// Returns the block of a type and a state: its name, and the properties given to `block_state` except the dropped ones
/// and lit=false and snowy=false, sorted by name. Types of other formats give their name without properties.
struct BlockText {
  std::string name;
  std::vector<Property> properties;
};
[[nodiscard]] BlockText block_text(const VoxelProperties& type, std::uint32_t state);
/// "minecraft:oak_stairs[facing=east,half=top]".
[[nodiscard]] std::string to_string(const BlockText& block);
/// Parses such a text; nullopt if brackets or equals signs are missing.
[[nodiscard]] std::optional<BlockText> parse_block(std::string_view text);

}  // namespace quoin::minecraft
