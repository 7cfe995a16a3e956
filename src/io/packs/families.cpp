#include "io/packs/families.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <nlohmann/json.hpp>
#include <quoin/core/assert.h>

#include "core/bytes/text.h"

namespace quoin::packs {

namespace {

using Json = nlohmann::json;
using Pairs = std::vector<std::pair<std::string, std::string>>;

constexpr std::size_t kMaxRows = 4'096;
constexpr std::size_t kMaxBoxes = 128;
constexpr std::size_t kMaxStates = 512;
constexpr int kMaxAliases = 4;
constexpr std::string_view kDirectionNames[] = {"north", "east", "south", "west"};

/// Splits at the first separator; the second part is empty if there is none.
std::pair<std::string, std::string> split(std::string_view text, char between) {
  const std::size_t at = text.find(between);
  if (at == std::string_view::npos) return {std::string(text), {}};
  return {std::string(text.substr(0, at)), std::string(text.substr(at + 1))};
}

template <std::size_t kCount>
std::optional<std::array<float, kCount>> family_numbers(std::string_view text, float least, float most) {
  const std::vector<std::string> parts = words(text, ',');
  if (parts.size() != kCount) return std::nullopt;
  std::array<float, kCount> numbers{};
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto number = parse_float(parts[i]);
    if (!number || *number < least || *number > most) return std::nullopt;
    numbers[i] = *number;
  }
  return numbers;
}

/// Returns the part of a texture that a face shows: as in the published format the one at its place in the block, but
/// moved into the texture if the box leaves the block. Programs that keep all textures in one image would otherwise show
/// parts of others. `letter`: of the direction.
std::optional<std::array<float, 4>> part_inside(const std::array<float, 3>& from, const std::array<float, 3>& to,
                                                char letter) {
  const bool is_level = letter == 'u' || letter == 'd';
  const int across = letter == 'e' || letter == 'w' ? 2 : 0;
  const auto range = [&](int axis, bool is_reversed) -> std::array<float, 2> {
    const auto at = static_cast<std::size_t>(axis);
    return is_reversed ? std::array{16.0F - to[at], 16.0F - from[at]} : std::array{from[at], to[at]};
  };
  const auto inside = [](std::array<float, 2> part) -> std::array<float, 2> {
    const float size = std::min(part[1] - part[0], 16.0F);
    const float start = std::clamp(part[0], 0.0F, 16.0F - size);
    return {start, start + size};
  };
  const std::array<float, 2> u = range(across, letter == 'e' || letter == 'n');
  const std::array<float, 2> v = is_level ? range(2, letter == 'd') : range(1, true);
  const std::array<float, 2> moved_u = inside(u);
  const std::array<float, 2> moved_v = inside(v);
  if (moved_u == u && moved_v == v) return std::nullopt;
  return std::array{moved_u[0], moved_v[0], moved_u[1], moved_v[1]};
}

/// Puts the texts that a pattern's stars stand for, and the name, into a text.
std::string filled(std::string text, const ResourceName& block, const std::vector<std::string>& stars) {
  text = with_stars(std::move(text), stars);
  return replaced(replaced(std::move(text), "{name}", block.path), "{space}", block.space);
}

}  // namespace

std::vector<std::string> words(std::string_view text, char between) {
  std::vector<std::string> found;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(between), text.size());
    if (end > 0) found.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return found;
}

std::string replaced(std::string text, std::string_view old, std::string_view by) {
  for (std::size_t at = text.find(old); at != std::string::npos; at = text.find(old, at + by.size())) {
    text.replace(at, old.size(), by);
  }
  return text;
}

std::string with_stars(std::string text, const std::vector<std::string>& stars) {
  for (std::size_t i = 0; i < stars.size(); ++i) {
    text = replaced(std::move(text), "{" + std::to_string(i + 1) + "}", stars[i]);
  }
  return text;
}

