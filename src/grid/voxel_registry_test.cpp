#include <quoin/grid/voxel_registry.h>

#include <limits>

#include <gtest/gtest.h>

namespace quoin {
namespace {

TEST(VoxelRegistry, FindsTypesByName) {
  VoxelRegistry types;
  EXPECT_FALSE(types.find("water"));
  const auto stone = types.add({.name = "stone"});
  const auto water = types.add({.name = "water", .visibility = Visibility::Transparent});
  ASSERT_TRUE(types.add({.name = "water"}) && stone && water);
  EXPECT_EQ(types.find("water"), *water) << "of several the first";
  EXPECT_EQ(types.find("stone"), *stone);
  EXPECT_FALSE(types.find("")) << "air is no type that was added";
}

std::string error_of(const VoxelProperties& properties) {
  VoxelRegistry types;
  const auto added = types.add(properties);
  const auto found = types.find_or_add(properties);
  EXPECT_EQ(added.has_value(), found.has_value());
  EXPECT_EQ(added.has_value(), validate_type(properties).has_value());
  if (added) return "";
  EXPECT_EQ(added.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(types.size(), 1U) << "nothing was added";
  return added.error().message;
}

TEST(VoxelRegistry, RefusesWrongPropertiesByName) {
  const std::string type = "cannot use voxel type \"roof\": ";
  EXPECT_EQ(error_of({.name = "roof", .visibility = Visibility::Transparent, .occludes = true}),
            type + "occludes: must be false for a transparent type, since only types that hide faces can occlude");
  EXPECT_EQ(error_of({.name = "roof", .light_cost = 16}), type + "light_cost: must be 0 to 15");
  EXPECT_EQ(error_of({.name = "roof", .state_bits = 33}), type + "state_bits: must be 0 to 32");
  EXPECT_EQ(error_of({.name = "roof", .visibility = Visibility::Air}), type + "visibility: only type 0 can be air");
  EXPECT_EQ(error_of({.name = "roof", .visibility = Visibility::Transparent, .blocks_light = true, .light_cost = 15}),
            "");
  EXPECT_EQ(error_of({.name = "roof", .blocks_light = false, .occludes = false}), "");
}

TEST(VoxelRegistry, LightAndOcclusionFollowVisibilityUnlessSet) {
  VoxelRegistry types;
  const VoxelType stone = types.add({.name = "stone"}).value();
  const VoxelType glass = types.add({.name = "glass", .visibility = Visibility::Transparent}).value();
  EXPECT_TRUE(types.blocks_light(stone) && types.occludes(stone));
  EXPECT_FALSE(types.blocks_light(glass) || types.occludes(glass));
  EXPECT_FALSE(types.blocks_light(kAir) || types.occludes(kAir));
  EXPECT_TRUE(types.blocks_light(99) && types.occludes(99)) << "not registered";
  EXPECT_FALSE(types.has_unoccluding());
  EXPECT_EQ(types.find_or_add({.name = "stone", .blocks_light = true, .occludes = true}).value(), stone);
  EXPECT_EQ(types.find_or_add({.name = "glass", .visibility = Visibility::Transparent, .occludes = false}).value(),
            glass);
  ChangeCursor cursor = types.cursor();
  VoxelProperties changed = types[stone];
  changed.light_cost = 2;
  changed.blocks_light = false;
  types.replace(stone, changed);
  EXPECT_FALSE(types.blocks_light(stone));
  const TypeChanges of_light = types.changes_since(cursor);
  ASSERT_EQ(of_light.items_unless_all().size(), 1U);
  EXPECT_FALSE(has_other_visibility(of_light)) << "meshes stay";
  changed.occludes = false;
  types.replace(stone, changed);
  EXPECT_TRUE(has_other_visibility(types.changes_since(cursor)));
  EXPECT_TRUE(types.has_unoccluding() && types.is_opaque(stone));
  changed.visibility = Visibility::Transparent;
  types.replace(stone, changed);
  EXPECT_FALSE(types.has_unoccluding());
  EXPECT_FALSE(types[stone].occludes.has_value()) << "the default again";
  EXPECT_TRUE(has_other_visibility(types.changes_since(cursor)));
}

TEST(VoxelRegistry, KnowsTypesWhoseDataChangesMeshes) {
  VoxelRegistry types;
  const auto stone = types.add({.name = "stone"});
  EXPECT_FALSE(types.has_remesh_on_data());
  const auto door = types.add({.name = "door", .remesh_on_data = true});
  ASSERT_TRUE(stone && door);
  EXPECT_TRUE(types.has_remesh_on_data());
  EXPECT_TRUE(types.remeshes_on_data(*door));
  EXPECT_FALSE(types.remeshes_on_data(*stone) || types.remeshes_on_data(kAir) || types.remeshes_on_data(9999));
  EXPECT_NE(types.find_or_add({.name = "door"}), *door) << "a property of the type";
  types.replace(*stone, {.name = "stone", .remesh_on_data = true});
  types.replace(*door, {.name = "door", .remesh_on_data = true});
  types.replace(*door, {.name = "door"});
  EXPECT_TRUE(types.remeshes_on_data(*stone) && !types.remeshes_on_data(*door));
  types.replace(*stone, {.name = "stone"});
  EXPECT_FALSE(types.has_remesh_on_data());
}

TEST(VoxelRegistry, RoundTripsColours) {
  for (int i = 0; i < 256; ++i) {
    const auto byte = static_cast<std::uint8_t>(i);
    const Rgba8 colour{byte, static_cast<std::uint8_t>(255 - i), 7, 255};
    EXPECT_EQ(srgb_colour(linear_colour(colour)), colour) << i;
  }
  EXPECT_NEAR(linear_colour({188, 0, 255, 3}).x, 0.5028865F, 1e-6F);
  EXPECT_EQ(srgb_colour({-1.0F, 9.0F, std::numeric_limits<float>::quiet_NaN()}), (Rgba8{0, 255, 0, 255}));
}

}  // namespace
}  // namespace quoin
