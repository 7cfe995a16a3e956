// After each `take`, one state of the scene is shown: all surfaces, their light, and the instances to draw.

#include <quoin/core/memory.h>
#include <quoin/live/live_meshes.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <set>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/live/live_light.h>
#include <quoin/mesh/blocky.h>
#include <quoin/render/surface_light.h>

#include "core/coordinates/chunk_order.h"
#include "core/death_for_tests.h"
#include "live/live_test_support.h"

namespace quoin {
namespace {

using LitQuads = std::vector<std::pair<std::uint64_t, FaceLight>>;

LitQuads lit_quads(const QuadBuffer& quads, const BlockVector<FaceLight>& light) {
  LitQuads all;
  for (std::size_t i = 0; i < quads.size(); ++i)
    all.emplace_back(quads[i].bits, light.empty() ? FaceLight{} : light[i]);
  std::sort(all.begin(), all.end());
  return all;
}

/// The blocky surfaces of one state of a scene, made on this thread.
class ExpectedSurfaces {
 public:
  using Surfaces = std::map<std::pair<GridHandle, std::tuple<int, int, int>>, LitQuads>;

  explicit ExpectedSurfaces(bool is_lit) : is_lit_(is_lit) {}

  /// Cost: meshes all chunks of the grids that differ from those of the last call.
  const Surfaces& of(const Scene& scene) {
    if (is_lit_) light_.update(scene, {1});
    const bool has_other_types = scene.types.changes_since(types_).empty() == false;
    std::set<GridHandle> drawn = grids_of_drawn(scene, InstanceFilter::Visible);
    std::erase_if(surfaces_, [&](const auto& each) { return !drawn.contains(each.first.first); });
    std::erase_if(cursors_, [&](const auto& each) { return !drawn.contains(each.first); });
    for (const GridHandle handle : drawn) {
      const Grid& grid = scene.grids()[handle].grid;
      ChangeCursor& cursor = cursors_[handle];
      const bool is_changed = grid.has_changed_since(cursor);
      cursor = grid.cursor();
      if (is_changed || has_other_types) mesh(scene, handle, grid);
    }
    return surfaces_;
  }
  [[nodiscard]] const SceneLight& light() const { return light_; }

 private:
  void mesh(const Scene& scene, GridHandle handle, const Grid& grid) {
    std::erase_if(surfaces_, [&](const auto& each) { return each.first.first == handle; });
    const GridLight lit = light_.of(handle);
    std::optional<SurfaceLight> surface_light;
    if (is_lit_) surface_light.emplace(*lit.light, *lit.voxels, scene.types);
    QuadBuffer quads;
    QuadBuffer split;
    BlockVector<FaceLight> corners;
    for (const IVec3 chunk : grid.chunks()) {
      mesher_.mesh(grid.neighbourhood(chunk), scene.types, {}, quads);
      if (is_lit_) surface_light->split(quads, chunk, LightMerging::Linear, split, corners);
      if (!quads.empty()) {
        surfaces_[{handle, {chunk.x, chunk.y, chunk.z}}] = lit_quads(is_lit_ ? split : quads, corners);
      }
    }
  }

  bool is_lit_;
  BlockyMesher mesher_;
  SceneLight light_;
  ChangeCursor types_;
  std::map<GridHandle, ChangeCursor> cursors_;
  Surfaces surfaces_;
};

/// A game that edits a scene and draws the surfaces and instances that LiveMeshes returns.
class WatchedGame {
 public:
  /// Meshes the scene as it is.
  WatchedGame(Scene& scene, unsigned workers, bool is_lit)
      : scene_(&scene), meshes_(options_of(workers)), expected_(is_lit), is_lit_(is_lit) {
    if (is_lit) meshes_.use_light(light_);
    meshes_.finish(scene, {});
    states_[0] = scene.snapshot();  // `finish` called `update` some times
    apply(meshes_.take());
    first_update_ = meshes_.shown_update();
    scene.instances().for_each([&](InstanceHandle handle, const Instance&) { known_.insert(handle); });
    drawn_ = known_;
  }

  static LiveMeshOptions options_of(unsigned workers) {
    LiveMeshOptions options;
    options.region_edge = kChunkEdge;  // as the surfaces that it is compared with
    options.workers = {workers};
    return options;
  }

  /// Runs one frame after the game's edits, and checks the surfaces and instances that are shown.
  void frame(std::size_t max_bytes = ~std::size_t{0}) {
    const std::uint64_t number = meshes_.update(*scene_, {});
    states_[number] = scene_->snapshot();
    note_instances(number);
    take(max_bytes);
  }
  void take(std::size_t max_bytes = ~std::size_t{0}) {
    apply(meshes_.take(max_bytes));
    check();
  }
  void finish() {
    meshes_.finish(*scene_, {});
    const std::uint64_t number = meshes_.update(*scene_, {});
    states_[number] = scene_->snapshot();
    note_instances(number);
    take();
    EXPECT_EQ(meshes_.pending(), 0U);
    EXPECT_EQ(meshes_.shown_update(), number);
  }

  [[nodiscard]] LiveMeshes& meshes() { return meshes_; }
  [[nodiscard]] LiveLight& light() { return light_; }
  [[nodiscard]] int states_shown() const { return states_shown_; }
  /// Updates that were not shown by the end of the next frame.
  [[nodiscard]] std::uint64_t longest_delay() const { return longest_delay_; }

 private:
  void apply(std::vector<SurfaceUpdate> updates) {
    for (SurfaceUpdate& update : updates) {
      const std::pair key{update.grid, std::tuple{update.chunk.x, update.chunk.y, update.chunk.z}};
      shown_.erase(key);
      if (update.surface != nullptr) shown_[key] = lit_quads(update.surface->quads, update.surface->light);
    }
    is_new_ |= !updates.empty();
  }

  // As LiveMeshes describes it.
  void note_instances(std::uint64_t number) {
    std::set<InstanceHandle> now;
    scene_->instances().for_each([&](InstanceHandle handle, const Instance&) { now.insert(handle); });
    for (const InstanceHandle handle : now) {
      if (!known_.contains(handle)) changes_.emplace_back(number, handle, true);
    }
    for (const InstanceHandle handle : known_) {
      if (!now.contains(handle)) changes_.emplace_back(number, handle, false);
    }
    known_ = std::move(now);
  }

  void check() {
    const std::uint64_t number = meshes_.shown_update();
    std::erase_if(changes_, [&](const auto& change) {
      const auto& [at, handle, is_added] = change;
      if (at > number) return false;
      if (is_added) drawn_.insert(handle);
      if (!is_added) drawn_.erase(handle);
      return true;
    });
    if (!states_.empty()) longest_delay_ = std::max(longest_delay_, states_.rbegin()->first - number);
    // Updates before the first state changed nothing.
    const Scene& state = states_.at(number <= first_update_ ? 0 : number);
    if (number != checked_) ++states_shown_;
    if (number == checked_ && !std::exchange(is_new_, false)) return;
    checked_ = number;
    std::set<InstanceHandle> instances;
    state.instances().for_each([&](InstanceHandle handle, const Instance&) { instances.insert(handle); });
    ASSERT_EQ(drawn_, instances) << "instances of update " << number;
    ASSERT_TRUE(shown_ == expected_.of(state)) << "surfaces of update " << number;
    if (is_lit_) check_light(state);
    if (number > first_update_) std::erase_if(states_, [&](const auto& each) { return each.first < number; });
  }

  void check_light(const Scene& state) {
    for (const GridHandle handle : state.grids().handles()) {
      const PropagatedLight& light = *light_.shown().of(handle).light;
      const PropagatedLight& wanted = *expected_.light().of(handle).light;
      const IBox box = state.grids()[handle].grid.bounds();
      for (int i = 0; i < 64; ++i) {
        const auto in = [&](int low, int high) {
          return low - 3 + static_cast<int>(random_() % unsigned(high - low + 6));
        };
        const IVec3 at{in(box.min.x, box.max.x), in(box.min.y, box.max.y), in(box.min.z, box.max.z)};
        ASSERT_EQ(light.at(at), wanted.at(at));
      }
    }
  }

  Scene* scene_;
  LiveLight light_{{{}, {1}}};
  LiveMeshes meshes_;
  ExpectedSurfaces expected_;
  bool is_lit_;
  std::uint64_t first_update_ = 0;
  std::map<std::uint64_t, Scene> states_;  // by update
  ExpectedSurfaces::Surfaces shown_;
  std::set<InstanceHandle> known_, drawn_;
  std::vector<std::tuple<std::uint64_t, InstanceHandle, bool>> changes_;
  std::mt19937 random_{1};
  bool is_new_ = true;
  std::uint64_t checked_ = ~std::uint64_t{0};
  int states_shown_ = 0;
  std::uint64_t longest_delay_ = 0;
};

// Lets workers proceed for a while, as a frame does that draws.
void draw_for(std::mt19937& random) {
  if (random() % 3 == 0) std::this_thread::sleep_for(std::chrono::microseconds(random() % 1500));
}

/// Ground of 2 x 1 x 2 chunks.
struct Ground {
  Ground() {
    scene.types = live_types();
    SceneGrid ground;
    ground.grid.fill_box({{0, 0, 0}, {128, 24, 128}}, 3);
    ground.grid.fill_box({{50, 20, 50}, {80, 24, 80}}, 2);
    handle = scene.add_grid(std::move(ground));
    scene.add_instance({"ground", handle});
  }
  Grid& grid() { return scene.edit(handle).grid; }
  // A place near the border of two or four chunks.
  static IVec3 place(std::mt19937& random) {
    const int along = 1 + static_cast<int>(random() % 126);
    const int near = 62 + static_cast<int>(random() % 4);
    const int y = 8 + static_cast<int>(random() % 17);
    return random() % 2 == 0 ? IVec3{near, y, along} : IVec3{along, y, near};
  }

  Scene scene;
  GridHandle handle;
};

constexpr int kDigs = kIsSlow ? 60 : 1000;

class LiveEpochs : public testing::TestWithParam<unsigned> {};  // the number of workers

TEST_P(LiveEpochs, ShowBothSidesOfAChunkBorderTogether) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    Ground ground;
    WatchedGame game(ground.scene, GetParam(), false);
    std::mt19937 random(seed);
    for (int dig = 0; dig < kDigs; ++dig) {
      ground.grid().set(Ground::place(random), random() % 3 == 0 ? VoxelType{3} : kAir);
      game.frame();
      draw_for(random);
      if (random() % 4 == 0) game.take();
      ASSERT_FALSE(HasFatalFailure()) << "seed " << seed << ", dig " << dig;
    }
    game.finish();
    EXPECT_GT(game.states_shown(), 10);
  }
}

TEST_P(LiveEpochs, ShowNewFacesWithTheirLight) {
  for (const unsigned seed : {1U, 2U}) {
    Ground ground;
    WatchedGame game(ground.scene, GetParam(), true);
    std::mt19937 random(seed);
    for (int dig = 0; dig < kDigs / 2; ++dig) {
      IVec3 at = Ground::place(random);
      if (random() % 2 == 0) at.y = 23;  // in daylight
      ground.grid().set(at, random() % 3 == 0 ? VoxelType{3} : kAir);
      if (random() % 50 == 0) ground.grid().fill_box({{at.x, 10, at.z}, at + IVec3{3, 9, 3}}, kAir);
      game.frame();
      draw_for(random);
      if (random() % 4 == 0) game.take();
      ASSERT_FALSE(HasFatalFailure()) << "seed " << seed << ", dig " << dig;
    }
    game.finish();
    EXPECT_GT(game.states_shown(), 2);
  }
}

