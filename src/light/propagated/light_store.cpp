#include "light/propagated/light_store.h"

#include <algorithm>
#include <bit>

namespace quoin::propagated {
namespace {

// Bit j of byte i becomes bit i of byte j.
std::uint64_t transpose_bytes(std::uint64_t w) {
  const auto swap = [&w](int distance, std::uint64_t mask) {
    const std::uint64_t other = (w ^ (w >> distance)) & mask;
    w ^= other ^ (other << distance);
  };
  swap(7, 0x00AA'00AA'00AA'00AAU);
  swap(14, 0x0000'CCCC'0000'CCCCU);
  swap(28, 0x0000'0000'F0F0'F0F0U);
  return w;
}

using RowPlanes = std::array<std::array<std::uint64_t, kPlanes>, kChannels>;

void write_planes(const RowPlanes& planes, std::span<std::uint16_t, kChunkEdge> out) {
  for (std::size_t first = 0; first < kChunkEdge; first += 8) {
    std::array<std::uint64_t, 2> halves{};
    for (std::size_t half = 0; half < 2; ++half) {
      for (std::size_t bit = 0; bit < 8; ++bit) {
        halves[half] |= (planes[2 * half + bit / kPlanes][bit % kPlanes] >> first & 255U) << (8 * bit);
      }
      halves[half] = transpose_bytes(halves[half]);
    }
    for (std::size_t i = 0; i < 8; ++i) {
      out[first + i] = static_cast<std::uint16_t>((halves[0] >> (8 * i) & 255U) | (halves[1] >> (8 * i) & 255U) << 8);
    }
  }
}

}  // namespace

LevelBlock LevelBlock::uniform(unsigned level) {
  LevelBlock block;
  for (std::size_t bit = 0; bit < kPlanes; ++bit) block.bits[bit].fill(std::uint64_t{0} - (level >> bit & 1U));
  return block;
}

std::optional<unsigned> LevelBlock::uniform() const {
  unsigned level = 0;
  for (std::size_t bit = 0; bit < kPlanes; ++bit) {
    const std::uint64_t first = bits[bit][0];
    if (first + 1 > 1) return std::nullopt;  // neither none nor all
    std::uint64_t other = 0;
    for (const std::uint64_t row : bits[bit]) other |= row ^ first;
    if (other != 0) return std::nullopt;
    level |= static_cast<unsigned>(first & 1U) << bit;
  }
  return level;
}

std::array<std::uint64_t, kPlanes> ChannelLight::row(int y, int z) const {
  unsigned level = 0;
  const LevelBlock* const found = block(block_of(y, z), level);
  std::array<std::uint64_t, kPlanes> planes;
  for (std::size_t bit = 0; bit < kPlanes; ++bit) {
    planes[bit] = found != nullptr ? found->bits[bit][static_cast<std::size_t>(y) % kBlock]
                                   : std::uint64_t{0} - (level >> bit & 1U);
  }
  return planes;
}

unsigned ChannelLight::at(int x, int y, int z) const {
  unsigned level = 0;
  const LevelBlock* const found = block(block_of(y, z), level);
  return found == nullptr ? level : found->at(x, y % static_cast<int>(kBlock));
}

void ChannelLight::put(std::size_t i, const LevelBlock& block) {
  if (index_.empty()) index_.assign(kBlocks, static_cast<std::uint16_t>(kUniform | level_));
  std::uint16_t& index = index_[i];
  if (const std::optional<unsigned> level = block.uniform()) {
    if ((index & kUniform) == 0) free_.push_back(index);
    index = static_cast<std::uint16_t>(kUniform | *level);
    return;
  }
  if ((index & kUniform) == 0) {
    blocks_[index] = block;
  } else if (!free_.empty()) {
    index = free_.back();
    free_.pop_back();
    blocks_[index] = block;
  } else {
    blocks_.push_back(block);
    index = static_cast<std::uint16_t>(blocks_.size() - 1);
  }
}

void ChannelLight::tidy() {
  if (free_.size() < blocks_.size() || index_.empty()) return;
  const std::uint16_t first = index_.front();
  if (std::any_of(index_.begin(), index_.end(), [&](std::uint16_t index) { return index != first; })) return;
  *this = {};
  level_ = first & 15U;
}

std::size_t ChannelLight::bytes() const {
  return index_.capacity() * sizeof(index_[0]) + blocks_.capacity() * sizeof(LevelBlock) +
         free_.capacity() * sizeof(free_[0]);
}

void ChunkLight::forget_lamps(const IBox& box) {
  const unsigned slabs = (2U << ((box.max.y - 1) / 4)) - (1U << (box.min.y / 4));
  for (int z = box.min.z / 4; z <= (box.max.z - 1) / 4; ++z) {
    lamp_slabs[static_cast<std::size_t>(z)] |= static_cast<std::uint16_t>(slabs);
  }
}

std::uint16_t ChunkLight::at(IVec3 local) const {
  unsigned word = 0;
  for (std::size_t c = 0; c < kChannels; ++c) word |= channels[c].at(local.x, local.y, local.z) << (4 * c);
  return static_cast<std::uint16_t>(word);
}

void ChunkLight::read_row(int y, int z, std::span<std::uint16_t, kChunkEdge> out) const {
  RowPlanes planes;
  for (std::size_t c = 0; c < kChannels; ++c) planes[c] = channels[c].row(y, z);
  write_planes(planes, out);
}

std::optional<std::uint16_t> ChunkLight::uniform() const {
  unsigned word = 0;
  for (std::size_t c = 0; c < kChannels; ++c) {
    const std::optional<unsigned> level = channels[c].uniform();
    if (!level) return std::nullopt;
    word |= *level << (4 * c);
  }
  return static_cast<std::uint16_t>(word);
}

std::size_t ChunkLight::bytes() const {
  std::size_t sum = sizeof(ChunkLight);
  for (const ChannelLight& channel : channels) sum += channel.bytes();
  return sum;
}

std::size_t ChangedRows::kind_of(int local) {
  return local == 0 ? 0 : local == kChunkEdge - 1 ? 2 : 1;
}

void ChangedRows::add_block(std::size_t block, const std::array<std::uint64_t, kBlock>& changed) {
  const int z = static_cast<int>(block / (kChunkEdge / kBlock));
  const int y = static_cast<int>(block % (kChunkEdge / kBlock) * kBlock);
  std::array<std::uint64_t, 3>& any = any_[kind_of(z)];
  std::uint64_t inner = 0;  // of the rows between the first and the last
  std::uint64_t rows = 0;
  for (std::size_t i = 0; i < kBlock; ++i) {
    rows |= std::uint64_t{changed[i] != 0} << i;
    if (i > 0 && i + 1 < kBlock) inner |= changed[i];
  }
  any[kind_of(y)] |= changed.front();
  any[kind_of(y + 1)] |= inner;
  any[kind_of(y + static_cast<int>(kBlock) - 1)] |= changed.back();
  if ((rows & 0x0FU) != 0) slabs_.add(y, z);
  if ((rows & 0xF0U) != 0) slabs_.add(y + 4, z);
  x_ |= inner | changed.front() | changed.back();
  y_ |= rows << y;
  z_ |= std::uint64_t{rows != 0} << z;
}

IBox ChangedRows::box() const {
  if (x_ == 0) return {};
  return {{std::countr_zero(x_), std::countr_zero(y_), std::countr_zero(z_)},
          {64 - std::countl_zero(x_), 64 - std::countl_zero(y_), 64 - std::countl_zero(z_)}};
}

VoxelRecord ChangedRows::record(IVec3 chunk) const {
  VoxelRecord record;
  for (std::size_t z = 0; z < kFirst.size(); ++z) {
    for (std::size_t y = 0; y < kFirst.size(); ++y) {
      if (any_[z][y] != 0) record.add(kFirst[y], kFirst[z], any_[z][y]);
    }
  }
  const IBox exact = box();
  record.chunk = chunk;
  record.slabs = slabs_;
  record.box = PackedBox::of(exact.min.x, exact.min.y, exact.min.z);
  record.box.unite(PackedBox::of(exact.max.x - 1, exact.max.y - 1, exact.max.z - 1));
  return record;
}

ChangedRows fill(ChunkLight& light, std::uint16_t word) {
  ChangedRows changed;
  for (std::size_t c = 0; c < kChannels; ++c) {
    const unsigned level = word >> (4 * c) & 15U;
    ChannelLight& channel = light.channels[c];
    if (channel.uniform() == level) continue;
    const LevelBlock now = LevelBlock::uniform(level);
    for (std::size_t i = 0; i < kBlocks; ++i) {
      unsigned was = 0;
      const LevelBlock* const stored = channel.block(i, was);
      const LevelBlock before = stored != nullptr ? *stored : LevelBlock::uniform(was);
      std::array<std::uint64_t, kBlock> differs{};
      for (std::size_t bit = 0; bit < kPlanes; ++bit) {
        for (std::size_t row = 0; row < kBlock; ++row) differs[row] |= before.bits[bit][row] ^ now.bits[bit][row];
      }
      changed.add_block(i, differs);
      channel.put(i, now);
    }
    channel.tidy();
  }
  return changed;
}

}  // namespace quoin::propagated
