// Textured faces in glTF files. The oracle reads positions, coordinates and images of a file, and compares each face of
// each voxel with `texel_at`.

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <string>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "io/gltf/gltf_for_tests.h"

namespace quoin {
namespace {

using Json = nlohmann::json;

Texture random_texture(const std::string& name, int size, unsigned seed, bool with_alpha = false) {
  std::mt19937 random(seed);
  AlphaImage image{size, size, {}};
  for (int i = 0; i < 4 * size * size; ++i) {
    const bool is_alpha = i % 4 == 3;
    image.rgba.push_back(is_alpha && !with_alpha ? 255 : static_cast<std::uint8_t>(random()));
  }
  return Texture::from_image(name, image).value();
}

class GltfTextures : public Gltf {
 protected:
  VoxelType add(VoxelProperties type) { return scene_.types.add(std::move(type)).value(); }
  GridHandle add_grid(const Grid& grid) {
    const GridHandle handle = scene_.add_grid({.name = "house", .grid = grid.snapshot()});
    place(scene_, handle, {0, 0, 0});
    return handle;
  }

  // Random voxels of four textured types and a plain one, in runs, so that faces merge.
  Grid random_grid(unsigned seed) {
    std::mt19937 random(seed);
    std::vector<VoxelType> types;
    for (std::uint8_t i = 0; i < 4; ++i) {
      std::array<VoxelFace, 6> faces;
      for (VoxelFace& face : faces) {
        face.texture = random_texture("t" + std::to_string(random() % 5), 16 << (random() % 2), random() % 5);
        face.turn = static_cast<std::uint8_t>(random() % 4);
        face.mirrored = random() % 2 == 0;
        if (random() % 2 == 0) face.tint = {200, 255, 100, 255};
      }
      types.push_back(add({.name = "textured " + std::to_string(i), .faces = VoxelFaces(faces)}));
    }
    types.push_back(add({.name = "plain", .colour = {9, 99, 199, 255}}));
    types.push_back(kAir);
    Grid grid;
    for (int i = 0; i < 120; ++i) {
      IVec3 low;
      IVec3 size;
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = static_cast<int>(random() % 100) - 50;
        size[axis] = 1 + static_cast<int>(random() % 9);
      }
      grid.fill_box({low, low + size}, types[random() % types.size()]);
    }
    return grid;
  }

  // Compares the texels of all faces in the file with the voxels of its only grid, and returns the number of points.
  int expect_faces(const ParsedGlb& glb, const Grid& grid) const {
    int points = 0;
    const Json& document = glb.document;
    for (const Json& node : document["nodes"]) {
      if (!node.contains("mesh")) continue;
      Vec3 origin(0.0F);
      if (node.contains("translation")) {
        for (int axis = 0; axis < 3; ++axis) origin[axis] = node["translation"][static_cast<std::size_t>(axis)];
      }
      for (const Json& primitive : document["meshes"][node["mesh"].get<std::size_t>()]["primitives"]) {
        const Json& material = document["materials"][primitive["material"].get<std::size_t>()];
        const std::size_t texture = material["pbrMetallicRoughness"]["baseColorTexture"]["index"];
        const Json& sampler = document["samplers"][document["textures"][texture]["sampler"].get<std::size_t>()];
        if (sampler["wrapS"] != 10497) continue;
        EXPECT_TRUE(sampler["wrapT"] == 10497 && sampler["magFilter"] == 9728 && sampler["minFilter"] == 9986);
        points += expect_primitive(glb, primitive, material, grid, origin);
      }
    }
    return points;
  }

