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

/// Those of a slab, 64x4x4 voxels: [plane][y % 4 + 4 (z % 4)].
struct SlabPlanes {
  alignas(64) std::array<std::uint64_t, kPlanes * kSlabWords> words;

  [[nodiscard]] std::uint64_t* plane(std::size_t i) { return words.data() + i * kSlabWords; }
  [[nodiscard]] const std::uint64_t* plane(std::size_t i) const { return words.data() + i * kSlabWords; }
};

/// The levels of one channel in a slab. Shared by its copies; it is never changed, but replaced. Threads: as Ref.
///
/// Planes that are all 0, all 1 or equal to the one before take nothing: a slab of one level is but a number, one of
/// open sky and rock has one plane. Where most rows are like the one before, only the others are kept.
class LightSlab {
 public:
  /// All of one level.
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
    if (is_uniform()) return level();
    unsigned found = 0;
    if (const Block& all = block(); all.stored == (1U << kPlanes) - 1 && !all.is_sparse) {
      const std::uint64_t* words = all.words() + row;
      for (std::size_t i = 0; i < kPlanes; ++i) found |= static_cast<unsigned>(words[i * kSlabWords] >> x & 1U) << i;
      return found;
    }
    visit_row(row,
              [&](std::size_t plane, std::uint64_t word) { found |= static_cast<unsigned>(word >> x & 1U) << plane; });
    return found;
  }
  [[nodiscard]] RowPlanes row(std::size_t row) const;
  /// Bit i: whether row i has light where `mask` has bits.
  [[nodiscard]] unsigned lit_rows(std::uint64_t mask) const;
  void read(SlabPlanes& out) const;
  /// Beside the object itself.
  [[nodiscard]] std::size_t bytes() const { return is_uniform() ? 0 : block().bytes(); }

 private:
  struct Form {
    std::array<std::uint16_t, kPlanes> fresh{};  // rows of each plane that are there, if it is sparse
    std::array<std::uint8_t, kPlanes> first{};   // word of each plane that is stored
    std::uint8_t stored = 0;                     // planes that are
    std::uint8_t same = 0;                       // not stored: equal to the one before
    std::uint8_t ones = 0;                       // not stored: all 1
    std::uint8_t count = 0;                      // of words
    bool is_sparse = false;
  };
  // Then words: [plane that is stored][row]; or, where it is sparse, of each of these planes those rows that differ
  // from the one before, the first from 0.
  struct Block : Form {
    explicit Block(const Form& form) : Form(form) {}
    std::atomic<std::uint32_t> owners{1};

    [[nodiscard]] std::uint64_t* words() { return reinterpret_cast<std::uint64_t*>(this + 1); }
    [[nodiscard]] const std::uint64_t* words() const { return reinterpret_cast<const std::uint64_t*>(this + 1); }
    [[nodiscard]] std::size_t bytes() const { return sizeof(Block) + count * sizeof(std::uint64_t); }
    [[nodiscard]] std::uint64_t word(std::size_t plane, std::size_t row) const {
      if (!is_sparse) return words()[first[plane] + row];
      const unsigned before = fresh[plane] & ((2U << row) - 1);
      return before == 0 ? 0 : words()[first[plane] + static_cast<std::size_t>(std::popcount(before)) - 1];
    }
  };
  static_assert(sizeof(Block) == 24);

  // A chunk has a thousand of them, eight bytes each.
  [[nodiscard]] Block& block() const {
    QUOIN_ASSERT(!is_uniform(), "a slab of several levels");
    return *reinterpret_cast<Block*>(bits_);  // NOLINT(performance-no-int-to-ptr)
  }
  void release() noexcept;
  void read_plane(std::size_t plane, std::uint64_t* out) const;
  template <class Visit>
  void visit_row(std::size_t row, Visit&& visit) const {
    const Block& stored = block();
    std::uint64_t word = 0;
    for (std::size_t plane = 0; plane < kPlanes; ++plane) {
      if ((stored.stored >> plane & 1U) != 0) {
        word = stored.word(plane, row);
      } else if ((stored.same >> plane & 1U) == 0) {
        word = (stored.ones >> plane & 1U) != 0 ? ~std::uint64_t{0} : 0;
      }
      visit(plane, word);
    }
  }

  std::uintptr_t bits_;  // 1 | level << 1, or a block
};

}  // namespace quoin::propagated
