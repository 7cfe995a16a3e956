#include "io/vox/read.h"

#include <algorithm>
#include <array>
#include <cstring>

#include <quoin/core/assert.h>

namespace quoin::vox {

namespace {

// Below this many voxels in a chunk single edits of the grid are cheaper than making a chunk of its own, and below the
// second one single edits of a chunk are cheaper than going over all its 64^3 places.
constexpr std::size_t kFewVoxels = 128;
constexpr std::size_t kSomeVoxels = 8'192;
// From this many voxels a chunk on, over all of a model, sorting them first costs more than room for all its chunks.
constexpr std::size_t kManyVoxels = 32'768;

constexpr unsigned kTypeShift = 3 * kChunkShift;
constexpr std::uint32_t kPlaceMask = (1U << kTypeShift) - 1U;
// A model spans at most four chunks on each axis.
constexpr unsigned kChunksShift = 2;
static_assert((kChunkEdge << kChunksShift) == kMaxModelEdge);

std::size_t chunk_number(IVec3 chunk) {
  QUOIN_ASSERT((chunk.x | chunk.y | chunk.z) >= 0 && (chunk.x | chunk.y | chunk.z) < 1 << kChunksShift,
               "a chunk of a model");
  return static_cast<std::size_t>((chunk.z << (2 * kChunksShift)) | (chunk.y << kChunksShift) | chunk.x);
}

std::uint32_t place_in_chunk(IVec3 local) {
  return static_cast<std::uint32_t>((local.z << (2 * kChunkShift)) | (local.y << kChunkShift) | local.x);
}

IVec3 local_from_place(std::uint32_t place) {
  const auto p = static_cast<int>(place);
  return {p & (kChunkEdge - 1), (p >> kChunkShift) & (kChunkEdge - 1), p >> (2 * kChunkShift)};
}

IVec3 chunks_of(IVec3 size) {
  return (size + (kChunkEdge - 1)) >> kChunkShift;
}

/// Where a grid's voxel lies among dense chunks, one after the other, as the sum of one share an axis.
struct DensePlaces {
  std::array<std::uint32_t, kMaxModelEdge> of_x{};  ///< by the model's axes
  std::array<std::uint32_t, kMaxModelEdge> of_y{};
  std::array<std::uint32_t, kMaxModelEdge> of_z{};
};

DensePlaces dense_places(IVec3 model_size) {
  const IVec3 chunks = chunks_of(canvas_of(model_size).max);
  const auto share = [](int voxel, int chunk_stride, int shift) {
    const int chunk = (voxel >> kChunkShift) * chunk_stride;
    return static_cast<std::uint32_t>(chunk << kTypeShift | (voxel & (kChunkEdge - 1)) << shift);
  };
  DensePlaces places;
  for (int i = 0; i < model_size.x; ++i) places.of_x[static_cast<std::size_t>(i)] = share(i, 1, 0);
  for (int i = 0; i < model_size.z; ++i) places.of_z[static_cast<std::size_t>(i)] = share(i, chunks.x, kChunkShift);
  for (int i = 0; i < model_size.y; ++i) {
    places.of_y[static_cast<std::size_t>(model_size.y - 1 - i)] = share(i, chunks.x * chunks.y, 2 * kChunkShift);
  }
  return places;
}

/// Calls `visit(grid voxel, colour index)` for every voxel inside the model.
template <class Visit>
void for_each_voxel(const Model& model, Visit visit) {
  for (std::size_t i = 0; i + 3 < model.voxels.size(); i += 4) {
    std::array<std::uint8_t, 4> bytes{};  // as one load
    std::memcpy(bytes.data(), model.voxels.data() + i, bytes.size());
    const int x = bytes[0];
    const int y = bytes[1];
    const int z = bytes[2];
    if (x >= model.size.x || y >= model.size.y || z >= model.size.z) continue;
    visit(IVec3{x, z, model.size.y - 1 - y}, bytes[3]);
  }
}

}  // namespace

IBox canvas_of(IVec3 model_size) {
  return {IVec3{0}, {model_size.x, model_size.z, model_size.y}};
}

DVec3 pivot_of(IVec3 model_size) {
  // The pivot is a corner between voxels, not a voxel: along the axis that is turned round it is counted from the end.
  return {model_size.x / 2, model_size.z / 2, model_size.y - model_size.y / 2};
}

void ModelBuilder::sort_into_chunks(const Model& model) {
  std::array<std::size_t, 65> counts{};
  std::int64_t inside = 0;
  for_each_voxel(model, [&](IVec3 voxel, std::uint8_t colour_index) {
    ++inside;
    if (colour_index == 0) {
      ++losses_.colourless;
    } else {
      ++counts[chunk_number(chunk_of(voxel))];
    }
  });
  losses_.outside += static_cast<std::int64_t>(model.voxels.size() / 4) - inside;
  chunk_begins_[0] = 0;
  for (std::size_t i = 0; i < 64; ++i) chunk_begins_[i + 1] = chunk_begins_[i] + counts[i];
  sorted_.resize(chunk_begins_[64]);
  std::array<std::size_t, 65> next = chunk_begins_;
  for_each_voxel(model, [&](IVec3 voxel, std::uint8_t colour_index) {
    if (colour_index == 0) return;
    const std::uint32_t type = type_of_[colour_index];
    sorted_[next[chunk_number(chunk_of(voxel))]++] = place_in_chunk(local_of(voxel)) | type << kTypeShift;
  });
}

void ModelBuilder::fill_chunk(IVec3 chunk, std::size_t first, std::size_t count, Grid& grid) {
  QUOIN_ASSERT(first + count <= sorted_.size(), "voxels that were sorted");
  const std::span voxels = std::span(sorted_).subspan(first, count);
  const auto type_of_voxel = [](std::uint32_t voxel) { return static_cast<VoxelType>(voxel >> kTypeShift); };
  if (count < kFewVoxels) {
    for (const std::uint32_t voxel : voxels) {
      grid.set(chunk * kChunkEdge + local_from_place(voxel & kPlaceMask), type_of_voxel(voxel));
    }
    return;
  }
  if (count < kSomeVoxels) {
    Chunk filled;
    for (const std::uint32_t voxel : voxels) filled.set(local_from_place(voxel & kPlaceMask), type_of_voxel(voxel));
    grid.put_chunk(chunk, std::move(filled));
    return;
  }
  dense_.assign(kChunkVoxels, kAir);
  for (const std::uint32_t voxel : voxels) dense_[voxel & kPlaceMask] = type_of_voxel(voxel);
  grid.put_chunk(chunk, Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(dense_)));
}

