#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>

namespace quoin {

inline constexpr int kMinChunk = std::numeric_limits<int>::min() >> kChunkShift;
inline constexpr int kMaxChunk = std::numeric_limits<int>::max() >> kChunkShift;

/// The outermost chunks stay air, so that every neighbour's coordinates are representable.
inline bool is_inside_world(IVec3 chunk) {
  const auto fits = [](int c) { return c > kMinChunk && c < kMaxChunk; };
  return fits(chunk.x) && fits(chunk.y) && fits(chunk.z);
}

/// Returns true if the neighbouring chunk has valid coordinates. At the ends of the int32 range it has none.
inline bool has_neighbour(IVec3 chunk, IVec3 offset) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t at = std::int64_t{chunk[axis]} + offset[axis];
    if (at != static_cast<int>(at)) return false;
  }
  return true;
}

/// [min, max) in int64, so that corners at the ends of the int32 range do not overflow.
struct LongBox {
  std::array<std::int64_t, 3> min{};
  std::array<std::int64_t, 3> max{};
};

/// Returns the box from `first` to `last`, both included.
inline LongBox box_from(IVec3 first, IVec3 last) {
  LongBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min[static_cast<std::size_t>(axis)] = first[axis];
    box.max[static_cast<std::size_t>(axis)] = std::int64_t{last[axis]} + 1;
  }
  return box;
}

inline LongBox box_from(const IBox& box) {
  LongBox result;
  for (int axis = 0; axis < 3; ++axis) {
    result.min[static_cast<std::size_t>(axis)] = box.min[axis];
    result.max[static_cast<std::size_t>(axis)] = box.max[axis];
  }
  return result;
}

/// Returns the integer points between two corners, and some outside. Requires: no coordinate is NaN.
inline LongBox box_around(DVec3 min, DVec3 max) {
  constexpr double kLimit = 2'147'483'648.0;
  LongBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    QUOIN_ASSERT(!std::isnan(min[axis]) && !std::isnan(max[axis]), "corners that are numbers");
    box.min[i] = static_cast<std::int64_t>(std::floor(std::clamp(min[axis] - 1.0, -kLimit, kLimit)));
    box.max[i] = static_cast<std::int64_t>(std::ceil(std::clamp(max[axis] + 1.0, -kLimit, kLimit)));
  }
  return box;
}

inline bool is_empty(const LongBox& box) {
  return box.max[0] <= box.min[0] || box.max[1] <= box.min[1] || box.max[2] <= box.min[2];
}

/// The chunks that a box meets. Requires: it is not empty and lies within the int32 range.
inline IBox chunks_of(const LongBox& box) {
  QUOIN_ASSERT(!is_empty(box), "a box of voxels");
  IBox chunks;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    QUOIN_ASSERT(static_cast<int>(box.min[i]) == box.min[i] && static_cast<int>(box.max[i] - 1) == box.max[i] - 1,
                 "voxels with int32 coordinates");
    chunks.min[axis] = static_cast<int>(box.min[i] >> kChunkShift);
    chunks.max[axis] = static_cast<int>((box.max[i] - 1) >> kChunkShift) + 1;
  }
  return chunks;
}

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

/// Clips a box to the world without the outermost chunks.
inline LongBox clipped(LongBox box) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.min[axis] = std::max<std::int64_t>(box.min[axis], std::int64_t{kMinChunk + 1} * kChunkEdge);
    box.max[axis] = std::min<std::int64_t>(box.max[axis], std::int64_t{kMaxChunk} * kChunkEdge);
  }
  return box;
}

}  // namespace quoin