std::optional<std::vector<std::string>> match_name(std::string_view pattern, std::string_view name) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) {
    return pattern == name ? std::optional(std::vector<std::string>()) : std::nullopt;
  }
  const std::string_view start = pattern.substr(0, star);
  const std::string_view rest = pattern.substr(star + 1);
  if (!name.starts_with(start)) return std::nullopt;
  name.remove_prefix(start.size());
  if (rest.find('*') == std::string_view::npos) {
    if (name.size() <= rest.size() || !name.ends_with(rest)) return std::nullopt;
    return std::vector{std::string(name.substr(0, name.size() - rest.size()))};
  }
  for (std::size_t length = 1; length < name.size(); ++length) {
    if (auto found = match_name(rest, name.substr(length))) {
      found->insert(found->begin(), std::string(name.substr(0, length)));
      return found;
    }
  }
  return std::nullopt;
}

Status NamePatterns::add(std::string_view patterns, std::size_t row) {
  for (std::string& pattern : words(patterns)) {
    const auto stars = std::ranges::count(pattern, '*');
    if (stars > 2) return make_error(ErrorCode::BadFormat, "the pattern " + pattern + " has more than two stars");
    if (stars > 0) {
      patterns_.emplace_back(std::move(pattern), row);
    } else if (!exact_.emplace(pattern, row).second) {
      return make_error(ErrorCode::BadFormat, "the name " + pattern + " is in two rows");
    }
  }
  return {};
}

std::optional<NamePatterns::Match> NamePatterns::find(std::string_view name) const {
  if (const auto found = exact_.find(std::string(name)); found != exact_.end())
    return Match{found->second, {}, false, true};
  for (const auto& [pattern, row] : patterns_) {
    if (auto stars = match_name(pattern, name)) return Match{row, std::move(*stars), pattern == "*", false};
  }
  return std::nullopt;
}

/// Parses the tables.
struct BlockFamilies::Parser {
  BlockFamilies& out;
  std::string context;

  [[nodiscard]] Error fault(const std::string& reason) const {
    return make_error(ErrorCode::BadFormat, context + ": " + reason);
  }

  /// Parses "nsew:side@0,0,16,8/90": the letters of directions, '*' for all and 'h' for the four sides, then the
  /// texture variable, the part of the texture and its turn. '-' instead of a variable removes the faces.
  Status faces(const std::string& token, Box& box) const {
    auto [letters, look] = split(token, ':');
    Face face;
    std::string uv;
    std::string turn;
    std::tie(look, turn) = split(look, '/');
    std::tie(face.variable, uv) = split(look, '@');
    if (face.variable.empty()) return fault("the face " + token + " has no texture");
    if (!uv.empty()) face.uv = family_numbers<4>(uv, 0.0F, 16.0F);
    if (!uv.empty() && !face.uv) return fault("invalid texture part " + uv);
    if (!turn.empty()) {
      const auto degrees = parse_float(turn);
      if (!degrees || (*degrees != 90.0F && *degrees != 180.0F && *degrees != 270.0F)) {
        return fault("invalid texture turn " + turn);
      }
      face.turn = static_cast<int>(*degrees);
    }
    for (const char letter : letters) {
      const std::string_view all = letter == '*' ? "nsewud" : letter == 'h' ? "nsew" : std::string_view(&letter, 1);
      if (std::string_view("*hnsewud").find(letter) == std::string_view::npos) {
        return fault("unknown direction in " + token);
      }
      for (const char each : all) {
        if (face.variable == "-") {
          box.faces.erase(each);
        } else {
          box.faces[each] = face;
        }
      }
    }
    return {};
  }

