// peer/nanovdb/*: NanoVDB's hierarchical DDA on a mask grid. Its own `firstActive` leaps a whole voxel past each
// crossing and misses corners; the loop here uses the same HDDA and finds the first voxel exactly.

#include <algorithm>

#include <nanovdb/util/HDDA.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <nanovdb/util/Ray.h>

#include "bench/peers/peer_report.h"
#include "bench/peers/vdb_world.h"

namespace quoin::peers {
namespace {

using workloads::RayQuery;
using NanoRay = nanovdb::Ray<float>;
using NanoCoord = nanovdb::Coord;
using NanoGrid = nanovdb::NanoGrid<nanovdb::ValueMask>;
using Handle = nanovdb::GridHandle<nanovdb::HostBuffer>;

// Distance beyond a node's face that is certainly inside the next node.
constexpr float kInto = 1e-3F;

Handle nano_from_grid(const Grid& grid) {
  const auto mask = vdb_from_grid<openvdb::MaskGrid>(grid);
  return nanovdb::openToNanoVDB<nanovdb::HostBuffer>(*mask, nanovdb::StatsMode::BBox, nanovdb::ChecksumMode::Disable);
}

const Handle& world() {
  static const Handle shared = nano_from_grid(workloads::ray_workload().grid);
  return shared;
}

const Handle& random_world() {
  static const Handle shared = nano_from_grid(workloads::random_ray_workload().grid);
  return shared;
}

template <class Accessor>
bool hits(NanoRay ray, const Accessor& voxels) {
  if (!ray.clip(voxels.root().bbox())) return false;
  NanoCoord at = nanovdb::RoundDown<NanoCoord>(ray(ray.t0() + kInto));
  nanovdb::HDDA<NanoRay, NanoCoord> hdda(ray, static_cast<int>(voxels.getDim(at, ray)));
  if (hdda.dim() == 1) at = hdda.voxel();
  for (;;) {
    if (voxels.isActive(at)) return true;
    if (!hdda.step()) return false;
    at = hdda.dim() == 1 ? hdda.voxel() : nanovdb::RoundDown<NanoCoord>(ray(hdda.time() + kInto));
    hdda.update(ray, static_cast<int>(voxels.getDim(at, ray)));
    if (hdda.dim() == 1) at = hdda.voxel();
  }
}

int count_hits(const Handle& handle, const std::vector<RayQuery>& rays) {
  const NanoGrid* grid = handle.grid<nanovdb::ValueMask>();
  const auto voxels = grid->getAccessor();
  int count = 0;
  for (const RayQuery& query : rays) {
    const DVec3 o = query.ray.origin;
    const DVec3 d = query.ray.direction;
    const auto f = [](double x) { return static_cast<float>(x); };
    const auto end = f(std::min(query.max_t, 1e6));
    count += hits(NanoRay({f(o.x), f(o.y), f(o.z)}, {f(d.x), f(d.y), f(d.z)}, 0.0F, end), voxels);
  }
  return count;
}

// Converts an existing OpenVDB grid, like NanoVDB's own tools.
void build(benchmark::State& state) {
  const auto mask = vdb_from_grid<openvdb::MaskGrid>(workloads::ray_workload().grid);
  const OneThread limit;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        nanovdb::openToNanoVDB<nanovdb::HostBuffer>(*mask, nanovdb::StatsMode::BBox, nanovdb::ChecksumMode::Disable));
  }
  state.counters["bytes"] = static_cast<double>(world().size());
}

[[maybe_unused]] const bool registered = [] {
  using Rays = const std::vector<RayQuery>&;
  const auto one_world = [](Rays rays) { return count_hits(world(), rays); };
  add_workload("peer/nanovdb/", "single", one_world, one_world, one_world);
  add_random("peer/nanovdb/", [](Rays rays) { return count_hits(random_world(), rays); });
  return true;
}();
BENCHMARK(build)->Name("peer/nanovdb/rays/build")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin::peers
