// Queries ignore filtered voxels and instances.

#include <algorithm>
#include <array>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/sweep.h>

#include "scene/query/field_scene_for_tests.h"

namespace quoin {
namespace {

constexpr std::uint32_t kShips = 2;
constexpr std::uint32_t kLand = 4;

// Four types: colliding or not, opaque or transparent.
Scene scene_of_all_kinds(Random& random) {
  Scene scene;
  for (int i = 0; i < 4; ++i) {
    VoxelProperties properties;
    properties.name = std::to_string(i);
    properties.collides = (i & 1) == 0;
    properties.visibility = (i & 2) == 0 ? Visibility::Opaque : Visibility::Transparent;
    EXPECT_TRUE(scene.types.add(properties).has_value());
  }
  for (int grid = 0; grid < 3; ++grid) {
    SceneGrid made;
    for (int voxel = 0; voxel < 120; ++voxel) {
      made.grid.set(IVec3(random.vector() * 5.0), static_cast<VoxelType>(1 + voxel % 4));
    }
    const GridHandle handle = scene.add_grid(std::move(made));
    for (int i = 0; i < 6; ++i) {
      Instance instance;
      instance.grid = handle;
      place_anywhere(instance, random);
      instance.position /= 6.0;
      instance.categories = i % 3 == 0 ? kShips : i % 3 == 1 ? kLand : kShips | kLand;
      scene.add_instance(instance);
    }
  }
  return scene;
}

bool is_met(const VoxelRegistry& types, VoxelType type, QueryTypes which) {
  return which == QueryTypes::All || (which == QueryTypes::Opaque ? types.is_opaque(type) : types[type].collides);
}

// Returns the scene with all filtered voxels replaced by air.
Scene seen_by(const Scene& scene, const QueryFilter& filter, QueryTypes which) {
  Scene left = scene.snapshot();
  for (const GridHandle handle : left.grids().handles()) {
    Grid& grid = left.edit(handle).grid;
    (void)grid.edit(grid.bounds(), [&](IVec3, VoxelType type) {
      return type == kAir || is_met(scene.types, type, which) ? type : kAir;
    });
  }
  for (const InstanceHandle handle : scene.instances().handles()) {
    const bool is_ignored = std::find(filter.ignored.begin(), filter.ignored.end(), handle) != filter.ignored.end();
    if (is_ignored || (scene.instances()[handle].categories & filter.categories) == 0) left.remove_instance(handle);
  }
  return left;
}

struct Filtered {
  explicit Filtered(unsigned seed) : random(seed), scene(scene_of_all_kinds(random)), tracer(scene) {
    const std::vector<InstanceHandle> handles = scene.instances().handles();
    ignored = {handles[seed % handles.size()], handles[(seed + 7) % handles.size()]};
  }
  // One voxel of each kind, by index.
  [[nodiscard]] QueryFilter filter(int i) const {
    QueryFilter made;
    if (i % 2 == 1) made.ignored = ignored;
    if (i / 2 % 3 != 0) made.categories = i / 2 % 3 == 1 ? kShips : kLand;
    if (i / 6 % 4 != 0) made.types = static_cast<QueryTypes>(i / 6 % 4 - 1);
    return made;
  }
  static constexpr int kFilters = 24;

