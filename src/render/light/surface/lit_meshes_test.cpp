#include <quoin/render/lit_meshes.h>

#include <algorithm>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/render/propagated_light.h>
#include <quoin/render/surface_light.h>

#include "render/light/surface/light_world_for_tests.h"

namespace quoin {
namespace {

class LitMeshes : public ::testing::Test {
 protected:
  void put(LightWorld world) {
    scene_.types = world.types;
    SceneGrid grid;
    grid.name = "world";
    grid.grid = std::move(world.grid);
    grid.pivot = {3.0, 4.0, 5.0};
    handle_ = scene_.add_grid(std::move(grid));
    scene_.add_instance({"world", handle_, {100.0, -7.0, 2.0}});
    light_.update(scene_.grids()[handle_].grid, scene_.types);
  }
  [[nodiscard]] const Grid& grid() const { return scene_.grids()[handle_].grid; }
  // Returns the expected light of a vertex, by the same functions that colour images.
  [[nodiscard]] Vec3 wanted(const MeanLevels& levels, Vec3 normal, float emission) const {
    const Vec3 light = light_colour(levels, normal, light_look(environment_of(scene_))) + emission;
    return glm::min(light * static_cast<float>(*environment_of(scene_).exposure), Vec3(1.0F)) * 65'535.0F;
  }
  static void expect_light(const LinearRgba16& light, Vec3 wanted, float tolerance) {
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(light[static_cast<std::size_t>(c)], wanted[c], tolerance);
    ASSERT_EQ(light[3], 65'535);
  }

  Scene scene_;
  GridHandle handle_;
  PropagatedLight light_;
  LightOptions options_;
};

// Compares every corner of every face, including those inside merged quads.
TEST_F(LitMeshes, MergedFacesMatchSingleFaces) {
  put(LightWorld(3));
  scene_.environment = Environment::natural({0.5, 0.15, 0.3});
  scene_.environment->exposure = 0.8;
  const auto meshes = mesh_lit_scene(scene_, options_);
  ASSERT_TRUE(meshes);
  SurfaceLight surface(light_, grid(), scene_.types);
  std::int64_t faces = 0;
  std::int64_t quads = 0;
  for (const MeshView& view : meshes->parts[0].surfaces) {
    ASSERT_EQ(view.light.size(), view.positions.size());
    for (std::size_t i = 0; i < view.positions.size(); i += 4, ++quads) {
      const Direction direction = view.directions[i];
      const FaceFrame& frame = frame_of(direction);
      const IVec3 first(view.positions[i]);
      const IVec3 size = IVec3(view.positions[i + 2]) - first;
      const float emission = scene_.types[view.types[i]].emission;
      for (int v = 0; v < size[frame.v]; ++v) {
        for (int u = 0; u < size[frame.u]; ++u, ++faces) {
          IVec3 voxel = first;
          voxel[frame.u] += u;
          voxel[frame.v] += v;
          if (frame.sign > 0) --voxel[frame.axis];
          const FaceLight corners = surface.face(voxel, direction);
          for (std::size_t c = 0; c < 4; ++c) {
            const float x = static_cast<float>(u + (c == 1 || c == 2 ? 1 : 0)) / static_cast<float>(size[frame.u]);
            const float y = static_cast<float>(v + (c >= 2 ? 1 : 0)) / static_cast<float>(size[frame.v]);
            const auto at = [&](std::size_t corner) {
              const LinearRgba16& light = view.light[i + corner];
              return Vec3(light[0], light[1], light[2]);
            };
            const Vec3 shown = (1 - y) * ((1 - x) * at(0) + x * at(1)) + y * ((1 - x) * at(3) + x * at(2));
            const Vec3 own = wanted(levels_of_corner(corners[c]), Vec3(normal_of(direction)), emission);
            for (int k = 0; k < 3; ++k) ASSERT_NEAR(shown[k], own[k], 1.01F);
          }
        }
      }
    }
  }
  EXPECT_EQ(faces, meshes->stats.faces_visible);
  EXPECT_EQ(quads, meshes->stats.quads);
  EXPECT_LT(quads, faces);
}

TEST_F(LitMeshes, SmoothVerticesTakeLightInFront) {
  put(LightWorld(4));
  auto meshes = mesh_scene_smoothly(scene_);
  ASSERT_TRUE(meshes);
  ASSERT_TRUE(light_meshes(scene_, options_, *meshes));
  SurfaceLight surface(light_, grid(), scene_.types);
  std::size_t lit = 0;
  for (const MeshView& view : meshes->parts[0].surfaces) {
    std::vector<MeanLevels> levels(view.positions.size());
    surface.read({view.positions, view.normals}, levels);
    for (std::size_t i = 0; i < levels.size(); ++i) {
      expect_light(view.light[i], wanted(levels[i], view.normals[i], 0.0F), 1.01F);
      lit += view.light[i][0] > 0;
    }
  }
  EXPECT_GT(lit, 1000U);
}

// A full box has the light of the cube in its place.
TEST_F(LitMeshes, LightsShapesLikeCubes) {
  LightWorld world(6);
  const VoxelType box = world.types
                            .add({.name = "box",
                                  .visibility = Visibility::Transparent,
                                  .shapes = VoxelShape::box(IVec3(0), IVec3(kShapeUnits))})
                            .value();
  world.grid.fill_box({{-8, 12, -8}, {8, 13, 8}}, LightWorld::kStone);
  world.grid.set({-4, 14, 3}, LightWorld::kLamp);
  for (const IVec3 at : {IVec3{0, 14, 0}, {-6, 15, 5}, {5, 13, -5}}) world.grid.set(at, box);
  put(std::move(world));
  auto meshes = mesh_lit_scene(scene_, options_);
  ASSERT_TRUE(meshes);
  SurfaceLight surface(light_, grid(), scene_.types);
  int vertices = 0;
  for (const MeshView& view : meshes->parts[0].surfaces) {
    for (std::size_t i = 0; i < view.positions.size() && !view.looks.empty(); ++i) {
      if (!view.looks[i].is_shape) continue;
      const Direction direction = view.directions[i];
      const FaceFrame& frame = frame_of(direction);
      const Vec3 inside =
          (view.positions[i - i % 4] + view.positions[i - i % 4 + 2]) * 0.5F - Vec3(normal_of(direction)) * 0.5F;
      const IVec3 voxel = voxel_of(DVec3(inside));
      const bool is_far_u = view.positions[i][frame.u] > inside[frame.u];
      const bool is_far_v = view.positions[i][frame.v] > inside[frame.v];
      const std::size_t corner = is_far_v ? (is_far_u ? 2 : 3) : (is_far_u ? 1 : 0);
      const MeanLevels levels = levels_of_corner(surface.face(voxel, direction)[corner]);
      expect_light(view.light[i], wanted(levels, Vec3(normal_of(direction)), 0.0F), 1.01F);
      ++vertices;
    }
  }
  EXPECT_EQ(vertices, 3 * 24 - 4);  // the floor hides a side
}

TEST_F(LitMeshes, LightsFieldsBySamples) {
  LightWorld empty;
  scene_.types = empty.types;
  SceneGrid made;
  made.field.add_sphere({0.0, 0.0, 0.0}, 14.0, LightWorld::kStone);
  made.field.remove_sphere({0.0, 0.0, 0.0}, 9.0);
  scene_.add_instance({"", scene_.add_grid(std::move(made))});
  auto meshes = mesh_scene(scene_);
  ASSERT_TRUE(meshes);
  ASSERT_TRUE(light_meshes(scene_, options_, *meshes));
  int inner = 0;
  for (const MeshPart& part : meshes->parts) {
    for (const MeshView& view : part.surfaces) {
      for (std::size_t i = 0; i < view.positions.size(); ++i) {
        if (glm::length(view.positions[i]) < 11.0F) {
          expect_light(view.light[i], Vec3(0.0F), 0.0F);
          ++inner;
        } else if (view.normals[i].y > 0.9F) {
          EXPECT_GT(view.light[i][1], 55'000);
        }
      }
    }
  }
  EXPECT_GT(inner, 500);
}

TEST_F(LitMeshes, RejectInvalidInput) {
  put(LightWorld(5));
  EXPECT_EQ(mesh_lit_scene(scene_, options_, {.mesh = {.watertight = true}}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(mesh_lit_scene(scene_, options_, {.atlas = true}).error().code, ErrorCode::InvalidArgument);
  scene_.environment = Environment::natural();
  scene_.environment->exposure = -1.0;
  EXPECT_EQ(mesh_lit_scene(scene_, options_).error().code, ErrorCode::InvalidArgument);
  scene_.environment.reset();
  auto meshes = mesh_scene(scene_);
  ASSERT_TRUE(meshes);
  meshes->placements.clear();
  EXPECT_EQ(light_meshes(scene_, options_, *meshes).error().code, ErrorCode::InvalidArgument);
}

TEST_F(LitMeshes, GiveSameBytesForAnyThreadCount) {
  put(LightWorld(6));
  const auto one = mesh_lit_scene(scene_, options_, {}, {1});
  const auto four = mesh_lit_scene(scene_, options_, {}, {4});
  ASSERT_TRUE(one && four);
  for (std::size_t i = 0; i < one->parts[0].surfaces.size(); ++i) {
    const MeshView& a = one->parts[0].surfaces[i];
    const MeshView& b = four->parts[0].surfaces[i];
    EXPECT_TRUE(std::equal(a.light.begin(), a.light.end(), b.light.begin(), b.light.end()));
    EXPECT_TRUE(std::equal(a.positions.begin(), a.positions.end(), b.positions.begin(), b.positions.end()));
  }
}

}  // namespace
}  // namespace quoin
