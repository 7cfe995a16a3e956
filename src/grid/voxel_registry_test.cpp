#include <quoin/grid/voxel_registry.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

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

VoxelProperties fluid_named(const char* name, std::uint32_t groups) {
  return {.name = name,
          .visibility = Visibility::Transparent,
          .shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid, .groups = groups})};
}

TEST(VoxelRegistry, KnowsTheFirstFluidOfEachGroup) {
  VoxelRegistry types;
  EXPECT_EQ(types.first_fluid(~0U), kAir);
  ASSERT_TRUE(types.add({.name = "stone"}));
  const VoxelType sea = *types.add(fluid_named("sea", 2));
  const VoxelType oil = *types.add(fluid_named("oil", 4));
  const VoxelType lake = *types.add(fluid_named("lake", 2));
  EXPECT_EQ(types.first_fluid(2), sea);
  EXPECT_EQ(types.first_fluid(4), oil);
  EXPECT_EQ(types.first_fluid(6), sea);
  EXPECT_EQ(types.first_fluid(1), kAir);
  const VoxelRegistry copy = types;
  types.replace(sea, {.name = "ice"});
  EXPECT_EQ(types.first_fluid(2), lake);
  EXPECT_EQ(types.fluid_groups(sea), 0U);
  EXPECT_EQ(copy.first_fluid(2), sea);
  types.replace(lake, {.name = "ice"});
  EXPECT_EQ(types.first_fluid(6), oil);
  types.replace(oil, {.name = "ice"});
  EXPECT_FALSE(types.has_fluids());
  EXPECT_EQ(types.first_fluid(~0U), kAir);
}

TEST(VoxelRegistry, ReportsTypesThatContainAChangedFluid) {
  VoxelRegistry types;
  const auto shapes_with = [](std::uint32_t groups) {
    ShapeRules rules{.parts = {{.shape = VoxelShape::box({0, 0, 0}, {16, 8, 16})}}};
    rules.fluid = ContainedFluid{.groups = groups};
    return *VoxelShapes::from_rules(std::move(rules));
  };
  const VoxelProperties water = fluid_named("water", 2);
  const VoxelType wet = *types.add({.name = "wet slab", .shapes = shapes_with(2)});
  ASSERT_TRUE(types.add({.name = "slab in oil", .shapes = shapes_with(4)}));
  ASSERT_TRUE(types.add({.name = "dry slab", .shapes = VoxelShape::box({0, 0, 0}, {16, 8, 16})}));
  ChangeCursor cursor = types.cursor();
  const auto changed = [&] {
    const TypeChanges changes = types.changes_since(cursor);
    std::vector<VoxelType> with_other_shapes;
    for (const TypeChange& change : changes.items_unless_all()) {
      if (change.shape_changed) with_other_shapes.push_back(change.type);
    }
    return with_other_shapes;
  };
  const VoxelType first = *types.add(water);
  EXPECT_EQ(changed(), (std::vector{wet, first}));
  VoxelProperties other = water;
  other.name = "brine";
  const VoxelType second = *types.add(other);
  EXPECT_EQ(changed(), std::vector{second}) << "not the first one";
  other = water;
  other.roughness = 0.5F;
  types.replace(first, other);
  EXPECT_EQ(changed(), std::vector<VoxelType>{}) << "it has the same models";
  other.colour = {1, 2, 3, 90};
  types.replace(first, other);
  EXPECT_EQ(changed(), std::vector{wet});
  types.replace(first, {.name = "ice"});
  EXPECT_EQ(changed(), (std::vector{wet, first}));
  types.replace(first, water);
  EXPECT_EQ(changed(), (std::vector{wet, first}));
}

// Adds types that differ in their names. Returns the time in seconds.
double seconds_to_add(VoxelProperties type, int count) {
  VoxelRegistry types;
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < count; ++i) {
    type.name = std::to_string(i);
    EXPECT_TRUE(types.add(type));
  }
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

TEST(VoxelRegistry, AddsFluidsAsFastAsOtherTypes) {
  const VoxelProperties fluid = fluid_named("", 1U << 31);
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double plain = seconds_to_add({.shapes = VoxelShape::box({0, 0, 0}, {16, 8, 16})}, 60'000);
    const double ratio = seconds_to_add(fluid, 60'000) / plain;
    least = std::min(least, ratio);
    RecordProperty("ratio", std::to_string(ratio));
  }
  EXPECT_LT(least, 4.0);
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
