// Bodies among voxels with shapes: slabs, stairs, fences, doors. The oracle is a list of all boxes, from `shape_at`.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/scene_query.h>
#include <quoin/scene/solid_shapes.h>
#include <quoin/scene/sweep.h>

#include "core/work/nightly_for_tests.h"
#include "scene/query/field_scene_for_tests.h"

namespace quoin {
namespace {

constexpr VoxelType kStone = 1, kSlab = 2, kStairs = 3, kFence = 4, kDoor = 5, kFlower = 6, kBeam = 7, kWater = 8;

VoxelShapes stairs() {
  const auto quarter = [](int x, int z) { return VoxelShape::box({x, 8, z}, {x + 8, 16, z + 8}); };
  const auto at = [](StairCorner corner) { return ShapeCondition{.corner = corner}; };
  using enum StairCorner;
  return *VoxelShapes::from_rules(
      {.parts = {{.shape = VoxelShape::box({0, 0, 0}, {16, 8, 16})},
                 {.shape = quarter(8, 0), .when = {at(Straight), at(OuterLeft), at(InnerLeft), at(InnerRight)}},
                 {.shape = quarter(8, 8), .when = {at(Straight), at(OuterRight), at(InnerLeft), at(InnerRight)}},
                 {.shape = quarter(0, 0), .when = {at(InnerLeft)}},
                 {.shape = quarter(0, 8), .when = {at(InnerRight)}}},
       .neighbours = ShapeNeighbours::Stairs});
}

// A post of 24 sixteenths, with bars towards other fences.
VoxelShapes fence() {
  std::vector<ShapePart> parts = {{.shape = *VoxelShape::from_elements({{.min = {6, 0, 6}, .max = {10, 24, 10}}})}};
  for (int turns = 0; turns < 4; ++turns) {
    const AxisOrientation turn = AxisOrientation::quarter_turns(1, turns);
    parts.push_back({.shape = *VoxelShape::from_elements({{.min = {10, 6, 7}, .max = {16, 24, 9}}}),
                     .orientation = turn,
                     .when = {{.connected = {turn.apply(Direction::PosX)}}}});
  }
  return *VoxelShapes::from_rules({.parts = std::move(parts), .neighbours = ShapeNeighbours::Connected});
}

VoxelRegistry shaped_types() {
  VoxelRegistry types;
  EXPECT_TRUE(types.add({.name = "stone"}));
  EXPECT_TRUE(types.add({.name = "slab", .shapes = VoxelShape::box({0, 0, 0}, {16, 8, 16})}));
  EXPECT_TRUE(types.add({.name = "stairs",
                         .state_bits = 3,
                         .orientations = StateOrientations::about_y_and_upside_down(),
                         .shapes = stairs()}));
  EXPECT_TRUE(types.add({.name = "fence", .shapes = fence()}));
  EXPECT_TRUE(types.add({.name = "door",
                         .state_bits = 2,
                         .orientations = StateOrientations::about_y(),
                         .shapes = VoxelShape::box({13, 0, 0}, {16, 16, 16})}));
  EXPECT_TRUE(types.add({.name = "flower", .shapes = VoxelShape::crossed_plates()}));
  ShapeElement beam{.min = {-8, 6, 7}, .max = {30, 10, 9}};
  beam.turn = ElementTurn{.axis = 1, .degrees = 22.5F};
  EXPECT_TRUE(types.add({.name = "beam", .shapes = *VoxelShape::from_elements({beam})}));
  EXPECT_TRUE(types.add({.name = "water",
                         .visibility = Visibility::Transparent,
                         .collides = false,
                         .state_bits = 4,
                         .shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid})}));
  return types;
}

struct ShapedWorld {
  Scene scene;
  GridHandle grid;
  ShapedWorld(Grid voxels, const Instance& placed = {}) {
    scene.types = shaped_types();
    SceneGrid made;
    made.grid = std::move(voxels);
    grid = scene.add_grid(std::move(made));
    Instance instance = placed;
    instance.grid = grid;
    scene.add_instance(instance);
  }
};

