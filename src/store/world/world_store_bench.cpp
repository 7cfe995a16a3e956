// store/save, store/load: chunks of generated terrain to and from a world on disk, including codec, checksums and
// syncs, on one worker thread. store/caller: the cost of saving on the calling thread.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>

#include <benchmark/benchmark.h>
#include <quoin/store/world_saver.h>

#include "store/world/terrain_chunks_for_tests.h"
#include "store/world/world_for_tests.h"

namespace quoin {
namespace {

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "store benchmark: %s\n", what);
  std::exit(1);
}

const TerrainChunks& terrain() {
  static const TerrainChunks chunks(40);
  return chunks;
}

WorldStore new_world(const std::filesystem::path& path) {
  auto world = WorldStore::create(path, {1});
  require(world.has_value(), "a world cannot be made");
  WorldChanges changes;
  changes.put_types(terrain().types);
  changes.put_grid(0, {.name = "land"});
  require(world->save(std::move(changes)).has_value() && world->flush().has_value(), "it cannot be saved to");
  return std::move(*world);
}

void save_all(WorldStore& world, const std::vector<std::size_t>& order, std::size_t group) {
  for (std::size_t begin = 0; begin < order.size(); begin += group) {
    WorldChanges changes;
    for (std::size_t i = begin; i < std::min(begin + group, order.size()); ++i) {
      changes.put_chunk(terrain().places[order[i]], terrain().chunks[order[i]]);
    }
    require(world.save(std::move(changes)).has_value(), "chunks cannot be saved");
  }
  require(world.flush().has_value(), "chunks cannot be saved");
}

std::vector<std::size_t> order_of(bool is_random) {
  std::vector<std::size_t> order(terrain().chunks.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::minstd_rand random(3);
  if (is_random) std::shuffle(order.begin(), order.end(), random);
  return order;
}

void check(const WorldStore& world) {
  for (std::size_t i = 0; i < terrain().chunks.size(); i += 17) {
    const auto chunk = world.load_chunk(terrain().places[i]);
    require(chunk && *chunk && **chunk == terrain().chunks[i], "a chunk is another");
  }
}

void count(benchmark::State& state, const WorldStore& world) {
  const auto chunks = static_cast<double>(terrain().chunks.size());
  state.counters["chunks"] = chunks;
  state.counters["chunks_per_second"] = benchmark::Counter(chunks, benchmark::Counter::kIsIterationInvariantRate);
  const double bytes = static_cast<double>(std::filesystem::file_size(world.path()));
  state.counters["file_bytes_per_chunk"] = bytes / chunks;
}

// Saves to a new world.
void save_new(benchmark::State& state) {
  const WorldFolder folder;
  const std::vector<std::size_t> order = order_of(false);
  int number = 0;
  std::optional<WorldStore> world;
  for (auto _ : state) {
    state.PauseTiming();
    world.reset();
    const auto path = folder.path() / (std::to_string(number++) + ".quoin");
    world = new_world(path);
    state.ResumeTiming();
    save_all(*world, order, 64);
  }
  check(*world);
  const auto path = world->path();
  world.reset();
  count(state, *WorldStore::open(path, WorldAccess::Read));
}

// Saves the same chunks again, in another order.
void save_again(benchmark::State& state) {
  const WorldFolder folder;
  WorldStore world = new_world(folder / "w.quoin");
  save_all(world, order_of(false), 64);
  const std::vector<std::size_t> order = order_of(true);
  for (auto _ : state) save_all(world, order, 64);
  check(world);
  count(state, world);
}

// Saves one chunk and waits until it is safe.
void save_one(benchmark::State& state) {
  const WorldFolder folder;
  WorldStore world = new_world(folder / "w.quoin");
  std::size_t i = 0;
  for (auto _ : state) {
    WorldChanges changes;
    i = (i + 101) % terrain().chunks.size();
    changes.put_chunk(terrain().places[i], terrain().chunks[i]);
    const auto ticket = world.save(std::move(changes));
    require(ticket && world.wait(*ticket), "a chunk cannot be saved");
  }
}

void load(benchmark::State& state) {
  const WorldFolder folder;
  {
    WorldStore world = new_world(folder / "w.quoin");
    save_all(world, order_of(false), 64);
  }
  const auto world = WorldStore::open(folder / "w.quoin", WorldAccess::Read, {1});
  check(*world);
  const std::vector<std::size_t> order = order_of(true);
  for (auto _ : state) {
    for (const std::size_t i : order) {
      const auto chunk = world->load_chunk(terrain().places[i]);
      benchmark::DoNotOptimize(chunk);
      require(chunk && *chunk, "a chunk is lost");
    }
  }
  count(state, *world);
}

/// A landscape and its saver.
struct Kept {
  WorldFolder folder;
  WorldStore world;
  Scene scene;
  GridHandle land;
  WorldSaver saver;

  Kept() : world(WorldStore::create(folder / "w.quoin", {1}).value()) {
    scene.types = terrain().types;
    SceneGrid grid;
    for (std::size_t i = 0; i < terrain().chunks.size(); ++i) {
      grid.grid.put_chunk(terrain().places[i].chunk, terrain().chunks[i].voxels);
    }
    land = scene.add_grid(std::move(grid));
    scene.add_instance({.name = "land", .grid = land});
    save();
    require(world.flush().has_value(), "a scene cannot be saved");
  }
  void save() { require(saver.save(world, scene).has_value(), "a scene cannot be saved"); }
};

void save_nothing(benchmark::State& state) {
  Kept kept;
  for (auto _ : state) kept.save();
}

// Edits one voxel per save; the caller does not wait for the disk.
void save_edit(benchmark::State& state) {
  Kept kept;
  int i = 0;
  for (auto _ : state) {
    state.PauseTiming();
    kept.scene.edit(kept.land).grid.set({i * 67 % 1280, 100, i * 31 % 1280}, static_cast<VoxelType>(1 + i % 2));
    ++i;
    state.ResumeTiming();
    kept.save();
    state.PauseTiming();
    require(kept.world.flush().has_value(), "an edit cannot be saved");
    state.ResumeTiming();
  }
}

BENCHMARK(save_new)->Name("store/save/new")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(save_again)->Name("store/save/again")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(save_one)->Name("store/save/one")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(load)->Name("store/load")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(save_nothing)->Name("store/caller/nothing")->Unit(benchmark::kMicrosecond);
BENCHMARK(save_edit)->Name("store/caller/edit")->Unit(benchmark::kMicrosecond)->Iterations(200);

}  // namespace
}  // namespace quoin
