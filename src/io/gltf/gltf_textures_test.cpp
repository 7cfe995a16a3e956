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

#include "grid/shapes/shape_types_for_tests.h"
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
  int expect_faces(const ParsedGlb& glb, const Grid& grid, int wrap = 10'497) const {
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
        if (sampler["minFilter"] != 9986) continue;
        EXPECT_TRUE(sampler["wrapS"] == wrap && sampler["wrapT"] == wrap && sampler["magFilter"] == 9728);
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
        const IVec3 voxel = voxel_of(at - DVec3(normal_of(direction)) * 0.02);  // faces of shapes lie inside, too
        const VoxelProperties& type = scene_.types[grid.get(voxel)];
        if (type.faces.empty()) {
          ADD_FAILURE() << "a texture on " << type.name;
          return points;
        }
        // Rounding decides between texels at their borders.
        const auto is_at_border = [&](double share, std::uint32_t size) {
          return std::abs(share * size - std::round(share * size)) < 1e-6;
        };
        const auto texel = [&](double share, std::uint32_t size) {
          return static_cast<std::size_t>((share - std::floor(share)) * size);
        };
        const std::size_t row = texel(st[1], image.height) * image.width;
        const std::uint8_t* pixel = image.pixels.data() + 4 * (row + texel(st[0], image.width));
        const Vec3 shown = linear_colour(Rgba8{pixel[0], pixel[1], pixel[2]}) * factor;
        const AxisOrientation turn = type.orientations.of(grid.data(voxel).state);
        const auto expected = texel_at(turned_face(type.faces, direction, turn), direction, at - DVec3(voxel), 0);
        const Vec3 wanted(expected[0], expected[1], expected[2]);
        // An atlas has the tints, rounded to bytes.
        const bool is_rounded = factor == Vec3(1.0F) && Rgba8{pixel[0], pixel[1], pixel[2]} == srgb_colour(wanted);
        const bool is_equal = is_rounded || glm::distance(shown, wanted) < 1e-4F;
        if (!is_equal && !is_at_border(st[0], image.width) && !is_at_border(st[1], image.height)) {
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

TEST_F(GltfTextures, TurnWithStatesAndCoverShapes) {
  for (const bool watertight : {false, true}) {
    scene_ = {};
    Grid grid = random_grid(4);
    StateOrientations all;
    for (int i = 0; i < AxisOrientation::kCount; ++i) all.by_value.push_back(AxisOrientation::at(i));
    const VoxelFaces faces = scene_.types[1].faces;  // six different ones
    const auto turns = StateOrientations::about_y_and_upside_down();
    const std::array<VoxelType, 3> types = {add({.name = "cube", .state_bits = 6, .faces = faces, .orientations = all}),
                                            add({.name = "slab",
                                                 .state_bits = 3,
                                                 .faces = faces,
                                                 .orientations = turns,
                                                 .shapes = shapes_for_tests::slab()}),
                                            add({.name = "stairs",
                                                 .state_bits = 3,
                                                 .faces = faces,
                                                 .orientations = turns,
                                                 .shapes = shapes_for_tests::stairs()})};
    std::mt19937 random(4);
    for (int i = 0; i < 900; ++i) {
      const auto part = [&] { return static_cast<int>(random() % 40) - 20; };
      const std::size_t which = random() % 3;
      grid.set({part(), part() / 4, part()}, types[which],
               {.state = static_cast<std::uint32_t>(random() % (which == 0 ? 48 : 8))});
    }
    add_grid(grid);
    const ParsedGlb glb = write(BlockyMeshOptions{.watertight = watertight});
    EXPECT_GT(expect_faces(glb, grid), 10'000);
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

TEST_F(GltfTextures, HaveMaterialsBySharesOfEmission) {
  const Texture stone = random_texture("stone", 16, 1);
  VoxelFace dark{.texture = stone, .emission_share = 0};
  const VoxelFace half{.texture = stone, .emission_share = 51};
  Grid grid;
  grid.set({0, 0, 0}, add({.name = "a", .emission = 4.0F, .faces = {dark, {stone}, half}}));
  add_grid(grid);
  const ParsedGlb glb = write();
  std::multiset<float> strengths;
  for (const Json& material : glb.document["materials"]) {
    float factor = material.contains("emissiveFactor") ? material["emissiveFactor"][0].get<float>() : 0.0F;
    if (material.contains("extensions")) {
      factor *= material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"].get<float>();
    }
    strengths.insert(std::round(1e4F * factor) / 1e4F);
  }
  EXPECT_EQ(strengths, (std::multiset<float>{0.0F, 0.8F, 4.0F}));
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

TEST_F(GltfTextures, GiveWayToAnOcclusionAtlas) {
  const VoxelType stone = add({.name = "stone", .colour = {90, 90, 90}});
  Grid grid;
  grid.set({0, 0, 0}, stone);
  add_grid(grid);
  SceneMeshes meshes = mesh_scene(scene_, {.atlas = true}).value();
  ASSERT_FALSE(meshes.atlas.rgb.empty());
  meshes.types.replace(stone, {.name = "stone", .faces = random_texture("stone", 16, 1)});
  for (const TexturesIn textures_in : {TexturesIn::Images, TexturesIn::Atlas}) {
    const auto bytes = write_mesh(meshes, FileFormat::Glb, {.textures_in = textures_in});
    ASSERT_TRUE(bytes) << to_string(bytes.error());
    const ParsedGlb glb = parse_glb(*bytes);
    for (const Json& image : glb.document["images"]) EXPECT_NE(image["name"], "stone");
    EXPECT_EQ(glb.document["materials"].size(), 1U);
  }
}

class GltfTextureAtlas : public GltfTextures {
 protected:
  ParsedGlb write_atlas() {
    const auto bytes =
        write_mesh(mesh_scene(scene_, {.atlas = true}).value(), FileFormat::Glb, {.textures_in = TexturesIn::Atlas});
    EXPECT_TRUE(bytes) << to_string(bytes.error());
    return parse_glb(bytes.value());
  }
  static constexpr int kClamp = 33'071;
};

TEST_F(GltfTextureAtlas, HasTheTexelsOfAllFaces) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    scene_ = {};
    const Grid grid = random_grid(seed);
    add_grid(grid);
    const ParsedGlb glb = write_atlas();
    EXPECT_GT(expect_faces(glb, grid, kClamp), 10'000) << "seed " << seed;
    std::multiset<std::string> names;
    for (const Json& image : glb.document["images"]) names.insert(image["name"]);
    EXPECT_EQ(names, (std::multiset<std::string>{"palette", "palette metallic-roughness", "atlas"}));
    EXPECT_EQ(glb.document["materials"].size(), 2U) << "of plain and textured types";
  }
}

TEST_F(GltfTextureAtlas, HasAMaterialPerUseOfAlpha) {
  const Texture stone = random_texture("stone", 16, 1);
  const Texture leaf = random_texture("leaf", 32, 2, true);
  Grid grid;
  int x = 0;
  const auto put = [&](VoxelProperties type) { grid.set({2 * x++, 0, 0}, add(std::move(type))); };
  put({.name = "a", .faces = stone});
  put({.name = "b", .faces = VoxelFace{.texture = stone, .tint = {255, 0, 0, 255}}});
  put({.name = "c", .emission = 4.0F, .faces = VoxelFace{.texture = stone, .tint = {0, 99, 0, 255}}});
  for (const FaceAlpha alpha : {FaceAlpha::Cutout, FaceAlpha::Translucent}) {
    put({.name = "d", .visibility = Visibility::Transparent, .faces = VoxelFace{.texture = leaf, .alpha = alpha}});
  }
  add_grid(grid);
  const ParsedGlb glb = write_atlas();
  EXPECT_GT(expect_faces(glb, grid, kClamp), 0);
  ASSERT_EQ(glb.document["images"].size(), 1U);
  ASSERT_EQ(glb.document["materials"].size(), 4U);
  std::multiset<std::string> modes;
  for (const Json& material : glb.document["materials"]) {
    EXPECT_EQ(material["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
    EXPECT_FALSE(material["pbrMetallicRoughness"].contains("baseColorFactor")) << "tints are in the atlas";
    modes.insert(material.contains("emissiveTexture") ? "glows" : material.value("alphaMode", "OPAQUE"));
  }
  EXPECT_EQ(modes, (std::multiset<std::string>{"OPAQUE", "glows", "MASK", "BLEND"}));
}

// Halves an image by means of 2 x 2 texels, as clients do.
PngImage halved(const PngImage& image) {
  PngImage half{image.width / 2, image.height / 2, 4, {}};
  for (std::uint32_t y = 0; y < half.height; ++y) {
    for (std::uint32_t x = 0; x < half.width; ++x) {
      for (std::uint32_t channel = 0; channel < 4; ++channel) {
        const auto at = [&](std::uint32_t i, std::uint32_t j) {
          return image.pixels[4 * ((2 * y + j) * image.width + 2 * x + i) + channel];
        };
        half.pixels.push_back(static_cast<std::uint8_t>((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4));
      }
    }
  }
  return half;
}

// Each type has textures of one colour, so at its faces' corners all texels that a linear filter reads have it.
TEST_F(GltfTextureAtlas, KeepsTexturesApartInFiveMipmapLevels) {
  std::mt19937 random(4);
  Grid grid;
  for (int i = 0; i < 30; ++i) {
    const int size = 16 << (random() % 4);
    AlphaImage image{size, size, {}};
    const std::array<std::uint8_t, 4> colour = {static_cast<std::uint8_t>(random()),
                                                static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(8 * i),
                                                255};
    for (int k = 0; k < 4 * size * size; ++k) image.rgba.push_back(colour[static_cast<std::size_t>(k % 4)]);
    const VoxelFaces faces(Texture::from_image(std::to_string(i), image).value());
    grid.fill_box({{i % 6 * 3, 0, i / 6 * 4}, {i % 6 * 3 + 1, 2, i / 6 * 4 + 3}}, add({.name = "a", .faces = faces}));
  }
  add_grid(grid);
  const ParsedGlb glb = write_atlas();
  const Json& primitive = glb.document["meshes"][0]["primitives"][0];
  const auto positions = glb.vectors(primitive, "POSITION");
  const auto uv = glb.array<std::array<float, 2>>(primitive["attributes"]["TEXCOORD_0"].get<std::size_t>());
  PngImage level = glb.image(0);
  for (int number = 0; number <= 4; ++number, level = halved(level)) {
    const auto texel = [&](float share, std::uint32_t size, int next) {
      const int i = static_cast<int>(std::floor(share * static_cast<float>(size) - 0.5F)) + next;
      return static_cast<std::size_t>(std::clamp(i, 0, static_cast<int>(size) - 1));
    };
    for (std::size_t i = 0; i < uv.size(); ++i) {
      const IVec3 cell(IVec3(positions[i]) / IVec3(3, 1, 4) * IVec3(3, 1, 4));
      const Rgba8 expected = scene_.types[grid.get({cell.x, 0, cell.z})].colour;
      for (int k = 0; k < 4; ++k) {
        const std::size_t at = texel(uv[i][1], level.height, k / 2) * level.width + texel(uv[i][0], level.width, k % 2);
        const std::uint8_t* const pixel = level.pixels.data() + 4 * at;
        ASSERT_EQ((Rgba8{pixel[0], pixel[1], pixel[2]}), (Rgba8{expected.r, expected.g, expected.b}))
            << "level " << number << ", vertex " << i;
      }
    }
  }
}

TEST_F(GltfTextureAtlas, RefusesMergedFacesAndHugeImages) {
  const VoxelType stone = add({.name = "stone", .faces = random_texture("stone", 16, 1)});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {2, 1, 1}}, stone);
  add_grid(grid);
  const MeshFileOptions options{.textures_in = TexturesIn::Atlas};
  const auto merged = write_mesh(mesh_scene(scene_).value(), FileFormat::Glb, options);
  ASSERT_FALSE(merged);
  EXPECT_EQ(merged.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(to_string(merged.error()).find("faces of several voxels"), std::string::npos);
  const SceneMeshes split = mesh_scene(scene_, {.atlas = true}).value();
  EXPECT_EQ(split.stats.quads, 10);
  EXPECT_TRUE(split.atlas.rgb.empty());
  EXPECT_EQ(write_mesh(split, FileFormat::Ply, options).error().code, ErrorCode::Unsupported);
  // 250 tints of a large texture need more than 16,384 x 16,384 texels.
  const Texture large = random_texture("large", 1'024, 2);
  for (int i = 0; i < 250; ++i) {
    grid.set({i, 5, 0},
             add({.name = "a", .faces = VoxelFace{.texture = large, .tint = {static_cast<std::uint8_t>(i)}}}));
  }
  const VoxelRegistry types = scene_.types;
  scene_ = {};
  scene_.types = types;
  add_grid(grid);
  const auto huge = write_mesh(mesh_scene(scene_, {.atlas = true}).value(), FileFormat::Glb, options);
  ASSERT_FALSE(huge);
  EXPECT_EQ(huge.error().code, ErrorCode::LimitExceeded);
}

}  // namespace
}  // namespace quoin
