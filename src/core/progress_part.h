#pragma once

#include <quoin/core/progress.h>

namespace quoin {

/// A listener for the stretch from `begin` to `end` of another's work. Lifetime: `whole` must outlive it.
[[nodiscard]] inline Progress part_of(const Progress& whole, double begin, double end) {
  if (!whole) return {};
  return [&whole, begin, end](double fraction) { return whole(begin + fraction * (end - begin)); };
}

}  // namespace quoin
