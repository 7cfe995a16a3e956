// The kernel for x86-64 processors with AVX2, BMI and BMI2; called only if the CPU has all of them.

#ifdef QUOIN_X86_KERNELS

#include "voxelize/nearest_kernel.inl"

namespace quoin::voxelizing {

const Kernel kAvx2Kernel = {&update_row};

}  // namespace quoin::voxelizing

#endif