// All boxes that bodies meet, in the space of the grid.
std::vector<DBox> all_boxes(const Grid& grid, const VoxelRegistry& types) {
  std::vector<DBox> boxes;
  const IBox bounds = grid.bounds();
  for (int z = bounds.min.z; z < bounds.max.z; ++z) {
    for (int y = bounds.min.y; y < bounds.max.y; ++y) {
      for (int x = bounds.min.x; x < bounds.max.x; ++x) {
        const IVec3 at{x, y, z};
        const VoxelType type = grid.get(at);
        if (type == kAir || !types[type].collides) continue;
        const ShapeModel* model = shape_at(grid, types, at);
        if (model == nullptr) boxes.push_back({DVec3(at), DVec3(at) + 1.0});
        if (model == nullptr) continue;
        for (const ModelBox& box : model->boxes) {
          if (!box.collides) continue;
          DBox found{DVec3(box.min), DVec3(box.max)};
          if (box.is_turned) {  // the beam's only box
            found = {};
            for (const ModelFace& face : model->faces) {
              for (const Vec3& corner : face.corners) found.extend(DVec3(corner));
            }
          }
          boxes.push_back({found.min + DVec3(at), found.max + DVec3(at)});
        }
      }
    }
  }
  return boxes;
}

Grid random_voxels(Random& random, int count) {
  Grid grid;
  const auto below = [&](int n) { return static_cast<int>(std::min(std::abs(random.share()) * n, n - 1.0)); };
  for (int i = 0; i < count; ++i) {
    const IVec3 at = IVec3(random.vector() * 5.0);
    grid.set(at, static_cast<VoxelType>(1 + below(8)), {.state = static_cast<std::uint32_t>(below(4))});
  }
  return grid;
}

double distance_of(const DBox& box, DVec3 point) {
  return glm::length(point - glm::clamp(point, box.min, box.max));
}

// Returns the fraction of the first overlap of a box along the axes with an obstacle; infinity if there is none.
double first_overlap(const DBox& obstacle, DVec3 centre, DVec3 half, DVec3 displacement) {
  double enter = 0.0;
  double leave = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = obstacle.min[axis] - half[axis] - centre[axis];
    const double high = obstacle.max[axis] + half[axis] - centre[axis];
    const double d = displacement[axis];
    if (d == 0.0 && (low >= 0.0 || high <= 0.0)) return INFINITY;
    if (d == 0.0) continue;
    enter = std::max(enter, std::min(low / d, high / d));
    leave = std::min(leave, std::max(low / d, high / d));
  }
  return enter < leave ? enter : INFINITY;
}

TEST(ShapeBodies, OverlapAndSweepMeetTheBoxesOfShapesExactly) {
  Random random(5);
  int hits = 0;
  int overlapping = 0;
  for (int world = 0; world < cases(8, 60); ++world) {
    const ShapedWorld made(random_voxels(random, 30 + 40 * (world % 4)));
    const SceneTracer tracer(made.scene);
    const std::vector<DBox> boxes = all_boxes(made.scene.grids()[made.grid].grid, made.scene.types);
    for (int i = 0; i < 150; ++i) {
      const DVec3 centre = random.vector() * 8.0;
      const DVec3 half = glm::abs(random.vector()) * 0.8 + 0.01;
      const DVec3 displacement = random.direction() * (i % 3 == 0 ? 100.0 : 4.0);
      double first = INFINITY;
      double nearest = INFINITY;
      for (const DBox& box : boxes) {
        first = std::min(first, first_overlap(box, centre, half, displacement));
        nearest = std::min(nearest, distance_of(box, centre));
      }
      const OrientedBox body{centre, half, {1, 0, 0, 0}};
      ASSERT_EQ(!overlaps(tracer, body).empty(), first == 0.0) << world << " " << i;
      const double radius = half.x + 1e-3;
      ASSERT_EQ(!overlaps(tracer, centre, radius).empty(), nearest < radius - 1e-9) << world << " " << i;
      overlapping += first == 0.0 ? 1 : 0;
      const auto hit = sweep_box(tracer, body, displacement);
      ASSERT_EQ(hit.has_value(), first <= 1.0) << world << " " << i;
      if (!hit) continue;
      ASSERT_NEAR(hit->fraction, first, 1e-6) << world << " " << i;
      hits += first > 0.0 ? 1 : 0;
    }
  }
  EXPECT_GT(hits, 120);
  EXPECT_GT(overlapping, 40);
}

