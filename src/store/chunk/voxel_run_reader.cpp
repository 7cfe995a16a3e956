// From runs to the packed rows of a chunk, four layers at a time:
//
//   runs      3 of grass | 70 of earth | ...
//   changes   each voxel's index XOR that of the voxel before: 0 but where a run starts
//   row sums  what a row changes in all, so that it is known how the next row begins, and how many voxels are not air
//   rows      of one index, or a prefix XOR over the row's changes
//   slabs     of one index, or a slot

#include <algorithm>
#include <array>
#include <bit>
#include <string>
#include <utility>

#include <quoin/core/assert.h>

#include "core/rows/packed_row.h"
#include "grid/chunk/chunk_storage.h"
#include "store/chunk/voxel_runs.h"

namespace quoin::store {
namespace {

constexpr std::uint32_t kLayers = 4;  // of slabs
constexpr std::uint32_t kRows = kLayers * kChunkEdge;
constexpr std::uint32_t kVoxels = kRows * kChunkEdge;

Error wrong_index(std::uint32_t index, std::size_t types, std::size_t at) {
  return ContentReader::fault("index " + std::to_string(index) + " of a palette of " + std::to_string(types), at);
}

// Fields each XORed with all before it in the word.
template <int kBits>
std::uint64_t prefix_xor(std::uint64_t word) {
  for (int distance = kBits; distance < 64; distance *= 2) word ^= word << distance;
  return word;
}

}  // namespace

struct VoxelRunReader::Run {
  std::uint32_t index = 0;
  std::uint32_t voxels = 0;
};

struct VoxelRunReader::Streams {
  const std::byte* length = nullptr;
  const std::byte* lengths_end = nullptr;
  const std::byte* low = nullptr;   // null where runs alternate
  const std::byte* high = nullptr;  // null to 256 types
  std::size_t lengths_at = 0;       // in the content
  std::size_t indices_at = 0;
  std::uint32_t runs = 0;
  std::uint32_t next = 0;

