#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <quoin/io/mesh_file.h>
#include <quoin/scene/scene_meshes.h>

#include "io/gltf/glb_for_tests.h"

namespace quoin {

namespace {

/// Returns four separate balls: plain, metal, emissive and glass.
Scene scene_of_balls() {
  Scene scene;
  std::vector<VoxelType> types;
  VoxelProperties plain;
  plain.colour = {200, 100, 50, 255};
  plain.roughness = 0.5F;
  VoxelProperties metal = plain;
  metal.metalness = 1.0F;
  metal.roughness = 0.25F;
  VoxelProperties lamp = plain;
  lamp.colour = {255, 0, 0, 255};
  lamp.emission = 4.0F;
  VoxelProperties glass = plain;
  glass.colour = {100, 200, 255, 80};
  glass.visibility = Visibility::Transparent;
  for (const VoxelProperties& type : {plain, metal, lamp, glass}) types.push_back(*scene.types.find_or_add(type));
  SceneGrid grid;
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 216; ++k) {
      grid.grid.set({12 * i + k % 6, k / 6 % 6, k / 36}, types[static_cast<std::size_t>(i)]);
    }
  }
  Instance instance;
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  return scene;
}

TEST(GltfSmooth, KeepsMaterialsOfTypes) {
  const Scene scene = scene_of_balls();
  const auto meshes = mesh_scene_smoothly(scene);
  ASSERT_TRUE(meshes);
  const auto bytes = write_mesh(*meshes, FileFormat::Glb);
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  const ParsedGlb glb = parse_glb(*bytes);
  const auto& materials = glb.document["materials"];
  ASSERT_EQ(materials.size(), 4U);
  int metals = 0;
  int plains = 0;
  int lamps = 0;
  int panes = 0;
  std::size_t triangles = 0;
  for (const auto& mesh : glb.document["meshes"]) {
    for (const auto& primitive : mesh["primitives"]) {
      triangles += glb.document["accessors"][primitive["indices"].get<std::size_t>()]["count"].get<std::size_t>() / 3;
      const auto& material = materials[primitive["material"].get<std::size_t>()];
      const auto& pbr = material["pbrMetallicRoughness"];
      if (material.contains("emissiveFactor")) {
        ++lamps;
        EXPECT_EQ(material["emissiveFactor"], nlohmann::json({1.0, 0.0, 0.0}));
        EXPECT_EQ(material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"], 4.0);
      } else if (material.contains("alphaMode")) {
        ++panes;
        EXPECT_EQ(material["alphaMode"], "BLEND");
        EXPECT_GT(material["extensions"]["KHR_materials_transmission"]["transmissionFactor"], 0.0);
        EXPECT_GT(material["extensions"]["KHR_materials_volume"]["thicknessFactor"], 2.0);
      } else if (pbr["metallicFactor"] == 1.0) {
        ++metals;
        EXPECT_EQ(pbr["roughnessFactor"], 0.25);
      } else {
        ++plains;
        EXPECT_EQ(pbr["metallicFactor"], 0.0);
        EXPECT_EQ(pbr["roughnessFactor"], 0.5);
      }
    }
  }
  EXPECT_EQ(triangles, static_cast<std::size_t>(meshes->stats.triangles));
  EXPECT_EQ(std::vector({plains, metals, lamps, panes}), std::vector({1, 1, 1, 1}));
  const auto used = glb.document["extensionsUsed"].dump();
  EXPECT_NE(used.find("emissive_strength"), std::string::npos);
  EXPECT_NE(used.find("transmission"), std::string::npos);
}

}  // namespace

}  // namespace quoin
