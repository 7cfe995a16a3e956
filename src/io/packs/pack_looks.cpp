#include "io/packs/pack_looks.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>
#include <quoin/core/assert.h>
#include <quoin/io/image_files.h>

#include "core/bytes/text.h"
#include "io/luanti/luanti.h"
#include "io/minecraft/block_looks.h"
#include "io/minecraft/block_types.h"
#include "io/packs/node_pack.h"
#include "io/packs/pack_own.h"
#include "io/packs/pack_shapes.h"
#include "io/packs/state_conditions.h"

namespace quoin::packs {

namespace {

constexpr Rgba8 kWhite{255, 255, 255};
constexpr std::size_t kMaxNames = 8;  // of a report
// Groups of fluids (ShapeRules::groups); see `joined_group` for those of other blocks.
constexpr std::uint32_t kWaterGroup = 1U << 4;
constexpr std::uint32_t kLavaGroup = 1U << 5;

std::string_view without_space(std::string_view block) {
  const std::size_t colon = block.find(':');
  return colon == std::string_view::npos ? block : block.substr(colon + 1);
}

bool has_any(std::string_view name, std::initializer_list<std::string_view> words) {
  return std::ranges::any_of(words, [&](std::string_view word) { return name.find(word) != std::string_view::npos; });
}

/// Returns the tint of a type's faces: the one of its name, in the colour that the importer found.
minecraft::NamedTint tint_of(const VoxelProperties& type, std::string_view name) {
  minecraft::NamedTint tint = minecraft::tint_of_block(name);
  if (const auto found = type.attributes.find(minecraft::kTintColourAttribute); found != type.attributes.end()) {
    const std::string& digits = found->second;
    std::uint32_t rgb = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), rgb, 16);
    if (error == std::errc() && end == digits.data() + digits.size()) tint.rgb = rgb;
  }
  return tint;
}

/// A model that a type shows, and when.
struct Outcome {
  StateModel state;
  Rgba8 tint = kWhite;
  std::vector<ShapeCondition> when;
  std::shared_ptr<const BlockModel> model;
};

bool is_same_model(const StateModel& a, const StateModel& b) {
  return std::tie(a.model, a.x, a.y, a.keeps_uv) == std::tie(b.model, b.x, b.y, b.keeps_uv);
}

bool is_always(const std::vector<ShapeCondition>& when) {
  return when.size() == 1 && when.front() == ShapeCondition{};
}

/// Returns the group of blocks that join each other (ShapeRules::groups).
std::uint32_t joined_group(std::string_view name) {
  if (name.ends_with("redstone_wire")) return 1U << 3;
  if (name.ends_with("fence")) return has_any(name, {"nether"}) ? 1U << 1 : 1U << 0;
  return 1U << 2;
}

}  // namespace

Result<std::shared_ptr<const BlockStates>> PackLibrary::states_of(const std::string& block) {
  if (const auto known = states.find(block); known != states.end()) return known->second;
  using Known = Result<std::shared_ptr<const BlockStates>>;
  const auto remember = [&](Known result) { return states.emplace(block, std::move(result)).first->second; };
  const auto name = resource_name(block);
  if (!name) return remember(std::shared_ptr<const BlockStates>());
  const std::string path = "assets/" + name->space + "/blockstates/" + name->path + ".json";
  const auto json = read_pack_json(pack, path);
  if (!json) return remember(json.error());
  if (!*json) return remember(std::shared_ptr<const BlockStates>());
  auto parsed = parse_block_states(**json);
  if (!parsed) {
    parsed.error().path = path;
    return remember(parsed.error());
  }
  return remember(std::make_shared<const BlockStates>(std::move(*parsed)));
}

/// A library that may have the look of a type, and the block whose look it is.
struct BlockLooks::Source {
  PackLibrary* library = nullptr;
  TypeStates states;
  BlockFamilies::Traits node{};  ///< of Luanti nodes
  bool is_named = false;         ///< replaces the looks of an earlier conversion
};

/// Makes the look of one type from one library.
class BlockLooks::Maker {
 public:
  Maker(BlockLooks& looks, Source source, const VoxelProperties& type)
      : looks_(looks),
        library_(*source.library),
        type_(type),
        states_(std::move(source.states)),
        node_(std::move(source.node)),
        name_(without_space(states_.block())),
        is_own_(looks.own_library_ && &library_ == &*looks.own_library_),
        light_(light_without_packs(type_, states_)) {}

