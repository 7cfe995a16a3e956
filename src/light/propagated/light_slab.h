#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <quoin/core/assert.h>

#include "light/propagated/kernel/kernel.h"

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

}  // namespace quoin::propagated
