// The kernel for x86-64 processors with AVX2, BMI and BMI2. Called only if the processor has all of them.

#include "trace/kernel/ray_kernel.h"

#ifdef QUOIN_X86_KERNELS

#include "trace/kernel/packet.inl"
#include "trace/kernel/single.inl"

namespace quoin::trace {

const Kernel kAvx2Kernel = {first_single<PathTracer>, any_single<PathTracer>, trace_first, trace_any};

}  // namespace quoin::trace

#endif
