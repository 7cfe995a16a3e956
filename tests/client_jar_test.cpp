// Checks the blocks of a resource pack: those of an installed client of Minecraft if QUOIN_CLIENT_JAR names its .jar,
// and those of Quoin's own pack, with faults that must be found.

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <quoin/io/file.h>
#include <quoin/io/image_files.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/scene.h>

#include "io/minecraft/block_types.h"
#include "io/packs/block_models.h"
#include "io/packs/block_states.h"
#include "io/packs/pack_files.h"
#include "io/packs/pack_looks.h"
#include "io/packs/pack_own.h"
#include "io/packs/packs_for_tests.h"
#include "io/zip.h"

namespace quoin::packs {
namespace {

namespace fs = std::filesystem;
using minecraft::Property;
using Files = std::shared_ptr<const PackFiles>;

/// The result of a check.
struct Checked {
  std::size_t blocks = 0;
  std::size_t states = 0;
  std::set<std::string> drawn_by_code;  ///< blocks whose models have no elements
  std::set<std::string> problems;
};

/// Returns the values of each property in a block's states; numbers and booleans with "true" and "false".
std::map<std::string, std::set<std::string>> values_of(const BlockStates& states) {
  std::map<std::string, std::set<std::string>> values;
  for (const StateCase& each : states.cases) {
    for (const auto& alternative : each.when) {
      for (const StateTerm& term : alternative) values[term.property].insert(term.values.begin(), term.values.end());
    }
  }
  for (auto& [property, all] : values) {
    if (all.contains("true") || all.contains("false")) all.insert({"true", "false"});
  }
  return values;
}

/// Calls `use` with each combination of values.
template <class Use>
void for_each_state(const std::map<std::string, std::set<std::string>>& values, Use use) {
  constexpr std::size_t kMost = 10'000;
  std::vector<std::vector<Property>> states = {{}};
  for (const auto& [property, all] : values) {
    std::vector<std::vector<Property>> longer;
    for (const std::vector<Property>& state : states) {
      for (const std::string& value : all) {
        longer.push_back(state);
        longer.back().emplace_back(property, value);
      }
    }
    ASSERT_LE(longer.size(), kMost);
    states = std::move(longer);
  }
  for (const std::vector<Property>& state : states) use(state);
}

/// Gives the types of all states of a block their looks.
void check_block(const Files& pack, const std::string& block, Checked& checked) {
  const auto json = read_pack_json(*pack, "assets/minecraft/blockstates/" + block + ".json");
  if (!json || !*json) {
    checked.problems.insert(block + ": " + (json ? "no block states" : to_string(json.error())));
    return;
  }
  const auto states = parse_block_states(**json);
  if (!states) {
    checked.problems.insert(block + ": " + to_string(states.error()));
    return;
  }
  ++checked.blocks;
  minecraft::BlockTypes types;
  BlockLooks looks(pack);
  for_each_state(values_of(*states), [&](const std::vector<Property>& state) {
    ++checked.states;
    const auto made = types.block("minecraft:" + block, state);
    if (made && made->tint != minecraft::Tint::None) (void)types.tinted(*made, {});
    if (!made) checked.problems.insert(block + ": " + to_string(made.error()));
  });
  const VoxelRegistry all = types.types();
  for (std::size_t i = 1; i < all.size(); ++i) (void)looks.applied(all[static_cast<VoxelType>(i)]);
  for (const std::string& name : looks.report().names) {
    // A block without elements has no look, and no file of it is at fault.
    if (name.ends_with("(not in the packs)")) {
      checked.drawn_by_code.insert(block);
    } else {
      checked.problems.insert(block + ": " + name);
    }
  }
}

Checked check_blocks(const Files& pack, const std::vector<std::string>& blocks) {
  Checked checked;
  for (const std::string& block : blocks) check_block(pack, block, checked);
  return checked;
}

/// A small town: a street, houses with roofs of stairs, gardens with fences and flowers, a pond.
class Town {
 public:
  Town() {
    put({{0, 0, 0}, {40, 1, 40}}, "grass_block", {{"snowy", "false"}});
    put({{0, 0, 18}, {40, 1, 22}}, "cobblestone");
    put({{30, 0, 28}, {37, 1, 36}}, "water", {{"level", "0"}});
    for (const int x : {4, 16, 28}) build_house({x, 1, 6});
    for (const int x : {6, 20}) build_house({x, 1, 27});
    for (int x = 0; x < 40; ++x) {
      put({{x, 1, 16}, {x + 1, 2, 17}}, "oak_fence",
          {{"east", "true"}, {"west", "true"}, {"north", "false"}, {"south", "false"}});
      if (x % 5 == 2) put({{x, 1, 23}, {x + 1, 2, 24}}, x % 2 == 0 ? "poppy" : "dandelion");
    }
    for (const int x : {1, 14, 38}) {
      put({{x, 1, 25}, {x + 1, 5, 26}}, "oak_log", {{"axis", "y"}});
      put({{x - 1, 4, 24}, {x + 2, 7, 27}}, "oak_leaves");
    }
  }

