#pragma once

#include <algorithm>
#include <cstdint>

namespace quoin::vulkan {

/// Erases the least recently used entries of a map until at most `max_bytes` are held. Entries that the last image used
/// (`last_use` is `image`) stay.
///
/// `bytes_of(entry)` and `release(entry)` take a reference to an entry; `release` frees its resources.
template <class Map, class BytesOf, class Release>
void drop_oldest(Map& entries, std::uint64_t image, std::uint64_t max_bytes, BytesOf&& bytes_of, Release&& release) {
  std::uint64_t held = 0;
  for (const auto& entry : entries) held += bytes_of(entry);
  while (held > max_bytes) {
    const auto oldest = std::min_element(entries.begin(), entries.end(), [](const auto& a, const auto& b) {
      return a.second.last_use < b.second.last_use;
    });
    if (oldest == entries.end() || oldest->second.last_use == image) return;
    held -= bytes_of(*oldest);
    release(*oldest);
    entries.erase(oldest);
  }
}

}  // namespace quoin::vulkan
