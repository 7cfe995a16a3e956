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

Texture plain_texture(const std::string& name, Rgba8 colour) {
  AlphaImage image{16, 16, {}};
  for (int i = 0; i < 16 * 16; ++i) image.rgba.insert(image.rgba.end(), {colour.r, colour.g, colour.b, 255});
  return Texture::from_image(name, image).value();
}

/// Returns ground of grass with rock at its sides, which shows textures, and of plain sand.
Scene scene_of_ground() {
  Scene scene;
  VoxelProperties grass;
  grass.name = "grass";
  VoxelFace rock{plain_texture("rock", {120, 110, 100, 255})};
  rock.turn = 1;
  rock.tint = {255, 0, 255, 255};
  const Texture top = plain_texture("top", {40, 200, 60, 255});
  grass.faces = VoxelFaces(rock, {top}, {top});
  grass.field_textures = {.voxels = 4.0F, .flat_degrees = 20.0F, .steep_degrees = 50.0F};
  const VoxelType first = scene.types.add(grass).value();
  const VoxelType sand = scene.types.add({.name = "sand", .colour = {210, 190, 120}}).value();
  SceneGrid ground;
  ground.pivot = {3.0, 1.0, 0.0};
  ground.field.add_box({-10, -6, -10}, {3, 0, 10}, first);
  ground.field.add_box({2, -6, -10}, {10, 0, 10}, sand);
  Instance instance;
  instance.grid = scene.add_grid(std::move(ground));
  instance.position = {5.0, 6.0, 7.0};
  scene.add_instance(instance);
  return scene;
}

TEST(GltfSmooth, HasMaterialsAndWeightsOfTexturedFields) {
  const Scene scene = scene_of_ground();
  const auto meshes = mesh_scene(scene);
  ASSERT_TRUE(meshes);
  for (const bool quantize : {false, true}) {
    const auto bytes = write_mesh(*meshes, FileFormat::Glb, {.quantize = quantize});
    ASSERT_TRUE(bytes) << to_string(bytes.error());
    const ParsedGlb glb = parse_glb(*bytes);
    const auto& mesh = glb.document["meshes"][0];
    const auto& primitive = mesh["primitives"][0];
    const std::size_t of_materials = primitive["attributes"]["_MATERIALS_0"];
    const std::size_t of_weights = primitive["attributes"]["_WEIGHTS_0"];
    EXPECT_EQ(glb.document["accessors"][of_materials]["componentType"], 5123);
    EXPECT_FALSE(glb.document["accessors"][of_materials].contains("normalized"));
    EXPECT_EQ(glb.document["accessors"][of_weights]["componentType"], 5121);
    EXPECT_EQ(glb.document["accessors"][of_weights]["normalized"], true);
    EXPECT_EQ(glb.document["accessors"][of_weights]["type"], "VEC4");
    const auto materials = glb.array<std::array<std::uint16_t, 4>>(of_materials);
    const auto weights = glb.array<std::array<std::uint8_t, 4>>(of_weights);
    const MeshView& view = meshes->parts.back().surfaces.front();  // the first part has no voxels
    ASSERT_EQ(materials.size(), view.positions.size());
    std::size_t mixed = 0;
    for (std::size_t i = 0; i < materials.size(); ++i) {
      ASSERT_EQ(materials[i], view.materials[i].types);
      ASSERT_EQ(weights[i], view.materials[i].weights);
      mixed += weights[i][0] != 0 && weights[i][1] != 0 ? 1 : 0;
    }
    EXPECT_GT(mixed, 10U);
    const auto indices = glb.indices(primitive);
    for (std::size_t i = 0; i < indices.size(); ++i) {
      ASSERT_EQ(materials[indices[i]], materials[indices[i / 3 * 3]]) << "in a triangle";
    }
    // Clients that do not know these attributes show the mean colours by slope.
    const auto colours = glb.array<std::array<std::uint16_t, 4>>(primitive["attributes"]["COLOR_0"].get<std::size_t>());
    for (std::size_t i = 0; i < colours.size(); ++i) ASSERT_LE(colours[i][1], view.albedo[i][1]);
    // The matrix maps positions of the file to voxels.
    const auto& matrix = mesh["extras"]["voxels_from_mesh"];
    ASSERT_EQ(matrix.size(), 16U);
    const auto stored = [&](std::size_t i) {
      const std::size_t accessor = primitive["attributes"]["POSITION"];
      if (!quantize) return DVec3(glb.array<Vec3>(accessor)[i]);
      const auto whole = glb.array<std::array<std::int16_t, 4>>(accessor)[i];
      return DVec3(whole[0], whole[1], whole[2]);
    };
    for (const std::size_t i : {std::size_t{0}, view.positions.size() / 2}) {
      DVec3 voxels(0.0);
      for (int axis = 0; axis < 3; ++axis) {
        for (int k = 0; k < 3; ++k)
          voxels[axis] += matrix[static_cast<std::size_t>(4 * k + axis)].get<double>() * stored(i)[k];
        voxels[axis] += matrix[static_cast<std::size_t>(12 + axis)].get<double>();
      }
      EXPECT_LT(glm::length(voxels - DVec3(view.positions[i])), 1e-3);
    }
  }
}

TEST(GltfSmooth, DescribesTexturesOfFields) {
  const auto bytes = write_mesh(*mesh_scene(scene_of_ground()), FileFormat::Glb);
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  const ParsedGlb glb = parse_glb(*bytes);
  const auto& described = glb.document["extras"]["field_materials"];
  ASSERT_EQ(described.size(), 2U);
  EXPECT_EQ(described[0]["type"], 1);
  EXPECT_EQ(described[0]["name"], "grass");
  EXPECT_EQ(described[0]["voxels"], 4.0);
  EXPECT_EQ(described[0]["flat_degrees"], 20.0);
  EXPECT_EQ(described[0]["steep_degrees"], 50.0);
  const auto& faces = described[0]["faces"];
  ASSERT_EQ(faces.size(), 6U);
  EXPECT_EQ(faces[0], nlohmann::json({{"texture", 0}, {"turn", 1}, {"tint", {1.0, 0.0, 1.0}}}));
  EXPECT_EQ(faces[2], nlohmann::json({{"texture", 1}}));
  EXPECT_EQ(described[1]["name"], "sand");
  EXPECT_TRUE(described[1].contains("color"));
  ASSERT_EQ(glb.document["textures"].size(), 2U);
  const PngImage image = glb.image(glb.document["textures"][1]["source"].get<std::size_t>());
  EXPECT_EQ(image.width, 16U);
  EXPECT_EQ(image.pixels[1], 200);
  const auto& sampler = glb.document["samplers"][glb.document["textures"][0]["sampler"].get<std::size_t>()];
  EXPECT_EQ(sampler["wrapS"], 10497) << "repeats";
}

TEST(GltfSmooth, HasNoMaterialsWithoutTextures) {
  Scene scene = scene_of_ground();
  VoxelProperties plain = scene.types[1];
  plain.faces = {};
  scene.types.replace(1, plain);
  const auto bytes = write_mesh(*mesh_scene(scene), FileFormat::Glb);
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  const ParsedGlb glb = parse_glb(*bytes);
  EXPECT_FALSE(glb.document.contains("extras"));
  EXPECT_FALSE(glb.document["meshes"][0].contains("extras"));
  EXPECT_FALSE(glb.document["meshes"][0]["primitives"][0]["attributes"].contains("_MATERIALS_0"));
}

}  // namespace

}  // namespace quoin
