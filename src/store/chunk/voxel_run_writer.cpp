// Converts the packed rows of a chunk to runs. A voxel starts a run if it differs from the previous voxel, tested by
// XOR on a word of voxels at a time.

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include <quoin/core/assert.h>

#include "core/rows/packed_row.h"
#include "grid/chunk/chunk_storage.h"
#include "store/chunk/voxel_runs.h"

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

void VoxelRunWriter::write(const Chunk& chunk, std::vector<std::byte>& out) {
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

void VoxelRunWriter::put_palette(std::vector<std::byte>& out) const {
  QUOIN_ASSERT(!palette_.empty() && palette_.size() <= kAllTypes, "1 to 65,536 types");
  put_number(out, static_cast<std::uint16_t>(palette_.size() - 1));
  for (const VoxelType type : palette_) put_number(out, type);
}

void VoxelRunWriter::put_runs(const Scan& scan, std::vector<std::byte>& out) const {
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

void VoxelRunWriter::put_packed(const Chunk& chunk, std::vector<std::byte>& out) {
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

}  // namespace quoin::store
