#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>
#include <quoin/core/result.h>

// Block states of resource packs: the models of a block by its properties.
// Source: the Minecraft Wiki, "Blockstates definition" (https://minecraft.wiki/w/Blockstates_definition).

namespace quoin::packs {

/// Maximum numbers in one file.
inline constexpr std::size_t kMaxStateCases = 4'096;
/// Maximum number of alternatives in the condition of a case, after its products are expanded.
inline constexpr std::size_t kMaxStateAlternatives = 1'024;

/// A model as a block state shows it.
struct StateModel {
  std::string model{};
  int x = 0;  ///< quarter turns about x, then about y, clockwise seen from the positive end of the axis
  int y = 0;
  bool keeps_uv = false;  ///< textures keep their place in the world when the model is turned
  int weight = 1;         ///< number of chances to be chosen by position, at least 1
};

/// A property must have one of the values, or none of them.
struct StateTerm {
  std::string property;
  std::vector<std::string> values;
  bool is_negated = false;
};

/// A model and the condition under which a block shows it.
struct StateCase {
  /// The case holds if any of these alternatives does. An alternative holds if all its terms do; without terms, always.
  std::vector<std::vector<StateTerm>> when;
  /// Models to choose from by position, in the order of the file.
  std::vector<StateModel> models;

  /// Returns the model with the greatest weight, the first of several.
  [[nodiscard]] const StateModel& heaviest() const;
};

/// The content of a block-state file.
struct BlockStates {
  bool is_multipart = false;  ///< a block shows all cases that hold; else the first
  std::vector<StateCase> cases;
};

/// Reads a block-state file.
/// Errors: BadFormat for JSON of another form, also for weights that are not whole numbers from 1 to 1,000,000;
///         LimitExceeded for kMaxStateCases and kMaxStateAlternatives.
[[nodiscard]] Result<BlockStates> parse_block_states(const nlohmann::json& json);

}  // namespace quoin::packs
