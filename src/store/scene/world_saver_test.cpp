#include <quoin/store/world_saver.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>
#include <quoin/io/scene_file.h>
#include <quoin/store/world_maintenance.h>
#include <quoin/terrain/terrain.h>

#include "core/database/connection.h"
#include "io/scene_file/scene_parts.h"
#include "store/scene/world_file.h"
#include "store/world/world_for_tests.h"

namespace quoin {
namespace {

/// Returns the scene's text as a scene file, shortened: equal texts mean equal scenes, to the last bit.
std::string text_of(const Scene& scene) {
  const auto file = scene_file_of(scene);
  if (!file) return to_string(file.error());
  const auto text = write_scene_file(*file);
  if (!text) return to_string(text.error());
  std::string all(reinterpret_cast<const char*>(text->data()), text->size());
  return all.substr(0, 3000) + std::to_string(std::hash<std::string>()(all));
}

/// Returns a scene with every kind of content.
Scene rich_scene() {
  Scene scene;
  scene.types = coloured_types(9);
  SceneGrid ground;
  ground.name = "ground";
  ground.pivot = {1.5, 2.25, -3.0};
  ground.canvas = {{0, 0, 0}, {5, 6, 7}};
  for (int i = 0; i < 12; ++i) {
    ground.grid.put_chunk({i % 4 - 2, i / 4, 40 - i}, random_chunk(static_cast<std::uint32_t>(i), 9));
  }
  ground.grid.set({3, 3, 3}, 4);
  const std::array<std::byte, 3> chest = {std::byte{1}, std::byte{2}, std::byte{3}};
  ground.grid.set_data({3, 3, 3}, {.state = 7, .bytes = chest});
  SceneGrid hill;
  hill.name = std::string("not \xff UTF-8");
  hill.field = DensityGrid(4.0F);
  hill.field.edit({{-20, -20, -20}, {90, 20, 20}}, [](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(p.y) + 0.1F * static_cast<float>(p.x % 7),
                         static_cast<VoxelType>(1 + (p.x & 1))};
  });
  const GridHandle first = scene.add_grid(std::move(ground));
  const GridHandle second = scene.add_grid(std::move(hill));
  const LayerHandle layer = scene.add_layer({"front", false});
  const GroupHandle outer = scene.add_group({.name = "outer", .layer = layer});
  const GroupHandle inner = scene.add_group({.name = "inner", .parent = outer, .position = {1e9, 2, 3}});
  scene.add_instance({.name = "a", .grid = first, .position = {1, 2, 1e12}, .group = inner});
  scene.add_instance({.name = "b",
                      .grid = second,
                      .rotation = {0.5, 0.5, -0.5, 0.5},
                      .voxel_size = 0.1,
                      .mirrored = true,
                      .visible = false,
                      .layer = layer,
                      .categories = 12});
  scene.lamps.push_back({.name = "sun lamp", .position = {1, 2, 3}, .intensity = 7.25});
  scene.lamps.push_back({.name = "", .kind = Lamp::Kind::Spot, .range = 33.0});
  return scene;
}

Scene loaded_from(const std::filesystem::path& path) {
  auto loaded = load_scene(path);
  EXPECT_TRUE(loaded) << to_string(loaded.error());
  if (!loaded) return {};
  EXPECT_TRUE(loaded->warnings.empty()) << loaded->warnings.front();
  return std::move(loaded->scene);
}

TEST(WorldSaver, RoundTripsScene) {
  const WorldFolder folder;
  const Scene scene = rich_scene();
  const auto saved = save_scene(scene, folder / "w.quoin");
  ASSERT_TRUE(saved) << to_string(saved.error());
  EXPECT_EQ(saved->bytes, std::filesystem::file_size(folder / "w.quoin"));
  EXPECT_TRUE(saved->warnings.empty());
  EXPECT_EQ(text_of(loaded_from(folder / "w.quoin")), text_of(scene));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << "no other files in the folder";
}

TEST(WorldSaver, IsDeterministic) {
  const WorldFolder folder;
  const Scene scene = rich_scene();
  ASSERT_TRUE(save_scene(scene, folder / "a.quoin", {1}));
  ASSERT_TRUE(save_scene(scene, folder / "b.quoin", {3}));
  EXPECT_EQ(*read_file(folder / "a.quoin"), *read_file(folder / "b.quoin"));
}

TEST(WorldSaver, KeepsSunAndCameras) {
  const WorldFolder folder;
  LoadedScene loaded;
  loaded.scene = rich_scene();
  loaded.scene.environment = Environment::natural({0.1, 0.7, -0.2});
  loaded.camera = look_at({1, 2, 3}, {4, 5, 7}, 0.7).value();
  FileCamera flat{.number = -3, .camera = *loaded.camera, .focus_distance = 12.5};
  flat.camera.projection = Camera::Projection::Orthographic;
  loaded.cameras = {{.number = 0, .camera = *loaded.camera}, flat};
  ASSERT_TRUE(save_scene(loaded, folder / "w.quoin"));
  const auto again = load_scene(folder / "w.quoin");
  ASSERT_TRUE(again);
  EXPECT_EQ(again->scene.environment, loaded.scene.environment);
  EXPECT_EQ(again->camera->forward, loaded.camera->forward);
  ASSERT_EQ(again->cameras.size(), 2U);
  EXPECT_EQ(again->cameras[1].number, -3);
  EXPECT_EQ(again->cameras[1].focus_distance, 12.5);
  EXPECT_EQ(again->cameras[1].camera.projection, Camera::Projection::Orthographic);
}

TEST(WorldSaver, SavesChangesOfEnvironment) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  auto world = WorldStore::create(path);
  ASSERT_TRUE(world);
  Scene scene = rich_scene();
  WorldSaver saver;
  Environment foggy = Environment::natural({1.0, 2.0, 3.0});
  foggy.fog = Fog{.density = 0.03, .top = 12.0};
  foggy.exposure = 1.5;
  const std::array<std::optional<Environment>, 5> states = {Environment::natural({0.0, 1.0, 0.5}), foggy,
                                                            Environment::reference(), std::nullopt, foggy};
  for (const std::optional<Environment>& wanted : states) {
    scene.environment = wanted;
    ASSERT_TRUE(saver.save(*world, scene));
    ASSERT_TRUE(world->flush());
    const auto again = load_world(*world);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->loaded.scene.environment, wanted);
    EXPECT_TRUE(again->loaded.warnings.empty());
  }
  // A loaded world's saver knows the environment, so that it writes only changes.
  auto loaded = load_world(*world);
  ASSERT_TRUE(loaded);
  ASSERT_TRUE(loaded->saver.save(*world, loaded->loaded.scene));
  loaded->loaded.scene.environment.reset();
  ASSERT_TRUE(loaded->saver.save(*world, loaded->loaded.scene));
  ASSERT_TRUE(world->flush());
  EXPECT_FALSE(load_world(*world).value().loaded.scene.environment);
}

