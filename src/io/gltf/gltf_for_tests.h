#pragma once

#include <gtest/gtest.h>

#include <string>

#include "io/gltf/glb_for_tests.h"

namespace quoin {

inline VoxelType add_type(Scene& scene, const std::string& name, Rgba8 colour) {
  VoxelProperties properties;
  properties.name = name;
  properties.colour = colour;
  return *scene.types.add(properties);
}

/// An L with an arm to +x and a red tip, so that no reflection or turn looks the same.
inline GridHandle add_asymmetric_grid(Scene& scene, const std::string& name) {
  const VoxelType grey = add_type(scene, "grey", {120, 120, 120, 255});
  const VoxelType red = add_type(scene, "red", {200, 10, 20, 255});
  SceneGrid grid;
  grid.name = name;
  grid.grid.fill_box({{0, 0, 0}, {1, 5, 1}}, grey);
  grid.grid.fill_box({{1, 0, 0}, {4, 1, 1}}, grey);
  grid.grid.set({3, 1, 0}, red);
  grid.grid.set({0, 1, 1}, grey);
  grid.pivot = {2.0, 2.5, 0.5};
  return scene.add_grid(std::move(grid));
}

inline InstanceHandle place(Scene& scene, GridHandle grid, DVec3 position, const std::string& name = "") {
  Instance instance;
  instance.name = name;
  instance.grid = grid;
  instance.position = position;
  return scene.add_instance(instance);
}

/// A scene and a folder to write it to.
class Gltf : public ::testing::Test {
 protected:
  ParsedGlb write(const BlockyMeshOptions& options = {}) {
    const auto meshes = mesh_scene(scene_, {.mesh = options});
    EXPECT_TRUE(meshes.has_value());
    return write(*meshes);
  }

  ParsedGlb write(const SceneMeshes& meshes) {
    const auto path = folder_.file("out.glb");
    const auto bytes = write_mesh(meshes, path);
    EXPECT_TRUE(bytes.has_value()) << to_string(bytes.error());
    const auto file = read_file(path);
    EXPECT_TRUE(file && file->size() == *bytes);
    return file ? parse_glb(*file) : ParsedGlb{};
  }

  Scene scene_;
  TestFolder folder_{std::string("gltf_") + ::testing::UnitTest::GetInstance()->current_test_info()->name()};
};

}  // namespace quoin