void ModelBuilder::build_densely(const Model& model, Grid& grid) {
  const IVec3 chunks = chunks_of(canvas_of(model.size).max);
  const DensePlaces places = dense_places(model.size);
  QUOIN_ASSERT(chunks.x * chunks.y * chunks.z <= 64, "no more chunks than a model has");
  dense_.assign(static_cast<std::size_t>(chunks.x * chunks.y * chunks.z) * kChunkVoxels, kAir);
  for (std::size_t i = 0; i + 3 < model.voxels.size(); i += 4) {
    std::array<std::uint8_t, 4> bytes{};  // as one load
    std::memcpy(bytes.data(), model.voxels.data() + i, bytes.size());
    if (bytes[0] >= model.size.x || bytes[1] >= model.size.y || bytes[2] >= model.size.z) {
      ++losses_.outside;
    } else if (bytes[3] == 0) {
      ++losses_.colourless;
    } else {
      dense_[places.of_x[bytes[0]] + places.of_y[bytes[1]] + places.of_z[bytes[2]]] = type_of_[bytes[3]];
    }
  }
  const std::span<const VoxelType> all = dense_;
  for (int i = 0; i < chunks.x * chunks.y * chunks.z; ++i) {
    const IVec3 place{i % chunks.x, i / chunks.x % chunks.y, i / (chunks.x * chunks.y)};
    grid.put_chunk(place,
                   Chunk::from_dense(all.subspan(static_cast<std::size_t>(i) * kChunkVoxels).first<kChunkVoxels>()));
  }
}

SceneGrid ModelBuilder::build(const Model& model) {
  SceneGrid out;
  out.canvas = canvas_of(model.size);
  out.pivot = pivot_of(model.size);
  const IVec3 chunks = chunks_of(out.canvas.max);
  if (model.voxels.size() / 4 >= static_cast<std::size_t>(chunks.x * chunks.y * chunks.z) * kManyVoxels) {
    build_densely(model, out.grid);
    return out;
  }
  sort_into_chunks(model);
  for (std::size_t i = 0; i < 64; ++i) {
    const std::size_t count = chunk_begins_[i + 1] - chunk_begins_[i];
    if (count == 0) continue;
    const auto number = static_cast<int>(i);
    const IVec3 chunk{number & 3, (number >> kChunksShift) & 3, number >> (2 * kChunksShift)};
    fill_chunk(chunk, chunk_begins_[i], count, out.grid);
  }
  return out;
}

}  // namespace quoin::vox