TEST(WorldSaver, LoadsSkyImage) {
  const WorldFolder folder;
  Scene scene = rich_scene();
  scene.environment.emplace().sky.model = SkyModel::Image;
  scene.environment->sky.image_file = "sky.hdr";
  ASSERT_TRUE(save_scene(scene, folder / "w.quoin"));
  const auto missing = load_scene(folder / "w.quoin");
  ASSERT_TRUE(missing && missing->warnings.size() == 1U);
  EXPECT_NE(missing->warnings[0].find("the image of the sky \"sky.hdr\""), std::string::npos) << missing->warnings[0];
  LoadOptions without_sky;
  without_sky.sky_image = false;
  EXPECT_TRUE(load_scene(folder / "w.quoin", without_sky)->warnings.empty());
  const std::string pixel = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n" + std::string("\x80\0\0\x81", 4);
  ASSERT_TRUE(write_file(std::as_bytes(std::span(pixel)), folder / "sky.hdr"));
  EXPECT_FALSE(lacks_image(loaded_from(folder / "w.quoin").environment->sky));
  const auto partial = load_partial_world(*WorldStore::open(folder / "w.quoin", WorldAccess::Read));
  ASSERT_TRUE(partial);
  EXPECT_TRUE(lacks_image(partial->loaded.scene.environment->sky)) << "read only with the chunks";
  EXPECT_TRUE(partial->loaded.warnings.empty());
}

// The core library has no reader of images: the library of formats sets it.
TEST(WorldSaver, LoadsWorldsWithoutReaderOfSkyImages) {
  const WorldFolder folder;
  Scene scene = rich_scene();
  scene.environment.emplace().sky.model = SkyModel::Image;
  scene.environment->sky.image_file = "sky.hdr";
  ASSERT_TRUE(save_scene(scene, folder / "w.quoin"));
  scene_json::register_sky_reader(nullptr);
  const auto loaded = load_world(*WorldStore::open(folder / "w.quoin", WorldAccess::Read));
  scene_json::register_sky_reader(read_radiance);
  ASSERT_TRUE(loaded);
  ASSERT_EQ(loaded->loaded.warnings.size(), 1U);
  EXPECT_NE(loaded->loaded.warnings[0].find("linked without quoin::quoin"), std::string::npos);
}

/// A world that is saved repeatedly, and its expected content.
class KeptWorld {
 public:
  explicit KeptWorld(const std::filesystem::path& path) : world_(WorldStore::create(path).value()) {}

  void save(const Scene& scene) {
    const auto ticket = saver_.save(world_, scene);
    ASSERT_TRUE(ticket) << to_string(ticket.error());
    ASSERT_TRUE(world_.flush());
    expect_like(scene);
  }
  void expect_like(const Scene& scene) {
    const auto loaded = load_world(world_);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    EXPECT_EQ(text_of(loaded->loaded.scene), text_of(scene));
  }
  [[nodiscard]] std::uint64_t chunks_of_last_save() {
    const std::uint64_t now = world_.stats().saved_chunks;
    return now - std::exchange(counted_, now);
  }
  WorldStore& world() { return world_; }
  WorldSaver& saver() { return saver_; }

 private:
  WorldStore world_;
  WorldSaver saver_;
  std::uint64_t counted_ = 0;
};

TEST(WorldSaver, SavesOnlyChanges) {
  const WorldFolder folder;
  KeptWorld kept(folder / "w.quoin");
  Scene scene = rich_scene();
  kept.save(scene);
  EXPECT_GT(kept.chunks_of_last_save(), 12U);
  kept.save(scene);
  EXPECT_EQ(kept.chunks_of_last_save(), 0U);
  const GridHandle ground = scene.grids().handles().front();
  const GridHandle hill = scene.grids().handles().back();
  scene.edit(ground).grid.set({3, 3, 4}, 5);
  kept.save(scene);
  EXPECT_EQ(kept.chunks_of_last_save(), 1U);
  scene.edit(ground).grid.set_data({3, 3, 4}, {.state = 9});
  kept.save(scene);
  EXPECT_EQ(kept.chunks_of_last_save(), 1U);
  scene.edit(hill).field.edit({{0, 0, 0}, {1, 1, 1}}, [](IVec3, DensitySample) { return DensitySample{-1.0F, 3}; });
  kept.save(scene);
  EXPECT_EQ(kept.chunks_of_last_save(), 1U);
  // A chunk that becomes air is stored as air.
  const IVec3 emptied = scene.grids()[ground].grid.chunks().front();
  scene.edit(ground).grid.fill_box({emptied * kChunkEdge, (emptied + IVec3(1)) * kChunkEdge}, kAir);
  kept.save(scene);
  const auto air = kept.world().load_chunk({0, 0, emptied});
  ASSERT_TRUE(air && air->has_value());
  EXPECT_EQ((*air)->voxels.uniform(), kAir);
}

TEST(WorldSaver, SavesEveryKindOfChange) {
  const WorldFolder folder;
  KeptWorld kept(folder / "w.quoin");
  Scene scene = rich_scene();
  kept.save(scene);
  const InstanceHandle instance = scene.instances().handles().front();
  scene.edit(instance).position = {-7, 8, 9};
  kept.save(scene);
  ASSERT_TRUE(scene.types.add(coloured_type(99)));
  scene.types.replace(2, coloured_type(77));
  kept.save(scene);
  scene.lamps.erase(scene.lamps.begin());
  kept.save(scene);
  scene.lamps.push_back({.name = "third"});
  kept.save(scene);
  const GroupHandle outer = scene.groups().handles().front();
  scene.remove_group(outer);
  kept.save(scene);
  scene.remove_layer(scene.layers().handles().front());
  kept.save(scene);
  SceneGrid ship;
  ship.grid.fill_box({{0, 0, 0}, {70, 3, 3}}, 10);
  const GridHandle ship_handle = scene.add_grid(std::move(ship));
  scene.add_instance({.name = "ship", .grid = ship_handle});
  kept.save(scene);
  scene.remove_grid(scene.grids().handles().front());
  kept.save(scene);
  EXPECT_EQ(kept.world().chunks(0, 0)->size(), 0U);
  EXPECT_EQ(kept.world().grids()->size(), 2U);
}

// Returns the revision of an instance in the file, -1 if it is not there.
std::int64_t revision_of(const std::filesystem::path& path, std::int64_t instance) {
  auto connection = Connection::open(path.string(), Connection::Mode::Read);
  if (!connection) return -1;
  const std::string query = "SELECT revision FROM parts WHERE kind='instance' AND id=" + std::to_string(instance);
  const auto found = connection->text(query.c_str());
  return found && !found->empty() ? std::stoll(*found) : -1;
}

TEST(WorldSaver, SkipsInstancesThatAreAsBefore) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  KeptWorld kept(path);
  Scene scene = rich_scene();
  kept.save(scene);
  const InstanceHandle first = scene.instances().handles().front();
  const InstanceHandle other = scene.instances().handles().back();
  const std::int64_t before = revision_of(path, 0);
  ASSERT_GE(before, 1);
  scene.edit(first).position.x += 1.0;
  scene.edit(first).position.x -= 1.0;
  scene.edit(other).position.y = -0.0;  // not the same as 0
  kept.save(scene);
  EXPECT_EQ(revision_of(path, 0), before);
  EXPECT_GT(revision_of(path, 1), before);
  scene.edit(first).name = "another";
  kept.save(scene);
  EXPECT_GT(revision_of(path, 0), before);
  // A refused save is repeated as a whole, although the saver has seen its instances.
  const std::int64_t middle = revision_of(path, 0);
  scene.edit(first).position.x = 77.0;
  scene.edit(other).position.x = std::nan("");
  EXPECT_FALSE(kept.saver().save(kept.world(), scene));
  scene.edit(other).position.x = 3.0;
  kept.save(scene);
  EXPECT_GT(revision_of(path, 0), middle);
  // An instance that leaves the file and returns has a new number.
  scene.edit(first).saved = false;
  ASSERT_TRUE(kept.saver().save(kept.world(), scene));
  scene.edit(first).saved = true;
  ASSERT_TRUE(kept.saver().save(kept.world(), scene));
  ASSERT_TRUE(kept.world().flush());
  EXPECT_EQ(revision_of(path, 0), -1);
  EXPECT_GT(revision_of(path, 2), middle);
}

TEST(WorldSaver, StepsSaveTheStateOfTheirBegin) {
  const WorldFolder folder;
  KeptWorld kept(folder / "w.quoin");
  Scene scene = rich_scene();
  kept.save(scene);
  (void)kept.chunks_of_last_save();
  const GridHandle ground = scene.grids().handles().front();
  const GridHandle hill = scene.grids().handles().back();
  const auto edit_all = [&](int y) {
    for (int i = 0; i < 100; ++i) scene.edit(ground).grid.set({64 * i, y, 0}, 3);
    scene.edit(hill).field.edit({{0, y, 0}, {1, y + 1, 1}}, [](IVec3, DensitySample) {
      return DensitySample{-2.0F, 3};
    });
    scene.edit(scene.instances().handles().front()).position.y += 1.0;
  };
  edit_all(0);
  bool is_saved = false;
  const auto on_saved = [&](const Status& outcome) { is_saved = outcome.has_value(); };
  EXPECT_FALSE(*kept.saver().step(kept.world(), 1.0)) << "no save is begun";
  ASSERT_TRUE(kept.saver().begin(kept.world(), scene, {}, on_saved));
  const Scene at_begin = scene.snapshot();
  int steps = 0;
  while (kept.saver().is_begun()) {
    edit_all(1 + steps);
    const auto ticket = kept.saver().step(kept.world(), 0.0);
    ASSERT_TRUE(ticket) << to_string(ticket.error());
    EXPECT_EQ(ticket->has_value(), !kept.saver().is_begun());
    ++steps;
    if (kept.saver().is_begun()) {
      EXPECT_EQ(kept.world().stats().pending_chunks, 0U) << "the store receives a save as a whole";
    }
  }
  EXPECT_GE(steps, 100 / 16);
  EXPECT_LT(steps, 20);
  ASSERT_TRUE(kept.world().flush());
  EXPECT_EQ(kept.chunks_of_last_save(), 101U);
  kept.expect_like(at_begin);
  kept.save(scene);
  EXPECT_TRUE(is_saved) << "called before the next commit";
  EXPECT_EQ(kept.chunks_of_last_save(), 101U);
}

TEST(WorldSaver, SavesAllInstancesAfterRefusedSaveInSteps) {
  const WorldFolder folder;
  KeptWorld kept(folder / "w.quoin");
  Scene scene = rich_scene();
  const GridHandle ground = scene.grids().handles().front();
  std::vector<InstanceHandle> ships;
  for (int i = 0; i < 40; ++i) ships.push_back(scene.add_instance({.name = "ship", .grid = ground}));
  kept.save(scene);
  for (const InstanceHandle ship : ships) scene.edit(ship).position.x += 1.0;
  scene.remove_instance(ships.back());
  scene.edit(ground).grid.set({1, 1, 1}, 200);  // not registered
  ASSERT_TRUE(kept.saver().begin(kept.world(), scene));
  ASSERT_TRUE(kept.saver().step(kept.world(), 0.0)) << "a part of the instances";
  ASSERT_TRUE(kept.saver().is_begun());
  EXPECT_FALSE(kept.saver().step(kept.world(), 1e9));
  EXPECT_FALSE(kept.saver().is_begun());
  scene.edit(ground).grid.set({1, 1, 1}, 3);
  kept.save(scene);
}

TEST(WorldSaver, RepeatsRefusedSaveInSteps) {
  const WorldFolder folder;
  KeptWorld kept(folder / "w.quoin");
  Scene scene = rich_scene();
  kept.save(scene);
  const GridHandle ground = scene.grids().handles().front();
  scene.edit(ground).grid.set({1, 1, 1}, 200);  // not registered
  scene.edit(scene.instances().handles().front()).position.y += 1.0;
  ASSERT_TRUE(kept.saver().begin(kept.world(), scene));
  const auto refused = kept.saver().step(kept.world(), 1e9);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
  EXPECT_FALSE(kept.saver().is_begun());
  scene.edit(ground).grid.set({1, 1, 1}, 3);
  kept.save(scene);
}

TEST(WorldSaver, FollowsMoreChangesThanJournalsKeep) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  KeptWorld kept(path);
  Scene scene = rich_scene();
  kept.save(scene);
  (void)kept.chunks_of_last_save();
  const GridHandle ground = scene.grids().handles().front();
  const InstanceHandle moving = scene.instances().handles().front();
  const std::int64_t resting = revision_of(path, 1);
  int reported = 0;
  for (int i = 0; i < 12'000; ++i) {
    scene.edit(ground).grid.set({3, 3, 4}, static_cast<VoxelType>(1 + i % 2));
    scene.edit(moving).position.x += 1.0;
    kept.saver().follow(scene, [&](GridHandle grid, std::optional<IVec3> chunk) {
      EXPECT_TRUE(grid == ground && chunk == IVec3(0));
      ++reported;
    });
  }
  EXPECT_EQ(reported, 12'000);
  kept.save(scene);
  EXPECT_EQ(kept.chunks_of_last_save(), 1U) << "of 13";
  EXPECT_EQ(revision_of(path, 1), resting);
}

TEST(WorldSaver, ContinuesFromLoadedWorld) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  ASSERT_TRUE(save_scene(rich_scene(), path));
  std::string wanted;
  {
    auto world = WorldStore::open(path, WorldAccess::Write);
    ASSERT_TRUE(world);
    auto loaded = load_world(*world);
    ASSERT_TRUE(loaded);
    Scene& scene = loaded->loaded.scene;
    ASSERT_TRUE(loaded->saver.save(*world, scene));
    ASSERT_TRUE(world->flush());
    EXPECT_EQ(world->stats().saved_chunks, 0U) << "nothing has changed since it was read";
    scene.edit(scene.grids().handles().front()).grid.set({100, 100, 100}, 3);
    scene.add_instance({.name = "new", .grid = scene.grids().handles().back()});
    WorldChanges more;
    more.put_value("time", {std::byte{12}});
    ASSERT_TRUE(loaded->saver.save(*world, scene, std::move(more)));
    ASSERT_TRUE(world->flush());
    EXPECT_EQ(world->stats().saved_chunks, 1U);
    wanted = text_of(scene);
  }
  const auto again = load_scene(path);
  ASSERT_TRUE(again);
  EXPECT_EQ(text_of(again->scene), wanted);
  ASSERT_EQ(again->warnings.size(), 1U);
  EXPECT_NE(again->warnings.front().find("application values left out: 1"), std::string::npos)
      << "which only a world keeps";
  EXPECT_TRUE(WorldStore::open(path, WorldAccess::Read)->value("time")->has_value());
}

TEST(WorldSaver, SavesRefusedChangesNextTime) {
  const WorldFolder folder;
  KeptWorld kept(folder / "w.quoin");
  Scene scene = rich_scene();
  kept.save(scene);
  const InstanceHandle gone = scene.instances().handles().front();
  const InstanceHandle other = scene.instances().handles().back();
  scene.remove_instance(gone);
  scene.edit(scene.grids().handles().front()).grid.set({1, 1, 1}, 6);
  scene.edit(other).position.x = std::nan("");
  const auto refused = kept.saver().save(kept.world(), scene);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(refused.error().message.find("instance"), std::string::npos) << refused.error().message;
  scene.edit(other).position.x = 3.0;
  kept.save(scene);
}

// The chunk is in no list of the grid, since it is air, nor in the world, since no save contained it before.
TEST(WorldSaver, SavesEmptiedChunkOfPartialGridAfterRefusedSave) {
  const WorldFolder folder;
  KeptWorld kept(folder / "w.quoin");
  Scene scene = rich_scene();
  SceneGrid streamed;
  streamed.grid.make_partial();
  streamed.field.make_partial();
  const GridHandle handle = scene.add_grid(std::move(streamed));
  ASSERT_TRUE(kept.saver().save(kept.world(), scene));
  const IVec3 chunk{1, 2, 3};
  scene.edit(handle).grid.load_chunk(chunk, Chunk(1));  // as from a generator
  scene.edit(handle).field.load_air_chunk(chunk);
  scene.edit(handle).grid.put_chunk(chunk, Chunk(kAir));
  const InstanceHandle other = scene.instances().handles().back();
  scene.edit(other).position.x = std::nan("");
  ASSERT_FALSE(kept.saver().save(kept.world(), scene));
  scene.edit(other).position.x = 3.0;
  ASSERT_TRUE(kept.saver().save(kept.world(), scene));
  const auto stored = kept.world().load_chunk({*kept.saver().number_of(handle), 0, chunk});
  ASSERT_TRUE(stored);
  ASSERT_TRUE(stored->has_value());
  EXPECT_EQ((*stored)->voxels.uniform(), kAir);
}

TEST(WorldSaver, FollowsInstancesThatComeAndGo) {
  const WorldFolder folder;
  KeptWorld kept(folder / "w.quoin");
  Scene scene = rich_scene();
  kept.save(scene);
  const GridHandle ground = scene.grids().handles().front();
  scene.edit(scene.instances().handles().front()).name = "before";
  for (int i = 0; i < 12'000; ++i) {
    const InstanceHandle grain = scene.add_instance({.name = "grain", .grid = ground});
    kept.saver().follow(scene);
    if (i % 6000 == 0) {
      kept.save(scene);
      scene.edit(ground).grid.set({i, 0, 0}, 2);
    }
    scene.remove_instance(grain);
    kept.saver().follow(scene);
  }
  kept.save(scene);
}

TEST(WorldSaver, RefusesSceneWithOtherTypes) {
  const WorldFolder folder;
  KeptWorld kept(folder / "w.quoin");
  kept.save(rich_scene());
  Scene other;
  ASSERT_TRUE(other.types.add(coloured_type(200)));
  WorldSaver saver;
  EXPECT_FALSE(saver.save(kept.world(), other));
}

TEST(WorldSaver, ReplacesOldWorldAndLog) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  ASSERT_TRUE(save_scene(rich_scene(), path));
  {
    auto world = WorldStore::open(path, WorldAccess::Write);
    EXPECT_FALSE(save_scene(rich_scene(), path)) << "while another writes it";
    EXPECT_FALSE(std::filesystem::exists(path.string() + "-new"));
  }
  Scene small;
  ASSERT_TRUE(small.types.add(coloured_type(1)));
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, 1);
  small.add_instance({.name = "", .grid = small.add_grid(std::move(grid))});
  ASSERT_TRUE(save_scene(small, path));
  EXPECT_EQ(text_of(loaded_from(path)), text_of(small));
}

TEST(WorldSaver, LoadsWorldFromBytes) {
  const WorldFolder folder;
  ASSERT_TRUE(save_scene(rich_scene(), folder / "w.quoin"));
  const auto bytes = read_file(folder / "w.quoin");
  ASSERT_TRUE(bytes);
  const auto loaded = load_scene(*bytes);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(text_of(loaded->scene), text_of(rich_scene()));
  EXPECT_EQ(loaded->format, "world");
}

TEST(WorldSaver, CancellingLeavesNoFile) {
  const WorldFolder folder;
  const auto saved = save_scene(rich_scene(), folder / "w.quoin", {}, [](double) { return false; });
  ASSERT_FALSE(saved);
  EXPECT_EQ(saved.error().code, ErrorCode::Cancelled);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  ASSERT_TRUE(save_scene(rich_scene(), folder / "w.quoin"));
  const auto loaded = load_scene(folder / "w.quoin", {}, {}, [](double) { return false; });
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().code, ErrorCode::Cancelled);
}