  Random random;
  Scene scene;
  SceneTracer tracer;
  std::array<InstanceHandle, 2> ignored;
};

TEST(QueryFilter, RaysHitOnlyUnfilteredInstances) {
  int differing = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Filtered all(seed);
    for (int i = 0; i < Filtered::kFilters; ++i) {
      const QueryFilter filter = all.filter(i);
      const Scene left = seen_by(all.scene, filter, filter.types.value_or(QueryTypes::All));
      const SceneTracer tracer(left);
      for (int ray_number = 0; ray_number < 60; ++ray_number) {
        const Ray ray{all.random.vector() * 25.0, all.random.direction()};
        const double max_t = ray_number % 3 == 0 ? kInfinity : 20.0 * std::abs(all.random.share());
        const auto found = first_hit(all.tracer, ray, max_t, filter);
        const auto expected = first_hit(tracer, ray, max_t);
        ASSERT_EQ(found.has_value(), expected.has_value()) << seed << " " << i << " " << ray_number;
        EXPECT_EQ(any_hit(all.tracer, ray, max_t, filter), expected.has_value());
        if (!found) continue;
        EXPECT_EQ(found->instance, expected->instance);
        EXPECT_EQ(found->voxel, expected->voxel);
        EXPECT_EQ(found->type, expected->type);
        EXPECT_EQ(found->face, expected->face);
        EXPECT_EQ(found->t, expected->t);
        EXPECT_EQ(found->starts_inside, expected->starts_inside);
        const auto unfiltered = first_hit(all.tracer, ray, max_t);
        if (unfiltered->t != found->t) ++differing;
      }
    }
  }
  EXPECT_GT(differing, 50);
}

TEST(QueryFilter, ShapesHitOnlyUnfilteredInstances) {
  int differing = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Filtered all(seed);
    for (int i = 0; i < Filtered::kFilters; ++i) {
      const QueryFilter filter = all.filter(i);
      const Scene left = seen_by(all.scene, filter, filter.types.value_or(QueryTypes::Colliding));
      const SceneTracer tracer(left);
      QueryFilter every;
      every.types = QueryTypes::All;
      for (int shape = 0; shape < 20; ++shape) {
        const OrientedBox box{all.random.vector() * 20.0, glm::abs(all.random.vector()) * 2.0, all.random.rotation()};
        const DVec3 way = all.random.vector() * 20.0;
        const auto found = sweep_box(all.tracer, box, way, filter);
        const auto expected = sweep_box(tracer, box, way, every);
        ASSERT_EQ(found.has_value(), expected.has_value());
        if (found) {
          EXPECT_EQ(found->fraction, expected->fraction);
          EXPECT_EQ(found->instance, expected->instance);
          EXPECT_EQ(found->voxel, expected->voxel);
          EXPECT_EQ(found->normal, expected->normal);
        }
        const auto unfiltered = sweep_box(all.tracer, box, way, every);
        if (unfiltered && (!found || unfiltered->fraction != found->fraction)) ++differing;
        const auto boxes = overlaps(all.tracer, box, filter);
        const auto boxes_left = overlaps(tracer, box, every);
        ASSERT_EQ(boxes.size(), boxes_left.size());
        for (std::size_t n = 0; n < boxes.size(); ++n) EXPECT_EQ(boxes[n].voxel, boxes_left[n].voxel);
        EXPECT_EQ(overlaps(all.tracer, box.centre, 2.0, filter).size(),
                  overlaps(tracer, box.centre, 2.0, every).size());
        if (shape % 5 != 0) continue;
        EXPECT_EQ(depenetration(all.tracer, box, 3.0, filter).has_value(),
                  depenetration(tracer, box, 3.0, every).has_value());
      }
    }
  }
  EXPECT_GT(differing, 100);
}

// A field of water, 10 deep, over a floor of stone; neither stone nor wood is transparent.
TEST(QueryFilter, RaysPassThroughWaterOfFields) {
  DensityGrid field;
  field.edit({{-8, -8, -8}, {9, 13, 9}}, [&](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(p.y - 10), p.y < 0 ? kStone : kWater};
  });
  Scene scene = scene_of(std::move(field), {});
  const SceneTracer tracer(scene);
  QueryFilter filter;
  filter.types = QueryTypes::Colliding;
  const Ray down{{0.3, 30.0, 0.4}, {0.0, -1.0, 0.0}};
  EXPECT_NEAR(first_hit(tracer, down)->t, 20.0, 1e-3);
  const auto floor = first_hit(tracer, down, kInfinity, filter);
  ASSERT_TRUE(floor);
  // A cell is stone if any of its solid samples is stone: the last such cell begins at 0.
  EXPECT_NEAR(floor->t, 30.0, 1e-3);
  EXPECT_EQ(floor->type, kStone);
  EXPECT_TRUE(any_hit(tracer, down, 31.0, filter));
  EXPECT_FALSE(any_hit(tracer, down, 29.0, filter));
  EXPECT_FALSE(any_hit(tracer, {{0.3, 5.0, 0.4}, {0.0, 1.0, 0.0}}, kInfinity, filter));
  // A rod without width falls as far.
  const auto rod = sweep_box(tracer, {{0.3, 30.0, 0.4}, DVec3(0.0)}, {0.0, -60.0, 0.0});
  ASSERT_TRUE(rod);
  EXPECT_NEAR(rod->fraction * 60.0, floor->t, 1e-4);
}