  /// Returns the type with its look; nullopt if the library has none. Errors: of files, with their path.
  Result<std::optional<VoxelProperties>> make() {
    if (is_fluid() && !keeps_fluid()) {
      if (auto fluid = make_fluid()) return std::optional(std::move(*fluid));
    }
    const auto found = library_.states_of(states_.block());
    if (!found) return found.error();
    if (*found == nullptr) return std::optional<VoxelProperties>();
    const BlockStates& states = **found;
    if (!states.is_multipart) states_.choose_absent(states);
    if (auto done = find_outcomes(states, Choices::Heaviest); !done) return done.error();
    if (outcomes_.empty()) return std::optional<VoxelProperties>();
    if (!node_.fluid.empty()) return make_node_fluid();
    const auto is_textured = [&](const Outcome& outcome) {
      return std::ranges::any_of(outcome.model->elements(), [&](const PackElement& element) {
        return std::ranges::any_of(
            element.faces, [&](const auto& face) { return face && texture_of_face(*outcome.model, *face) != nullptr; });
      });
    };
    has_textures_ = std::ranges::any_of(outcomes_, is_textured);
    is_multipart_ = states.is_multipart;
    if (!is_multipart_) {
      if (auto cube = make_cube()) return std::optional(std::move(*cube));
    }
    if (std::ranges::any_of(states.cases, [](const StateCase& each) { return each.models.size() > 1; })) {
      if (auto chosen = make_choices(states)) return chosen;
    }
    auto shaped = make_shapes();
    if (!shaped) return shaped.error();
    return std::optional(std::move(*shaped));
  }

  /// Appends the names of the textures that `make` needs, apart from those of lighter models. Returns true if the
  /// library has a look for the type.
  bool list_textures(std::vector<ResourceName>& names) {
    is_quiet_ = true;
    if (is_fluid() && !keeps_fluid()) {
      for (const char* const end : {"_still", "_flow"}) names.push_back({"minecraft", fluid_texture(end)});
      return true;
    }
    const auto found = library_.states_of(states_.block());
    if (!found || *found == nullptr) return false;
    if (!(*found)->is_multipart) states_.choose_absent(**found);
    if (!find_outcomes(**found, Choices::Heaviest)) return false;
    for (const Outcome& outcome : outcomes_) {
      for (const PackElement& element : outcome.model->elements()) {
        for (const auto& face : element.faces) {
          auto name = face ? outcome.model->texture(face->texture) : std::nullopt;
          if (name) names.push_back(std::move(*name));
        }
      }
    }
    return !outcomes_.empty();
  }

 private:
  enum class Choices : std::uint8_t { Heaviest, ByPosition };

  /// Returns the type with shapes that choose among models by position; nullopt, noted, if it has too many parts.
  std::optional<VoxelProperties> make_choices(const BlockStates& states) {
    const std::vector<Outcome> heaviest = outcomes_;
    outcomes_.clear();
    std::string reason = "no model of its choices can be used";
    if (const Status found = find_outcomes(states, Choices::ByPosition); !found) {
      reason = found.error().message;
    } else if (!outcomes_.empty()) {
      auto shaped = make_shapes();
      const Status valid = shaped ? validate_type(*shaped) : Status(shaped.error());
      if (valid) return std::move(*shaped);
      reason = valid.error().message;
    }
    outcomes_ = heaviest;
    if (!is_own_) {
      ++looks_.report_.without_choices;
      looks_.note(type_.name, reason + "; its heaviest model is shown everywhere");
    }
    return std::nullopt;
  }

  /// Returns the tint of faces by the packs' colour maps.
  [[nodiscard]] Rgba8 tint() const {
    const minecraft::NamedTint named = tint_of(type_, name_);
    return minecraft::colour_of_rgb(looks_.tint_by_maps(named.kind, named.rgb));
  }

  [[nodiscard]] bool is_fluid() const {
    if (name_ != "water" && name_ != "lava" && name_ != "bubble_column") return false;
    const minecraft::StateField* const level = states_.field("level");
    return level == nullptr ? type_.state_bits == 0 || name_ == "bubble_column"
                            : level->first_bit == 0 && level->kind == 'n';
  }

  [[nodiscard]] std::string fluid_texture(const char* end) const {
    return std::string(name_ == "lava" ? "block/lava" : "block/water") + end;
  }

  /// Returns true if a fluid has the look of an earlier conversion and only the own pack could replace it.
  [[nodiscard]] bool keeps_fluid() const {
    if (!looks_.own_library_ || (type_.faces.empty() && type_.shapes.empty())) return false;
    const std::string path = "assets/minecraft/textures/" + fluid_texture("_still") + ".png";
    const auto found = looks_.packs_->read(path, kMaxImageBytes);
    return found && !*found;
  }

  std::optional<VoxelProperties> make_fluid() {
    const auto read = [&](const char* end) { return texture_named({"minecraft", fluid_texture(end)}); };
    const PackTexture* const still = read("_still");
    if (still == nullptr) return std::nullopt;
    const PackTexture* const flow = read("_flow");
    const Rgba8 colour = name_ == "lava" ? kWhite : tint();
    const VoxelFace top{.texture = still->texture, .turn = 3, .tint = colour, .alpha = still->alpha};
    VoxelFace side = top;
    side.turn = 0;
    if (flow != nullptr) {
      // A side shows a quarter of this texture, which has twice the edge.
      FaceLayer layer{.look = {.texture = flow->texture, .alpha = flow->alpha}};
      if (flow->texture.size() == 2 * still->texture.size()) {
        layer.part = {0.0F, 0.0F, 8.0F, 8.0F};
        layer = looks_.textures_.blended(layer, nullptr);
      }
      side.texture = layer.look.texture;
      side.alpha = layer.look.alpha;
    }
    ShapeRules rules{.neighbours = ShapeNeighbours::Fluid, .groups = name_ == "lava" ? kLavaGroup : kWaterGroup};
    auto shapes = VoxelShapes::from_rules(std::move(rules));
    if (!shapes) return std::nullopt;
    VoxelProperties made = type_;
    VoxelFace bottom = top;
    bottom.turn = 0;
    made.faces = VoxelFaces(side, top, bottom);
    made.shapes = std::move(*shapes);
    settle(made);
    return made;
  }

  /// Makes a liquid of Luanti. The importer turned levels of flowing liquids around (docs/formats/luanti.md); maps that
  /// were converted before have whole cubes.
  Result<std::optional<VoxelProperties>> make_node_fluid() {
    const auto look = [&](const char* variable) {
      VoxelFace face{.tint = {type_.colour.r, type_.colour.g, type_.colour.b}};
      const PackTexture* const found = texture_of_face(*outcomes_.front().model, {.texture = variable});
      if (found != nullptr) face = {.texture = found->texture, .alpha = found->alpha};
      return face;
    };
    const VoxelFace top = look("#still");
    VoxelProperties made = type_;
    if (!top.texture.is_null()) made.faces = VoxelFaces(look("#flow"), top, top);
    const auto states = type_.attributes.find(models::kNodeStatesAttribute);
    if (node_.fluid == "source" || (states != type_.attributes.end() && states->second.starts_with("drop:"))) {
      auto shapes = VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid, .groups = node_.groups});
      if (!shapes) return shapes.error();
      made.shapes = std::move(*shapes);
    }
    has_textures_ = !made.faces.empty();
    settle(made);
    return std::optional(std::move(made));
  }

  /// Fills `outcomes_`: models with elements, without cases that cannot hold, equal ones once. The game draws models
  /// without elements by code.
  Status find_outcomes(const BlockStates& states, Choices choices) {
    const Rgba8 colour = tint();
    std::size_t condition_count = 0;
    std::vector<ShapeCondition> taken;  // by earlier variants
    for (const StateCase& each : states.cases) {
      auto when = states_.conditions(each);
      if (!when) return when.error();
      if (!states.is_multipart && !when->empty()) {
        auto left = conditions_without(*when, taken);
        if (!left) return left.error();
        taken.insert(taken.end(), when->begin(), when->end());
        when = std::move(left);
      }
      condition_count += when->size();
      if (condition_count > kMaxTypeConditions) {
        return make_error(ErrorCode::LimitExceeded,
                          "more than " + std::to_string(kMaxTypeConditions) + " conditions of a block");
      }
      if (when->empty()) continue;
      if (choices == Choices::Heaviest || each.models.size() == 1) {
        add_model(each.heaviest(), colour, std::move(*when));
      } else if (auto done = add_choices(each, colour, *when); !done) {
        return done;
      }
    }
    std::erase_if(outcomes_, [](const Outcome& each) { return each.model->elements().empty(); });
    for (const Outcome& outcome : outcomes_) {
      for (const PackElement& each : outcome.model->elements()) {
        has_element_light_ = has_element_light_ || each.light_emission > 0;
        if (light_.may_meet(outcome.when)) greatest_light_ = std::max(greatest_light_, each.light_emission);
      }
    }
    return {};
  }

  /// Adds the models of a case, each with its share of positions.
  Status add_choices(const StateCase& each, Rgba8 colour, const std::vector<ShapeCondition>& when) {
    std::int64_t total = 0;
    for (const StateModel& model : each.models) total += model.weight;
    if (total > kMaxPositionCount) {
      return make_error(ErrorCode::LimitExceeded,
                        "the weights of its models have a sum above " + std::to_string(kMaxPositionCount));
    }
    std::uint16_t first = 0;
    for (const StateModel& model : each.models) {
      const auto end = static_cast<std::uint16_t>(first + model.weight);
      std::vector<ShapeCondition> share = when;
      for (ShapeCondition& condition : share) condition.positions = {static_cast<std::uint16_t>(total), first, end};
      add_model(model, colour, std::move(share));
      first = end;
    }
    return {};
  }

  void add_model(const StateModel& state, Rgba8 colour, std::vector<ShapeCondition> when) {
    const auto model = library_.models.model(state.model);
    if (!model || *model == nullptr) {
      note_model(state.model, model ? std::string("no such model") : to_string(model.error()));
      return;
    }
    const minecraft::StateTint* const by_state = minecraft::state_tint_of(name_);
    const minecraft::StateField* const field = by_state == nullptr ? nullptr : states_.field(by_state->property);
    if (field == nullptr || !has_tinted_face(**model)) {
      add_outcome(state, colour, std::move(when), *model);
    } else {
      add_by_state(*by_state, *field, state, when, *model);
    }
  }

  /// Counts a model that cannot be used, once.
  void note_model(const std::string& name, const std::string& reason) {
    if (is_quiet_ || is_own_ || !looks_.missing_.insert("model " + name).second) return;
    ++looks_.report_.missing_models;
    looks_.note("model " + name, reason);
  }

  static bool has_tinted_face(const BlockModel& model) {
    return std::ranges::any_of(model.elements(), [](const PackElement& element) {
      return std::ranges::any_of(element.faces, [](const auto& face) { return face && face->is_tinted; });
    });
  }

  /// Adds an outcome per colour of a tint that the state selects.
  void add_by_state(const minecraft::StateTint& tint, const minecraft::StateField& field, const StateModel& state,
                    const std::vector<ShapeCondition>& when, const std::shared_ptr<const BlockModel>& model) {
    const std::uint32_t mask = mask_of(field);
    constexpr std::uint32_t kValues = 16;
    for (std::uint32_t value = 0; value < kValues && value >> field.bits == 0; ++value) {
      std::vector<ShapeCondition> narrower;
      for (ShapeCondition condition : when) {
        const std::uint32_t bits = value << field.first_bit;
        if (((condition.state ^ bits) & condition.state_mask & mask) != 0) continue;
        condition.state_mask |= mask;
        condition.state |= bits;
        narrower.push_back(condition);
      }
      const Rgba8 colour = tint.colour(tint.group(static_cast<int>(value)));
      if (!narrower.empty()) add_outcome(state, colour, std::move(narrower), model);
    }
  }

  void add_outcome(const StateModel& state, Rgba8 tint, std::vector<ShapeCondition> when,
                   std::shared_ptr<const BlockModel> model) {
    const auto same = std::ranges::find_if(
        outcomes_, [&](const Outcome& each) { return is_same_model(each.state, state) && each.tint == tint; });
    if (same == outcomes_.end()) {
      outcomes_.push_back({state, tint, std::move(when), std::move(model)});
    } else if (is_always(when) || is_always(same->when)) {
      same->when.assign(1, {});
    } else {
      same->when.insert(same->when.end(), when.begin(), when.end());
    }
  }

  const PackTexture* texture_named(const ResourceName& name) {
    const auto found = looks_.textures_.texture(name);
    if (found && *found != nullptr) return *found;
    // The own pack need not have every texture, but a damaged one is always a file of another pack.
    if ((!is_own_ || !found) && looks_.missing_.insert(to_string(name)).second) {
      ++looks_.report_.missing_textures;
      looks_.note(to_string(name), found ? "no such texture" : to_string(found.error()));
    }
    return nullptr;
  }

  const PackTexture* texture_of_face(const BlockModel& model, const PackFace& face) {
    const auto name = model.texture(face.texture);
    return name ? texture_named(*name) : nullptr;
  }

  [[nodiscard]] std::vector<ShapeElement> elements(const Outcome& outcome) {
    const auto texture = [&](const BlockModel& model, const PackFace& face) { return texture_of_face(model, face); };
    const FaceColours colours{texture, {type_.colour.r, type_.colour.g, type_.colour.b}, outcome.tint};
    const AxisOrientation turn = orientation_of(outcome.state);
    const std::vector<PackElement> lit = lit_elements(*outcome.model);
    const std::span<const PackElement> own = lit.empty() ? outcome.model->elements() : std::span(lit);
    if (!outcome.state.keeps_uv || turn == AxisOrientation()) {
      return elements_of(*outcome.model, own, colours, has_textures_, looks_.textures_);
    }
    std::vector<PackElement> turned;
    for (const PackElement& each : own) turned.push_back(turned_with_world(each, turn));
    return elements_of(*outcome.model, turned, colours, has_textures_, looks_.textures_);
  }

  /// Returns a model's elements with shares of emission; none if all faces have all of it. Packs that light up elements
  /// decide; else the rules for the block's name do.
  [[nodiscard]] std::vector<PackElement> lit_elements(const BlockModel& model) const {
    const float base = light_.emission;
    if (!(emission() > 0.0F)) return {};
    if (has_element_light_) return with_light_emission(model.elements(), base > 0.0F ? base : greatest_light());
    const EmittingFaces* const rule = EmissionRules::instance().find(name_);
    return rule == nullptr ? std::vector<PackElement>() : with_emission(model, *rule);
  }

  [[nodiscard]] float greatest_light() const { return static_cast<float>(greatest_light_) / 15.0F; }

  /// Returns the emission of the type with its look. Types without light have the greatest light of their elements;
  /// those of the game only look lit.
  [[nodiscard]] float emission() const {
    constexpr float kUnlit = 0.9F / 30.0F;  // from 1 / 30, propagated light has level 1
    if (light_.emission > 0.0F) return light_.emission;
    return light_.is_of_game ? std::min(greatest_light(), kUnlit) : greatest_light();
  }

  /// Returns the orientation that remains after `elements`.
  static AxisOrientation remaining_turn(const Outcome& outcome) {
    return outcome.state.keeps_uv ? AxisOrientation() : orientation_of(outcome.state);
  }

  [[nodiscard]] static bool follows_positions(const Outcome& outcome) {
    return std::ranges::any_of(outcome.when,
                               [](const ShapeCondition& each) { return !(each.positions == PositionShare{}); });
  }

  /// Returns true if all outcomes are one model, turned by the state.
  [[nodiscard]] bool is_one_model() const {
    const Outcome& first = outcomes_.front();
    return std::ranges::all_of(outcomes_, [&](const Outcome& each) {
      if (follows_positions(each)) return false;
      const bool is_locked = each.state.keeps_uv && orientation_of(each.state) != AxisOrientation();
      return each.model == first.model && each.tint == first.tint && (!is_locked || outcomes_.size() == 1);
    });
  }

  /// Returns the orientations of outcomes that are one model; nullopt if the bits that select them lie too far apart.
  [[nodiscard]] std::optional<StateOrientations> orientations() const {
    if (!node_.turn.empty()) return node_orientations(node_.turn);
    StateOrientations made;
    if (outcomes_.size() == 1) {
      const AxisOrientation turn = remaining_turn(outcomes_.front());
      if (turn != AxisOrientation()) made.by_value.push_back(turn);
      return made;
    }
    std::uint32_t mask = 0;
    for (const Outcome& outcome : outcomes_) {
      for (const ShapeCondition& condition : outcome.when) {
        const bool follows_others =
            !condition.connected.empty() || !condition.unconnected.empty() || condition.corner.has_value();
        if (condition.state_mask == 0 || follows_others) return std::nullopt;
        mask |= condition.state_mask;
      }
    }
    constexpr int kMaxBits = 6;
    const int first = std::countr_zero(mask);
    if (static_cast<int>(std::bit_width(mask)) - first > kMaxBits) return std::nullopt;
    made.first_bit = static_cast<std::uint8_t>(first);
    for (std::uint32_t value = 0; value <= mask >> first; ++value) {
      const std::uint32_t state = value << first;
      const auto shown = std::ranges::find_if(outcomes_, [&](const Outcome& outcome) {
        return std::ranges::any_of(outcome.when, [&](const ShapeCondition& each) { return holds(each, state); });
      });
      made.by_value.push_back(shown == outcomes_.end() ? AxisOrientation() : remaining_turn(*shown));
    }
    while (!made.by_value.empty() && made.by_value.back() == AxisOrientation()) made.by_value.pop_back();
    // A single orientation would turn all states.
    if (made.by_value.size() == 1) made.by_value.emplace_back();
    if (made.by_value.size() > AxisOrientation::kCount) return std::nullopt;
    return made;
  }

  /// Returns the type as a whole cube that the state turns; nullopt for other models.
  std::optional<VoxelProperties> make_cube() {
    if (!has_textures_ || !is_one_model()) return std::nullopt;
    const auto faces = faces_of_cube(elements(outcomes_.front()));
    if (!faces) return std::nullopt;
    const auto turns = orientations();
    if (!turns) return std::nullopt;
    VoxelProperties made = type_;
    made.faces = VoxelFaces(*faces);
    made.orientations = *turns;
    settle(made);
    return made;
  }

  /// Adds the parts of an outcome: several if it has more elements than a shape.
  static Status add_parts(const Outcome& outcome, const std::vector<ShapeElement>& all,
                          const AxisOrientation& orientation, ShapeRules& rules) {
    for (std::size_t first = 0; first < all.size(); first += kMaxShapeElements) {
      const std::size_t end = std::min(all.size(), first + kMaxShapeElements);
      auto shape = VoxelShape::from_elements(
          {all.begin() + static_cast<std::ptrdiff_t>(first), all.begin() + static_cast<std::ptrdiff_t>(end)});
      if (!shape) return shape.error();
      ShapePart part{.shape = std::move(*shape), .orientation = orientation};
      if (!is_always(outcome.when)) part.when = outcome.when;
      rules.parts.push_back(std::move(part));
    }
    return {};
  }

  Result<VoxelProperties> make_shapes() {
    VoxelProperties made = type_;
    ShapeRules rules;
    if (states_.connects()) {
      rules.neighbours = ShapeNeighbours::Connected;
      rules.groups = node_.groups != 0 ? node_.groups : joined_group(name_);
      rules.connects_to_full_sides = node_.groups != 0 ? node_.joins_full_sides : name_ != "redstone_wire";
    }
    std::vector<std::vector<ShapeElement>> all;
    if (states_.has_corners() && follows_corners()) {
      if (auto done = add_stairs(made, rules, all); !done) return done.error();
      return with_shapes(std::move(made), std::move(rules), all);
    }
    if (outcomes_.empty()) return make_error(ErrorCode::BadFormat, "no model for straight stairs");
    const auto turns = !is_multipart_ && is_one_model() ? orientations() : std::nullopt;
    if (turns) {
      made.orientations = *turns;
      all.push_back(elements(outcomes_.front()));
      Outcome merged = outcomes_.front();
      for (const Outcome& outcome : outcomes_) {
        if (&outcome != &outcomes_.front()) {
          merged.when.insert(merged.when.end(), outcome.when.begin(), outcome.when.end());
        }
      }
      if (auto done = add_parts(merged, all.back(), {}, rules); !done) return done.error();
    } else {
      if (!node_.turn.empty()) made.orientations = node_orientations(node_.turn);
      for (const Outcome& outcome : outcomes_) {
        all.push_back(elements(outcome));
        if (auto done = add_parts(outcome, all.back(), remaining_turn(outcome), rules); !done) return done.error();
      }
    }
    return with_shapes(std::move(made), std::move(rules), all);
  }

  /// Returns true if conditions depend on corners, and each on the facing and half that corners need. Else leaves the
  /// conditions of straight stairs.
  bool follows_corners() {
    const std::uint32_t both = mask_of(*states_.field("facing")) | mask_of(*states_.field("half"));
    bool has_corners = false;
    bool is_complete = !is_multipart_;
    for (const Outcome& outcome : outcomes_) {
      for (const ShapeCondition& condition : outcome.when) {
        has_corners = has_corners || condition.corner;
        is_complete = is_complete && (condition.state_mask & both) == both;
      }
    }
    if (has_corners && is_complete) return true;
    for (Outcome& outcome : outcomes_) {
      std::erase_if(outcome.when,
                    [](const ShapeCondition& each) { return each.corner && *each.corner != StairCorner::Straight; });
      for (ShapeCondition& condition : outcome.when) condition.corner.reset();
    }
    std::erase_if(outcomes_, [](const Outcome& each) { return each.when.empty(); });
    return false;
  }

  /// Adds the parts of stairs whose corners follow their neighbours. These are found in the space of unturned stairs,
  /// so the type has orientations, and parts are turned back by the orientations of their states.
  Status add_stairs(VoxelProperties& made, ShapeRules& rules, std::vector<std::vector<ShapeElement>>& all) {
    rules.neighbours = ShapeNeighbours::Stairs;
    const minecraft::StateField& facing = *states_.field("facing");
    const minecraft::StateField& half = *states_.field("half");
    const std::uint32_t both = mask_of(facing) | mask_of(half);
    const auto is_top = [&](std::uint32_t state) {
      return minecraft::value_of_code(half, (state & mask_of(half)) >> half.first_bit) == "top";
    };
    made.orientations.first_bit = static_cast<std::uint8_t>(facing.first_bit);
    for (std::uint32_t value = 0; value <= both >> facing.first_bit; ++value) {
      const std::uint32_t state = value << facing.first_bit;
      const std::string name = minecraft::value_of_code(facing, value & (mask_of(facing) >> facing.first_bit));
      // East is the unturned one. Counter-clockwise, seen from above:
      constexpr std::array<std::string_view, 4> kFacings = {"east", "north", "west", "south"};
      const auto quarter = std::ranges::find(kFacings, name) - kFacings.begin();
      made.orientations.by_value.push_back(AxisOrientation::quarter_turns(1, static_cast<int>(quarter)) *
                                           AxisOrientation::quarter_turns(0, is_top(state) ? 2 : 0));
    }
    for (const Outcome& outcome : outcomes_) {
      all.push_back(elements(outcome));
      std::map<int, Outcome> by_turn;
      for (ShapeCondition condition : outcome.when) {
        // The half turn of upper stairs exchanges the sides.
        if (is_top(condition.state) && condition.corner) condition.corner = mirrored(*condition.corner);
        Outcome& part = by_turn[made.orientations.of(condition.state).index()];
        part.when.push_back(condition);
      }
      for (const auto& [turn, part] : by_turn) {
        const AxisOrientation back = AxisOrientation::at(turn).inverse();
        if (auto done = add_parts(part, all.back(), back * remaining_turn(outcome), rules); !done) return done;
      }
    }
    return {};
  }

  static StairCorner mirrored(StairCorner corner) {
    switch (corner) {
      case StairCorner::OuterLeft:
        return StairCorner::OuterRight;
      case StairCorner::OuterRight:
        return StairCorner::OuterLeft;
      case StairCorner::InnerLeft:
        return StairCorner::InnerRight;
      case StairCorner::InnerRight:
        return StairCorner::InnerLeft;
      default:
        return corner;
    }
  }

  Result<VoxelProperties> with_shapes(VoxelProperties made, ShapeRules rules,
                                      const std::vector<std::vector<ShapeElement>>& all) const {
    rules.fluid = contained_water();
    auto shapes = VoxelShapes::from_rules(std::move(rules));
    if (!shapes) return shapes.error();
    made.shapes = std::move(*shapes);
    made.faces = common_faces(all);
    settle(made);
    return made;
  }

  /// Returns the water around blocks that grow in water, and around waterlogged ones; nullopt for other blocks.
  [[nodiscard]] std::optional<ContainedFluid> contained_water() const {
    constexpr std::array<std::string_view, 4> kWaterPlants = {"seagrass", "tall_seagrass", "kelp", "kelp_plant"};
    if (std::ranges::find(kWaterPlants, name_) != kWaterPlants.end() || states_.is_named("waterlogged", "true")) {
      return ContainedFluid{.groups = kWaterGroup};
    }
    const minecraft::StateField* const field = states_.field("waterlogged");
    if (field == nullptr || field->kind != 'b') return std::nullopt;
    return ContainedFluid{.groups = kWaterGroup, .when = {{.state_mask = mask_of(*field), .state = mask_of(*field)}}};
  }

  /// Returns a texture per direction, for uses that show a whole voxel: that of the largest face. No faces if there are
  /// no textures.
  static VoxelFaces common_faces(const std::vector<std::vector<ShapeElement>>& all) {
    std::array<VoxelFace, 6> faces;
    std::array<float, 6> areas{};
    const VoxelFace* any = nullptr;
    for (const auto& elements : all) {
      for (const ShapeElement& element : elements) {
        const Vec3 size = element.max - element.min;
        for (const Direction direction : kDirections) {
          const auto i = static_cast<std::size_t>(direction);
          const ElementFace& face = element.faces[i];
          if (!face.is_drawn || !face.face || face.face->texture.is_null()) continue;
          if (any == nullptr) any = &*face.face;
          const float area = size[frame_of(direction).u] * size[frame_of(direction).v];
          if (area <= areas[i]) continue;
          areas[i] = area;
          faces[i] = *face.face;
        }
      }
    }
    if (any == nullptr) return {};
    for (VoxelFace& face : faces) {
      if (face.texture.is_null()) face = *any;
    }
    return VoxelFaces(faces);
  }

  /// Sets the properties that depend on the look.
  void settle(VoxelProperties& made) const {
    bool is_opaque = true;
    for_each_look(made, [&](const VoxelFace& look) { is_opaque = is_opaque && look.alpha == FaceAlpha::Opaque; });
    if (!has_textures_ && made.faces.empty()) is_opaque = !has_any(name_, {"glass", "ice", "slime", "honey"});
    made.visibility = is_opaque ? Visibility::Opaque : Visibility::Transparent;
    if (is_opaque) made.colour.a = 255;
    made.occludes = std::nullopt;
    made.emission = emission();
    // Shapes stop light by their sides.
    if (is_opaque && !made.shapes.empty()) made.blocks_light = std::nullopt;
    made.attributes.erase(minecraft::kGuessAttribute);
    if (!node_.is_fallback) made.attributes.erase(models::kNodeGuessAttribute);
  }

  BlockLooks& looks_;
  PackLibrary& library_;
  const VoxelProperties& type_;
  TypeStates states_;
  BlockFamilies::Traits node_;
  std::string_view name_;
  bool is_own_ = false;
  bool is_quiet_ = false;  // nothing is noted
  bool is_multipart_ = false;
  bool has_textures_ = false;
  std::vector<Outcome> outcomes_;
  BlockLight light_;
  int greatest_light_ = 0;          // PackElement::light_emission of models that the type's states show
  bool has_element_light_ = false;  // of any model
};

