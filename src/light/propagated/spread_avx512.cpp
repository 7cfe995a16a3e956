// The pass for x86-64 processors with AVX-512 F, BW, DQ and VL; called only where all were found.

#ifdef QUOIN_X86_KERNELS

#include "light/propagated/spread.inl"

namespace quoin::propagated {

const Spread kSpreadAvx512 = spread;

}  // namespace quoin::propagated

#endif
