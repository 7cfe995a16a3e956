#include "io/minecraft/state_turns.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <string>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>

namespace quoin::minecraft {

namespace {

constexpr std::array<std::pair<std::string_view, Direction>, 6> kDirectionWords = {{{"north", Direction::NegZ},
                                                                                    {"south", Direction::PosZ},
                                                                                    {"west", Direction::NegX},
                                                                                    {"east", Direction::PosX},
                                                                                    {"up", Direction::PosY},
                                                                                    {"down", Direction::NegY}}};

std::optional<Direction> direction_of(std::string_view word) {
  const auto found = std::ranges::find(kDirectionWords, word, &std::pair<std::string_view, Direction>::first);
  return found == kDirectionWords.end() ? std::nullopt : std::optional(found->second);
}

std::string_view word_of(Direction direction) {
  const auto found = std::ranges::find(kDirectionWords, direction, &std::pair<std::string_view, Direction>::second);
  QUOIN_ASSERT(found != kDirectionWords.end(), "a direction");
  return found->first;
}

bool is_vertical(Direction direction) {
  return frame_of(direction).axis == 1;
}

/// Turns the properties of one block. Members are the answers to questions that several properties ask.
class Turner {
 public:
  Turner(std::string_view name, std::vector<Property>& properties, const AxisOrientation& turn)
      : name_(name.substr(name.find(':') == std::string_view::npos ? 0 : name.find(':') + 1)),
        properties_(properties),
        old_(properties),
        turn_(turn),
        up_(turn.apply(Direction::PosY)) {}

  /// Returns false if there is no such state.
  bool run() {
    if (name_.ends_with("torch") && !is_upright()) return false;
    if (find("face") != nullptr && find("facing") != nullptr) return turn_mounted();
    if (!turn_sides()) return false;
    return std::ranges::all_of(properties_, [&](Property& property) { return turn_property(property); });
  }

 private:
  [[nodiscard]] const std::string* find(std::string_view key) const {
    const auto found = std::ranges::find(old_, key, &Property::first);
    return found == old_.end() ? nullptr : &found->second;
  }
  void set(std::string_view key, std::string_view value) {
    for (Property& property : properties_) {
      if (property.first == key) property.second = value;
    }
  }
  [[nodiscard]] bool is_upright() const { return up_ == Direction::PosY; }
  [[nodiscard]] bool is_flipped() const { return up_ == Direction::NegY; }
  /// Replaces a word by the other of two, if `swaps`.
  static void exchange(std::string& value, std::string_view a, std::string_view b, bool swaps) {
    if (swaps && (value == a || value == b)) value = value == a ? b : a;
  }

  /// Returns true for blocks that face in six directions.
  [[nodiscard]] bool faces_up() const {
    constexpr std::array<std::string_view, 13> kEnds = {
        "dispenser",   "dropper", "observer",      "piston", "piston_head", "moving_piston", "barrel",
        "shulker_box", "end_rod", "lightning_rod", "_bud",   "cluster",     "command_block"};
    return std::ranges::any_of(kEnds, [&](std::string_view end) { return name_.ends_with(end); });
  }

  /// Turns `face` and `facing` of levers, buttons and grindstones: the direction away from the surface, and one along
  /// it.
  bool turn_mounted() {
    const auto facing = direction_of(*find("facing"));
    if (!facing) return false;
    const std::string& face = *find("face");
    const Direction away = face == "floor" ? Direction::PosY : face == "ceiling" ? Direction::NegY : *facing;
    const Direction along = face == "wall" ? Direction::NegY : *facing;
    const Direction new_away = turn_.apply(away);
    Direction new_along = turn_.apply(along);
    if (is_vertical(new_away)) {
      set("face", new_away == Direction::PosY ? "floor" : "ceiling");
      set("facing", word_of(new_along));
      return true;
    }
    const bool is_symmetric = name_.ends_with("_button");
    if (new_along != Direction::NegY && !(is_symmetric && new_along == Direction::PosY)) return false;
    set("face", "wall");
    set("facing", word_of(new_away));
    return true;
  }

  /// Moves the values of sides ("north") to the sides where they arrive.
  bool turn_sides() {
    const bool has_all = find("up") != nullptr && find("down") != nullptr;
    for (const auto& [word, direction] : kDirectionWords) {
      const std::string* const value = find(word);
      if (value == nullptr) continue;
      const std::string_view to = word_of(turn_.apply(direction));
      if (word == "up" && !has_all && find("down") == nullptr && is_upright()) continue;  // the post of a wall
      if (!has_all && !is_upright()) return false;
      if (find(to) == nullptr) return false;
      set(to, *value);
    }
    return true;
  }

  bool turn_facing(std::string& value) const {
    const auto facing = direction_of(value);
    if (!facing) return true;
    const Direction to = turn_.apply(*facing);
    const bool stays = is_upright() && to == *facing;  // a hopper that faces down
    if (is_vertical(to) && !faces_up() && !stays) return false;
    value = word_of(to);
    // Blocks that stand on something keep standing; a facing alone does not tell.
    const bool lies_free = faces_up() || find("half") != nullptr;
    return lies_free || is_upright();
  }

  bool turn_rotation(std::string& value) const {
    int steps = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), steps);
    if (error != std::errc() || end != value.data() + value.size() || steps < 0 || steps > 15) return true;
    if (!is_upright()) return false;
    constexpr std::array kQuarters = {Direction::PosZ, Direction::NegX, Direction::NegZ, Direction::PosX};
    const auto south = std::ranges::find(kQuarters, turn_.apply(Direction::PosZ)) - kQuarters.begin();
    const int from = static_cast<int>(south) * 4;
    value = std::to_string((turn_.is_mirrored() ? from - steps + 16 : from + steps) % 16);
    return true;
  }

  bool turn_shape(std::string& value) const {
    if (name_.ends_with("stairs")) {
      // Left and right are those of somebody who looks along `facing`, also of stairs upside down.
      const bool swaps = turn_.is_mirrored() != is_flipped();
      exchange(value, "inner_left", "inner_right", swaps);
      exchange(value, "outer_left", "outer_right", swaps);
      return true;
    }
    if (!name_.ends_with("rail")) return true;
    if (!is_upright()) return false;
    constexpr std::string_view kAscending = "ascending_";
    if (value.starts_with(kAscending)) {
      const auto direction = direction_of(std::string_view(value).substr(kAscending.size()));
      if (direction) value = std::string(kAscending).append(word_of(turn_.apply(*direction)));
      return true;
    }
    const std::size_t between = value.find('_');
    if (between == std::string::npos) return true;
    const auto a = direction_of(std::string_view(value).substr(0, between));
    const auto b = direction_of(std::string_view(value).substr(between + 1));
    if (!a || !b) return true;
    std::string_view first = word_of(turn_.apply(*a));
    std::string_view second = word_of(turn_.apply(*b));
    // The order of the published names: north before south before the others, and east before west.
    const auto rank = [](std::string_view word) {
      return word == "north" ? 0 : word == "south" ? 1 : word == "east" ? 2 : 3;
    };
    if (rank(second) < rank(first)) std::swap(first, second);
    value = std::string(first).append("_").append(second);
    return true;
  }

  bool turn_orientation(std::string& value) const {
    const std::size_t between = value.find('_');
    if (between == std::string::npos) return true;
    const auto front = direction_of(std::string_view(value).substr(0, between));
    const auto top = direction_of(std::string_view(value).substr(between + 1));
    if (!front || !top) return true;
    const Direction new_front = turn_.apply(*front);
    const Direction new_top = turn_.apply(*top);
    if (!is_vertical(new_front) && new_top != Direction::PosY) return false;
    value = std::string(word_of(new_front)).append("_").append(word_of(new_top));
    return true;
  }

  bool turn_property(Property& property) {
    auto& [key, value] = property;
    if (key == "facing") return turn_facing(value);
    if (key == "rotation") return turn_rotation(value);
    if (key == "shape") return turn_shape(value);
    if (key == "orientation") return turn_orientation(value);
    if (key == "axis") {
      const Direction along = value == "x" ? Direction::PosX : value == "z" ? Direction::PosZ : Direction::PosY;
      constexpr std::array kAxes = {"x", "y", "z"};
      value = kAxes[static_cast<std::size_t>(frame_of(turn_.apply(along)).axis)];
      return true;
    }
    if (key == "hinge") {
      exchange(value, "left", "right", turn_.is_mirrored());
      return true;
    }
    if (key == "half") {
      if (value == "lower" || value == "upper") return is_upright();
      exchange(value, "bottom", "top", is_flipped());
      return is_upright() || is_flipped();
    }
    if (key == "type") {
      exchange(value, "left", "right", turn_.is_mirrored());
      if (value != "bottom" && value != "top") return true;
      exchange(value, "bottom", "top", is_flipped());
      return is_upright() || is_flipped();
    }
    if (key == "vertical_direction") {
      exchange(value, "up", "down", is_flipped());
      return is_upright() || is_flipped();
    }
    constexpr std::array<std::string_view, 8> kStanding = {"layers",  "attachment", "hanging", "part",
                                                           "candles", "eggs",       "pickles", "moisture"};
    return is_upright() || std::ranges::find(kStanding, key) == kStanding.end();
  }

  std::string_view name_;
  std::vector<Property>& properties_;
  std::vector<Property> old_;
  const AxisOrientation& turn_;
  Direction up_;
};

}  // namespace

std::optional<std::vector<Property>> turned_properties(std::string_view name, std::vector<Property> properties,
                                                       const AxisOrientation& turn) {
  if (!Turner(name, properties, turn).run()) return std::nullopt;
  return properties;
}

std::optional<std::uint32_t> turned_state(const VoxelProperties& type, std::uint32_t state,
                                          const AxisOrientation& turn) {
  if (!type.attributes.contains(kStatesAttribute)) return std::nullopt;
  const auto block = parse_block(type.name);
  if (!block) return std::nullopt;
  const std::vector<StateField> fields = state_fields(type);
  std::vector<Property> properties;
  const auto mask_of_bits = [](const StateField& field) {
    return static_cast<std::uint32_t>((std::uint64_t{1} << field.bits) - 1U);
  };
  for (const StateField& field : fields) {
    properties.emplace_back(field.key, value_of_code(field, state >> field.first_bit & mask_of_bits(field)));
  }
  properties.insert(properties.end(), block->properties.begin(), block->properties.end());
  const auto turned = turned_properties(block->name, std::move(properties), turn);
  if (!turned) return std::nullopt;
  for (std::size_t i = 0; i < turned->size(); ++i) {
    const std::string& value = (*turned)[i].second;
    if (i >= fields.size()) {
      if (value != block->properties[i - fields.size()].second) return std::nullopt;
      continue;
    }
    const auto code = code_of_value(fields[i], value);
    if (!code) return std::nullopt;
    state &= ~(mask_of_bits(fields[i]) << fields[i].first_bit);
    state |= *code << fields[i].first_bit;
  }
  return state;
}

}  // namespace quoin::minecraft