  /// Parses "turn=y,45,8,8,8" or "turn=y,45,8,8,8,r": axis, degrees, origin, rescale.
  Status turn(const std::string& text, Box& box) const {
    std::vector<std::string> parts = words(text, ',');
    const bool rescales = parts.size() == 6 && parts.back() == "r";
    if (rescales) parts.pop_back();
    if (parts.size() != 5 || (parts[0] != "x" && parts[0] != "y" && parts[0] != "z")) {
      return fault("invalid turn " + text);
    }
    const auto degrees = parse_float(parts[1]);
    const auto origin = family_numbers<3>(parts[2] + "," + parts[3] + "," + parts[4], -16.0F, 32.0F);
    if (!degrees || std::abs(*degrees) > 90.0F || !origin) return fault("invalid turn " + text);
    Json json = {{"origin", *origin}, {"axis", parts[0]}, {"angle", *degrees}};
    if (rescales) json["rescale"] = true;
    box.turn = json.dump();
    return {};
  }

  Status box(const std::string& text, std::vector<Box>& boxes) const {
    const std::vector<std::string> tokens = words(text);
    Box made;
    if (tokens.size() < 7) return fault("a box needs six numbers and its faces: " + text);
    for (std::size_t i = 0; i < 6; ++i) {
      const auto number = parse_float(tokens[i]);
      if (!number || *number < -16.0F || *number > 32.0F) return fault("invalid corner " + tokens[i]);
      (i < 3 ? made.from[i] : made.to[i - 3]) = *number;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      if (made.from[i] > made.to[i]) return fault("exchanged corners: " + text);
    }
    for (std::size_t i = 6; i < tokens.size(); ++i) {
      Status status;
      if (tokens[i].starts_with("turn=")) {
        status = turn(tokens[i].substr(5), made);
      } else if (tokens[i] == "noshade") {
        made.has_shade = false;
      } else {
        status = faces(tokens[i], made);
      }
      if (!status) return status;
    }
    boxes.push_back(std::move(made));
    return {};
  }

  /// Parses a model: boxes, and "+NAME x y z" for the boxes of another model, moved.
  Status model(const std::string& name, const Json& json) {
    context = "model " + name;
    if (!json.is_array()) return fault("must be a list of boxes");
    std::vector<Box> boxes;
    for (const Json& each : json) {
      if (!each.is_string()) return fault("must be a list of texts");
      const auto text = each.get<std::string>();
      if (text.starts_with('+')) {
        const std::vector<std::string> parts = words(text.substr(1));
        const auto other = out.models_.find(parts.empty() ? "" : parts[0]);
        if (other == out.models_.end()) return fault("no earlier model " + text.substr(1));
        std::optional<std::array<float, 3>> move = std::array<float, 3>{};
        if (parts.size() == 4) {
          move = family_numbers<3>(parts[1] + "," + parts[2] + "," + parts[3], -16.0F, 16.0F);
        }
        if (!move || (parts.size() != 1 && parts.size() != 4)) return fault("invalid move " + text);
        for (Box box : other->second) {
          if (parts.size() == 4 && !box.turn.empty()) return fault("a turned box cannot be moved");
          for (std::size_t i = 0; i < 3; ++i) {
            box.from[i] += (*move)[i];
            box.to[i] += (*move)[i];
          }
          boxes.push_back(std::move(box));
        }
      } else if (auto status = box(text, boxes); !status) {
        return status;
      }
      if (boxes.size() > kMaxBoxes) return fault("more than " + std::to_string(kMaxBoxes) + " boxes");
    }
    out.models_[name] = std::move(boxes);
    return {};
  }

