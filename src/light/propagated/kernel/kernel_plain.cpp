// The kernel for any processor.

#include "light/propagated/kernel/kernel.inl"

namespace quoin::propagated {

const Kernel kPlainKernel = {&spread, &take_sky, &find_blocks, &find_rows, &unpack, &shift_in, &read_slab, &merge};

}  // namespace quoin::propagated