  /// Returns an image of the town with the looks of the pack; `report` counts the missing files.
  [[nodiscard]] Image image(const Files& pack, BlockPackReport& report) const {
    Scene scene;
    scene.types = types_.types();
    BlockLooks looks(pack);
    for (std::size_t i = 1; i < scene.types.size(); ++i) {
      const auto type = static_cast<VoxelType>(i);
      scene.types.replace(type, looks.applied(scene.types[type]));
    }
    report = looks.report();
    SceneGrid grid;
    grid.grid = grid_.snapshot();
    Instance instance;
    instance.grid = scene.add_grid(std::move(grid));
    scene.add_instance(instance);
    RenderOptions options;
    options.width = 480;
    options.height = 320;
    const auto rendered = CpuRenderer(scene).render(frame_scene(scene, View::Iso, 1.5), options);
    EXPECT_TRUE(rendered);
    return rendered ? rendered->colour : Image{};
  }

 private:
  void put(const IBox& box, std::string_view name, const std::vector<Property>& properties = {}) {
    const auto block = types_.block("minecraft:" + std::string(name), properties);
    ASSERT_TRUE(block);
    VoxelType type = block->type;
    if (block->tint != minecraft::Tint::None) type = types_.tinted(*block, {}).value();
    for (int z = box.min.z; z < box.max.z; ++z) {
      for (int y = box.min.y; y < box.max.y; ++y) {
        for (int x = box.min.x; x < box.max.x; ++x) {
          grid_.set({x, y, z}, type);
          if (block->state != 0) grid_.set_data({x, y, z}, {.state = block->state});
        }
      }
    }
  }

  void build_house(IVec3 at) {
    put({at, at + IVec3(8, 4, 8)}, "oak_planks");
    put({at + IVec3(1, 0, 1), at + IVec3(7, 4, 7)}, "air");
    put({at + IVec3(2, 1, 7), at + IVec3(6, 3, 8)}, "glass");
    put({at + IVec3(3, 0, 7), at + IVec3(4, 1, 8)}, "oak_door",
        {{"facing", "south"}, {"half", "lower"}, {"hinge", "left"}, {"open", "false"}, {"powered", "false"}});
    for (int step = 0; step < 4; ++step) {
      for (const bool is_far : {false, true}) {
        const int z = is_far ? 7 - step : step;
        put({at + IVec3(0, 4 + step, z), at + IVec3(8, 5 + step, z + 1)}, "stone_brick_stairs",
            {{"facing", is_far ? "north" : "south"}, {"half", "bottom"}, {"shape", "straight"}});
      }
    }
    put({at + IVec3(0, 0, -1), at + IVec3(8, 1, 0)}, "smooth_stone_slab", {{"type", "bottom"}});
  }

