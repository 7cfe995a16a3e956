#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "io/gltf/gltf_for_tests.h"
#include "io/material_palette.h"

namespace quoin {

namespace {

using Json = nlohmann::json;

using GltfMaterials = Gltf;

TEST_F(GltfMaterials, WritesOcclusionAsLinearGreyOrOmitsIt) {
  place(scene_, add_asymmetric_grid(scene_, "crane"), {0, 0, 0});
  const auto meshes = mesh_scene(scene_);
  const ParsedGlb glb = write(*meshes);
  const Json& primitive = glb.document["meshes"][0]["primitives"][0];
  const std::size_t accessor = primitive["attributes"]["COLOR_0"];
  EXPECT_EQ(glb.document["accessors"][accessor]["componentType"], 5121);
  EXPECT_EQ(glb.document["accessors"][accessor]["type"], "VEC4");
  EXPECT_EQ(glb.document["accessors"][accessor]["normalized"], true);
  const auto colours = glb.array<std::array<std::uint8_t, 4>>(accessor);
  const auto& occlusion = meshes->parts[0].surfaces[0].block_occlusion;
  ASSERT_EQ(colours.size(), occlusion.size());
  constexpr std::array<std::uint8_t, 4> grey_of = {255, 191, 128, 64};
  std::set<std::uint8_t> seen;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const std::uint8_t grey = grey_of[occlusion[i]];
    EXPECT_EQ(colours[i], (std::array<std::uint8_t, 4>{grey, grey, grey, 255}));
    seen.insert(grey);
  }
  EXPECT_GT(seen.size(), 1U) << "the model has inner corners";
  const ParsedGlb plain = write(BlockyMeshOptions{.merge = true, .bake_occlusion = false, .watertight = false});
  EXPECT_FALSE(plain.document["meshes"][0]["primitives"][0]["attributes"].contains("COLOR_0"));
}

TEST_F(GltfMaterials, StoresOneTexelPerType) {
  SceneGrid grid;
  grid.name = "ramp";
  for (int i = 0; i < 600; ++i) {
    VoxelProperties properties;
    properties.colour = {static_cast<std::uint8_t>(i % 256), static_cast<std::uint8_t>(i / 256), 77, 255};
    properties.roughness = static_cast<float>(i) / 600.0F;
    properties.metalness = 1.0F - properties.roughness;
    grid.grid.set({2 * i, 0, 0}, *scene_.types.add(properties));
  }
  place(scene_, scene_.add_grid(std::move(grid)), {0, 0, 0});
  const auto meshes = mesh_scene(scene_);
  const ParsedGlb glb = write(*meshes);
  const PngImage palette = glb.image(0);
  const PngImage surface = glb.image(1);
  EXPECT_EQ(palette.width, 256U);
  EXPECT_EQ(palette.height, 4U) << "601 types need 3 rows, and textures keep to powers of two";
  const Json& primitive = glb.document["meshes"][0]["primitives"][0];
  const auto& types = meshes->parts[0].surfaces[0].types;
  for (std::size_t vertex = 0; vertex < types.size(); vertex += 5) {
    const VoxelProperties& properties = scene_.types[types[vertex]];
    EXPECT_EQ(glb.texel(palette, primitive, vertex),
              (std::array<int, 4>{properties.colour.r, properties.colour.g, 77, 255}));
    const auto rough = glb.texel(surface, primitive, vertex);
    EXPECT_NEAR(rough[1], properties.roughness * 255.0F, 0.51F);
    EXPECT_NEAR(rough[2], properties.metalness * 255.0F, 0.51F);
  }
  const Json& sampler = glb.document["samplers"][0];
  EXPECT_EQ(sampler, Json({{"magFilter", 9728}, {"minFilter", 9728}, {"wrapS", 33071}, {"wrapT", 33071}}));
  EXPECT_EQ(glb.document["materials"][0]["pbrMetallicRoughness"]["metallicFactor"], 1.0);
  EXPECT_EQ(glb.document["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"], 1.0);
}

TEST_F(GltfMaterials, BlendsTransparentTypesWithPaletteAlpha) {
  VoxelProperties glass;
  glass.colour = {10, 200, 220, 90};
  glass.visibility = Visibility::Transparent;
  VoxelProperties stone;
  stone.colour = {90, 90, 90, 40};
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, *scene_.types.add(glass));
  grid.grid.set({2, 0, 0}, *scene_.types.add(stone));
  place(scene_, scene_.add_grid(std::move(grid)), {0, 0, 0});
  const ParsedGlb glb = write();
  const Json& primitives = glb.document["meshes"][0]["primitives"];
  ASSERT_EQ(primitives.size(), 2U);
  const Json& opaque = glb.document["materials"][primitives[0]["material"].get<std::size_t>()];
  const Json& blended = glb.document["materials"][primitives[1]["material"].get<std::size_t>()];
  EXPECT_FALSE(opaque.contains("alphaMode"));
  EXPECT_EQ(blended["alphaMode"], "BLEND");
  EXPECT_NE(opaque["name"], blended["name"]);
  const PngImage palette = glb.image(0);
  EXPECT_EQ(glb.texel(palette, primitives[0], 0), (std::array<int, 4>{90, 90, 90, 255})) << "opaque at any alpha";
  EXPECT_EQ(glb.texel(palette, primitives[1], 0), (std::array<int, 4>{10, 200, 220, 116}))
      << "a voxel that covers 90 of 255 and tints the rest";
}

/// Adds a cube of glass, a deep pool of water in stone, and a single voxel of each.
void add_glass_and_water(Scene& scene) {
  VoxelProperties glass;
  glass.colour = {190, 230, 235, 12};
  glass.visibility = Visibility::Transparent;
  glass.ior = 1.5F;
  VoxelProperties water;
  water.colour = {30, 90, 170, 60};
  water.visibility = Visibility::Transparent;
  water.ior = 1.25F;
  const VoxelType glass_type = *scene.types.add(glass);
  const VoxelType water_type = *scene.types.add(water);
  SceneGrid grid;
  grid.grid.fill_box({{0, 0, 0}, {6, 6, 6}}, glass_type);
  grid.grid.fill_box({{20, 0, 0}, {40, 12, 20}}, add_type(scene, "stone", {90, 90, 90, 255}));
  grid.grid.fill_box({{21, 3, 1}, {39, 12, 19}}, water_type);
  const GridHandle handle = scene.add_grid(std::move(grid));
  scene.edit(place(scene, handle, {0, 0, 0})).voxel_size = 0.5;
}

const Json& material_of(const ParsedGlb& glb, float ior) {
  for (const Json& material : glb.document["materials"]) {
    if (material.contains("extensions") && material["extensions"]["KHR_materials_ior"]["ior"] == ior) return material;
  }
  ADD_FAILURE() << "no material of index " << ior;
  return glb.document["materials"][0];
}

TEST_F(GltfMaterials, WritesThicknessAndAttenuationOfGlass) {
  add_glass_and_water(scene_);
  const ParsedGlb glb = write();
  EXPECT_EQ(glb.document["extensionsUsed"],
            Json({"KHR_materials_transmission", "KHR_materials_volume", "KHR_materials_ior"}));
  const Json& water = material_of(glb, 1.25F);
  const Json& volume = water["extensions"]["KHR_materials_volume"];
  EXPECT_EQ(volume["thicknessFactor"], 9.0F) << "voxels, as the mesh has them";
  EXPECT_EQ(volume["attenuationDistance"], 4.5F) << "in the world";
  EXPECT_EQ(water["alphaMode"], "BLEND");
  EXPECT_EQ(material_of(glb, 1.5F)["extensions"]["KHR_materials_volume"]["thicknessFactor"], 6.0F);
}

// Compares the transmitted background and the body's own colour, for clients with and without transmission, with
// Quoin's images.
TEST_F(GltfMaterials, ApproximatesRenderedGlassWithAndWithoutTransmission) {
  add_glass_and_water(scene_);
  const auto meshes = mesh_scene(scene_);
  const MaterialPalette palette(*meshes);
  const Surfaces surfaces(scene_.types);
  int seen = 0;
  for (const SurfaceMaterial& material : palette.materials()) {
    if (!material.is_transparent()) continue;
    ++seen;
    const GlassMaterial& glass = material.glass;
    const Surface& surface = surfaces[material.type];
    const float own = 1.0F - std::exp(surface.log_clarity * glass.thickness);
    EXPECT_NEAR(glass.alpha * (1.0F - glass.transmission), own, 1e-5F);
    for (int channel = 0; channel < 3; ++channel) {
      const float passed = std::exp(surface.log_transmittance[channel] * glass.thickness);
      const float colour = surface.colour[channel];
      const float through = 1.0F - glass.alpha + glass.alpha * glass.transmission * colour * glass.attenuation[channel];
      EXPECT_NEAR(through, passed, 0.1F);
      EXPECT_NEAR(1.0F - glass.alpha, passed, 0.1F);
      EXPECT_NEAR(glass.alpha * colour, own * colour, 0.1F);
    }
  }
  EXPECT_EQ(seen, 2);
}

TEST(GlassMaterial, AttenuationIsNoDarkerThanBody) {
  Surface pane;
  pane.colour = {0.79F, 0.87F, 1.0F};
  for (const float absorption : {0.05F, 0.1F, 0.3F}) {
    set_absorption(absorption, pane);
    for (const float thickness : {1.0F, 3.0F, 12.0F}) {
      const GlassMaterial glass = glass_material(pane, thickness);
      for (int channel = 0; channel < 3; ++channel) {
        const float passed = std::exp(pane.log_transmittance[channel] * thickness);
        EXPECT_GE(glass.attenuation[channel], 0.999F * passed) << absorption << " " << thickness;
        EXPECT_LE(glass.attenuation[channel], 1.0F);
      }
    }
  }
}

TEST(GlassMaterial, IsClearOrOpaqueAtExtremes) {
  Surface clear;
  clear.colour = {0.5F, 0.2F, 1.0F};
  set_absorption(0.0F, clear);
  EXPECT_EQ(glass_material(clear, 7.0F).alpha, 0.0F);
  Surface closed = clear;
  set_absorption(1.0F, closed);
  EXPECT_EQ(glass_material(closed, 7.0F).alpha, 1.0F);
  EXPECT_EQ(glass_material(closed, 7.0F).transmission, 0.0F);
  float last = 0.0F;
  Surface water = clear;
  set_absorption(0.1F, water);
  for (const float thickness : {0.5F, 1.0F, 3.0F, 10.0F, 40.0F}) {
    EXPECT_GT(glass_material(water, thickness).alpha, last) << "the deeper the less shows";
    last = glass_material(water, thickness).alpha;
  }
  EXPECT_GT(last, 0.98F);
}

TEST_F(GltfMaterials, EstimatesThicknessWithoutGrid) {
  add_glass_and_water(scene_);
  auto meshes = *mesh_scene(scene_);
  for (MeshPart& part : meshes.parts) part.thickness.clear();
  const MaterialPalette palette(meshes);
  std::vector<float> thickness;
  for (const SurfaceMaterial& material : palette.materials()) {
    if (material.is_transparent()) thickness.push_back(material.glass.thickness);
  }
  ASSERT_EQ(thickness.size(), 2U);
  EXPECT_NEAR(thickness[0], 6.0F, 1e-4F);
  EXPECT_EQ(thickness[1], 1.0F) << "the pool's surface is open: its walls are the stone's";
}

double linear_from_srgb(int srgb) {
  const double value = srgb / 255.0;
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

TEST_F(GltfMaterials, PreservesEmissionOfMixedStrengths) {
  const std::vector<float> strengths = {8.0F, 6.5F, 4.0F, 3.9F, 0.5F, 0.02F, 1000.0F};
  SceneGrid grid;
  std::vector<VoxelType> types;
  for (std::size_t i = 0; i < strengths.size(); ++i) {
    VoxelProperties lamp;
    lamp.colour = {250, 180, static_cast<std::uint8_t>(40 + i), 255};
    lamp.emission = strengths[i];
    types.push_back(*scene_.types.add(lamp));
    grid.grid.set({static_cast<int>(2 * i), 0, 0}, types.back());
  }
  grid.grid.set({0, 2, 0}, add_type(scene_, "stone", {90, 90, 90, 255}));
  place(scene_, scene_.add_grid(std::move(grid)), {0, 0, 0});
  const ParsedGlb glb = write();
  EXPECT_EQ(glb.document["extensionsUsed"], Json({"KHR_materials_emissive_strength"}));
  std::set<std::string> names;
  for (const Json& material : glb.document["materials"]) names.insert(material["name"]);
  EXPECT_EQ(names.size(), glb.document["materials"].size());
  std::set<int> found;
  for (const Json& primitive : glb.document["meshes"][0]["primitives"]) {
    const Json& material = glb.document["materials"][primitive["material"].get<std::size_t>()];
    if (!material.contains("emissiveTexture")) continue;
    EXPECT_EQ(material["emissiveTexture"]["index"], 2);
    const double factor = material["emissiveFactor"][0].get<double>() *
                          material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"].get<double>();
    const auto count = glb.vectors(primitive, "POSITION").size();
    for (std::size_t vertex = 0; vertex < count; vertex += 4) {
      const auto base = glb.texel(glb.image(0), primitive, vertex);
      const auto texel = glb.texel(glb.image(2), primitive, vertex);
      const double expected = strengths[static_cast<std::size_t>(base[2] - 40)];
      EXPECT_EQ(base[0], 250) << "the base colour is kept";
      EXPECT_NEAR(factor * linear_from_srgb(texel[0]) / linear_from_srgb(base[0]), expected, expected * 0.01);
      found.insert(base[2]);
    }
  }
  EXPECT_EQ(found.size(), strengths.size());
}

TEST_F(GltfMaterials, SingleStrengthKeepsPaletteColour) {
  VoxelProperties lamp;
  lamp.colour = {201, 102, 3, 255};
  lamp.emission = 0.35F;
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, *scene_.types.add(lamp));
  place(scene_, scene_.add_grid(std::move(grid)), {0, 0, 0});
  const ParsedGlb glb = write();
  const Json& primitive = glb.document["meshes"][0]["primitives"][0];
  EXPECT_EQ(glb.texel(glb.image(2), primitive, 0), (std::array<int, 4>{201, 102, 3, 255}));
}

}  // namespace

}  // namespace quoin