  /// Adds the turned versions of a state: "facing:north" means one per value of `facing`, of a model made for north.
  Status spin(const std::string& kind, const std::string& base, const State& state, Family& family) const {
    const auto add = [&](const std::string& key, std::string_view value, int x, int y, const std::string& model) {
      State turned = state;
      turned.when.emplace_back(key, value);
      turned.x = x;
      turned.y = y;
      turned.model = model;
      family.states.push_back(std::move(turned));
    };
    const auto from = std::ranges::find(kDirectionNames, base);
    if (kind == "facing" || kind == "sides" || kind == "rotation") {
      if (from == std::end(kDirectionNames)) return fault("unknown direction " + base);
      const auto first = static_cast<int>(from - std::begin(kDirectionNames));
      for (int k = 0; k < (kind == "rotation" ? 16 : 4); ++k) {
        if (kind == "facing") {
          add(kind, kDirectionNames[(first + k) % 4], 0, k * 90, state.model);
        } else if (kind == "sides") {
          State turned = state;
          turned.y = k * 90;
          for (auto& [key, value] : turned.when) {
            if (key == "side") key = kDirectionNames[(first + k) % 4];
          }
          family.states.push_back(std::move(turned));
        } else {  // 0 faces south
          const int steps = ((2 - first) * 4 + k + 16) % 16;
          constexpr const char* kParts[] = {"", "_turn1", "_turn2", "_turn3"};
          add(kind, std::to_string(k), 0, (steps + 1) / 4 % 4 * 90, state.model + kParts[steps % 4]);
        }
      }
    } else if (kind == "facing6" && (base == "up" || base == "north")) {
      const bool is_up = base == "up";
      for (int k = 0; k < 4; ++k) add("facing", kDirectionNames[k], is_up ? 90 : 0, k * 90, state.model);
      add("facing", "up", is_up ? 0 : 270, 0, state.model);
      add("facing", "down", is_up ? 180 : 90, 0, state.model);
    } else if (kind == "axis") {
      add(kind, "y", 0, 0, state.model);
      add(kind, "z", 90, 0, state.model);
      add(kind, "x", 90, 90, state.model);
    } else {
      return fault("unknown option " + kind + ":" + base);
    }
    return {};
  }

  /// Parses "half=bottom,shape=straight > _inner facing:east uvlock": values of properties, the end of the model's name
  /// ('.' for none), turns.
  Status state(const std::string& text, Family& family) const {
    const std::size_t arrow = text.find('>');
    if (arrow == std::string::npos) return fault("a state needs '>': " + text);
    State state;
    const std::vector<std::string> condition = words(text.substr(0, arrow));
    for (const std::string& each : words(condition.empty() ? "" : condition[0], ',')) {
      state.when.push_back(split(each, '='));
      if (state.when.back().second.empty()) return fault("a property without a value: " + each);
    }
    std::string spin_kind;
    std::string spin_base;
    for (const std::string& token : words(text.substr(arrow + 1))) {
      if (token == "uvlock") {
        state.keeps_uv = true;
      } else if (token.starts_with("x=") || token.starts_with("y=")) {
        const auto degrees = parse_float(token.substr(2));
        if (!degrees || std::fmod(*degrees, 90.0F) != 0.0F || *degrees < 0.0F || *degrees > 270.0F) {
          return fault("invalid turn " + token);
        }
        (token[0] == 'x' ? state.x : state.y) = static_cast<int>(*degrees);
      } else if (token == "axis") {
        spin_kind = token;
      } else if (token.find(':') != std::string::npos) {
        std::tie(spin_kind, spin_base) = split(token, ':');
      } else {
        state.model = token == "." ? "" : token;
      }
    }
    if (!family.models.contains(state.model)) return fault("no model " + state.model + " for " + text);
    const std::size_t first = family.states.size();
    if (spin_kind.empty()) {
      family.states.push_back(state);
    } else if (auto status = spin(spin_kind, spin_base, state, family); !status) {
      return status;
    }
    // Half turns of the state itself, such as upside down, come on top of the turns above.
    for (std::size_t i = first; !spin_kind.empty() && i < family.states.size(); ++i) {
      family.states[i].x = (family.states[i].x + state.x) % 360;
      family.states[i].y = (family.states[i].y + state.y) % 360;
    }
    if (!family.has_parts) expand_values(first, family);
    return family.states.size() <= kMaxStates ? Status() : fault("more than " + std::to_string(kMaxStates) + " states");
  }

