#include <quoin/core/instruction_set.h>

namespace quoin {
namespace {

InstructionSet widest() {
#ifdef QUOIN_X86_KERNELS
  __builtin_cpu_init();
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
                        __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("popcnt");
  const bool has_avx512 = has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                          __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  if (has_avx512) return InstructionSet::Avx512;
  if (has_avx2) return InstructionSet::Avx2;
#endif
  return InstructionSet::Plain;
}

}  // namespace

InstructionSet resolve(InstructionSet wanted) {
  static const InstructionSet on_this_machine = widest();
  // Declared from the widest to the plainest.
  return wanted < on_this_machine ? on_this_machine : wanted;
}

}  // namespace quoin
