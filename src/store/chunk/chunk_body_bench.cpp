// store/encode, store/decode: bodies of mixed chunks of generated terrain (a fifth of them edited at random), and of
// the smooth terrain's densities. Each body is decoded and compared before timing.

#include "store/chunk/chunk_body.h"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <benchmark/benchmark.h>

#include <quoin/core/memory.h>
#include <quoin/terrain/terrain.h>

#include "store/world/terrain_chunks_for_tests.h"

namespace quoin::store {
namespace {

struct Sample {
  VoxelRegistry types;
  std::vector<StoredChunk> chunks;
  std::vector<BlockVector<std::byte>> bodies;
};

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "store benchmark: %s\n", what);
  std::exit(1);
}

void encode_all(Sample& sample) {
  ChunkEncoder encoder;
  ChunkDecoder decoder;
  for (const StoredChunk& chunk : sample.chunks) {
    const DensityChunk* const densities = chunk.densities ? &*chunk.densities : nullptr;
    BlockVector<std::byte>& body = sample.bodies.emplace_back();
    require(encoder.encode({}, 1, chunk.voxels, densities, body).has_value(), "a chunk that cannot be kept");
    const auto back = decoder.decode({}, body, {&sample.types, 8.0F});
    require(back.has_value() && *back == chunk, "a chunk that is read as another");
  }
}

const Sample& voxels() {
  static const Sample sample = [] {
    Sample s;
    TerrainChunks terrain(16);
    s.types = std::move(terrain.types);
    s.chunks = std::move(terrain.chunks);
    encode_all(s);
    return s;
  }();
  return sample;
}

const Sample& densities() {
  static const Sample sample = [] {
    Sample s;
    const auto types = add_terrain_types(s.types);
    const auto terrain = generate_smooth_terrain({.size = {4, 2, 4}}, *types);
    for (const IVec3 place : terrain->chunks()) {
      const DensityChunk& chunk = *terrain->find_chunk(place);
      if (!chunk.uniform()) s.chunks.push_back({Chunk(), chunk});
    }
    encode_all(s);
    return s;
  }();
  return sample;
}

void count_chunks(benchmark::State& state, const Sample& sample) {
  double bytes = 0.0;
  for (const auto& body : sample.bodies) bytes += static_cast<double>(body.size());
  const auto chunks = static_cast<double>(sample.chunks.size());
  state.counters["chunks"] = chunks;
  state.counters["bytes_per_chunk"] = bytes / chunks;
  state.counters["seconds_per_chunk"] =
      benchmark::Counter(chunks, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void encode(benchmark::State& state, const Sample& sample) {
  ChunkEncoder encoder;
  BlockVector<std::byte> body;
  for (auto _ : state) {
    for (const StoredChunk& chunk : sample.chunks) {
      require(encoder.encode({}, 1, chunk.voxels, chunk.densities ? &*chunk.densities : nullptr, body).has_value(),
              "a chunk that cannot be kept");
      benchmark::DoNotOptimize(body.data());
    }
  }
  count_chunks(state, sample);
}

void decode(benchmark::State& state, const Sample& sample) {
  ChunkDecoder decoder;
  for (auto _ : state) {
    for (const auto& body : sample.bodies) {
      const auto chunk = decoder.decode({}, body, {&sample.types, 8.0F});
      require(chunk.has_value(), "a body that cannot be read");
    }
  }
  count_chunks(state, sample);
}

void encode_voxels(benchmark::State& state) {
  encode(state, voxels());
}
BENCHMARK(encode_voxels)->Name("store/encode")->Unit(benchmark::kMillisecond);

void decode_voxels(benchmark::State& state) {
  decode(state, voxels());
}
BENCHMARK(decode_voxels)->Name("store/decode")->Unit(benchmark::kMillisecond);

void encode_densities(benchmark::State& state) {
  encode(state, densities());
}
BENCHMARK(encode_densities)->Name("store/encode_densities")->Unit(benchmark::kMillisecond);

void decode_densities(benchmark::State& state) {
  decode(state, densities());
}
BENCHMARK(decode_densities)->Name("store/decode_densities")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin::store