  /// Replaces variants with alternative values, "age=0|1", by one variant per value.
  static void expand_values(std::size_t first, Family& family) {
    for (std::size_t i = first; i < family.states.size();) {
      const auto found = std::ranges::find_if(
          family.states[i].when, [](const auto& pair) { return pair.second.find('|') != std::string::npos; });
      if (found == family.states[i].when.end()) {
        ++i;
        continue;
      }
      const State state = family.states[i];
      const auto number = found - family.states[i].when.begin();
      family.states.erase(family.states.begin() + static_cast<std::ptrdiff_t>(i));
      for (const std::string& value : words(state.when[static_cast<std::size_t>(number)].second, '|')) {
        family.states.push_back(state);
        family.states.back().when[static_cast<std::size_t>(number)].second = value;
      }
    }
  }

  /// Parses "turn", "fluid" and "joins" of a family.
  Status trait(const std::string& key, const std::string& value, Traits& traits) const {
    constexpr std::array<std::string_view, 3> kTurns = {"4dir", "facedir", "wallmounted"};
    constexpr std::array<std::string_view, 2> kFluids = {"source", "flowing"};
    // The bits of the own pack's blocks come first: pack_looks.cpp.
    constexpr std::array<std::string_view, 7> kGroups = {"fence", "pane", "rail", "powder", "water", "river", "lava"};
    constexpr unsigned kFirstGroup = 8;
    const auto is_one_of = [&](const auto& names) { return std::ranges::find(names, value) != names.end(); };
    if (key == "turn" && is_one_of(kTurns)) {
      traits.turn = value;
    } else if (key == "fluid" && is_one_of(kFluids)) {
      traits.fluid = value;
    } else if (key == "joins" && is_one_of(kGroups)) {
      traits.groups = 1U << (kFirstGroup + static_cast<unsigned>(std::ranges::find(kGroups, value) - kGroups.begin()));
    } else if (key == "mirror" && value == "diagonal") {
      traits.mirror = value;
    } else {
      return fault("unknown " + key + " " + value);
    }
    return {};
  }

  Status family(const std::string& name, const Json& json) {
    context = "family " + name;
    if (!json.is_object()) return fault("must be an object");
    Family made;
    for (const auto& [key, value] : json.items()) {
      if (key == "models" && value.is_object()) {
        for (const auto& [end, model] : value.items()) {
          std::vector<std::string> parts = words(model.is_string() ? model.get<std::string>() : "");
          if (parts.empty() || !out.models_.contains(parts[0])) return fault("no model for " + end);
          out.model_ends_.insert(end);
          ModelUse& use = made.models[end];
          use.model = parts[0];
          for (std::size_t i = 1; i < parts.size(); ++i) use.renamed.push_back(split(parts[i], '='));
        }
      } else if (key == "full" && value.is_boolean()) {
        made.is_full = value.get<bool>();
      } else if (key == "joins_full" && value.is_boolean()) {
        made.traits.joins_full_sides = value.get<bool>();
      } else if ((key == "turn" || key == "fluid" || key == "joins" || key == "mirror") && value.is_string()) {
        if (auto status = trait(key, value.get<std::string>(), made.traits); !status) return status;
      } else if (key != "states" && key != "parts") {
        return fault("unknown key " + key);
      }
    }
    made.has_parts = json.contains("parts");
    if (made.has_parts == json.contains("states")) return fault("needs either states or parts");
    const Json& states = made.has_parts ? json["parts"] : json["states"];
    if (!states.is_array() || states.empty()) return fault("states must be a list");
    for (const Json& each : states) {
      if (!each.is_string()) return fault("states must be texts");
      if (auto status = state(each.get<std::string>(), made); !status) return status;
    }
    out.families_[name] = std::move(made);
    return {};
  }

