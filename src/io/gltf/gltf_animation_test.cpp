#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>
#include <string>

#include <quoin/scene/scene_animation.h>

#include "core/death_for_tests.h"
#include "io/gltf/gltf_for_tests.h"
#include "io/vox/vox_for_tests.h"

namespace quoin {
namespace {

using Json = nlohmann::json;

/// A node's state at a time, by the specification: each value applies from its time onwards.
struct Moment {
  DVec3 translation{0.0};
  DQuat rotation{1.0, 0.0, 0.0, 0.0};
  DVec3 scale{1.0};
};

DVec3 vector_of(const Json& json) {
  return {json[0], json[1], json[2]};
}

Moment node_at(const ParsedGlb& glb, std::size_t node, double seconds) {
  const Json& entry = glb.document["nodes"][node];
  Moment moment;
  if (entry.contains("translation")) moment.translation = vector_of(entry["translation"]);
  if (entry.contains("scale")) moment.scale = vector_of(entry["scale"]);
  if (entry.contains("rotation")) {
    const Json& q = entry["rotation"];
    moment.rotation = DQuat(q[3], q[0], q[1], q[2]);
  }
  if (!glb.document.contains("animations")) return moment;
  const Json& animation = glb.document["animations"][0];
  for (const Json& channel : animation["channels"]) {
    if (channel["target"]["node"] != node) continue;
    const Json& sampler = animation["samplers"][channel["sampler"].get<std::size_t>()];
    EXPECT_EQ(sampler["interpolation"], "STEP");
    const auto times = glb.array<float>(sampler["input"].get<std::size_t>());
    std::size_t last = 0;
    for (std::size_t i = 0; i < times.size(); ++i) {
      if (static_cast<double>(times[i]) <= seconds) last = i;
    }
    const std::string path = channel["target"]["path"];
    const auto output = sampler["output"].get<std::size_t>();
    if (path == "rotation") {
      const auto q = glb.array<std::array<float, 4>>(output)[last];
      moment.rotation = DQuat(q[3], q[0], q[1], q[2]);
    } else {
      const DVec3 value(glb.array<Vec3>(output)[last]);
      (path == "scale" ? moment.scale : moment.translation) = value;
    }
  }
  return moment;
}

class GltfAnimation : public ::testing::Test {
 protected:
  /// Reads the frames of a .vox file into an animation.
  static SceneAnimation animation_of(const std::vector<std::byte>& file) {
    SceneAnimation animation;
    const auto first = read_vox(file).value();
    for (int frame = 0; frame <= first.last_frame; ++frame) {
      LoadOptions options;
      options.frame = frame;
      EXPECT_TRUE(animation.add(read_vox(file, options).value().scene).has_value());
    }
    return animation;
  }
  static ParsedGlb written(const SceneAnimation& animation, double frames_per_second,
                           const MeshFileOptions& options = {}) {
    auto meshes = mesh_scene(animation.scene()).value();
    animation.animate(meshes, frames_per_second);
    return parse_glb(write_mesh(meshes, FileFormat::Glb, options).value());
  }
};

/// Returns a walker of two models, a bird that flies and turns, and a stone, in a group.
std::vector<std::byte> film() {
  vox_test::FileBuilder file;
  file.model(2, 2, 3, {{0, 0, 0, 1}, {1, 1, 2, 1}}).model(2, 2, 2, {{0, 0, 0, 2}, {1, 1, 1, 2}});
  file.model(1, 1, 4, {{0, 0, 0, 3}}).model(5, 5, 1, {{0, 0, 0, 4}, {4, 4, 0, 4}});
  file.transform(0, 1, {{}}, {}, -1).group(1, {2, 4, 6});
  file.transform(2, 3, {{{"_t", "10 0 0"}}}, {{"_name", "walker"}}, 0);
  file.shape(3, {{0, {{"_f", "0"}}}, {1, {{"_f", "2"}}}, {0, {{"_f", "5"}}}});
  file.transform(4, 5, {{{"_t", "0 0 9"}, {"_f", "0"}}, {{"_t", "3 0 9"}, {"_r", "17"}, {"_f", "3"}}},
                 {{"_name", "bird"}}, 0);
  file.shape(5, 2);
  file.transform(6, 7, {{{"_t", "0 7 0"}}}, {{"_name", "yard"}}, 0).group(7, {8});
  file.transform(8, 9, {{}}, {{"_name", "stone"}}, 0).shape(9, 3);
  return file.file();
}

std::optional<std::size_t> node_named(const Json& document, const std::string& name, std::size_t which = 0) {
  for (std::size_t i = 0; i < document["nodes"].size(); ++i) {
    const Json& node = document["nodes"][i];
    if (node.value("name", "") == name && which-- == 0) return i;
  }
  return std::nullopt;
}

TEST_F(GltfAnimation, AnimatesVisibilityAndSkipsStaticNodes) {
  const SceneAnimation animation = animation_of(film());
  EXPECT_EQ(animation.frame_count(), 6U);
  const ParsedGlb glb = written(animation, 4.0);
  const std::size_t first = node_named(glb.document, "walker").value();
  const std::size_t second = node_named(glb.document, "walker", 1).value();
  for (int frame = 0; frame < 6; ++frame) {
    const double seconds = 0.25 * frame + 0.1;
    const bool is_second = frame >= 2 && frame < 5;
    EXPECT_EQ(node_at(glb, first, seconds).scale, DVec3(is_second ? 0.0 : 1.0)) << frame;
    EXPECT_EQ(node_at(glb, second, seconds).scale, DVec3(is_second ? 1.0 : 0.0)) << frame;
  }
  EXPECT_EQ(glb.document["nodes"][second]["scale"], Json({0.0, 0.0, 0.0})) << "hidden where nothing plays";
  const std::size_t stone = node_named(glb.document, "stone").value();
  for (const Json& channel : glb.document["animations"][0]["channels"]) EXPECT_NE(channel["target"]["node"], stone);
  const Json& animated = glb.document["animations"][0];
  EXPECT_EQ(animated["name"], "frames");
  const std::size_t times = animated["samplers"][0]["input"];
  EXPECT_EQ(glb.document["accessors"][times]["min"], Json({0.0}));
  EXPECT_EQ(glb.document["accessors"][times]["max"], Json({1.5})) << "the last frame is as long as the others";
}

std::size_t triangles_of(const ParsedGlb& glb, const Json& mesh) {
  std::size_t triangles = 0;
  for (const Json& primitive : mesh["primitives"]) triangles += glb.indices(primitive).size() / 3;
  return triangles;
}
std::size_t mesh_triangles(const Scene& scene, GridHandle grid) {
  const auto mesh = build_blocky_mesh(scene.grids()[grid].grid, scene.types, {});
  return static_cast<std::size_t>(mesh->triangle_count());
}

/// Expects the nodes of a file to match the placement in each frame's own scene.
void expect_same_places(const std::vector<std::byte>& file, const SceneAnimation& animation, const ParsedGlb& glb) {
  for (int frame = 0; frame < static_cast<int>(animation.frame_count()); ++frame) {
    LoadOptions options;
    options.frame = frame;
    const Scene scene = read_vox(file, options).value().scene;
    for (const InstanceHandle handle : scene.instances().handles()) {
      const Instance& instance = scene.instances()[handle];
      const double seconds = 0.1 * frame + 0.05;
      int shown = 0;
      for (std::size_t which = 0; which < 4; ++which) {
        const auto node = node_named(glb.document, instance.name, which);
        if (!node || !glb.document["nodes"][*node].contains("mesh")) continue;
        const Moment moment = node_at(glb, *node, seconds);
        if (moment.scale == DVec3(0.0)) continue;
        ++shown;
        EXPECT_LT(glm::length(moment.translation - instance.position), 1e-4) << instance.name << frame;
        const std::size_t mesh = glb.document["nodes"][*node]["mesh"];
        const Json& shape = glb.document["meshes"][mesh];
        EXPECT_EQ(shape.value("name", std::string()).ends_with(" (mirrored)"), instance.mirrored);
        EXPECT_EQ(triangles_of(glb, shape), mesh_triangles(scene, instance.grid)) << "the model of this frame";
        EXPECT_NEAR(std::abs(glm::dot(moment.rotation, glm::normalize(instance.rotation))), 1.0, 1e-6);
      }
      EXPECT_EQ(shown, 1) << instance.name << " in frame " << frame;
    }
  }
}

TEST_F(GltfAnimation, MatchesFileAtEveryFrame) {
  vox_test::FileBuilder builder;
  std::mt19937 random(7);
  const auto number = [&](int most) { return static_cast<int>(random() % static_cast<unsigned>(most)); };
  builder.model(2, 2, 3, {{0, 0, 0, 1}, {1, 1, 2, 1}}).model(2, 4, 2, {{0, 0, 0, 2}});
  builder.model(3, 1, 3, {{0, 0, 0, 3}, {2, 0, 0, 1}, {1, 0, 2, 1}});
  std::vector<std::int32_t> children;
  for (int i = 0; i < 8; ++i) children.push_back(2 + 2 * i);
  builder.transform(0, 1, {{}}, {}, -1).group(1, children);
  for (int i = 0; i < 8; ++i) {
    std::vector<vox_test::Entries> keys;
    for (int frame = 0; frame < 12; frame += 1 + number(4)) {
      const std::string place = std::to_string(number(40) - 20) + " " + std::to_string(number(40)) + " 3";
      // Tests turns and reflections: a byte of two columns and three signs.
      constexpr std::array<int, 6> kColumns = {4, 8, 1, 9, 2, 6};
      const int turn = kColumns[random() % 6] | (number(8) << 4);
      keys.push_back({{"_t", place}, {"_r", std::to_string(turn)}, {"_f", std::to_string(frame)}});
    }
    builder.transform(2 + 2 * i, 3 + 2 * i, keys, {{"_name", "n" + std::to_string(i)}}, 0);
    builder.shape(3 + 2 * i, {{0, {{"_f", "0"}}},
                              {static_cast<std::uint32_t>(number(3)), {{"_f", std::to_string(1 + number(10))}}}});
  }
  const auto file = builder.file();
  const SceneAnimation animation = animation_of(file);
  expect_same_places(file, animation, written(animation, 10.0));
}

TEST_F(GltfAnimation, MovesPackedNodesLikePlainNodes) {
  const SceneAnimation animation = animation_of(film());
  const ParsedGlb plain = written(animation, 10.0);
  for (const MeshFileOptions options :
       {MeshFileOptions{.quantize = true}, MeshFileOptions{.quantize = true, .compress = true}}) {
    const ParsedGlb packed = written(animation, 10.0, options);
    const std::size_t bird = node_named(packed.document, "bird").value();
    const DVec3 rest = node_at(packed, bird, 0.0).translation - node_at(plain, bird, 0.0).translation;
    for (int frame = 0; frame < 6; ++frame) {
      const double seconds = 0.1 * frame + 0.05;
      const Moment moved = node_at(packed, bird, seconds);
      const Moment wanted = node_at(plain, bird, seconds);
      // The mesh's origin turns with the node.
      const DVec3 origin = glm::conjugate(node_at(plain, bird, 0.0).rotation) * rest;
      EXPECT_LT(glm::length(moved.translation - (wanted.translation + wanted.rotation * origin)), 1e-5) << frame;
      EXPECT_EQ(moved.scale, node_at(packed, bird, 0.0).scale);
    }
  }
}

TEST_F(GltfAnimation, ScalesMotion) {
  const SceneAnimation animation = animation_of(film());
  const ParsedGlb glb = written(animation, 10.0, {.scale = 0.5});
  const std::size_t bird = node_named(glb.document, "bird").value();
  const std::size_t walker = node_named(glb.document, "walker").value();
  EXPECT_LT(glm::length(node_at(glb, bird, 0.45).translation - DVec3(1.5, 4.5, 0.0)), 1e-6);
  EXPECT_EQ(node_at(glb, walker, 0.05).scale, DVec3(0.5));
  EXPECT_EQ(node_at(glb, walker, 0.25).scale, DVec3(0.0));
}

TEST_F(GltfAnimation, TreatsModelsAsFramesWithoutSceneGraph) {
  vox_test::FileBuilder builder;
  for (std::uint8_t i = 1; i <= 3; ++i) builder.model(1, 1, i, {{0, 0, 0, i}});
  const auto file = builder.file();
  const SceneAnimation animation = animation_of(file);
  EXPECT_EQ(animation.frame_count(), 3U);
  const ParsedGlb glb = written(animation, 10.0);
  ASSERT_EQ(glb.document["nodes"].size(), 3U);
  for (int frame = 0; frame < 3; ++frame) {
    for (std::size_t node = 0; node < 3; ++node) {
      const double scale = node == static_cast<std::size_t>(frame) ? 1.0 : 0.0;
      EXPECT_EQ(node_at(glb, node, 0.1 * frame + 0.05).scale, DVec3(scale));
    }
  }
}

TEST_F(GltfAnimation, WritesNoAnimationForStaticModels) {
  vox_test::FileBuilder builder;
  builder.model(2, 2, 2, {{0, 0, 0, 1}});
  const ParsedGlb glb = written(animation_of(builder.file()), 10.0);
  EXPECT_FALSE(glb.document.contains("animations"));
}

TEST_F(GltfAnimation, RefusesInvalidFramesAndKeys) {
  SceneAnimation animation;
  Scene scene;
  const GridHandle grid = add_asymmetric_grid(scene, "crane");
  place(scene, grid, {0, 0, 0});
  ASSERT_TRUE(animation.add(scene).has_value());
  place(scene, grid, {9, 0, 0});
  EXPECT_EQ(animation.add(scene).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(animation.frame_count(), 1U);
  auto meshes = mesh_scene(animation.scene()).value();
  for (const std::vector<MeshKey>& keys : {std::vector<MeshKey>{{1.0}},
                                           {{0.0}, {1e-50}},
                                           {{0.0}, {1e50}},
                                           {{0.0}, {100.0}, {100.000001}},
                                           {{0.0}, {0.0}},
                                           {{0.0}, {std::nan("")}},
                                           {{0.0, true, {.mirrored = true}}},
                                           {{0.0, true, {.position = DVec3(std::nan(""))}}},
                                           {{0.0, true, {.scale = 0.0}}}}) {
    SceneMeshes odd = meshes;
    odd.placements[0].keys = keys;
    EXPECT_EQ(write_mesh(odd, FileFormat::Glb).error().code, ErrorCode::InvalidArgument);
  }
  meshes.seconds = -1.0;
  EXPECT_EQ(write_mesh(meshes, FileFormat::Glb).error().code, ErrorCode::InvalidArgument);
}

TEST(SceneAnimationDeathTest, AssertsOnForeignMeshesAndZeroRate) {
  Scene scene;
  place(scene, add_asymmetric_grid(scene, "crane"), {0, 0, 0});
  SceneAnimation animation;
  ASSERT_TRUE(animation.add(scene).has_value());
  auto meshes = mesh_scene(animation.scene()).value();
  QUOIN_EXPECT_MISTAKE(animation.animate(meshes, 0.0), "frames_per_second is positive");
  meshes.placements[0].instance.reset();
  QUOIN_EXPECT_MISTAKE(animation.animate(meshes, 10.0), "the meshes are those of the animation's scene");
}

}  // namespace
}  // namespace quoin
