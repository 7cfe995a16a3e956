#pragma once

// Shared by the peers' benchmarks: the same names as Quoin's after "peer/", hit checks before timing, and the same
// counters.

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/ray_workload.h"

namespace quoin::peers {

/// Ends the run unless the count matches the workload's, within the tolerance of Quoin's own tracer.
inline void check_hits(const std::string& name, int hits, int expected) {
  if (std::abs(hits - expected) <= workloads::kHitTolerance) return;
  std::fprintf(stderr, "%s: %d hits, expected %d\n", name.c_str(), hits, expected);
  std::exit(1);
}

/// Registers `count_hits(rays)`, which traces all rays and returns the number of hits. One call is checked before
/// timing.
template <class CountHits>
void add_rays(const std::string& name, const std::vector<workloads::RayQuery>& (*rays)(), int (*expected)(),
              CountHits count_hits) {
  const auto run = [=](benchmark::State& state) {
    int hits = count_hits(rays());
    check_hits(name, hits, expected());
    for (auto _ : state) benchmark::DoNotOptimize(hits = count_hits(rays()));
    state.counters["hits"] = hits;
    state.counters["rays_per_second"] =
        benchmark::Counter(static_cast<double>(rays().size()), benchmark::Counter::kIsIterationInvariantRate);
  };
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMillisecond);
}

/// The three parts of the rays workload, in order and shuffled: `prefix` + "rays/primary/" + `kind` and so on.
template <class Primary, class Shadow, class Occlusion>
void add_workload(const std::string& prefix, const std::string& kind, Primary primary, Shadow shadow,
                  Occlusion occlusion) {
  using workloads::ray_workload;
  using Rays = const std::vector<workloads::RayQuery>&;
  constexpr auto kPrimary = +[] { return workloads::kPrimaryHits; };
  constexpr auto kShadow = +[] { return workloads::kShadowHits; };
  constexpr auto kOcclusion = +[] { return workloads::kOcclusionHits; };
  const std::string name = prefix + "rays/";
  add_rays(
      name + "primary/" + kind, +[]() -> Rays { return ray_workload().primary; }, kPrimary, primary);
  add_rays(
      name + "shadow/" + kind, +[]() -> Rays { return ray_workload().shadow; }, kShadow, shadow);
  add_rays(
      name + "ao/" + kind, +[]() -> Rays { return ray_workload().occlusion; }, kOcclusion, occlusion);
  using workloads::shuffled_rays;
  const std::string suffix = kind + "/shuffled";
  add_rays(
      name + "primary/" + suffix, +[]() -> Rays { return shuffled_rays().primary; }, kPrimary, primary);
  add_rays(
      name + "shadow/" + suffix, +[]() -> Rays { return shuffled_rays().shadow; }, kShadow, shadow);
  add_rays(
      name + "ao/" + suffix, +[]() -> Rays { return shuffled_rays().occlusion; }, kOcclusion, occlusion);
}

/// rays/random600: first hits, one ray at a time.
template <class First>
void add_random(const std::string& prefix, First first) {
  using workloads::random_ray_workload;
  add_rays(
      prefix + "rays/random600",
      +[]() -> const std::vector<workloads::RayQuery>& { return random_ray_workload().rays; },
      +[] { return workloads::kRandomHits; }, first);
}

}  // namespace quoin::peers
