// The faces of blocks that emit light: rules by name, and light_emission of models.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "io/packs/pack_own.h"
#include "io/packs/pack_shapes.h"
#include "io/packs/packs_for_tests.h"

namespace quoin::packs {
namespace {

using packs_test::block;
using packs_test::PackBuilder;

using Properties = std::vector<minecraft::Property>;

VoxelProperties own_look(std::string_view name, const Properties& properties = {}) {
  BlockLooks looks(std::make_shared<MemoryPack>(), OwnPack::instance());
  return looks.applied(block(name, properties).type);
}

struct SideOfShape {
  const ShapeElement* element = nullptr;
  Direction direction = Direction::PosX;
  VoxelFace look;
};

// Returns the drawn sides of a type's shapes that have a look of their own.
std::vector<SideOfShape> sides_of(const VoxelProperties& type) {
  std::vector<SideOfShape> sides;
  for (const ShapePart& part : type.shapes.rules().parts) {
    for (const ShapeElement& element : part.shape.elements()) {
      for (const Direction direction : kDirections) {
        const ElementFace& face = element.faces[static_cast<std::size_t>(direction)];
        if (face.is_drawn && face.face) sides.push_back({&element, direction, *face.face});
      }
    }
  }
  return sides;
}

std::vector<int> shares_of(const VoxelProperties& type) {
  std::vector<int> shares;
  for (const Direction direction : kDirections) shares.push_back(type.faces[direction].emission_share);
  return shares;
}

TEST(PackEmission, FrontsOfFurnacesEmit) {
  for (const char* name : {"furnace", "blast_furnace", "smoker"}) {
    const VoxelProperties lit = own_look(name, {{"facing", "north"}, {"lit", "true"}});
    EXPECT_EQ(shares_of(lit), (std::vector<int>{0, 0, 0, 0, 0, 255})) << name;
    EXPECT_FLOAT_EQ(lit.emission, 13.0F / 15.0F);
    const VoxelProperties dark = own_look(name, {{"facing", "north"}, {"lit", "false"}});
    EXPECT_EQ(dark.emission, 0.0F);
    EXPECT_EQ(shares_of(dark), std::vector<int>(6, 255)) << "shares make no difference";
  }
}

TEST(PackEmission, WholeCubesEmitAsBefore) {
  for (const char* name : {"glowstone", "shroomlight", "magma_block", "sea_lantern"}) {
    const VoxelProperties made = own_look(name);
    EXPECT_EQ(shares_of(made), std::vector<int>(6, 255)) << name;
    EXPECT_GT(made.emission, 0.0F);
  }
}

TEST(PackEmission, HeadsOfTorchesEmit) {
  for (const char* name : {"torch", "soul_torch", "redstone_torch"}) {
    float bright = 0.0F;
    for (const SideOfShape& side : sides_of(own_look(name, {}))) {
      const Vec3 size = side.element->max - side.element->min;
      const FaceFrame& frame = frame_of(side.direction);
      if (side.look.emission_share == 0) {
        EXPECT_LE(side.element->min.y, 8.0F);
        continue;
      }
      EXPECT_GE(side.element->min.y, 8.0F) << name;
      bright += size[frame.u] * size[frame.v];
    }
    EXPECT_FLOAT_EQ(bright, 4.0F * 4.0F + 4.0F) << name;
  }
  for (const char* name : {"wall_torch", "soul_wall_torch"}) {
    const std::vector<SideOfShape> sides = sides_of(own_look(name, {{"facing", "east"}}));
    EXPECT_TRUE(std::ranges::any_of(sides, [](const SideOfShape& side) { return side.look.emission_share == 255; }));
    for (const SideOfShape& side : sides) {
      EXPECT_EQ(side.look.emission_share == 255, side.element->min.y >= 11.5F) << name;
    }
  }
}

TEST(PackEmission, PartsOfBlocksEmit) {
  const auto check = [](std::string_view name, const Properties& properties, const auto& emits) {
    int bright = 0;
    int dark = 0;
    for (const SideOfShape& side : sides_of(own_look(name, properties))) {
      EXPECT_EQ(side.look.emission_share, emits(side) ? 255 : 0) << name << " " << side.look.texture.name();
      (side.look.emission_share > 0 ? bright : dark) += 1;
    }
    EXPECT_GT(bright, 0) << name;
    EXPECT_GT(dark, 0) << name;
  };
  const auto is_plate = [](const SideOfShape& side) {
    const Vec3 size = side.element->max - side.element->min;
    return size.x == 0.0F || size.y == 0.0F || size.z == 0.0F;
  };
  const auto has_texture = [](std::string_view end) {
    return [end](const SideOfShape& side) { return side.look.texture.name().ends_with(end); };
  };
  check("lantern", {{"hanging", "true"}}, [&](const SideOfShape& side) { return !is_plate(side); });
  check("soul_lantern", {{"hanging", "false"}}, [&](const SideOfShape& side) { return !is_plate(side); });
  check("lava_cauldron", {}, has_texture("lava_still"));
  check("campfire", {{"facing", "north"}, {"lit", "true"}}, has_texture("campfire_fire"));
  check("soul_campfire", {{"facing", "north"}, {"lit", "true"}}, has_texture("soul_campfire_fire"));
  check("end_rod", {{"facing", "up"}}, [](const SideOfShape& side) { return side.element->min.y >= 1.0F; });
  const VoxelProperties jack = own_look("jack_o_lantern", {{"facing", "north"}});
  EXPECT_EQ(shares_of(jack), (std::vector<int>{0, 0, 0, 0, 0, 255}));
  for (const char* name : {"ender_chest", "enchanting_table", "brewing_stand"}) {
    const VoxelProperties made = own_look(name, {{"facing", "north"}});
    EXPECT_GT(made.emission, 0.0F) << name;
    for_each_look(made, [&](const VoxelFace& look) { EXPECT_EQ(look.emission_share, 0) << name; });
  }
}

// The texture stays in place when an element is cut.
TEST(PackEmission, CutElementsShowTheSameTexels) {
  PackBuilder pack;
  pack.texture("block/noise", packs_test::png(16, [](int x, int y) {
                 return Rgba8{static_cast<std::uint8_t>(16 * x), static_cast<std::uint8_t>(16 * y), 90};
               }));
  const auto files = pack.files();
  TextureReader textures(*files);
  const PackTexture* const noise = *textures.texture({"minecraft", "block/noise"});
  ASSERT_NE(noise, nullptr);
  const FaceColours colours{[&](const BlockModel&, const PackFace&) { return noise; }};
  for (int turn = 0; turn < 4; ++turn) {
    for (const bool has_uv : {false, true}) {
      PackElement element{.from = {2, 1, 3}, .to = {14, 15, 12}};
      for (auto& face : element.faces) {
        face = PackFace{.texture = "block/noise", .turn = turn};
        if (has_uv) face->uv = {1.0F, 14.0F, 9.0F, 2.0F};
      }
      BlockModel model;
      model.shared_elements = std::make_shared<const std::vector<PackElement>>(std::vector{element});
      EmittingFaces rule;
      rule.within = {Vec3(4, 5, 3), Vec3(32, 9, 10)};
      const std::vector<PackElement> cut = with_emission(model, rule);
      ASSERT_EQ(cut.size(), 5U);
      const auto model_of = [&](std::span<const PackElement> elements) {
        return VoxelShapes(*VoxelShape::from_elements(elements_of(model, elements, colours, true, textures)));
      };
      const VoxelShapes whole = model_of(model.elements());
      const VoxelShapes parts = model_of(cut);
      const auto uv_at = [](const ModelFace& face, const Vec3& point) {
        const Vec3 u = face.corners[1] - face.corners[0];
        const Vec3 v = face.corners[3] - face.corners[0];
        const float a = glm::dot(point - face.corners[0], u) / glm::dot(u, u);
        const float b = glm::dot(point - face.corners[0], v) / glm::dot(v, v);
        std::array<float, 2> uv{};
        for (std::size_t i = 0; i < 2; ++i) {
          uv[i] = face.uv[0][i] + a * (face.uv[1][i] - face.uv[0][i]) + b * (face.uv[3][i] - face.uv[0][i]);
        }
        return uv;
      };
      float area = 0.0F;
      for (const ModelFace& part : parts.model(0, {}, {}).faces) {
        const auto& all = whole.model(0, {}, {}).faces;
        const auto of = std::ranges::find(all, part.direction, &ModelFace::direction);
        ASSERT_NE(of, all.end());
        for (std::size_t corner = 0; corner < 4; ++corner) {
          const std::array<float, 2> expected = uv_at(*of, part.corners[corner]);
          for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(part.uv[corner][i], expected[i], 1e-5F) << turn;
        }
        area += glm::length(glm::cross(part.corners[1] - part.corners[0], part.corners[3] - part.corners[0]));
      }
      EXPECT_NEAR(area * 256.0F, 2.0F * (12 * 14 + 12 * 9 + 14 * 9), 1e-2F) << "no faces inside";
    }
  }
}

TEST(PackEmission, NamesFaultsOfRules) {
  const auto error_of = [](std::string_view table) {
    const auto made = EmissionRules::from_text(table);
    return made ? std::string() : made.error().message;
  };
  EXPECT_EQ(error_of("[]"), "");
  EXPECT_EQ(error_of(R"([["a b*", "texture=x,y* elements=plates within=0,0,0,1,2,3 share=9"]])"), "");
  EXPECT_EQ(error_of("{}"), "the table of emission is no JSON list");
  for (const char* wrong : {R"(["a"])", R"(["a", 1])", R"(["a", "", ""])", "7"}) {
    EXPECT_NE(error_of("[" + std::string(wrong) + "]").find("must be two texts"), std::string::npos) << wrong;
  }
  for (const char* wrong : {"colour=red", "share=256", "share=-1", "share=", "share", "within=1,2,3",
                            "within=1,2,3,4,5,x", "elements=all", "texture=", "=", "within=1,2,3,4,5,nan"}) {
    const std::string error = error_of(R"([["a", ")" + std::string(wrong) + "\"]]");
    EXPECT_NE(error.find(std::string("unknown condition ") + wrong), std::string::npos) << wrong;
  }
  EXPECT_NE(error_of(R"([["a", ""], ["a", ""]])").find("is in two rows"), std::string::npos);
}

// Blocks with a lower half that has this light_emission, and an upper half: stone, two torches, and an ore of a mod.
PackBuilder pack_with_light(const std::string& light, const std::string& light_above = "") {
  PackBuilder pack;
  pack.texture("block/red", packs_test::plain_png({200, 20, 20}));
  const auto box = [](const char* from, const char* to, const std::string& level) {
    return std::string(R"({"from": [)") + from + R"(], "to": [)" + to + "]" +
           (level.empty() ? "" : ", \"light_emission\": " + level) +
           R"(, "faces": {"north": {"texture": "block/red"}, "up": {"texture": "block/red"}}})";
  };
  pack.model("block/halves", R"({"elements": [)" + box("0, 0, 0", "16, 8, 16", light) + ", " +
                                 box("0, 8, 0", "16, 16, 16", light_above) + "]}");
  const std::string states = R"({"variants": {"": {"model": "block/halves"}}})";
  for (const char* name : {"stone", "torch", "soul_torch", "redstone_torch"}) pack.states(name, states);
  for (const char* name : {"ore", "glow_stone"}) {
    pack.put_asset("mod/blockstates/" + std::string(name) + ".json", states);
  }
  return pack;
}

// Returns the shares of the lower and the upper half.
std::array<int, 2> shares_of_halves(const VoxelProperties& type) {
  std::array<int, 2> found{-1, -1};
  for (const SideOfShape& side : sides_of(type)) found[side.element->min.y > 0.0F ? 1 : 0] = side.look.emission_share;
  return found;
}

VoxelProperties look_of(const PackBuilder& pack, const char* name, const Properties& properties = {}) {
  return BlockLooks(pack.files()).applied(block(name, properties).type);
}

TEST(PackEmission, ReadsLightOfElements) {
  // The ore does not emit, so it has the light of its elements.
  const VoxelProperties ore = look_of(pack_with_light("9", "3"), "mod:ore");
  EXPECT_FLOAT_EQ(ore.emission, 9.0F / 15.0F);
  EXPECT_EQ(shares_of_halves(ore), (std::array{255, 85}));
  // A soul torch has level 10: an element of level 4 shows less.
  const VoxelProperties torch = look_of(pack_with_light("4"), "soul_torch");
  EXPECT_FLOAT_EQ(torch.emission, 10.0F / 15.0F);
  EXPECT_EQ(shares_of_halves(torch), (std::array{102, 0}));
  EXPECT_EQ(shares_of_halves(look_of(pack_with_light("15"), "soul_torch")), (std::array{255, 0}));
  // Without light_emission, the rule for torches counts.
  EXPECT_EQ(shares_of_halves(look_of(pack_with_light(""), "torch")), (std::array{0, 255}));
  EXPECT_EQ(look_of(pack_with_light(""), "stone").emission, 0.0F);
  for (const char* wrong : {"16", "-1", "1.5", "\"9\"", "null"}) {
    BlockLooks looks(pack_with_light(wrong).files());
    EXPECT_TRUE(looks.applied(block("stone").type).shapes.empty()) << wrong;
    ASSERT_FALSE(looks.report().names.empty());
    EXPECT_NE(looks.report().names[0].find("\"light_emission\" is not a whole number from 0 to 15"), std::string::npos)
        << looks.report().names[0];
  }
}

TEST(PackEmission, DarkBlocksOfTheGameOnlyLookLit) {
  const VoxelProperties stone = look_of(pack_with_light("15", "5"), "stone");
  EXPECT_GT(stone.emission, 0.0F);
  EXPECT_EQ(std::lround(15.0F * stone.emission), 0) << "the level of propagated light";
  EXPECT_EQ(shares_of_halves(stone), (std::array{255, 85}));
}

TEST(PackEmission, DarkStatesStayDark) {
  PackBuilder pack = pack_with_light("15");
  pack.model("block/dark", R"({"elements": [{"from": [0, 0, 0], "to": [16, 8, 16],
    "faces": {"up": {"texture": "block/red"}}}]})");
  pack.states("cave_vines", R"({"variants": {"berries=true": {"model": "block/halves"},
    "berries=false": {"model": "block/dark"}}})");
  pack.states("respawn_anchor", R"({"variants": {"charges=4": {"model": "block/halves"},
    "charges=0": {"model": "block/dark"}, "charges=1": {"model": "block/dark"}, "charges=2": {"model": "block/dark"},
    "charges=3": {"model": "block/dark"}}})");
  const auto vines = [&](const char* berries) {
    return look_of(pack, "cave_vines", {{"age", "3"}, {"berries", berries}});
  };
  EXPECT_EQ(vines("false").emission, 0.0F);
  EXPECT_FALSE(vines("false").shapes.empty());
  EXPECT_FLOAT_EQ(vines("true").emission, 14.0F / 15.0F);
  // The model of this dark state has light, so the torch looks lit.
  EXPECT_LT(look_of(pack, "redstone_torch", {{"lit", "false"}}).emission, 1.0F / 30.0F);
  EXPECT_FLOAT_EQ(look_of(pack, "redstone_torch", {{"lit", "true"}}).emission, 7.0F / 15.0F);
  EXPECT_FLOAT_EQ(look_of(pack, "redstone_torch").emission, 7.0F / 15.0F);
  constexpr std::array kLevels{0, 3, 7, 11, 15};
  for (int charges = 0; charges <= 4; ++charges) {
    const VoxelProperties anchor = look_of(pack, "respawn_anchor", {{"charges", std::to_string(charges)}});
    EXPECT_FLOAT_EQ(anchor.emission, static_cast<float>(kLevels[static_cast<std::size_t>(charges)]) / 15.0F) << charges;
    EXPECT_FALSE(anchor.shapes.empty());
  }
}

