#include "store/world/part_text.h"

#include <array>
#include <cmath>
#include <limits>
#include <random>
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

TEST(PartText, KeepsTextures) {
  const AlphaImage image{16, 16, std::vector<std::uint8_t>(std::size_t{4} * 16 * 16, 255)};
  const VoxelProperties snow{
      .name = "snow", .colour = {255, 255, 255}, .faces = Texture::from_image("snow", image).value()};
  const std::string text = text_of(snow);
  const auto read = part_from<VoxelProperties>(std::as_bytes(std::span(text)), "type 1");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*read, snow);
  const std::string wrong = R"({"colour": [0, 0, 0, 255], "faces": {"textures": [], "sides": []}})";
  const Status refused = check_part({part::kType, std::int64_t{1}}, std::as_bytes(std::span(wrong)));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "type 1.faces.sides: must be a list of 6 faces");
}

TEST(PartText, CountsBytesOfTextures) {
  for (const std::uint8_t alpha : {255, 200}) {
    for (const int side : {16, 64}) {
      const auto texels = static_cast<std::size_t>(side) * static_cast<std::size_t>(side);
      const AlphaImage image{side, side, std::vector<std::uint8_t>(4 * texels, alpha)};
      const VoxelFace face{.texture = Texture::from_image("t", image).value(), .alpha = FaceAlpha::Translucent};
      const VoxelProperties type{.visibility = Visibility::Transparent, .faces = face};
      EXPECT_LE(texture_bytes(type), text_of(type).size());
      EXPECT_GT(texture_bytes(type) + 600, text_of(type).size());
    }
  }
  EXPECT_EQ(texture_bytes(VoxelProperties{}), 0U);
}

TEST(PartText, KeepsShapesAndCountsTheirTextures) {
  const AlphaImage image{64, 64, std::vector<std::uint8_t>(std::size_t{4} * 64 * 64, 255)};
  ShapeElement element{.max = Vec3(16.0F, 24.0F, 16.0F)};
  for (ElementFace& face : element.faces) face.face = VoxelFace{.texture = Texture::from_image("t", image).value()};
  const VoxelProperties tall{.name = "tall",
                             .state_bits = 2,
                             .orientations = StateOrientations::about_y(),
                             .shapes = VoxelShape::from_elements({element}).value()};
  const std::string text = text_of(tall);
  const auto read = part_from<VoxelProperties>(std::as_bytes(std::span(text)), "type 1");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*read, tall);
  EXPECT_LE(texture_bytes(tall), text.size());
  EXPECT_GT(texture_bytes(tall) + 1'000, text.size());
  const std::string wrong = R"({"colour": [0, 0, 0, 255], "shapes": {"parts": []}})";
  const Status refused = check_part({part::kType, std::int64_t{1}}, std::as_bytes(std::span(wrong)));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "type 1.shapes: cannot use the shapes of a type: there is no part");
}

// A type's part must stay whole when another type changes.
TEST(PartText, HasAllTexturesOfAType) {
  const AlphaImage image{16, 16, std::vector<std::uint8_t>(std::size_t{4} * 16 * 16, 255)};
  const Texture snow = Texture::from_image("snow", image).value();
  for (const char* const name : {"a", "b"}) {
    EXPECT_NE(text_of(VoxelProperties{.name = name, .faces = snow}).find("\"texels\""), std::string::npos) << name;
  }
  const std::string text =
      R"({"colour": [0, 0, 0, 255], "faces": {"textures": [{"type": 1, "texture": 0}], "sides": []}})";
  const auto read = part_from<VoxelProperties>(std::as_bytes(std::span(text)), "type 2");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().message, "type 2.faces.textures[0].type: type 1 does not come before this type");
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

// The writer makes the text of readable parts after the save was accepted, when it is too late for errors.
TEST(PartText, AcceptsTextOfReadablePartsOnly) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const std::array numbers = {0.0, -0.0, 1.0, -2.5, 0.1, 1e300, 5e-324, -1e-310, kInf, -kInf, std::nan("")};
  const std::array<std::string, 4> names = {"", "a \"name\"", std::string("\0\xff", 2), "\xed\xa0\x80 \xc3\xa9"};
  std::minstd_rand random(1);
  int readable = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto number = [&] { return numbers[random() % (i % 2 == 0 ? 8 : numbers.size())]; };
    SceneFile::Placement instance;
    instance.grid = random();
    instance.instance = {.name = names[random() % names.size()],
                         .position = {number(), number(), number()},
                         .rotation = {number(), number(), number(), number()},
                         .voxel_size = number()};
    if (random() % 2 == 0) instance.group = random();
    const std::string text = text_of(instance);
    const bool is_accepted = check_part({part::kInstance, std::int64_t{0}}, std::as_bytes(std::span(text))).has_value();
    EXPECT_EQ(is_readable(instance), is_accepted) << text;
    const SceneFile::Group group{{.name = instance.instance.name,
                                  .position = instance.instance.position,
                                  .rotation = instance.instance.rotation},
                                 instance.group,
                                 {}};
    const std::string other = text_of(group);
    EXPECT_EQ(is_readable(group),
              check_part({part::kGroup, std::int64_t{0}}, std::as_bytes(std::span(other))).has_value())
        << other;
    readable += is_accepted ? 1 : 0;
  }
  EXPECT_GT(readable, 100);
  EXPECT_LT(readable, 1000);
  EXPECT_FALSE(is_readable(SceneFile::Placement{})) << "it has no grid";
  SceneFile::Placement long_name{.instance = {}, .grid = 0};
  long_name.instance.name.resize((std::size_t{1} << 20) + 1);
  EXPECT_FALSE(is_readable(long_name)) << "its text is checked at once";
}

}  // namespace
}  // namespace quoin::store
