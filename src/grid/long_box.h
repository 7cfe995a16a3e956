#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>

namespace quoin {

inline constexpr int kMinChunk = std::numeric_limits<int>::min() >> kChunkShift;
inline constexpr int kMaxChunk = std::numeric_limits<int>::max() >> kChunkShift;

/// The outermost chunks stay air, so that every neighbour's coordinates are representable.
inline bool is_inside_world(IVec3 chunk) {
  const auto fits = [](int c) { return c > kMinChunk && c < kMaxChunk; };
  return fits(chunk.x) && fits(chunk.y) && fits(chunk.z);
}

/// [min, max) in int64, so that corners at the ends of the int32 range do not overflow.
struct LongBox {
  std::array<std::int64_t, 3> min{};
  std::array<std::int64_t, 3> max{};
};

/// The part of a box that lies in a chunk, in the chunk's coordinates.
inline IBox part_of(const LongBox& box, IVec3 chunk) {
  IBox part;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const std::int64_t origin = std::int64_t{chunk[axis]} * kChunkEdge;
    part.min[axis] = static_cast<int>(std::max<std::int64_t>(box.min[i] - origin, 0));
    part.max[axis] = static_cast<int>(std::min<std::int64_t>(box.max[i] - origin, kChunkEdge));
  }
  return part;
}

/// Without what lies in the outermost chunks.
inline LongBox clipped(LongBox box) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.min[axis] = std::max<std::int64_t>(box.min[axis], std::int64_t{kMinChunk + 1} * kChunkEdge);
    box.max[axis] = std::min<std::int64_t>(box.max[axis], std::int64_t{kMaxChunk} * kChunkEdge);
  }
  return box;
}

}  // namespace quoin