  int expect_primitive(const ParsedGlb& glb, const Json& primitive, const Json& material, const Grid& grid,
                       Vec3 origin) const {
    const PngImage image = glb.image(material["pbrMetallicRoughness"]["baseColorTexture"]["index"]);
    Vec3 factor(1.0F);
    if (material["pbrMetallicRoughness"].contains("baseColorFactor")) {
      const Json& given = material["pbrMetallicRoughness"]["baseColorFactor"];
      factor = {given[0].get<float>(), given[1].get<float>(), given[2].get<float>()};
    }
    const auto positions = glb.vectors(primitive, "POSITION");
    const auto normals = glb.vectors(primitive, "NORMAL");
    const auto uv = glb.array<std::array<float, 2>>(primitive["attributes"]["TEXCOORD_0"].get<std::size_t>());
    const auto indices = glb.indices(primitive);
    int points = 0;
    for (std::size_t i = 0; i < indices.size(); i += 3) {
      const std::array<std::size_t, 3> corner = {indices[i], indices[i + 1], indices[i + 2]};
      const Direction direction = nearest_direction(DVec3(normals[corner[0]]));
      for (int step = 0; step < 40; ++step) {
        const double a = 0.0137 + 0.024 * step;
        const double b = (1.0 - a) * (0.0211 + 0.023 * (step * 17 % 40));
        const std::array<double, 3> shares = {a, b, 1.0 - a - b};
        DVec3 at(origin);
        std::array<double, 2> st{};
        for (std::size_t k = 0; k < 3; ++k) {
          at += DVec3(positions[corner[k]]) * shares[k];
          for (std::size_t c = 0; c < 2; ++c) st[c] += double{uv[corner[k]][c]} * shares[k];
        }
        const IVec3 voxel = voxel_of(at - DVec3(normal_of(direction)) * 0.5);
        const VoxelProperties& type = scene_.types[grid.get(voxel)];
        if (type.faces.empty()) {
          ADD_FAILURE() << "a texture on " << type.name;
          return points;
        }
        // Rounding decides between texels at their borders.
        const auto is_at_border = [&](double share) {
          return std::abs(share * image.width - std::round(share * image.width)) < 1e-6;
        };
        const auto texel = [&](double share) {
          return static_cast<std::size_t>((share - std::floor(share)) * image.width);
        };
        const std::uint8_t* pixel = image.pixels.data() + 4 * (texel(st[1]) * image.width + texel(st[0]));
        const Vec3 shown = linear_colour(Rgba8{pixel[0], pixel[1], pixel[2]}) * factor;
        const auto expected = texel_at(type.faces[direction], direction, at - DVec3(voxel), 0);
        const bool is_equal = glm::distance(shown, Vec3(expected[0], expected[1], expected[2])) < 1e-4F;
        if (!is_equal && !is_at_border(st[0]) && !is_at_border(st[1])) {
          ADD_FAILURE() << "voxel " << voxel.x << ' ' << voxel.y << ' ' << voxel.z << " face " << name_of(direction);
          return points;
        }
        ++points;
      }
    }
    return points;
  }
};

TEST_F(GltfTextures, RepeatOnMergedFaces) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    for (const bool watertight : {false, true}) {
      scene_ = {};
      const Grid grid = random_grid(seed);
      add_grid(grid);
      const ParsedGlb glb = write(BlockyMeshOptions{.watertight = watertight});
      EXPECT_GT(expect_faces(glb, grid), 1'000) << "seed " << seed;
    }
  }
}

TEST_F(GltfTextures, HaveSmallCoordinatesFarFromTheOrigin) {
  const VoxelType stone = add({.name = "stone", .faces = random_texture("stone", 64, 1)});
  Grid grid;
  grid.fill_box({{30'000, 0, -20'000}, {30'200, 3, -19'900}}, stone);
  add_grid(grid);
  const ParsedGlb glb = write();
  expect_faces(glb, grid);
  const Json& primitive = glb.document["meshes"][0]["primitives"][0];
  for (const auto& uv : glb.array<std::array<float, 2>>(primitive["attributes"]["TEXCOORD_0"].get<std::size_t>())) {
    EXPECT_LE(std::max(std::abs(uv[0]), std::abs(uv[1])), 64.0F);
    EXPECT_TRUE(uv[0] == std::round(uv[0]) && uv[1] == std::round(uv[1]));
  }
}

