#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <quoin/core/memory.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/store/world_store.h>

namespace quoin::store {

/// Returns types 1 to `count`: multiples of 3 have 8 bits of state, multiples of 5 have 32.
inline VoxelRegistry types_for_tests(int count) {
  VoxelRegistry types;
  for (int i = 1; i <= count; ++i) {
    VoxelProperties properties;
    properties.name = "t" + std::to_string(i);
    properties.state_bits = static_cast<std::uint8_t>(i % 5 == 0 ? 32 : i % 3 == 0 ? 8 : 0);
    if (!types.add(properties)) break;
  }
  return types;
}

/// Returns nested boxes of types below `types`; with noise, also single voxels.
inline Chunk chunk_of_boxes(std::mt19937& random, int types, int boxes, int noise) {
  const auto below = [&](int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); };
  Chunk chunk(static_cast<VoxelType>(below(types)));
  for (int i = 0; i < boxes; ++i) {
    const IVec3 min{below(64), below(64), below(64)};
    const IVec3 size{1 + below(40), 1 + below(40), 1 + below(40)};
    chunk.fill_box({min, min + size}, static_cast<VoxelType>(below(types)), [](int, int, std::uint64_t) {});
  }
  for (int i = 0; i < noise; ++i) {
    chunk.set(below(64), below(64), below(64), static_cast<VoxelType>(below(types)));
  }
  return chunk;
}

/// Adds states and bytes to some voxels whose types allow them.
inline void put_some_data(std::mt19937& random, const VoxelRegistry& types, int tries, Chunk& chunk) {
  for (int i = 0; i < tries; ++i) {
    const IVec3 local{static_cast<int>(random() % 64), static_cast<int>(random() % 64),
                      static_cast<int>(random() % 64)};
    const int bits = types[chunk.get(local)].state_bits;
    VoxelData data;
    if (bits != 0) data.state = static_cast<std::uint32_t>(random()) >> (32 - bits);
    BlockVector<std::byte> bytes(random() % 4 == 0 ? random() % 200 : 0);
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
    data.bytes = bytes;
    chunk.set_data(local, data);
  }
}

/// Densities of spheres within a band, with materials below `types`.
inline DensityChunk densities_of_spheres(std::mt19937& random, int types, float band, int spheres) {
  const auto below = [&](int end) { return static_cast<float>(random() % static_cast<unsigned>(end)); };
  DensityChunk chunk(stored_density(band, band));
  chunk.materials() = chunk_of_boxes(random, types, 4, 10);
  for (int i = 0; i < spheres; ++i) {
    const float at[3] = {below(64), below(64), below(64)};
    const float radius = 2.0F + below(16);
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        std::array<Half, kChunkEdge> row{};
        chunk.read_row(y, z, row);
        for (int x = 0; x < kChunkEdge; ++x) {
          const float d[3] = {static_cast<float>(x) - at[0], static_cast<float>(y) - at[1],
                              static_cast<float>(z) - at[2]};
          const float distance = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - radius;
          Half& half = row[static_cast<std::size_t>(x)];
          half = stored_density(std::min(float_from_half(half), distance), band);
        }
        chunk.write_row(y, z, row);
      }
    }
  }
  return chunk;
}

struct CorpusChunk {
  std::string file;
  StoredChunk chunk;
};

/// Returns the contents of the files in tests/corpus/chunk_body, at address {} and with `types_for_tests(300)`.
inline std::vector<CorpusChunk> corpus_chunks() {
  std::mt19937 random(42);
  const VoxelRegistry types = types_for_tests(300);
  std::vector<CorpusChunk> chunks;
  const auto put = [&](const char* file, Chunk voxels) { chunks.push_back({file, {std::move(voxels)}}); };
  put("air", Chunk());
  put("one_type", Chunk(VoxelType{7}));
  put("two_types", chunk_of_boxes(random, 2, 6, 10));
  put("twenty_types", chunk_of_boxes(random, 20, 20, 20));
  put("three_hundred_types", chunk_of_boxes(random, 301, 500, 100));
  Chunk noise;
  for (int z = 0; z < 64; ++z) {
    for (int y = 0; y < 64; ++y) noise.fill_row(y, z, 0xAAAA'AAAA'5555'5555U << (z & 1), VoxelType{1});
  }
  put("packed", noise);
  Chunk with_data = chunk_of_boxes(random, 31, 8, 0);
  put_some_data(random, types, 60, with_data);
  put("data", with_data);
  DensityChunk densities(stored_density(8.0F, 8.0F), VoxelType{2});
  std::array<Half, kChunkEdge> row{};
  for (int i = 0; i < 9; ++i) {
    for (std::size_t x = 0; x < row.size(); ++x) {
      row[x] = stored_density(static_cast<float>(x) / 8.0F + static_cast<float>(i) - 6.0F, 8.0F);
    }
    densities.write_row(30 + i % 3, 9 + i / 3, row);
  }
  densities.unite_slabs();
  chunks.push_back({"densities", {Chunk(), densities}});
  return chunks;
}

}  // namespace quoin::store
