// The pass over a level, for compilers to make wide instructions of.

#include <bit>
#include <cstring>

#include "light/propagated/spread.h"

namespace quoin::propagated {
namespace {

// Eight rows.
using Rows [[gnu::vector_size(kBlock * sizeof(std::uint64_t))]] = std::uint64_t;

inline Rows load(const std::uint64_t* from) {
  Rows rows;
  std::memcpy(&rows, from, sizeof(rows));
  return rows;
}

inline void store(std::uint64_t* to, const Rows& rows) {
  std::memcpy(to, &rows, sizeof(rows));
}

inline bool has_any(const Rows& rows) {
  using Half [[gnu::vector_size(kBlock / 2 * sizeof(std::uint64_t))]] = std::uint64_t;
  std::array<Half, 2> halves;
  std::memcpy(halves.data(), &rows, sizeof(rows));
  const Half any = halves[0] | halves[1];
  return (any[0] | any[1] | any[2] | any[3]) != 0;
}

// Returns whether any voxel of the block got the level.
inline bool spread_block(const SpreadStep& step, std::size_t first) {
  const std::uint64_t* const front = step.front + first;
  const Rows own = load(front);
  const Rows open = load(step.open + first);
  const Rows along_y = load(front - 1) | load(front + 1);
  const Rows along_z = load(front - kStride) | load(front + kStride);
  const Rows got = (own << 1 | own >> 1 | along_y | along_z) & open;
  store(step.next + first, got);
  if (!has_any(got)) return false;
  store(step.open + first, open & ~got);
  for (std::uint64_t* const plane : step.level) {
    if (plane != nullptr) store(plane + first, load(plane + first) | got);
  }
  return true;
}

void spread(const SpreadStep& step, int low_z, int high_z) {
  for (int z = low_z; z < high_z; ++z) {
    const auto i = static_cast<std::size_t>(z);
    unsigned lit = 0;
    for (unsigned left = (*step.blocks)[i]; left != 0; left &= left - 1) {
      const auto block = static_cast<unsigned>(std::countr_zero(left));
      const std::size_t first = (i + 1) * kStride + kBlock + kBlock * block;
      lit |= unsigned{spread_block(step, first)} << block;
    }
    (*step.lit)[i] = static_cast<std::uint8_t>(lit);
  }
}

bool replace(const std::array<const std::uint64_t*, kPlanes>& planes, const std::array<std::uint64_t, kBlock>& where,
             LevelBlock& block, std::array<std::uint64_t, kBlock>& changed) {
  const Rows mask = load(where.data());
  Rows any{};
  for (std::size_t bit = 0; bit < kPlanes; ++bit) {
    std::uint64_t* const rows = block.bits[bit].data();
    const Rows before = load(rows);
    const Rows other = (before ^ load(planes[bit])) & mask;
    store(rows, before ^ other);
    any |= other;
  }
  store(changed.data(), any);
  return has_any(any);
}

}  // namespace
}  // namespace quoin::propagated
