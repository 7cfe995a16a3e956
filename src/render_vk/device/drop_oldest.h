#pragma once

#include <algorithm>
#include <cstdint>

namespace quoin::vulkan {

/// Erases from a map what pictures have not asked for longest, until no more than `max_bytes` are held; what the last
/// picture asked for (`last_use` is `picture`) stays.
///
/// `bytes_of(entry)` and `release(entry)` take what an iterator points to; the second gives back what it holds.
template <class Map, class BytesOf, class Release>
void drop_oldest(Map& entries, std::uint64_t picture, std::uint64_t max_bytes, BytesOf&& bytes_of, Release&& release) {
  std::uint64_t held = 0;
  for (const auto& entry : entries) held += bytes_of(entry);
  while (held > max_bytes) {
    const auto oldest = std::min_element(entries.begin(), entries.end(), [](const auto& a, const auto& b) {
      return a.second.last_use < b.second.last_use;
    });
    if (oldest == entries.end() || oldest->second.last_use == picture) return;
    held -= bytes_of(*oldest);
    release(*oldest);
    entries.erase(oldest);
  }
}

}  // namespace quoin::vulkan
