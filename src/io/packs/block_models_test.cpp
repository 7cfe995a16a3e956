#include "io/packs/block_models.h"

#include <string>

#include <gtest/gtest.h>

#include "io/packs/packs_for_tests.h"

namespace quoin::packs {
namespace {

using packs_test::PackBuilder;

std::string model_error(const PackBuilder& pack, std::string_view name) {
  const auto files = pack.files();
  ModelReader reader(*files);
  const auto model = reader.model(name);
  if (model) return *model == nullptr ? "absent" : "";
  return to_string(model.error());
}

std::string error_of_element(const std::string& element) {
  PackBuilder pack;
  pack.model("block/a", R"({"elements": [)" + element + "]}");
  return model_error(pack, "block/a");
}

TEST(BlockModels, InheritsTexturesAndElements) {
  PackBuilder pack;
  packs_test::add_parents(pack);
  pack.model("block/stone", R"({"parent": "minecraft:block/cube_all", "textures": {"all": "block/stone"}})");
  const auto files = pack.files();
  ModelReader reader(*files);
  const auto model = reader.model("stone");  // names without a folder lie in block
  ASSERT_TRUE(model && *model);
  ASSERT_EQ((*model)->elements().size(), 1U);
  const auto& up = (*model)->elements()[0].faces[2];
  ASSERT_TRUE(up);
  EXPECT_EQ((*model)->texture(up->texture), (ResourceName{"minecraft", "block/stone"}));
  EXPECT_EQ(reader.model("minecraft:block/stone")->get(), model->get()) << "each is read once";
  EXPECT_FALSE((*model)->texture("#missing"));
}

TEST(BlockModels, ReadsElements) {
  PackBuilder pack;
  pack.model("block/a", R"({"elements": [{"from": [16, 0, -16], "to": [0, 32, 0.5], // a comment
    "rotation": {"origin": [8, 0, 8], "axis": "x", "angle": -22.5, "rescale": true},
    "faces": {"up": {"texture": "#t", "uv": [0, 1.5, 16, 8], "rotation": 270, "tintindex": 0},
              "north": {"texture": "b:c"}}}]})");
  const auto files = pack.files();
  ModelReader reader(*files);
  const auto model = reader.model("block/a");
  ASSERT_TRUE(model && *model) << model_error(pack, "block/a");
  const PackElement& element = (*model)->elements()[0];
  EXPECT_EQ(element.from, Vec3(0.0F, 0.0F, -16.0F));
  EXPECT_EQ(element.to, Vec3(16.0F, 32.0F, 0.5F));
  EXPECT_EQ(element.turn, (ElementTurn{Vec3(8.0F, 0.0F, 8.0F), 0, -22.5F, true}));
  const auto& up = element.faces[2];
  ASSERT_TRUE(up);
  EXPECT_EQ(up->uv, (std::array<float, 4>{0.0F, 1.5F, 16.0F, 8.0F}));
  EXPECT_EQ(up->turn, 3);
  EXPECT_TRUE(up->is_tinted);
  ASSERT_TRUE(element.faces[5]);
  EXPECT_FALSE(element.faces[5]->is_tinted);
  EXPECT_FALSE(element.faces[0]);
  EXPECT_EQ((*model)->texture("b:c"), (ResourceName{"b", "c"}));
}

TEST(BlockModels, RefusesCyclesAndMissingParents) {
  PackBuilder pack;
  pack.model("block/a", R"({"parent": "block/b"})");
  pack.model("block/b", R"({"parent": "block/a"})");
  pack.model("block/c", R"({"parent": "block/none"})");
  pack.model("block/d", R"({"parent": "block/../d"})");
  for (int i = 0; i < 40; ++i) {
    pack.model("chain/" + std::to_string(i), R"({"parent": "chain/)" + std::to_string(i + 1) + "\"}");
  }
  pack.model("chain/40", "{}");
  EXPECT_NE(model_error(pack, "block/a").find("its own ancestor"), std::string::npos);
  EXPECT_NE(model_error(pack, "block/c").find("there is no model minecraft:block/none"), std::string::npos);
  EXPECT_NE(model_error(pack, "block/d").find("not the name of a model"), std::string::npos);
  EXPECT_NE(model_error(pack, "chain/0").find("more than 32 parents"), std::string::npos);
  EXPECT_EQ(model_error(pack, "chain/20"), "");
  EXPECT_EQ(model_error(pack, "block/absent"), "absent");
}

TEST(BlockModels, LongChainsLeaveNoErrorsForTheirParents) {
  PackBuilder pack;
  for (int i = 0; i < 40; ++i) {
    pack.model("chain/" + std::to_string(i), R"({"parent": "chain/)" + std::to_string(i + 1) + "\"}");
  }
  pack.model("chain/40", "{}");
  const auto files = pack.files();
  for (const bool from_below : {true, false}) {
    ModelReader reader(*files);
    for (int k = 0; k <= 40; ++k) {
      const int i = from_below ? k : 40 - k;
      const auto model = reader.model("chain/" + std::to_string(i));
      EXPECT_EQ(model.has_value(), 40 - i <= kMaxModelParents) << i;
      EXPECT_EQ(model ? "" : model.error().message, 40 - i <= kMaxModelParents ? "" : "more than 32 parents");
    }
  }
}

