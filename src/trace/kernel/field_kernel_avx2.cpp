// Rays in fields for x86-64 processors with AVX2, BMI and BMI2. Called only if the processor has all of them.

#include "trace/kernel/ray_kernel.h"

#ifdef QUOIN_X86_KERNELS

#include "trace/kernel/field.inl"

namespace quoin::trace {

const FieldKernel kAvx2FieldKernel = {first_in_field<true>, first_in_field<false>, first_hits_in_field,
                                      any_hits_in_field};

}  // namespace quoin::trace

#endif
