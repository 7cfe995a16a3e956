// Converts the packed rows of a chunk to runs. A voxel starts a run if it differs from the previous voxel, tested by
// XOR on a word of voxels at a time.

#include "store/chunk/voxel_sections.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <string>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/rows/packed_row.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin::store {
namespace {

constexpr std::uint32_t kUnseen = 0xFFFF'FFFFU;
constexpr std::size_t kAllTypes = std::size_t{1} << 16;

// Returns the lowest bit of each non-zero field of a word.
template <int kBits>
std::uint64_t fields_not_0(std::uint64_t word) {
  for (int width = 1; width < kBits; width *= 2) word |= word >> width;
  return word & packed_row::repeat(kBits, 1);
}

/// Calls `start(voxel, index)` for the first voxel of each run that starts in a row.
template <int kBits, class Start>
void starts_of_row(const std::uint64_t* row, std::uint32_t first, std::uint32_t& before, Start&& start) {
  constexpr std::uint64_t kField = (std::uint64_t{1} << kBits) - 1;
  for (int i = 0; i < kBits; ++i) {
    const std::uint64_t word = row[i];
    const std::uint64_t changed = word ^ (word << kBits | before);
    for (std::uint64_t left = changed == 0 ? 0 : fields_not_0<kBits>(changed); left != 0; left &= left - 1) {
      const int bit = std::countr_zero(left);
      start(first + static_cast<std::uint32_t>((i * 64 + bit) / kBits),
            static_cast<std::uint32_t>(word >> bit & kField));
    }
    before = static_cast<std::uint32_t>(word >> (64 - kBits));
  }
}

template <int kBits, class Start>
void for_each_start(const ChunkStorage& m, Start&& start) {
  std::uint32_t before = 0;
  const std::uint32_t corner = m.slabs[0];
  before = (corner & ChunkStorage::kUniformSlab) != 0 ? corner & ~ChunkStorage::kUniformSlab : m.read(corner, 0, 0);
  start(0U, before);
  for (int y = 0; y < kChunkEdge; ++y) {
    for (int z = 0; z < kChunkEdge; z += 4) {
      const std::uint32_t entry = m.slabs[ChunkStorage::slab_index(y, z)];
      const auto first = static_cast<std::uint32_t>((y * kChunkEdge + z) * kChunkEdge);
      if ((entry & ChunkStorage::kUniformSlab) != 0) {
        const std::uint32_t index = entry & ~ChunkStorage::kUniformSlab;
        if (index != before) start(first, index);
        before = index;
        continue;
      }
      for (std::uint32_t i = 0; i < 4; ++i) {
        const std::uint64_t* const row = m.row(entry, ChunkStorage::row_in_slab(y, z + static_cast<int>(i)));
        starts_of_row<kBits>(row, first + i * kChunkEdge, before, start);
      }
    }
  }
}

template <class Start>
void for_each_start(const ChunkStorage& m, Start&& start) {
  switch (m.bits) {
    case 1:
      return for_each_start<1>(m, start);
    case 2:
      return for_each_start<2>(m, start);
    case 4:
      return for_each_start<4>(m, start);
    case 8:
      return for_each_start<8>(m, start);
    default:
      return for_each_start<16>(m, start);
  }
}

}  // namespace

/// Takes the starts of runs, in order, and ends with the streams of lengths and indices.
struct VoxelRunWriter::Scan {
  explicit Scan(VoxelRunWriter& of, const ChunkStorage& storage) : writer(of), m(storage) {
    writer.palette_.clear();
    writer.new_index_.assign(m.direct() ? kAllTypes : m.palette.size(), kUnseen);
    // A run's length takes no more bytes than the run has voxels.
    writer.lengths_.resize(kChunkVoxels);
    writer.indices_.resize(kChunkVoxels);
    length = writer.lengths_.data();
    index = writer.indices_.data();
  }
  void operator()(std::uint32_t voxel, std::uint32_t stored) {
    if (voxel != 0) end_run(voxel);
    QUOIN_ASSERT(stored < writer.new_index_.size() && runs() < kChunkVoxels, "a stored index, and room for the run");
    std::uint32_t found = writer.new_index_[stored];
    if (found == kUnseen) [[unlikely]] {
      found = static_cast<std::uint32_t>(writer.palette_.size());
      writer.new_index_[stored] = found;
      writer.palette_.push_back(m.direct() ? static_cast<VoxelType>(stored) : m.palette[stored]);
    }
    *index++ = static_cast<std::uint16_t>(found);
    first = voxel;
  }
  void end_run(std::uint32_t voxel) {
    QUOIN_ASSERT(voxel > first && voxel <= kChunkVoxels, "runs in the order of the voxels");
    std::uint32_t rest = voxel - first - 1;
    for (; rest >= 0x80; rest >>= 7) *length++ = static_cast<std::uint8_t>(rest | 0x80U);
    *length++ = static_cast<std::uint8_t>(rest);
  }
  [[nodiscard]] std::size_t runs() const { return static_cast<std::size_t>(index - writer.indices_.data()); }
  [[nodiscard]] std::size_t length_bytes() const { return static_cast<std::size_t>(length - writer.lengths_.data()); }
  [[nodiscard]] std::size_t bytes() const {
    const std::size_t types = writer.palette_.size();
    return 8 + length_bytes() + (types == 2 ? 0 : runs() * (types <= 256 ? 1 : 2));
  }

  VoxelRunWriter& writer;
  const ChunkStorage& m;
  std::uint32_t first = 0;  // first voxel of the current run
  std::uint8_t* length = nullptr;
  std::uint16_t* index = nullptr;
};

void VoxelRunWriter::write(const Chunk& chunk, BlockVector<std::byte>& out) {
  const ChunkStorage* const m = ChunkStorage::of(chunk);
  if (m == nullptr) {
    palette_.assign(1, *chunk.uniform());
    put_number(out, std::uint8_t{0});
    return put_palette(out);
  }
  Scan scan(*this, *m);
  for_each_start(*m, scan);
  scan.end_run(kChunkVoxels);
  const std::size_t types = palette_.size();
  const bool is_packed = types > 1 && scan.bytes() > kChunkVoxels / 8 * static_cast<std::size_t>(bits_for(types));
  put_number(out, static_cast<std::uint8_t>(types == 1 ? 0 : is_packed ? 2 : 1));
  put_palette(out);
  if (types == 1) return;
  return is_packed ? put_packed(chunk, out) : put_runs(scan, out);
}

void VoxelRunWriter::put_palette(BlockVector<std::byte>& out) const {
  QUOIN_ASSERT(!palette_.empty() && palette_.size() <= kAllTypes, "1 to 65,536 types");
  put_number(out, static_cast<std::uint16_t>(palette_.size() - 1));
  for (const VoxelType type : palette_) put_number(out, type);
}

void VoxelRunWriter::put_runs(const Scan& scan, BlockVector<std::byte>& out) const {
  put_number(out, static_cast<std::uint32_t>(scan.runs()));
  put_number(out, static_cast<std::uint32_t>(scan.length_bytes()));
  const std::size_t before = out.size();
  out.resize(before + scan.bytes() - 8);
  std::memcpy(out.data() + before, lengths_.data(), scan.length_bytes());
  if (palette_.size() == 2) return;
  std::byte* const low = out.data() + before + scan.length_bytes();
  for (std::size_t i = 0; i < scan.runs(); ++i) low[i] = static_cast<std::byte>(indices_[i]);
  if (palette_.size() <= 256) return;
  std::byte* const high = low + scan.runs();
  for (std::size_t i = 0; i < scan.runs(); ++i) high[i] = static_cast<std::byte>(indices_[i] >> 8);
}

void VoxelRunWriter::put_packed(const Chunk& chunk, BlockVector<std::byte>& out) {
  const int bits = bits_for(palette_.size());
  const ChunkStorage& m = *ChunkStorage::of(chunk);
  std::array<std::uint64_t, 16> row{};
  for (int y = 0; y < kChunkEdge; ++y) {
    for (int z = 0; z < kChunkEdge; ++z) {
      const std::uint32_t entry = m.slabs[ChunkStorage::slab_index(y, z)];
      const bool is_uniform = (entry & ChunkStorage::kUniformSlab) != 0;
      const std::uint64_t* const from = is_uniform ? nullptr : m.row(entry, ChunkStorage::row_in_slab(y, z));
      for (int x = 0; x < kChunkEdge; ++x) {
        const std::uint32_t stored =
            is_uniform ? entry & ~ChunkStorage::kUniformSlab : packed_row::read(from, m.bits, x);
        QUOIN_ASSERT(new_index_[stored] < palette_.size(), "a type of the palette");
        packed_row::write(row.data(), bits, x, new_index_[stored]);
      }
      for (int i = 0; i < bits; ++i) put_number(out, row[static_cast<std::size_t>(i)]);
    }
  }
}

// Converts runs to the packed rows of a chunk, four layers at a time:
//
//   runs      3 of grass | 70 of earth | ...
//   changes   each voxel's index XOR the previous voxel's index: 0 except at the start of a run
//   row sums  the total change within a row: gives the first index of the next row, and the count of non-air voxels
//   rows      of one index, or a prefix XOR over the row's changes
//   slabs     of one index, or a slot

namespace {

constexpr std::uint32_t kLayers = 4;  // of slabs
constexpr std::uint32_t kRows = kLayers * kChunkEdge;
constexpr std::uint32_t kVoxels = kRows * kChunkEdge;

Error wrong_index(std::size_t types, std::size_t at) {
  return ContentReader::fault("invalid palette index: too early, repeated or not below " + std::to_string(types), at);
}

// Returns a word whose fields are XORed with all fields before them.
template <int kBits>
std::uint64_t prefix_xor(std::uint64_t word) {
  for (int distance = kBits; distance < 64; distance *= 2) word ^= word << distance;
  return word;
}

}  // namespace

struct VoxelRunReader::Streams {
  const std::byte* length = nullptr;
  const std::byte* lengths_end = nullptr;
  const std::byte* low = nullptr;   // null if runs alternate
  const std::byte* high = nullptr;  // null for up to 256 types
  std::size_t lengths_at = 0;       // in the content
  std::size_t indices_at = 0;
  std::uint32_t runs = 0;
  std::uint32_t next = 0;

  template <int kBits>
  [[nodiscard]] std::uint32_t take_index() {
    QUOIN_ASSERT(next < runs, "a run that is left");
    const std::uint32_t i = next++;
    if constexpr (kBits == 1) return i & 1U;
    QUOIN_ASSERT(low != nullptr && (kBits < 16 || high != nullptr), "a stream of indices");
    const auto index = std::to_integer<std::uint32_t>(low[i]);
    return kBits < 16 ? index : index | std::to_integer<std::uint32_t>(high[i]) << 8;
  }
  /// Returns 0 if the stream ends or a number is too large.
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
    return ContentReader::fault(
        "unknown voxel encoding " + std::to_string(form) + " with " + std::to_string(types) + " types", begin);
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
      status = ContentReader::fault(
          "type " + std::to_string(type) + ", but the last type of the world is " + std::to_string(type_count - 1),
          reader.at() - sizeof(type));
    } else if ((seen_[type / 64] >> (type % 64) & 1U) != 0) {
      status = ContentReader::fault("duplicate type " + std::to_string(type), reader.at() - sizeof(type));
    }
    seen_[type / 64] |= std::uint64_t{1} << (type % 64);
  }
  for (std::size_t i = 0; i < taken; ++i) seen_[palette_[i] / 64] = 0;
  return status;
}

/// Builds storage, four layers at a time.
template <int kBits>
class VoxelRunReader::Builder {
 public:
  enum class Fault : std::uint8_t { None, End, Index, Length };

  // Requires: `changes` and `words` are scratch.
  Builder(const BlockVector<VoxelType>& palette, BlockVector<std::uint32_t>& counts,
          BlockVector<std::uint64_t>& changes, BlockVector<std::uint64_t>& words)
      : palette_(palette), counts_(counts), changes_(changes), words_(words) {
    QUOIN_ASSERT(!palette_.empty() && palette_.size() <= std::size_t{1} << kBits, "a palette of indices of kBits bits");
    counts_.assign(palette_.size(), 0);
    changes_.assign(kRows * kBits, 0);
    words_.resize(std::max(words_.size(), kChunkVoxels / 64 * kBits));
    last_ = stored(0);
    const auto air = std::ranges::find(palette_, kAir);
    if (air != palette_.end()) air_ = static_cast<std::uint32_t>(air - palette_.begin());
    is_last_solid_ = palette_[0] != kAir;
  }

  /// Takes the runs that start in the next four layers.
  [[nodiscard]] Fault take_runs(Streams& streams) {
    QUOIN_ASSERT(layers_begin_ < kChunkVoxels && voxel_ >= layers_begin_, "layers that are left");
    // Local copies stay in registers: for the compiler the loop's writes could alias any member.
    Streams s = streams;
    std::uint64_t* const changes = changes_.data();
    std::uint32_t* const counts = counts_.data();
    const auto types = static_cast<std::uint32_t>(palette_.size());
    const std::uint32_t air = air_;
    std::uint32_t at = voxel_ - layers_begin_;
    std::uint32_t before = before_;
    std::int64_t was_solid = before != air ? 1 : 0;
    Fault fault = Fault::None;
    while (at < kVoxels) {
      if (s.next == s.runs) {
        fault = Fault::End;
        break;
      }
      const std::uint32_t index = s.template take_index<kBits>();
      const std::uint32_t voxels = s.take_voxels();
      // The first index must be 0, and each index must differ from the previous one.
      if (index >= seen_) [[unlikely]] {
        if (index > seen_ || index >= types) fault = Fault::Index;
        ++seen_;
      } else if (index == before) [[unlikely]] {
        fault = Fault::Index;
      }
      if (voxels - 1 >= kChunkVoxels - layers_begin_ - at) [[unlikely]]
        fault = fault == Fault::None ? Fault::Length : fault;
      if (fault != Fault::None) [[unlikely]]
        break;
      const std::int64_t is_solid = index != air ? 1 : 0;
      const std::uint32_t x = at % kChunkEdge;
      const std::uint32_t was = stored(before);
      const std::uint32_t is = stored(index);
      changes[at * kBits >> 6] ^= std::uint64_t{was ^ is} << (at * kBits & 63U);
      const std::int64_t solid = is_solid - was_solid;
      sums_[at / kChunkEdge] += (std::int64_t{x} << 48) + solid * (std::int64_t{kChunkEdge - x} << 32) +
                                (std::int64_t{is} - std::int64_t{was});
      ended_[x] -= static_cast<int>(solid);
      counts[index] += voxels;
      before = index;
      was_solid = is_solid;
      at += voxels;
    }
    streams = s;
    before_ = before;
    voxel_ = layers_begin_ + at;
    return fault;
  }

  /// Return the numbers of voxels and of palette indices read so far.
  [[nodiscard]] std::uint32_t voxels() const { return voxel_; }
  [[nodiscard]] std::uint32_t seen() const { return seen_; }

  /// Makes slabs of these layers. Requires: their runs were taken.
  void end_layers() {
    QUOIN_ASSERT(voxel_ >= layers_begin_ + kVoxels, "layers whose runs were taken");
    const auto first_y = static_cast<int>(layers_begin_ / (kChunkEdge * kChunkEdge));
    std::array<std::uint32_t, kRows> before;  // index of the voxel before each row
    std::array<std::uint32_t, kRows> first;   // index of its first voxel; with kMixed if others follow
    for (std::uint32_t row = 0; row < kRows; ++row) {
      constexpr std::uint64_t kField = (std::uint64_t{1} << kBits) - 1;
      std::uint64_t& changes = changes_[row * kBits];
      const RowSum sum(sums_[row]);
      before[row] = last_;
      first[row] = (last_ ^ static_cast<std::uint32_t>(changes & kField)) | (sum.is_mixed ? kMixed : 0U);
      if (!sum.is_mixed) changes = 0;
      count_row(static_cast<std::size_t>(first_y) + row / kChunkEdge, row % kChunkEdge, sum.solid);
      last_ += static_cast<std::uint32_t>(sum.change);
      is_last_solid_ = last_ != (kBits == 16 ? kAir : air_);
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
      QUOIN_ASSERT((std::size_t{entry} + 1) * kSlabRows * kBits <= words_.size(), "room for every slab");
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
    layers_begin_ += kVoxels;
  }

  /// Requires: all layers ended, and each index of the palette was seen.
  Chunk finish() {
    QUOIN_ASSERT(layers_begin_ == kChunkVoxels && seen_ == palette_.size(), "a whole chunk that has every type");
    ChunkStorage& m = *m_;
    m.bits = kBits;
    m.words = PagedWords(std::span(words_).first(std::size_t{m.slot_count} * kSlabRows * kBits));
    m.non_air = static_cast<int>(kChunkVoxels - (air_ < counts_.size() ? counts_[air_] : 0));
    count_columns();
    if (kBits == 16) {
      m.counts.assign(ChunkStorage::kRemainders, 0);
      for (std::size_t i = 0; i < palette_.size(); ++i) m.counts[palette_[i] % ChunkStorage::kRemainders] += counts_[i];
    } else {
      m.palette = palette_;
      m.counts = counts_;
    }
    m.used = static_cast<std::uint32_t>(m.counts.size() - static_cast<std::size_t>(std::ranges::count(m.counts, 0U)));
    return ChunkStorage::chunk_of(std::move(m_));
  }

 private:
  static constexpr std::uint32_t kMixed = 0x8000'0000U;
  /// The total change of a row's runs: three sums packed into one number.
  struct RowSum {
    explicit RowSum(std::int64_t sum) : change(static_cast<std::int32_t>(sum)) {
      const std::int64_t above = (sum - change) >> 32;
      solid = static_cast<std::int16_t>(above);
      is_mixed = above - solid != 0;
    }
    std::int32_t change;  // of the stored index
    std::int16_t solid;   // non-air voxels, minus their number if the whole row were like the last voxel before it
    bool is_mixed;        // a run starts within the row, not only at its start
  };
  static std::uint32_t row_of_slab(std::uint32_t z, std::uint32_t i) { return (i & 3U) * kChunkEdge + z + (i >> 2); }

  [[nodiscard]] std::uint32_t stored(std::uint32_t index) const { return kBits == 16 ? palette_[index] : index; }

  void count_row(std::size_t y, std::size_t z, int change) {
    const int solid = (is_last_solid_ ? kChunkEdge : 0) + change;
    auto& counts = m_->layer_counts;
    counts[1][y] = static_cast<std::uint16_t>(counts[1][y] + solid);
    counts[2][z] = static_cast<std::uint16_t>(counts[2][z] + solid);
  }

  // Writes a row and clears its changes.
  static void put_row(std::uint64_t* changes, std::uint32_t before, std::uint64_t* out) {
    std::uint64_t carry = before;
    for (int i = 0; i < kBits; ++i) {
      const std::uint64_t change = std::exchange(changes[i], 0);
      out[i] = prefix_xor<kBits>(change) ^ packed_row::repeat(kBits, static_cast<std::uint32_t>(carry));
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

  const BlockVector<VoxelType>& palette_;
  BlockVector<std::uint32_t>& counts_;   // voxels of each index
  BlockVector<std::uint64_t>& changes_;  // 0 between layers
  BlockVector<std::uint64_t>& words_;
  Ref<ChunkStorage> m_ = make_ref<ChunkStorage>();
  std::array<std::int64_t, kRows> sums_{};  // RowSum
  std::array<int, kChunkEdge> ended_{};     // by x: runs of solid voxels that end before x, minus runs that start there
  std::uint32_t air_ = 0xFFFF'FFFFU;        // the palette index of air, if present
  std::uint32_t last_ = 0;                  // index of the last voxel of the rows so far
  bool is_last_solid_ = false;
  std::uint32_t layers_begin_ = 0;  // their first voxel
  std::uint32_t voxel_ = 0;         // first voxel of the next run
  std::uint32_t before_ = 0;        // index of the last run
  std::uint32_t seen_ = 0;          // indices so far
};

template <int kBits>
Result<Chunk> VoxelRunReader::build(Streams streams) {
  using Fault = typename Builder<kBits>::Fault;
  Builder<kBits> builder(palette_, counts_, changes_, words_);
  for (std::uint32_t begin = 0; begin < kChunkVoxels; begin += kVoxels) {
    const Fault fault = builder.take_runs(streams);
    if (fault == Fault::Index) return wrong_index(palette_.size(), streams.indices_at + streams.next - 1);
    if (fault != Fault::None) {
      const char* const what = fault == Fault::End ? "runs end early, at voxel " : "invalid run length at voxel ";
      return ContentReader::fault(what + std::to_string(builder.voxels()), streams.lengths_at);
    }
    builder.end_layers();
  }
  if (streams.next != streams.runs || streams.length != streams.lengths_end || builder.seen() != palette_.size()) {
    return ContentReader::fault("runs exceed the chunk, or a type is unused", streams.lengths_at);
  }
  return builder.finish();
}

Result<Chunk> VoxelRunReader::read_runs(ContentReader& reader) {
  if (!reader.has(8)) return reader.cut_off();
  Streams streams;
  streams.runs = reader.take<std::uint32_t>();
  const std::size_t length_bytes = reader.take<std::uint32_t>();
  const std::size_t types = palette_.size();
  if (streams.runs < types || streams.runs > kChunkVoxels) {
    return ContentReader::fault(
        "invalid number of runs: " + std::to_string(streams.runs) + " for " + std::to_string(types) + " types",
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

Result<Chunk> VoxelRunReader::read_packed(ContentReader& reader) {
  const auto bits = static_cast<std::size_t>(bits_for(palette_.size()));
  const std::size_t begin = reader.at();
  if (!reader.has(kChunkVoxels / 8 * bits)) return reader.cut_off();
  BlockVector<VoxelType> types(kChunkVoxels);
  std::uint32_t seen = 0;
  for (std::size_t i = 0; i < std::size_t{kChunkEdge} * kChunkEdge; ++i) {
    const std::size_t first = (i % kChunkEdge * kChunkEdge + i / kChunkEdge) * kChunkEdge;  // of a row: by z, then y
    std::array<std::uint64_t, 16> row{};
    for (std::size_t k = 0; k < bits; ++k) row[k] = reader.take<std::uint64_t>();
    for (int x = 0; x < kChunkEdge; ++x) {
      const std::uint32_t index = packed_row::read(row.data(), static_cast<int>(bits), x);
      if (index > seen || index >= palette_.size()) {
        return wrong_index(palette_.size(), begin + (i * kChunkEdge + static_cast<std::size_t>(x)) * bits / 8);
      }
      seen += index == seen ? 1U : 0U;
      types[first + static_cast<std::size_t>(x)] = palette_[index];
    }
  }
  if (seen != palette_.size()) return ContentReader::fault("unused types in the palette", begin);
  return Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(types));
}

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
struct DataStreams {
  ContentReader gaps, states, lengths;
  ContentReader bytes;
  std::size_t gaps_at = 0, states_at = 0, lengths_at = 0;  // in the content
};

Error moved(Error error, std::size_t by) {
  error.byte_offset = error.byte_offset.value_or(0) + by;
  return error;
}

Status read_voxel(DataStreams& streams, const VoxelRegistry& types, std::uint32_t& next, Chunk& chunk) {
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

Status write_placed_data(const Chunk& chunk, BlockVector<std::byte>& out) {
  QUOIN_ASSERT(chunk.data_count() != 0, "a chunk with data");
  std::array<BlockVector<std::byte>, 3> streams;
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
  DataStreams streams{ContentReader(parts[0]), ContentReader(parts[1]),    ContentReader(parts[2]), bytes, first,
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
