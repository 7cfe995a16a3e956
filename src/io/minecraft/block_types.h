#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>

#include "io/minecraft/block_looks.h"

// The properties of a Minecraft block apart from its name ("facing=east,half=top") as a bit field, VoxelData::state.
// Blocks that differ only in these are one type. docs/formats/minecraft.md documents the bits.

namespace quoin::minecraft {

using Property = std::pair<std::string, std::string>;

/// The attribute of a type that lists the fields of its state bits, from the lowest up: "facing:3,half:2".
inline constexpr const char* kStatesAttribute = "minecraft.states";
/// The attribute of a type with a guessed look: "words" or "nothing".
inline constexpr const char* kGuessAttribute = "minecraft.look";
/// The attribute with the tint of a biome-coloured type: "grass", "foliage" or "water".
inline constexpr const char* kTintAttribute = "minecraft.tint";
/// The attribute with the biome's colour of that tint: "91bd59".
inline constexpr const char* kTintColourAttribute = "minecraft.tint_colour";

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
/// A field of a type's state bits, in the order of kStatesAttribute.
struct StateField {
  std::string key;
  char kind = 'w';  ///< 'w': a word, 'b': true or false, 'n': a number
  int first_bit = 0;
  int bits = 0;
};
/// Returns the fields of a type; none for types of other formats.
[[nodiscard]] std::vector<StateField> state_fields(const VoxelProperties& type);
/// Returns a value as the bits of a field; nullopt if it has no code.
[[nodiscard]] std::optional<std::uint32_t> code_of_value(const StateField& field, std::string_view value);
/// Returns the value of a code of a field. Requires: the code fits into the field.
[[nodiscard]] std::string value_of_code(const StateField& field, std::uint32_t code);
/// Returns the commonest value of a property with words ("axis": "y"); empty for other properties.
[[nodiscard]] std::string_view commonest_value(std::string_view key);
/// Returns the commonest of some values of a property; the first if it is not known. Requires: there are values.
[[nodiscard]] std::string_view commonest_value(std::string_view key, std::span<const std::string_view> values);

/// "minecraft:oak_stairs[facing=east,half=top]".
[[nodiscard]] std::string to_string(const BlockText& block);
/// Parses such a text; nullopt if brackets or equals signs are missing.
[[nodiscard]] std::optional<BlockText> parse_block(std::string_view text);

/// A block in voxel form. Biome-coloured blocks have one type per colour: BlockTypes::tinted.
struct Block {
  VoxelType type = kAir;  ///< also kAir for tinted blocks
  std::uint32_t state = 0;
  Tint tint = Tint::None;
  std::uint32_t number = 0;     ///< number among the tinted blocks
  std::uint16_t invisible = 0;  ///< not 0: the block is read as air, and BlockTypes::invisible_name has its name
  std::uint8_t light = 0;       ///< light level of an invisible block, 0 to 15

  /// Returns true for visible air of any kind.
  [[nodiscard]] bool is_air() const { return type == kAir && tint == Tint::None && invisible == 0; }
  /// Returns true if the block has only a type, in every biome.
  [[nodiscard]] bool is_plain() const { return state == 0 && tint == Tint::None && invisible == 0; }
};

/// The types of the blocks met so far. Threads: all functions can be called at once.
class BlockTypes {
 public:
  /// Returns the block of that name with these properties, in any order. Errors: LimitExceeded.
  [[nodiscard]] Result<Block> block(std::string_view name, const std::vector<Property>& properties);
  /// Returns the type of a tinted block in a biome. Errors: LimitExceeded.
  [[nodiscard]] Result<VoxelType> tinted(const Block& block, const BiomeTints& tints);
  [[nodiscard]] VoxelRegistry types() const;
  /// Returns the name of an invisible block: "minecraft:barrier". Requires: `number` is a Block::invisible, not 0.
  [[nodiscard]] std::string invisible_name(std::uint16_t number) const;

 private:
  [[nodiscard]] Result<Block> add(const std::string& key, const BlockState& state, std::uint8_t light,
                                  std::optional<int> emitted);
  mutable std::shared_mutex mutex_;
  VoxelRegistry types_;
  std::unordered_map<std::string, Block> blocks_;
  std::vector<std::string> invisible_;                         // names by Block::invisible - 1
  std::vector<VoxelProperties> tinted_;                        // by Block::number, before tinting
  std::unordered_map<std::uint64_t, VoxelType> tinted_types_;  // types, by Block::number and colour
};

/// Converts a block of a world before 1.13 to later names: its name, and the kind, rotation and height in its data.
/// Other data becomes the property "data". Unknown block numbers become "legacy:NUMBER". Requires: 0 <= id < 4096, 0 <=
/// data < 16.
[[nodiscard]] std::pair<std::string, std::vector<Property>> legacy_block(int id, int data);

}  // namespace quoin::minecraft
