#pragma once

#include <algorithm>
#include <vector>

#include <quoin/core/vec.h>

namespace quoin {

/// The order in which grids list their chunks: by z, then y, then x.
inline constexpr ByZyx by_zyx{};

inline void sort_and_unite(std::vector<IVec3>& chunks) {
  std::sort(chunks.begin(), chunks.end(), by_zyx);
  chunks.erase(std::unique(chunks.begin(), chunks.end()), chunks.end());
}

/// Appends the chunks with a voxel at most `reach` voxels away, on each axis, from a box in the coordinates of `chunk`.
inline void add_chunks_near(IVec3 chunk, const IBox& box, int reach, std::vector<IVec3>& to) {
  const IVec3 origin = chunk * kChunkEdge;
  const IVec3 first = chunk_of(origin + box.min - reach);
  const IVec3 last = chunk_of(origin + box.max - 1 + reach);
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) to.emplace_back(x, y, z);
    }
  }
}

/// Sorts change records by their chunks, in the order of `by_zyx`.
inline constexpr auto by_chunk = [](const auto& a, const auto& b) { return by_zyx(a.chunk, b.chunk); };

}  // namespace quoin
