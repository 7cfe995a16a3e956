// The Surface Nets kernel for x86-64 processors with AVX-512 F, BW, DQ, VL and VBMI2. Called only if the processor has
// all of them.

#ifdef QUOIN_X86_KERNELS

#include "mesh/smooth/occlusion_lanes.inl"
#include "mesh/smooth/slices.inl"
#include "mesh/smooth/vectors.inl"

namespace quoin::smooth {

void mesh_avx512(Work& work, SmoothChunkMesh& out) {
  mesh_slices(work, out);
}

void occlude_avx512(Work& work, int z, std::size_t count, float* occlusion) {
  Slice slice;
  slice.z = z;
  add_occlusion(work, slice, count, occlusion);
}

}  // namespace quoin::smooth

#endif
