#pragma once

#include <vector>

namespace quoin {

/// So that the next element is put without a failure.
template <class T>
void make_room(std::vector<T>& all) {
  if (all.size() == all.capacity()) all.reserve(2 * all.size() + 1);
}

}  // namespace quoin
