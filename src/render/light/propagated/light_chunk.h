#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/ref.h>
#include <quoin/grid/chunk.h>

#include "render/light/propagated/kernel/light_kernel.h"

namespace quoin::propagated {

/// Levels of a row of 64 voxels: bit x of [i] is bit i of the level at x.
using RowPlanes = std::array<std::uint64_t, kPlanes>;

/// The bit planes of a slab, 64x4x4 voxels: [plane][y % 4 + 4 (z % 4)].
struct SlabPlanes {
  alignas(64) std::array<std::uint64_t, kPlanes * kSlabWords> words;

  [[nodiscard]] std::uint64_t* plane(std::size_t i) {
    QUOIN_ASSERT(i < kPlanes, "one of the planes");
    return words.data() + i * kSlabWords;
  }
  [[nodiscard]] const std::uint64_t* plane(std::size_t i) const {
    QUOIN_ASSERT(i < kPlanes, "one of the planes");
    return words.data() + i * kSlabWords;
  }
  [[nodiscard]] RowPlanes row(std::size_t row) const {
    QUOIN_ASSERT(row < kSlabWords, "one of the slab's rows");
    RowPlanes planes;
    for (std::size_t i = 0; i < kPlanes; ++i) planes[i] = plane(i)[row];
    return planes;
  }
  /// Bit i is set if row i has light in the voxels of `mask`.
  [[nodiscard]] unsigned lit_rows(std::uint64_t mask) const { return kernel().find_rows(words.data(), kPlanes, mask); }
};

/// The levels of one channel in a slab. Shared by its copies and immutable. Threads: as Ref.
///
/// A slab of a single level is stored as a number. Other slabs are stored as SlabUnits; a slab of open sky and rock
/// takes half a plane.
class LightSlab {
 public:
  /// A slab of one level.
  explicit LightSlab(unsigned level = 0) noexcept : bits_(std::uintptr_t{level} << 1 | 1U) {
    QUOIN_ASSERT(level < 1U << kPlanes, "a level");
  }
  [[nodiscard]] static LightSlab of(const SlabPlanes& planes, const SlabKinds& kinds);

  LightSlab(const LightSlab& other) noexcept : bits_(other.bits_) {
    if (!is_uniform()) block().owners.fetch_add(1, std::memory_order_relaxed);
  }
  LightSlab(LightSlab&& other) noexcept : bits_(std::exchange(other.bits_, 1)) {}
  LightSlab& operator=(LightSlab other) noexcept {
    std::swap(bits_, other.bits_);
    return *this;
  }
  ~LightSlab() {
    if (!is_uniform()) release();
  }

  [[nodiscard]] bool is_uniform() const { return (bits_ & 1U) != 0; }
  /// Requires: is_uniform().
  [[nodiscard]] unsigned level() const {
    QUOIN_ASSERT(is_uniform(), "a slab of one level");
    return static_cast<unsigned>(bits_ >> 1);
  }
  [[nodiscard]] unsigned at(std::size_t row, unsigned x) const {
    QUOIN_ASSERT(x < 64, "0 <= x < 64");
    if (is_uniform()) return level();
    const RowPlanes planes = this->row(row);
    unsigned found = 0;
    for (std::size_t i = 0; i < kPlanes; ++i) found |= static_cast<unsigned>(planes[i] >> x & 1U) << i;
    return found;
  }
  [[nodiscard]] RowPlanes row(std::size_t row) const;
  void read(SlabPlanes& out) const;
  /// Returns the heap memory, without the object itself.
  [[nodiscard]] std::size_t bytes() const { return is_uniform() ? 0 : block().bytes(); }

 private:
  // Then its units.
  struct Block {
    explicit Block(const SlabUnits& of) : form(of) {}

    SlabUnits form;
    std::atomic<std::uint32_t> owners{1};

    [[nodiscard]] std::uint32_t* units() { return reinterpret_cast<std::uint32_t*>(this + 1); }
    [[nodiscard]] const std::uint32_t* units() const { return reinterpret_cast<const std::uint32_t*>(this + 1); }
    [[nodiscard]] std::size_t bytes() const { return sizeof(Block) + form.first[kPlanes] * sizeof(std::uint32_t); }
  };
  static_assert(sizeof(Block) == 28);

  // A chunk has a thousand of them, eight bytes each.
  [[nodiscard]] Block& block() const {
    QUOIN_ASSERT(!is_uniform(), "a slab of several levels");
    return *reinterpret_cast<Block*>(bits_);  // NOLINT(performance-no-int-to-ptr)
  }
  void release() noexcept;

  std::uintptr_t bits_;  // 1 | level << 1, or a block
};

inline constexpr std::size_t kChannels = 4;  // sky, red, green, blue
inline constexpr std::size_t kSky = 0;
inline constexpr std::size_t kSlabs = 256;  // of a chunk

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
  /// Returns the heap memory. Cost: O(1).
  [[nodiscard]] std::size_t bytes() const { return is_uniform() ? 0 : sizeof(Slabs) + slabs_->bytes; }

 private:
  struct Slabs : RefCounted {
    std::array<LightSlab, kSlabs> all;
    std::size_t bytes = 0;  // LightSlab::bytes of all
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
