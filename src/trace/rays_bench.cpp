// rays/*: the 256x128x256 terrain, primary, shadow and occlusion rays, one at a time and in packets; rays/random600.

#include <bit>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <quoin/trace/packet.h>
#include <quoin/trace/ray.h>

#include "bench/ray_workload.h"

namespace quoin {
namespace {

using workloads::random_ray_workload;
using workloads::ray_workload;
using workloads::RayQuery;

void report(benchmark::State& state, std::size_t rays, int hits, int expected) {
  if (std::abs(hits - expected) > workloads::kHitTolerance) {
    std::fprintf(stderr, "ray benchmark: %d hits, expected %d\n", hits, expected);
    std::exit(1);
  }
  state.counters["hits"] = hits;
  state.counters["rays_per_second"] =
      benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsIterationInvariantRate);
}

void trace(benchmark::State& state, const std::vector<RayQuery>& rays, int expected) {
  int hits = 0;
  for (auto _ : state) {
    hits = 0;
    for (const RayQuery& query : rays) hits += any_hit(ray_workload().tree, query.ray, query.max_t);
  }
  report(state, rays.size(), hits, expected);
}

// Packets of 16 in the order of the rays.
std::vector<RayPacket> packets_of(const std::vector<RayQuery>& rays) {
  std::vector<RayPacket> packets((rays.size() + 15) / 16);
  for (std::size_t i = 0; i < rays.size(); ++i)
    packets[i / 16].set(static_cast<int>(i % 16), rays[i].ray, rays[i].max_t);
  return packets;
}

void trace_packets(benchmark::State& state, const std::vector<RayQuery>& rays, int expected, InstructionSet set) {
  const std::vector<RayPacket> packets = packets_of(rays);
  int hits = 0;
  for (auto _ : state) {
    hits = 0;
    for (const RayPacket& packet : packets) hits += std::popcount(any_hits(ray_workload().tree, packet, set));
  }
  report(state, rays.size(), hits, expected);
}

void primary(benchmark::State& state) {
  trace(state, ray_workload().primary, workloads::kPrimaryHits);
}
void shadow(benchmark::State& state) {
  trace(state, ray_workload().shadow, workloads::kShadowHits);
}
void occlusion(benchmark::State& state) {
  trace(state, ray_workload().occlusion, workloads::kOcclusionHits);
}
BENCHMARK(primary)->Name("rays/primary/single")->Unit(benchmark::kMillisecond);
BENCHMARK(shadow)->Name("rays/shadow/single")->Unit(benchmark::kMillisecond);
BENCHMARK(occlusion)->Name("rays/ao/single")->Unit(benchmark::kMillisecond);

void primary_packets(benchmark::State& state, InstructionSet set) {
  trace_packets(state, ray_workload().primary, workloads::kPrimaryHits, set);
}
void shadow_packets(benchmark::State& state, InstructionSet set) {
  trace_packets(state, ray_workload().shadow, workloads::kShadowHits, set);
}
void occlusion_packets(benchmark::State& state, InstructionSet set) {
  trace_packets(state, ray_workload().occlusion, workloads::kOcclusionHits, set);
}

[[maybe_unused]] const bool registered = [] {
  const struct {
    const char* suffix;
    InstructionSet set;
  } sets[] = {{"", InstructionSet::Best}, {"/avx2", InstructionSet::Avx2}, {"/plain", InstructionSet::Plain}};
  for (const auto& s : sets) {
    const auto add = [&](const char* name, void (*run)(benchmark::State&, InstructionSet)) {
      benchmark::RegisterBenchmark((std::string("rays/") + name + "/packet" + s.suffix).c_str(), run, s.set)
          ->Unit(benchmark::kMillisecond);
    };
    add("primary", primary_packets);
    add("shadow", shadow_packets);
    add("ao", occlusion_packets);
  }
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
  report(state, workload.rays.size(), hits, workload.hits);
}
BENCHMARK(random600)->Name("rays/random600")->Unit(benchmark::kMillisecond);

void build(benchmark::State& state) {
  for (auto _ : state)
    benchmark::DoNotOptimize(OccupancyTree::build(ray_workload().grid, ray_workload().types).bytes());
  state.counters["bytes"] = static_cast<double>(ray_workload().tree.bytes());
}
BENCHMARK(build)->Name("rays/build")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin
