// The kernel of impostors for x86-64 processors with AVX-512 F, BW, DQ and VL; called only if the CPU has all of them.

#ifdef QUOIN_X86_KERNELS

#include "render/impostor/raster/raster.inl"

namespace quoin::raster {

const Draw kDrawAvx512 = draw_faces;

}  // namespace quoin::raster

#endif