namespace {

/// Returns the packs that are not null, the lowest first, as one.
std::shared_ptr<const PackFiles> stacked(std::vector<std::shared_ptr<const PackFiles>> packs) {
  std::erase(packs, nullptr);
  return packs.size() == 1 ? packs.front() : std::make_shared<PackStack>(std::move(packs));
}

/// Returns true for Minecraft blocks and Luanti nodes.
bool has_look(const VoxelProperties& type) {
  return type.attributes.contains(minecraft::kStatesAttribute) ||
         type.attributes.contains(models::kNodeStatesAttribute);
}

/// Returns the fields of a node's param2 that families name. They overlap: the family of a node uses one of them.
std::vector<minecraft::StateField> param2_fields() {
  return {{"wallmounted", 'n', 0, 3}, {"style", 'n', 0, 3}, {"facedir", 'n', 0, 5}};
}

}  // namespace

std::vector<BlockLooks::Source> BlockLooks::sources_of_node(const VoxelProperties& type) {
  std::vector<Source> sources;
  const ResourceName name = split_resource_name(type.name);
  const BlockFamilies::Traits traits = NodePack::families().traits(name);
  const TypeStates states(type.name, param2_fields(), traits.groups != 0);
  const std::string tile = name.space + "_" + name.path;
  const auto has_tile = [&](const char* end) { return packs_->has(tile_path(tile + end)); };
  sources.push_back({&library_, states, traits, true});
  // A node that only the rule for all names knows, and whose texture no folder has, may have the name of a block.
  const bool is_block = traits.is_fallback && own_library_ && !name.path.empty() &&
                        OwnPack::instance()->families().is_known({"minecraft", name.path}) &&
                        !(packs_->has_tiles() && (has_tile("") || has_tile("_top") || has_tile("_side")));
  if (is_block) {
    BlockFamilies::Traits guessed;
    guessed.is_fallback = true;
    sources.push_back({&*own_library_, TypeStates("minecraft:" + name.path, {}, false), guessed, false});
  }
  if (node_library_) sources.push_back({&*node_library_, states, traits, packs_->has_tiles()});
  return sources;
}

