#pragma once

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/instruction_set.h"

/// Skips the test, with a message, if the machine lacks the instruction set.
#define QUOIN_SKIP_WITHOUT(set) \
  if (!::quoin::has_instruction_set(set)) GTEST_SKIP() << "this machine lacks " << ::quoin::name_of(set)

namespace quoin {

/// Returns the instruction sets of this machine, for tests that compare each with an oracle.
inline std::vector<InstructionSet> sets_of_this_machine() {
  std::vector<InstructionSet> sets;
  for (std::size_t i = 0; i < kInstructionSets; ++i) {
    const auto set = static_cast<InstructionSet>(i);
    if (has_instruction_set(set)) sets.push_back(set);
  }
  return sets;
}

inline std::string name_in_tests(InstructionSet set) {
  constexpr const char* kNames[kInstructionSets] = {"Plain", "Avx2", "Avx512", "Avx512Bytes"};
  return kNames[static_cast<std::size_t>(set)];
}
/// For INSTANTIATE_TEST_SUITE_P.
inline std::string name_of_set(const testing::TestParamInfo<InstructionSet>& info) {
  return name_in_tests(info.param);
}

}  // namespace quoin
