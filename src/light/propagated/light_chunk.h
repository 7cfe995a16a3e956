#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/ref.h>
#include <quoin/grid/chunk.h>

#include "light/propagated/light_slab.h"

namespace quoin::propagated {

inline constexpr std::size_t kChannels = 4;  // sky, red, green, blue
inline constexpr std::size_t kSlabs = 256;   // of a chunk

[[nodiscard]] inline std::size_t slab_index(int y, int z) {
  QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
  return static_cast<std::size_t>((z >> 2) * 16 + (y >> 2));
}
[[nodiscard]] inline std::size_t row_in_slab(int y, int z) {
  return static_cast<std::size_t>((z & 3) << 2 | (y & 3));
}

/// Replaces slabs of one channel of a chunk: all by one level, or those at some indices.
struct ChannelChange {
  struct Slab {
    std::size_t index;
    LightSlab now;
  };
  bool is_uniform = false;
  unsigned level = 0;
  std::vector<Slab> slabs;

  [[nodiscard]] bool empty() const { return !is_uniform && slabs.empty(); }
};

/// The levels of one channel in a chunk: of one level everywhere, or slabs. Copies share them until one is changed.
class ChannelLight {
 public:
  [[nodiscard]] bool is_uniform() const { return slabs_ == nullptr; }
  /// Requires: is_uniform().
  [[nodiscard]] unsigned level() const {
    QUOIN_ASSERT(is_uniform(), "light of one level");
    return level_;
  }
  /// Requires: !is_uniform().
  [[nodiscard]] const LightSlab& stored(std::size_t index) const {
    QUOIN_ASSERT(!is_uniform() && index < kSlabs, "light of several levels, one of its slabs");
    return (*slabs_)[index];
  }
  /// Requires: 0 <= x, y, z < 64.
  [[nodiscard]] unsigned at(int x, int y, int z) const {
    QUOIN_ASSERT((x | y | z) >= 0 && (x | y | z) < kChunkEdge, "0 <= x, y, z < 64");
    return is_uniform() ? level_ : (*slabs_)[slab_index(y, z)].at(row_in_slab(y, z), static_cast<unsigned>(x));
  }
  [[nodiscard]] RowPlanes row(int y, int z) const {
    return is_uniform() ? LightSlab(level_).row(0) : (*slabs_)[slab_index(y, z)].row(row_in_slab(y, z));
  }
  void take(ChannelChange change);
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Slabs : RefCounted {
    std::array<LightSlab, kSlabs> all;
    LightSlab& operator[](std::size_t i) { return all[i]; }
  };
  void unite();

  unsigned level_ = 0;
  Ref<Slabs> slabs_;
};

/// A set of slabs of a chunk: [z / 4], bit y / 4.
using SlabSet = std::array<std::uint16_t, kChunkEdge / 4>;

[[nodiscard]] inline SlabSet all_slabs() {
  SlabSet all;
  all.fill(0xFFFF);
  return all;
}

/// The light of all channels of a chunk. Dark by default.
struct LightChunk {
  std::array<ChannelLight, kChannels> channels;
  SlabSet lamp_slabs = all_slabs();  ///< all slabs with lamps, maybe more

  /// Packed. Requires: 0 <= x, y, z < 64.
  [[nodiscard]] std::uint16_t at(IVec3 voxel) const {
    unsigned word = 0;
    for (std::size_t c = 0; c < kChannels; ++c) word |= channels[c].at(voxel.x, voxel.y, voxel.z) << (4 * c);
    return static_cast<std::uint16_t>(word);
  }
  void read_row(int y, int z, std::span<std::uint16_t, kChunkEdge> out) const;
  [[nodiscard]] bool is_dark() const;
  [[nodiscard]] std::size_t bytes() const;
};

}  // namespace quoin::propagated
