#include "core/instruction_set.h"

#include <quoin/core/assert.h>

namespace quoin {
namespace {

void use(InstructionSet set) {
  instruction_set_in_use.store(static_cast<std::uint8_t>(static_cast<int>(set) + 1), std::memory_order_relaxed);
}

InstructionSet most_of_this_machine() {
#ifdef QUOIN_X86_KERNELS
  __builtin_cpu_init();
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
                        __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("popcnt");
  const bool has_avx512 = has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                          __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  const bool has_bytes = has_avx512 && __builtin_cpu_supports("avx512vbmi") && __builtin_cpu_supports("avx512vbmi2") &&
                         __builtin_cpu_supports("avx512vpopcntdq") && __builtin_cpu_supports("gfni");
  if (has_bytes) return InstructionSet::Avx512Bytes;
  if (has_avx512) return InstructionSet::Avx512;
  if (has_avx2) return InstructionSet::Avx2;
#endif
  return InstructionSet::Plain;
}

}  // namespace

InstructionSet find_instruction_set() {
  const InstructionSet found = most_of_this_machine();
  use(found);
  return found;
}

const char* name_of(InstructionSet set) {
  constexpr const char* kNames[kInstructionSets] = {"plain C++", "AVX2, BMI and BMI2", "AVX-512 F, BW, DQ and VL",
                                                    "AVX-512 VBMI, VBMI2 and VPOPCNTDQ, and GFNI"};
  QUOIN_ASSERT(static_cast<std::size_t>(set) < kInstructionSets, "a known instruction set");
  return kNames[static_cast<std::size_t>(set)];
}

InstructionSetOverride::InstructionSetOverride(InstructionSet set) : before_(instruction_set()) {
  QUOIN_ASSERT(has_instruction_set(set), "this machine must have the instruction set");
  use(set);
}

InstructionSetOverride::~InstructionSetOverride() {
  use(before_);
}

}  // namespace quoin
