// The kernel for x86-64 processors with AVX-512; called only if the CPU has all of them.

#ifdef QUOIN_X86_KERNELS

#include "voxelize/nearest_kernel.inl"

namespace quoin::voxelizing {

const Kernel kAvx512Kernel = {&update_row};

}  // namespace quoin::voxelizing

#endif
