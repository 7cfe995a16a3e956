#include "light/propagated/light_chunk.h"

#include <algorithm>

#include <quoin/core/assert.h>

namespace quoin::propagated {

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
    (*slabs_)[slab.index] = std::move(slab.now);
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

std::size_t ChannelLight::bytes() const {
  if (is_uniform()) return 0;
  std::size_t sum = sizeof(Slabs);
  for (const LightSlab& slab : slabs_->all) sum += slab.bytes();
  return sum;
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
