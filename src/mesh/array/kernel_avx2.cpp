// The kernel for x86-64 processors with AVX2, BMI and BMI2; called only where all were found.

#include "mesh/array/kernel.h"

#ifdef QUOIN_X86_KERNELS

#include "mesh/array/table.inl"
#include "mesh/array/vertices.inl"

namespace quoin::array {

const Kernel kAvx2Kernel = make_kernel();

}  // namespace quoin::array

#endif