  /// Parses ["*_stairs", "stairs", "top=@top side=@side", "tinted variables"].
  Status rule(const Json& json) {
    context = "rule " + json.dump().substr(0, 60);
    if (!json.is_array() || json.size() < 2 || json.size() > 4) return fault("must have 2 to 4 texts");
    std::vector<std::string> texts;
    for (const Json& each : json) {
      std::string& text = texts.emplace_back();
      for (const Json& part : each.is_array() ? each : Json::array({each})) {  // a long text is a list of texts
        if (!part.is_string()) return fault("must have 2 to 4 texts");
        text += (text.empty() ? "" : " ") + part.get<std::string>();
      }
    }
    Rule made;
    made.family = texts[1];
    if (!made.family.starts_with('=') && !out.families_.contains(made.family)) {
      return fault("no family " + made.family);
    }
    if (texts.size() > 2) {
      for (const std::string& each : words(texts[2])) {
        made.textures.push_back(split(each, '='));
        if (made.textures.back().second.empty()) return fault("a variable without a texture: " + each);
      }
    }
    if (texts.size() > 3) made.tinted = words(texts[3]);
    if (auto status = out.names_.add(texts[0], out.rules_.size()); !status) {
      return fault(status.error().message);
    }
    out.rules_.push_back(std::move(made));
    return out.rules_.size() <= kMaxRows ? Status() : fault("more than " + std::to_string(kMaxRows) + " rules");
  }
};

Result<BlockFamilies> BlockFamilies::from_text(std::string_view families, std::string_view rules,
                                               std::string_view texture_space) {
  BlockFamilies made;
  made.texture_space_ = texture_space;
  Parser parser{made, {}};
  const Json tables = Json::parse(families, nullptr, false);
  const Json rows = Json::parse(rules, nullptr, false);
  const auto is_table = [&](const char* key) { return tables.contains(key) && tables[key].is_array(); };
  if (!tables.is_object() || !is_table("models") || !is_table("families")) {
    return make_error(ErrorCode::BadFormat, "the table of families is no JSON object with models and families");
  }
  if (!rows.is_array()) return make_error(ErrorCode::BadFormat, "the table of rules is no JSON list");
  for (const char* const key : {"models", "families"}) {
    for (const Json& group : tables[key]) {
      for (const auto& [name, value] : group.items()) {
        const bool is_model = std::string_view(key) == "models";
        if (auto status = is_model ? parser.model(name, value) : parser.family(name, value); !status) {
          return status.error();
        }
      }
    }
  }
  for (const Json& row : rows) {
    if (auto status = parser.rule(row); !status) return status.error();
  }
  if (const auto last = made.names_.find("?"); !last || !last->is_fallback) {
    return make_error(ErrorCode::BadFormat, "the table of rules has no rule for all names");
  }
  return made;
}

BlockFamilies::Found BlockFamilies::find(const ResourceName& block, int depth) const {
  auto match = names_.find(texture_space_.empty() ? block.path : block.space + ":" + block.path);
  QUOIN_ASSERT(match, "a rule for all names");
  const Rule& rule = rules_[match->row];
  if (rule.family.starts_with('=')) {
    const std::string name = filled(rule.family.substr(1), block, match->stars);
    const ResourceName other = texture_space_.empty() ? ResourceName{block.space, name} : split_resource_name(name);
    if (depth < kMaxAliases) return find(other, depth + 1);
    match->row = names_.find("?")->row;
  }
  const Rule& found = rules_[match->row];
  return {&found,         &families_.find(found.family)->second, block, std::move(match->stars), match->is_fallback,
          match->is_exact};
}

/// Returns the blocks that may be the material of a block, the likeliest first, and whether only a rule of this name
/// counts.
std::vector<std::pair<ResourceName, bool>> BlockFamilies::materials(const Found& found) const {
  const std::string& space = found.block.space;
  const std::string base = found.stars.empty() ? found.block.path : found.stars[0];
  if (texture_space_.empty()) {
    // Bamboo has planks and a block, quartz only a block; other names may be woods of mods.
    return {{{space, base}, false},
            {{space, base + "s"}, false},
            {{space, base + "_planks"}, true},
            {{space, base + "_block"}, false},
            {{space, base + "_planks"}, false}};
  }
  // The last star is the name of a material, of the game's own mods or of the same mod.
  const std::string& name = found.stars.empty() ? found.block.path : found.stars.back();
  return {{{"default", name}, false}, {{"farming", name}, true}, {{space, name}, false}};
}

