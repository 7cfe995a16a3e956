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

/// Sorts change records by their chunks, in the order of `by_zyx`.
inline constexpr auto by_chunk = [](const auto& a, const auto& b) { return by_zyx(a.chunk, b.chunk); };

}  // namespace quoin
