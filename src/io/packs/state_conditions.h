#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/grid/voxel_shape.h>

#include "io/minecraft/block_types.h"
#include "io/packs/block_states.h"

// Conditions of block states as conditions of a type's state bits.

namespace quoin::packs {

/// Maximum number of conditions of a type.
inline constexpr std::size_t kMaxTypeConditions = 8'192;

/// The properties of a block type: those in its name, and those in its state bits.
class TypeStates {
 public:
  /// Reads the name and the fields of a type. Requires: the type has the attribute kStatesAttribute.
  explicit TypeStates(const VoxelProperties& type);
  /// Creates the properties of a block of another format: its fields, which may overlap. `connects`: its sides follow
  /// its neighbours.
  TypeStates(std::string block, std::vector<minecraft::StateField> fields, bool connects)
      : block_(std::move(block)), fields_(std::move(fields)), connects_(connects) {}

  /// Returns the name without properties: "minecraft:oak_stairs"; empty if it cannot be parsed.
  [[nodiscard]] const std::string& block() const { return block_; }
  [[nodiscard]] const minecraft::StateField* field(std::string_view property) const;
  /// Returns true if the name or the state has the property.
  [[nodiscard]] bool has(std::string_view property) const;

  /// Returns true if the name has the property with this value.
  [[nodiscard]] bool is_named(std::string_view property, std::string_view value) const;

  /// Chooses a value for each property that the type does not have and whose commonest value no variant has: the
  /// commonest one that a variant has, or the first. Call it before `conditions`, with the variants of the block.
  void choose_absent(const BlockStates& variants);

  /// Returns the conditions under which a case holds: none if it never does, and one without bits if it always does.
  /// Properties that the type does not have take the value that is commonest in the game. Sides of fences, panes and
  /// the like that the type does not have become connections with neighbours (ShapeNeighbours::Connected), and the
  /// shape of stairs their corner (ShapeNeighbours::Stairs), left and right as the published format means them.
  /// Errors: LimitExceeded for kMaxTypeConditions.
  [[nodiscard]] Result<std::vector<ShapeCondition>> conditions(const StateCase& of) const;

  /// Returns true if conditions may depend on connections, since the type lacks its sides.
  [[nodiscard]] bool connects() const { return connects_; }
  /// Returns true for stairs whose corners follow their neighbours, since the type lacks their shape. It then has the
  /// fields facing and half, next to each other.
  [[nodiscard]] bool has_corners() const { return has_corners_; }

  /// Returns the light levels of the type's states in the game (minecraft::light_level_of_block), each with the
  /// conditions of the states that have it; none for blocks that are not listed.
  [[nodiscard]] std::map<int, std::vector<ShapeCondition>> light_levels() const;

 private:
  [[nodiscard]] static std::vector<ShapeCondition> with_corners(const std::vector<ShapeCondition>& all,
                                                                const StateTerm& term);
  [[nodiscard]] Status restrict(std::vector<ShapeCondition>& all, const StateTerm& term) const;
  [[nodiscard]] bool holds_for_absent(const StateTerm& term) const;

  std::string block_;
  std::vector<std::pair<std::string, std::string>> named_;  // properties in the name
  std::vector<minecraft::StateField> fields_;
  std::map<std::string, std::string> chosen_;  // values of absent properties
  bool connects_ = false;
  bool has_corners_ = false;
};

/// Returns conditions that hold where one of `all` does and none of `taken`. Positions are not regarded.
/// Errors: LimitExceeded for kMaxTypeConditions.
[[nodiscard]] Result<std::vector<ShapeCondition>> conditions_without(std::vector<ShapeCondition> all,
                                                                     const std::vector<ShapeCondition>& taken);

/// Returns true if a state satisfies a condition, apart from connections, corners and positions.
[[nodiscard]] inline bool holds(const ShapeCondition& condition, std::uint32_t state) {
  return (state & condition.state_mask) == condition.state;
}

/// Returns the mask of a field's bits.
[[nodiscard]] inline std::uint32_t mask_of(const minecraft::StateField& field) {
  return static_cast<std::uint32_t>(((std::uint64_t{1} << field.bits) - 1U) << field.first_bit);
}

/// The light of a type without packs.
struct BlockLight {
  float emission = 0.0F;               ///< as in VoxelProperties
  bool is_of_game = false;             ///< the block is one of the game's, also if it is dark
  std::vector<ShapeCondition> when{};  ///< one of these holds in the states with this light; empty: all states

  /// Returns true if a state with this light may meet one of the conditions.
  [[nodiscard]] bool may_meet(const std::vector<ShapeCondition>& conditions) const;
};

/// Finds the light by the name of a type, since an earlier pack may have set its emission. Where the light level depends
/// on state bits, each level is a type of its own; the result is then the level that is nearest to the type's emission,
/// as packs do not change it. `states` has the name of the block that gives the type its look.
[[nodiscard]] BlockLight light_without_packs(const VoxelProperties& type, const TypeStates& states);

}  // namespace quoin::packs