std::string BlockFamilies::texture_of_material(const Found& found, std::string_view side) const {
  static const std::map<std::string_view, std::vector<std::string_view>> known_variables = {
      {"top", {"top", "end", "all", "side"}},
      {"bottom", {"bottom", "end", "top", "all", "side"}},
      {"side", {"side", "all", "front"}},
  };
  const std::vector<std::pair<ResourceName, bool>> candidates = materials(found);
  for (const auto& [name, is_listed] : candidates) {
    const Found material = find(name);
    if (material.is_fallback || !material.family->is_full || (is_listed && !material.is_exact)) continue;
    const auto variables = known_variables.find(side);
    for (const std::string_view variable :
         variables != known_variables.end() ? variables->second : known_variables.at("side")) {
      for (const auto& [key, value] : material.rule->textures) {
        if (key == variable) return texture(material, value);
      }
    }
  }
  const ResourceName& last = candidates.back().first;
  return texture_space_.empty() ? "quoin:block/" + last.space + "/" + last.path
                                : texture_space_ + ":block/" + last.space + "_" + last.path;
}

std::string BlockFamilies::texture(const Found& found, const std::string& text) const {
  if (text.starts_with('@')) return texture_of_material(found, std::string_view(text).substr(1));
  const ResourceName named = split_resource_name(filled(text, found.block, found.stars));
  const bool has_space = text.find(':') != std::string::npos;
  const bool has_folder = named.path.starts_with("block/") || named.path.starts_with("entity/");
  const std::string& space = texture_space_.empty() ? found.block.space : texture_space_;
  return (has_space ? named.space : space) + ":" + (has_folder ? "" : "block/") + named.path;
}

std::string BlockFamilies::model_name(const ResourceName& block, const Found& found, const std::string& end) const {
  if (found.is_fallback) return "quoin:block/" + block.space + "/" + block.path + end;
  return block.space + ":block/" + block.path + end;
}

std::string BlockFamilies::block_state(const ResourceName& block) const {
  const Found found = find(block);
  Json file = Json::object();
  for (const State& state : found.family->states) {
    Json apply = {{"model", model_name(block, found, state.model)}};
    if (state.x != 0) apply["x"] = state.x;
    if (state.y != 0) apply["y"] = state.y;
    if (state.keeps_uv) apply["uvlock"] = true;
    if (found.family->has_parts) {
      Json part = {{"apply", std::move(apply)}};
      for (const auto& [key, value] : state.when) part["when"][key] = value;
      file["multipart"].push_back(std::move(part));
      continue;
    }
    std::string key;
    for (const auto& [property, value] : state.when) {
      key.append(key.empty() ? "" : ",").append(property).append("=").append(value);
    }
    file["variants"][key] = std::move(apply);
  }
  return file.dump();
}

