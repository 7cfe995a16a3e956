#pragma once

// For tests, and for benchmarks, which know no GoogleTest.

#include "core/instruction_set.h"

namespace quoin {

/// Creates an object with the kernels of `set`.
template <class T>
[[nodiscard]] T made_with(InstructionSet set) {
  const InstructionSetOverride over(set);
  return T();
}

}  // namespace quoin
