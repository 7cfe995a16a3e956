#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>

#include "light/propagated/light_domain.h"
#include "light/propagated/light_store.h"

namespace quoin::propagated {

/// Reads light at voxels that lie near each other: remembers the slab of the last one.
class LightReader {
 public:
  LightReader(const LightStore& store, const LightDomain& domain) : store_(&store), domain_(&domain) {}

  /// Packed.
  [[nodiscard]] std::uint16_t at(IVec3 voxel) {
    if (!is_known_ || slab_of(voxel) != slab_) look_at(voxel);
    unsigned word = even_;
    if (mixed_ == 0) return static_cast<std::uint16_t>(word);
    const auto x = static_cast<unsigned>(voxel.x & (kChunkEdge - 1));
    const std::size_t row = row_in_slab(voxel.y, voxel.z);
    for (std::size_t i = 0; i < mixed_; ++i) word |= slabs_[i]->at(row, x) << shifts_[i];
    return static_cast<std::uint16_t>(word);
  }

  /// The 64 voxels along x in whose row `voxel` lies.
  void read_row(IVec3 voxel, std::span<std::uint16_t, kChunkEdge> out) {
    if (const IVec3 chunk = chunk_of(voxel); !is_known_ || chunk != chunk_) look_at(voxel);
    if (light_ == nullptr) {
      std::fill(out.begin(), out.end(), static_cast<std::uint16_t>(even_));
    } else {
      light_->read_row(voxel.y & (kChunkEdge - 1), voxel.z & (kChunkEdge - 1), out);
    }
  }

 private:
  static IVec3 slab_of(IVec3 voxel) { return {voxel.x >> kChunkShift, voxel.y >> 2, voxel.z >> 2}; }
  void look_at(IVec3 voxel) {
    const IVec3 chunk = chunk_of(voxel);
    if (!is_known_ || chunk != chunk_) {
      is_held_ = domain_->holds(chunk);
      light_ = is_held_ ? store_->find(chunk) : nullptr;
    }
    is_known_ = true;
    chunk_ = chunk;
    slab_ = slab_of(voxel);
    mixed_ = 0;
    even_ = is_held_ ? std::uint16_t{0} : domain_->beyond(chunk);
    if (light_ == nullptr) return;
    const IVec3 local = local_of(voxel);
    for (std::size_t c = 0; c < kChannels; ++c) {
      const ChannelLight& channel = light_->channels[c];
      const auto shift = static_cast<unsigned>(4 * c);
      const LightSlab* slab = channel.is_uniform() ? nullptr : &channel.stored(slab_index(local.y, local.z));
      if (slab == nullptr || slab->is_uniform()) {
        even_ |= (slab == nullptr ? channel.level() : slab->level()) << shift;
      } else {
        slabs_[mixed_] = slab;
        shifts_[mixed_++] = shift;
      }
    }
  }

  const LightStore* store_;
  const LightDomain* domain_;
  bool is_known_ = false;
  bool is_held_ = false;
  IVec3 chunk_{0};
  IVec3 slab_{0};
  const LightChunk* light_ = nullptr;
  unsigned even_ = 0;  // of the channels that have one level in the slab
  std::size_t mixed_ = 0;
  std::array<const LightSlab*, kChannels> slabs_{};  // of the others
  std::array<unsigned, kChannels> shifts_{};
};

}  // namespace quoin::propagated
