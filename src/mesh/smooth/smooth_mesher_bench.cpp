// smooth/* of the workload specification: 64^3 fields, from the grid's own storage (half floats, signs kept) to
// complete indexed meshes. The time includes gathering from storage.

#include <quoin/mesh/smooth.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <quoin/mesh/smooth_mesh.h>
#include <quoin/mesh/smooth_occlusion.h>
#include <quoin/terrain/terrain.h>

#include "bench/smooth_workload.h"
#include "core/made_with_for_tests.h"

namespace quoin {
namespace {

using workloads::Smooth;

void check(Smooth which, const SmoothChunkMesh& mesh) {
  const auto triangles = static_cast<std::int64_t>(mesh.indices.size() / 3);
  const auto vertices = static_cast<std::int64_t>(mesh.positions.size());
  const bool is_right = which == Smooth::S4
                            ? triangles == workloads::kSphereTriangles && vertices == workloads::kSphereVertices
                            : triangles == workloads::kTerrainTriangles;
  if (is_right) return;
  std::fprintf(stderr, "smooth benchmark: %lld triangles, %lld vertices are wrong\n", static_cast<long long>(triangles),
               static_cast<long long>(vertices));
  std::exit(1);
}

DensityNeighbourhood alone(const DensityChunk& chunk) {
  DensityNeighbourhood n;
  n.chunks[13] = &chunk;
  return n;
}

struct Case {
  std::string name;
  Smooth which = Smooth::S4;
  int chunks = 1;
  SmoothOcclusion occlusion = SmoothOcclusion::None;
  InstructionSet instructions = instruction_set();
  int level = 0;
};

void run(benchmark::State& state, const Case& what) {
  std::vector<DensityChunk> chunks;
  for (int i = 0; i < what.chunks; ++i) {
    chunks.push_back(workloads::density_chunk(workloads::smooth_field(what.which, i % 4, i / 4)));
  }
  SmoothOptions options;
  options.border = SmoothBorder::Open;
  options.split_sheets = false;
  options.occlusion.method = what.occlusion;
  options.levels.fill(static_cast<std::uint8_t>(what.level));
  auto mesher = made_with<SmoothMesher>(what.instructions);
  SmoothChunkMesh mesh;
  mesher.mesh(alone(chunks[0]), options, mesh);
  if (what.level == 0) check(what.which, mesh);
  state.counters["triangles"] = static_cast<double>(mesh.indices.size()) / 3;
  state.counters["vertices"] = static_cast<double>(mesh.positions.size());
  std::size_t next = 0;
  for (auto _ : state) {
    mesher.mesh(alone(chunks[next]), options, mesh);
    benchmark::DoNotOptimize(mesh.indices.data());
    next = next + 1 == chunks.size() ? 0 : next + 1;
  }
}

// Computes the occlusion of a mesh's vertices separately; the mesher does so while meshing.
void places(benchmark::State& state) {
  const DensityChunk chunk = workloads::density_chunk(workloads::smooth_field(Smooth::S1, 0, 0));
  DensityGrid field;
  field.put_chunk(IVec3{0}, chunk);
  SmoothOptions options;
  options.border = SmoothBorder::Open;
  options.split_sheets = false;
  SmoothMesher mesher;
  SmoothChunkMesh mesh;
  mesher.mesh(field.neighbourhood(IVec3{0}), options, mesh);
  const std::vector<float> expected(mesh.occlusion.begin(), mesh.occlusion.end());
  const SmoothSamples all{{mesh.positions.data(), mesh.positions.size()}, {mesh.normals.data(), mesh.normals.size()}};
  std::vector<float> found(expected.size());
  SmoothOccluder occluder;
  const std::int64_t how = state.range(0);
  for (auto _ : state) {
    if (how == 0) {
      occluder.occlude(field.neighbourhood(IVec3{0}), all, options.occlusion, found);
    } else if (how == 1) {
      if (!smooth_occlusion(field, all, options.occlusion, found, Threads{1})) std::abort();
    } else {
      for (std::size_t i = 0; i < found.size(); ++i) {
        found[i] = smooth_occlusion(field, DVec3(all.positions[i]), all.normals[i], options.occlusion);
      }
    }
    benchmark::DoNotOptimize(found.data());
  }
  if (found != expected) std::exit(1);
  state.counters["places"] = static_cast<double>(found.size());
}
// The samples of one chunk; of a field in one call; of a field with one call each.
BENCHMARK(places)->Name("smooth/places")->ArgName("how")->DenseRange(0, 2)->Unit(benchmark::kMicrosecond);

// Meshes a whole generated world, welded, with occlusion and materials.
void world(benchmark::State& state) {
  VoxelRegistry types;
  const auto materials = add_terrain_types(types);
  SmoothTerrainOptions terrain;
  terrain.size = {4, 2, 4};
  const auto field = materials ? generate_smooth_terrain(terrain, *materials) : materials.error();
  if (!field) {
    std::fprintf(stderr, "smooth benchmark: %s\n", to_string(field.error()).c_str());
    std::exit(1);
  }
  const Threads threads{static_cast<unsigned>(state.range(0))};
  std::size_t triangles = 0;
  std::size_t vertices = 0;
  for (auto _ : state) {
    const auto mesh = build_smooth_mesh(*field, types, {}, threads);
    triangles = mesh ? mesh->indices.size() / 3 : 0;
    vertices = mesh ? mesh->positions.size() : 0;
  }
  if (triangles == 0) std::exit(1);
  state.counters["triangles"] = static_cast<double>(triangles);
  state.counters["vertices"] = static_cast<double>(vertices);
  state.counters["field_bytes"] = static_cast<double>(field->bytes());
}
BENCHMARK(world)
    ->Name("smooth/world")
    ->ArgName("threads")
    ->Arg(1)
    ->Arg(2)
    ->Arg(4)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

[[maybe_unused]] const bool kRegistered = [] {
  const std::pair<SmoothOcclusion, const char*> kForms[] = {
      {SmoothOcclusion::None, "normals"},
      {SmoothOcclusion::SolidShare, "normals_ao"},
      {SmoothOcclusion::Weighted, "normals_weighted_ao"},
      {SmoothOcclusion::SoftShare, "normals_soft_ao"},
  };
  const std::pair<InstructionSet, const char*> kSets[] = {
      {instruction_set(), ""}, {InstructionSet::Avx2, "/avx2"}, {InstructionSet::Plain, "/plain"}};
  for (const auto& [form, form_name] : kForms) {
    for (const auto& [set, set_name] : kSets) {
      if (!has_instruction_set(set)) continue;
      for (const Smooth which : {Smooth::S4, Smooth::S1}) {
        for (const int chunks : {1, 16}) {
          if (which == Smooth::S4 && chunks > 1) continue;
          const std::string name = std::string("smooth/") + (which == Smooth::S4 ? "s4" : "s1") +
                                   (chunks > 1 ? "/cold16/" : "/hot/") + form_name + set_name;
          const Case what{name, which, chunks, form, set};
          benchmark::RegisterBenchmark(name.c_str(), run, what)->Unit(benchmark::kMicrosecond);
        }
      }
    }
  }
  for (int level = 1; level <= kMaxSmoothLevel; ++level) {
    const std::string name = "smooth/s1/level" + std::to_string(level) + "/normals_soft_ao";
    const Case what{name, Smooth::S1, 1, SmoothOcclusion::SoftShare, instruction_set(), level};
    benchmark::RegisterBenchmark(name.c_str(), run, what)->Unit(benchmark::kMicrosecond);
  }
  return true;
}();

}  // namespace
}  // namespace quoin
