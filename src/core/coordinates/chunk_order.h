#pragma once

#include <algorithm>
#include <vector>

#include <quoin/core/vec.h>

namespace quoin {

/// The order in which grids list their chunks: by z, then y, then x.
inline constexpr auto by_zyx = [](IVec3 a, IVec3 b) {
  if (a.z != b.z) return a.z < b.z;
  return a.y != b.y ? a.y < b.y : a.x < b.x;
};

inline void sort_and_unite(std::vector<IVec3>& chunks) {
  std::sort(chunks.begin(), chunks.end(), by_zyx);
  chunks.erase(std::unique(chunks.begin(), chunks.end()), chunks.end());
}

/// Records of changes likewise, by their chunks.
inline constexpr auto by_chunk = [](const auto& a, const auto& b) { return by_zyx(a.chunk, b.chunk); };

}  // namespace quoin