std::vector<BlockLooks::Source> BlockLooks::sources_of(const VoxelProperties& type) {
  if (!type.attributes.contains(minecraft::kStatesAttribute)) return sources_of_node(type);
  std::vector<Source> sources;
  sources.push_back({&library_, TypeStates(type), {}, true});
  if (own_library_) sources.push_back({&*own_library_, TypeStates(type), {}, false});
  return sources;
}

BlockLooks::BlockLooks(std::shared_ptr<const PackFiles> packs, std::shared_ptr<const PackFiles> own)
    : packs_(std::move(packs)),
      own_(std::move(own)),
      nodes_(own_ != nullptr || packs_->has_tiles() ? std::make_shared<NodePack>(own_ != nullptr) : nullptr),
      all_(stacked({own_, packs_})),
      textured_(stacked({own_, nodes_, packs_})),
      library_(*packs_, *all_),
      textures_(*textured_) {
  if (own_ != nullptr) own_library_.emplace(*own_, *own_);
  if (nodes_ != nullptr) node_library_.emplace(*nodes_, *nodes_);
}

void BlockLooks::note(std::string name, const std::string& reason) {
  if (report_.names.size() < kMaxNames)
    report_.names.push_back(printable(name.append(" (").append(reason).append(")")));
}

void BlockLooks::prepare(const VoxelRegistry& types, std::size_t first, Threads threads) {
  std::vector<ResourceName> names;
  {
    const std::scoped_lock lock(mutex_);
    std::set<std::string> listed;
    for (std::size_t i = first; i < types.size(); ++i) {
      const VoxelProperties& type = types[static_cast<VoxelType>(i)];
      if (!has_look(type)) continue;
      std::vector<ResourceName> of_type;
      for (Source& source : sources_of(type)) {
        const bool keeps_look = !source.is_named && (!type.faces.empty() || !type.shapes.empty());
        if (keeps_look || Maker(*this, std::move(source), type).list_textures(of_type)) break;
      }
      for (ResourceName& name : of_type) {
        if (!textures_.knows(name) && listed.insert(to_string(name)).second) names.push_back(std::move(name));
      }
    }
  }
  // Without the lock: a thread that waits for the others may meanwhile be asked for looks.
  std::vector<std::optional<TextureReader::Known>> read(names.size());
  parallel_for(names.size(), threads, [&](std::size_t i) { read[i].emplace(textures_.read(names[i])); });
  const std::scoped_lock lock(mutex_);
  for (std::size_t i = 0; i < names.size(); ++i) textures_.put(names[i], std::move(*read[i]));
}

