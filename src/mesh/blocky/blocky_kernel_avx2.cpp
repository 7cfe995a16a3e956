// The mesher's kernel for x86-64 processors with AVX2, BMI and BMI2. Called only if the processor has all of them.

#ifdef QUOIN_X86_KERNELS

#include "mesh/blocky/blocky_kernel.inl"

namespace quoin::blocky {

void mesh_avx2(const Job& job, Scratch& scratch, QuadBuffer& out) {
  mesh_chunk(job, scratch, out);
}

void find_faces_avx2(const Job& job, Scratch& scratch) {
  find_all_faces(job, scratch);
}

std::int64_t count_faces_avx2(const Job& job, Scratch& scratch) {
  return count_all_faces(job, scratch);
}

}  // namespace quoin::blocky

#endif
