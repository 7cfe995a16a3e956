// map/1.12, map/1.13, map/1.18: a map of 16 regions with 16,384 finished chunks of a real region of that version
//                   (tests/maps/repeat_region.py), on one thread. Counters: chunks per second of processor time; share,
//                   the bytes of the tiles of all zooms by those of the world; peak_mb.
// map/luanti, map/quoin: a real Luanti map; the world of map/1.13 with four regions, converted to .quoin. Chunks are
//                   parts of these formats.
// map/unchanged     brings the map of 12,288 unchanged chunks up to date
//
// They need ../shared/data and python3.

#include <quoin/map/world_map.h>

#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include <benchmark/benchmark.h>
#include <quoin/io/block_packs.h>
#include <quoin/store/world_import.h>

#include "bench/process_memory.h"

namespace quoin {
namespace {

namespace fs = std::filesystem;

const fs::path kData = fs::path(QUOIN_SOURCE_DIR).parent_path() / "shared" / "data";
const std::string kFixtures = "mc/PrismarineJS+prismarine-provider-anvil/test__fixtures__";

// A folder that is removed at the end of the process.
const fs::path& scratch() {
  struct Folder {
    fs::path path = fs::temp_directory_path() / ("quoin_map_bench_" + std::to_string(::getpid()));
    ~Folder() { fs::remove_all(path); }
  };
  static const Folder folder;
  return folder.path;
}

// Returns a world of repeated chunks; empty if it cannot be made.
fs::path repeated(const std::string& region, int regions) {
  const fs::path world = scratch() / (region + std::to_string(regions));
  if (fs::exists(world)) return world;
  const std::string command = "python3 '" + std::string(QUOIN_SOURCE_DIR) + "/tests/maps/repeat_region.py' '" +
                              (kData / (kFixtures + region + ".mca")).string() + "' '" + world.string() + "' " +
                              std::to_string(regions) + " >/dev/null 2>&1";
  return std::system(command.c_str()) == 0 ? world : fs::path();
}

std::uint64_t bytes_below(const fs::path& folder) {
  if (!fs::is_directory(folder)) return fs::file_size(folder);
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) bytes += entry.file_size();
  }
  return bytes;
}

std::unique_ptr<ChunkSource> opened(const fs::path& world) {
  auto source = open_map_source(world);
  auto packs = BlockPacks::open(std::vector<fs::path>{kBuiltinPack});
  return source && packs ? with_packs(std::move(*source), *packs) : nullptr;
}

void draw(benchmark::State& state, const fs::path& world) {
  if (world.empty() || !fs::exists(world)) return state.SkipWithError("needs ../shared/data and python3");
  const fs::path folder = scratch() / "map";
  std::uint64_t chunks = 0;
  reset_peak();
  for (auto _ : state) {
    state.PauseTiming();
    fs::remove_all(folder);
    state.ResumeTiming();
    const auto source = opened(world);
    const auto drawn = source ? draw_map(*source, folder, {.threads = {1}}) : Result<DrawnMap>(Error{});
    if (!drawn) return state.SkipWithError("the map cannot be drawn");
    chunks += drawn->chunks;
  }
  state.counters["chunks"] = benchmark::Counter(static_cast<double>(chunks), benchmark::Counter::kIsRate);
  state.counters["share"] =
      static_cast<double>(bytes_below(folder / "tiles")) / static_cast<double>(bytes_below(world));
  state.counters["peak_mb"] = status_megabytes("VmHWM:");
}

void map_1_12(benchmark::State& state) {
  draw(state, repeated("1.12.2__r.0.-1", 16));
}
void map_1_13(benchmark::State& state) {
  draw(state, repeated("1.13.2__r.-1.-1", 16));
}
void map_1_18(benchmark::State& state) {
  draw(state, repeated("1.18.2__r.0.0", 16));
}
void map_luanti(benchmark::State& state) {
  draw(state, kData / "luanti/cornernote+minetest-mesecons-circuits");
}
void map_quoin(benchmark::State& state) {
  const fs::path world = scratch() / "world.quoin";
  if (const fs::path from = repeated("1.13.2__r.-1.-1", 4); !fs::exists(world) && !from.empty()) {
    const auto source = opened(from);
    if (!source || !import_world(*source, world)) return state.SkipWithError("cannot convert the world");
  }
  draw(state, world);
}
void map_unchanged(benchmark::State& state) {
  const fs::path world = repeated("1.13.2__r.-1.-1", 12);
  if (world.empty()) return state.SkipWithError("needs ../shared/data and python3");
  const fs::path folder = scratch() / "unchanged";
  if (const auto source = opened(world); !source || !draw_map(*source, folder)) {
    return state.SkipWithError("the map cannot be drawn");
  }
  for (auto _ : state) {
    const auto source = opened(world);
    const auto drawn = draw_map(*source, folder);
    if (!drawn || drawn->tiles_written > 0) return state.SkipWithError("the map is not up to date");
  }
}

BENCHMARK(map_1_12)->Name("map/1.12")->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK(map_1_13)->Name("map/1.13")->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK(map_1_18)->Name("map/1.18")->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK(map_luanti)->Name("map/luanti")->Unit(benchmark::kMillisecond);
BENCHMARK(map_quoin)->Name("map/quoin")->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK(map_unchanged)->Name("map/unchanged")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin
