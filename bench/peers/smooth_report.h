#pragma once

// The smooth workloads for peers: the same names as Quoin's after "peer/", vertex checks before timing, and the same
// counters.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <quoin/core/vec.h>

#include "bench/smooth_workload.h"

namespace quoin::peers {

struct PeerMesh {
  std::vector<Vec3> vertices;
  std::int64_t triangles = 0;
};

/// Ends the run unless every vertex lies on the sphere and the triangle count is about as expected.
inline void check_mesh(const std::string& name, workloads::Smooth which, std::int64_t terrain_triangles,
                       const PeerMesh& mesh) {
  const bool is_sphere = which == workloads::Smooth::S4;
  const std::int64_t expected = is_sphere ? workloads::kSphereTriangles : terrain_triangles;
  double worst = 0;
  for (const Vec3& v : mesh.vertices) {
    if (is_sphere) worst = std::max(worst, std::abs(glm::length(DVec3(v) - DVec3(31)) - 28.0));
  }
  if (std::abs(mesh.triangles - expected) <= expected / 10 && worst < 0.05) return;
  std::fprintf(stderr, "%s: %lld triangles, expected about %lld; %g from the surface\n", name.c_str(),
               static_cast<long long>(mesh.triangles), static_cast<long long>(expected), worst);
  std::exit(1);
}

/// Registers a mesher. `prepare(fields)` converts the input, untimed; `mesh(prepared, i)` meshes field i;
/// `take(prepared)` returns the last mesh. `terrain_triangles`: the peer's approximate triangle count for S1.
template <class Prepare, class Mesh, class Take>
void add_smooth(const std::string& prefix, const std::string& kind, std::int64_t terrain_triangles, Prepare prepare,
                Mesh mesh, Take take) {
  struct Workload {
    const char* name;
    workloads::Smooth which;
    int fields;
  };
  for (const Workload& workload :
       {Workload{"smooth/s4/hot/", workloads::Smooth::S4, 1}, Workload{"smooth/s1/hot/", workloads::Smooth::S1, 1},
        Workload{"smooth/s1/cold16/", workloads::Smooth::S1, 16}}) {
    const std::string name = prefix + workload.name + kind;
    const auto run = [=](benchmark::State& state) {
      std::vector<std::vector<float>> fields;
      for (int i = 0; i < workload.fields; ++i) {
        fields.push_back(workloads::smooth_field(workload.which, i % 4, i / 4));
      }
      auto prepared = prepare(fields);
      mesh(prepared, 0);
      const PeerMesh first = take(prepared);
      check_mesh(name, workload.which, terrain_triangles, first);
      std::size_t next = 0;
      for (auto _ : state) {
        mesh(prepared, next);
        next = next + 1 == fields.size() ? 0 : next + 1;
      }
      state.counters["triangles"] = static_cast<double>(first.triangles);
      state.counters["vertices"] = static_cast<double>(first.vertices.size());
    };
    benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMicrosecond);
  }
}

}  // namespace quoin::peers