TEST(QueryFilter, MovingBodyIgnoresItself) {
  Scene scene;
  ASSERT_TRUE(scene.types.add({}).has_value());
  SceneGrid ship;
  ship.grid.fill_box({{0, 0, 0}, {6, 3, 4}}, 1);
  ship.pivot = {3.0, 1.5, 2.0};
  Instance instance;
  instance.grid = scene.add_grid(std::move(ship));
  const InstanceHandle own = scene.add_instance(instance);
  instance.position = {20.0, 0.0, 0.0};
  const InstanceHandle other = scene.add_instance(instance);
  const SceneTracer tracer(scene);
  const OrientedBox box{DVec3(0.0), {3.0, 1.5, 2.0}};
  SlideOptions options;
  options.pushes_out = false;
  EXPECT_EQ(move_and_slide(tracer, box, {30.0, 0.0, 0.0}, options).centre, DVec3(0.0));
  options.filter.ignored = {&own, 1};
  const SlideResult moved = move_and_slide(tracer, box, {30.0, 0.0, 0.0}, options);
  EXPECT_NEAR(moved.centre.x, 14.0, 2e-3);
  ASSERT_EQ(moved.contacts.size(), 1U);
  EXPECT_EQ(moved.contacts[0].kind, SlideContact::Kind::Wall);
  EXPECT_EQ(moved.contacts[0].hit.instance, other);
  EXPECT_EQ(moved.contacts[0].hit.voxel.x, 0);
}

TEST(SlideContact, ReportsTheHit) {
  Scene scene;
  ASSERT_TRUE(scene.types.add({}).has_value());
  VoxelProperties wood;
  wood.name = "wood";
  ASSERT_TRUE(scene.types.add(wood).has_value());
  SceneGrid room;
  room.grid.fill_box({{0, 0, 0}, {20, 1, 20}}, 1);
  room.grid.fill_box({{15, 1, 0}, {16, 10, 20}}, 2);
  room.grid.fill_box({{0, 5, 0}, {20, 6, 20}}, 2);
  Instance instance;
  instance.grid = scene.add_grid(std::move(room));
  const InstanceHandle placed = scene.add_instance(instance);
  const SceneTracer tracer(scene);
  SlideOptions options;
  options.floor = FloorOptions{};
  const OrientedBox player{{10.0, 3.0, 10.0}, {0.4, 0.9, 0.4}};

  // Falls onto the floor and slides along the wall.
  const SlideResult fallen = move_and_slide(tracer, player, {8.0, -4.0, 0.0}, options);
  ASSERT_EQ(fallen.contacts.size(), 2U);
  EXPECT_EQ(fallen.contacts[0].kind, SlideContact::Kind::Floor);
  EXPECT_EQ(fallen.contacts[0].hit.type, 1);
  EXPECT_EQ(fallen.contacts[0].hit.voxel.y, 0);
  EXPECT_EQ(fallen.contacts[1].kind, SlideContact::Kind::Wall);
  EXPECT_EQ(fallen.contacts[1].hit.type, 2);
  EXPECT_TRUE(fallen.is_on_floor);
  EXPECT_EQ(fallen.floor.instance, placed);
  EXPECT_EQ(fallen.floor.type, 1);
  EXPECT_EQ(fallen.floor.normal, fallen.floor_normal);

  const SlideResult risen = move_and_slide(tracer, player, {0.0, 4.0, 0.0}, options);
  ASSERT_EQ(risen.contacts.size(), 1U);
  EXPECT_EQ(risen.contacts[0].kind, SlideContact::Kind::Ceiling);
  EXPECT_FALSE(risen.is_on_floor);
  EXPECT_EQ(risen.floor.instance, InstanceHandle());

  const OrientedBox sunk{{10.0, 1.5, 10.0}, {0.4, 0.9, 0.4}};
  const SlideResult out = move_and_slide(tracer, sunk, {0.0, -0.1, 0.0}, options);
  ASSERT_FALSE(out.contacts.empty());
  EXPECT_EQ(out.contacts[0].kind, SlideContact::Kind::Inside);
  EXPECT_TRUE(overlaps(tracer, {out.centre, sunk.half_size}).empty());
}

