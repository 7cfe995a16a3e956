#include "world_window.h"

#include <chrono>
#include <thread>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <quoin/io/formats.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/store/world_maintenance.h>
#include <quoin/terrain/terrain.h>

#include "cpu_backend.h"
#include "document.h"
#include "viewer_fixture.h"

namespace quoin::viewer {
namespace {

constexpr EndlessTerrain kLand{7, 2, false};

class WorldWindowTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto made = WorldStore::create(folder_.file("tried.quoin"));
    if (!made && made.error().code == ErrorCode::Unsupported) GTEST_SKIP() << to_string(made.error());
  }
  [[nodiscard]] std::filesystem::path path() const { return folder_.file("world.quoin"); }
  [[nodiscard]] std::filesystem::path other(const char* name) const { return folder_.file(name); }

  void make_small() const { ASSERT_TRUE(save_scene(small_scene(), path())); }
  void make_endless() const {
    auto world = StreamedWorld::open_or_create(path());
    ASSERT_TRUE(world) << to_string(world.error());
    ASSERT_TRUE(world->add_terrain(kLand));
    ASSERT_TRUE(world->flush());
  }
  [[nodiscard]] std::unique_ptr<Document> open(const WorldOptions& options = {}) const {
    auto document = Document::open(path(), {}, {}, options);
    if (!document) {
      ADD_FAILURE() << to_string(document.error());
      return std::make_unique<Document>();
    }
    return std::move(*document);
  }
  // Does the same as the window does per frame.
  static void settle(WorldWindow& world, const Camera& camera) {
    const auto start = std::chrono::steady_clock::now();
    do {
      ASSERT_TRUE(world.plan(camera));
      if (world.has_chunks_to_move()) {
        ASSERT_TRUE(world.move(camera));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      ASSERT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
    } while (!world.is_complete());
  }
  static Camera camera_at(DVec3 position, DVec3 direction = {1.0, -0.4, 0.3}) {
    return look_along(position, direction, 1.0).value();
  }
  static SceneHit hit_below(const Document& document, DVec3 from) {
    const SceneTracer tracer(document.scene());
    const auto hit = first_hit(tracer, {from, {0.0, -1.0, 0.0}});
    EXPECT_TRUE(hit.has_value());
    return hit.value_or(SceneHit{});
  }

  ScratchFolder folder_{"world_window"};
};

Scene whole_land(const IBox& chunks) {
  Scene scene;
  const auto generator = make_terrain_generator(kLand, scene.types);
  EXPECT_TRUE(generator);
  SceneGrid land;
  for (int z = chunks.min.z; z < chunks.max.z; ++z) {
    for (int y = chunks.min.y; y < chunks.max.y; ++y) {
      for (int x = chunks.min.x; x < chunks.max.x; ++x) {
        land.grid.put_chunk({x, y, z}, (*generator)->make({x, y, z}, {})->voxels);
      }
    }
  }
  Instance instance;
  instance.grid = scene.add_grid(std::move(land));
  scene.add_instance(instance);
  return scene;
}

WorldOptions near_by() {
  WorldOptions options;
  options.distance = 160.0;
  return options;
}

TEST_F(WorldWindowTest, LoadsSmallWorldInFull) {
  make_small();
  const auto document = open();
  ASSERT_NE(document->world(), nullptr);
  settle(*document->world(), camera_at({5000.0, 40.0, 0.0}));
  EXPECT_EQ(document->scene().voxel_count(), small_scene().scene.voxel_count());
  EXPECT_FALSE(document->is_dirty());
  EXPECT_EQ(document->world()->first_camera(1.5).forward, direction_of(View::Iso));
}

TEST_F(WorldWindowTest, LoadsWideWorldAroundCamera) {
  Scene scene;
  (void)scene.types.add(VoxelProperties{}).value();
  SceneGrid wide;
  for (int i = 0; i < 8; ++i) wide.grid.fill_box({{4000 * i, 0, 0}, {4000 * i + 32, 32, 32}}, 1);
  Instance instance;
  instance.grid = scene.add_grid(std::move(wide));
  instance.voxel_size = 0.1;
  scene.add_instance(instance);
  ASSERT_TRUE(save_scene(scene, path()));
  WorldOptions options;
  options.distance = 20.0;
  const auto document = open(options);
  EXPECT_FALSE(document->world()->is_whole());
  settle(*document->world(), camera_at({0.0, 10.0, -10.0}));
  EXPECT_GE(document->scene().voxel_count(), 32 * 32 * 32);
}

TEST_F(WorldWindowTest, SavesEditsAutomatically) {
  make_small();
  {
    const auto document = open();
    const Camera camera = camera_at({10.0, 40.0, 10.0});
    settle(*document->world(), camera);
    const SceneHit hit = hit_below(*document, {10.5, 60.0, 30.5});
    ASSERT_TRUE(document->begin_stroke({BrushAction::Place, BrushShape::Box, 1, 3}, hit));
    document->end_stroke();
    EXPECT_FALSE(document->is_dirty());
  }
  const auto again = load_scene(path());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->scene.voxel_count(), small_scene().scene.voxel_count() + 18);
}

TEST_F(WorldWindowTest, UndoesEditsOnlyWhereLoaded) {
  make_endless();
  const auto document = open(near_by());
  const Camera here = camera_at({0.0, 100.0, 0.0});
  const Camera there = camera_at({3000.0, 100.0, 0.0});
  settle(*document->world(), here);
  const SceneHit hit = hit_below(*document, {10.5, 140.0, 30.5});
  const GridHandle land = document->scene().grids().handles().front();
  const auto type_there = [&] { return document->scene().grids()[land].grid.get(hit.voxel); };
  const VoxelType before = type_there();
  ASSERT_NE(before, kAir);
  ASSERT_TRUE(document->begin_stroke({BrushAction::Remove, BrushShape::Sphere, 2, 0}, hit));
  document->end_stroke();
  ASSERT_EQ(type_there(), kAir);

  settle(*document->world(), there);
  ASSERT_FALSE(document->scene().grids()[land].grid.is_loaded(chunk_of(hit.voxel)));
  EXPECT_FALSE(document->undo());
  EXPECT_TRUE(document->history().can_undo());
  settle(*document->world(), here);
  EXPECT_EQ(type_there(), kAir) << "the edit was read back from disk";
  EXPECT_TRUE(document->undo());
  EXPECT_EQ(type_there(), before);
  settle(*document->world(), there);
  EXPECT_FALSE(document->redo());
  settle(*document->world(), here);
  EXPECT_EQ(type_there(), before);
  EXPECT_TRUE(document->redo());
  EXPECT_EQ(type_there(), kAir);
}

TEST_F(WorldWindowTest, OpensWorldReadOnlyWithAnotherWriter) {
  make_small();
  const auto before = std::filesystem::file_size(path());
  {
    const auto writer = WorldStore::open(path(), WorldAccess::Write);
    ASSERT_TRUE(writer);
    const auto document = open();
    ASSERT_NE(document->why_not_edited(), nullptr);
    settle(*document->world(), camera_at({10.0, 40.0, 10.0}));
    EXPECT_EQ(document->scene().voxel_count(), small_scene().scene.voxel_count());
    EXPECT_FALSE(document->can_save_in_place());
    EXPECT_FALSE(
        document->begin_stroke({BrushAction::Place, BrushShape::Box, 1, 3}, hit_below(*document, {10.5, 60.0, 30.5})));
  }
  EXPECT_EQ(std::filesystem::file_size(path()), before);
}

TEST_F(WorldWindowTest, CopiesOnlyToWorldFiles) {
  make_endless();
  const auto document = open(near_by());
  settle(*document->world(), camera_at({0.0, 100.0, 0.0}));
  std::vector<std::string> warnings;
  ASSERT_TRUE(document->write(other("copy.quoin"), warnings));
  const auto checked = check_world(other("copy.quoin"));
  ASSERT_TRUE(checked) << to_string(checked.error());
  const Status refused = document->write(other("copy.vox"), warnings);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
  EXPECT_FALSE(std::filesystem::exists(other("copy.vox")));
  EXPECT_TRUE(document->write(path(), warnings)) << "the world itself";
  EXPECT_TRUE(warnings.empty());
}

