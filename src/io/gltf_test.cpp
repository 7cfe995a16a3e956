#include <quoin/io/gltf.h>

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <set>
#include <string>

#include "io/glb_for_tests.h"

namespace quoin {

namespace {

using Json = nlohmann::json;

VoxelType add_type(Scene& scene, const std::string& name, Rgba8 colour) {
  VoxelProperties properties;
  properties.name = name;
  properties.colour = colour;
  return *scene.types.add(properties);
}

/// An L with an arm to +x and a red tip, so that no reflection or turn looks the same.
GridHandle add_asymmetric_grid(Scene& scene, const std::string& name) {
  const VoxelType grey = add_type(scene, "grey", {120, 120, 120, 255});
  const VoxelType red = add_type(scene, "red", {200, 10, 20, 255});
  SceneGrid grid;
  grid.name = name;
  grid.grid.fill_box({0, 0, 0}, {0, 4, 0}, grey);
  grid.grid.fill_box({1, 0, 0}, {3, 0, 0}, grey);
  grid.grid.set({3, 1, 0}, red);
  grid.grid.set({0, 1, 1}, grey);
  grid.pivot = {2.0, 2.5, 0.5};
  return scene.add_grid(std::move(grid));
}

InstanceHandle place(Scene& scene, GridHandle grid, DVec3 position, const std::string& name = "") {
  Instance instance;
  instance.name = name;
  instance.grid = grid;
  instance.position = position;
  return scene.add_instance(instance);
}

class Gltf : public ::testing::Test {
 protected:
  ParsedGlb write(const BlockyMeshOptions& options = {}) {
    const auto meshes = mesh_scene(scene_, options);
    EXPECT_TRUE(meshes.has_value());
    return write(*meshes);
  }

  ParsedGlb write(const SceneMeshes& meshes) {
    const auto path = folder_.file("out.glb");
    const auto bytes = write_glb(scene_, meshes, path);
    EXPECT_TRUE(bytes.has_value()) << to_string(bytes.error());
    const auto file = read_file(path);
    EXPECT_TRUE(file && file->size() == *bytes);
    return file ? parse_glb(*file) : ParsedGlb{};
  }

