// rays/*: the 256x128x256 terrain, primary, shadow and occlusion rays, one at a time, in packets and in arrays of
// packets; rays/random600.
// rays/*/subnormal_lanes: the same with subnormal numbers in unused lanes. ratio_to_zeroed is its time divided by the
// time with zeros there, at most 1.1.

#include <bit>
#include <chrono>
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

int count_hits(Ask ask, const std::vector<RayQuery>& rays) {
  const OccupancyTree& tree = ray_workload().tree;
  int hits = 0;
  for (const RayQuery& query : rays) {
    hits +=
        ask == Ask::First ? first_hit(tree, query.ray, query.max_t).has_value() : any_hit(tree, query.ray, query.max_t);
  }
  return hits;
}

int count_hits(Ask ask, const std::vector<RayPacket>& packets) {
  const OccupancyTree& tree = ray_workload().tree;
  PacketHits found;
  int hits = 0;
  for (const RayPacket& packet : packets) {
    if (ask == Ask::First) first_hits(tree, packet, found);
    hits += std::popcount(ask == Ask::First ? found.hit : any_hits(tree, packet));
  }
  return hits;
}

void trace(benchmark::State& state, const Case& c, InstructionSet set) {
  const InstructionSetOverride over(set);
  const std::vector<RayQuery>& rays = c.rays();
  int hits = 0;
  for (auto _ : state) hits = count_hits(c.ask, rays);
  report(state, rays.size(), hits, c.expected);
}

void trace_packets(benchmark::State& state, const Case& c, InstructionSet set) {
  const InstructionSetOverride over(set);
  const std::vector<RayPacket> packets = workloads::ray_packets(c.rays());
  int hits = 0;
  for (auto _ : state) hits = count_hits(c.ask, packets);
  report(state, c.rays().size(), hits, c.expected);
}

void trace_array(benchmark::State& state, const Case& c, InstructionSet set) {
  const InstructionSetOverride over(set);
  const std::vector<RayPacket> packets = workloads::ray_packets(c.rays());
  std::vector<std::uint32_t> blocked(packets.size());
  int hits = 0;
  for (auto _ : state) {
    any_hits(ray_workload().tree, packets, blocked);
    hits = 0;
    for (const std::uint32_t each : blocked) hits += std::popcount(each);
  }
  report(state, c.rays().size(), hits, c.expected);
}

// Subnormal as a float, and as a double.
constexpr double kSubnormalFloat = 1e-40;
constexpr double kSubnormalDouble = 1e-310;

// Rays without motion along x, by a component that is 0 or subnormal as a float. In memory it follows the origin, so a
// kernel that reads four numbers there also has it in its unused lane.
std::vector<RayQuery> still_rays(std::vector<RayQuery> rays, double x) {
  for (RayQuery& query : rays) query.ray.direction.x = x;
  return rays;
}

// Makes every second lane of the packets inactive and puts these numbers into it.
std::vector<RayPacket> sparse_packets(const std::vector<RayQuery>& rays, double xz, double y) {
  std::vector<RayPacket> packets = workloads::ray_packets(rays);
  for (RayPacket& packet : packets) {
    packet.active &= 0x5555U;
    for (std::size_t i = 1; i < RayPacket::kSize; i += 2) {
      packet.origin_x[i] = packet.origin_z[i] = packet.direction_x[i] = packet.direction_z[i] = xz;
      packet.origin_y[i] = packet.direction_y[i] = y;
    }
  }
  return packets;
}

template <class Rays>
void compare(benchmark::State& state, Ask ask, const Rays& zeroed, const Rays& subnormal) {
  using Clock = std::chrono::steady_clock;
  const auto seconds = [](Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration<double>(to - from).count();
  };
  double of_zeroed = 0.0;
  double of_subnormal = 0.0;
  int expected = 0;
  int hits = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const Clock::time_point start = Clock::now();
    expected = count_hits(ask, zeroed);
    state.ResumeTiming();
    const Clock::time_point middle = Clock::now();
    hits = count_hits(ask, subnormal);
    const Clock::time_point end = Clock::now();
    of_zeroed += seconds(start, middle);
    of_subnormal += seconds(middle, end);
  }
  if (hits != expected || hits == 0) {
    std::fprintf(stderr, "ray benchmark: %d hits with subnormal lanes, %d with zeroed ones\n", hits, expected);
    std::exit(1);
  }
  state.counters["hits"] = hits;
  state.counters["ratio_to_zeroed"] = of_subnormal / of_zeroed;
}

void trace_subnormal(benchmark::State& state, const Case& c, InstructionSet set) {
  const InstructionSetOverride over(set);
  compare(state, c.ask, still_rays(c.rays(), 0.0), still_rays(c.rays(), kSubnormalFloat));
}

void trace_subnormal_packets(benchmark::State& state, const Case& c, InstructionSet set) {
  const InstructionSetOverride over(set);
  compare(state, c.ask, sparse_packets(c.rays(), 0.0, 0.0),
          sparse_packets(c.rays(), kSubnormalFloat, kSubnormalDouble));
}

[[maybe_unused]] const bool registered = [] {
  const auto add = [](const Case& c, const std::string& suffix, InstructionSet set) {
    if (!has_instruction_set(set)) return;
    const std::string name = "rays/" + std::string(c.name);
    benchmark::RegisterBenchmark((name + "/single" + suffix).c_str(), trace, c, set)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark((name + "/packet" + suffix).c_str(), trace_packets, c, set)
        ->Unit(benchmark::kMillisecond);
    if (c.ask == Ask::First) return;
    benchmark::RegisterBenchmark((name + "/array" + suffix).c_str(), trace_array, c, set)
        ->Unit(benchmark::kMillisecond);
  };
  for (const Case& c : kCases) add(c, "", instruction_set());
  const auto add_subnormal = [](const Case& c, const char* kind, auto run) {
    benchmark::RegisterBenchmark(("rays/" + std::string(c.name) + kind + "/subnormal_lanes").c_str(), run, c,
                                 instruction_set())
        ->Unit(benchmark::kMillisecond);
  };
  for (const Case& c : kCases) {
    add_subnormal(c, "/single", trace_subnormal);
    add_subnormal(c, "/packet", trace_subnormal_packets);
  }
  for (const Case& c : kShuffled) add(c, "/shuffled", instruction_set());
  for (const Case& c : kCases) add(c, "/avx2", InstructionSet::Avx2);
  for (const Case& c : kCases) add(c, "/plain", InstructionSet::Plain);
  return true;
}();

// Traces first hits in the same way as a game.
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

// Updates the tree after an edit of a cube of this edge; excludes the edit.
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
