#include "io/packs/block_states.h"

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include <algorithm>
#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "io/packs/packs_for_tests.h"
#include "io/packs/state_conditions.h"

namespace quoin::packs {
namespace {

Result<BlockStates> states_from(const std::string& text) {
  return parse_block_states(nlohmann::json::parse(text));
}

std::string states_error(const std::string& text) {
  const auto states = states_from(text);
  return states ? "" : states.error().message;
}

// Returns the models that a block shows.
std::multiset<std::string> shown(const std::string& text, const packs_test::TypeAndState& block) {
  const auto states = states_from(text);
  EXPECT_TRUE(states);
  const TypeStates of_type(block.type);
  std::multiset<std::string> models;
  for (const StateCase& each : states->cases) {
    const auto conditions = of_type.conditions(each);
    EXPECT_TRUE(conditions);
    for (const ShapeCondition& condition : *conditions) {
      if (!holds(condition, block.state)) continue;
      models.insert(each.heaviest().model);
      break;
    }
  }
  return models;
}

using Models = std::multiset<std::string>;

TEST(BlockStates, ChoosesVariantsByState) {
  const std::string stairs = R"({"variants": {
    "facing=east,half=bottom": {"model": "a"}, "facing=south,half=bottom": {"model": "b", "y": 90},
    "facing=east,half=top": {"model": "c", "x": 180, "uvlock": true}}})";
  const auto block = [](const char* facing, const char* half) {
    return packs_test::block("minecraft:oak_stairs", {{"facing", facing}, {"half", half}, {"waterlogged", "false"}});
  };
  EXPECT_EQ(shown(stairs, block("east", "bottom")), Models{"a"});
  EXPECT_EQ(shown(stairs, block("south", "bottom")), Models{"b"});
  EXPECT_EQ(shown(stairs, block("east", "top")), Models{"c"});
  EXPECT_EQ(shown(stairs, block("south", "top")), Models{});
  const auto states = states_from(stairs);
  bool has_lock = false;
  for (const StateCase& each : states->cases) has_lock |= each.heaviest().keeps_uv && each.heaviest().x == 2;
  EXPECT_TRUE(has_lock);
}

TEST(BlockStates, ComparesPropertiesInTheNameAndAbsentOnes) {
  const std::string furnace = R"({"variants": {"lit=true": {"model": "on"}, "lit=false": {"model": "off"}}})";
  EXPECT_EQ(shown(furnace, packs_test::block("minecraft:furnace", {{"lit", "true"}})), Models{"on"});
  EXPECT_EQ(shown(furnace, packs_test::block("minecraft:furnace", {{"lit", "false"}})), Models{"off"});
  EXPECT_EQ(shown(furnace, packs_test::block("minecraft:furnace")), Models{"off"});
  const std::string slab = R"({"variants": {"type=bottom": {"model": "low"}, "type=top": {"model": "high"}}})";
  EXPECT_EQ(shown(slab, packs_test::block("minecraft:oak_slab")), Models{"low"}) << "the commonest value";
  const std::string mod = R"({"variants": {"kind=strange": {"model": "a"}, "kind=plain": {"model": "b"}}})";
  EXPECT_EQ(shown(mod, packs_test::block("mod:thing", {{"kind", "strange"}})), Models{"a"});
}

TEST(BlockStates, CombinesParts) {
  const std::string fence = R"({"multipart": [
    {"apply": {"model": "post"}}, {"when": {"north": "true"}, "apply": {"model": "north"}},
    {"when": {"east": true}, "apply": {"model": "east"}},
    {"when": {"OR": [{"north": "true", "east": "true"}, {"south": "true"}]}, "apply": {"model": "or"}},
    {"when": {"AND": [{"north": "true"}, {"OR": [{"east": "true"}, {"west": "true"}]}]}, "apply": {"model": "and"}}]})";
  const auto block = [](bool north, bool east, bool south) {
    const auto text = [](bool is_set) { return std::string(is_set ? "true" : "false"); };
    return packs_test::block("minecraft:oak_fence",
                             {{"north", text(north)}, {"east", text(east)}, {"south", text(south)}, {"west", "false"}});
  };
  EXPECT_EQ(shown(fence, block(false, false, false)), Models{"post"});
  EXPECT_EQ(shown(fence, block(true, false, false)), (Models{"post", "north"}));
  EXPECT_EQ(shown(fence, block(true, true, false)), (Models{"post", "north", "east", "or", "and"}));
  EXPECT_EQ(shown(fence, block(false, false, true)), (Models{"post", "or"}));
}

TEST(BlockStates, ListsAndNegatesValues) {
  const std::string wire = R"({"multipart": [{"when": {"north": "side|up"}, "apply": {"model": "a"}},
    {"when": {"north": "!none"}, "apply": {"model": "b"}}, {"when": {"power": 3}, "apply": {"model": "three"}}]})";
  const auto block = [](const char* north, const char* power) {
    return packs_test::block("minecraft:redstone_wire", {{"north", north}, {"power", power}});
  };
  EXPECT_EQ(shown(wire, block("up", "0")), (Models{"a", "b"}));
  EXPECT_EQ(shown(wire, block("none", "3")), Models{"three"});
}

TEST(BlockStates, ConnectsFencesOfOldWorlds) {
  const auto states = states_from(R"({"multipart": [{"when": {"north": "true"}, "apply": {"model": "a"}},
    {"when": {"west": "false"}, "apply": {"model": "b"}}]})");
  const packs_test::TypeAndState fence = packs_test::block("minecraft:oak_fence");
  const TypeStates of_fence(fence.type);
  EXPECT_TRUE(of_fence.connects());
  EXPECT_EQ(of_fence.conditions(states->cases[0])->at(0).connected, DirectionSet{Direction::NegZ});
  EXPECT_EQ(of_fence.conditions(states->cases[1])->at(0).unconnected, DirectionSet{Direction::NegX});
  const packs_test::TypeAndState vine = packs_test::block("minecraft:vine");
  EXPECT_FALSE(TypeStates(vine.type).connects());
  EXPECT_TRUE(TypeStates(vine.type).conditions(states->cases[0])->empty());
}

TEST(BlockStates, KeepsWeightsInTheOrderOfTheFile) {
  const auto states =
      states_from(R"({"variants": {"": [{"model": "a"}, {"model": "b", "weight": 5}, {"model": "c", "weight": 5}]}})");
  ASSERT_TRUE(states);
  const StateCase& each = states->cases.at(0);
  ASSERT_EQ(each.models.size(), 3U);
  EXPECT_EQ(each.models[0].model, "a");
  EXPECT_EQ(each.models[0].weight, 1);
  EXPECT_EQ(each.models[1].weight, 5);
  EXPECT_EQ(each.heaviest().model, "b");
}

// The conditions that are left are checked in all states, with all sides and corners.
TEST(BlockStates, EarlierConditionsTakeStatesAway) {
  const auto fits = [](const ShapeCondition& one, std::uint32_t state, std::uint8_t sides, StairCorner corner) {
    return holds(one, state) && (one.connected.bits() & ~sides) == 0 && (one.unconnected.bits() & sides) == 0 &&
           (!one.corner || *one.corner == corner);
  };
  const auto any_fits = [&](const std::vector<ShapeCondition>& all, std::uint32_t state, std::uint8_t sides,
                            StairCorner corner) {
    return std::ranges::count_if(all, [&](const ShapeCondition& one) { return fits(one, state, sides, corner); });
  };
  std::mt19937 random(7);
  const auto random_condition = [&] {
    ShapeCondition made;
    made.state_mask = static_cast<std::uint32_t>(random() & random() & 15U);
    made.state = static_cast<std::uint32_t>(random()) & made.state_mask;
    const auto sides = static_cast<std::uint8_t>(random() & random() & 7U);
    const auto others = static_cast<std::uint8_t>(random() & random() & 7U & ~sides);
    made.connected = DirectionSet::from_bits(sides);
    made.unconnected = DirectionSet::from_bits(others);
    if (random() % 3 == 0) made.corner = static_cast<StairCorner>(random() % 5);
    return made;
  };
  for (int i = 0; i < 300; ++i) {
    const std::vector<ShapeCondition> all = {random_condition()};
    std::vector<ShapeCondition> taken;
    for (int k = 0; k < i % 4; ++k) taken.push_back(random_condition());
    const auto left = conditions_without(all, taken);
    ASSERT_TRUE(left);
    for (std::uint32_t number = 0; number < 16 * 8 * 5; ++number) {
      const std::uint32_t state = number % 16;
      const auto sides = static_cast<std::uint8_t>(number / 16 % 8);
      const auto corner = static_cast<StairCorner>(number / 128);
      const bool is_wanted = any_fits(all, state, sides, corner) != 0 && any_fits(taken, state, sides, corner) == 0;
      ASSERT_EQ(any_fits(*left, state, sides, corner), is_wanted ? 1 : 0) << "never twice";
    }
  }
}

TEST(BlockStates, RefusesWrongFiles) {
  EXPECT_EQ(states_error(R"({"variants": {"": {"model": "a"}}})"), "");
  for (const char* wrong :
       {"{}", R"({"variants": []})", R"({"variants": {"": {}}})", R"({"variants": {"": []}})",
        R"({"variants": {"": 1}})", R"({"variants": {"": [{"model": "a", "weight": 0}]}})",
        R"({"variants": {"": [{"model": "a", "weight": 1.5}]}})",
        R"({"variants": {"": [{"model": "a", "weight": "2"}]}})",
        R"({"variants": {"": [{"model": "a", "weight": 1e7}]}})", R"({"variants": {"a": {"model": "a"}}})",
        R"({"variants": {"": {"model": "a", "x": 45}}})", R"({"variants": {"": {"model": "a", "y": "90"}}})",
        R"({"multipart": {}})", R"({"multipart": [1]})", R"({"multipart": [{"when": {"a": "b"}}]})",
        R"({"multipart": [{"apply": {"model": "a"}, "when": 1}]})",
        R"({"multipart": [{"apply": {"model": "a"}, "when": {"OR": 1}}]})",
        R"({"multipart": [{"apply": {"model": "a"}, "when": {"a": null}}]})"}) {
    EXPECT_NE(states_error(wrong), "") << wrong;
  }
}

TEST(BlockStates, LimitsProducts) {
  // Each AND of eleven pairs has 2^11 alternatives.
  std::string pairs;
  for (int i = 0; i < 11; ++i) {
    const std::string key = "k" + std::to_string(i);
    pairs += (i == 0 ? "" : ",") + (R"({"OR": [{")" + key + R"(": "a"}, {")" + key + R"(": "b"}]})");
  }
  EXPECT_NE(states_error(R"({"multipart": [{"apply": {"model": "a"}, "when": {"AND": [)" + pairs + "]}}]}"), "");
  std::string deep = R"({"a": "b"})";
  for (int i = 0; i < 10; ++i) deep = R"({"OR": [)" + deep + "]}";
  EXPECT_NE(states_error(R"({"multipart": [{"apply": {"model": "a"}, "when": )" + deep + "}]}"), "");
  std::string key;
  for (int i = 0; i < 80; ++i) key += (i == 0 ? "k" : ",k") + std::to_string(i) + "=1";
  EXPECT_NE(states_error(R"({"variants": {")" + key + R"(": {"model": "a"}}})"), "");
  // Many values of many fields.
  std::string all;
  for (int i = 0; i < 32; ++i) all += (i == 0 ? "" : "|") + std::to_string(i);
  const auto states = states_from(R"({"multipart": [{"apply": {"model": "a"}, "when": {"a": ")" + all + R"(", "b": ")" +
                                  all + R"(", "c": ")" + all + R"("}}]})");
  ASSERT_TRUE(states);
  const packs_test::TypeAndState block = packs_test::block("mod:a", {{"a", "1"}, {"b", "2"}, {"c", "3"}});
  const auto conditions = TypeStates(block.type).conditions(states->cases[0]);
  ASSERT_FALSE(conditions);
  EXPECT_EQ(conditions.error().code, ErrorCode::LimitExceeded);
  // A long list of values in each of many alternatives.
  std::string values = "1";
  std::string empty = "{}";
  for (int i = 0; i < 10'000; ++i) values += "|1";
  for (int i = 0; i < 1'000; ++i) empty += ",{}";
  const auto list_of_values = [&](const std::string& alternatives) {
    return R"({"multipart": [{"apply": {"model": "a"}, "when": {"OR": [)" + alternatives + R"(], "a": ")" + values +
           R"("}}]})";
  };
  EXPECT_EQ(states_error(list_of_values("{},{}")), "");
  EXPECT_NE(states_error(list_of_values(empty)).find("values in the products"), std::string::npos);
}

}  // namespace
}  // namespace quoin::packs
