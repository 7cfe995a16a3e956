// Conversion of surfaces with the content that was meshed, and its replacement while workers run.

#include <quoin/core/memory.h>
#include <quoin/live/live_meshes.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/live/live_light.h>
#include <quoin/mesh/blocky.h>
#include <quoin/render/surface_light.h>

#include "live/live_test_support.h"
#include "live/placed_light_world_for_tests.h"

namespace quoin {
namespace {

VoxelType add_type(Scene& scene, VoxelProperties properties) {
  const auto type = scene.types.add(std::move(properties));
  EXPECT_TRUE(type.has_value());
  return *type;
}

/// The converted data of a surface.
template <class T>
const T& converted(const SurfaceUpdate& update) {
  EXPECT_NE(update.surface->converted, nullptr);
  return *static_cast<const T*>(update.surface->converted.get());
}

using Coordinates = std::array<int, 3>;
Coordinates coordinates(IVec3 v) {
  return {v.x, v.y, v.z};
}

TEST(SurfaceConverter, AcceptsCallablesOfBothForms) {
  EXPECT_FALSE(SurfaceConverter());
  EXPECT_FALSE(SurfaceConverter(nullptr));
  EXPECT_FALSE(SurfaceConverter(std::function<ConvertedSurface(const SurfaceUpdate&)>()));
  EXPECT_FALSE(SurfaceConverter(SurfaceConverter::WithContext()));
  const auto bytes = [](const SurfaceConverter& convert) {
    EXPECT_TRUE(convert);
    return convert({}, {}).bytes;
  };
  EXPECT_EQ(bytes([](const SurfaceUpdate&) { return ConvertedSurface(nullptr, 1); }), 1U);
  EXPECT_EQ(bytes([](const SurfaceUpdate&, const SurfaceContext&) { return ConvertedSurface(nullptr, 2); }), 2U);
  EXPECT_EQ(bytes([](const auto&... all) { return ConvertedSurface(nullptr, sizeof...(all)); }), 2U);
  EXPECT_EQ(bytes(std::function([](const SurfaceUpdate&) { return ConvertedSurface(nullptr, 4); })), 4U);
  EXPECT_EQ(bytes([](const SurfaceUpdate&) { return std::make_shared<int>(1); }), 0U);
}

// Four furnaces that their states turn: merged quads do not tell them apart.
TEST(LiveConvert, ReadsStatesOfVoxels) {
  OneGrid one;
  const VoxelType furnace = add_type(one.scene, {.name = "furnace", .colour = {}, .state_bits = 2});
  for (int i = 0; i < 4; ++i) one.grid().set({62 + i, 3, 3}, furnace, {.state = static_cast<std::uint32_t>(i)});
  for (const SurfaceStyle style : {SurfaceStyle::Blocky, SurfaceStyle::Smooth}) {
    using States = std::map<Coordinates, std::uint32_t>;
    LiveMeshOptions wanted;
    wanted.style = style;
    wanted.convert = [furnace](const SurfaceUpdate& update, const SurfaceContext& context) {
      EXPECT_EQ(context.chunk, update.chunk);
      EXPECT_EQ((*context.types)[furnace].name, "furnace");
      auto states = std::make_shared<States>();
      for (int x = -2; x < 66; ++x) {
        const IVec3 local{x, 3, 3};
        if (context.voxels.get(local) != furnace) continue;
        (*states)[coordinates(update.chunk * kChunkEdge + local)] = context.voxels.data(local).state;
      }
      return states;
    };
    LiveMeshes meshes(wanted);
    meshes.finish(one.scene, {});
    const std::vector<SurfaceUpdate> taken = meshes.take();
    ASSERT_EQ(taken.size(), 2U);
    for (const SurfaceUpdate& each : taken) {
      const States expected = {{{62, 3, 3}, 0}, {{63, 3, 3}, 1}, {{64, 3, 3}, 2}, {{65, 3, 3}, 3}};
      EXPECT_EQ(converted<States>(each), expected) << "the neighbour's voxels too";
    }
  }
}

/// A door and a chest in the middle of three chunks of stone.
class DoorWorld : public OneGrid {
 public:
  DoorWorld() {
    grid().fill_box({{1, 1, 1}, {191, 20, 63}}, 3);
    for (const IVec3 at : {kDoor, kBorderDoor}) grid().set(at, door);
    for (const IVec3 at : kChests) grid().set(at, chest);
  }

