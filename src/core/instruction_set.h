#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>

namespace quoin {

/// The instruction sets of kernels, from the smallest to the largest. Each set includes all earlier ones. All give the
/// same bytes.
enum class InstructionSet : std::uint8_t {
  Plain,        ///< none beyond the build's baseline
  Avx2,         ///< AVX2, BMI, BMI2
  Avx512,       ///< AVX-512 F, BW, DQ, VL
  Avx512Bytes,  ///< AVX-512 VBMI, VBMI2, VPOPCNTDQ; GFNI
};
inline constexpr std::size_t kInstructionSets = 4;

// One more than the set in use; 0 until the first request.
inline constinit std::atomic<std::uint8_t> instruction_set_in_use{0};

// Detects the instruction sets of the machine.
[[nodiscard]] InstructionSet find_instruction_set();

/// Returns the instruction set for kernels: the largest that this machine supports, or a smaller one set by an
/// override. Kernels read it once per call or once per object. Cost: one load.
[[nodiscard]] inline InstructionSet instruction_set() {
  const std::uint8_t known = instruction_set_in_use.load(std::memory_order_relaxed);
  return known != 0 ? static_cast<InstructionSet>(known - 1) : find_instruction_set();
}

[[nodiscard]] inline bool has_instruction_set(InstructionSet set) {
  return set <= instruction_set();
}

/// A table with one kernel per instruction set. An entry repeats if a set has no better kernel.
template <class Kernel>
struct KernelTable {
  const Kernel* of[kInstructionSets];

  /// Returns the kernel for the widest instructions of this machine.
  [[nodiscard]] const Kernel& widest() const {
    const Kernel* const kernel = of[static_cast<std::size_t>(instruction_set())];
    QUOIN_ASSERT(kernel != nullptr, "a kernel per instruction set");
    return *kernel;
  }
};

// A kernel's source is compiled once for each instruction set (cmake/QuoinKernels.cmake). It defines kPlainKernel,
// kAvx2Kernel or kAvx512Kernel and, when compiled for the plain set, the table of them:
//
//   constinit const Kernel QUOIN_KERNEL(Kernel) = {...};
//   #ifndef QUOIN_KERNEL_AVX2
//   constinit const KernelTable<Kernel> kKernels = QUOIN_KERNEL_TABLE(Kernel, Avx512);
//   #endif
//
// The second argument names the kernel of InstructionSet::Avx512: Avx2 if the widest kernel needs more than this set.
#if defined(QUOIN_KERNEL_AVX512)
#define QUOIN_KERNEL(Kernel) kAvx512##Kernel
#elif defined(QUOIN_KERNEL_AVX2)
#define QUOIN_KERNEL(Kernel) kAvx2##Kernel
#else
#define QUOIN_KERNEL(Kernel) kPlain##Kernel
#endif
#ifdef QUOIN_X86_KERNELS
#define QUOIN_KERNEL_TABLE(Kernel, avx512) \
  { &kPlain##Kernel, &kAvx2##Kernel, &k##avx512##Kernel, &kAvx512##Kernel }
#else
#define QUOIN_KERNEL_TABLE(Kernel, avx512) \
  { &kPlain##Kernel }
#endif

/// Returns a name of the processors that have the set, for messages.
[[nodiscard]] const char* name_of(InstructionSet set);

/// For tests and benchmarks: while it exists, calls and new objects use at most `set`, on every thread. Within its
/// scope the machine appears to support no larger set. Scopes nest, on one thread at a time.
///
/// Requires: has_instruction_set(set).
class InstructionSetOverride {
 public:
  explicit InstructionSetOverride(InstructionSet set);
  ~InstructionSetOverride();
  InstructionSetOverride(const InstructionSetOverride&) = delete;
  InstructionSetOverride& operator=(const InstructionSetOverride&) = delete;

 private:
  InstructionSet before_;
};

}  // namespace quoin
