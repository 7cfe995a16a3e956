// Compares the own pack with npm's minecraft-data (MIT): collision boxes and states of all blocks of one version.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <quoin/grid/voxel_shape.h>

#include "io/minecraft/block_types.h"
#include "io/packs/block_models.h"
#include "io/packs/block_states.h"
#include "io/packs/pack_looks.h"
#include "io/packs/pack_own.h"
#include "tests/minecraft_data_for_tests.h"

namespace quoin::packs {
namespace {

namespace fs = std::filesystem;
using minecraft_data::data_folder;
using minecraft_data::Json;
using minecraft_data::kInstall;
using minecraft_data::kVersions;
using minecraft_data::parsed;
using minecraft_data::state_count;
using minecraft_data::Values;
using minecraft_data::values_of;

bool holds(const StateCase& each, const Values& values) {
  return std::ranges::any_of(each.when, [&](const std::vector<StateTerm>& terms) {
    return std::ranges::all_of(terms, [&](const StateTerm& term) {
      const auto found = values.find(term.property);
      const bool is_one = found != values.end() && std::ranges::find(term.values, found->second) != term.values.end();
      return is_one != term.is_negated;
    });
  });
}

/// Reads blocks of the own pack as any pack.
class Reader {
 public:
  /// Returns the models of a state; adds to `problems` if a file is missing or invalid.
  std::vector<StateModel> models(const std::string& block, const Values& values, std::set<std::string>& problems) {
    auto& states = states_[block];
    if (!states) {
      const auto json = read_pack_json(pack_, "assets/minecraft/blockstates/" + block + ".json");
      if (!json || !*json) {
        problems.insert(block + ": no block states");
        return {};
      }
      auto parsed = parse_block_states(**json);
      if (!parsed) {
        problems.insert(block + ": " + parsed.error().message);
        return {};
      }
      states = std::move(*parsed);
    }
    std::vector<StateModel> found;
    for (const StateCase& each : states->cases) {
      if (!holds(each, values)) continue;
      found.push_back(each.heaviest());
      if (!states->is_multipart) break;
    }
    return found;
  }

  /// Returns the elements of a model.
  std::vector<PackElement> elements(const std::string& name, std::set<std::string>& problems) {
    const auto model = reader_.model(name);
    if (!model || *model == nullptr) {
      problems.insert("model " + name + ": " + (model ? "absent" : model.error().message));
      return {};
    }
    for (const PackElement& element : (*model)->elements()) {
      for (const auto& face : element.faces) {
        if (!face) continue;
        const auto texture = (*model)->texture(face->texture);
        if (!texture) {
          problems.insert("model " + name + ": no texture " + face->texture);
        } else if (textures_.insert(to_string(*texture)).second) {
          const auto png =
              pack_.read("assets/" + texture->space + "/textures/" + texture->path + ".png", kMaxImageBytes);
          if (!png || !*png) {
            problems.insert("no texture " + to_string(*texture));
          } else {
            texture_bytes_ += (*png)->size();
          }
        }
      }
    }
    return {(*model)->elements().begin(), (*model)->elements().end()};
  }

  [[nodiscard]] std::size_t texture_count() const { return textures_.size(); }
  [[nodiscard]] std::size_t texture_bytes() const { return texture_bytes_; }

