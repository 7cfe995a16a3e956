#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <vector>

#include <quoin/core/memory.h>

#include "grid/chunk/chunk_storage.h"
#include "store/chunk/chunk_body.h"
#include "store/chunk/chunk_body_for_tests.h"

namespace {

using namespace quoin::store;

void require(bool holds) {
  if (!holds) std::abort();
}

const quoin::VoxelRegistry& types() {
  static const quoin::VoxelRegistry all = types_for_tests(300);
  return all;
}

/// Compares the counts stored in a chunk with its voxels.
void require_sound(const quoin::Chunk& chunk) {
  std::array<std::array<int, quoin::kChunkEdge>, 3> layers{};
  for (int z = 0; z < quoin::kChunkEdge; ++z) {
    for (int y = 0; y < quoin::kChunkEdge; ++y) {
      std::array<quoin::VoxelType, quoin::kChunkEdge> row{};
      chunk.read_row(y, z, row);
      for (std::size_t x = 0; x < row.size(); ++x) {
        require(row[x] < types().size());
        if (row[x] == quoin::kAir) continue;
        ++layers[0][x];
        ++layers[1][static_cast<std::size_t>(y)];
        ++layers[2][static_cast<std::size_t>(z)];
      }
    }
  }
  const quoin::ChunkStorage* const m = quoin::ChunkStorage::of(chunk);
  for (std::size_t axis = 0; axis < 3 && m != nullptr; ++axis) {
    for (std::size_t i = 0; i < layers[axis].size(); ++i) require(m->layer_counts[axis][i] == layers[axis][i]);
  }
}

/// A body must give an error, or a chunk that is equal after encoding and decoding again.
void read_body(quoin::BlockVector<std::byte>& body) {
  if (body.size() < kChunkBodyHeader) return;
  put_checksum(body);
  const auto header = read_header(body);
  if (!header) return;
  static ChunkDecoder decoder;
  static ChunkEncoder encoder;
  const auto chunk = decoder.decode(header->place, body, {&types(), 8.0F});
  if (!chunk) {
    require(chunk.error().byte_offset.has_value());
    return;
  }
  require_sound(chunk->voxels);
  quoin::BlockVector<std::byte> again;
  const quoin::DensityChunk* const densities = chunk->densities ? &*chunk->densities : nullptr;
  require(encoder.encode(header->place, header->revision, chunk->voxels, densities, again).has_value());
  const auto back = decoder.decode(header->place, again, {&types(), 8.0F});
  require(back.has_value() && *back == *chunk);
}

}  // namespace

// Decodes the input as a body, with the checksum corrected. Also decodes it as uncompressed content, with the first
// byte as the section mask: random bytes rarely get through a zstd frame.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  quoin::BlockVector<std::byte> body(bytes.begin(), bytes.end());
  read_body(body);
  if (size == 0) return 0;
  static const quoin::BlockVector<std::byte> air = [] {
    quoin::BlockVector<std::byte> of_air;
    require(ChunkEncoder().encode({}, 1, quoin::Chunk(), nullptr, of_air).has_value());
    return of_air;
  }();
  body = air;
  body[12] = bytes[0] & std::byte{7};
  for (std::size_t i = 0; i < 4; ++i) body[40 + i] = static_cast<std::byte>((size - 1) >> (8 * i));
  body.insert(body.end(), bytes.begin() + 1, bytes.end());
  read_body(body);
  return 0;
}
