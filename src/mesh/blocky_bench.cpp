// blocky/* of the workload specification: 62^3 interiors of padded 64^3 chunks, from the grid's own palette storage to
// complete packed quads.

#include <quoin/mesh/blocky.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

using workloads::Blocky;

struct Case {
  const char* name;
  Blocky which;
};
constexpr Case kCases[] = {{"w1", Blocky::W1},   {"w2", Blocky::W2}, {"w3a", Blocky::W3a},     {"w3b", Blocky::W3b},
                           {"w3c", Blocky::W3c}, {"w4", Blocky::W4}, {"empty", Blocky::Empty}, {"full", Blocky::Full}};

// Empty and full chunks lie among their like.
Neighbourhood surrounded(const Chunk& chunk, Blocky which) {
  Neighbourhood n = lone(chunk);
  if (which == Blocky::Full) n.chunks.fill(&chunk);
  return n;
}

void check(Blocky which, std::int64_t faces) {
  if (faces == workloads::expected_faces(which)) return;
  std::fprintf(stderr, "blocky benchmark: %lld faces, expected %lld\n", static_cast<long long>(faces),
               static_cast<long long>(workloads::expected_faces(which)));
  std::exit(1);
}

void mesh(benchmark::State& state, Blocky which, int chunk_count, bool occlusion, InstructionSet instructions) {
  std::vector<Chunk> chunks;
  for (int i = 0; i < chunk_count; ++i) chunks.push_back(workloads::blocky_chunk(which, i % 8, i / 8));
  const VoxelRegistry types = workloads::three_types();
  QuadOptions options;
  options.occlusion = occlusion;
  options.region = which == Blocky::Full ? kWholeChunk : workloads::kInterior;
  BlockyMesher mesher(instructions);
  QuadBuffer quads;
  mesher.mesh(surrounded(chunks[0], which), types, options, quads);
  const std::int64_t faces = face_count(quads);
  check(which, faces);
  const auto first_quads = static_cast<double>(quads.size());
  std::size_t next = 0;
  for (auto _ : state) {
    mesher.mesh(surrounded(chunks[next], which), types, options, quads);
    benchmark::DoNotOptimize(quads.data());
    next = next + 1 == chunks.size() ? 0 : next + 1;
  }
  state.counters["quads"] = first_quads;
  state.counters["faces"] = static_cast<double>(faces);
}

void register_all() {
  for (const Case& c : kCases) {
    for (const int count : {1, 64}) {
      for (const bool occlusion : {true, false}) {
        const std::string name =
            std::string("blocky/") + c.name + (count == 1 ? "/hot" : "/cold64") + (occlusion ? "/ao" : "/no_ao");
        benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
          mesh(state, c.which, count, occlusion, InstructionSet::Best);
        })->Unit(benchmark::kMicrosecond);
        if (c.which != Blocky::W1 || count == 1) continue;
        benchmark::RegisterBenchmark(("plain/" + name).c_str(), [=](benchmark::State& state) {
          mesh(state, c.which, count, occlusion, InstructionSet::Plain);
        })->Unit(benchmark::kMicrosecond);
      }
    }
  }
}

void visible_faces(benchmark::State& state) {
  std::vector<Chunk> chunks;
  for (int i = 0; i < 64; ++i) chunks.push_back(workloads::blocky_chunk(Blocky::W1, i % 8, i / 8));
  const VoxelRegistry types = workloads::three_types();
  BlockyMesher mesher;
  FaceRows faces;
  mesher.find_faces(lone(chunks[0]), types, workloads::kInterior, faces);
  check(Blocky::W1, faces.count());
  std::size_t next = 0;
  for (auto _ : state) {
    mesher.find_faces(lone(chunks[next]), types, workloads::kInterior, faces);
    benchmark::DoNotOptimize(faces.rows[0].data());
    next = next + 1 == chunks.size() ? 0 : next + 1;
  }
  state.counters["faces"] = static_cast<double>(workloads::expected_faces(Blocky::W1));
}
BENCHMARK(visible_faces)->Name("visible_faces/w1/cold64")->Unit(benchmark::kMicrosecond);

const bool kRegistered = (register_all(), true);

}  // namespace
}  // namespace quoin