// A box on a lift, and on a raft that turns and drifts, keeps its position relative to the floor.
TEST(SlideContact, MovingFloorsCarryBodies) {
  Scene scene;
  ASSERT_TRUE(scene.types.add({}).has_value());
  SceneGrid raft;
  raft.grid.fill_box({{0, 0, 0}, {12, 1, 12}}, 1);
  raft.pivot = {6.0, 0.5, 6.0};
  Instance instance;
  instance.grid = scene.add_grid(std::move(raft));
  instance.voxel_size = 0.5;
  const InstanceHandle handle = scene.add_instance(instance);
  SceneTracer tracer(scene);
  SlideOptions options;
  options.floor = FloorOptions{};
  OrientedBox box{{1.5, 2.0, 0.5}, {0.2, 0.5, 0.2}};
  SlideResult moved = move_and_slide(tracer, box, {0.0, -2.0, 0.0}, options);
  ASSERT_TRUE(moved.is_on_floor);
  box.centre = moved.centre;
  const SceneGrid& grid = scene.grids()[instance.grid];
  const DVec3 on_raft = grid_from_world(scene.instances()[handle], grid, box.centre);
  for (int frame = 0; frame < 240; ++frame) {
    const Instance before = scene.instances()[moved.floor.instance];
    Instance& raft_now = scene.edit(handle);
    raft_now.position += DVec3(0.03, 0.02 * std::sin(0.1 * frame), 0.0);
    raft_now.rotation = glm::angleAxis(0.01 * frame, DVec3(0.0, 1.0, 0.0));
    tracer.update();
    box.centre = transformed_point(before, scene.instances()[handle], box.centre);
    moved = move_and_slide(tracer, box, {0.0, -0.01, 0.0}, options);
    ASSERT_TRUE(moved.is_on_floor) << frame;
    box.centre = moved.centre;
  }
  EXPECT_LT(glm::length(grid_from_world(scene.instances()[handle], grid, box.centre) - on_raft), 0.01);
  EXPECT_GT(box.centre.x, 5.0);
  // An invalid placement moves nothing.
  Instance nowhere;
  nowhere.voxel_size = 0.0;
  EXPECT_EQ(transformed_point(nowhere, instance, {1.0, 2.0, 3.0}), DVec3(1.0, 2.0, 3.0));
}

// A point, a rod and a plate stop in the same way as boxes, also between two voxels, and slide along a wall.
TEST(QueryFilter, StopsBoxesWithoutSize) {
  Scene scene;
  ASSERT_TRUE(scene.types.add({}).has_value());
  SceneGrid ground;
  ground.grid.fill_box({{-20, -3, -20}, {20, 0, 20}}, 1);
  Instance instance;
  instance.grid = scene.add_grid(std::move(ground));
  scene.add_instance(instance);
  const SceneTracer tracer(scene);
  for (const DVec3 half : {DVec3(0.0), DVec3(1.0, 0.0, 0.0), DVec3(1.0, 0.0, 1.0), DVec3(0.0, 1.0, 0.0)}) {
    for (const DVec3 at : {DVec3(0.3, 5.0, 0.7), DVec3(0.0, 5.0, 0.0), DVec3(-2.0, 5.0, 0.5)}) {
      for (const double way : {-6.1, -60.0, -6e5}) {
        const auto hit = sweep_box(tracer, {at, half}, {0.0, way, 0.0});
        ASSERT_TRUE(hit) << half.x << half.y << half.z << " " << way;
        EXPECT_NEAR(hit->fraction * -way, 5.0 - half.y, 1e-6);
        EXPECT_NEAR(hit->normal.y, 1.0, 1e-9);
        const SlideResult moved = move_and_slide(tracer, {at, half}, {0.0, way, 0.0});
        EXPECT_GT(moved.centre.y, half.y);
      }
      EXPECT_FALSE(overlaps(tracer, {{at.x, -1.5, at.z}, half}).empty());
      EXPECT_FALSE(overlaps(tracer, {{at.x, -1.0, at.z}, half}).empty());
      EXPECT_TRUE(overlaps(tracer, {{at.x, half.y, at.z}, half}).empty());
      // Tests the ground's upper face and its side.
      EXPECT_FALSE(sweep_box(tracer, {{at.x, half.y, at.z}, half}, {12.0, 0.0, 3.0}));
      EXPECT_FALSE(sweep_box(tracer, {{20.0 + half.x, 5.0, at.z}, half}, {0.0, -30.0, 0.0}));
    }
  }
}

}  // namespace
}  // namespace quoin