std::optional<std::uint32_t> BlockLooks::colour_in(ColourMap& map, const char* name,
                                                   const minecraft::Climate& climate) {
  constexpr int kSize = 256;
  if (!map.is_read) {
    map.is_read = true;
    const std::string path = std::string("assets/minecraft/textures/colormap/") + name + ".png";
    const auto png = packs_->read(path, kMaxImageBytes);
    auto image = png && *png ? read_alpha_image(**png) : Result<AlphaImage>(AlphaImage{});
    const bool is_map = image && image->width == kSize && image->height == kSize;
    if (is_map) {
      map.image = std::move(*image);
    } else if (!png || *png) {
      const Error* const error = !png ? &png.error() : !image ? &image.error() : nullptr;
      ++report_.missing_textures;
      note(path, error != nullptr ? to_string(*error) : "a colour map has 256 x 256 pixels");
    }
  }
  if (!map.image) return std::nullopt;
  const auto pixel = [](float share) { return static_cast<std::size_t>((1.0F - share) * 255.0F); };
  const std::size_t column = pixel(climate.temperature);
  const std::size_t row = pixel(climate.downfall * climate.temperature);
  const std::uint8_t* const rgba = &map.image->rgba[4 * (row * kSize + column)];
  return std::uint32_t{rgba[0]} << 16 | std::uint32_t{rgba[1]} << 8 | rgba[2];
}

