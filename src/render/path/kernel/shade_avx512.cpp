// The kernel for x86-64 processors with AVX-512 F, BW, DQ and VL; called only if the CPU has all of them.

#ifdef QUOIN_X86_KERNELS

#include "render/path/kernel/shade.inl"

namespace quoin::path {

const Kernel kAvx512Kernel = {&shade, &choose_lamps, &pairs};

}  // namespace quoin::path

#endif
