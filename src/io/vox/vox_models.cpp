#include "io/vox/vox_reader.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "io/byte_stream.h"

namespace quoin::vox {

namespace {

// With fewer voxels per chunk than the first number, editing the grid voxel by voxel is cheaper than making a chunk.
// With fewer than the second, editing the chunk voxel by voxel is cheaper than visiting all its 64^3 voxels.
constexpr std::size_t kFewVoxels = 128;
constexpr std::size_t kSomeVoxels = 8'192;
// With at least this many voxels per chunk, averaged over a model, sorting costs more than memory for all its chunks.
constexpr std::size_t kManyVoxels = 32'768;

constexpr unsigned kTypeShift = 3 * kChunkShift;
constexpr std::uint32_t kPlaceMask = (1U << kTypeShift) - 1U;
// A model spans at most four chunks on each axis.
constexpr unsigned kChunksShift = 2;
static_assert((kChunkEdge << kChunksShift) == kMaxModelEdge);

IVec3 local_from_place(std::uint32_t place) {
  QUOIN_ASSERT(place <= kPlaceMask, "a place in a chunk");
  const auto p = static_cast<int>(place);
  return {p & (kChunkEdge - 1), (p >> kChunkShift) & (kChunkEdge - 1), p >> (2 * kChunkShift)};
}

IVec3 chunks_of(IVec3 size) {
  return (size + (kChunkEdge - 1)) >> kChunkShift;
}

/// The address of a voxel in a grid, as the sum of one share per model axis: its index in its chunk in bits 0-17, the
/// chunk's number above. Shares outside the model are so large that no sum with one is a valid address.
struct Places {
  static constexpr std::uint32_t kOutside = 1U << 28;
  std::array<std::uint32_t, 256> of_x{};
  std::array<std::uint32_t, 256> of_y{};
  std::array<std::uint32_t, 256> of_z{};
};
static_assert(kMaxModelEdge <= 256 && (64U << kTypeShift) < Places::kOutside);

/// `strides`: increments of the chunk number per chunk along the grid's axes.
Places places_in(IVec3 model_size, IVec3 strides) {
  QUOIN_ASSERT((IBox{IVec3{1}, IVec3{kMaxModelEdge + 1}}.contains(model_size)), "1 to 256 voxels along each axis");
  const auto share = [](int voxel, int stride, int shift) {
    const int chunk = (voxel >> kChunkShift) * stride;
    return static_cast<std::uint32_t>(chunk << kTypeShift | (voxel & (kChunkEdge - 1)) << shift);
  };
  Places places;
  for (auto* shares : {&places.of_x, &places.of_y, &places.of_z}) shares->fill(Places::kOutside);
  for (int i = 0; i < model_size.x; ++i) places.of_x[static_cast<std::size_t>(i)] = share(i, strides.x, 0);
  for (int i = 0; i < model_size.z; ++i) places.of_z[static_cast<std::size_t>(i)] = share(i, strides.y, kChunkShift);
  for (int i = 0; i < model_size.y; ++i) {
    places.of_y[static_cast<std::size_t>(model_size.y - 1 - i)] = share(i, strides.z, 2 * kChunkShift);
  }
  return places;
}

/// Calls `visit(address, colour index)` for every voxel of a model, including voxels outside it.
template <class Visit>
void for_each_voxel(const Model& model, const Places& places, Visit visit) {
  for (std::size_t i = 0; i + 3 < model.voxels.size(); i += 4) {
    std::array<std::uint8_t, 4> bytes{};  // loads the four bytes at once
    std::memcpy(bytes.data(), model.voxels.data() + i, bytes.size());
    visit(places.of_x[bytes[0]] + places.of_y[bytes[1]] + places.of_z[bytes[2]], bytes[3]);
  }
}

}  // namespace

IBox canvas_of(IVec3 model_size) {
  return {IVec3{0}, {model_size.x, model_size.z, model_size.y}};
}

DVec3 pivot_of(IVec3 model_size) {
  // The pivot is a corner between voxels. Along the reversed axis it is counted from the end.
  return {model_size.x / 2, model_size.z / 2, model_size.y - model_size.y / 2};
}

void ModelBuilder::sort_into_chunks(const Model& model) {
  const Places places = places_in(model.size, {1, 1 << kChunksShift, 1 << (2 * kChunksShift)});
  std::array<std::size_t, 65> counts{};
  // Adjacent voxels mostly lie in the same chunk, so its count is kept in a register.
  std::size_t chunk = 64;
  std::size_t in_a_row = 0;
  for_each_voxel(model, places, [&](std::uint32_t place, std::uint8_t colour_index) {
    if (place >= Places::kOutside) {
      ++losses_.outside;
    } else if (colour_index == 0) {
      ++losses_.colourless;
    } else {
      if (place >> kTypeShift != chunk) {
        counts[chunk] += in_a_row;
        chunk = place >> kTypeShift;
        in_a_row = 0;
      }
      ++in_a_row;
    }
  });
  counts[chunk] += in_a_row;
  chunk_begins_[0] = 0;
  for (std::size_t i = 0; i < 64; ++i) chunk_begins_[i + 1] = chunk_begins_[i] + counts[i];
  sorted_.resize(chunk_begins_[64]);
  std::array<std::size_t, 65> next = chunk_begins_;
  chunk = 64;
  std::uint32_t* end = sorted_.data() + next[chunk];
  for_each_voxel(model, places, [&](std::uint32_t place, std::uint8_t colour_index) {
    if (place >= Places::kOutside || colour_index == 0) return;
    if (place >> kTypeShift != chunk) {
      next[chunk] = static_cast<std::size_t>(end - sorted_.data());
      chunk = place >> kTypeShift;
      end = sorted_.data() + next[chunk];
    }
    const std::uint32_t type = type_of_[colour_index];
    *end++ = (place & kPlaceMask) | type << kTypeShift;
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
  const Places places = places_in(model.size, {1, chunks.x, chunks.x * chunks.y});
  QUOIN_ASSERT(chunks.x * chunks.y * chunks.z <= 64, "no more chunks than a model has");
  dense_.assign(static_cast<std::size_t>(chunks.x * chunks.y * chunks.z) * kChunkVoxels, kAir);
  for_each_voxel(model, places, [&](std::uint32_t place, std::uint8_t colour_index) {
    if (place >= Places::kOutside) {
      ++losses_.outside;
    } else if (colour_index == 0) {
      ++losses_.colourless;
    } else {
      QUOIN_ASSERT(place < dense_.size(), "a voxel of the model");
      dense_[place] = type_of_[colour_index];
    }
  });
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

namespace {

Error wrong_count(const Model& model, const std::string& held) {
  const std::int64_t wanted = std::int64_t{model.size.x} * model.size.y * model.size.z;
  return bad_at(model.offset, "chunk TDCZ holds " + held + " voxels, but its size needs " + std::to_string(wanted));
}

// The data must end after the last voxel. Unterminated streams are accepted.
Status check_end(ByteStream& stream, const Model& model) {
  std::array<std::byte, 1> more{};
  const auto count = stream.read(more);
  if (!count) return stream.is_cut_off() ? Status() : Status(count.error());
  if (*count > 0) return wrong_count(model, "more");
  return {};
}

}  // namespace

Result<std::vector<std::byte>> unpack_voxels(std::span<const std::byte> file, const Model& model) {
  QUOIN_ASSERT(model.packed_begin <= model.packed_end && model.packed_end <= file.size(),
               "a compressed model of the file");
  ByteStream stream(file.first(model.packed_end), model.packed_begin, Compression::Zlib);
  std::vector<std::byte> layer(static_cast<std::size_t>(model.size.x) * static_cast<std::size_t>(model.size.y));
  std::vector<std::byte> voxels;
  for (int z = 0; z < model.size.z; ++z) {
    const auto count = stream.read(layer);
    if (!count) return count.error();
    if (*count < layer.size()) {
      return wrong_count(model, std::to_string(static_cast<std::size_t>(z) * layer.size() + *count));
    }
    auto colour = layer.begin();
    for (int y = 0; y < model.size.y; ++y) {
      for (int x = 0; x < model.size.x; ++x, ++colour) {
        if (*colour == std::byte{0}) continue;
        for (const int coordinate : {x, y, z}) voxels.push_back(static_cast<std::byte>(coordinate));
        voxels.push_back(*colour);
      }
    }
  }
  if (auto sound = check_end(stream, model); !sound) return sound.error();
  return voxels;
}

}  // namespace quoin::vox
