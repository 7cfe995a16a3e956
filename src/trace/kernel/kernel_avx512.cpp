// The kernel for x86-64 processors with AVX-512 F, BW, DQ and VL; called only where all were found.

#include "trace/kernel/kernel.h"

#ifdef QUOIN_X86_KERNELS

#include "trace/kernel/packet.inl"
#include "trace/kernel/single.inl"
#include "trace/kernel/single_short.inl"

namespace quoin::trace {

const Kernel kAvx512Kernel = {first_single<PathTracer>, any_short_single, trace_first, trace_any};

}  // namespace quoin::trace

#endif
