#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <quoin/core/result.h>

#include "io/packs/pack_files.h"

// Block families: tables that give every block name, also of mods, its block states, models and textures in the
// published resource-pack format. docs/formats/block_pack.md describes the tables.

namespace quoin::packs {

/// Returns the parts of a text that are not empty.
[[nodiscard]] std::vector<std::string> words(std::string_view text, char between = ' ');
/// Returns the text with `by` at each place of `old`.
[[nodiscard]] std::string replaced(std::string text, std::string_view old, std::string_view by);
/// Returns the text with the texts of stars (`match_name`) for "{1}" and "{2}".
[[nodiscard]] std::string with_stars(std::string text, const std::vector<std::string>& stars);

/// Returns the texts that the stars of a pattern stand for, in order; nullopt if the pattern does not match. Stars
/// match at least one character, as few as possible. A pattern has at most two stars.
[[nodiscard]] std::optional<std::vector<std::string>> match_name(std::string_view pattern, std::string_view name);

/// Rows of a table that are selected by patterns of names: exact names first, then the first matching pattern.
class NamePatterns {
 public:
  /// Adds patterns, separated by spaces, that select `row`. Earlier patterns win. Errors: BadFormat for more than two
  /// stars or a name that was added before.
  [[nodiscard]] Status add(std::string_view patterns, std::size_t row);

  struct Match {
    std::size_t row = 0;
    std::vector<std::string> stars;
    bool is_fallback = false;  ///< the pattern is a single star
    bool is_exact = false;     ///< the pattern is a name
  };
  [[nodiscard]] std::optional<Match> find(std::string_view name) const;

 private:
  std::unordered_map<std::string, std::size_t> exact_;
  std::vector<std::pair<std::string, std::size_t>> patterns_;
};

/// The tables of families, and the rules that assign them to names. Immutable after it was made.
class BlockFamilies {
 public:
  /// Parses both tables. `texture_space`: not empty for tables of another game, whose patterns match names with their
  /// namespace ("stairs:stair_*") and whose textures have this namespace by default.
  ///
  /// Errors: BadFormat, naming the family, model or rule, for invalid JSON, unknown keys, models, families or options,
  ///         numbers outside the published format, and lists beyond their limits.
  [[nodiscard]] static Result<BlockFamilies> from_text(std::string_view families, std::string_view rules,
                                                       std::string_view texture_space = {});

  /// Returns the block-state file of a block as JSON. Every name has one.
  [[nodiscard]] std::string block_state(const ResourceName& block) const;
  /// Returns a model file as JSON; nullopt if no block state refers to it and it is no published parent.
  [[nodiscard]] std::optional<std::string> model(const ResourceName& model) const;
  /// The properties of a family that block-state files cannot have.
  struct Traits {
    std::string turn;          ///< the rule for a number in the state that turns the block; empty: none
    std::string fluid;         ///< "source" or "flowing"; empty: no fluid
    std::uint32_t groups = 0;  ///< bits of the groups whose blocks join each other (ShapeRules::groups); 0: joins none
    bool joins_full_sides = false;
    std::string mirror;  ///< the mirror that leaves an unturned block as it is: empty: x; "diagonal": exchanges x and z
    bool is_full = false;      ///< whole cubes
    bool is_fallback = false;  ///< the rule for all names
  };
  [[nodiscard]] Traits traits(const ResourceName& block) const;
  /// Returns the name of the family.
  [[nodiscard]] std::string family(const ResourceName& block) const;
  /// Returns true if a rule other than the last one, which makes cubes of all names, matches.
  [[nodiscard]] bool is_known(const ResourceName& block) const;
  /// Returns the number of rules.
  [[nodiscard]] std::size_t rule_count() const { return rules_.size(); }

 private:
  struct Face {
    std::string variable;  // without '#'
    std::optional<std::array<float, 4>> uv;
    int turn = 0;
  };
  struct Box {
    std::array<float, 3> from{};
    std::array<float, 3> to{};
    std::map<char, Face> faces;  // by the letter of the direction
    std::string turn;            // JSON of "rotation", or empty
    bool has_shade = true;
  };
  struct State {
    std::vector<std::pair<std::string, std::string>> when;
    std::string model;  // a key of Family::models
    int x = 0;
    int y = 0;
    bool keeps_uv = false;
  };
  struct ModelUse {
    std::string model;
    std::vector<std::pair<std::string, std::string>> renamed;  // texture variables and their new names
  };
  struct Family {
    std::map<std::string, ModelUse> models;  // by the end of their published name
    std::vector<State> states;
    bool has_parts = false;
    bool is_full = false;
    Traits traits{};
  };
  struct Rule {
    std::string family;  // or, after '=', the name whose rule is meant
    std::vector<std::pair<std::string, std::string>> textures;
    std::vector<std::string> tinted;
  };
  struct Found {
    const Rule* rule = nullptr;
    const Family* family = nullptr;
    ResourceName block;  // the block whose rule it is: without "waxed_"
    std::vector<std::string> stars;
    bool is_fallback = false;
    bool is_exact = false;
  };
  struct Parser;

  [[nodiscard]] Found find(const ResourceName& block, int depth = 0) const;
  [[nodiscard]] std::string texture(const Found& found, const std::string& text) const;
  [[nodiscard]] std::string texture_of_material(const Found& found, std::string_view side) const;
  [[nodiscard]] std::vector<std::pair<ResourceName, bool>> materials(const Found& found) const;
  [[nodiscard]] std::string model_name(const ResourceName& block, const Found& found, const std::string& end) const;
  [[nodiscard]] std::string model_json(const std::vector<Box>& boxes,
                                       const std::vector<std::pair<std::string, std::string>>& textures,
                                       const std::vector<std::string>& tinted) const;

  std::map<std::string, std::vector<Box>> models_;
  std::map<std::string, Family> families_;
  std::set<std::string, std::less<>> model_ends_;  // of all families
  std::vector<Rule> rules_;
  NamePatterns names_;
  std::string texture_space_;  // see from_text
};

}  // namespace quoin::packs
