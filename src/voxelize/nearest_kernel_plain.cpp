// The kernel for any CPU.

#include "voxelize/nearest_kernel.inl"

namespace quoin::voxelizing {

const Kernel kPlainKernel = {&update_row};

#ifdef QUOIN_X86_KERNELS
constinit const KernelTable<Kernel> kKernels = {{&kPlainKernel, &kAvx2Kernel, &kAvx512Kernel, &kAvx512Kernel}};
#else
constinit const KernelTable<Kernel> kKernels = {{&kPlainKernel}};
#endif

}  // namespace quoin::voxelizing
