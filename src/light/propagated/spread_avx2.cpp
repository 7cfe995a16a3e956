// The pass for x86-64 processors with AVX2; called only where it was found.

#ifdef QUOIN_X86_KERNELS

#include "light/propagated/spread.inl"

namespace quoin::propagated {

const SpreadKernel kSpreadAvx2{spread, replace};

}  // namespace quoin::propagated

#endif