  minecraft::BlockTypes types_;
  Grid grid_;
};

/// Counts pixels of the colour that games show for missing textures.
std::size_t magenta_pixels(const Image& image) {
  std::size_t count = 0;
  for (std::size_t i = 0; i + 2 < image.rgb.size(); i += 3) {
    const int red = image.rgb[i];
    const int green = image.rgb[i + 1];
    const int blue = image.rgb[i + 2];
    count += red > 60 && blue > 60 && 3 * green < std::min(red, blue) ? 1U : 0U;
  }
  return count;
}

std::string joined(const std::set<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += "\n  " + line;
  return text;
}

// The client of the person who runs the test.
TEST(ClientJar, LoadsAllBlockStates) {
  const char* const jar = std::getenv("QUOIN_CLIENT_JAR");
  if (jar == nullptr) GTEST_SKIP() << "set QUOIN_CLIENT_JAR to the .jar of a client of Minecraft (Java Edition)";
  const auto bytes = read_file(jar);
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  const auto parts = ZipParts::open(*bytes);
  ASSERT_TRUE(parts) << to_string(parts.error());
  std::vector<std::string> blocks;
  for (const std::string& name : parts->names()) {
    const fs::path path = name;
    const bool is_states = path.parent_path() == "assets/minecraft/blockstates" && path.extension() == ".json";
    if (is_states) blocks.push_back(path.stem().string());
  }
  EXPECT_GT(blocks.size(), 100U) << "a client has block states";
  const auto pack = open_pack(fs::path(jar));
  ASSERT_TRUE(pack) << to_string(pack.error());
  const Checked checked = check_blocks(*pack, blocks);
  EXPECT_TRUE(checked.problems.empty()) << joined(checked.problems);
  EXPECT_LT(4 * checked.drawn_by_code.size(), checked.blocks) << joined(checked.drawn_by_code);
  std::cout << checked.blocks << " blocks with " << checked.states << " states; " << checked.drawn_by_code.size()
            << " are drawn by code\n";

  BlockPackReport report;
  const Image image = Town().image(*pack, report);
  EXPECT_EQ(to_string(report), "");
  EXPECT_EQ(magenta_pixels(image), 0U);
  const fs::path shown = fs::path(testing::TempDir()) / "quoin_client_town.png";
  ASSERT_TRUE(write_png(image, shown));
  std::cout << "the town with this client: " << shown << "\n";
}

constexpr std::array kBlocks = {"stone", "oak_stairs", "oak_fence", "furnace", "redstone_wire", "poppy", "oak_door"};

/// Quoin's own pack below other files.
Files own_pack_below(std::map<std::string, std::string, std::less<>> files) {
  return std::make_shared<const PackStack>(
      std::vector<Files>{OwnPack::instance(), std::make_shared<const MemoryPack>(std::move(files))});
}

TEST(ClientJar, ChecksFindFaultsOfBlocks) {
  const std::vector<std::string> blocks(kBlocks.begin(), kBlocks.end());
  const Checked good = check_blocks(own_pack_below({}), blocks);
  EXPECT_TRUE(good.problems.empty()) << joined(good.problems);
  EXPECT_TRUE(good.drawn_by_code.empty()) << joined(good.drawn_by_code);
  EXPECT_EQ(good.blocks, blocks.size());
  EXPECT_GT(good.states, 100U);
  const std::string states = "assets/minecraft/blockstates/stone.json";
  const std::string stone = R"({"variants": {"": {"model": "block/test"}}})";
  const std::string model = "assets/minecraft/models/block/test.json";
  const std::vector<std::map<std::string, std::string, std::less<>>> faults = {
      {{states, "{"}},
      {{states, R"({"variants": 3})"}},
      {{states, stone}},
      {{states, stone}, {model, R"({"parent": "block/absent"})"}},
      {{states, stone}, {model, R"({"parent": "block/cube_all", "textures": {"all": "block/absent"}})"}},
      {{states, stone},
       {model, R"({"parent": "block/cube_all", "textures": {"all": "block/bad"}})"},
       {"assets/minecraft/textures/block/bad.png", "no image"}}};
  for (const auto& fault : faults) {
    EXPECT_FALSE(check_blocks(own_pack_below(fault), blocks).problems.empty()) << fault.begin()->second;
  }
  const Checked by_code = check_blocks(own_pack_below({{states, stone}, {model, R"({"elements": []})"}}), blocks);
  EXPECT_EQ(by_code.drawn_by_code, std::set<std::string>{"stone"});
  EXPECT_TRUE(by_code.problems.empty()) << joined(by_code.problems);
}

TEST(ClientJar, ChecksFindFaultsOfTheTown) {
  const Town town;
  BlockPackReport report;
  const Image good = town.image(own_pack_below({}), report);
  EXPECT_EQ(to_string(report), "");
  EXPECT_EQ(magenta_pixels(good), 0U);
  // The colours of the game's image for missing textures.
  const std::string planks = "assets/minecraft/textures/block/oak_planks.png";
  const std::string missing = packs_test::png(16, [](int x, int y) {
    return (x < 8) == (y < 8) ? Rgba8{248, 0, 248, 255} : Rgba8{0, 0, 0, 255};
  });
  const Image magenta = town.image(own_pack_below({{planks, missing}}), report);
  EXPECT_GT(magenta_pixels(magenta), 100U);
  (void)town.image(own_pack_below({{planks, "no image"}}), report);
  EXPECT_NE(to_string(report), "");
}

}  // namespace
}  // namespace quoin::packs