  Scene scene_;
  TestFolder folder_{std::string("gltf_") + ::testing::UnitTest::GetInstance()->current_test_info()->name()};
};

DVec3 vector_from(const Json& node, const char* key, DVec3 otherwise) {
  return node.contains(key) ? DVec3(node[key][0], node[key][1], node[key][2]) : otherwise;
}

DVec3 world_from_node(const Json& node, const Vec3& point) {
  DQuat rotation(1, 0, 0, 0);
  if (node.contains("rotation")) {
    const Json& r = node["rotation"];
    rotation = DQuat(r[3], r[0], r[1], r[2]);
  }
  const DVec3 scaled = DVec3(point) * vector_from(node, "scale", DVec3(1.0));
  return vector_from(node, "translation", DVec3(0.0)) + rotation * scaled;
}

/// Corners of all triangles in the world, with their colour: what a picture of the file shows, as a set.
using Corner = std::array<long, 6>;
std::multiset<Corner> world_corners(const ParsedGlb& glb, const Json& node) {
  std::multiset<Corner> corners;
  const PngImage palette = glb.image(0);
  for (const Json& primitive : glb.document["meshes"][node["mesh"].get<std::size_t>()]["primitives"]) {
    const auto positions = glb.vectors(primitive, "POSITION");
    for (const std::uint32_t index : glb.indices(primitive)) {
      const DVec3 p = world_from_node(node, positions[index]);
      const auto texel = glb.texel(palette, primitive, index);
      corners.insert(
          {std::lround(p.x * 1000), std::lround(p.y * 1000), std::lround(p.z * 1000), texel[0], texel[1], texel[2]});
    }
  }
  return corners;
}

std::multiset<Corner> expected_corners(const Scene& scene, const Instance& instance, const BlockyMesh& mesh) {
  std::multiset<Corner> corners;
  for (const BlockyTriangles& surface : mesh.surfaces) {
    for (const std::uint32_t index : surface.indices) {
      const DVec3 p = world_from_grid(instance, scene.grids()[instance.grid], DVec3(surface.positions[index]));
      const Rgba8 colour = scene.types[surface.types[index]].colour;
      corners.insert(
          {std::lround(p.x * 1000), std::lround(p.y * 1000), std::lround(p.z * 1000), colour.r, colour.g, colour.b});
    }
  }
  return corners;
}

void expect_outward_windings(const ParsedGlb& glb) {
  for (const Json& mesh : glb.document["meshes"]) {
    for (const Json& primitive : mesh["primitives"]) {
      const auto positions = glb.vectors(primitive, "POSITION");
      const auto normals = glb.vectors(primitive, "NORMAL");
      const auto indices = glb.indices(primitive);
      ASSERT_EQ(indices.size() % 3, 0U);
      for (std::size_t i = 0; i < indices.size(); i += 3) {
        const Vec3 a = positions[indices[i]];
        const Vec3 across = glm::cross(positions[indices[i + 1]] - a, positions[indices[i + 2]] - a);
        ASSERT_GT(glm::length(across), 0.0F);
        ASSERT_NEAR(glm::dot(glm::normalize(across), normals[indices[i]]), 1.0F, 1e-5F) << "triangle " << i / 3;
      }
    }
  }
}

TEST_F(Gltf, instances_of_one_grid_share_its_mesh_and_keep_names_and_transforms) {
  const GridHandle grid = add_asymmetric_grid(scene_, "crane");
  place(scene_, grid, {0, 0, 0}, "first");
  const InstanceHandle second = place(scene_, grid, {10.5, -3, 1e6}, "second");
  scene_.instances()[second].rotation = glm::angleAxis(glm::radians(90.0), DVec3(0, 1, 0));
  scene_.instances()[second].voxel_size = 0.25;
  const ParsedGlb glb = write();
  ASSERT_EQ(glb.document["meshes"].size(), 1U);
  ASSERT_EQ(glb.document["nodes"].size(), 2U);
  EXPECT_EQ(glb.document["meshes"][0]["name"], "crane");
  const Json& a = glb.document["nodes"][0];
  const Json& b = glb.document["nodes"][1];
  EXPECT_EQ(a, Json({{"name", "first"}, {"mesh", 0}}));
  EXPECT_EQ(b["mesh"], 0);
  EXPECT_EQ(b["name"], "second");
  EXPECT_EQ(b["translation"], Json({10.5, -3.0, 1e6}));
  EXPECT_EQ(b["scale"], Json({0.25, 0.25, 0.25}));
  EXPECT_NEAR(b["rotation"][1].get<double>(), std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(b["rotation"][3].get<double>(), std::sqrt(0.5), 1e-12);
  EXPECT_EQ(glb.document["asset"]["version"], "2.0");
  EXPECT_TRUE(glb.document["asset"]["generator"].get<std::string>().starts_with("Quoin "));
}

TEST_F(Gltf, every_instance_lies_where_the_scene_has_it_mirrored_ones_too) {
  const GridHandle grid = add_asymmetric_grid(scene_, "crane");
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-20.0, 20.0);
  for (int i = 0; i < 6; ++i) {
    Instance& instance = scene_.instances()[place(scene_, grid, {number(random), number(random), number(random)})];
    instance.rotation = glm::normalize(DQuat(number(random), number(random), number(random), number(random)));
    instance.voxel_size = i < 2 ? 1.0 : 0.5 * i;
    instance.mirrored = i % 2 == 1;
  }
  const auto meshes = mesh_scene(scene_, {});
  ASSERT_TRUE(meshes);
  const ParsedGlb glb = write(*meshes);
  ASSERT_EQ(glb.document["meshes"].size(), 2U) << "one as it is, one reflected";
  expect_outward_windings(glb);
  std::size_t node = 0;
  for (const InstanceHandle handle : scene_.instances().handles()) {
    const Instance& instance = scene_.instances()[handle];
    EXPECT_EQ(world_corners(glb, glb.document["nodes"][node]), expected_corners(scene_, instance, *meshes->find(grid)))
        << "instance " << node;
    ++node;
  }
  for (const Json& entry : glb.document["nodes"]) {
    if (entry.contains("scale")) {
      EXPECT_GT(entry["scale"][0].get<double>(), 0.0);
    }
  }
}

TEST_F(Gltf, an_asymmetric_model_is_pinned) {
  const GridHandle grid = add_asymmetric_grid(scene_, "crane");
  place(scene_, grid, {0, 0, 0});
  Instance& mirrored = scene_.instances()[place(scene_, grid, {0, 0, 0})];
  mirrored.mirrored = true;
  const ParsedGlb glb = write();
  // The red tip fills (3..4, 1..2, 0..1); the pivot is at (2, 2.5, 0.5).
  const auto red_box = [&](const Json& node) {
    DBox box;
    for (const Corner& corner : world_corners(glb, node)) {
      if (corner[3] == 200) box.extend(DVec3(corner[0], corner[1], corner[2]) / 1000.0);
    }
    return box;
  };
  const DBox straight = red_box(glb.document["nodes"][0]);
  EXPECT_EQ(straight.min, DVec3(1, -1.5, -0.5));
  EXPECT_EQ(straight.max, DVec3(2, -0.5, 0.5));
  const DBox reflected = red_box(glb.document["nodes"][1]);
  EXPECT_EQ(reflected.min, DVec3(-2, -1.5, -0.5));
  EXPECT_EQ(reflected.max, DVec3(-1, -0.5, 0.5));
}

TEST_F(Gltf, arrays_are_aligned_bounded_and_inside_the_buffer) {
  place(scene_, add_asymmetric_grid(scene_, "crane"), {0, 0, 0});
  const ParsedGlb glb = write();
  EXPECT_EQ(glb.document["buffers"][0]["byteLength"], glb.binary.size());
  EXPECT_EQ(glb.binary.size() % 4, 0U);
  for (const Json& view : glb.document["bufferViews"]) {
    EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0U);
    EXPECT_LE(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>(), glb.binary.size());
  }
  const Json& primitive = glb.document["meshes"][0]["primitives"][0];
  const Json& accessor = glb.document["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
  EXPECT_EQ(accessor["min"], Json({-2.0, -2.5, -0.5}));
  EXPECT_EQ(accessor["max"], Json({2.0, 2.5, 1.5}));
}

TEST_F(Gltf, occlusion_is_linear_grey_with_full_alpha_and_can_be_left_out) {
  place(scene_, add_asymmetric_grid(scene_, "crane"), {0, 0, 0});
  const auto meshes = mesh_scene(scene_, {});
  const ParsedGlb glb = write(*meshes);
  const Json& primitive = glb.document["meshes"][0]["primitives"][0];
  const std::size_t accessor = primitive["attributes"]["COLOR_0"];
  EXPECT_EQ(glb.document["accessors"][accessor]["componentType"], 5121);
  EXPECT_EQ(glb.document["accessors"][accessor]["type"], "VEC4");
  EXPECT_EQ(glb.document["accessors"][accessor]["normalized"], true);
  const auto colours = glb.array<std::array<std::uint8_t, 4>>(accessor);
  const auto& levels = meshes->grids[0].mesh.surfaces[0].levels;
  ASSERT_EQ(colours.size(), levels.size());
  constexpr std::array<std::uint8_t, 4> grey_of_level = {255, 191, 128, 64};
  std::set<std::uint8_t> seen;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const std::uint8_t grey = grey_of_level[levels[i]];
    EXPECT_EQ(colours[i], (std::array<std::uint8_t, 4>{grey, grey, grey, 255}));
    seen.insert(grey);
  }
  EXPECT_GT(seen.size(), 1U) << "the model has inner corners";
  const ParsedGlb plain = write(BlockyMeshOptions{.merge = true, .occlusion = false, .watertight = false});
  EXPECT_FALSE(plain.document["meshes"][0]["primitives"][0]["attributes"].contains("COLOR_0"));
}

TEST_F(Gltf, every_type_has_its_texel) {
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
  const auto meshes = mesh_scene(scene_, {});
  const ParsedGlb glb = write(*meshes);
  const PngImage palette = glb.image(0);
  const PngImage surface = glb.image(1);
  EXPECT_EQ(palette.width, 256U);
  EXPECT_EQ(palette.height, 4U) << "601 types need 3 rows, and textures keep to powers of two";
  const Json& primitive = glb.document["meshes"][0]["primitives"][0];
  const auto& types = meshes->grids[0].mesh.surfaces[0].types;
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

/// A mesh of `vertices` vertices, made of as many triangles as hold them all; one kind of voxel.
SceneMeshes mesh_of_size(Scene& scene, std::size_t vertices) {
  SceneMeshes meshes;
  const GridHandle grid = add_asymmetric_grid(scene, "big");
  place(scene, grid, {0, 0, 0});
  BlockyTriangles surface;
  for (std::size_t i = 0; i < vertices; ++i) {
    surface.positions.emplace_back(static_cast<float>(i / 3), i % 3 == 1 ? 1.0F : 0.0F, i % 3 == 2 ? 1.0F : 0.0F);
    surface.directions.push_back(Direction::PosX);
    surface.levels.push_back(0);
    surface.types.push_back(1);
  }
  for (std::size_t i = 0; i + 2 < vertices; i += 3) {
    for (std::size_t corner = 0; corner < 3; ++corner)
      surface.indices.push_back(static_cast<std::uint32_t>(i + corner));
  }
  BlockyMesh mesh;
  mesh.surfaces[0] = std::move(surface);
  meshes.grids.push_back({grid, std::move(mesh)});
  return meshes;
}

TEST_F(Gltf, indices_take_16_bits_where_they_fit) {
  const auto component = [&](std::size_t vertices) {
    scene_ = Scene();
    const ParsedGlb glb = write(mesh_of_size(scene_, vertices));
    const Json& primitive = glb.document["meshes"][0]["primitives"][0];
    EXPECT_EQ(glb.indices(primitive).back(), vertices - 1);
    return glb.document["accessors"][primitive["indices"].get<std::size_t>()]["componentType"].get<int>();
  };
  EXPECT_EQ(component(3), 5123);
  EXPECT_EQ(component(65'532), 5123);
  EXPECT_EQ(component(65'535), 5125) << "65,535 restarts strips, so it may be no index";
  EXPECT_EQ(component(65'538), 5125);
}

TEST_F(Gltf, transparent_types_blend_with_alpha_in_the_palette) {
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
  EXPECT_EQ(glb.texel(palette, primitives[0], 0), (std::array<int, 4>{90, 90, 90, 255}))
      << "opaque whatever alpha says";
  EXPECT_EQ(glb.texel(palette, primitives[1], 0), (std::array<int, 4>{10, 200, 220, 90}));
}

double linear(int srgb) {
  const double value = srgb / 255.0;
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

TEST_F(Gltf, emission_comes_out_right_in_linear_light_whatever_the_strengths) {
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
  std::size_t found = 0;
  for (const Json& primitive : glb.document["meshes"][0]["primitives"]) {
    const Json& material = glb.document["materials"][primitive["material"].get<std::size_t>()];
    if (!material.contains("emissiveTexture")) continue;
    EXPECT_EQ(material["emissiveTexture"]["index"], 2);
    const double factor = material["emissiveFactor"][0].get<double>() *
                          material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"].get<double>();
    const auto count = glb.vectors(primitive, "POSITION").size();
    for (std::size_t vertex = 0; vertex < count; vertex += 24) {
      const auto base = glb.texel(glb.image(0), primitive, vertex);
      const auto texel = glb.texel(glb.image(2), primitive, vertex);
      const double expected = strengths[static_cast<std::size_t>(base[2] - 40)];
      EXPECT_EQ(base[0], 250) << "the base colour is kept";
      EXPECT_NEAR(factor * linear(texel[0]) / linear(base[0]), expected, expected * 0.01);
      ++found;
    }
  }
  EXPECT_EQ(found, strengths.size());
}

TEST_F(Gltf, one_strength_keeps_the_palette_colour_in_the_emissive_texture) {
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

TEST_F(Gltf, an_empty_scene_and_an_empty_grid_are_valid_files) {
  const ParsedGlb nothing = write();
  EXPECT_EQ(nothing.document["scenes"], Json::parse("[{}]"));
  EXPECT_TRUE(nothing.binary.empty());
  SceneGrid grid;
  grid.name = "void";
  place(scene_, scene_.add_grid(std::move(grid)), {1, 2, 3}, "nowhere");
  const ParsedGlb glb = write();
  ASSERT_EQ(glb.document["nodes"].size(), 1U);
  EXPECT_EQ(glb.document["nodes"][0]["name"], "nowhere");
  EXPECT_FALSE(glb.document["nodes"][0].contains("mesh"));
  EXPECT_FALSE(glb.document.contains("meshes"));
  EXPECT_FALSE(glb.document.contains("buffers"));
}

TEST_F(Gltf, hidden_instances_are_left_out_unless_asked_for) {
  const GridHandle grid = add_asymmetric_grid(scene_, "crane");
  const GridHandle other = add_asymmetric_grid(scene_, "ghost");
  place(scene_, grid, {0, 0, 0}, "seen");
  scene_.instances()[place(scene_, other, {0, 0, 0}, "unseen")].visible = false;
  EXPECT_EQ(write().document["nodes"].size(), 1U);
  const auto all = mesh_scene(scene_, {}, true);
  ASSERT_TRUE(all);
  EXPECT_EQ(write(*all).document["nodes"].size(), 2U);
  EXPECT_EQ(all->grids.size(), 2U);
}

TEST_F(Gltf, names_that_are_no_utf8_are_repaired) {
  SceneGrid grid;
  grid.name = "caf\xE9";
  grid.grid.set({0, 0, 0}, add_type(scene_, "stone", {90, 90, 90, 255}));
  place(scene_, scene_.add_grid(std::move(grid)), {0, 0, 0});
  EXPECT_EQ(write().document["meshes"][0]["name"], "caf\xEF\xBF\xBD");
}

TEST_F(Gltf, the_same_bytes_at_any_thread_count) {
  std::mt19937 random(11);
  for (int g = 0; g < 5; ++g) {
    const GridHandle handle = add_asymmetric_grid(scene_, "grid " + std::to_string(g));
    Grid& grid = scene_.grids()[handle].grid;
    for (int i = 0; i < 2000; ++i) {
      grid.set({static_cast<int>(random() % 100), static_cast<int>(random() % 100), static_cast<int>(random() % 300)},
               1);
    }
    place(scene_, handle, {0, 0, 400.0 * g});
  }
  const auto file = [&](unsigned threads) {
    const auto meshes = mesh_scene(scene_, {}, false, Threads{threads});
    const auto path = folder_.file("threads.glb");
    EXPECT_TRUE(write_glb(scene_, *meshes, path));
    return *read_file(path);
  };
  const auto one = file(1);
  EXPECT_EQ(one, file(2));
  EXPECT_EQ(one, file(8));
}

TEST_F(Gltf, text_form_holds_the_same_content) {
  place(scene_, add_asymmetric_grid(scene_, "crane"), {0, 0, 0});
  const auto meshes = mesh_scene(scene_, {});
  const ParsedGlb glb = write(*meshes);
  const auto path = folder_.file("a crane.gltf");
  const auto bytes = write_gltf(scene_, *meshes, path);
  ASSERT_TRUE(bytes);
  const auto text = *read_file(path);
  Json document =
      Json::parse(reinterpret_cast<const char*>(text.data()), reinterpret_cast<const char*>(text.data()) + text.size());
  EXPECT_EQ(document["buffers"][0]["uri"], "a%20crane.bin");
  document["buffers"][0].erase("uri");
  EXPECT_EQ(document, glb.document);
  const auto buffer = *read_file(folder_.file("a crane.bin"));
  EXPECT_EQ(buffer, glb.binary);
  EXPECT_EQ(*bytes, text.size() + buffer.size());
}

TEST_F(Gltf, failures_leave_no_file) {
  place(scene_, add_asymmetric_grid(scene_, "crane"), {0, 0, 0});
  const auto meshes = mesh_scene(scene_, {});
  const auto missing = write_glb(scene_, *meshes, folder_.file("no such folder/out.glb"));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::CannotWrite);
  const auto stopped = write_glb(scene_, *meshes, folder_.file("out.glb"), [](double) { return false; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
  const auto pair = write_gltf(scene_, *meshes, folder_.file("out.gltf"), [](double) { return false; });
  EXPECT_FALSE(pair);
  scene_.instances()[scene_.instances().handles()[0]].position.x = std::numeric_limits<double>::quiet_NaN();
  const auto nowhere = write_glb(scene_, *meshes, folder_.file("out.glb"));
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(folder_.count(), 0U);
}

}  // namespace

}  // namespace quoin