/// A ship of several chunks. Pieces are cut off and welded again.
struct Ship {
  explicit Ship(unsigned seed) : random(seed) {
    scene.types = live_types();
    SceneGrid ship;
    ship.grid.fill_box({{0, 0, 0}, {150, 20, 20}}, 3);
    handle = scene.add_grid(std::move(ship));
    scene.add_instance({"ship", handle});
  }
  struct Piece {
    GridHandle grid;
    InstanceHandle instance;
    IBox box;
  };

  void edit() {
    if (pieces.size() > 3 || (!pieces.empty() && random() % 3 == 0)) return weld();
    IBox box;
    box.min = {static_cast<int>(random() % 130), static_cast<int>(random() % 12), static_cast<int>(random() % 12)};
    box.max = box.min + IVec3{5 + static_cast<int>(random() % 80), 8, 8};
    const auto overlaps = [&](const Piece& piece) { return !intersect(piece.box, box).empty(); };
    if (std::any_of(pieces.begin(), pieces.end(), overlaps)) return weld();
    scene.edit(handle).grid.fill_box(box, kAir);
    // Some pieces show a grid that is there already.
    const bool is_copy = random() % 3 == 0 && !pieces.empty();
    SceneGrid cut;
    cut.grid.fill_box(box, 3);
    const GridHandle grid = is_copy ? pieces.front().grid : scene.add_grid(std::move(cut));
    pieces.push_back({grid, scene.add_instance({"piece", grid}), box});
  }
  void weld() {
    const std::size_t i = random() % pieces.size();
    const Piece piece = pieces[i];
    pieces.erase(pieces.begin() + static_cast<std::ptrdiff_t>(i));
    scene.edit(handle).grid.fill_box(piece.box, 3);
    scene.remove_instance(piece.instance);
    const auto has_grid = [&](const Piece& other) { return other.grid == piece.grid; };
    if (std::none_of(pieces.begin(), pieces.end(), has_grid)) scene.remove_grid(piece.grid);
  }

  std::mt19937 random;
  Scene scene;
  GridHandle handle;
  std::vector<Piece> pieces;
};

TEST_P(LiveEpochs, ShowPiecesOfAGridOnce) {
  for (const bool is_lit : {false, true}) {
    Ship ship(GetParam());
    WatchedGame game(ship.scene, GetParam(), is_lit);
    for (int cut = 0; cut < kDigs / (is_lit ? 4 : 1); ++cut) {
      ship.edit();
      // Pieces fly away meanwhile, which needs no new surfaces.
      for (const Ship::Piece& piece : ship.pieces) ship.scene.edit(piece.instance).position.y += 0.1;
      game.frame();
      draw_for(ship.random);
      ASSERT_FALSE(HasFatalFailure()) << "cut " << cut;
    }
    game.finish();
  }
}

TEST_P(LiveEpochs, ShowOneStateAfterRandomEdits) {
  for (unsigned seed = 0; seed < (kIsSlow ? 2U : 12U); ++seed) {
    SceneEditor editor(seed);
    WatchedGame game(editor.scene, GetParam(), seed % 3 == 2);
    for (int i = 0; i < 60; ++i) {
      for (int n = editor.below(3); n >= 0; --n) editor.edit();
      game.frame(editor.below(2) == 0 ? 1 : ~std::size_t{0});
      if (editor.below(3) == 0) std::this_thread::sleep_for(std::chrono::microseconds(editor.below(2000)));
      ASSERT_FALSE(HasFatalFailure()) << "seed " << seed << ", edit " << i;
    }
    game.finish();
    ASSERT_FALSE(HasFatalFailure()) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Workers, LiveEpochs, testing::Values(1U, 2U, 4U),
                         [](const auto& workers) { return "Workers" + std::to_string(workers.param); });

// Returns a grid of voxels and a field, which do not touch each other.
SceneGrid voxels_and_field() {
  SceneGrid both;
  both.grid.fill_box({{0, 0, 0}, {128, 10, 64}}, 3);
  both.field.add_box({2.0, 102.0, 2.0}, {126.0, 120.0, 62.0}, 1);
  return both;
}

TEST(LiveEpochsOfFields, ShowVoxelsAndFieldsTogether) {
  Scene scene;
  scene.types = live_types();
  const GridHandle handle = scene.add_grid(voxels_and_field());
  scene.add_instance({"both", handle});
  LiveMeshes meshes({.workers = {2}});
  meshes.finish(scene, {});
  EXPECT_FALSE(meshes.take().empty());
  std::mt19937 random(3);
  int shown = 0;
  for (int i = 0; i < (kIsSlow ? 30 : 200); ++i) {
    const int x = 4 + i / 2 * 7 % 120;
    Grid& grid = scene.edit(handle).grid;
    grid.set({x, 9, 30}, grid.get({x, 9, 30}) == kAir ? VoxelType{3} : kAir);
    const DVec3 at{static_cast<double>(x), 120.0, 30.0};
    if (i % 2 == 0) scene.edit(handle).field.remove_sphere(at, 3.0);
    if (i % 2 == 1) scene.edit(handle).field.add_sphere(at, 3.0, 1);
    meshes.update(scene, {});
    std::set<SurfaceContent> contents;
    for (const SurfaceUpdate& update : meshes.take()) contents.insert(update.content);
    EXPECT_NE(contents.size(), 1U) << "edit " << i;
    shown += contents.empty() ? 0 : 1;
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
  }
  EXPECT_GT(shown, 3);
}

// A field that leaves takes its surfaces along in one step with the voxels that replace it.
TEST(LiveEpochsOfFields, ShowReplacedGridsOnce) {
  Scene scene;
  scene.types = live_types();
  InstanceHandle placed = scene.add_instance({"first", scene.add_grid(voxels_and_field())});
  LiveMeshes meshes({.workers = {2}});
  meshes.finish(scene, {});
  std::map<GridHandle, std::set<SurfaceContent>> shown;
  const auto take = [&] {
    std::map<GridHandle, int> surfaces;
    for (const SurfaceUpdate& update : meshes.take()) {
      if (update.surface == nullptr) shown[update.grid].erase(update.content);
      if (update.surface != nullptr) shown[update.grid].insert(update.content);
    }
    std::erase_if(shown, [](const auto& each) { return each.second.empty(); });
    ASSERT_EQ(shown.size(), 1U) << "one grid at a time";
    EXPECT_EQ(shown.begin()->second.size(), 2U);
  };
  take();
  for (int i = 0; i < 40; ++i) {
    scene.remove_grid(scene.instances()[placed].grid);
    placed = scene.add_instance({"next", scene.add_grid(voxels_and_field())});
    meshes.update(scene, {});
    ASSERT_NO_FATAL_FAILURE(take()) << i;
    std::this_thread::sleep_for(std::chrono::microseconds(300 * (i % 8)));
  }
  meshes.finish(scene, {});
  ASSERT_NO_FATAL_FAILURE(take());
  EXPECT_EQ(shown.begin()->first, scene.instances()[placed].grid);
}

TEST(LiveEpochsOfLight, AllowDestroyingEitherFirst) {
  Ground ground;
  for (const bool light_first : {true, false}) {
    auto light = std::make_unique<LiveLight>();
    auto meshes = std::make_unique<LiveMeshes>();
    meshes->use_light(*light);
    meshes->update(ground.scene, {});
    if (light_first) {
      light.reset();
      meshes->finish(ground.scene, {});
      EXPECT_FALSE(meshes->take().empty());
    } else {
      meshes.reset();
      light->finish(ground.scene);
      EXPECT_FALSE(light->is_late());
    }
  }
}

TEST(LiveEpochsOfLight, ChangeWhileMeshesStay) {
  Ground ground;
  LiveLight first;
  LiveLight second;
  LiveMeshes meshes;
  ShownSurfaces shown;
  const auto expect_lit = [&](bool is_lit) {
    meshes.finish(ground.scene, {});
    shown.apply(meshes.take());
    EXPECT_EQ(shown.all().size(), 4U);
    for (const SurfaceUpdate& each : shown.all()) {
      EXPECT_EQ(each.surface->light.size(), is_lit ? each.surface->quads.size() : 0U);
    }
  };
  expect_lit(false);
  meshes.use_light(first);
  expect_lit(true);
  EXPECT_TRUE(first.take()) << "it shows other light";
  EXPECT_FALSE(first.take());
  EXPECT_FALSE(first.is_late());
  meshes.use_light(second);
  ground.grid().set({64, 23, 64}, kAir);
  expect_lit(true);
  EXPECT_TRUE(second.take());
  first.update(ground.scene);
  EXPECT_TRUE(first.is_late()) << "it is on its own again";
  meshes.use_light(nullptr);
  expect_lit(false);
}

// The light of a new lamp has to be shown, although no face changes.
TEST(LiveEpochsOfLight, OnReadyReachesTheEnd) {
  Ground ground;
  std::mutex mutex;
  std::condition_variable called;
  int calls = 0;
  LiveLight light;
  LiveMeshes meshes({.on_ready = [&] {
    const std::lock_guard lock(mutex);
    ++calls;
    called.notify_all();
  }});
  meshes.use_light(light);
  for (int i = 0; i < 20; ++i) {
    for (int seen = -1;;) {
      const std::uint64_t number = meshes.update(ground.scene, {});
      (void)meshes.take();
      if (meshes.pending() == 0) {
        EXPECT_EQ(meshes.shown_update(), number);
        break;
      }
      std::unique_lock lock(mutex);
      ASSERT_TRUE(called.wait_for(lock, std::chrono::seconds(20), [&] { return calls != seen; })) << i;
      seen = calls;
    }
    // Below the ground there is no face; a grid without an instance has no surface.
    if (i % 2 == 0) ground.grid().set({20 + i, 10, 20}, 1);
    if (i % 2 == 1) (void)ground.scene.add_grid({});
  }
}

TEST(LiveEpochsOfLight, InstancesThatMoveNeedNoSurfaces) {
  Ground ground;
  LiveLight light;
  LiveMeshes meshes;
  meshes.use_light(light);
  const InstanceHandle second = ground.scene.add_instance({"second", ground.handle});
  meshes.finish(ground.scene, {});
  (void)meshes.take();
  for (int i = 0; i < 5; ++i) {
    ground.scene.edit(second).position.x += 1.0;
    const std::uint64_t number = meshes.update(ground.scene, {});
    EXPECT_EQ(meshes.pending(), 0U) << "no light is asked for";
    EXPECT_TRUE(meshes.take().empty());
    EXPECT_EQ(meshes.shown_update(), number);
  }
  // A grid that an instance shows for the first time needs surfaces, although its light is known.
  SceneGrid hidden;
  hidden.grid.set({1, 1, 1}, 3);
  const GridHandle grid = ground.scene.add_grid(std::move(hidden));
  meshes.finish(ground.scene, {});
  EXPECT_TRUE(meshes.take().empty());
  ground.scene.add_instance({"third", grid});
  meshes.finish(ground.scene, {});
  EXPECT_EQ(meshes.take().size(), 1U);
}

TEST(LiveEpochsDeathTest, RejectLightThatOtherMeshesUse) {
  LiveLight light;
  LiveMeshes meshes;
  LiveMeshes others;  // starts its threads before the process of the death test
  meshes.use_light(light);
  QUOIN_EXPECT_MISTAKE(others.use_light(light), "one receiver at a time");
}

}  // namespace
}  // namespace quoin
