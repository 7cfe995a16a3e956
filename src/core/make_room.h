#pragma once

#include <cstddef>
#include <vector>

namespace quoin {

/// Reserves memory, so that adding `more` elements cannot fail. If memory must grow, also reserves room for `spare`
/// further elements.
template <class T>
void make_room(std::vector<T>& all, std::size_t more, std::size_t spare) {
  if (all.size() + more > all.capacity()) all.reserve(all.size() + more + spare);
}
/// Reserves memory for the next element; doubles it if it must grow.
template <class T>
void make_room(std::vector<T>& all) {
  make_room(all, 1, all.size());
}

}  // namespace quoin
