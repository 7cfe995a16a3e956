// rays/*: the 256x128x256 terrain, primary, shadow and occlusion rays, one at a time and in packets; rays/random600.

#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <quoin/trace/packet.h>
#include <quoin/trace/ray.h>

#include "bench/ray_workload.h"
#include "core/instruction_set.h"

namespace quoin {
namespace {

using workloads::random_ray_workload;
using workloads::ray_workload;
using workloads::RayQuery;
using workloads::shuffled_rays;

void report(benchmark::State& state, std::size_t rays, int hits, int expected) {
  if (std::abs(hits - expected) > workloads::kHitTolerance) {
    std::fprintf(stderr, "ray benchmark: %d hits, expected %d\n", hits, expected);
    std::exit(1);
  }
  state.counters["hits"] = hits;
  state.counters["rays_per_second"] =
      benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsIterationInvariantRate);
}

enum class Ask : std::uint8_t { First, Any };

struct Case {
  const char* name;
  Ask ask;
  const std::vector<RayQuery>& (*rays)();
  int expected;
};

const Case kCases[] = {
    {"primary", Ask::First, []() -> const std::vector<RayQuery>& { return ray_workload().primary; },
     workloads::kPrimaryHits},
    {"shadow", Ask::Any, []() -> const std::vector<RayQuery>& { return ray_workload().shadow; },
     workloads::kShadowHits},
    {"ao", Ask::Any, []() -> const std::vector<RayQuery>& { return ray_workload().occlusion; },
     workloads::kOcclusionHits},
};

const Case kShuffled[] = {
    {"primary", Ask::First, []() -> const std::vector<RayQuery>& { return shuffled_rays().primary; },
     workloads::kPrimaryHits},
    {"shadow", Ask::Any, []() -> const std::vector<RayQuery>& { return shuffled_rays().shadow; },
     workloads::kShadowHits},
    {"ao", Ask::Any, []() -> const std::vector<RayQuery>& { return shuffled_rays().occlusion; },
     workloads::kOcclusionHits},
};

void trace(benchmark::State& state, const Case& c, InstructionSet set) {
  const InstructionSetOverride over(set);
  const OccupancyTree& tree = ray_workload().tree;
  const std::vector<RayQuery>& rays = c.rays();
  int hits = 0;
  for (auto _ : state) {
    hits = 0;
    for (const RayQuery& query : rays) {
      hits += c.ask == Ask::First ? first_hit(tree, query.ray, query.max_t).has_value()
                                  : any_hit(tree, query.ray, query.max_t);
    }
  }
  report(state, rays.size(), hits, c.expected);
}

void trace_packets(benchmark::State& state, const Case& c, InstructionSet set) {
  const InstructionSetOverride over(set);
  const OccupancyTree& tree = ray_workload().tree;
  const std::vector<RayPacket> packets = workloads::ray_packets(c.rays());
  PacketHits found;
  int hits = 0;
  for (auto _ : state) {
    hits = 0;
    for (const RayPacket& packet : packets) {
      if (c.ask == Ask::First) first_hits(tree, packet, found);
      hits += std::popcount(c.ask == Ask::First ? found.hit : any_hits(tree, packet));
    }
  }
  report(state, c.rays().size(), hits, c.expected);
}

[[maybe_unused]] const bool registered = [] {
  const auto add = [](const Case& c, const std::string& suffix, InstructionSet set) {
    if (!has_instruction_set(set)) return;
    const std::string name = "rays/" + std::string(c.name);
    benchmark::RegisterBenchmark((name + "/single" + suffix).c_str(), trace, c, set)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark((name + "/packet" + suffix).c_str(), trace_packets, c, set)
        ->Unit(benchmark::kMillisecond);
  };
  for (const Case& c : kCases) add(c, "", instruction_set());
  for (const Case& c : kShuffled) add(c, "/shuffled", instruction_set());
  for (const Case& c : kCases) add(c, "/avx2", InstructionSet::Avx2);
  for (const Case& c : kCases) add(c, "/plain", InstructionSet::Plain);
  return true;
}();

// First hits, as a game asks for them.
void random600(benchmark::State& state) {
  const auto& workload = random_ray_workload();
  int hits = 0;
  for (auto _ : state) {
    hits = 0;
    for (const RayQuery& query : workload.rays) hits += first_hit(workload.tree, query.ray, query.max_t).has_value();
  }
  report(state, workload.rays.size(), hits, workloads::kRandomHits);
}
BENCHMARK(random600)->Name("rays/random600")->Unit(benchmark::kMillisecond);

void build(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(OccupancyTree::build(ray_workload().grid, ray_workload().types).bytes());
  }
  state.counters["bytes"] = static_cast<double>(ray_workload().tree.bytes());
}
BENCHMARK(build)->Name("rays/build")->Unit(benchmark::kMillisecond);

// Following an edit of a cube of this edge, the edit itself not counted.
void update(benchmark::State& state) {
  Grid grid = workloads::terrain_grid(256, 256);
  ChangeCursor cursor = grid.cursor();
  OccupancyTree tree = OccupancyTree::build(grid, ray_workload().types);
  const IVec3 corner{100, 20, 100};
  const IVec3 size{static_cast<int>(state.range(0))};
  bool is_solid = false;
  for (auto _ : state) {
    state.PauseTiming();
    grid.fill_box({corner, corner + size + 1}, is_solid ? VoxelType{1} : kAir);
    is_solid = !is_solid;
    const GridChanges dirty = grid.changes_since(cursor);
    state.ResumeTiming();
    tree.update(grid, ray_workload().types, dirty);
  }
}
BENCHMARK(update)->Name("rays/update")->Arg(1)->Arg(32)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace quoin
