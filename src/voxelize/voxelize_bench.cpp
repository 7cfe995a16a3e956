// voxelize/*: a torus of 69,432 triangles at 512 voxels along its longest side, on one thread; also its distances.

#include <quoin/voxelize/voxelize.h>

#include <cstdio>
#include <cstdlib>

#include <benchmark/benchmark.h>

#include "voxelize/shapes_for_tests.h"

namespace quoin {
namespace {

constexpr int kVoxels = 512;

const TriangleMesh& torus() {
  static const TriangleMesh made =
      shapes::rotated(shapes::torus({0.0, 0.0, 0.0}, 2.0, 0.8, 263, 132), {1.0, 2.0, 0.5}, 0.7);
  return made;
}

VoxelLattice lattice() {
  const auto found = lattice_of_size(torus(), kVoxels);
  if (found) return *found;
  std::fprintf(stderr, "voxelize benchmark: %s\n", to_string(found.error()).c_str());
  std::exit(1);
}

void count(benchmark::State& state, std::int64_t voxels) {
  state.counters["triangles"] = static_cast<double>(torus().triangles.size());
  state.counters["voxels"] = static_cast<double>(voxels);
}

void voxels(benchmark::State& state, SurfaceVoxels surface, SolidVoxels solid) {
  VoxelizeOptions options;
  options.lattice = lattice();
  options.surface = surface;
  options.solid = solid;
  std::int64_t found = 0;
  for (auto _ : state) {
    VoxelRegistry types;
    const auto made = voxelize(torus(), options, types, Threads{1});
    found = made ? made->grid.voxel_count() : 0;
  }
  if (found == 0) state.SkipWithError("no voxels");
  count(state, found);
}
BENCHMARK_CAPTURE(voxels, thin, SurfaceVoxels::Separating6, SolidVoxels::None)
    ->Name("voxelize/surface/6")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(voxels, thick, SurfaceVoxels::Separating26, SolidVoxels::None)
    ->Name("voxelize/surface/26")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(voxels, winding, SurfaceVoxels::None, SolidVoxels::Winding)
    ->Name("voxelize/solid/winding")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(voxels, parity, SurfaceVoxels::None, SolidVoxels::Parity)
    ->Name("voxelize/solid/parity")
    ->Unit(benchmark::kMillisecond);

void field(benchmark::State& state) {
  DistanceFieldOptions options;
  options.lattice = lattice();
  options.band = 3.0F;
  for (auto _ : state) {
    VoxelRegistry types;
    if (!distance_field(torus(), options, types, Threads{1})) state.SkipWithError("no field");
  }
  count(state, 0);
}
BENCHMARK(field)->Name("voxelize/field/3")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin
