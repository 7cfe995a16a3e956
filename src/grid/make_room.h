#pragma once

#include <vector>

namespace quoin {

/// Reserves memory, so that adding the next element cannot fail.
template <class T>
void make_room(std::vector<T>& all) {
  if (all.size() == all.capacity()) all.reserve(2 * all.size() + 1);
}

}  // namespace quoin
