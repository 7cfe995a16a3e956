#include "light/propagated/light_slab.h"

#include <algorithm>
#include <bit>
#include <new>

#include <quoin/core/assert.h>

namespace quoin::propagated {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

}  // namespace

LightSlab LightSlab::of(const SlabPlanes& planes, const SlabKinds& kinds) {
  const unsigned mixed = kinds.has_ones & kinds.has_zeros;
  const unsigned ones = kinds.has_ones & ~kinds.has_zeros;
  if (mixed == 0) return LightSlab(ones);
  Form form;
  form.stored = static_cast<std::uint8_t>(mixed & (kinds.differs | 1U));
  form.same = static_cast<std::uint8_t>(mixed & ~form.stored);
  form.ones = static_cast<std::uint8_t>(ones);
  std::size_t few = 0;
  std::size_t all = 0;
  for (std::size_t i = 0; i < kPlanes; ++i) {
    if ((form.stored >> i & 1U) == 0) continue;
    form.fresh[i] = kinds.fresh[i];
    few += static_cast<std::size_t>(std::popcount(kinds.fresh[i]));
    all += kSlabWords;
  }
  // Else reading would take longer for little.
  form.is_sparse = 2 * few <= all;
  form.count = static_cast<std::uint8_t>(form.is_sparse ? few : all);
  Block* made = new (::operator new(sizeof(Block) + form.count * sizeof(std::uint64_t))) Block(form);
  std::uint64_t* next = made->words();
  for (std::size_t i = 0; i < kPlanes; ++i) {
    if ((form.stored >> i & 1U) == 0) continue;
    made->first[i] = static_cast<std::uint8_t>(next - made->words());
    const std::uint64_t* rows = planes.plane(i);
    if (!form.is_sparse) {
      next = std::copy_n(rows, kSlabWords, next);
      continue;
    }
    for (unsigned left = form.fresh[i]; left != 0; left &= left - 1) *next++ = rows[std::countr_zero(left)];
  }
  LightSlab slab;
  QUOIN_ASSERT(next == made->words() + form.count, "as many words as were counted");
  slab.bits_ = reinterpret_cast<std::uintptr_t>(made);
  QUOIN_ASSERT((slab.bits_ & 1U) == 0, "an address is even");
  return slab;
}

void LightSlab::read_plane(std::size_t plane, std::uint64_t* out) const {
  const Block& stored = block();
  const std::uint64_t* next = stored.words() + stored.first[plane];
  if (!stored.is_sparse) {
    std::copy_n(next, kSlabWords, out);
    return;
  }
  std::uint64_t word = 0;
  for (std::size_t row = 0; row < kSlabWords; ++row) {
    if ((stored.fresh[plane] >> row & 1U) != 0) word = *next++;
    out[row] = word;
  }
}

RowPlanes LightSlab::row(std::size_t row) const {
  RowPlanes planes{};
  if (is_uniform()) {
    for (std::size_t i = 0; i < kPlanes; ++i) planes[i] = (level() >> i & 1U) != 0 ? kAll : 0;
    return planes;
  }
  visit_row(row, [&](std::size_t plane, std::uint64_t word) { planes[plane] = word; });
  return planes;
}

unsigned LightSlab::lit_rows(std::uint64_t mask) const {
  constexpr unsigned kAllRows = (1U << kSlabWords) - 1;
  if (is_uniform()) return level() != 0 && mask != 0 ? kAllRows : 0;
  const Block& stored = block();
  if (stored.ones != 0) return mask != 0 ? kAllRows : 0;
  if (!stored.is_sparse) return kernel().find_rows(stored.words(), stored.count / kSlabWords, mask);
  // Each row that is there goes on to the next one.
  unsigned rows = 0;
  for (std::size_t i = 0; i < kPlanes; ++i) {
    const std::uint64_t* next = stored.words() + stored.first[i];
    for (unsigned left = (stored.stored >> i & 1U) != 0 ? stored.fresh[i] : 0; left != 0;) {
      const unsigned from = left & (~left + 1);
      left &= left - 1;
      const unsigned to = left == 0 ? kAllRows + 1 : left & (~left + 1);
      if ((*next++ & mask) != 0) rows |= to - from;
    }
  }
  return rows;
}

void LightSlab::read(SlabPlanes& out) const {
  if (is_uniform()) {
    for (std::size_t i = 0; i < kPlanes; ++i)
      std::fill_n(out.plane(i), kSlabWords, (level() >> i & 1U) != 0 ? kAll : 0);
    return;
  }
  const Block& stored = block();
  for (std::size_t i = 0; i < kPlanes; ++i) {
    std::uint64_t* to = out.plane(i);
    if ((stored.stored >> i & 1U) != 0) {
      read_plane(i, to);
    } else if ((stored.same >> i & 1U) != 0) {
      std::copy_n(out.plane(i - 1), kSlabWords, to);
    } else {
      std::fill_n(to, kSlabWords, (stored.ones >> i & 1U) != 0 ? kAll : 0);
    }
  }
}

void LightSlab::release() noexcept {
  Block& mine = block();
  if (mine.owners.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
  mine.~Block();
  ::operator delete(&mine);
}

}  // namespace quoin::propagated
