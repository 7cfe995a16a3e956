#include "render/light/propagated/light_chunk.h"

#include <algorithm>
#include <bit>
#include <new>

#include <quoin/core/assert.h>

namespace quoin::propagated {
LightSlab LightSlab::of(const SlabPlanes& planes, const SlabKinds& kinds) {
  QUOIN_ASSERT((kinds.has_ones | kinds.has_zeros) == (1U << kPlanes) - 1, "each plane has ones or zeros");
  if ((kinds.has_ones & kinds.has_zeros) == 0) return LightSlab(kinds.has_ones);
  SlabUnitsRoom units;
  const SlabUnits form = kernel().pack_slab(planes.words.data(), units);
  const std::size_t count = form.first[kPlanes];
  QUOIN_ASSERT(count <= 2 * kPlanes * kSlabWords, "two units per row and plane");
  auto* const made = new (::operator new(sizeof(Block) + count * sizeof(std::uint32_t))) Block(form);
  std::copy_n(units.begin(), count, made->units());
  LightSlab slab;
  slab.bits_ = reinterpret_cast<std::uintptr_t>(made);
  QUOIN_ASSERT((slab.bits_ & 1U) == 0, "an address is even");
  return slab;
}

RowPlanes LightSlab::row(std::size_t row) const {
  QUOIN_ASSERT(row < kSlabWords, "one of the slab's rows");
  RowPlanes planes{};
  if (is_uniform()) {
    for (std::size_t i = 0; i < kPlanes; ++i) planes[i] = (level() >> i & 1U) != 0 ? kAll : 0;
    return planes;
  }
  kernel().unpack_row(block().form, block().units(), row, planes.data());
  return planes;
}

void LightSlab::read(SlabPlanes& out) const {
  if (is_uniform()) {
    for (std::size_t i = 0; i < kPlanes; ++i)
      std::fill_n(out.plane(i), kSlabWords, (level() >> i & 1U) != 0 ? kAll : 0);
    return;
  }
  kernel().unpack_slab(block().form, block().units(), out.words.data());
}

void LightSlab::release() noexcept {
  Block& mine = block();
  if (mine.owners.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
  mine.~Block();
  ::operator delete(&mine);
}

void ChannelLight::take(ChannelChange change) {
  if (change.is_uniform) {
    QUOIN_ASSERT(change.level < 1U << kPlanes && change.slabs.empty(), "one level for the chunk");
    slabs_.reset();
    level_ = change.level;
    return;
  }
  if (is_uniform()) {
    slabs_ = make_ref<Slabs>();
    slabs_->all.fill(LightSlab(level_));
  } else {
    slabs_.make_own();
  }
  bool is_any_uniform = false;
  for (ChannelChange::Slab& slab : change.slabs) {
    QUOIN_ASSERT(slab.index < kSlabs, "a slab of the chunk");
    is_any_uniform |= slab.now.is_uniform();
    LightSlab& stored = (*slabs_)[slab.index];
    slabs_->bytes += slab.now.bytes() - stored.bytes();
    stored = std::move(slab.now);
  }
  if (is_any_uniform) unite();
}

// Slabs of one level all become a chunk of it.
void ChannelLight::unite() {
  const LightSlab& first = slabs_->all.front();
  const auto is_like_first = [&](const LightSlab& slab) { return slab.is_uniform() && slab.level() == first.level(); };
  if (!std::all_of(slabs_->all.begin(), slabs_->all.end(), is_like_first)) return;
  level_ = first.level();
  slabs_.reset();
}

void LightChunk::read_row(int y, int z, std::span<std::uint16_t, kChunkEdge> out) const {
  const bool is_even = std::all_of(channels.begin(), channels.end(), [&](const ChannelLight& channel) {
    return channel.is_uniform() || channel.stored(slab_index(y, z)).is_uniform();
  });
  if (is_even) {
    std::fill(out.begin(), out.end(), at({0, y, z}));
    return;
  }
  std::array<RowPlanes, kChannels> planes;
  for (std::size_t c = 0; c < kChannels; ++c) planes[c] = channels[c].row(y, z);
  kernel().unpack(planes.front().data(), out.data());
}

bool LightChunk::is_dark() const {
  return std::all_of(channels.begin(), channels.end(),
                     [](const ChannelLight& channel) { return channel.is_uniform() && channel.level() == 0; });
}

std::size_t LightChunk::bytes() const {
  std::size_t sum = 0;
  for (const ChannelLight& channel : channels) sum += channel.bytes();
  return sum;
}

}  // namespace quoin::propagated
