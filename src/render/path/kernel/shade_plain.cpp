// The kernel for any CPU.

#include "render/path/kernel/shade.inl"

namespace quoin::path {

const Kernel kPlainKernel = {&shade, &choose_lamps, &pairs};

#ifdef QUOIN_X86_KERNELS
constinit const KernelTable<Kernel> kKernels = {{&kPlainKernel, &kAvx2Kernel, &kAvx512Kernel, &kAvx512Kernel}};
#else
constinit const KernelTable<Kernel> kKernels = {{&kPlainKernel}};
#endif

}  // namespace quoin::path
