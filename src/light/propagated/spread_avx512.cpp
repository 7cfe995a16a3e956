// The pass for x86-64 processors with AVX-512 F, BW, DQ and VL; called only where all were found.

#ifdef QUOIN_X86_KERNELS

#include "light/propagated/spread.inl"

namespace quoin::propagated {

const SpreadKernel kSpreadAvx512{spread, replace};

}  // namespace quoin::propagated

#endif
