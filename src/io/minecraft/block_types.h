#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>

#include "io/minecraft/biomes.h"
#include "io/minecraft/block_looks.h"
#include "io/minecraft/block_states.h"

namespace quoin::minecraft {

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
  [[nodiscard]] Result<Block> add(const std::string& key, const BlockState& state, std::uint8_t light);
  mutable std::shared_mutex mutex_;
  VoxelRegistry types_;
  std::unordered_map<std::string, Block> blocks_;
  std::vector<std::string> invisible_;                         // names by Block::invisible - 1
  std::vector<VoxelProperties> tinted_;                        // by Block::number, before tinting
  std::unordered_map<std::uint64_t, VoxelType> tinted_types_;  // types, by Block::number and colour
};

}  // namespace quoin::minecraft