/// Returns the colour that the packs' colour maps have in place of one of the game's own.
std::uint32_t BlockLooks::tint_by_maps(minecraft::Tint tint, std::uint32_t rgb) {
  const bool is_grass = tint == minecraft::Tint::Grass;
  if (!is_grass && tint != minecraft::Tint::Foliage) return rgb;
  const auto climate = is_grass ? minecraft::climate_of_grass(rgb) : minecraft::climate_of_foliage(rgb);
  if (!climate) return rgb;
  const auto found = colour_in(is_grass ? grass_ : foliage_, is_grass ? "grass" : "foliage", *climate);
  if (!found) return rgb;
  return climate->is_dark && is_grass ? ((*found & 0xFEFEFE) + 0x28340A) >> 1 : *found;
}

VoxelProperties BlockLooks::applied(const VoxelProperties& type) {
  if (!has_look(type)) return type;
  const std::scoped_lock lock(mutex_);
  ++report_.types;
  std::string reason = "not in the packs";
  bool is_damaged = false;  // the look of a named pack
  for (Source& source : sources_of(type)) {
    // A world that was converted with a pack keeps its looks.
    if (!source.is_named && (!type.faces.empty() || !type.shapes.empty())) return type;
    const std::size_t refused = textures_.refused_blends();
    auto made = Maker(*this, std::move(source), type).make();
    if (!made) {
      reason = to_string(made.error());
      is_damaged = true;
    } else if (textures_.refused_blends() > refused) {
      reason = "the blended textures of faces on equal faces have more than 2^26 texels";
      is_damaged = true;
    } else if (*made) {
      if (Status valid = validate_type(**made); !valid) {
        reason = valid.error().message;
        is_damaged = true;
        continue;
      }
      if (is_damaged) {
        ++report_.replaced_looks;
        note(type.name, reason);
      }
      return std::move(**made);
    }
  }
  ++report_.without_look;
  note(type.name, reason);
  return type;
}

BlockPackReport BlockLooks::report() const {
  const std::scoped_lock lock(mutex_);
  return report_;
}

}  // namespace quoin::packs
