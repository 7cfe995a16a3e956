#pragma once

// A town of Minecraft blocks with every family of the own pack: houses, a pond, a field, and a market of all families.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <quoin/grid/grid.h>
#include <quoin/scene/scene.h>

#include "io/minecraft/block_types.h"
#include "io/packs/block_models.h"
#include "io/packs/block_states.h"
#include "io/packs/families.h"
#include "io/packs/pack_own.h"

namespace quoin::block_town {

using Properties = std::vector<minecraft::Property>;

/// The names of all families in the tables of the own pack.
inline std::set<std::string> all_families() {
  std::ifstream in(std::filesystem::path(QUOIN_SOURCE_DIR) / "src/io/packs/data/families.json");
  std::set<std::string> names;
  for (const auto& group : nlohmann::json::parse(in)["families"]) {
    for (const auto& [name, family] : group.items()) names.insert(name);
  }
  return names;
}

/// Returns a block of each family that has blocks, by family: the first name of its first rule, with a material for the
/// stars of a pattern.
inline std::map<std::string, std::string> blocks_of_families() {
  const packs::BlockFamilies& families = packs::OwnPack::instance()->families();
  std::ifstream in(std::filesystem::path(QUOIN_SOURCE_DIR) / "src/io/packs/data/rules.json");
  std::map<std::string, std::string> found;
  for (const auto& rule : nlohmann::json::parse(in)) {
    std::string patterns;  // a long text is a list of texts
    for (const auto& part : rule[0].is_array() ? rule[0] : nlohmann::json::array({rule[0]})) {
      patterns += part.get<std::string>() + " ";
    }
    for (const std::string& pattern : packs::words(patterns)) {
      for (const char* const material : {"oak", "white", "stone", "iron", "tube", "copper", "zombie", "crimson"}) {
        const std::string name = packs::replaced(pattern, "*", material);
        const std::string family = families.family({"minecraft", name});
        if (name != material) found.try_emplace(family, name);
      }
    }
  }
  return found;
}

/// The blocks of a town by position.
class Town {
 public:
  explicit Town(unsigned seed) : random_(seed) {
    lay_ground();
    for (int i = 0; i < 4; ++i) build_house({4 + 13 * i, 1, 4});
    lay_pond({58, 1, 5});
    lay_field({60, 0, 16});
    fill_market({3, 1, 24});
  }

  [[nodiscard]] Scene scene() const {
    Scene scene;
    scene.types = types_.types();
    SceneGrid town;
    for (const auto& [at, block] : blocks_) town.grid.set({at[0], at[1], at[2]}, block.first, {block.second, {}});
    scene.add_instance(Instance{.grid = scene.add_grid(std::move(town))});
    return scene;
  }

  [[nodiscard]] const std::set<std::string>& families() const { return families_; }

 private:
  void put(IVec3 at, const std::string& name, const Properties& properties = {}) {
    const auto block = types_.block("minecraft:" + name, properties);
    ASSERT_TRUE(block) << name;
    families_.insert(packs::OwnPack::instance()->families().family({"minecraft", name}));
    VoxelType type = block->type;
    if (block->tint != minecraft::Tint::None) type = types_.tinted(*block, {}).value_or(kAir);
    blocks_[{at.x, at.y, at.z}] = {type, block->state};
  }

  void fill(IVec3 from, IVec3 to, const std::string& name, const Properties& properties = {}) {
    for (int z = from.z; z < to.z; ++z) {
      for (int y = from.y; y < to.y; ++y) {
        for (int x = from.x; x < to.x; ++x) put({x, y, z}, name, properties);
      }
    }
  }

  void lay_ground() {
    fill({0, -1, 0}, {72, 0, 66}, "dirt");
    fill({0, 0, 0}, {72, 1, 66}, "grass_block", {{"snowy", "false"}});
    fill({0, 0, 14}, {72, 1, 16}, "dirt_path");
    fill({1, 0, 22}, {71, 1, 64}, "stone_bricks");
    const std::vector<std::string> plants = {"poppy", "dandelion", "short_grass", "fern", "azure_bluet", "oak_sapling"};
    for (int i = 0; i < 90; ++i) {
      const IVec3 at{number(72), 1, number(14)};
      if (!blocks_.contains({at.x, at.y, at.z})) put(at, plants[static_cast<std::size_t>(number(6))]);
    }
    for (int x = 2; x < 72; x += 8) {
      put({x, 1, 13}, "oak_fence", sides("false"));
      put({x, 2, 13}, "torch");
    }
  }

  static Properties sides(const std::string& value) {
    return {{"north", value}, {"east", value}, {"south", value}, {"west", value}, {"waterlogged", "false"}};
  }

  void build_house(IVec3 at) {
    const auto from = [&](int x, int y, int z) { return at + IVec3(x, y, z); };
    fill(from(0, 0, 0), from(9, 5, 8), "oak_planks");
    fill(from(1, 0, 1), from(8, 5, 7), "air");
    for (const int x : {0, 8}) {
      for (const int z : {0, 7}) fill(from(x, 0, z), from(x + 1, 5, z + 1), "oak_log", {{"axis", "y"}});
    }
    for (const int y : {0, 1}) {
      put(from(4, y, 7), "oak_door",
          {{"facing", "north"}, {"half", y == 0 ? "lower" : "upper"}, {"hinge", "left"}, {"open", "false"}});
    }
    for (const int x : {2, 6}) {
      put(from(x, 2, 7), "glass_pane",
          {{"north", "false"}, {"east", "true"}, {"south", "false"}, {"west", "true"}, {"waterlogged", "false"}});
    }
    put(from(3, 2, 8), "wall_torch", {{"facing", "south"}});
    put(from(2, 0, 2), "lantern", {{"hanging", "false"}});
    for (int step = 0; step < 5; ++step) {
      for (int z = -1; z < 9; ++z) {
        const auto stairs = [&](const char* facing) {
          return Properties{{"facing", facing}, {"half", "bottom"}, {"shape", "straight"}, {"waterlogged", "false"}};
        };
        if (step == 4) {
          put(from(4, 4 + step, z), "spruce_slab", {{"type", "bottom"}, {"waterlogged", "false"}});
          continue;
        }
        put(from(step, 5 + step, z), "spruce_stairs", stairs("east"));
        put(from(8 - step, 5 + step, z), "spruce_stairs", stairs("west"));
        if (z == 0 || z == 7) fill(from(step + 1, 5 + step, z), from(8 - step, 6 + step, z + 1), "oak_planks");
      }
    }
  }

  void lay_pond(IVec3 at) {
    fill(at + IVec3(0, -1, 0), at + IVec3(9, 0, 7), "water", {{"level", "0"}});
    put(at + IVec3(3, 0, 3), "lily_pad");
    put(at + IVec3(6, -1, 2), "seagrass");
    put(at + IVec3(4, -1, 5), "tube_coral_fan", {{"waterlogged", "true"}});
  }

  void lay_field(IVec3 at) {
    for (int x = 0; x < 9; ++x) {
      for (int z = 0; z < 5; ++z) {
        put(at + IVec3(x, 0, z), "farmland", {{"moisture", "7"}});
        const std::vector<std::string> crops = {"wheat", "carrots", "beetroots"};
        const int age = number(4);
        put(at + IVec3(x, 1, z), crops[static_cast<std::size_t>(x % 3)], {{"age", std::to_string(age)}});
      }
    }
  }

  /// Puts three random states of a block of each family in a row, and a torch next to every third family.
  void fill_market(IVec3 at) {
    int place = 0;
    for (const auto& [family, name] : blocks_of_families()) {
      const IVec3 corner = at + IVec3(place % 8 * 8, 0, place / 8 * 2);
      for (int i = 0; i < 3; ++i) put(corner + IVec3(2 * i, 0, 0), name, random_state(name));
      if (place % 3 == 0) put(corner + IVec3(6, 0, 1), "torch");
      ++place;
    }
  }

  /// Returns values of all properties that the block states of a block name.
  Properties random_state(const std::string& name) {
    const auto json =
        packs::read_pack_json(*packs::OwnPack::instance(), "assets/minecraft/blockstates/" + name + ".json");
    EXPECT_TRUE(json && *json) << name;
    const auto states = packs::parse_block_states(**json);
    EXPECT_TRUE(states) << name;
    std::map<std::string, std::set<std::string>> values;
    for (const packs::StateCase& each : states->cases) {
      for (const auto& terms : each.when) {
        for (const packs::StateTerm& term : terms) {
          values[term.property].insert(term.values.begin(), term.values.end());
        }
      }
    }
    Properties chosen;
    for (const auto& [property, all] : values) {
      std::set<std::string> choices = all;
      if (choices == std::set<std::string>{"true"}) choices.insert("false");
      auto at = choices.begin();
      std::advance(at, number(static_cast<int>(choices.size())));
      chosen.emplace_back(property, *at);
    }
    return chosen;
  }

  int number(int limit) { return static_cast<int>(random_() % static_cast<unsigned>(limit)); }

  std::mt19937 random_;
  minecraft::BlockTypes types_;
  std::set<std::string> families_;
  std::map<std::array<int, 3>, std::pair<VoxelType, std::uint32_t>> blocks_;
};

}  // namespace quoin::block_town
