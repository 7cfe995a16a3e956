#include "scene/meshes/scene_mesh_parts.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <random>
#include <tuple>

#include <quoin/grid/copy_box.h>
#include <quoin/scene/scene_meshes.h>

#include "core/coordinates/unit_rotation.h"

namespace quoin {

namespace {

GridHandle add_grid(Scene& scene, const IBox& box) {
  if (scene.types.size() < 2) {
    EXPECT_TRUE(scene.types.add({}).has_value());
  }
  SceneGrid grid;
  grid.grid.fill_box(box, 1);
  grid.pivot = {2.5, 1.0, -3.5};
  return scene.add_grid(std::move(grid));
}

/// Returns an instance that places a grid in the lattice of another instance.
Instance placed(const Scene& scene, const Instance& lattice, GridHandle grid, const LatticePlace& place) {
  Instance instance;
  instance.grid = grid;
  instance.voxel_size = lattice.voxel_size;
  instance.mirrored = place.orientation.is_mirrored() != lattice.mirrored;
  // The remaining orientation after the mirror of x.
  const AxisOrientation mirror = instance.mirrored ? AxisOrientation::mirror(0) : AxisOrientation{};
  const AxisOrientation own = lattice.mirrored ? AxisOrientation::mirror(0) : AxisOrientation{};
  const glm::dmat3 turn = (own * place.orientation * mirror).matrix();
  instance.rotation = unit_rotation(lattice.rotation) * glm::quat_cast(turn);
  const DVec3 pivot = scene.grids()[grid].pivot;
  const DVec3 arrived = place.orientation.apply(pivot) + DVec3(place.offset);
  instance.position = world_from_grid(lattice, scene.grids()[lattice.grid], arrived);
  return instance;
}

TEST(Lattices, FindExactlyTheOrientations) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  for (int i = 0; i < AxisOrientation::kCount; ++i) {
    Scene scene;
    const GridHandle first = add_grid(scene, {{-3, 0, 5}, {9, 4, 11}});
    const GridHandle second = add_grid(scene, {{40, -7, 0}, {44, 9, 3}});
    Instance lattice;
    lattice.grid = first;
    lattice.position = 900.0 * DVec3(any(random), any(random), any(random));
    lattice.rotation = DQuat(any(random), any(random), any(random), any(random));
    lattice.voxel_size = 0.37;
    lattice.mirrored = i % 3 == 0;
    const LatticePlace place{AxisOrientation::at(i), {31, -800, 5}};
    const Instance instance = placed(scene, lattice, second, place);
    const auto found = place_in_lattice(scene, lattice, instance);
    ASSERT_TRUE(found) << i;
    EXPECT_EQ(found->orientation, place.orientation);
    EXPECT_EQ(found->offset, place.offset);
    const IBox box{{1, 2, 3}, {4, 6, 8}};
    EXPECT_EQ(found->inverse().apply(found->apply(box)), box);
    Instance off = instance;
    off.position += world_from_grid_direction(lattice, DVec3(0.5, 0.0, 0.0));
    EXPECT_FALSE(place_in_lattice(scene, lattice, off)) << "half a voxel off";
    off = instance;
    off.rotation = off.rotation * glm::angleAxis(0.01, DVec3(0, 1, 0));
    EXPECT_FALSE(place_in_lattice(scene, lattice, off)) << "turned by half a degree";
    off = instance;
    off.voxel_size *= 1.5;
    EXPECT_FALSE(place_in_lattice(scene, lattice, off)) << "larger voxels";
  }
}

TEST(Lattices, GroupTouchingInstances) {
  Scene scene;
  const GridHandle cube = add_grid(scene, {{0, 0, 0}, {4, 4, 4}});
  std::vector<InstanceHandle> all;
  for (const DVec3 at : {DVec3(0, 0, 0), DVec3(20, 0, 0), DVec3(4, 0, 0), DVec3(8, 4, 4), DVec3(25, 0, 0),
                         DVec3(13.5, 4, 4), DVec3(0, -4.5, 0), DVec3(22, 2, 2)}) {
    Instance instance;
    instance.grid = cube;
    instance.position = at;
    all.push_back(scene.add_instance(instance));
  }
  const auto groups = lattice_groups(scene, all);
  std::vector<std::vector<std::size_t>> numbers;
  for (const auto& group : groups) {
    numbers.emplace_back();
    for (const LatticeMember& member : group) {
      numbers.back().push_back(
          static_cast<std::size_t>(std::find(all.begin(), all.end(), member.instance) - all.begin()));
    }
    EXPECT_EQ(group[0].place.offset, IVec3(0));
  }
  // 0, 2, 3 in a row, 1 and 7 overlapping; 4 one voxel away from 1 but within 7; 5 and 6 off by half a voxel.
  EXPECT_EQ(numbers, (std::vector<std::vector<std::size_t>>{{0, 2, 3}, {1, 4, 7}, {5}, {6}}));
}

using Corner = std::array<std::int64_t, 3>;
using Triangle = std::array<Corner, 3>;

/// Returns the triangles of all placements in the world, rounded to 1/512: floats represent that safely. Each triangle
/// starts with its least corner.
std::map<Triangle, int> triangles_of(const SceneMeshes& meshes) {
  std::map<Triangle, int> all;
  for (const MeshPlacement& placement : meshes.placements) {
    const MeshPart& part = meshes.parts[placement.part];
    const glm::dmat4 matrix = placement.matrix();
    const bool turns = glm::determinant(glm::dmat3(matrix)) < 0.0;
    for (const MeshView& view : part.surfaces) {
      for (std::size_t i = 0; i < view.indices.size(); i += 3) {
        Triangle triangle{};
        for (std::size_t k = 0; k < 3; ++k) {
          const DVec3 at(view.positions[view.indices[i + (turns ? 2 - k : k)]]);
          const DVec3 p(matrix * glm::dvec4(at - part.pivot, 1.0));
          for (int axis = 0; axis < 3; ++axis)
            triangle[k][static_cast<std::size_t>(axis)] = std::llround(p[axis] * 512.0 + 0.02);
        }
        std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
        ++all[triangle];
      }
    }
  }
  return all;
}

TEST(UnitedInstances, MatchSingleGrid) {
  std::mt19937 random(8);
  for (const bool glass : {false, true}) {
    Scene whole;
    ASSERT_TRUE(whole.types.add({}).has_value());
    VoxelProperties pane;
    pane.visibility = Visibility::Transparent;
    ASSERT_TRUE(whole.types.add(pane).has_value());
    SceneGrid model;
    model.grid.edit({{-20, -9, 50}, {20, 12, 75}}, [&](IVec3 p, VoxelType) -> VoxelType {
      if (std::sin(p.x * 0.4) + std::sin(p.y * 0.5) + std::cos(p.z * 0.3) < 0.3) return kAir;
      return glass && (p.x / 3 + p.z / 4) % 3 == 0 ? 2 : 1;
    });
    Scene pieces;
    pieces.types = whole.types;
    Instance lattice;
    lattice.voxel_size = 0.5;
    // Pieces with arbitrary orientations; the first is unchanged.
    for (int i = 0; i < 4; ++i) {
      const IBox box{{-20 + 10 * i, -9, 50}, {-10 + 10 * i, 12, 75}};
      LatticePlace place;
      if (i > 0) place = {AxisOrientation::at(static_cast<int>(random() % 48)), {100 * i, -7, 3 * i}};
      const LatticePlace back = place.inverse();
      SceneGrid piece;
      piece.name = "piece " + std::to_string(i);
      copy_box(model.grid, box, piece.grid, back.apply(box).min, back.orientation);
      const GridHandle handle = pieces.add_grid(std::move(piece));
      if (i == 0) {
        lattice.grid = handle;
        pieces.add_instance(lattice);
      } else {
        pieces.add_instance(placed(pieces, pieces.instances()[pieces.instances().handles()[0]], handle, place));
      }
    }
    Instance one = lattice;
    one.grid = whole.add_grid(std::move(model));
    whole.add_instance(one);
    const auto expected = mesh_scene_smoothly(whole);
    const auto united = mesh_scene_smoothly(pieces);
    ASSERT_TRUE(expected && united);
    ASSERT_EQ(united->parts.size(), 4U);
    ASSERT_EQ(united->placements.size(), 4U);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(united->parts[i].name, "piece " + std::to_string(i));
      EXPECT_EQ(united->parts[i].surfaces.size(), glass ? 2U : 1U);
    }
    EXPECT_EQ(united->stats.triangles, expected->stats.triangles);
    EXPECT_EQ(triangles_of(*united), triangles_of(*expected));
    const auto separate = mesh_scene_smoothly(pieces, {.unite = false});
    ASSERT_TRUE(separate);
    EXPECT_GT(separate->stats.triangles, expected->stats.triangles) << "walls where the pieces meet";
  }
}

TEST(UnitedInstances, SeparateInstancesSharePart) {
  Scene scene;
  const GridHandle cube = add_grid(scene, {{0, 0, 0}, {3, 3, 3}});
  for (int i = 0; i < 5; ++i) {
    Instance instance;
    instance.grid = cube;
    instance.position = DVec3(10.0 * i, 0, 0);
    scene.add_instance(instance);
  }
  Instance adjacent;
  adjacent.grid = cube;
  adjacent.position = DVec3(43.0, 0, 0);
  scene.add_instance(adjacent);
  const auto meshes = mesh_scene_smoothly(scene);
  ASSERT_TRUE(meshes);
  EXPECT_EQ(meshes->parts.size(), 3U) << "the lone ones' and two of the pair";
  EXPECT_EQ(meshes->placements.size(), 6U);
  const auto parted = mesh_scene_smoothly(scene, {.unite = false});
  ASSERT_TRUE(parted);
  EXPECT_EQ(parted->parts.size(), 1U);
}

TEST(UnitedInstances, LastInstanceWinsSharedVoxels) {
  Scene scene;
  ASSERT_TRUE(scene.types.add({}).has_value());
  VoxelProperties red;
  red.colour = {200, 0, 0, 255};
  ASSERT_TRUE(scene.types.add(red).has_value());
  for (const VoxelType type : {VoxelType{1}, VoxelType{2}}) {
    SceneGrid grid;
    grid.grid.fill_box({{0, 0, 0}, {4, 4, 4}}, type);
    Instance instance;
    instance.grid = scene.add_grid(std::move(grid));
    scene.add_instance(instance);
  }
  const auto meshes = mesh_scene_smoothly(scene);
  ASSERT_TRUE(meshes);
  ASSERT_EQ(meshes->parts.size(), 1U) << "of the first nothing is left";
  for (const LinearRgba16& albedo : meshes->parts[0].surfaces[0].albedo) EXPECT_EQ(albedo[1], 0);
}

}  // namespace

}  // namespace quoin
