// vertices/*: converts quads of a 256x128x256 terrain to vertices and indices in a caller's layout.

#include <quoin/mesh/vertex_writer.h>

#include <cstddef>
#include <cstdlib>
#include <vector>

#include <benchmark/benchmark.h>
#include <quoin/mesh/blocky.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

const QuadBuffer& terrain_quads() {
  static const QuadBuffer all = [] {
    Grid grid;
    grid.edit({IVec3{0}, {256, 128, 256}},
              [](IVec3 v, VoxelType) { return workloads::terrain_type(v.y, workloads::height(v.x, v.z)); });
    const VoxelRegistry types = workloads::three_types();
    BlockyMesher mesher;
    QuadBuffer quads;
    QuadBuffer made;
    for (const IVec3 chunk : grid.chunks()) {
      mesher.mesh(grid.neighbourhood(chunk), types, {}, quads);
      made.insert(made.end(), quads.begin(), quads.end());
    }
    return made;
  }();
  return all;
}

void count(benchmark::State& state) {
  state.counters["quads"] = static_cast<double>(terrain_quads().size());
  state.counters["quads_per_second"] =
      benchmark::Counter(static_cast<double>(terrain_quads().size()), benchmark::Counter::kIsIterationInvariantRate);
}

void write(benchmark::State& state, const VertexLayout& layout) {
  const QuadBuffer& quads = terrain_quads();
  const VertexWriter writer(layout, workloads::three_types());
  std::vector<std::byte> out(writer.bytes_needed(vertices_needed(quads.size())));
  for (auto _ : state) {
    writer.write(quads, Vec3(0.0F), out);
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  count(state);
}

const VertexLayout kFloats = {36,
                              {{VertexAttribute::Position, VertexFormat::Float32x3, 0},
                               {VertexAttribute::Normal, VertexFormat::Float32x3, 12},
                               {VertexAttribute::Uv, VertexFormat::Float32x2, 24},
                               {VertexAttribute::Colour, VertexFormat::Unorm8x4Srgb, 32}}};
const VertexLayout kPacked = {12,
                              {{VertexAttribute::Position, VertexFormat::Uint8x4, 0},
                               {VertexAttribute::Colour, VertexFormat::Unorm8x4Srgb, 4},
                               {VertexAttribute::Type, VertexFormat::Uint16, 8},
                               {VertexAttribute::Face, VertexFormat::Uint8, 10},
                               {VertexAttribute::Brightness, VertexFormat::Unorm8, 11}}};
BENCHMARK_CAPTURE(write, floats, kFloats)->Name("vertices/36_bytes")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(write, packed, kPacked)->Name("vertices/12_bytes")->Unit(benchmark::kMillisecond);

struct Packed {
  std::array<std::uint8_t, 4> position;
  std::array<std::uint8_t, 4> rest;
};

// Uses a layout known at compile time.
void write_inlined(benchmark::State& state) {
  const QuadBuffer& quads = terrain_quads();
  std::vector<Packed> out(vertices_needed(quads.size()));
  for (auto _ : state) {
    for_each_vertex(quads, [&](std::size_t i, const QuadVertex& v) {
      out[i] = {{static_cast<std::uint8_t>(v.position.x), static_cast<std::uint8_t>(v.position.y),
                 static_cast<std::uint8_t>(v.position.z), v.occlusion},
                {static_cast<std::uint8_t>(v.direction), static_cast<std::uint8_t>(v.type),
                 static_cast<std::uint8_t>(v.type >> 8), 0}};
    });
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  count(state);
}
BENCHMARK(write_inlined)->Name("vertices/8_bytes_inlined")->Unit(benchmark::kMillisecond);

void write_index(benchmark::State& state) {
  const QuadBuffer& quads = terrain_quads();
  std::vector<std::uint32_t> out(indices_needed(quads.size()));
  for (auto _ : state) {
    write_indices<std::uint32_t>(std::span<const Quad>(quads), 0, out);
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  count(state);
}
BENCHMARK(write_index)->Name("vertices/indices")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin
