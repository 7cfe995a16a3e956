// Scene queries in unloaded areas.

#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/scene/scene_query.h>
#include <quoin/scene/sweep.h>

namespace quoin {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A partial grid with a floor (y below 0). The chunks in a box are loaded, except those that a test omits.
struct PartialScene {
  Scene scene;
  GridHandle grid;
  InstanceHandle instance;

  explicit PartialScene(const DQuat& rotation = DQuat(1, 0, 0, 0), double voxel_size = 1.0) {
    VoxelProperties stone;
    stone.name = "stone";
    (void)scene.types.add(std::move(stone));
    SceneGrid content;
    content.grid.make_partial();
    grid = scene.add_grid(std::move(content));
    Instance placed;
    placed.grid = grid;
    placed.rotation = rotation;
    placed.voxel_size = voxel_size;
    instance = scene.add_instance(std::move(placed));
  }
  void load(IVec3 chunk) { scene.edit(grid).grid.load_chunk(chunk, Chunk(chunk.y < 0 ? VoxelType{1} : kAir)); }
  void load_around(int reach) {
    for (int z = -reach; z < reach; ++z) {
      for (int y = -reach; y < reach; ++y) {
        for (int x = -reach; x < reach; ++x) load({x, y, z});
      }
    }
  }
  void unload(IVec3 chunk) { scene.edit(grid).grid.unload_chunk(chunk); }
};

QueryFilter met() {
  return {.unloaded = UnloadedChunks::Block};
}
QueryFilter passed() {
  return {.unloaded = UnloadedChunks::Ignore};
}
const OrientedBox kBody{DVec3(32.0, 10.0, 32.0), DVec3(0.4, 0.9, 0.4)};

TEST(UnloadedRays, ReportDistanceToUnloadedChunk) {
  PartialScene world;
  world.load_around(2);
  const SceneTracer tracer(world.scene);
  const Ray down{{32.0, 100.0, 32.0}, {0.0, -1.0, 0.0}};
  const auto hit = first_hit(tracer, down);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->t, 100.0);
  EXPECT_EQ(hit->unloaded_t, kInfinity);
  EXPECT_FALSE(hit->is_unloaded);

  // From above the loaded chunks: hits the same voxel, with a possible earlier hit in unloaded chunks.
  const Ray from_above{{32.0, 200.0, 32.0}, {0.0, -2.0, 0.0}};
  const auto uncertain = first_hit(tracer, from_above);
  ASSERT_TRUE(uncertain);
  EXPECT_EQ(uncertain->t, 100.0);
  EXPECT_EQ(uncertain->unloaded_t, 0.0);
  const auto stopped = first_hit(tracer, from_above, kInfinity, met());
  ASSERT_TRUE(stopped);
  EXPECT_TRUE(stopped->is_unloaded);
  EXPECT_TRUE(stopped->starts_inside);
  EXPECT_EQ(stopped->voxel, IVec3(0, 192, 0));
  EXPECT_EQ(stopped->type, kAir);
}

TEST(UnloadedRays, HitUnloadedChunksIfTheyBlock) {
  PartialScene world;
  world.load_around(2);
  const SceneTracer tracer(world.scene);
  const Ray level{{1.0, 70.5, 32.0}, {1.0, 0.0, 0.0}};
  EXPECT_FALSE(first_hit(tracer, level));
  EXPECT_FALSE(any_hit(tracer, level));
  EXPECT_FALSE(first_hit(tracer, level, 126.0, met()));
  EXPECT_FALSE(any_hit(tracer, level, 126.0, met()));
  const auto end = first_hit(tracer, level, kInfinity, met());
  ASSERT_TRUE(end);
  EXPECT_EQ(end->t, 127.0);
  EXPECT_EQ(end->voxel, IVec3(128, 64, 0));
  EXPECT_EQ(end->face, Direction::NegX);
  EXPECT_EQ(end->normal, DVec3(-1.0, 0.0, 0.0));
  EXPECT_TRUE(any_hit(tracer, level, kInfinity, met()));
  EXPECT_FALSE(
      first_hit(tracer, level, kInfinity, {.ignored = {&world.instance, 1}, .unloaded = UnloadedChunks::Block}));
}

