#include <cmath>
#include <numbers>
#include <string>

#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <quoin/io/mesh_file.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene_meshes.h>

#include "io/gltf/glb_for_tests.h"

namespace quoin {

namespace {

DVec3 forward_of(const nlohmann::json& node) {
  DQuat rotation(1.0, 0.0, 0.0, 0.0);
  if (node.contains("rotation")) {
    const auto& q = node["rotation"];
    rotation = DQuat(q[3].get<double>(), q[0].get<double>(), q[1].get<double>(), q[2].get<double>());
  }
  return rotation * DVec3(0.0, 0.0, -1.0);
}

SceneMeshes lit_meshes() {
  SceneMeshes meshes;
  Lamp point;
  point.name = "bulb";
  point.position = {1.0, 2.0, 3.0};
  point.colour = {0.5F, 0.25F, 0.0F};
  point.intensity = 8.0;
  point.range = 20.0;
  Lamp spot;
  spot.kind = Lamp::Kind::Spot;
  spot.direction = {0.0, -3.0, 0.0};
  spot.outer_angle_radians = 3.0;
  spot.inner_angle_radians = 0.25;
  Lamp dark;
  dark.intensity = 0.0;
  meshes.lamps = {point, spot, dark};
  meshes.cameras.push_back({"near", *look_at({5.0, 5.0, 5.0}, {5.0, 5.0, -10.0}, 0.75)});
  Camera flat = *look_at({0.0, 10.0, 0.0}, {10.0, 10.0, 0.0}, 1.0);
  flat.projection = Camera::Projection::Orthographic;
  flat.view_height = 12.0;
  meshes.cameras.push_back({"flat", flat});
  return meshes;
}

TEST(GltfLights, WritesLampsAndCamerasAsNodes) {
  const auto bytes = write_mesh(lit_meshes(), FileFormat::Glb);
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  const nlohmann::json document = parse_glb(*bytes).document;
  const auto& lights = document["extensions"]["KHR_lights_punctual"]["lights"];
  ASSERT_EQ(lights.size(), 2U) << "a dark lamp is left out";
  EXPECT_EQ(lights[0]["type"], "point");
  EXPECT_EQ(lights[0]["name"], "bulb");
  EXPECT_EQ(lights[0]["color"], nlohmann::json({1.0, 0.5, 0.0}));
  EXPECT_NEAR(lights[0]["intensity"].get<double>(), 4.0 * std::numbers::pi, 1e-9);
  EXPECT_EQ(lights[0]["range"], 20.0);
  EXPECT_FALSE(lights[1].contains("range"));
  EXPECT_NEAR(lights[1]["spot"]["outerConeAngle"].get<double>(), std::numbers::pi / 2.0, 1e-9);
  EXPECT_EQ(lights[1]["spot"]["innerConeAngle"], 0.25);
  EXPECT_EQ(document["extensionsUsed"], nlohmann::json({"KHR_lights_punctual"}));
  const auto& nodes = document["nodes"];
  ASSERT_EQ(nodes.size(), 4U);
  EXPECT_EQ(document["scenes"][0]["nodes"], nlohmann::json({0, 1, 2, 3}));
  EXPECT_EQ(nodes[0]["translation"], nlohmann::json({1.0, 2.0, 3.0}));
  EXPECT_EQ(nodes[0]["extensions"]["KHR_lights_punctual"]["light"], 0);
  EXPECT_LT(glm::length(forward_of(nodes[1]) - DVec3(0.0, -1.0, 0.0)), 1e-9);
  const auto& cameras = document["cameras"];
  EXPECT_EQ(cameras[0]["type"], "perspective");
  EXPECT_EQ(cameras[0]["perspective"]["yfov"], 0.75);
  EXPECT_EQ(cameras[1]["orthographic"]["ymag"], 6.0);
  EXPECT_EQ(nodes[2]["camera"], 0);
  EXPECT_EQ(nodes[2]["name"], "near");
  EXPECT_LT(glm::length(forward_of(nodes[2]) - DVec3(0.0, 0.0, -1.0)), 1e-9);
  EXPECT_LT(glm::length(forward_of(nodes[3]) - DVec3(1.0, 0.0, 0.0)), 1e-9);
}

TEST(GltfLights, ScalesAndTurnsLikeMeshes) {
  MeshFileOptions options;
  options.scale = 2.0;
  options.up = UpAxis::Z;
  const auto bytes = write_mesh(lit_meshes(), FileFormat::Glb, options);
  ASSERT_TRUE(bytes);
  const nlohmann::json document = parse_glb(*bytes).document;
  const auto& light = document["extensions"]["KHR_lights_punctual"]["lights"][0];
  EXPECT_EQ(document["nodes"][0]["translation"], nlohmann::json({2.0, -6.0, 4.0}));
  EXPECT_EQ(light["range"], 40.0);
  EXPECT_NEAR(light["intensity"].get<double>(), 16.0 * std::numbers::pi, 1e-9);
  EXPECT_LT(glm::length(forward_of(document["nodes"][1]) - DVec3(0.0, 0.0, -1.0)), 1e-9);
  EXPECT_EQ(document["cameras"][1]["orthographic"]["ymag"], 12.0);
}

}  // namespace

}  // namespace quoin