TEST(BlockModels, ChildrenShareTheElementsOfParents) {
  PackBuilder pack;
  pack.model("block/parent", R"({"elements": [{"from": [0, 0, 0], "to": [16, 16, 16]}]})");
  pack.model("block/child", R"({"parent": "block/parent", "textures": {"all": "block/a"}})");
  pack.model("block/other", R"({"parent": "block/parent", "elements": []})");
  const auto files = pack.files();
  ModelReader reader(*files);
  const auto parent = *reader.model("block/parent");
  EXPECT_EQ((*reader.model("block/child"))->shared_elements, parent->shared_elements);
  EXPECT_EQ(parent->elements().size(), 1U);
  EXPECT_TRUE((*reader.model("block/other"))->elements().empty());
}

// A quote in a comment would hide the brackets after it.
TEST(BlockModels, CommentsDoNotHideDeepJson) {
  const std::string deep = std::string(100, '[') + std::string(100, ']');
  PackBuilder pack;
  pack.model("block/line", "// \"\n{\"a\": " + deep + "}");
  pack.model("block/block", "/* \" */{\"a\": " + deep + "}");
  pack.model("block/good", "/* [[[ */ {\"a\": 1} // " + deep);
  EXPECT_NE(model_error(pack, "block/line").find("64 levels"), std::string::npos);
  EXPECT_NE(model_error(pack, "block/block").find("64 levels"), std::string::npos);
  EXPECT_EQ(model_error(pack, "block/good"), "");
}

TEST(BlockModels, ModelsThatTheGameDrawsHaveNoElements) {
  PackBuilder pack;
  pack.model("block/chest", R"({"parent": "builtin/entity", "textures": {"particle": "block/oak_planks"}})");
  const auto files = pack.files();
  ModelReader reader(*files);
  const auto model = reader.model("block/chest");
  ASSERT_TRUE(model && *model);
  EXPECT_TRUE((*model)->elements().empty());
}

TEST(BlockModels, RefusesWrongElements) {
  EXPECT_EQ(error_of_element(R"({"from": [0, 0, 0], "to": [16, 16, 16]})"), "");
  for (const char* wrong :
       {"1", R"({"from": [0, 0], "to": [16, 16, 16]})", R"({"from": [0, 0, 0]})",
        R"({"from": [0, 0, -17], "to": [16, 16, 16]})", R"({"from": [0, 0, 1e999], "to": [16, 16, 16]})",
        R"({"from": [0, 0, 0], "to": [16, 16, "16"]})",
        R"({"from": [0, 0, 0], "to": [16, 16, 16], "rotation": {"axis": "w", "angle": 45}})",
        R"({"from": [0, 0, 0], "to": [16, 16, 16], "rotation": {"axis": "x", "angle": "45"}})",
        R"({"from": [0, 0, 0], "to": [16, 16, 16], "rotation": {"x": 10, "y": 10}})",
        R"({"from": [0, 0, 0], "to": [16, 16, 16], "faces": {"up": 1}})",
        R"({"from": [0, 0, 0], "to": [16, 16, 16], "faces": {"up": {"uv": [0, 0, 16]}}})",
        R"({"from": [0, 0, 0], "to": [16, 16, 16], "faces": {"up": {"rotation": 45}}})"}) {
    EXPECT_NE(error_of_element(wrong), "") << wrong;
  }
  std::string many;
  for (std::size_t i = 0; i <= kMaxModelElements; ++i) {
    many += (i == 0 ? "" : ",") + std::string(R"({"from": [0, 0, 0], "to": [16, 16, 16]})");
  }
  EXPECT_NE(error_of_element(many).find("513 elements"), std::string::npos);
}

TEST(BlockModels, LimitsTextures) {
  PackBuilder pack;
  pack.model("block/long", R"({"textures": {"a": ")" + std::string(100'000, 'a') + "\"}}");
  std::string many;
  for (int i = 0; i < 1'500; ++i) many += (i == 0 ? "\"t" : ",\"t") + std::to_string(i) + R"(": "block/a")";
  pack.model("block/many", R"({"textures": {)" + many + "}}");
  EXPECT_NE(model_error(pack, "block/long").find("too long"), std::string::npos);
  EXPECT_NE(model_error(pack, "block/many").find("more than 1024 textures"), std::string::npos);
  EXPECT_NE(error_of_element(R"({"from": [0, 0, 0], "to": [16, 16, 16], "faces": {"up": {"texture": ")" +
                             std::string(100'000, 'a') + "\"}}}")
                .find("too long"),
            std::string::npos);
}

TEST(BlockModels, RefusesDeepAndLargeJson) {
  PackBuilder pack;
  pack.model("block/deep", R"({"a": )" + std::string(100'000, '[') + std::string(100'000, ']') + "}");
  pack.model("block/large", "{\"a\": \"" + std::string(kMaxJsonBytes, 'a') + "\"}");
  pack.model("block/cut", "{\"a\": ");
  pack.model("block/list", "[]");
  EXPECT_NE(model_error(pack, "block/deep").find("64 levels"), std::string::npos);
  EXPECT_NE(model_error(pack, "block/large").find("at most 8388608"), std::string::npos);
  EXPECT_NE(model_error(pack, "block/cut").find("not valid JSON"), std::string::npos);
  EXPECT_NE(model_error(pack, "block/list").find("not a JSON object"), std::string::npos);
  EXPECT_NE(model_error(pack, "a b"), "");
}

}  // namespace
}  // namespace quoin::packs
