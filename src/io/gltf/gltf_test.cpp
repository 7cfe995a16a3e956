#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <string>

#include "io/gltf/gltf_for_tests.h"
#include "io/gltf/gltf_layout.h"

namespace quoin {

namespace {

using Json = nlohmann::json;

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

/// The world corners of all triangles with their colour, as a set: the visible content of a file.
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

std::multiset<Corner> expected_corners(const Scene& scene, const Instance& instance, const MeshPart& part) {
  std::multiset<Corner> corners;
  for (const MeshView& surface : part.surfaces) {
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

TEST_F(Gltf, InstancesOfOneGridShareOneMesh) {
  const GridHandle grid = add_asymmetric_grid(scene_, "crane");
  place(scene_, grid, {0, 0, 0}, "first");
  const InstanceHandle second = place(scene_, grid, {10.5, -3, 1e6}, "second");
  scene_.edit(second).rotation = glm::angleAxis(glm::radians(90.0), DVec3(0, 1, 0));
  scene_.edit(second).voxel_size = 0.25;
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

TEST_F(Gltf, PlacesTurnedAndMirroredInstances) {
  const GridHandle grid = add_asymmetric_grid(scene_, "crane");
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-20.0, 20.0);
  for (int i = 0; i < 6; ++i) {
    Instance& instance = scene_.edit(place(scene_, grid, {number(random), number(random), number(random)}));
    instance.rotation = glm::normalize(DQuat(number(random), number(random), number(random), number(random)));
    instance.voxel_size = i < 2 ? 1.0 : 0.5 * i;
    instance.mirrored = i % 2 == 1;
  }
  const auto meshes = mesh_scene(scene_);
  ASSERT_TRUE(meshes);
  const ParsedGlb glb = write(*meshes);
  ASSERT_EQ(glb.document["meshes"].size(), 2U) << "one as it is, one reflected";
  expect_outward_windings(glb);
  std::size_t node = 0;
  for (const InstanceHandle handle : scene_.instances().handles()) {
    const Instance& instance = scene_.instances()[handle];
    EXPECT_EQ(world_corners(glb, glb.document["nodes"][node]), expected_corners(scene_, instance, meshes->parts[0]))
        << "instance " << node;
    ++node;
  }
  for (const Json& entry : glb.document["nodes"]) {
    if (entry.contains("scale")) {
      EXPECT_GT(entry["scale"][0].get<double>(), 0.0);
    }
  }
}

TEST_F(Gltf, KeepsHandednessOfAsymmetricModel) {
  const GridHandle grid = add_asymmetric_grid(scene_, "crane");
  place(scene_, grid, {0, 0, 0});
  Instance& mirrored = scene_.edit(place(scene_, grid, {0, 0, 0}));
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

TEST_F(Gltf, AlignsAndBoundsArrays) {
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

/// Returns a mesh of `vertices` vertices with enough triangles to use them all; one kind of voxel.
SceneMeshes mesh_of_size(std::size_t vertices) {
  SceneMeshes meshes;
  EXPECT_TRUE(meshes.types.add({}));
  BlockyTriangles surface;
  for (std::size_t i = 0; i < vertices; ++i) {
    surface.positions.emplace_back(static_cast<float>(i / 3), i % 3 == 1 ? 1.0F : 0.0F, i % 3 == 2 ? 1.0F : 0.0F);
    surface.directions.push_back(Direction::PosX);
    surface.occlusion.push_back(0);
    surface.types.push_back(1);
  }
  for (std::size_t i = 0; i + 2 < vertices; i += 3) {
    for (std::size_t corner = 0; corner < 3; ++corner)
      surface.indices.push_back(static_cast<std::uint32_t>(i + corner));
  }
  BlockyMesh mesh;
  mesh.surfaces[0] = std::move(surface);
  meshes.parts.push_back(mesh_part("big", std::move(mesh)));
  meshes.placements.emplace_back();
  return meshes;
}

TEST_F(Gltf, Uses16BitIndicesIfPossible) {
  const auto component = [&](std::size_t vertices) {
    const ParsedGlb glb = write(mesh_of_size(vertices));
    const Json& primitive = glb.document["meshes"][0]["primitives"][0];
    EXPECT_EQ(glb.indices(primitive).back(), vertices - 1);
    return glb.document["accessors"][primitive["indices"].get<std::size_t>()]["componentType"].get<int>();
  };
  EXPECT_EQ(component(3), 5123);
  EXPECT_EQ(component(65'532), 5123);
  EXPECT_EQ(component(65'535), 5125) << "65,535 restarts strips, so it may be no index";
  EXPECT_EQ(component(65'538), 5125);
}

TEST_F(Gltf, WritesValidFilesForEmptyScenesAndGrids) {
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

TEST_F(Gltf, LeavesOutHiddenInstancesByDefault) {
  const GridHandle grid = add_asymmetric_grid(scene_, "crane");
  const GridHandle other = add_asymmetric_grid(scene_, "ghost");
  place(scene_, grid, {0, 0, 0}, "seen");
  scene_.edit(place(scene_, other, {0, 0, 0}, "unseen")).visible = false;
  EXPECT_EQ(write().document["nodes"].size(), 1U);
  const auto all = mesh_scene(scene_, {.instances = InstanceFilter::All});
  ASSERT_TRUE(all);
  EXPECT_EQ(write(*all).document["nodes"].size(), 2U);
  EXPECT_EQ(all->parts.size(), 2U);
}

/// Returns a node's matrix, combined by glTF's rules.
glm::dmat4 matrix_of(const nlohmann::json& node) {
  glm::dmat4 matrix(1.0);
  if (node.contains("rotation")) {
    const auto& q = node["rotation"];
    matrix = glm::mat4_cast(DQuat(q[3], q[0], q[1], q[2]));
  }
  if (node.contains("scale")) {
    for (int axis = 0; axis < 3; ++axis) matrix[axis] *= node["scale"][static_cast<std::size_t>(axis)].get<double>();
  }
  if (node.contains("translation")) {
    for (int axis = 0; axis < 3; ++axis) matrix[3][axis] = node["translation"][static_cast<std::size_t>(axis)];
  }
  return matrix;
}

TEST_F(Gltf, WritesGroupsAsNodesWithoutMovingInstances) {
  const double half = std::sqrt(0.5);
  const GridHandle grid = add_asymmetric_grid(scene_, "crane");
  const LayerHandle layer = scene_.add_layer({"harbour"});
  const GroupHandle ship = scene_.add_group({.name = "ship", .position = {10, 0, 0}, .rotation = {half, 0, half, 0}});
  const GroupHandle deck = scene_.add_group({.name = "deck", .parent = ship, .layer = layer, .position = {10, 4, 0}});
  scene_.add_group({.name = "nothing below", .parent = ship});
  std::vector<InstanceHandle> placed = {place(scene_, grid, {1, 2, 3}, "on deck"),
                                        place(scene_, grid, {9, 9, 9}, "free")};
  scene_.edit(placed[0]).group = deck;
  scene_.edit(placed[0]).layer = layer;
  scene_.edit(placed[0]).rotation = {half, half, 0, 0};
  scene_.edit(placed[0]).mirrored = true;
  const nlohmann::json document = write().document;
  const auto& nodes = document["nodes"];
  ASSERT_EQ(nodes.size(), 4U);
  EXPECT_EQ(document["scenes"][0]["nodes"], nlohmann::json({1, 2}));
  EXPECT_EQ(nodes[2]["name"], "ship");
  EXPECT_EQ(nodes[2]["children"], nlohmann::json({3}));
  EXPECT_EQ(nodes[3]["name"], "deck");
  EXPECT_EQ(nodes[3]["children"], nlohmann::json({0}));
  EXPECT_EQ(nodes[3]["extras"]["layer"], "harbour");
  EXPECT_EQ(nodes[0]["extras"]["layer"], "harbour");
  EXPECT_FALSE(nodes[1].contains("extras"));
  const glm::dmat4 whole = matrix_of(nodes[2]) * matrix_of(nodes[3]) * matrix_of(nodes[0]);
  Instance alone = scene_.instances()[placed[0]];
  alone.mirrored = false;  // the mirror is baked into the mesh
  for (int axis = 0; axis < 3; ++axis) {
    DVec3 unit(0.0);
    unit[axis] = 1.0;
    EXPECT_LT(glm::length(DVec3(whole[axis]) - world_from_grid_direction(alone, unit)), 1e-12);
  }
  EXPECT_LT(glm::length(DVec3(whole[3]) - alone.position), 1e-12);
}

TEST_F(Gltf, RepairsInvalidUtf8Names) {
  SceneGrid grid;
  grid.name = "caf\xE9";
  grid.grid.set({0, 0, 0}, add_type(scene_, "stone", {90, 90, 90, 255}));
  place(scene_, scene_.add_grid(std::move(grid)), {0, 0, 0});
  EXPECT_EQ(write().document["meshes"][0]["name"], "caf\xEF\xBF\xBD");
}

TEST_F(Gltf, RefusesFilesAbove4Gib) {
  constexpr std::uint64_t limit = std::numeric_limits<std::uint32_t>::max();
  EXPECT_EQ(glb_file_bytes(100, 0).value_or(0), 120U);
  EXPECT_EQ(glb_file_bytes(100, limit - 128).value_or(0), limit);
  const auto refused = glb_file_bytes(100, limit - 127);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
}

TEST_F(Gltf, WritesSameBytesAtAnyThreadCount) {
  std::mt19937 random(11);
  for (int g = 0; g < 5; ++g) {
    const GridHandle handle = add_asymmetric_grid(scene_, "grid " + std::to_string(g));
    Grid& grid = scene_.edit(handle).grid;
    for (int i = 0; i < 2000; ++i) {
      grid.set({static_cast<int>(random() % 100), static_cast<int>(random() % 100), static_cast<int>(random() % 300)},
               1);
    }
    place(scene_, handle, {0, 0, 400.0 * g});
  }
  const auto file = [&](unsigned threads) {
    const auto meshes = mesh_scene(scene_, {}, Threads{threads});
    const auto path = folder_.file("threads.glb");
    EXPECT_TRUE(write_mesh(*meshes, path));
    return *read_file(path);
  };
  const auto one = file(1);
  EXPECT_EQ(one, file(2));
  EXPECT_EQ(one, file(8));
}

TEST_F(Gltf, TextFormMatchesBinaryForm) {
  place(scene_, add_asymmetric_grid(scene_, "crane"), {0, 0, 0});
  const auto meshes = mesh_scene(scene_);
  const ParsedGlb glb = write(*meshes);
  const auto path = folder_.file("a crane.gltf");
  const auto bytes = write_mesh(*meshes, path);
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

TEST_F(Gltf, FailuresLeaveNoFile) {
  place(scene_, add_asymmetric_grid(scene_, "crane"), {0, 0, 0});
  const auto meshes = mesh_scene(scene_);
  const auto missing = write_mesh(*meshes, folder_.file("no such folder/out.glb"));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::CannotWrite);
  const auto stopped = write_mesh(*meshes, folder_.file("out.glb"), {}, [](double) { return false; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
  const auto pair = write_mesh(*meshes, folder_.file("out.gltf"), {}, [](double) { return false; });
  EXPECT_FALSE(pair);
  EXPECT_EQ(folder_.count(), 0U);
}

}  // namespace

}  // namespace quoin
