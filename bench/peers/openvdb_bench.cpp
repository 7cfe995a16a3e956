// peer/openvdb/*: OpenVDB's tree of bytes, its VolumeRayIntersector down to nodes, then its DDA from voxel to voxel.

#include <algorithm>
#include <cstdlib>
#include <limits>

#include <openvdb/math/DDA.h>
#include <openvdb/math/Ray.h>
#include <openvdb/tools/RayIntersector.h>

#include "bench/peers/peer_report.h"
#include "bench/peers/vdb_world.h"

namespace quoin::peers {
namespace {

using workloads::RayQuery;
using VdbRay = openvdb::math::Ray<double>;
using Intersector = openvdb::tools::VolumeRayIntersector<ByteGrid>;

const ByteGrid& world() {
  static const ByteGrid::Ptr shared = vdb_from_grid<ByteGrid>(workloads::ray_workload().grid);
  return *shared;
}

int count_hits(const std::vector<RayQuery>& rays) {
  static Intersector intersector(world());
  const auto voxels = world().getConstUnsafeAccessor();
  int hits = 0;
  for (const RayQuery& query : rays) {
    const DVec3 o = query.ray.origin;
    const DVec3 d = query.ray.direction;
    const VdbRay ray({o.x, o.y, o.z}, {d.x, d.y, d.z}, 0.0, std::min(query.max_t, 1e6));
    if (!intersector.setIndexRay(ray)) continue;
    double enter = 0;
    double leave = 0;
    bool hit = false;
    while (!hit && intersector.march(enter, leave)) {
      openvdb::math::DDA<VdbRay, 0> dda(ray, enter, leave);
      do {
        hit = voxels.isValueOn(dda.voxel());
      } while (!hit && dda.step());
    }
    hits += hit;
  }
  return hits;
}

void build(benchmark::State& state) {
  const Grid& grid = workloads::ray_workload().grid;
  const OneThread limit;
  for (auto _ : state) benchmark::DoNotOptimize(vdb_from_grid<ByteGrid>(grid));
  state.counters["bytes"] = static_cast<double>(world().memUsage());
}

constexpr int kWidth = 256;
constexpr int kHeight = 128;

void memory(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(world().memUsage());
  state.counters["bytes"] = static_cast<double>(world().memUsage());
  state.counters["voxels"] = static_cast<double>(world().activeVoxelCount());
}

void per(benchmark::State& state, const char* name, double count) {
  state.counters[name] =
      benchmark::Counter(count, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void get_sequential(benchmark::State& state) {
  const std::int64_t solid = workloads::ray_workload().grid.voxel_count();
  const auto reader = world().getConstAccessor();
  for (auto _ : state) {
    std::int64_t sum = 0;
    for (int x = 0; x < kWidth; ++x) {
      for (int y = 0; y < kHeight; ++y) {
        for (int z = 0; z < kWidth; ++z) sum += reader.getValue({x, y, z});  // z is contiguous in OpenVDB's leaves
      }
    }
    if (sum != solid) std::exit(1);
  }
  per(state, "seconds_per_get", double{kWidth} * kHeight * kWidth);
}

void get_dependent(benchmark::State& state) {
  constexpr int kGets = 1'000'000;
  const auto reader = world().getConstAccessor();
  for (auto _ : state) {
    std::uint32_t s = 12'345;
    for (int i = 0; i < kGets; ++i) {
      const openvdb::Coord at(static_cast<int>(s >> 8 & 255U), static_cast<int>(s >> 16 & 127U),
                              static_cast<int>(s >> 24));
      s = s * 1'664'525U + 1'013'904'223U + reader.getValue(at);
    }
    benchmark::DoNotOptimize(s);
  }
  per(state, "seconds_per_get", kGets);
}

void set_sequential(benchmark::State& state) {
  constexpr int kEdge = 128;
  for (auto _ : state) {
    const auto grid = ByteGrid::create(0);
    auto writer = grid->getAccessor();
    for (int x = 0; x < kEdge; ++x) {
      for (int y = 0; y < kEdge; ++y) {
        for (int z = 0; z < kEdge; ++z) {
          writer.setValueOn({x, y, z}, static_cast<std::uint8_t>(1 + (x & y & 1)));
        }
      }
    }
    if (grid->activeVoxelCount() != std::uint64_t{kEdge} * kEdge * kEdge) std::exit(1);
  }
  per(state, "seconds_per_set", double{kEdge} * kEdge * kEdge);
}

[[maybe_unused]] const bool registered = [] {
  add_workload("peer/openvdb/", "single", count_hits, count_hits, count_hits);
  return true;
}();
BENCHMARK(build)->Name("peer/openvdb/rays/build")->Unit(benchmark::kMillisecond);
BENCHMARK(memory)->Name("peer/openvdb/grid/world");
BENCHMARK(get_sequential)->Name("peer/openvdb/grid/get_sequential")->Unit(benchmark::kMillisecond);
BENCHMARK(get_dependent)->Name("peer/openvdb/grid/get_dependent")->Unit(benchmark::kMillisecond);
BENCHMARK(set_sequential)->Name("peer/openvdb/grid/set_sequential")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin::peers
