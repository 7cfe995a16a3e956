#include <quoin/scene/scene_meshes.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

namespace {

GridHandle add_grid(Scene& scene, int length) {
  SceneGrid grid;
  grid.name = std::to_string(length) + " long";
  VoxelProperties stone;
  stone.name = "stone";
  grid.grid.fill_box({{0, 0, 0}, {length, 1, 1}}, *scene.types.find_or_add(stone));
  return scene.add_grid(std::move(grid));
}

void place(Scene& scene, GridHandle grid, bool visible = true) {
  Instance instance;
  instance.grid = grid;
  instance.visible = visible;
  scene.add_instance(instance);
}

// Returns true if each edge occurs equally often in both directions.
bool is_closed(const MeshView& view) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (std::size_t i = 0; i < view.indices.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = view.indices[i + k];
      const std::uint32_t b = view.indices[i + (k + 1) % 3];
      edges[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  }
  return std::all_of(edges.begin(), edges.end(), [](const auto& edge) { return edge.second == 0; });
}

double volume_of(const MeshView& view) {
  double six_fold = 0.0;
  for (std::size_t i = 0; i < view.indices.size(); i += 3) {
    const auto corner = [&](std::size_t k) { return DVec3(view.positions[view.indices[i + k]]); };
    six_fold += glm::dot(corner(0), glm::cross(corner(1), corner(2)));
  }
  return six_fold / 6.0;
}

VoxelType add_type(Scene& scene, const char* name, Visibility visibility) {
  VoxelProperties look;
  look.name = name;
  look.visibility = visibility;
  return *scene.types.add(look);
}

TEST(SceneMeshes, CloseTransparentMaterialsOfFields) {
  Scene scene;
  const VoxelType stone = add_type(scene, "stone", Visibility::Opaque);
  const VoxelType water = add_type(scene, "water", Visibility::Transparent);
  const VoxelType glass = add_type(scene, "glass", Visibility::Transparent);
  SceneGrid content;
  content.name = "domes";
  content.field.add_box({-40, -30, -40}, {40, 0, 40}, stone);
  content.field.add_sphere({0, 0, 0}, 20, water);
  content.field.add_sphere({70, 0, 0}, 10, glass);
  Instance instance;
  instance.grid = scene.add_grid(std::move(content));
  scene.add_instance(instance);
  const double ball = 4.0 / 3.0 * 3.14159265358979 * 10 * 10 * 10;
  const double dome = 2.0 / 3.0 * 3.14159265358979 * 20 * 20 * 20;
  for (const bool is_smooth : {false, true}) {
    const auto meshes = is_smooth ? mesh_scene_smoothly(scene) : mesh_scene(scene);
    ASSERT_TRUE(meshes);
    const auto part = std::find_if(meshes->parts.begin(), meshes->parts.end(),
                                   [](const MeshPart& each) { return !each.surfaces.empty(); });
    ASSERT_NE(part, meshes->parts.end());
    ASSERT_EQ(part->surfaces.size(), 2U);
    EXPECT_EQ(part->surfaces[0].surface, SurfaceClass::Opaque);
    EXPECT_EQ(part->surfaces[1].surface, SurfaceClass::Transparent);
    for (const MeshView& view : part->surfaces) EXPECT_TRUE(is_closed(view));
    // The added bodies do not change the stone.
    EXPECT_NEAR(volume_of(part->surfaces[0]), 80.0 * 30 * 80, 0.02 * 80 * 30 * 80);
    EXPECT_NEAR(volume_of(part->surfaces[1]), ball + dome, 0.04 * (ball + dome));
    const auto has_only = [](const MeshView& view, std::vector<VoxelType> types) {
      return std::all_of(view.types.begin(), view.types.end(),
                         [&](VoxelType type) { return std::find(types.begin(), types.end(), type) != types.end(); });
    };
    EXPECT_TRUE(has_only(part->surfaces[0], {stone}));
    EXPECT_TRUE(has_only(part->surfaces[1], {water, glass}));
  }
}

TEST(SceneMeshes, MeshEachDrawnGridOnce) {
  Scene scene;
  const GridHandle twice = add_grid(scene, 3);
  const GridHandle hidden = add_grid(scene, 4);
  add_grid(scene, 5);
  place(scene, twice);
  place(scene, twice);
  place(scene, hidden, false);
  const auto meshes = mesh_scene(scene);
  ASSERT_TRUE(meshes);
  ASSERT_EQ(meshes->parts.size(), 1U);
  EXPECT_EQ(meshes->parts[0].name, "3 long");
  EXPECT_EQ(meshes->placements.size(), 2U);
  EXPECT_EQ(meshes->stats.faces_total, 18);
  EXPECT_EQ(meshes->stats.faces_visible, 14);
  EXPECT_EQ(meshes->stats.quads, 6);
  EXPECT_EQ(meshes->stats.triangles, 12);
  EXPECT_EQ(meshes->stats.vertices, 24);
  const auto all = mesh_scene(scene, {.instances = InstanceFilter::All});
  ASSERT_TRUE(all);
  EXPECT_EQ(all->stats.faces_total, 18 + 24);
  EXPECT_EQ(all->parts.size(), 2U) << "none of the grid that is placed nowhere";
}

TEST(SceneMeshes, SkipInstancesOfMissingGrids) {
  Scene scene;
  Instance lost;
  lost.grid = GridHandle{7, 0};
  scene.add_instance(lost);
  const auto meshes = mesh_scene(scene);
  ASSERT_TRUE(meshes);
  EXPECT_TRUE(meshes->parts.empty());
  EXPECT_TRUE(meshes->placements.empty());
}

TEST(SceneMeshes, ReportRisingProgressUpToOne) {
  Scene scene;
  for (const int length : {3, 700, 30, 1000}) place(scene, add_grid(scene, length));
  std::vector<double> reported;
  const auto meshes = mesh_scene(scene, {}, Threads{4}, [&](double fraction) {
    reported.push_back(fraction);
    return true;
  });
  ASSERT_TRUE(meshes);
  ASSERT_FALSE(reported.empty());
  EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end()));
  EXPECT_NEAR(reported.back(), 1.0, 1e-9);
}

TEST(SceneMeshes, StopWhenCancelled) {
  Scene scene;
  for (const int length : {3, 700}) place(scene, add_grid(scene, length));
  const auto meshes = mesh_scene(scene, {}, {}, [](double) { return false; });
  ASSERT_FALSE(meshes);
  EXPECT_EQ(meshes.error().code, ErrorCode::Cancelled);
}

TEST(SceneMeshes, RejectInvalidTransforms) {
  const auto refuses = [](const std::function<void(Instance&)>& spoil) {
    Scene scene;
    place(scene, add_grid(scene, 1));
    spoil(scene.edit(scene.instances().handles()[0]));
    const auto blocky = mesh_scene(scene);
    const auto smooth = mesh_scene_smoothly(scene);
    return !blocky && blocky.error().code == ErrorCode::InvalidArgument && !smooth &&
           smooth.error().code == ErrorCode::InvalidArgument;
  };
  EXPECT_TRUE(refuses([](Instance& i) { i.position.x = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_TRUE(refuses([](Instance& i) { i.voxel_size = -1.0; }));
  EXPECT_TRUE(refuses([](Instance& i) { i.rotation.y = std::numeric_limits<double>::infinity(); }));
}

TEST(SceneMeshes, NormalizeRotationsOfAnyLength) {
  const DQuat turn = glm::angleAxis(0.9, glm::normalize(DVec3(1, 2, -1)));
  const std::array<std::pair<DQuat, DQuat>, 4> cases = {
      {{DQuat(0, 0, 0, 0), DQuat(1, 0, 0, 0)}, {turn * 1e200, turn}, {turn * 1e-200, turn}, {turn * -3.0, -turn}}};
  for (const auto& [given, expected] : cases) {
    Scene scene;
    place(scene, add_grid(scene, 1));
    scene.edit(scene.instances().handles()[0]).rotation = given;
    const auto meshes = mesh_scene(scene);
    ASSERT_TRUE(meshes);
    const auto& placed = std::get<Similarity>(meshes->placements[0].world_from_part);
    EXPECT_LT(glm::length(placed.rotation - expected), 1e-12);
  }
}

/// An L of voxels with an arm upwards, which every turn and reflection changes.
constexpr std::array kVoxels = {IVec3(0, 0, 0), IVec3(0, 1, 0), IVec3(0, 2, 0), IVec3(1, 0, 0), IVec3(0, 1, 1)};

GridHandle add_asymmetric(Scene& scene) {
  SceneGrid grid;
  grid.pivot = {2.0, 2.5, 0.5};
  for (const IVec3 voxel : kVoxels) grid.grid.set(voxel, *scene.types.find_or_add({}));
  return scene.add_grid(std::move(grid));
}

double distance_from_voxels(const Instance& instance, const SceneGrid& grid, DVec3 point) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const IVec3 voxel : kVoxels) {
    nearest = std::min(nearest, glm::length(world_from_grid(instance, grid, DVec3(voxel) + 0.5) - point));
  }
  return nearest;
}

TEST(SmoothSceneMeshes, SurroundVoxelsOfEveryInstance) {
  Scene scene;
  const GridHandle grid = add_asymmetric(scene);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  for (int i = 0; i < 6; ++i) {
    Instance instance;
    instance.grid = grid;
    instance.position = 40.0 * DVec3(any(random), any(random), any(random));
    instance.rotation = glm::normalize(DQuat(any(random), any(random), any(random), any(random)));
    instance.voxel_size = 1.5 + any(random);
    instance.mirrored = i % 2 == 1;
    instance.visible = i != 5;
    scene.add_instance(instance);
  }
  const auto meshes = mesh_scene_smoothly(scene);
  ASSERT_TRUE(meshes) << to_string(meshes.error());
  ASSERT_EQ(meshes->parts.size(), 1U);
  ASSERT_EQ(meshes->placements.size(), 5U) << "the hidden one is left out";
  const MeshPart& part = meshes->parts[0];
  ASSERT_TRUE(part.surfaces[0].has_albedo());
  const auto handles = scene.instances().handles();
  for (std::size_t i = 0; i < 5; ++i) {
    const Instance& instance = scene.instances()[handles[i]];
    for (const Vec3& p : part.surfaces[0].positions) {
      const DVec3 point(meshes->placements[i].matrix() * glm::dvec4(DVec3(p) - part.pivot, 1.0));
      // The surface runs between voxel centres.
      EXPECT_LT(distance_from_voxels(instance, scene.grids()[grid], point), instance.voxel_size);
    }
  }
}

TEST(SmoothSceneMeshes, AreThreadIndependentAndCancellable) {
  Scene scene;
  place(scene, add_asymmetric(scene));
  place(scene, add_grid(scene, 40));
  place(scene, scene.add_grid({}));
  const auto one = mesh_scene_smoothly(scene, {}, Threads{1});
  double last = 0.0;
  const auto four = mesh_scene_smoothly(scene, {}, Threads{4}, [&](double fraction) {
    EXPECT_GE(fraction, last);
    EXPECT_LE(fraction, 1.0);
    last = fraction;
    return true;
  });
  ASSERT_TRUE(one && four);
  ASSERT_EQ(one->parts.size(), 2U) << "the empty one is left out";
  for (std::size_t i = 0; i < 2; ++i) {
    const MeshView& a = one->parts[i].surfaces[0];
    const MeshView& b = four->parts[i].surfaces[0];
    EXPECT_TRUE(std::ranges::equal(a.positions, b.positions));
    EXPECT_TRUE(std::ranges::equal(a.indices, b.indices));
    EXPECT_TRUE(std::ranges::equal(a.occlusion, b.occlusion));
  }
  const auto cancelled = mesh_scene_smoothly(scene, {}, {}, [](double) { return false; });
  ASSERT_FALSE(cancelled);
  EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
}

TEST(VolumeMeshes, SimplifyWithinErrorIfSupported) {
  Volume ball;
  ball.size = {40, 40, 40};
  for (int i = 0; i < 40 * 40 * 40; ++i) {
    const DVec3 p(i % 40, i / 40 % 40, i / 1600);
    ball.values.push_back(static_cast<float>(15.0 - glm::length(p - 20.0)));
  }
  ball.min = -20.0F;
  ball.max = 15.0F;
  const auto whole = mesh_volume(ball);
  const auto simple = mesh_volume(ball, {.simplify_error = 0.1F});
  ASSERT_TRUE(whole);
  ASSERT_EQ(simple.has_value(), can_simplify());
  if (!can_simplify()) GTEST_SKIP() << "this build has no meshoptimizer";
  EXPECT_LT(simple->stats.triangles, whole->stats.triangles / 2);
  EXPECT_GT(simple->stats.simplify_error, 0.0F);
  EXPECT_LE(simple->stats.simplify_error, 0.1F);
  EXPECT_TRUE(mesh_volume(ball, {.iso = 100.0F})->parts.empty());
}

}  // namespace

}  // namespace quoin