TEST(UnloadedRays, WholeGridsHaveNoUnloadedChunks) {
  Scene scene;
  SceneGrid content;
  content.grid.set(0, 0, 0, 1);
  Instance placed;
  placed.grid = scene.add_grid(std::move(content));
  scene.add_instance(std::move(placed));
  const SceneTracer tracer(scene);
  EXPECT_FALSE(first_hit(tracer, {{10.0, 10.0, 10.0}, {1.0, 0.0, 0.0}}, kInfinity, met()));
  EXPECT_TRUE(overlaps(tracer, DVec3(50.0), 2.0).empty());
  EXPECT_FALSE(sweep_box(tracer, kBody, {0.0, -100.0, 0.0}));
}

TEST(UnloadedRays, EmptyPartialGridIsUnloadedEverywhere) {
  PartialScene world;
  const SceneTracer tracer(world.scene);
  EXPECT_FALSE(first_hit(tracer, {{0.5, 0.5, 0.5}, {1.0, 0.0, 0.0}}));
  EXPECT_TRUE(first_hit(tracer, {{0.5, 0.5, 0.5}, {1.0, 0.0, 0.0}}, kInfinity, met()));
  ASSERT_EQ(overlaps(tracer, DVec3(50.0), 2.0).size(), 1U);
  EXPECT_TRUE(overlaps(tracer, DVec3(50.0), 2.0, passed()).empty());
}

// Finds the first unloaded chunk on a ray in small steps.
std::optional<double> by_steps(const Grid& grid, const Ray& ray, double max_t, double step) {
  for (double t = 0.0; t <= max_t; t += step) {
    const DVec3 at = ray.origin + t * ray.direction;
    if (!grid.is_loaded(chunk_of(IVec3(glm::floor(at))))) return t;
  }
  return std::nullopt;
}

TEST(UnloadedRays, MatchSmallStepsOnRandomRays) {
  std::mt19937 random(7);
  PartialScene world;
  std::uniform_int_distribution<int> place(-3, 3);
  for (int i = 0; i < 250; ++i) world.load({place(random), place(random), place(random)});
  const SceneTracer tracer(world.scene);
  const Grid& grid = world.scene.grids()[world.grid].grid;
  std::uniform_real_distribution<double> along(-150.0, 150.0);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  int ends = 0;
  for (int i = 0; i < 400; ++i) {
    Ray ray{{along(random), std::abs(along(random)), along(random)},
            {share(random), std::abs(share(random)), share(random)}};
    ray.direction = glm::normalize(ray.direction);
    const auto expected = by_steps(grid, ray, 60.0, 0.01);
    const auto hit = first_hit(tracer, ray, 60.0, met());
    if (hit && !hit->is_unloaded) continue;
    const bool is_at_end = hit && hit->t > 59.9;
    EXPECT_TRUE(hit.has_value() == expected.has_value() || is_at_end) << i;
    if (!hit || !expected) continue;
    ++ends;
    EXPECT_NEAR(hit->t, *expected, 0.3) << i;  // steps may skip a chunk's corner
    EXPECT_LE(hit->t, *expected) << i;
    EXPECT_FALSE(grid.is_loaded(chunk_of(hit->voxel))) << i;
  }
  EXPECT_GT(ends, 100);
}

TEST(UnloadedRays, FollowLoadingAndUnloading) {
  PartialScene world;
  world.load_around(2);
  SceneTracer tracer(world.scene);
  const Ray level{{1.0, 70.5, 32.0}, {1.0, 0.0, 0.0}};
  world.load({2, 1, 0});
  tracer.update();
  ASSERT_TRUE(first_hit(tracer, level, kInfinity, met()));
  EXPECT_EQ(first_hit(tracer, level, kInfinity, met())->t, 191.0);
  world.unload({0, 1, 0});
  tracer.update();
  EXPECT_EQ(first_hit(tracer, level, kInfinity, met())->t, 0.0);
  world.scene.edit(world.instance).position = {0.0, 64.0, 0.0};
  tracer.update();
  EXPECT_EQ(first_hit(tracer, level, kInfinity, met())->t, 127.0);
  world.scene.remove_instance(world.instance);
  tracer.update();
  EXPECT_FALSE(first_hit(tracer, level, kInfinity, met()));
}

TEST(UnloadedRays, RequireBothFieldSamplesLoaded) {
  PartialScene world;
  world.scene.edit(world.grid).field.make_partial();
  for (int x = -1; x < 1; ++x) {
    for (int y = -1; y < 1; ++y) {
      for (int z = -1; z < 1; ++z) {
        world.load({x, y, z});
        world.scene.edit(world.grid).field.load_air_chunk({x, y, z});
      }
    }
  }
  const SceneTracer tracer(world.scene);
  const auto up = first_hit(tracer, {{5.5, 5.5, 5.5}, {1.0, 0.0, 0.0}}, kInfinity, met());
  ASSERT_TRUE(up);
  EXPECT_EQ(up->t, 57.5);  // at 63, the last loaded sample
  const auto down = first_hit(tracer, {{5.5, 5.5, 5.5}, {-1.0, 0.0, 0.0}}, kInfinity, met());
  ASSERT_TRUE(down);
  EXPECT_EQ(down->t, 69.5);
  const auto box = sweep_box(tracer, {{5.5, 5.5, 5.5}, DVec3(0.5)}, {100.0, 0.0, 0.0});
  ASSERT_TRUE(box);
  EXPECT_NEAR(box->fraction * 100.0, 57.0, 1e-6);
}

TEST(UnloadedSweeps, BodyDoesNotFallThroughUnloadedGround) {
  PartialScene world;
  world.load_around(1);
  world.unload({0, -1, 0});  // the ground
  SceneTracer tracer(world.scene);
  const DVec3 fall(0.0, -50.0, 0.0);
  const auto hit = sweep_box(tracer, kBody, fall);
  ASSERT_TRUE(hit);
  EXPECT_TRUE(hit->is_unloaded);
  EXPECT_NEAR(hit->fraction * 50.0, 9.1, 1e-6);
  EXPECT_EQ(hit->normal, DVec3(0.0, 1.0, 0.0));
  EXPECT_EQ(hit->voxel, IVec3(0, -64, 0));
  EXPECT_FALSE(sweep_box(tracer, kBody, fall, passed()));
  const Capsule round{0.4, kBody.centre, {0.0, 0.5, 0.0}};
  ASSERT_TRUE(sweep_capsule(tracer, round, fall));
  EXPECT_TRUE(sweep_capsule(tracer, round, fall)->is_unloaded);
  EXPECT_FALSE(sweep_capsule(tracer, round, fall, passed()));

  SlideOptions walks;
  walks.floor = FloorOptions{};
  const SlideResult waits = move_and_slide(tracer, kBody, fall, walks);
  EXPECT_TRUE(waits.is_waiting);
  EXPECT_TRUE(waits.is_blocked);
  EXPECT_FALSE(waits.is_on_floor);
  EXPECT_GT(waits.centre.y, 0.9);
  EXPECT_EQ(waits.contacts.front().kind, SlideContact::Kind::Unloaded);
  walks.filter = passed();
  EXPECT_LT(move_and_slide(tracer, kBody, fall, walks).centre.y, -30.0);

  world.load({0, -1, 0});
  tracer.update();
  walks.filter = {};
  const SlideResult stands = move_and_slide(tracer, kBody, fall, walks);
  EXPECT_TRUE(stands.is_on_floor);
  EXPECT_FALSE(stands.is_waiting);
  EXPECT_NEAR(stands.centre.y, 0.9, 0.01);
}

TEST(UnloadedSweeps, BoxStaysInUnloadedChunks) {
  PartialScene world;
  world.load_around(1);
  SceneTracer tracer(world.scene);
  const OrientedBox outside{{200.0, 10.0, 10.0}, DVec3(0.4)};
  for (const bool has_floor : {false, true}) {
    SlideOptions options;
    if (has_floor) options.floor = FloorOptions{};
    const SlideResult result = move_and_slide(tracer, outside, {0.0, -5.0, 0.0}, options);
    EXPECT_EQ(result.centre, outside.centre);
    EXPECT_EQ(result.displacement, DVec3(0.0));
    EXPECT_TRUE(result.is_waiting);
  }
  EXPECT_FALSE(depenetration(tracer, outside, 2.0));
  EXPECT_EQ(depenetration(tracer, outside, 2.0, passed()), DVec3(0.0));
}

