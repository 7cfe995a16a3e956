// The kernel for x86-64 processors with AVX-512 F, BW, DQ and VL; called only after all were detected.

#ifdef QUOIN_X86_KERNELS

#include "render/light/propagated/kernel/light_kernel.inl"
#include "render/light/propagated/kernel/slab_units.inl"

namespace quoin::propagated {

const Kernel kAvx512Kernel = {&spread,    &take_sky, &find_blocks, &find_rows,   &unpack,    &shift_in,
                              &read_slab, &merge,    &pack_slab,   &unpack_slab, &unpack_row};

}  // namespace quoin::propagated

#endif
