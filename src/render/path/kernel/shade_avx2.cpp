// The kernel for x86-64 processors with AVX2, BMI and BMI2; called only if the CPU has all of them.

#ifdef QUOIN_X86_KERNELS

#include "render/path/kernel/shade.inl"

namespace quoin::path {

const Kernel kAvx2Kernel = {&shade, &choose_lamps, &pairs};

}  // namespace quoin::path

#endif
