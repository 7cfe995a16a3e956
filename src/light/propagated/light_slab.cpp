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

}  // namespace quoin::propagated