std::string BlockFamilies::model_json(const std::vector<Box>& boxes, const Pairs& textures,
                                      const std::vector<std::string>& tinted) const {
  static const std::map<char, std::tuple<const char*, int, bool>> sides = {
      {'n', {"north", 2, false}}, {'s', {"south", 2, true}}, {'e', {"east", 0, true}},
      {'w', {"west", 0, false}},  {'u', {"up", 1, true}},    {'d', {"down", 1, false}}};
  Json file = Json::object();
  for (const auto& [variable, texture] : textures) file["textures"][variable] = texture;
  for (const Box& box : boxes) {
    Json element = {{"from", box.from}, {"to", box.to}, {"faces", Json::object()}};
    if (!box.turn.empty()) element["rotation"] = Json::parse(box.turn);
    if (!box.has_shade) element["shade"] = false;
    for (const auto& [letter, face] : box.faces) {
      const auto& [name, axis, is_high] = sides.at(letter);
      Json side = {{"texture", "#" + face.variable}};
      if (const auto part = face.uv ? face.uv : part_inside(box.from, box.to, letter)) side["uv"] = *part;
      if (face.turn != 0) side["rotation"] = face.turn;
      if (std::ranges::find(tinted, face.variable) != tinted.end()) side["tintindex"] = 0;
      const auto at = static_cast<std::size_t>(axis);
      const bool is_outside = is_high ? box.to[at] == 16.0F : box.from[at] == 0.0F;
      if (is_outside && box.turn.empty()) side["cullface"] = name;
      element["faces"][name] = std::move(side);
    }
    file["elements"].push_back(std::move(element));
  }
  return file.dump();
}

std::optional<std::string> BlockFamilies::model(const ResourceName& model) const {
  constexpr std::string_view kFolder = "block/";
  if (!model.path.starts_with(kFolder)) return std::nullopt;
  ResourceName block{model.space, model.path.substr(kFolder.size())};
  const bool is_fallback = model.space == "quoin" && block.path.find('/') != std::string::npos;
  if (is_fallback) std::tie(block.space, block.path) = split(block.path, '/');
  const auto made = [&](const ResourceName& name, const std::string& end) -> std::optional<std::string> {
    std::string base = end;
    int turns = 0;  // of "_turn1" to "_turn3"
    if (end.size() >= 6 && end.substr(end.size() - 6, 5) == "_turn" && end.back() >= '1' && end.back() <= '3') {
      turns = end.back() - '0';
      base = end.substr(0, end.size() - 6);
    }
    if (!model_ends_.contains(base)) return std::nullopt;  // searching for a rule costs more
    const Found found = find(name);
    if (found.is_fallback != is_fallback) return std::nullopt;
    const auto local = found.family->models.find(base);
    if (local == found.family->models.end()) return std::nullopt;
    Pairs textures;
    for (const auto& [variable, text] : found.rule->textures) textures.emplace_back(variable, texture(found, text));
    std::vector<Box> boxes = models_.find(local->second.model)->second;
    for (Box& box : boxes) {
      for (auto& [letter, face] : box.faces) {
        const auto renamed = std::ranges::find(local->second.renamed, face.variable, &Pairs::value_type::first);
        if (renamed != local->second.renamed.end()) face.variable = renamed->second;
      }
    }
    constexpr std::array kTurns = {0.0F, -22.5F, -45.0F, 22.5F};
    for (Box& box : boxes) {
      if (turns == 0) break;
      box.turn =
          Json({{"origin", {8, 8, 8}}, {"axis", "y"}, {"angle", kTurns[static_cast<std::size_t>(turns)]}}).dump();
    }
    return model_json(boxes, textures, found.rule->tinted);
  };
  for (std::size_t at = block.path.find('_', 1); at != std::string::npos; at = block.path.find('_', at + 1)) {
    if (auto json = made({block.space, block.path.substr(0, at)}, block.path.substr(at))) return json;
  }
  if (auto json = made(block, "")) return json;
  // Models of other packs refer to published parents, such as cube_all: models whose textures are still variables.
  const auto parent = models_.find(block.path);
  if (block.space != "minecraft" || is_fallback || parent == models_.end()) return std::nullopt;
  return model_json(parent->second, {}, {});
}

BlockFamilies::Traits BlockFamilies::traits(const ResourceName& block) const {
  const Found found = find(block);
  Traits traits = found.family->traits;
  traits.is_fallback = found.is_fallback;
  traits.is_full = found.family->is_full;
  return traits;
}

std::string BlockFamilies::family(const ResourceName& block) const {
  return find(block).rule->family;
}

bool BlockFamilies::is_known(const ResourceName& block) const {
  return !find(block).is_fallback;
}

}  // namespace quoin::packs
