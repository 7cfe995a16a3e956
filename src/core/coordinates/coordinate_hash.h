#pragma once

#include <cstddef>
#include <cstdint>

#include <quoin/core/vec.h>

namespace quoin {

/// Spreads integer coordinates (of chunks, of regions) over a hash table.
struct CoordinateHash {
  std::size_t operator()(IVec3 c) const {
    std::uint64_t h = 0;
    for (int axis = 0; axis < 3; ++axis) {
      h = (h ^ static_cast<std::uint32_t>(c[axis])) * 0x9E37'79B9'7F4A'7C15U;
    }
    return static_cast<std::size_t>(h ^ (h >> 32));
  }
};

}  // namespace quoin