  [[nodiscard]] std::uint32_t take_index() {
    const std::uint32_t i = next++;
    if (low == nullptr) return i & 1U;
    const auto index = std::to_integer<std::uint32_t>(low[i]);
    return high == nullptr ? index : index | std::to_integer<std::uint32_t>(high[i]) << 8;
  }
  /// 0 where the stream is cut off or a number too large.
  [[nodiscard]] std::uint32_t take_voxels() {
    if (length == lengths_end) return 0;
    const auto one = std::to_integer<std::uint32_t>(*length++);
    if (one < 0x80) [[likely]]
      return one + 1;
    std::uint32_t number = one & 0x7FU;
    for (int shift = 7; shift <= 14; shift += 7) {
      if (length == lengths_end) return 0;
      const auto more = std::to_integer<std::uint32_t>(*length++);
      number |= (more & 0x7FU) << shift;
      if (more < 0x80) return more == 0 ? 0 : number + 1;
    }
    return 0;
  }
};

Result<Chunk> VoxelRunReader::read(ContentReader& reader, std::size_t type_count) {
  const std::size_t begin = reader.at();
  if (!reader.has(3)) return reader.cut_off();
  const auto form = reader.take<std::uint8_t>();
  const std::size_t types = std::size_t{reader.take<std::uint16_t>()} + 1;
  if (form > 2 || (form == 0) != (types == 1)) {
    return ContentReader::fault("voxels of form " + std::to_string(form) + " with " + std::to_string(types) + " types",
                                begin);
  }
  if (auto status = read_palette(reader, types, type_count); !status) return status.error();
  if (form == 0) return Chunk(palette_[0]);
  return form == 1 ? read_runs(reader) : read_packed(reader);
}

Status VoxelRunReader::read_palette(ContentReader& reader, std::size_t count, std::size_t type_count) {
  if (!reader.has(count * sizeof(VoxelType))) return reader.cut_off();
  palette_.resize(count);
  seen_.resize((std::size_t{1} << 16) / 64);
  Status status;
  std::size_t taken = 0;
  for (; taken < count && status; ++taken) {
    const auto type = reader.take<VoxelType>();
    palette_[taken] = type;
    if (type >= type_count) {
      status =
          ContentReader::fault("type " + std::to_string(type) + ", and the world has " + std::to_string(type_count - 1),
                               reader.at() - sizeof(type));
    } else if ((seen_[type / 64] >> (type % 64) & 1U) != 0) {
      status = ContentReader::fault("type " + std::to_string(type) + " twice", reader.at() - sizeof(type));
    }
    seen_[type / 64] |= std::uint64_t{1} << (type % 64);
  }
  for (std::size_t i = 0; i < taken; ++i) seen_[palette_[i] / 64] = 0;
  return status;
}

Result<Chunk> VoxelRunReader::read_runs(ContentReader& reader) {
  if (!reader.has(8)) return reader.cut_off();
  Streams streams;
  streams.runs = reader.take<std::uint32_t>();
  const std::size_t length_bytes = reader.take<std::uint32_t>();
  const std::size_t types = palette_.size();
  if (streams.runs < types || streams.runs > kChunkVoxels) {
    return ContentReader::fault(std::to_string(streams.runs) + " runs of " + std::to_string(types) + " types",
                                reader.at() - 8);
  }
  streams.lengths_at = reader.at();
  if (!reader.has(length_bytes)) return reader.cut_off();
  streams.length = reader.take_bytes(length_bytes).data();
  streams.lengths_end = streams.length + length_bytes;
  streams.indices_at = reader.at();
  if (types > 2) {
    if (!reader.has(streams.runs)) return reader.cut_off();
    streams.low = reader.take_bytes(streams.runs).data();
  }
  if (types > 256) {
    if (!reader.has(streams.runs)) return reader.cut_off();
    streams.high = reader.take_bytes(streams.runs).data();
  }
  switch (bits_for(types)) {
    case 1:
      return build<1>(streams);
    case 2:
      return build<2>(streams);
    case 4:
      return build<4>(streams);
    case 8:
      return build<8>(streams);
    default:
      return build<16>(streams);
  }
}

namespace {

/// Storage that is filled four layers at a time.
template <int kBits>
class StorageBuilder {
 public:
  // Requires: `changes` and `words` are scratch; the first run is of `palette[0]`.
  StorageBuilder(const std::vector<VoxelType>& palette, std::vector<std::uint64_t>& changes,
                 std::vector<std::uint64_t>& words)
      : palette_(palette), changes_(changes), words_(words) {
    changes_.assign(kRows * kBits, 0);
    words_.resize(std::max(words_.size(), kChunkVoxels / 64 * kBits));
    last_ = stored(0);
    const auto air = std::ranges::find(palette_, kAir);
    if (air != palette_.end()) air_ = static_cast<std::uint32_t>(air - palette_.begin());
    is_last_solid_ = palette_[0] != kAir;
  }

  /// A run of another index starts at a voxel of these layers.
  void start(std::uint32_t voxel, std::uint32_t before, std::uint32_t index) {
    const std::uint32_t change = stored(before) ^ stored(index);
    const std::uint32_t x = voxel % kChunkEdge;
    changes_[voxel * kBits >> 6] ^= std::uint64_t{change} << (voxel * kBits & 63U);
    const int solid = (index != air_ ? 1 : 0) - (before != air_ ? 1 : 0);
    RowSum& row = sums_[voxel / kChunkEdge];
    row.change ^= static_cast<std::uint16_t>(change);
    row.inside |= x;
    row.solid = static_cast<std::int16_t>(row.solid + solid * static_cast<int>(kChunkEdge - x));
    ended_[x] -= solid;
  }

  /// All runs of these layers were told.
  void end_layers(int first_y) {
    std::array<std::uint32_t, kRows> before;  // index of the voxel before each row
    std::array<std::uint32_t, kRows> first;   // of its first; with kMixed where others follow
    for (std::uint32_t row = 0; row < kRows; ++row) {
      constexpr std::uint64_t kField = (std::uint64_t{1} << kBits) - 1;
      before[row] = last_;
      first[row] = last_ ^ static_cast<std::uint32_t>(changes_[row * kBits] & kField);
      if (sums_[row].inside != 0) first[row] |= kMixed;
      count_row(static_cast<std::size_t>(first_y) + row / kChunkEdge, row % kChunkEdge, sums_[row]);
      last_ ^= sums_[row].change;
    }
    for (std::uint32_t z = 0; z < kChunkEdge; z += 4) {
      std::uint32_t differs = first[z] & kMixed;
      for (std::uint32_t i = 0; i < kSlabRows; ++i) differs |= first[row_of_slab(z, i)] ^ first[z];
      std::uint32_t& entry = m_->slabs[ChunkStorage::slab_index(first_y, static_cast<int>(z))];
      if (differs == 0) {
        entry = ChunkStorage::kUniformSlab | first[z];
        continue;
      }
      entry = m_->slot_count++;
      std::uint64_t* out = words_.data() + std::size_t{entry} * kSlabRows * kBits;
      for (std::uint32_t i = 0; i < kSlabRows; ++i, out += kBits) {
        const std::uint32_t row = row_of_slab(z, i);
        if ((first[row] & kMixed) != 0) {
          put_row(changes_.data() + row * kBits, before[row], out);
        } else {
          std::fill_n(out, kBits, packed_row::repeat(kBits, first[row]));
        }
      }
    }
    sums_ = {};
    std::fill(changes_.begin(), changes_.end(), 0);
  }

  /// `counts`: voxels of each index of the palette; all are more than 0.
  Chunk finish(const std::vector<std::uint32_t>& counts) {
    ChunkStorage& m = *m_;
    m.bits = kBits;
    m.words.assign(words_.begin(), words_.begin() + static_cast<std::ptrdiff_t>(m.slot_count) * kSlabRows * kBits);
    m.non_air = static_cast<int>(kChunkVoxels - (air_ < counts.size() ? counts[air_] : 0));
    count_columns();
    if (kBits == 16) {
      m.counts.assign(ChunkStorage::kRemainders, 0);
      for (std::size_t i = 0; i < palette_.size(); ++i) m.counts[palette_[i] % ChunkStorage::kRemainders] += counts[i];
    } else {
      m.palette = palette_;
      m.counts = counts;
    }
    m.used = static_cast<std::uint32_t>(m.counts.size() - static_cast<std::size_t>(std::ranges::count(m.counts, 0U)));
    return ChunkStorage::chunk_of(std::move(m_));
  }

 private:
  static constexpr std::uint32_t kMixed = 0x8000'0000U;
  struct RowSum {
    std::uint16_t change = 0;
    std::int16_t solid = 0;
    std::uint32_t inside = 0;  // not 0 where a run starts within the row
  };
  static std::uint32_t row_of_slab(std::uint32_t z, std::uint32_t i) { return (i & 3U) * kChunkEdge + z + (i >> 2); }

  [[nodiscard]] std::uint32_t stored(std::uint32_t index) const { return kBits == 16 ? palette_[index] : index; }

  void count_row(std::size_t y, std::size_t z, RowSum sum) {
    const int solid = (is_last_solid_ ? kChunkEdge : 0) + sum.solid;
    auto& counts = m_->layer_counts;
    counts[1][y] = static_cast<std::uint16_t>(counts[1][y] + solid);
    counts[2][z] = static_cast<std::uint16_t>(counts[2][z] + solid);
    const std::uint32_t last = last_ ^ sum.change;
    is_last_solid_ = last != (kBits == 16 ? kAir : air_);
  }

  static void put_row(const std::uint64_t* changes, std::uint32_t before, std::uint64_t* out) {
    std::uint64_t carry = before;
    for (int i = 0; i < kBits; ++i) {
      out[i] = prefix_xor<kBits>(changes[i]) ^ packed_row::repeat(kBits, static_cast<std::uint32_t>(carry));
      carry = out[i] >> (64 - kBits);
    }
  }

  // A run of solid voxels from s to e has rows(e) - rows(s) + (x < e % 64) - (x < s % 64) of column x. Of all runs the
  // first two sum to the same for each x, which the sum over all columns gives.
  void count_columns() {
    int weighted = 0;
    for (int x = 0; x < kChunkEdge; ++x) weighted += x * ended_[static_cast<std::size_t>(x)];
    int column = (m_->non_air - weighted) / kChunkEdge;
    for (std::size_t x = kChunkEdge; x-- > 0;) {
      m_->layer_counts[0][x] = static_cast<std::uint16_t>(column);
      column += ended_[x];
    }
  }

  const std::vector<VoxelType>& palette_;
  std::vector<std::uint64_t>& changes_;
  std::vector<std::uint64_t>& words_;
  Ref<ChunkStorage> m_ = make_ref<ChunkStorage>();
  std::array<RowSum, kRows> sums_{};
  std::array<int, kChunkEdge> ended_{};  // by x: runs of solid voxels that end before it, less those that start there
  std::uint32_t air_ = 0xFFFF'FFFFU;     // its index, where there is any
  std::uint32_t last_ = 0;               // index of the last voxel of the rows so far
  bool is_last_solid_ = false;
};

}  // namespace

template <int kBits>
Result<Chunk> VoxelRunReader::build(Streams streams) {
  counts_.assign(palette_.size(), 0);
  StorageBuilder<kBits> builder(palette_, changes_, words_);
  std::uint32_t voxel = 0;
  std::uint32_t before = 0;
  std::uint32_t seen = 0;  // indices so far
  for (std::uint32_t layers_end = kVoxels; layers_end <= kChunkVoxels; layers_end += kVoxels) {
    while (voxel < layers_end) {
      if (streams.next == streams.runs) {
        return ContentReader::fault("runs that end at voxel " + std::to_string(voxel), streams.lengths_at);
      }
      const std::uint32_t index = streams.take_index();
      const std::uint32_t voxels = streams.take_voxels();
      // The first has to be 0, and all others differ from the one before.
      const bool is_wrong = index > seen || (index == before && seen != 0) || index >= palette_.size();
      if (is_wrong || voxels == 0 || voxels > kChunkVoxels - voxel) [[unlikely]] {
        if (is_wrong) return wrong_index(index, palette_.size(), streams.indices_at + streams.next - 1);
        return ContentReader::fault("a run's length at voxel " + std::to_string(voxel), streams.lengths_at);
      }
      seen += index == seen ? 1U : 0U;
      if (voxel != 0) builder.start(voxel - (layers_end - kVoxels), before, index);
      counts_[index] += voxels;
      before = index;
      voxel += voxels;
    }
    builder.end_layers(static_cast<int>(layers_end / (kChunkEdge * kChunkEdge) - kLayers));
  }
  if (streams.next != streams.runs || streams.length != streams.lengths_end || seen != palette_.size()) {
    return ContentReader::fault("runs beyond the chunk, or types without any", streams.lengths_at);
  }
  return builder.finish(counts_);
}

Result<Chunk> VoxelRunReader::read_packed(ContentReader& reader) {
  const auto bits = static_cast<std::size_t>(bits_for(palette_.size()));
  const std::size_t begin = reader.at();
  if (!reader.has(kChunkVoxels / 8 * bits)) return reader.cut_off();
  std::vector<VoxelType> types(kChunkVoxels);
  std::uint32_t seen = 0;
  for (std::size_t i = 0; i < std::size_t{kChunkEdge} * kChunkEdge; ++i) {
    const std::size_t first = (i % kChunkEdge * kChunkEdge + i / kChunkEdge) * kChunkEdge;  // of a row: by z, then y
    std::array<std::uint64_t, 16> row{};
    for (std::size_t k = 0; k < bits; ++k) row[k] = reader.take<std::uint64_t>();
    for (int x = 0; x < kChunkEdge; ++x) {
      const std::uint32_t index = packed_row::read(row.data(), static_cast<int>(bits), x);
      if (index > seen || index >= palette_.size()) {
        return wrong_index(index, palette_.size(), begin + (i * kChunkEdge + static_cast<std::size_t>(x)) * bits / 8);
      }
      seen += index == seen ? 1U : 0U;
      types[first + static_cast<std::size_t>(x)] = palette_[index];
    }
  }
  if (seen != palette_.size()) return ContentReader::fault("types without any voxels", begin);
  return Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(types));
}

}  // namespace quoin::store
