// rays/density/*: the rays of rays/* on the same terrain as a smooth field of 256x128x256 samples.

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <quoin/trace/density_ray.h>

#include "bench/ray_workload.h"
#include "core/instruction_set.h"

namespace quoin {
namespace {

using workloads::RayQuery;

struct Workload {
  DensityGrid field;
  std::vector<RayQuery> primary;
  std::vector<RayQuery> shadow;
  std::vector<RayQuery> occlusion;
};

DensityGrid smooth_terrain() {
  DensityGrid field;
  field.edit({IVec3{0}, IVec3{256, 128, 256}}, [](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(p.y - workloads::smooth_height(p.x, p.z)), 1};
  });
  return field;
}

const Workload& workload() {
  static const Workload shared = [] {
    Workload w;
    w.field = smooth_terrain();
    w.primary = workloads::detail::camera_rays();
    const DensityTree tree(w.field);
    for (std::size_t i = 0; i < w.primary.size(); ++i) {
      const RayQuery& query = w.primary[i];
      const auto hit = first_hit(tree, query.ray);
      if (hit) workloads::detail::add_rays_from(query.ray, hit->t, hit->normal, i, w.shadow, w.occlusion);
    }
    return w;
  }();
  return shared;
}

const DensityTree& tree() {
  static const DensityTree shared(workload().field);
  return shared;
}

void report(benchmark::State& state, std::size_t rays, int hits) {
  state.counters["hits"] = hits;
  state.counters["rays"] = static_cast<double>(rays);
  state.counters["rays_per_second"] =
      benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsIterationInvariantRate);
}

using Rays = std::vector<RayQuery> Workload::*;

void trace(benchmark::State& state, Rays which, bool asks_where, InstructionSet set) {
  const InstructionSetOverride over(set);
  const std::vector<RayQuery>& rays = workload().*which;
  int hits = 0;
  for (auto _ : state) {
    hits = 0;
    for (const RayQuery& query : rays) {
      hits +=
          asks_where ? first_hit(tree(), query.ray, query.max_t).has_value() : any_hit(tree(), query.ray, query.max_t);
    }
  }
  report(state, rays.size(), hits);
}

void trace_packets(benchmark::State& state, Rays which, bool asks_where, InstructionSet set) {
  const InstructionSetOverride over(set);
  const std::vector<RayQuery>& rays = workload().*which;
  const std::vector<RayPacket> packets = workloads::ray_packets(rays);
  DensityPacketHits found;
  int hits = 0;
  for (auto _ : state) {
    hits = 0;
    for (const RayPacket& packet : packets) {
      if (asks_where) first_hits(tree(), packet, found);
      hits += std::popcount(asks_where ? found.hit : any_hits(tree(), packet));
    }
  }
  report(state, rays.size(), hits);
}

[[maybe_unused]] const bool registered = [] {
  const auto add = [](const std::string& name, Rays which, bool asks_where, const std::string& suffix,
                      InstructionSet set) {
    if (!has_instruction_set(set)) return;
    const std::string path = "rays/density/" + name;
    benchmark::RegisterBenchmark((path + "/single" + suffix).c_str(), trace, which, asks_where, set)
        ->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark((path + "/packet" + suffix).c_str(), trace_packets, which, asks_where, set)
        ->Unit(benchmark::kMillisecond);
  };
  for (const bool is_narrow : {false, true}) {
    const std::string suffix = is_narrow ? "/avx2" : "";
    const InstructionSet set = is_narrow ? InstructionSet::Avx2 : instruction_set();
    add("primary", &Workload::primary, true, suffix, set);
    add("shadow", &Workload::shadow, false, suffix, set);
    add("ao", &Workload::occlusion, false, suffix, set);
  }
  return true;
}();

void build(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(OccupancyTree::build(workload().field).bytes());
  state.counters["bytes"] = static_cast<double>(tree().cells().bytes());
}
BENCHMARK(build)->Name("rays/density/build")->Unit(benchmark::kMillisecond);

// Updates the tree after a ball of radius 6 was dug or filled in a chunk's middle, and at a corner of eight chunks;
// excludes the edit.
void update(benchmark::State& state) {
  DensityGrid field = smooth_terrain();
  DensityTree followed(field);
  ChangeCursor cursor = field.cursor();
  const DVec3 centre = state.range(0) == 0 ? DVec3{96, 30, 96} : DVec3{128, 64, 128};
  bool is_solid = state.range(0) == 0;
  for (auto _ : state) {
    state.PauseTiming();
    is_solid ? field.remove_sphere(centre, 6.0) : field.add_sphere(centre, 6.0, 1);
    is_solid = !is_solid;
    const DensityChanges changes = field.changes_since(cursor);
    state.ResumeTiming();
    followed.update(changes);
  }
}
BENCHMARK(update)->Name("rays/density/update")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace quoin