TEST(WorldSaver, KeepsDamagedChunks) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  ASSERT_TRUE(save_scene(rich_scene(), path));
  {  // the last byte of a chunk's body
    auto connection = Connection::open(path.string(), Connection::Mode::Write);
    ASSERT_TRUE(connection);
    ASSERT_TRUE(
        connection->run("UPDATE chunks SET body = substr(body, 1, length(body) - 1) || x'00' WHERE key IN (SELECT key "
                        "FROM chunks LIMIT 1)"));
  }
  auto world = WorldStore::open(path, WorldAccess::Write);
  auto loaded = load_world(*world);
  ASSERT_TRUE(loaded);
  ASSERT_EQ(loaded->loaded.warnings.size(), 1U);
  Scene& scene = loaded->loaded.scene;
  const InstanceHandle instance = scene.instances().handles().front();
  scene.edit(instance).position.x = std::nan("");
  ASSERT_FALSE(loaded->saver.save(*world, scene)) << "after which all is saved";
  scene.edit(instance).position.x = 1.0;
  ASSERT_TRUE(loaded->saver.save(*world, scene));
  ASSERT_TRUE(world->flush());
  EXPECT_EQ(load_world(*world)->loaded.warnings.size(), 1U) << "it is damaged still, not air";
}

/// Lines for the grids with their voxel counts, the groups with their parents, and the instances with their grids,
/// groups and positions; of saved objects only, or of all. Sorted, since numbers in a world depend on earlier saves.
std::vector<std::string> lines_of(const Scene& scene, bool only_saved) {
  std::vector<std::string> lines;
  const auto name_of = [](const auto& map, auto handle) {
    const auto* const found = map.find(handle);
    return found == nullptr ? std::string("none") : found->name;
  };
  scene.grids().for_each([&](GridHandle, const SceneGrid& grid) {
    if (only_saved && !grid.saved) return;
    lines.push_back("grid " + grid.name + " " + std::to_string(grid.grid.voxel_count()));
  });
  scene.groups().for_each([&](GroupHandle handle, const SceneGroup& group) {
    if (only_saved && !is_saved(scene, group)) return;
    lines.push_back("group " + group.name + " in " + name_of(scene.groups(), parent_of(scene, handle)));
  });
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    if (only_saved && !is_saved(scene, instance)) return;
    lines.push_back("instance " + instance.name + " of " + name_of(scene.grids(), instance.grid) + " in " +
                    name_of(scene.groups(), instance.group) + " at " + std::to_string(instance.position.x));
  });
  std::ranges::sort(lines);
  return lines;
}

std::vector<std::string> lines_in(WorldStore& world) {
  const Status flushed = world.is_writable() ? world.flush() : Status();
  EXPECT_TRUE(flushed.has_value());
  const auto loaded = load_world(world);
  EXPECT_TRUE(loaded) << to_string(loaded.error());
  if (!loaded) return {};
  EXPECT_TRUE(loaded->loaded.warnings.empty()) << loaded->loaded.warnings.front();
  EXPECT_EQ(lines_of(loaded->loaded.scene, true), lines_of(loaded->loaded.scene, false)) << "marked in the file";
  return lines_of(loaded->loaded.scene, false);
}

/// Returns a scene of six grids, nested groups and instances of each grid in each group.
Scene marked_scene() {
  Scene scene;
  scene.types = coloured_types(3);
  std::vector<GroupHandle> groups = {{}};
  for (int i = 0; i < 6; ++i) {
    const GroupHandle parent = i < 2 ? GroupHandle{} : groups[static_cast<std::size_t>(i / 2)];
    groups.push_back(scene.add_group({.name = "group " + std::to_string(i), .parent = parent}));
  }
  for (int i = 0; i < 6; ++i) {
    SceneGrid grid{.name = "grid " + std::to_string(i)};
    grid.grid.fill_box({{0, 0, 0}, {70 + i, 2, 2}}, 1);
    const GridHandle handle = scene.add_grid(std::move(grid));
    for (const GroupHandle group : groups) {
      const std::string name = "instance " + std::to_string(scene.instances().size());
      scene.add_instance({.name = name, .grid = handle, .group = group});
    }
  }
  return scene;
}

TEST(WorldSaver, LeavesOutObjectsMarkedAsNotSaved) {
  const WorldFolder folder;
  Scene scene = marked_scene();
  const std::vector<GridHandle> grids = scene.grids().handles();
  const std::vector<GroupHandle> groups = scene.groups().handles();
  scene.edit(grids[1]).saved = false;
  scene.edit(groups[0]).saved = false;  // with the groups 2 and 3 below
  scene.edit(scene.instances().handles()[0]).saved = false;
  const std::vector<std::string> wanted = lines_of(scene, true);
  EXPECT_EQ(wanted.size(), 5U + 3U + 5U * 4U - 1U);
  ASSERT_TRUE(save_scene(scene, folder / "w.quoin"));
  auto written = WorldStore::open(folder / "w.quoin", WorldAccess::Read);
  ASSERT_TRUE(written);
  EXPECT_EQ(lines_in(*written), wanted);
  EXPECT_EQ(lines_of(scene, false).size(), 6U + 6U + 42U) << "the scene keeps them";
  KeptWorld kept(folder / "kept.quoin");
  ASSERT_TRUE(kept.saver().save(kept.world(), scene));
  EXPECT_EQ(lines_in(kept.world()), wanted);
  EXPECT_FALSE(kept.saver().number_of(grids[1]));
  // Edits of a grid that is left out write nothing.
  ASSERT_TRUE(kept.world().flush());
  static_cast<void>(kept.chunks_of_last_save());
  scene.edit(grids[1]).grid.set({1, 1, 1}, 2);
  ASSERT_TRUE(kept.saver().save(kept.world(), scene));
  ASSERT_TRUE(kept.world().flush());
  EXPECT_EQ(kept.chunks_of_last_save(), 0U);
}

TEST(WorldSaver, FollowsChangedMarks) {
  const WorldFolder folder;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const auto path = folder.path() / ("w" + std::to_string(seed) + ".quoin");
    std::minstd_rand random(seed);
    std::optional<KeptWorld> kept(path);
    Scene scene = marked_scene();
    const std::vector<GridHandle> grids = scene.grids().handles();
    const std::vector<GroupHandle> groups = scene.groups().handles();
    const std::vector<InstanceHandle> instances = scene.instances().handles();
    const auto flip = [&](const auto& handles) {
      auto& object = scene.edit(handles[random() % handles.size()]);
      object.saved = !object.saved;
    };
    for (int save = 0; save < 40; ++save) {
      for (unsigned i = 0; i < 1 + random() % 4; ++i) {
        if (random() % 3 == 0) flip(grids);
        if (random() % 3 == 0) flip(groups);
        if (random() % 3 == 0) flip(instances);
      }
      scene.edit(grids[random() % grids.size()]).grid.set({static_cast<int>(random() % 300), 3, 3}, 2);
      if (random() % 4 == 0) {  // a refused save must not lose a mark
        const InstanceHandle broken = scene.add_instance({.name = "broken", .grid = GridHandle{99, 1}});
        ASSERT_FALSE(kept->saver().save(kept->world(), scene));
        scene.remove_instance(broken);
      }
      ASSERT_TRUE(kept->saver().save(kept->world(), scene));
      ASSERT_EQ(lines_in(kept->world()), lines_of(scene, true)) << "seed " << seed << ", save " << save;
    }
    std::size_t chunks = 0;
    const auto stored = kept->world().grids();
    ASSERT_TRUE(stored);
    for (const auto& [number, grid] : *stored) chunks += kept->world().chunks(number, 0)->size();
    kept.reset();
    const auto check = check_world(path);
    ASSERT_TRUE(check);
    EXPECT_TRUE(check->damage.empty());
    EXPECT_EQ(check->chunks, chunks) << "chunks of grids that were left out are gone";
  }
}

// Moving, renaming, removing and adding instances between two steps belongs to the next save.
TEST(WorldSaver, StepsCopyInstancesOfTheirBegin) {
  const WorldFolder folder;
  KeptWorld kept(folder / "w.quoin");
  Scene scene = rich_scene();
  const GridHandle ground = scene.grids().handles().front();
  const GroupHandle group = scene.groups().handles().front();
  std::vector<InstanceHandle> ships;
  for (int i = 0; i < 100; ++i) {
    ships.push_back(scene.add_instance({.name = "a ship with a long name " + std::to_string(i), .grid = ground}));
  }
  kept.save(scene);
  const auto move_all = [&] {
    for (const InstanceHandle ship : ships) scene.edit(ship).position.x += 1.0;
  };
  const auto remove = [&](std::size_t i) {
    scene.remove_instance(ships[i]);
    ships.erase(ships.begin() + static_cast<std::ptrdiff_t>(i));
  };
  move_all();
  scene.edit(ships[1]).name = "renamed before";
  scene.edit(ships[2]).saved = false;
  remove(3);
  ASSERT_TRUE(kept.saver().begin(kept.world(), scene));
  const std::vector<std::string> at_begin = lines_of(scene, true);
  int steps = 0;
  for (; kept.saver().is_begun(); ++steps) {
    move_all();
    scene.edit(ships[50]).name = "renamed after step " + std::to_string(steps);
    scene.edit(ships[51]).group = group;
    remove(60);
    scene.add_instance({.name = "added", .grid = ground});
    ASSERT_TRUE(kept.saver().step(kept.world(), 0.0));
    ASSERT_LT(steps, 20);
  }
  EXPECT_GT(steps, 100 / 16);
  EXPECT_EQ(lines_in(kept.world()), at_begin);
  ASSERT_TRUE(kept.saver().save(kept.world(), scene));
  EXPECT_EQ(lines_in(kept.world()), lines_of(scene, true));
}

TEST(WorldSaver, RefusesToLeaveOutPartialGrid) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  ASSERT_TRUE(save_scene(rich_scene(), path));
  auto world = WorldStore::open(path, WorldAccess::Write);
  auto loaded = load_partial_world(*world);
  ASSERT_TRUE(loaded);
  Scene& scene = loaded->loaded.scene;
  const GridHandle ground = scene.grids().handles().front();
  scene.edit(ground).saved = false;
  const auto refused = loaded->saver.save(*world, scene);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(refused.error().message.find("cannot leave out grid \"ground\""), std::string::npos);
  scene.edit(ground).saved = true;
  ASSERT_TRUE(loaded->saver.save(*world, scene));
  EXPECT_EQ(text_of(load_world(*world)->loaded.scene), text_of(rich_scene()));
}

TEST(WorldSaver, KeepsWholeGrids) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  constexpr std::size_t kGround = 0;
  constexpr std::size_t kHill = 1;
  const auto grid_in = [](const Scene& in, std::size_t i) -> const SceneGrid& {
    return in.grids()[in.grids().handles().at(i)];
  };
  const auto edited_in = [](Scene& in, std::size_t i) -> SceneGrid& { return in.edit(in.grids().handles().at(i)); };
  Scene scene = rich_scene();
  edited_in(scene, kHill).whole = true;
  ASSERT_TRUE(save_scene(scene, path));
  auto world = WorldStore::open(path, WorldAccess::Write);
  const auto whole_in = [&](std::uint32_t number) { return world->grids()->at(number).whole; };
  EXPECT_FALSE(whole_in(0));
  EXPECT_TRUE(whole_in(1));
  {
    auto all = load_world(*world);
    ASSERT_TRUE(all);
    EXPECT_FALSE(grid_in(all->loaded.scene, kGround).whole);
    EXPECT_TRUE(grid_in(all->loaded.scene, kHill).whole);
    EXPECT_TRUE(grid_in(all->loaded.scene.snapshot(), kHill).whole);
    edited_in(all->loaded.scene, kGround).whole = true;
    edited_in(all->loaded.scene, kHill).whole = false;
    all->loaded.scene.add_grid({.name = "new"});
    ASSERT_TRUE(all->saver.save(*world, all->loaded.scene));
    EXPECT_TRUE(whole_in(0));
    EXPECT_FALSE(whole_in(1));
    EXPECT_FALSE(whole_in(2)) << "only a partial world's saver knows that a grid does not stream";
  }
  auto none = load_partial_world(*world);
  ASSERT_TRUE(none);
  EXPECT_TRUE(grid_in(none->loaded.scene, kGround).grid.is_partial()) << "no bytes were allowed";
  EXPECT_TRUE(grid_in(none->loaded.scene, kGround).whole);
  auto some = load_partial_world(*world, {}, std::uint64_t{1} << 30);
  ASSERT_TRUE(some) << to_string(some.error());
  Scene& opened = some->loaded.scene;
  EXPECT_FALSE(grid_in(opened, kGround).grid.is_partial());
  EXPECT_EQ(grid_in(opened, kGround).grid.voxel_count(), grid_in(scene, kGround).grid.voxel_count());
  EXPECT_TRUE(grid_in(opened, kHill).grid.is_partial());
  EXPECT_TRUE(grid_in(opened, kHill).field.is_partial());
  edited_in(opened, kGround).grid.set({200, 1, 1}, 3);
  opened.add_grid({.name = "ship"});
  ASSERT_TRUE(some->saver.save(*world, opened));
  EXPECT_TRUE(whole_in(0));
  EXPECT_FALSE(whole_in(1));
  EXPECT_TRUE(whole_in(3));
  ASSERT_TRUE(world->flush());
  EXPECT_EQ(grid_in(load_world(*world)->loaded.scene, kGround).grid.get({200, 1, 1}), 3);
}

// The texts of the types would have 4 MiB each, although all share one texture.
TEST(WorldSaver, RefusesTexturesAboveLimitBeforeEncodingThem) {
  const WorldFolder folder;
  const AlphaImage image{1024, 1024, std::vector<std::uint8_t>(std::size_t{4} * 1024 * 1024, 255)};
  const Texture snow = Texture::from_image("snow", image).value();
  Scene scene;
  for (int i = 0; i < 520; ++i) ASSERT_TRUE(scene.types.add({.name = std::to_string(i), .faces = snow}));
  auto world = WorldStore::create(folder / "w.quoin");
  ASSERT_TRUE(world);
  WorldSaver saver;
  const auto refused = saver.save(*world, scene);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
}

TEST(WorldSaver, RefusesWholeGridsAboveLimit) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  Scene scene;
  scene.types = coloured_types(9);
  for (const char* const name : {"small", "huge"}) {
    SceneGrid grid{.name = name, .whole = true};
    const int chunks = grid.name == "small" ? 1 : 30;
    for (int i = 0; i < chunks; ++i) grid.grid.put_chunk({i, 0, 0}, random_chunk(static_cast<std::uint32_t>(i), 9));
    scene.add_grid(std::move(grid));
  }
  ASSERT_TRUE(save_scene(scene, path));
  const auto world = WorldStore::open(path, WorldAccess::Read);
  const std::uint64_t needed = *memory_of_world(*world);
  EXPECT_TRUE(load_partial_world(*world, {}, needed + 1000));
  const auto refused = load_partial_world(*world, {}, needed - 1000);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
  EXPECT_NE(refused.error().message.find("cannot load grid 1 \"huge\" as a whole"), std::string::npos)
      << refused.error().message;
  EXPECT_NE(refused.error().message.find("are allowed"), std::string::npos) << refused.error().message;
  EXPECT_EQ(refused.error().path, path.string());
}

TEST(WorldSaver, RefusesToMixScenes) {
  const WorldFolder folder;
  KeptWorld kept(folder / "w.quoin");
  kept.save(rich_scene());
  WorldSaver saver;
  const auto refused = saver.save(kept.world(), rich_scene());
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("load_world"), std::string::npos);
}

}  // namespace
}  // namespace quoin