TEST_F(WorldWindowTest, CopyReplacesWorldAndKeepsBackup) {
  make_endless();
  const auto document = open(near_by());
  settle(*document->world(), camera_at({0.0, 100.0, 0.0}));
  std::vector<std::string> warnings;
  ASSERT_TRUE(save_scene(small_scene(), other("copy.quoin")));
  EXPECT_EQ(document->write(other("copy.quoin"), warnings, [](double) { return false; }).error().code,
            ErrorCode::Cancelled);
  EXPECT_EQ(load_scene(other("copy.quoin"))->scene.voxel_count(), small_scene().scene.voxel_count());
  ASSERT_TRUE(document->write(other("copy.quoin"), warnings));
  EXPECT_TRUE(warnings.empty());
  EXPECT_NE(load_scene(other("copy.quoin"))->scene.voxel_count(), small_scene().scene.voxel_count());
  const auto kept = load_scene(other("copy.quoin~"));
  ASSERT_TRUE(kept) << to_string(kept.error());
  EXPECT_EQ(kept->scene.voxel_count(), small_scene().scene.voxel_count());
  // A world that is open elsewhere, or that has a write-ahead log, is not replaced.
  const auto game = WorldStore::open(other("copy.quoin"), WorldAccess::Write);
  ASSERT_TRUE(game);
  EXPECT_EQ(document->write(other("copy.quoin"), warnings).error().code, ErrorCode::CannotWrite);
}

// Images of a flight match those of a fully loaded world, as far as chunks are loaded.
TEST_F(WorldWindowTest, FlightMatchesFullyLoadedWorld) {
  make_endless();
  WorldOptions options = near_by();
  options.memory_bytes = std::size_t{64} << 20;
  const auto document = open(options);
  WorldWindow& world = *document->world();
  const Scene whole = whole_land({{0, 0, 0}, {18, 2, 8}});
  const SceneTracer whole_tracer(whole);
  SceneTracer tracer(document->scene());
  std::int64_t compared = 0;
  for (int frame = 0; frame < 120; ++frame) {
    const Camera camera = camera_at({180.0 + 5.0 * frame, 90.0, 256.0}, {1.0, -0.3, 0.2});
    ASSERT_TRUE(world.plan(camera));
    const double complete = world.stats().complete_radius;
    if (world.has_chunks_to_move()) {
      ASSERT_TRUE(world.move(camera));
    }
    tracer.update();
    if (frame == 0) {
      settle(world, camera);
      tracer.update();
    }
    for (int y = 0; y < 24; ++y) {
      for (int x = 0; x < 36; ++x) {
        const Ray ray = ray_through(camera, {x + 0.5, y + 0.5, 36, 24});
        const auto expected = first_hit(whole_tracer, ray, complete - 96.0);
        const auto seen = first_hit(tracer, ray, complete - 96.0);
        ASSERT_EQ(seen.has_value(), expected.has_value()) << frame << ": " << x << ", " << y;
        if (!seen) continue;
        ++compared;
        ASSERT_EQ(seen->voxel, expected->voxel);
        ASSERT_EQ(seen->t, expected->t);
        ASSERT_EQ(seen->type, expected->type);
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
  }
  EXPECT_GT(compared, 10'000);
  EXPECT_GT(world.stats().chunks_unloaded, 0U);
}

TEST_F(WorldWindowTest, DrawingDuringLoadingEndsWithTheFullImage) {
  make_endless();
  const auto document = open(near_by());
  WorldWindow& world = *document->world();
  CpuBackend backend(document->scene(), {InstanceFilter::Visible, {2}, 0.02, {}}, {});
  ViewRequest request;
  request.width = 96;
  request.height = 64;
  request.samples = 1;
  request.camera = camera_at({0.0, 100.0, 0.0});
  bool has_seen = true;
  const auto start = std::chrono::steady_clock::now();
  std::optional<ViewFrame> last;
  int moves = 0;
  while (!last || !last->is_settled || !world.is_complete()) {
    ASSERT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
    backend.show(request);
    ASSERT_TRUE(world.plan(request.camera));
    if (has_seen && world.has_chunks_to_move()) {
      ScenePause pause(backend);
      ASSERT_TRUE(world.move(request.camera));
      has_seen = false;
      last.reset();
      ++moves;
    }
    if (auto frame = backend.take()) {
      has_seen = true;
      last = std::move(frame);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_GT(moves, 1);
  EXPECT_GT(backend.bytes(), 0U);
  RenderOptions options;
  options.width = request.width;
  options.height = request.height;
  options.light = request.light;
  options.environment = marched_environment(request);
  const auto expected = CpuRenderer(document->scene()).render(request.camera, options);
  ASSERT_TRUE(expected);
  EXPECT_EQ(last->colour.rgb, expected->colour.rgb);
}

}  // namespace
}  // namespace quoin::viewer
