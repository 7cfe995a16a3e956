#include "store/world/part_text.h"

#include <string>

#include <gtest/gtest.h>

namespace quoin::store {
namespace {

Result<SceneLayer> layer_from(const std::string& text) {
  return part_from<SceneLayer>(std::as_bytes(std::span(text)), "layer 1");
}

TEST(PartText, ReadsNamesWithManyBrackets) {
  SceneLayer layer;
  layer.name = std::string(100, '[') + std::string(200, '}');
  const auto read = layer_from(text_of(layer));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->name, layer.name);
}

TEST(PartText, RejectsDeepNestingBehindBracketsInStrings) {
  constexpr int kDepth = 100'000;
  const std::string text = R"({"name": ")" + std::string(kDepth, ']') + R"(", "nested": )" + std::string(kDepth, '[');
  const auto read = layer_from(text);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().message, "layer 1: nested too deeply");
}

Result<WorldGrid> grid_from(const std::string& text) {
  return part_from<WorldGrid>(std::as_bytes(std::span(text)), "grid 3");
}

TEST(PartText, KeepsWholeGrids) {
  EXPECT_EQ(text_of(WorldGrid{}).find("whole"), std::string::npos) << "as in files of version 3";
  for (const bool is_whole : {false, true}) {
    const WorldGrid grid{.name = "ship", .band = 3.0F, .whole = is_whole};
    const auto read = grid_from(text_of(grid));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(*read, grid);
  }
  EXPECT_FALSE(grid_from(R"({"name": "old", "band": 8.0})")->whole);
}

TEST(PartText, KeepsLightAndOcclusionOfTypes) {
  EXPECT_EQ(text_of(VoxelProperties{.name = "stone"}).find("light"), std::string::npos) << "as in earlier files";
  const VoxelProperties grate{.name = "grate", .blocks_light = false, .occludes = false, .light_cost = 3};
  const std::string text = text_of(grate);
  const auto read = part_from<VoxelProperties>(std::as_bytes(std::span(text)), "type 1");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*read, grate);
}

TEST(PartText, KeepsTypesWhoseDataChangesMeshes) {
  VoxelProperties door{.name = "door", .state_bits = 1};
  EXPECT_EQ(text_of(door), R"({"name":"door","colour":[0,0,0,255],"state_bits":1})") << "as before the property";
  door.remesh_on_data = true;
  const std::string text = text_of(door);
  const auto read = part_from<VoxelProperties>(std::as_bytes(std::span(text)), "type 1");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*read, door);
}

TEST(PartText, RejectsDamagedMark) {
  for (const char* const value : {"1", "\"yes\"", "null", "[true]"}) {
    const auto read = grid_from(std::string(R"({"band": 8.0, "whole": )") + value + "}");
    ASSERT_FALSE(read) << value;
    EXPECT_EQ(read.error().code, ErrorCode::BadFormat);
    EXPECT_NE(read.error().message.find("grid 3.whole"), std::string::npos) << read.error().message;
  }
  const std::string text = R"({"whole": 1})";
  const Status refused = check_part({part::kGrid, std::int64_t{3}}, std::as_bytes(std::span(text)));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace quoin::store