  static constexpr IVec3 kDoor{100, 20, 30};
  static constexpr IVec3 kBorderDoor{64, 20, 30};
  static constexpr std::array<IVec3, 2> kChests{IVec3{98, 20, 28}, IVec3{102, 20, 32}};
  VoxelType door = add_type(scene, {.name = "door", .colour = {}, .state_bits = 8, .remesh_on_data = true});
  VoxelType chest = add_type(scene, {.name = "chest", .colour = {}, .state_bits = 8});
};

struct DataCase {
  const char* name;
  SurfaceStyle style;
  bool is_lit;
};

class LiveData : public testing::TestWithParam<DataCase> {};

TEST_P(LiveData, RemeshesChunksOfChangedDoorsOnly) {
  DoorWorld world;
  LiveMeshOptions wanted;
  wanted.style = GetParam().style;
  wanted.convert = [](const SurfaceUpdate& update, const SurfaceContext& context) {
    const IVec3 local = DoorWorld::kDoor - update.chunk * kChunkEdge;
    return std::make_shared<std::uint32_t>(context.voxels.data(local).state);
  };
  LiveLight light;
  LiveMeshes meshes(wanted);
  if (GetParam().is_lit) meshes.use_light(light);
  const auto chunks_after = [&] {
    meshes.finish(world.scene, {});
    std::vector<SurfaceUpdate> taken = meshes.take();
    std::sort(taken.begin(), taken.end());
    return taken;
  };
  EXPECT_EQ(chunks_after().size(), 3U);
  const std::int64_t meshed = meshes.stats().chunks_meshed;
  for (std::uint32_t state = 1; state <= 3; ++state) {
    for (const IVec3 at : DoorWorld::kChests) ASSERT_TRUE(world.grid().set_data(at, {.state = state}));
    EXPECT_TRUE(chunks_after().empty()) << "the door between the chests did not change";
    EXPECT_EQ(meshes.stats().chunks_meshed, meshed + state - 1);
    ASSERT_TRUE(world.grid().set_data(DoorWorld::kDoor, {.state = state}));
    const std::vector<SurfaceUpdate> changed = chunks_after();
    ASSERT_EQ(changed.size(), 1U);
    EXPECT_EQ(changed[0].chunk, IVec3(1, 0, 0));
    EXPECT_EQ(converted<std::uint32_t>(changed[0]), state);
    EXPECT_EQ(meshes.stats().chunks_meshed, meshed + state);
  }
  ASSERT_TRUE(world.grid().set_data(DoorWorld::kBorderDoor, {.state = 1}));
  EXPECT_EQ(chunks_after().size(), 2U) << "the chunk that touches the door too";
}

TEST_P(LiveData, FollowsTypesThatStartToDependOnData) {
  DoorWorld world;
  LiveMeshOptions wanted;
  wanted.style = GetParam().style;
  LiveLight light;
  LiveMeshes meshes(wanted);
  if (GetParam().is_lit) meshes.use_light(light);
  const auto set = [&](VoxelType type, bool remesh_on_data) {
    VoxelProperties properties = world.scene.types[type];
    properties.remesh_on_data = remesh_on_data;
    world.scene.types.replace(type, properties);
    meshes.finish(world.scene, {});
    return meshes.take().size();
  };
  const auto change_chest = [&](std::uint32_t state) {
    EXPECT_TRUE(world.grid().set_data(DoorWorld::kChests[0], {.state = state}));
    meshes.finish(world.scene, {});
    return meshes.take().size();
  };
  EXPECT_EQ(set(world.door, false), 3U);
  EXPECT_EQ(change_chest(1), 0U);
  EXPECT_EQ(set(world.chest, true), 3U) << "the data could have changed before";
  EXPECT_EQ(change_chest(2), 1U);
  EXPECT_EQ(set(world.chest, false), 0U);
  EXPECT_EQ(change_chest(3), 0U);
}

// Faces that a type's orientations turn are in the quads.
TEST(LiveConvert, RemeshesTypesWithOtherOrientations) {
  OneGrid one;
  VoxelProperties log{.name = "log", .colour = {}, .state_bits = 2, .orientations = StateOrientations::along_axes()};
  const VoxelType type = add_type(one.scene, log);
  one.grid().set({1, 1, 1}, type, {.state = 1});
  LiveMeshes meshes(LiveMeshOptions{});
  meshes.finish(one.scene, {});
  EXPECT_EQ(meshes.take().size(), 1U);
  log.orientations = StateOrientations::about_y();
  one.scene.types.replace(type, log);
  meshes.finish(one.scene, {});
  EXPECT_EQ(meshes.take().size(), 1U);
}

INSTANTIATE_TEST_SUITE_P(All, LiveData,
                         testing::Values(DataCase{"Blocky", SurfaceStyle::Blocky, false},
                                         DataCase{"Lit", SurfaceStyle::Blocky, true},
                                         DataCase{"Smooth", SurfaceStyle::Smooth, false}),
                         [](const auto& tested) { return tested.param.name; });

// A partial grid: data of chunks that come and go is no change, and edits of loaded chunks are.
TEST(LiveConvert, RemeshesLoadedDoors) {
  OneGrid one;
  const VoxelType door = add_type(one.scene, {.name = "door", .colour = {}, .state_bits = 8, .remesh_on_data = true});
  one.grid().make_partial();
  one.grid().set_extent({{0, 0, 0}, {9, 1, 1}});
  LiveMeshes meshes;
  const auto count = [&] {
    meshes.finish(one.scene, {});
    return meshes.take().size();
  };
  const auto load = [&](int x) {
    Chunk chunk(kAir);
    chunk.set({30, 30, 30}, door);
    chunk.set_data({30, 30, 30}, {.state = 1});
    EXPECT_TRUE(one.grid().load_chunk({x, 0, 0}, chunk));
  };
  for (int x = 0; x < 5; ++x) load(x);
  EXPECT_EQ(count(), 4U);
  EXPECT_TRUE(one.grid().set_data({64 + 30, 30, 30}, {.state = 2}));
  load(5);
  EXPECT_EQ(count(), 2U) << "the door, and the chunk that is complete now";
  EXPECT_TRUE(one.grid().unload_chunk({0, 0, 0}));
  EXPECT_EQ(count(), 2U) << "chunks 0 and 1 are gone";
}

/// A shape that depends on a voxel, all 26 neighbours, and the states of stairs among these.
template <class Type, class State>
std::uint64_t shape_of(IVec3 at, VoxelType stairs, const Type& type, const State& state) {
  std::uint64_t shape = 7;
  for (int i = 0; i < 27; ++i) {
    const IVec3 near = at + Neighbourhood::offset(i);
    shape = shape * 1'000'003U + type(near);
    shape = shape * 1'000'003U + (type(near) == stairs ? state(near) : 0U);
  }
  return shape;
}

/// The shapes of the stairs and flowers of a chunk, by voxel of the grid.
using Shapes = std::map<Coordinates, std::uint64_t>;

template <class Type, class State>
Shapes shapes_in(const Chunk& voxels, VoxelType stairs, const Type& type, const State& state) {
  Shapes shapes;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      std::array<VoxelType, kChunkEdge> row;
      voxels.read_row(y, z, row);
      for (int x = 0; x < kChunkEdge; ++x) {
        if (row[static_cast<std::size_t>(x)] < stairs) continue;  // stairs, then flowers
        shapes[{x, y, z}] = shape_of(IVec3{x, y, z}, stairs, type, state);
      }
    }
  }
  return shapes;
}