// Also for turned grids, and bodies that are turned or round.
TEST(ShapeBodies, SweepsStopExactlyBeforeTheFirstOverlap) {
  Random random(9);
  int hits = 0;
  for (int world = 0; world < cases(8, 30); ++world) {
    Instance placed;
    placed.rotation = random.rotation();
    placed.voxel_size = 1.0 + 0.4 * random.share();
    placed.mirrored = world % 2 == 0;
    const ShapedWorld made(random_voxels(random, 60), placed);
    const SceneTracer tracer(made.scene);
    for (int i = 0; i < 60; ++i) {
      const OrientedBox box{random.vector() * 8.0, glm::abs(random.vector()) + 0.1, random.rotation()};
      const Capsule capsule{0.1 + std::abs(random.share()), random.vector() * 8.0, random.vector()};
      const DVec3 displacement = random.direction() * (i % 2 == 0 ? 25.0 : 3.0);
      const auto check = [&](const auto& body, const auto& hit) {
        const auto at = [&](double t) {
          auto there = body;
          there.centre += t * displacement;
          return !overlaps(tracer, there).empty();
        };
        if (at(0.0)) {
          ASSERT_TRUE(hit && hit->fraction == 0.0 && hit->depth > 0.0);
          return;
        }
        const double until = hit ? hit->fraction : 1.0;
        for (int step = 0; step < 40; ++step) {
          const double t = until * step / 40.0 - (hit ? 1e-7 : 0.0);
          ASSERT_TRUE(t < 0.0 || !at(t)) << world << " " << i << " at " << t;
        }
        if (!hit) return;
        ++hits;
        EXPECT_LT(glm::dot(hit->normal, displacement), 0.0);
        EXPECT_TRUE(at(hit->fraction + 1e-6)) << world << " " << i;
      };
      check(box, sweep_box(tracer, box, displacement));
      check(capsule, sweep_capsule(tracer, capsule, displacement));
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(hits, 60);
}

TEST(ShapeBodies, NeverTunnelThroughAThinDoor) {
  Grid grid;
  grid.fill_box({{0, -3, -3}, {1, 4, 4}}, kDoor);
  ShapedWorld made(std::move(grid));
  SceneTracer tracer(made.scene);
  for (const double speed : {3.0, 100.0, 1e4, 1e6}) {
    const auto hit = sweep_box(tracer, {{2.0, 0.3, 0.4}, DVec3(0.2), {1, 0, 0, 0}}, {-speed, 0.0, 0.0});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->fraction * speed, 0.8, 1e-6 * speed);
    EXPECT_EQ(hit->normal, DVec3(1, 0, 0));
    EXPECT_EQ(hit->type, kDoor);
  }
  // The doors open: the state turns them by a quarter.
  for (int z = -3; z < 4; ++z) {
    for (int y = -3; y < 4; ++y) made.scene.edit(made.grid).grid.set_data({0, y, z}, {.state = 1});
  }
  tracer.update();
  EXPECT_FALSE(sweep_box(tracer, {{2.0, 0.3, 0.5}, DVec3(0.2), {1, 0, 0, 0}}, {-9.0, 0.0, 0.0}));
}

TEST(ShapeBodies, FencesReachOutsideTheirVoxel) {
  Grid grid;
  for (int z = 0; z < 5; ++z) grid.set({0, 0, z}, kFence);
  const ShapedWorld made(std::move(grid));
  const SceneTracer tracer(made.scene);
  const auto jump = [&](double height) {
    return sweep_box(tracer, {{2.0, height + 0.4, 2.4}, DVec3(0.3, 0.4, 0.3), {1, 0, 0, 0}}, {-4.0, 0.0, 0.0});
  };
  ASSERT_TRUE(jump(1.45));
  EXPECT_EQ(jump(1.45)->voxel, IVec3(0, 0, 2));
  EXPECT_EQ(jump(1.45)->type, kFence);
  EXPECT_FALSE(jump(1.55));
  const auto overlap = overlaps(tracer, {0.5, 1.4, 2.5}, 0.05);
  ASSERT_EQ(overlap.size(), 1U);
  EXPECT_EQ(overlap[0].voxel, IVec3(0, 0, 2));
}

SlideOptions walking() {
  SlideOptions options;
  options.floor = FloorOptions{.step_height = 0.6, .snap_distance = 0.6};
  return options;
}

TEST(ShapeBodies, PlayerStandsOnASlabAtHalf) {
  Grid grid;
  grid.fill_box({{-4, -1, -4}, {5, 0, 5}}, kStone);
  grid.fill_box({{1, 0, -4}, {5, 1, 5}}, kSlab);
  const ShapedWorld made(std::move(grid));
  const SceneTracer tracer(made.scene);
  OrientedBox player{{2.5, 3.0, 0.5}, {0.3, 0.9, 0.3}, {1, 0, 0, 0}};
  for (int i = 0; i < 40; ++i) player.centre = move_and_slide(tracer, player, {0.0, -0.3, 0.0}, walking()).centre;
  EXPECT_NEAR(player.centre.y - player.half_size.y, 0.5, 2e-3);
  // Walks down from the slab and up again.
  for (int i = 0; i < 40; ++i) player.centre = move_and_slide(tracer, player, {-0.1, -0.05, 0.0}, walking()).centre;
  EXPECT_NEAR(player.centre.y - player.half_size.y, 0.0, 2e-3);
  EXPECT_NEAR(player.centre.x, -1.5, 0.2);
  SlideResult result;
  for (int i = 0; i < 40; ++i) {
    result = move_and_slide(tracer, player, {0.1, -0.05, 0.0}, walking());
    player.centre = result.centre;
    EXPECT_TRUE(result.is_on_floor) << i;
  }
  EXPECT_NEAR(player.centre.y - player.half_size.y, 0.5, 2e-3);
  EXPECT_EQ(result.floor.type, kSlab);
  Capsule round{0.3, {2.5, 3.0, 0.5}, {0.0, 0.6, 0.0}};
  for (int i = 0; i < 40; ++i) round.centre = move_and_slide(tracer, round, {0.0, -0.3, 0.0}, walking()).centre;
  EXPECT_NEAR(round.centre.y - 0.9, 0.5, 2e-3);
}

TEST(ShapeBodies, PlayerWalksUpARealStaircase) {
  for (const std::uint32_t state : {0U, 1U, 2U, 3U}) {
    SCOPED_TRACE(state);
    const DVec3 ahead(AxisOrientation::quarter_turns(1, static_cast<int>(state)).apply(IVec3(1, 0, 0)));
    const IVec3 front(ahead);
    Grid grid;
    grid.fill_box({{-20, -1, -20}, {21, 0, 21}}, kStone);
    // Ten stairs, then a slab on top of the last height, and a fence behind it.
    for (int i = 0; i < 10; ++i) {
      for (int side = -1; side <= 1; ++side) {
        const IVec3 at = front * (i + 2) + IVec3(front.z, 0, front.x) * side + IVec3(0, i, 0);
        grid.set(at, kStairs, {.state = state});
        for (int y = 0; y < i; ++y) grid.set({at.x, y, at.z}, kStone);
      }
    }
    for (int i = 12; i < 16; ++i) grid.set(front * i + IVec3(0, 9, 0), kStone);
    for (int i = 13; i < 16; ++i) grid.set(front * i + IVec3(0, 10, 0), kSlab);
    grid.set(front * 15 + IVec3(0, 11, 0), kFence);
    const ShapedWorld made(std::move(grid));
    const SceneTracer tracer(made.scene);
    for (const bool is_round : {false, true}) {
      OrientedBox box{{0.5, 0.91, 0.5}, {0.3, 0.9, 0.3}, {1, 0, 0, 0}};
      Capsule capsule{0.3, box.centre, {0.0, 0.6, 0.0}};
      double highest = 0.0;
      DVec3 centre = box.centre;
      double falling = 0.0;
      SlideResult result;
      for (int frame = 0; frame < 600; ++frame) {
        falling = result.is_on_floor ? 0.01 : falling + 0.004;
        const DVec3 step = 0.06 * ahead - DVec3(0.0, falling, 0.0);
        result =
            is_round ? move_and_slide(tracer, capsule, step, walking()) : move_and_slide(tracer, box, step, walking());
        ASSERT_LT(result.centre.y - centre.y, 0.61) << "one step at a time, frame " << frame;
        centre = box.centre = capsule.centre = result.centre;
        highest = std::max(highest, centre.y - 0.9);
      }
      EXPECT_NEAR(centre.y - 0.9, 10.5, 5e-3) << "on the slab on top";
      EXPECT_NEAR(glm::dot(centre - 0.5, ahead), 14.575, 5e-3) << "the fence stops the player";
      EXPECT_NEAR(highest, 10.5, 5e-3);
      EXPECT_TRUE(result.is_on_floor);
    }
  }
}

TEST(ShapeBodies, DepenetrationFindsTheNearestPlaceAmongShapes) {
  Grid grid;
  grid.fill_box({{-4, 0, -4}, {5, 1, 5}}, kSlab);
  grid.fill_box({{-4, 2, -4}, {5, 3, 5}}, kStone);
  const ShapedWorld made(std::move(grid));
  const SceneTracer tracer(made.scene);
  // There are 1.5 voxels between the slabs and the ceiling.
  const OrientedBox box{{0.5, 1.0, 0.5}, {0.3, 0.74, 0.3}, {1, 0, 0, 0}};
  const auto away = depenetration(tracer, box, 2.0);
  ASSERT_TRUE(away);
  EXPECT_NEAR(away->y, 0.24, 1e-9);
  EXPECT_EQ(away->x, 0.0);
  const auto round = depenetration(tracer, Capsule{0.3, box.centre, {0.0, 0.44, 0.0}}, 2.0);
  ASSERT_TRUE(round);
  EXPECT_TRUE(overlaps(tracer, Capsule{0.3, box.centre + *round, {0.0, 0.44, 0.0}}).empty());
  EXPECT_FALSE(depenetration(tracer, {{0.5, 1.25, 0.5}, {0.3, 0.76, 0.3}, {1, 0, 0, 0}}, 0.2));
}

TEST(ShapeBodies, SolidShapesHaveTheBoxesOfShapes) {
  Random random(2);
  Grid grid = random_voxels(random, 80);
  grid.fill_box({{60, 0, 0}, {68, 2, 2}}, kFence);
  VoxelRegistry types = shaped_types();
  SolidShapes shapes({.boxes = true, .faces = true});
  const auto found = [&] {
    std::vector<DBox> boxes;
    for (const IVec3 chunk : grid.chunks()) {
      const DVec3 low(chunk * kChunkEdge);
      for (const IBox& box : shapes.boxes(chunk)) {
        for (int z = box.min.z; z < box.max.z; ++z) {
          for (int y = box.min.y; y < box.max.y; ++y) {
            for (int x = box.min.x; x < box.max.x; ++x)
              boxes.push_back({DVec3(x, y, z) + low, DVec3(x, y, z) + 1.0 + low});
          }
        }
      }
      for (const DBox& box : shapes.shape_boxes(chunk)) boxes.push_back({box.min + low, box.max + low});
    }
    return boxes;
  };
  const auto sorted = [](std::vector<DBox> boxes) {
    const auto key = [](const DBox& box) {
      const auto rounded = [](double v) { return std::lround(v * 1e4); };
      return std::array{rounded(box.min.x), rounded(box.min.y), rounded(box.min.z),
                        rounded(box.max.x), rounded(box.max.y), rounded(box.max.z)};
    };
    std::vector<std::array<long, 6>> keys;
    for (const DBox& box : boxes) keys.push_back(key(box));
    std::sort(keys.begin(), keys.end());
    return keys;
  };
  shapes.update(grid, types);
  EXPECT_EQ(sorted(found()), sorted(all_boxes(grid, types)));
  for (int i = 0; i < 20; ++i) {
    const IVec3 at = i % 2 == 0 ? IVec3(63 + i % 3, i % 2, 0) : IVec3(random.vector() * 5.0);
    i % 3 == 0 ? (void)grid.set_data(at, {.state = 1}) : (void)grid.set(at, i % 4 == 0 ? kAir : kStairs);
    shapes.update(grid, types);
    ASSERT_EQ(sorted(found()), sorted(all_boxes(grid, types))) << i;
  }
  VoxelProperties slab = types[kSlab];
  slab.shapes = VoxelShape::box({0, 0, 0}, {16, 4, 16});
  types.replace(kSlab, slab);
  shapes.update(grid, types);
  EXPECT_EQ(sorted(found()), sorted(all_boxes(grid, types)));
  // Fences do not connect to glass, which is as solid as stone.
  grid.fill_box({{60, 0, 2}, {68, 1, 3}}, kStone);
  shapes.update(grid, types);
  VoxelProperties stone = types[kStone];
  stone.visibility = Visibility::Transparent;
  types.replace(kStone, stone);
  shapes.update(grid, types);
  EXPECT_EQ(sorted(found()), sorted(all_boxes(grid, types)));
}

}  // namespace
}  // namespace quoin
