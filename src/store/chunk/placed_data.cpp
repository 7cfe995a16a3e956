#include "store/chunk/placed_data.h"

#include <array>
#include <bit>
#include <string>

#include <quoin/core/assert.h>

namespace quoin::store {
namespace {

std::string at_voxel(IVec3 local) {
  return " at voxel (" + std::to_string(local.x) + ", " + std::to_string(local.y) + ", " + std::to_string(local.z) +
         ") of the chunk";
}

IVec3 local_of_place(std::uint32_t place) {
  QUOIN_ASSERT(place < kChunkVoxels, "a voxel of the chunk");
  const auto at = static_cast<int>(place);
  return {at % kChunkEdge, at / kChunkEdge % kChunkEdge, at / kChunkEdge / kChunkEdge};
}

/// The streams of the voxels' numbers.
struct Streams {
  ContentReader gaps, states, lengths;
  ContentReader bytes;
  std::size_t gaps_at = 0, states_at = 0, lengths_at = 0;  // in the content
};

Error moved(Error error, std::size_t by) {
  error.byte_offset = error.byte_offset.value_or(0) + by;
  return error;
}

Status read_voxel(Streams& streams, const VoxelRegistry& types, std::uint32_t& next, Chunk& chunk) {
  const auto gap = streams.gaps.take_short();
  if (!gap) return moved(gap.error(), streams.gaps_at);
  const auto state = streams.states.take_short();
  if (!state) return moved(state.error(), streams.states_at);
  const auto length = streams.lengths.take_short();
  if (!length) return moved(length.error(), streams.lengths_at);
  if (*gap >= kChunkVoxels - next) {
    return ContentReader::fault("data outside the chunk", streams.gaps_at + streams.gaps.at() - 1);
  }
  const std::uint32_t place = next + *gap;
  next = place + 1;
  const IVec3 local = local_of_place(place);
  const VoxelType type = chunk.get(local);
  const std::size_t lengths_at = streams.lengths_at + streams.lengths.at() - 1;
  if (type == kAir) return ContentReader::fault("data" + at_voxel(local) + ", which is air", lengths_at);
  if (*length > kMaxVoxelDataBytes || !streams.bytes.has(*length)) {
    return ContentReader::fault(std::to_string(*length) + " bytes of data" + at_voxel(local) + ": too many",
                                lengths_at);
  }
  if (*state == 0 && *length == 0) return ContentReader::fault("empty data" + at_voxel(local), lengths_at);
  if (static_cast<unsigned>(std::bit_width(*state)) > types[type].state_bits) {
    return ContentReader::fault("state " + std::to_string(*state) + at_voxel(local) + ", whose type has " +
                                    std::to_string(types[type].state_bits) + " bits",
                                streams.states_at + streams.states.at() - 1);
  }
  chunk.set_data(local, {*state, streams.bytes.take_bytes(*length)});
  return {};
}

}  // namespace

Status write_placed_data(const Chunk& chunk, std::vector<std::byte>& out) {
  QUOIN_ASSERT(chunk.data_count() != 0, "a chunk with data");
  std::array<std::vector<std::byte>, 3> streams;
  std::size_t total = 0;
  std::uint32_t next = 0;
  chunk.for_each_data([&](IVec3 local, const VoxelData& data) {
    const auto place = static_cast<std::uint32_t>((local.z * kChunkEdge + local.y) * kChunkEdge + local.x);
    QUOIN_ASSERT(place >= next, "voxels in the order of their places");
    put_short_number(streams[0], place - next);
    put_short_number(streams[1], data.state);
    put_short_number(streams[2], static_cast<std::uint32_t>(data.bytes.size()));
    next = place + 1;
    total += data.bytes.size();
  });
  if (total > kMaxChunkDataBytes) {
    return make_error(ErrorCode::LimitExceeded, "the voxels of a chunk hold " + std::to_string(total) +
                                                    " bytes of data; the limit is " +
                                                    std::to_string(kMaxChunkDataBytes));
  }
  put_number(out, static_cast<std::uint32_t>(chunk.data_count()));
  for (const auto& stream : streams) put_number(out, static_cast<std::uint32_t>(stream.size()));
  for (const auto& stream : streams) out.insert(out.end(), stream.begin(), stream.end());
  out.reserve(out.size() + total);
  chunk.for_each_data(
      [&](IVec3, const VoxelData& data) { out.insert(out.end(), data.bytes.begin(), data.bytes.end()); });
  return {};
}

Status read_placed_data(ContentReader& reader, const VoxelRegistry& types, Chunk& chunk) {
  constexpr std::size_t kHeader = 16;
  if (!reader.has(kHeader)) return reader.cut_off();
  const std::size_t begin = reader.at();
  const auto count = reader.take<std::uint32_t>();
  if (count == 0 || count > kChunkVoxels) {
    return ContentReader::fault("invalid number of voxels with data: " + std::to_string(count), begin);
  }
  std::array<std::size_t, 3> sizes{};
  for (std::size_t& size : sizes) size = reader.take<std::uint32_t>();
  std::array<std::span<const std::byte>, 3> parts;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!reader.has(sizes[i])) return reader.cut_off();
    parts[i] = reader.take_bytes(sizes[i]);
  }
  const std::size_t first = begin + kHeader;
  const ContentReader bytes = reader;
  Streams streams{ContentReader(parts[0]), ContentReader(parts[1]),    ContentReader(parts[2]), bytes, first,
                  first + sizes[0],        first + sizes[0] + sizes[1]};
  std::uint32_t next = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (auto status = read_voxel(streams, types, next, chunk); !status) return status;
  }
  if (!streams.gaps.is_at_end() || !streams.states.is_at_end() || !streams.lengths.is_at_end()) {
    return ContentReader::fault("extra bytes after the voxel data", begin);
  }
  reader = streams.bytes;
  return {};
}

}  // namespace quoin::store