TEST(LiveConvert, BuildsStairsFromNeighbourhood) {
  OneGrid one;
  const VoxelType stairs = add_type(
      one.scene,
      {.name = "stairs", .colour = {}, .visibility = Visibility::Transparent, .state_bits = 3, .remesh_on_data = true});
  (void)add_type(one.scene, {.name = "flower", .colour = {}, .visibility = Visibility::Transparent});
  LiveMeshOptions wanted;
  wanted.workers = {2};
  wanted.convert = [stairs](const SurfaceUpdate&, const SurfaceContext& context) {
    return std::make_shared<Shapes>(shapes_in(
        *context.voxels.centre(), stairs, [&](IVec3 at) { return context.voxels.get(at); },
        [&](IVec3 at) { return context.voxels.data(at).state; }));
  };
  LiveMeshes meshes(wanted);
  ShownSurfaces shown;
  std::mt19937 random(3);
  const auto below = [&](int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); };
  std::size_t compared = 0;
  for (int round = 0; round < (kIsSlow ? 10 : 40); ++round) {
    for (int i = 0; i < 60; ++i) {
      const IVec3 at{58 + below(12), 60 + below(8), 60 + below(8)};
      if (below(3) == 0) {
        one.grid().set_data(at, {.state = static_cast<std::uint32_t>(below(8))});
      } else {
        one.grid().set(at, static_cast<VoxelType>(below(stairs + 2)));
      }
      if (below(20) == 0) meshes.update(one.scene, {});
    }
    meshes.finish(one.scene, {});
    shown.apply(meshes.take());
    const Grid& grid = one.scene.grids()[one.handle].grid;
    for (const IVec3 chunk : grid.chunks()) {
      const IVec3 first = chunk * kChunkEdge;
      const Shapes expected = shapes_in(
          *grid.find_chunk(chunk), stairs, [&](IVec3 at) { return grid.get(first + at); },
          [&](IVec3 at) { return grid.data(first + at).state; });
      const ChunkSurface* const surface = shown.find(one.handle, chunk);
      if (expected.empty()) continue;
      ASSERT_NE(surface, nullptr);
      ASSERT_EQ(*static_cast<const Shapes*>(surface->converted.get()), expected) << "round " << round;
      compared += expected.size();
    }
  }
  EXPECT_GT(compared, 100U);
}

struct ReadLight {
  std::vector<std::pair<IVec3, LightLevels>> levels;  // of voxels in front of faces
  BlockVector<FaceLight> corners;                     // of the faces, in this order
  std::vector<std::pair<IVec3, Direction>> faces;
};

// The light that `convert` reads is the light that is shown with the surface.
TEST(LiveConvert, ReadsLightOfSurface) {
  PlacedLightWorld world(5);
  LiveMeshOptions wanted;
  wanted.merge = false;
  wanted.workers = {2};
  wanted.convert = [](const SurfaceUpdate& update, const SurfaceContext& context) {
    auto read = std::make_shared<ReadLight>();
    for (std::size_t i = 0; i < update.surface->quads.size(); i += 7) {
      const Quad quad = update.surface->quads[i];
      const IVec3 front = quad.voxel() + normal_of(quad.direction());
      const IVec3 first = update.chunk * kChunkEdge;
      read->levels.emplace_back(first + front, context.light_at(front));
      read->faces.emplace_back(first + quad.voxel(), quad.direction());
      read->corners.push_back(context.light_of_face(quad.voxel(), quad.direction()));
      EXPECT_EQ(read->corners.back(), update.surface->light[i]);
    }
    return read;
  };
  LiveLight light;
  LiveMeshes meshes(wanted);
  meshes.use_light(light);
  ShownSurfaces shown;
  std::mt19937 random(6);
  std::size_t compared = 0;
  for (int round = 0; round < 6; ++round) {
    meshes.finish(world.scene, {});
    shown.apply(meshes.take());
    const GridLight lit = light.shown().of(world.handle);
    SurfaceLight surface_light(*lit.light, *lit.voxels, world.scene.types);
    for (const SurfaceUpdate& each : shown.all()) {
      const auto& read = converted<ReadLight>(each);
      for (const auto& [voxel, levels] : read.levels) ASSERT_EQ(lit.light->at(voxel), levels) << "round " << round;
      for (std::size_t i = 0; i < read.faces.size(); ++i) {
        ASSERT_EQ(surface_light.face(read.faces[i].first, read.faces[i].second), read.corners[i]);
      }
      compared += read.faces.size();
    }
    Grid& grid = world.scene.edit(world.handle).grid;
    for (int i = 0; i < 5; ++i) grid.set(LightWorld::somewhere(random), static_cast<VoxelType>(random() % 5));
  }
  EXPECT_GT(compared, 1000U);
}

TEST(LiveConvert, HasNoLightWithoutUse) {
  OneGrid one;
  one.grid().set({3, 3, 3}, 1);
  LiveMeshOptions wanted;
  wanted.convert = [](const SurfaceUpdate&, const SurfaceContext& context) {
    EXPECT_EQ(context.light, nullptr);
    EXPECT_EQ(context.corners, nullptr);
    EXPECT_EQ(context.densities.centre(), nullptr);
    return std::make_shared<int>(1);
  };
  LiveMeshes meshes(wanted);
  meshes.finish(one.scene, {});
  ASSERT_EQ(meshes.take().size(), 1U);
}

using VertexWeights = std::vector<std::vector<MaterialWeight>>;

// Weights give the types and the mean colours of the vertices.
void expect_weights(const ChunkSurface& surface, const VoxelRegistry& types, bool has_mean_colours, bool& is_mixed) {
  const auto& all = *static_cast<const VertexWeights*>(surface.converted.get());
  ASSERT_EQ(all.size(), surface.types.size());
  for (std::size_t v = 0; v < all.size(); ++v) {
    float sum = 0.0F;
    std::array<double, 4> mean{};
    for (const MaterialWeight& each : all[v]) {
      sum += each.weight;
      const LinearRgba16 colour = linear_colour_of(types[each.type].colour);
      for (std::size_t i = 0; i < 4; ++i) mean[i] += double{each.weight} * colour[i];
    }
    ASSERT_NEAR(sum, 1.0F, 1e-5F);
    is_mixed |= all[v].size() > 1;
    if (!has_mean_colours) continue;
    ASSERT_EQ(all[v].front().type, surface.types[v]);
    for (std::size_t i = 0; i < 4; ++i) ASSERT_NEAR(mean[i], surface.albedo[v][i], 1.0);
  }
}

TEST(LiveConvert, WeighsMaterials) {
  OneGrid one;
  one.field().add_sphere({40.0, 40.0, 40.0}, 30.0, 1);
  one.field().add_sphere({60.0, 50.0, 40.0}, 25.0, 3);
  one.field().add_sphere({100.0, 40.0, 40.0}, 30.0, 3);
  one.field().add_sphere({80.0, 60.0, 40.0}, 14.0, 2);  // glass
  one.grid().fill_sphere({-40.0, 40.0, 40.0}, 20.0, 1);
  one.grid().fill_sphere({-50.0, 45.0, 40.0}, 20.0, 3);
  for (const double detail_distance : {1000.0, 30.0}) {
    for (const SurfaceColours colours : {SurfaceColours::Sharp, SurfaceColours::Blended}) {
      LiveMeshOptions wanted;
      wanted.style = SurfaceStyle::Smooth;
      wanted.colours = colours;
      wanted.detail_distance = detail_distance;
      wanted.convert = [](const SurfaceUpdate& update, const SurfaceContext& context) {
        auto weights = std::make_shared<VertexWeights>(update.surface->types.size());
        for (std::size_t v = 0; v < weights->size(); ++v) {
          context.material_weights(*update.surface, v, (*weights)[v]);
        }
        const auto& voxels = context.voxels.chunks;
        const bool has_voxels =
            std::any_of(voxels.begin(), voxels.end(), [](const Chunk* each) { return each != nullptr; });
        EXPECT_EQ(has_voxels, update.content == SurfaceContent::Voxels);
        return weights;
      };
      LiveMeshes meshes(wanted);
      meshes.finish(one.scene, {0.0, 40.0, 40.0});
      std::map<std::pair<SurfaceContent, int>, bool> is_mixed;
      for (const SurfaceUpdate& each : meshes.take()) {
        const bool has_mean_colours = each.content == SurfaceContent::Field || colours == SurfaceColours::Blended;
        expect_weights(*each.surface, one.scene.types, has_mean_colours, is_mixed[{each.content, each.surface->level}]);
        if (HasFatalFailure()) return;
      }
      EXPECT_TRUE((is_mixed[{SurfaceContent::Voxels, 0}]));
      EXPECT_EQ(is_mixed.size() > 2, detail_distance < 100.0) << "several levels of detail";
    }
  }
}

/// Converted data that counts how much of it exists, as the data of a plug-in would.
class Plugin {
 public:
  struct Data {
    Data(Plugin& plugin, int number) : made_by(plugin), version(number) { ++made_by.alive; }
    Data(const Data&) = delete;
    Data& operator=(const Data&) = delete;
    ~Data() { --made_by.alive; }
    Plugin& made_by;
    const int version;
  };

  explicit Plugin(int version) : version_(version) {}
  SurfaceConverter converter() {
    return [this](const SurfaceUpdate&) {
      ++inside;
      is_open.wait(false);
      auto made = std::make_shared<Data>(*this, version_);
      --inside;
      return made;
    };
  }
  void open() {
    is_open = true;
    is_open.notify_all();
  }

  std::atomic<int> inside{0};
  std::atomic<int> alive{0};
  std::atomic<bool> is_open{true};

 private:
  int version_;
};

/// Opens a gate soon, from another thread.
class OpenSoon {
 public:
  explicit OpenSoon(std::function<void()> open)
      : thread_([open = std::move(open)] {
          std::this_thread::sleep_for(std::chrono::milliseconds(30));
          open();
        }) {}
  OpenSoon(const OpenSoon&) = delete;
  OpenSoon& operator=(const OpenSoon&) = delete;
  ~OpenSoon() { thread_.join(); }

 private:
  std::thread thread_;
};

TEST(LiveReload, WaitsForRunningConvert) {
  OneGrid one;
  one.grid().fill_box({{0, 0, 0}, {640, 10, 10}}, 1);
  Plugin former(1);
  Plugin newer(2);
  former.is_open = false;
  LiveMeshOptions wanted;
  wanted.workers = {2};
  wanted.convert = former.converter();
  LiveMeshes meshes(wanted);
  meshes.update(one.scene, {});
  while (former.inside == 0) std::this_thread::yield();
  {
    const OpenSoon soon([&] { former.open(); });
    meshes.set_convert(newer.converter());
    EXPECT_TRUE(former.is_open);
    EXPECT_EQ(former.inside, 0);
    EXPECT_EQ(former.alive, 0) << "no result of the former function is left";
  }
  meshes.finish(one.scene, {});
  const std::vector<SurfaceUpdate> taken = meshes.take();
  EXPECT_EQ(taken.size(), 10U);
  for (const SurfaceUpdate& each : taken) EXPECT_EQ(converted<Plugin::Data>(each).version, 2);
  EXPECT_EQ(former.alive, 0);
}

TEST(LiveReload, WaitsForRunningOnReady) {
  OneGrid one;
  one.grid().set({3, 3, 3}, 1);
  std::atomic<bool> is_open{false};
  std::atomic<int> inside{0};
  std::atomic<int> newer{0};
  LiveMeshOptions wanted;
  wanted.on_ready = [&] {
    ++inside;
    is_open.wait(false);
    --inside;
  };
  LiveMeshes meshes(wanted);
  meshes.update(one.scene, {});
  while (inside == 0) std::this_thread::yield();
  {
    const OpenSoon soon([&] {
      is_open = true;
      is_open.notify_all();
    });
    meshes.set_on_ready([&] { ++newer; });
    EXPECT_EQ(inside, 0);
    EXPECT_TRUE(is_open);
  }
  EXPECT_EQ(newer, 0);
  one.grid().set({4, 3, 3}, 1);
  meshes.finish(one.scene, {});
  while (newer == 0) std::this_thread::yield();
  meshes.set_on_ready(nullptr);
  one.grid().set({5, 3, 3}, 1);
  meshes.finish(one.scene, {});
  EXPECT_EQ(newer, 1);
}

struct ReloadCase {
  const char* name;
  SurfaceStyle style;
  bool is_field;
  bool is_lit;
};

class LiveReloads : public testing::TestWithParam<ReloadCase> {
 protected:
  void fill(IVec3 at, VoxelType type) {
    const DVec3 centre = DVec3(at) + 0.5;
    if (!GetParam().is_field) {
      one_.grid().fill_sphere(centre, 4.0, type);
    } else if (type == kAir) {
      one_.field().remove_sphere(centre, 8.0);
    } else {
      one_.field().add_sphere(centre, 4.0, type);
    }
  }

  OneGrid one_;
};

// Edits that were meshed but not taken are converted again, and shown together; removed chunks are still reported.
TEST_P(LiveReloads, DropResultsThatWereNotTaken) {
  for (int i = 0; i < 6; ++i) fill({64 * i + 30, 30, 30}, 1);
  Plugin former(1);
  Plugin newer(2);
  LiveMeshOptions wanted;
  wanted.style = GetParam().style;
  wanted.convert = former.converter();
  LiveLight light;
  LiveMeshes meshes(wanted);
  if (GetParam().is_lit) meshes.use_light(light);
  meshes.finish(one_.scene, {});
  std::vector<SurfaceUpdate> held = meshes.take();
  ASSERT_EQ(held.size(), 6U);
  const std::uint64_t shown = meshes.shown_update();
  fill({64 * 2 + 30, 30, 30}, kAir);
  fill({64 * 3 + 34, 30, 30}, 3);
  meshes.finish(one_.scene, {});
  EXPECT_EQ(former.alive, 7);
  meshes.set_convert(newer.converter());
  EXPECT_EQ(former.alive, 6) << "only those that were taken";
  EXPECT_TRUE(meshes.take().empty());
  EXPECT_EQ(meshes.shown_update(), shown);
  EXPECT_GT(meshes.pending(), 0U);
  meshes.finish(one_.scene, {});
  const std::vector<SurfaceUpdate> taken = meshes.take();
  ASSERT_EQ(taken.size(), 6U);
  for (const SurfaceUpdate& each : taken) {
    ASSERT_EQ(each.surface == nullptr, each.chunk.x == 2);
    EXPECT_EQ(each.changed_regions, ~std::uint64_t{0}) << "the former vertices have another format";
    if (each.surface != nullptr) {
      EXPECT_EQ(converted<Plugin::Data>(each).version, 2);
    }
  }
  EXPECT_GT(meshes.shown_update(), shown);
  held.clear();
  meshes.set_convert(newer.converter());
  EXPECT_EQ(former.alive, 0) << "and of those that were dropped before the call";
  // A grid that has left the scene is reported too.
  meshes.finish(one_.scene, {});
  EXPECT_EQ(meshes.take().size(), 5U);
  one_.scene.remove_instance(one_.placed);
  meshes.finish(one_.scene, {});
  meshes.set_convert(nullptr);
  meshes.finish(one_.scene, {});
  EXPECT_EQ(meshes.take().size(), 5U);
  EXPECT_EQ(meshes.pending(), 0U);
}

INSTANTIATE_TEST_SUITE_P(All, LiveReloads,
                         testing::Values(ReloadCase{"Blocky", SurfaceStyle::Blocky, false, false},
                                         ReloadCase{"Lit", SurfaceStyle::Blocky, false, true},
                                         ReloadCase{"Smooth", SurfaceStyle::Smooth, false, false},
                                         ReloadCase{"Field", SurfaceStyle::Blocky, true, false}),
                         [](const auto& tested) { return tested.param.name; });

// The surfaces are right and of the newest function, however edits, reloads and `take` follow each other.
TEST(LiveReload, KeepsSurfacesRight) {
  for (const SurfaceStyle style : {SurfaceStyle::Blocky, SurfaceStyle::Smooth}) {
    SceneEditor editor(style == SurfaceStyle::Blocky ? 8 : 9);
    LiveMeshOptions wanted;
    wanted.style = style;
    wanted.workers = {3};
    std::vector<std::unique_ptr<Plugin>> plugins;
    LiveLight light;
    LiveMeshes meshes(wanted);
    if (style == SurfaceStyle::Blocky) meshes.use_light(light);
    ShownSurfaces shown;
    for (int i = 0; i < (kIsSlow ? 30 : 150); ++i) {
      editor.edit();
      meshes.update(editor.scene, editor.eye());
      if (editor.below(3) == 0) shown.apply(meshes.take());
      if (editor.below(8) == 0) {
        plugins.push_back(std::make_unique<Plugin>(static_cast<int>(plugins.size())));
        meshes.set_convert(plugins.back()->converter());
      }
    }
    meshes.finish(editor.scene, {});
    shown.apply(meshes.take());
    for (const SurfaceUpdate& each : shown.all()) {
      EXPECT_EQ(converted<Plugin::Data>(each).version + 1, static_cast<int>(plugins.size()));
    }
    if (style == SurfaceStyle::Smooth) expect_surfaces(shown, editor.scene, wanted);
    meshes.use_light(static_cast<const SceneLight*>(nullptr));
    meshes.finish(editor.scene, {});
    shown.apply(meshes.take());
    expect_surfaces(shown, editor.scene, wanted);
  }
}

}  // namespace
}  // namespace quoin