TEST(UnloadedSweeps, BoxesAreNotPushedIntoUnloadedChunks) {
  PartialScene world;
  world.load_around(1);
  // In the ground, one voxel from the border of the unloaded area.
  world.scene.edit(world.grid).grid.fill_box({{0, 0, 0}, {64, 64, 64}}, 1);
  world.scene.edit(world.grid).grid.fill_box({{50, 0, 0}, {56, 64, 64}}, kAir);
  const SceneTracer tracer(world.scene);
  const OrientedBox body{{63.0, 32.5, 32.5}, DVec3(0.4)};
  const auto out = depenetration(tracer, body, 10.0);
  ASSERT_TRUE(out);
  EXPECT_LT(out->x, -6.9);
  const auto wrong = depenetration(tracer, body, 10.0, passed());
  ASSERT_TRUE(wrong);
  EXPECT_GT(wrong->x, 1.0);
}

TEST(UnloadedSweeps, WorkInTurnedAndScaledGrids) {
  const DQuat turned = glm::angleAxis(0.4, glm::normalize(DVec3(1.0, 2.0, 3.0)));
  PartialScene world(turned, 0.25);
  world.load_around(1);
  world.scene.edit(world.grid).grid.clear();
  const SceneTracer tracer(world.scene);
  // Along the grid's x axis: loaded up to voxel 64, which is 16 in the world.
  const DVec3 along = turned * DVec3(1.0, 0.0, 0.0);
  const auto ray = first_hit(tracer, {DVec3(0.0), along}, kInfinity, met());
  ASSERT_TRUE(ray);
  EXPECT_NEAR(ray->t, 16.0, 1e-9);
  EXPECT_NEAR(glm::length(ray->normal + along), 0.0, 1e-9);
  const auto ball = sweep_capsule(tracer, {1.0, DVec3(0.0), DVec3(0.0)}, along * 100.0);
  ASSERT_TRUE(ball);
  EXPECT_TRUE(ball->is_unloaded);
  EXPECT_NEAR(ball->fraction * 100.0, 15.0, 1e-6);
}

TEST(UnloadedOverlaps, AreReportedOncePerInstance) {
  PartialScene world;
  world.load_around(1);
  const SceneTracer tracer(world.scene);
  EXPECT_TRUE(overlaps(tracer, kBody).empty());
  const OrientedBox at_border{{64.0, 10.0, 10.0}, DVec3(0.4)};
  const auto found = overlaps(tracer, at_border);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(found[0].is_unloaded);
  EXPECT_EQ(found[0].voxel, IVec3(64, 0, 0));
  // A hit with a loaded voxel takes precedence.
  const auto ground = overlaps(tracer, OrientedBox{{64.0, 0.0, 10.0}, DVec3(0.4)});
  ASSERT_EQ(ground.size(), 1U);
  EXPECT_FALSE(ground[0].is_unloaded);
  EXPECT_EQ(overlaps(tracer, DVec3(70.0, 10.0, 10.0), 3.0).size(), 1U);
  EXPECT_TRUE(overlaps(tracer, at_border, passed()).empty());
}

// Air outside of a grid's extent is known: rays and shapes pass it at any distance, without a walk over its chunks.
TEST(UnloadedExtent, KnownAirDoesNotBlock) {
  PartialScene world;
  world.scene.edit(world.grid).grid.set_extent({{-2, -2, -2}, {2, 2, 2}});
  const SceneTracer tracer(world.scene);
  EXPECT_FALSE(first_hit(tracer, {{32.0, 200.0, 32.0}, {0.3, 1.0, 0.2}}, kInfinity, met()));
  EXPECT_FALSE(any_hit(tracer, {{200.0, 10.0, 32.0}, {1.0, 0.0, 0.0}}, kInfinity, met()));
  const auto hit = first_hit(tracer, {{32.0, 1e8, 32.0}, {0.0, -1.0, 0.0}}, kInfinity, met());
  ASSERT_TRUE(hit);
  EXPECT_TRUE(hit->is_unloaded);
  EXPECT_EQ(hit->t, 1e8 - 128.0);
  EXPECT_EQ(hit->voxel, IVec3(0, 64, 0));
  OrientedBox body = kBody;
  body.centre = {32.0, 1000.0, 32.0};
  EXPECT_TRUE(overlaps(tracer, body, met()).empty());
  EXPECT_FALSE(sweep_box(tracer, body, {1e7, 0.0, 0.0}, met()));
  const auto fall = sweep_box(tracer, body, {0.0, -1000.0, 0.0}, met());
  ASSERT_TRUE(fall);
  EXPECT_TRUE(fall->is_unloaded);
  EXPECT_NEAR(fall->fraction, (1000.0 - 0.9 - 128.0) / 1000.0, 1e-9);
}

}  // namespace
}  // namespace quoin