 private:
  const OwnPack& pack_ = *OwnPack::instance();
  ModelReader reader_{pack_};
  std::map<std::string, std::optional<BlockStates>> states_;
  std::set<std::string> textures_;
  std::size_t texture_bytes_ = 0;
};

/// Returns the shape of models of one state; nullopt if they have no elements.
std::optional<VoxelShapes> shape_of(Reader& reader, const std::vector<StateModel>& models,
                                    std::set<std::string>& problems) {
  ShapeRules rules;
  for (const StateModel& each : models) {
    std::vector<ShapeElement> elements;
    for (const PackElement& element : reader.elements(each.model, problems)) {
      elements.push_back({.min = element.from, .max = element.to, .turn = element.turn});
    }
    if (elements.empty()) continue;
    auto shape = VoxelShape::from_elements(std::move(elements));
    if (!shape) {
      problems.insert("model " + each.model + ": " + shape.error().message);
      continue;
    }
    rules.parts.push_back(
        {.shape = *shape,
         .orientation = AxisOrientation::quarter_turns(1, -each.y) * AxisOrientation::quarter_turns(0, -each.x)});
  }
  if (rules.parts.empty()) return std::nullopt;
  auto shapes = VoxelShapes::from_rules(std::move(rules));
  if (!shapes) {
    problems.insert(shapes.error().message);
    return std::nullopt;
  }
  return *shapes;
}

/// Returns true if the block's collision boxes in its default state are one cube.
bool is_cube(const Json& shapes, const Json& block) {
  const Json& numbers = shapes["blocks"][block["name"].get<std::string>()];
  const int state = block["defaultState"].get<int>() - block["minStateId"].get<int>();
  const int number = numbers.is_array() ? numbers[static_cast<std::size_t>(state)].get<int>() : numbers.get<int>();
  return shapes["shapes"][std::to_string(number)] == Json::parse("[[0.0,0.0,0.0,1.0,1.0,1.0]]");
}

// Drawn as cubes, although their collision boxes are none.
const std::map<std::string, std::string> kCubes = {
    {"soul_sand", "the game draws a cube, and selects one; bodies sink in by two sixteenths"},
    {"mud", "as soul_sand"},
    {"powder_snow", "the game draws a cube, into which bodies sink"},
    {"end_gateway", "a cube of stars without collision"},
};
// Drawn as less than a cube, although they collide as one.
const std::map<std::string, std::string> kLess = {
    {"barrier", "invisible"},
    {"chorus_flower", "the game draws a smaller flower"},
};
// No elements.
const std::set<std::string> kInvisible = {"air", "cave_air", "void_air", "structure_void", "barrier", "light"};

TEST(OwnPackOracle, DrawsCubesExactlyWhereBlocksAreCubes) {
  if (!fs::exists(data_folder())) GTEST_SKIP() << kInstall;
  for (const std::string version : kVersions) {
    const Json blocks = parsed(data_folder(version) / "blocks.json");
    const Json shapes = parsed(data_folder(version) / "blockCollisionShapes.json");
    Reader reader;
    std::set<std::string> problems;
    std::set<std::string> failures;
    std::size_t cubes = 0;
    for (const Json& block : blocks) {
      const auto name = block["name"].get<std::string>();
      const int state = block["defaultState"].get<int>() - block["minStateId"].get<int>();
      const auto shape = shape_of(reader, reader.models(name, values_of(block, state), problems), problems);
      const bool is_drawn_as_cube = shape && shape->model(0, {}, {}).is_full;
      const bool is_a_cube = kCubes.contains(name) || (is_cube(shapes, block) && !kLess.contains(name));
      cubes += is_drawn_as_cube ? 1U : 0U;
      if (is_drawn_as_cube != is_a_cube) failures.insert(name + (is_a_cube ? " is a cube" : " is no cube"));
    }
    std::cout << version << ": " << blocks.size() << " blocks, " << cubes << " cubes, " << reader.texture_count()
              << " textures, " << failures.size() << " blocks fail, " << problems.size() << " problems\n";
    EXPECT_EQ(failures, std::set<std::string>());
    EXPECT_EQ(problems, std::set<std::string>());
  }
}

TEST(OwnPackOracle, AllStatesHaveElements) {
  if (!fs::exists(data_folder())) GTEST_SKIP() << kInstall;
  for (const std::string version : kVersions) {
    Reader reader;
    std::set<std::string> problems;
    std::set<std::string> without;
    std::size_t states = 0;
    for (const Json& block : parsed(data_folder(version) / "blocks.json")) {
      const auto name = block["name"].get<std::string>();
      const int count = state_count(block);
      for (int state = 0; state < count; ++state) {
        std::size_t elements = 0;
        for (const StateModel& each : reader.models(name, values_of(block, state), problems)) {
          elements += reader.elements(each.model, problems).size();
        }
        ++states;
        // The upper half of a young pitcher crop does not grow in the game.
        if (elements == 0 && !kInvisible.contains(name) && name != "pitcher_crop") without.insert(name);
      }
    }
    std::cout << version << ": " << states << " states, " << reader.texture_count() << " textures of "
              << reader.texture_bytes() << " bytes, " << without.size() << " blocks with empty states, "
              << problems.size() << " problems\n";
    EXPECT_EQ(without, std::set<std::string>());
    EXPECT_EQ(problems, std::set<std::string>());
  }
}

TEST(OwnPackOracle, AllTypesHaveLooks) {
  if (!fs::exists(data_folder())) GTEST_SKIP() << kInstall;
  minecraft::BlockTypes types;
  for (const Json& block : parsed(data_folder() / "blocks.json")) {
    const auto name = "minecraft:" + block["name"].get<std::string>();
    const int count = state_count(block);
    for (int state = 0; state < count; ++state) {
      const Values values = values_of(block, state);
      const auto made = types.block(name, {values.begin(), values.end()});
      ASSERT_TRUE(made) << name;
      ASSERT_TRUE(made->tint == minecraft::Tint::None || types.tinted(*made, {})) << name;
    }
  }
  BlockLooks looks(std::make_shared<MemoryPack>(), OwnPack::instance());
  const VoxelRegistry plain = types.types();
  std::set<std::string> without;
  std::size_t cubes = 0;
  for (std::size_t i = 1; i < plain.size(); ++i) {
    const VoxelProperties made = looks.applied(plain[static_cast<VoxelType>(i)]);
    if (made.faces.empty() && made.shapes.empty()) without.insert(made.name);
    cubes += made.shapes.empty() ? 1U : 0U;
  }
  std::cout << plain.size() - 1 << " types, " << cubes << " cubes, " << without.size() << " without a look\n";
  EXPECT_EQ(without, std::set<std::string>());
  EXPECT_EQ(looks.report().without_look, 0U);
}

using Sixteenths = std::vector<bool>;  // x + 16 y + 256 z

/// Returns the sixteenths that the game's collision boxes of a state touch; fences reach above their voxel.
Sixteenths collision(const Json& shapes, const Json& block, int state) {
  const Json& numbers = shapes["blocks"][block["name"].get<std::string>()];
  const int number = numbers.is_array() ? numbers[static_cast<std::size_t>(state)].get<int>() : numbers.get<int>();
  Sixteenths bits(4'096);
  for (const Json& box : shapes["shapes"][std::to_string(number)]) {
    std::array<int, 6> at{};
    for (std::size_t i = 0; i < 6; ++i) {
      at[i] = std::clamp(static_cast<int>(std::lround(box[i].get<double>() * 16.0)), 0, 16);
    }
    for (int z = at[2]; z < at[5]; ++z) {
      for (int y = at[1]; y < at[4]; ++y) {
        for (int x = at[0]; x < at[3]; ++x) bits[static_cast<std::size_t>(x + 16 * y + 256 * z)] = true;
      }
    }
  }
  return bits;
}

/// Returns the sixteenths that boxes and plates of a model touch, also turned ones by their bounds.
Sixteenths touched(const ShapeModel& model) {
  Sixteenths bits(4'096);
  for (const ModelFace& face : model.faces) {
    Vec3 low{100.0F};
    Vec3 high{-100.0F};
    for (const Vec3& corner : face.corners) {
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], corner[axis] * 16.0F);
        high[axis] = std::max(high[axis], corner[axis] * 16.0F);
      }
    }
    const auto first = [](float at) { return std::clamp(static_cast<int>(std::floor(at + 0.1F)), 0, 15); };
    const auto last = [](float at) { return std::clamp(static_cast<int>(std::ceil(at - 0.1F)), 1, 16); };
    for (int z = first(low.z); z < last(high.z); ++z) {
      for (int y = first(low.y); y < last(high.y); ++y) {
        for (int x = first(low.x); x < last(high.x); ++x) bits[static_cast<std::size_t>(x + 16 * y + 256 * z)] = true;
      }
    }
  }
  for (std::size_t z = 0; z < 16; ++z) {
    for (std::size_t y = 0; y < 16; ++y) {
      for (std::size_t x = 0; x < 16; ++x) {
        if ((model.bits[y + 16 * z] >> x & 1U) != 0) bits[x + 16 * y + 256 * z] = true;
      }
    }
  }
  return bits;
}

/// Returns the shared part of both.
double overlap(const Sixteenths& a, const Sixteenths& b) {
  std::size_t both = 0;
  std::size_t any = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    both += a[i] && b[i] ? 1U : 0U;
    any += a[i] || b[i] ? 1U : 0U;
  }
  return any == 0 ? 1.0 : static_cast<double>(both) / static_cast<double>(any);
}

/// Turns bits about y by a quarter.
Sixteenths turned(const Sixteenths& bits) {
  Sixteenths made(4'096);
  for (std::size_t z = 0; z < 16; ++z) {
    for (std::size_t y = 0; y < 16; ++y) {
      for (std::size_t x = 0; x < 16; ++x) made[15 - z + 16 * y + 256 * x] = bits[x + 16 * y + 256 * z];
    }
  }
  return made;
}

constexpr std::array<std::string_view, 12> kEqualFamilies = {"_stairs", "_slab", "_door",    "_trapdoor",
                                                             "_bed",    "chest", "_carpet",  "anvil",
                                                             "cactus",  "cocoa", "repeater", "farmland"};

TEST(OwnPackOracle, ShapesFollowCollisionBoxesInAllStates) {
  if (!fs::exists(data_folder())) GTEST_SKIP() << kInstall;
  const Json shapes = parsed(data_folder() / "blockCollisionShapes.json");
  Reader reader;
  std::set<std::string> problems;
  std::map<std::string, double> worst;
  std::map<std::string, std::string> better_turned;
  for (const Json& block : parsed(data_folder() / "blocks.json")) {
    const auto name = block["name"].get<std::string>();
    const int count = state_count(block);
    std::map<std::string, Sixteenths> known;
    for (int state = 0; state < count; ++state) {
      const Sixteenths expected = collision(shapes, block, state);
      if (std::ranges::find(expected, true) == expected.end()) continue;
      const auto models = reader.models(name, values_of(block, state), problems);
      std::string key;
      for (const StateModel& each : models) {
        key += each.model + " " + std::to_string(each.x) + " " + std::to_string(each.y) + " ";
      }
      if (!known.contains(key)) {
        const auto shape = shape_of(reader, models, problems);
        known[key] = shape ? touched(shape->model(0, {}, {})) : Sixteenths(4'096);
      }
      const double shared = overlap(expected, known[key]);
      Sixteenths other = known[key];
      for (int quarter = 1; quarter < 4; ++quarter) {
        other = turned(other);
        if (overlap(expected, other) > shared + 0.01) better_turned[name] = key + std::to_string(quarter);
      }
      const auto [at, is_new] = worst.emplace(name, shared);
      if (!is_new) at->second = std::min(at->second, shared);
    }
  }
  // Boxes of the game and of the pack are equal for these families up to details.
  std::set<std::string> different;
  std::size_t near = 0;
  for (const auto& [name, shared] : worst) {
    near += shared >= 0.8 ? 1U : 0U;
    if (name.starts_with("potted_") || name == "pale_moss_carpet") continue;  // plants and hanging moss do not collide
    const bool is_equal =
        std::ranges::any_of(kEqualFamilies, [&](std::string_view end) { return name.ends_with(end); });
    if (is_equal && shared < 0.8) different.insert(name);
  }
  std::cout << worst.size() << " blocks collide, " << near << " with at least 80 % of their boxes in common\n";
  EXPECT_EQ(better_turned, (std::map<std::string, std::string>()));
  EXPECT_EQ(different, std::set<std::string>());
  EXPECT_EQ(problems, std::set<std::string>());
}

/// Checks the test above: it must notice a turned door.
TEST(OwnPackOracle, OverlapNoticesTurns) {
  Sixteenths door(4'096);
  for (std::size_t i = 0; i < door.size(); ++i) door[i] = i % 16 < 3;
  EXPECT_EQ(overlap(door, door), 1.0);
  EXPECT_LT(overlap(door, turned(door)), 0.2);
  EXPECT_EQ(turned(turned(turned(turned(door)))), door);
}

}  // namespace
}  // namespace quoin::packs