TEST(PackEmission, LaterPacksReplaceTheLightOfEarlierOnes) {
  const auto again = [](const VoxelProperties& type, const char* light) {
    return BlockLooks(pack_with_light(light).files()).applied(type);
  };
  VoxelProperties ore = look_of(pack_with_light("15"), "mod:ore");
  EXPECT_EQ(ore.emission, 1.0F);
  ore = again(ore, "6");
  EXPECT_FLOAT_EQ(ore.emission, 6.0F / 15.0F);
  EXPECT_EQ(shares_of_halves(ore), (std::array{255, 0}));
  EXPECT_EQ(again(ore, "").emission, 0.0F);
  EXPECT_EQ(again(look_of(pack_with_light("3"), "mod:glow_stone"), "").emission, 1.0F) << "a lamp by its name";
  // Worlds of earlier versions have other levels.
  VoxelProperties torch = block("torch").type;
  torch.emission = 1.0F;
  EXPECT_FLOAT_EQ(again(torch, "").emission, 14.0F / 15.0F);
}

// Only the visible texels of an overlay emit.
TEST(PackEmission, OverlaysEmitByTheirVisibleShare) {
  PackBuilder pack = pack_with_light("");
  const auto shares = [&](const std::string& lower, const std::string& upper, const std::string& overlay) {
    const auto box = [](const std::string& light, const std::string& texture) {
      return R"({"from": [0, 0, 0], "to": [16, 16, 16], "light_emission": )" + light +
             R"(, "faces": {"up": {"texture": "block/)" + texture + R"("}, "north": {"texture": "block/)" + texture +
             "\"}}}";
    };
    pack.model("block/halves", R"({"elements": [)" + box(lower, "red") + ", " + box(upper, overlay) + "]}");
    std::vector<int> found;
    for (const SideOfShape& side : sides_of(look_of(pack, "mod:ore"))) found.push_back(side.look.emission_share);
    return found;
  };
  pack.texture("block/quarter", packs_test::png(16, [](int x, int) {
                 return x < 4 ? Rgba8{255, 255, 0} : Rgba8{0, 0, 0, 0};
               }));
  EXPECT_EQ(shares("0", "15", "quarter"), (std::vector<int>{64, 64}));
  EXPECT_EQ(shares("15", "0", "quarter"), (std::vector<int>{191, 191}));
  EXPECT_EQ(shares("15", "15", "quarter"), (std::vector<int>{255, 255}));
  EXPECT_EQ(shares("0", "15", "red"), (std::vector<int>{255, 255})) << "an opaque overlay hides the face below";
}

}  // namespace
}  // namespace quoin::packs
