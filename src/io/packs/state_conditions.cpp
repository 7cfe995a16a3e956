#include "io/packs/state_conditions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include <quoin/core/assert.h>

#include "io/luanti/luanti.h"
#include "io/minecraft/block_looks.h"

namespace quoin::packs {

namespace {

struct NamedSide {
  std::string_view name;
  Direction direction;
};
constexpr std::array<NamedSide, 4> kSides = {
    {{"north", Direction::NegZ}, {"south", Direction::PosZ}, {"west", Direction::NegX}, {"east", Direction::PosX}}};

const NamedSide* side_of(std::string_view property) {
  const auto found = std::ranges::find(kSides, property, &NamedSide::name);
  return found == kSides.end() ? nullptr : &*found;
}

constexpr int kMaxNegatedBits = 8;

/// Returns true for blocks whose sides join their neighbours.
bool joins_neighbours(std::string_view block) {
  return std::ranges::any_of(
      std::array<std::string_view, 6>{"fence", "_pane", "iron_bars", "copper_bars", "_wall", "redstone_wire"},
      [&](std::string_view end) { return block.ends_with(end); });
}

Error too_many_conditions() {
  return make_error(ErrorCode::LimitExceeded,
                    "more than " + std::to_string(kMaxTypeConditions) + " conditions of a block");
}

bool contains_value(const StateTerm& term, std::string_view value) {
  return (std::ranges::find(term.values, value) != term.values.end()) != term.is_negated;
}

}  // namespace

TypeStates::TypeStates(const VoxelProperties& type) : fields_(minecraft::state_fields(type)) {
  QUOIN_ASSERT(type.attributes.contains(minecraft::kStatesAttribute), "a type of a Minecraft block");
  if (auto text = minecraft::parse_block(type.name)) {
    block_ = std::move(text->name);
    named_ = std::move(text->properties);
  }
  const minecraft::StateField* const facing = field("facing");
  const minecraft::StateField* const half = field("half");
  const auto has_words = [](const minecraft::StateField* one, int bits) {
    return one != nullptr && one->kind == 'w' && one->bits == bits;
  };
  has_corners_ = block_.ends_with("_stairs") && has_words(facing, 3) && has_words(half, 2) && !has("shape") &&
                 facing->first_bit + facing->bits == half->first_bit;
  connects_ =
      joins_neighbours(block_) && std::ranges::none_of(kSides, [&](const NamedSide& side) { return has(side.name); });
}

const minecraft::StateField* TypeStates::field(std::string_view property) const {
  const auto found = std::ranges::find(fields_, property, &minecraft::StateField::key);
  return found == fields_.end() ? nullptr : &*found;
}

bool TypeStates::is_named(std::string_view property, std::string_view value) const {
  return std::ranges::any_of(named_, [&](const auto& each) { return each.first == property && each.second == value; });
}

bool TypeStates::has(std::string_view property) const {
  return field(property) != nullptr ||
         std::ranges::find(named_, property, &std::pair<std::string, std::string>::first) != named_.end();
}

void TypeStates::choose_absent(const BlockStates& variants) {
  std::map<std::string, std::vector<std::string_view>> values;
  std::set<std::string> met;
  for (const StateCase& each : variants.cases) {
    for (const std::vector<StateTerm>& terms : each.when) {
      for (const StateTerm& term : terms) {
        if (has(term.property)) continue;
        if (holds_for_absent(term)) met.insert(term.property);
        if (!term.is_negated)
          values[term.property].insert(values[term.property].end(), term.values.begin(), term.values.end());
      }
    }
  }
  for (const auto& [property, all] : values) {
    if (!met.contains(property) && !all.empty()) chosen_[property] = minecraft::commonest_value(property, all);
  }
}

bool TypeStates::holds_for_absent(const StateTerm& term) const {
  if (const auto chosen = chosen_.find(term.property); chosen != chosen_.end()) {
    return contains_value(term, chosen->second);
  }
  std::vector<std::string_view> common;  // it may be any of them
  if (const std::string_view word = minecraft::commonest_value(term.property); !word.empty()) common.push_back(word);
  // A side of a fence is true or false, one of a wall none, low or tall.
  if (common.empty() || side_of(term.property) != nullptr) common.insert(common.end(), {"false", "0"});
  const auto is_met = [&](std::string_view value) { return contains_value(term, value); };
  return term.is_negated ? std::ranges::all_of(common, is_met) : std::ranges::any_of(common, is_met);
}

std::map<int, std::vector<ShapeCondition>> TypeStates::light_levels() const {
  std::map<int, std::vector<ShapeCondition>> levels;
  struct State {
    std::vector<std::pair<std::string, std::string>> properties;
    ShapeCondition when;
  };
  std::vector<State> states{{named_, {}}};
  for (const std::string_view key : minecraft::light_properties_of_block(block_)) {
    const minecraft::StateField* const of_key = field(key);
    if (of_key == nullptr) {
      // Names of types leave lit=false out, which unlit redstone torches have.
      const std::size_t count = key == "lit" && !has(key) ? states.size() : 0;
      for (std::size_t i = 0; i < count; ++i) {
        State unlit = states[i];
        unlit.properties.emplace_back(key, "false");
        states.push_back(std::move(unlit));
      }
      continue;
    }
    std::vector<State> longer;
    // Words and numbers have codes below 32.
    const std::uint32_t codes = std::uint32_t{1} << std::min(of_key->bits, 5);
    for (const State& state : states) {
      for (std::uint32_t code = 0; code < codes; ++code) {
        State& made = longer.emplace_back(state);
        made.properties.emplace_back(key, minecraft::value_of_code(*of_key, code));
        made.when.state_mask |= mask_of(*of_key);
        made.when.state |= code << of_key->first_bit;
      }
    }
    states = std::move(longer);
  }
  for (const State& state : states) {
    if (const auto level = minecraft::light_level_of_block(block_, state.properties)) {
      levels[*level].push_back(state.when);
    }
  }
  return levels;
}

std::vector<ShapeCondition> TypeStates::with_corners(const std::vector<ShapeCondition>& all, const StateTerm& term) {
  constexpr std::array<std::pair<std::string_view, StairCorner>, 5> kCorners = {
      {{"straight", StairCorner::Straight},
       {"outer_left", StairCorner::OuterLeft},
       {"outer_right", StairCorner::OuterRight},
       {"inner_left", StairCorner::InnerLeft},
       {"inner_right", StairCorner::InnerRight}}};
  std::vector<ShapeCondition> made;
  for (const auto& [name, corner] : kCorners) {
    if (!contains_value(term, name)) continue;
    for (ShapeCondition condition : all) {
      if (condition.corner && *condition.corner != corner) continue;
      condition.corner = corner;
      made.push_back(condition);
    }
  }
  return made;
}

Status TypeStates::restrict(std::vector<ShapeCondition>& all, const StateTerm& term) const {
  const minecraft::StateField* const found = field(term.property);
  if (found == nullptr) {
    const auto named = std::ranges::find(named_, term.property, &std::pair<std::string, std::string>::first);
    const NamedSide* const side = connects_ ? side_of(term.property) : nullptr;
    if (named == named_.end() && side != nullptr) {
      const bool is_joined = std::ranges::any_of(std::array<std::string_view, 4>{"true", "side", "low", "up"},
                                                 [&](std::string_view value) { return contains_value(term, value); });
      const bool is_free = contains_value(term, "false") || contains_value(term, "none");
      for (ShapeCondition& condition : all) {
        if (is_joined && !is_free) condition.connected.insert(side->direction);
        if (is_free && !is_joined) condition.unconnected.insert(side->direction);
      }
      if (!is_joined && !is_free) all.clear();
      return {};
    }
    if (has_corners_ && term.property == "shape") {
      all = with_corners(all, term);
      return {};
    }
    const bool is_met = named == named_.end() ? holds_for_absent(term) : contains_value(term, named->second);
    if (!is_met) all.clear();
    return {};
  }
  std::vector<std::uint32_t> codes;
  for (const std::string& value : term.values) {
    const auto code = minecraft::code_of_value(*found, value);
    if (code && std::ranges::find(codes, *code) == codes.end()) codes.push_back(*code);
  }
  if (term.is_negated) {
    if (found->bits > kMaxNegatedBits) return too_many_conditions();
    std::vector<std::uint32_t> others;
    for (std::uint32_t code = 0; code < 1U << found->bits; ++code) {
      if (std::ranges::find(codes, code) == codes.end()) others.push_back(code);
    }
    codes = std::move(others);
  }
  if (codes.size() * all.size() > kMaxTypeConditions) return too_many_conditions();
  std::vector<ShapeCondition> restricted;
  for (const ShapeCondition& condition : all) {
    for (const std::uint32_t code : codes) {
      const std::uint32_t mask = mask_of(*found);
      const std::uint32_t bits = code << found->first_bit;
      if (((condition.state ^ bits) & condition.state_mask & mask) != 0) continue;
      ShapeCondition narrower = condition;
      narrower.state_mask |= mask;
      narrower.state |= bits;
      restricted.push_back(narrower);
    }
  }
  all = std::move(restricted);
  return {};
}

Result<std::vector<ShapeCondition>> TypeStates::conditions(const StateCase& of) const {
  std::vector<ShapeCondition> all;
  for (const std::vector<StateTerm>& terms : of.when) {
    std::vector<ShapeCondition> met(1);
    for (const StateTerm& term : terms) {
      if (auto done = restrict(met, term); !done) return done.error();
    }
    const auto is_contradiction = [](const ShapeCondition& each) {
      return (each.connected.bits() & each.unconnected.bits()) != 0;
    };
    std::erase_if(met, is_contradiction);
    if (all.size() + met.size() > kMaxTypeConditions) {
      return too_many_conditions();
    }
    for (const ShapeCondition& each : met) {
      if (each == ShapeCondition{}) return std::vector<ShapeCondition>(1);
      if (std::ranges::find(all, each) == all.end()) all.push_back(each);
    }
  }
  return all;
}

namespace {

/// Appends conditions that hold where one does and another does not.
void append_without(const ShapeCondition& one, const ShapeCondition& taken, std::vector<ShapeCondition>& out) {
  const bool is_apart = ((one.state ^ taken.state) & one.state_mask & taken.state_mask) != 0 ||
                        (one.connected.bits() & taken.unconnected.bits()) != 0 ||
                        (one.unconnected.bits() & taken.connected.bits()) != 0 ||
                        (one.corner && taken.corner && *one.corner != *taken.corner);
  if (is_apart) {
    out.push_back(one);
    return;
  }
  // Takes off one bit, side and corner after the other. `rest` has all that were equal.
  ShapeCondition rest = one;
  for (std::uint32_t left = taken.state_mask & ~one.state_mask; left != 0; left &= left - 1) {
    const std::uint32_t bit = left & (~left + 1);
    ShapeCondition other = rest;
    other.state_mask = rest.state_mask |= bit;
    other.state |= ~taken.state & bit;
    rest.state |= taken.state & bit;
    out.push_back(other);
  }
  for (const Direction side : kDirections) {
    if (taken.connected.contains(side) && !rest.connected.contains(side)) {
      out.push_back(rest);
      out.back().unconnected.insert(side);
      rest.connected.insert(side);
    }
    if (taken.unconnected.contains(side) && !rest.unconnected.contains(side)) {
      out.push_back(rest);
      out.back().connected.insert(side);
      rest.unconnected.insert(side);
    }
  }
  if (!taken.corner || rest.corner) return;
  using enum StairCorner;
  for (const StairCorner corner : {Straight, OuterLeft, OuterRight, InnerLeft, InnerRight}) {
    if (corner == *taken.corner) continue;
    out.push_back(rest);
    out.back().corner = corner;
  }
}

}  // namespace

Result<std::vector<ShapeCondition>> conditions_without(std::vector<ShapeCondition> all,
                                                       const std::vector<ShapeCondition>& taken) {
  std::vector<ShapeCondition> rest;
  for (const ShapeCondition& each : taken) {
    rest.clear();
    for (const ShapeCondition& one : all) append_without(one, each, rest);
    if (rest.size() > kMaxTypeConditions) return too_many_conditions();
    std::swap(all, rest);
    if (all.empty()) break;
  }
  return all;
}

bool BlockLight::may_meet(const std::vector<ShapeCondition>& conditions) const {
  const auto agree = [](const ShapeCondition& a, const ShapeCondition& b) {
    return ((a.state ^ b.state) & a.state_mask & b.state_mask) == 0;
  };
  return when.empty() || std::ranges::any_of(conditions, [&](const ShapeCondition& a) {
           return std::ranges::any_of(when, [&](const ShapeCondition& b) { return agree(a, b); });
         });
}

BlockLight light_without_packs(const VoxelProperties& type, const TypeStates& states) {
  if (!type.attributes.contains(minecraft::kStatesAttribute)) {
    const auto node = models::node_properties(type.name);
    return {.emission = node ? node->emission : 0.0F};
  }
  const auto levels = states.light_levels();
  const std::string& block = states.block();
  if (levels.empty()) {
    const bool is_of_game = block.starts_with("minecraft:") || block.find(':') == std::string::npos;
    return {minecraft::look_of_block(block, states.is_named("lit", "true"), false).emission, is_of_game};
  }
  const auto nearest = std::ranges::min_element(
      levels, {}, [&](const auto& each) { return std::abs(static_cast<float>(each.first) - 15.0F * type.emission); });
  return {static_cast<float>(nearest->first) / 15.0F, true, nearest->second};
}

}  // namespace quoin::packs
