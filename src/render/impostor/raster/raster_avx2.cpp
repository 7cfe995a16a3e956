// The kernel of impostors for x86-64 processors with AVX2, BMI and BMI2; called only if the CPU has all of them.

#ifdef QUOIN_X86_KERNELS

#include "render/impostor/raster/raster.inl"

namespace quoin::raster {

const Draw kDrawAvx2 = draw_faces;

}  // namespace quoin::raster

#endif
