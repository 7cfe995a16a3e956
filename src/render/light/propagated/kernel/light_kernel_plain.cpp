// The kernel for any processor.

#include "render/light/propagated/kernel/light_kernel.inl"
#include "render/light/propagated/kernel/slab_units.inl"

namespace quoin::propagated {

const Kernel kPlainKernel = {&spread,    &take_sky, &find_blocks, &find_rows,   &unpack,    &shift_in,
                             &read_slab, &merge,    &pack_slab,   &unpack_slab, &unpack_row};

#ifdef QUOIN_X86_KERNELS
constinit const KernelTable<Kernel> kKernels = {{&kPlainKernel, &kAvx2Kernel, &kAvx512Kernel, &kAvx512Kernel}};
#else
constinit const KernelTable<Kernel> kKernels = {{&kPlainKernel}};
#endif

}  // namespace quoin::propagated
