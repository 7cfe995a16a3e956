// The kernel for x86-64 processors with AVX2, BMI and BMI2. Called only if the processor has all of them.

#include "mesh/array/array_kernel.h"

#ifdef QUOIN_X86_KERNELS

#include "mesh/array/array_kernel.inl"
#include "mesh/array/vertices.inl"

namespace quoin::array {

const Kernel kAvx2Kernel = make_kernel();

}  // namespace quoin::array

#endif