TEST_F(GltfTextures, HaveAMaterialPerTextureTintAndAlpha) {
  const Texture stone = random_texture("stone", 16, 1);
  const Texture leaf = random_texture("leaf", 32, 2, true);
  const VoxelFace tinted{.texture = stone, .tint = {255, 0, 0, 255}};
  Grid grid;
  int x = 0;
  const auto put = [&](VoxelProperties type) { grid.set({2 * x++, 0, 0}, add(std::move(type))); };
  put({.name = "a", .faces = stone});
  put({.name = "b", .faces = {tinted, {stone}, {.texture = stone, .turn = 2}}});
  put({.name = "c",
       .visibility = Visibility::Transparent,
       .faces = VoxelFace{.texture = leaf, .alpha = FaceAlpha::Cutout}});
  put({.name = "d",
       .visibility = Visibility::Transparent,
       .faces = VoxelFace{.texture = leaf, .alpha = FaceAlpha::Translucent}});
  put({.name = "e", .roughness = 0.25F, .metalness = 1.0F, .emission = 4.0F, .faces = tinted});
  add_grid(grid);
  const ParsedGlb glb = write();
  const Json& document = glb.document;
  ASSERT_EQ(document["images"].size(), 2U) << "no palette without plain types";
  EXPECT_EQ(document["samplers"].size(), 1U);
  EXPECT_EQ(glb.image(0).width, 16U);
  EXPECT_EQ(glb.image(1).width, 32U);
  std::map<std::string, Json> materials;
  for (const Json& each : document["materials"]) materials[each["name"]] = each;
  ASSERT_EQ(materials.size(), 5U);
  std::set<std::string> names;
  for (const auto& [name, material] : materials) names.insert(name);
  EXPECT_EQ(names, (std::set<std::string>{"leaf", "leaf 2", "stone", "stone 2", "stone 3"}));
  int cutout = 0;
  int translucent = 0;
  int glowing = 0;
  for (const auto& [name, material] : materials) {
    const bool is_leaf = name.starts_with("leaf");
    EXPECT_EQ(material["pbrMetallicRoughness"]["baseColorTexture"]["index"], is_leaf ? 1 : 0);
    EXPECT_EQ(material.contains("alphaMode"), is_leaf);
    if (material.value("alphaMode", "") == "MASK") {
      ++cutout;
      EXPECT_LT(127.25 / 255.0, material["alphaCutoff"]) << "far from the bytes on both sides";
      EXPECT_GT(127.75 / 255.0, material["alphaCutoff"]);
      EXPECT_TRUE(material["doubleSided"]);
    }
    translucent += material.value("alphaMode", "") == "BLEND" ? 1 : 0;
    if (!material.contains("emissiveTexture")) continue;
    ++glowing;
    EXPECT_EQ(material["emissiveTexture"]["index"], 0);
    EXPECT_EQ(material["emissiveFactor"], Json({1.0F, 0.0F, 0.0F}));
    EXPECT_EQ(material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"], 4.0F);
    EXPECT_EQ(material["pbrMetallicRoughness"]["roughnessFactor"], 0.25F);
    EXPECT_EQ(material["pbrMetallicRoughness"]["metallicFactor"], 1.0F);
  }
  EXPECT_EQ(cutout, 1);
  EXPECT_EQ(translucent, 1);
  EXPECT_EQ(glowing, 1);
  EXPECT_EQ(document["extensionsUsed"], Json({"KHR_materials_emissive_strength"}));
  EXPECT_FALSE(glb.image(0).pixels.empty());
}

TEST_F(GltfTextures, StandNextToPlainTypes) {
  const VoxelType stone = add({.name = "stone", .faces = random_texture("stone", 16, 1)});
  const VoxelType paint = add({.name = "paint", .colour = {1, 2, 3, 255}});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {4, 1, 1}}, stone);
  grid.fill_box({{4, 0, 0}, {8, 1, 1}}, paint);
  add_grid(grid);
  const ParsedGlb glb = write();
  ASSERT_EQ(glb.document["meshes"][0]["primitives"].size(), 2U);
  EXPECT_EQ(glb.document["images"].size(), 3U);
  EXPECT_EQ(glb.document["samplers"].size(), 2U);
  EXPECT_EQ(expect_faces(glb, grid), 40 * 2 * 5) << "40 points in each triangle of five faces";
}

TEST_F(GltfTextures, AreReadBackByMeshReaders) {
  const Texture stone = random_texture("stone", 16, 1);
  const VoxelType type = add({.name = "stone", .faces = stone});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {5, 4, 3}}, type);
  add_grid(grid);
  const auto path = folder_.file("a.glb");
  for (const bool compress : {false, true}) {
    const MeshFileOptions options{.quantize = compress, .compress = compress};
    const auto written = write_mesh(mesh_scene(scene_).value(), path, options);
    if (!written && written.error().code == ErrorCode::Unsupported) continue;
    ASSERT_TRUE(written) << to_string(written.error());
    const auto mesh = read_mesh(path);
    if (!mesh && mesh.error().code == ErrorCode::Unsupported) GTEST_SKIP() << "built without tinygltf";
    ASSERT_TRUE(mesh) << to_string(mesh.error());
    ASSERT_EQ(mesh->mesh.textures.size(), 1U);
    EXPECT_EQ(mesh->mesh.textures[0].wrap_u, TextureWrap::Repeat);
    EXPECT_FALSE(mesh->mesh.textures[0].is_smooth);
    const AlphaImage& image = mesh->mesh.textures[0].image;
    ASSERT_EQ(image.rgba.size(), 4U * 16 * 16);
    EXPECT_EQ(image.rgba[4], stone.level(0)[1].r);
  }
}

TEST_F(GltfTextures, GiveWayToAnAtlas) {
  const VoxelType stone = add({.name = "stone", .faces = random_texture("stone", 16, 1)});
  Grid grid;
  grid.set({0, 0, 0}, stone);
  add_grid(grid);
  const ParsedGlb glb = write(mesh_scene(scene_, {.atlas = true}).value());
  for (const Json& image : glb.document["images"]) EXPECT_NE(image["name"], "stone");
  EXPECT_EQ(glb.document["materials"].size(), 1U);
}

}  // namespace
}  // namespace quoin
