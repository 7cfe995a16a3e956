// The mesher's kernel for x86-64 processors with AVX2, BMI and BMI2; called only where all were found.

#include "grid/packed_row.h"
#include "mesh/blocky_scratch.h"

#ifdef QUOIN_X86_KERNELS

#include <algorithm>

#include <immintrin.h>

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,bmi,bmi2,popcnt"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,bmi,bmi2,popcnt")
#endif

#define QUOIN_KERNEL avx2
#define QUOIN_KERNEL_AVX2 1
#define QUOIN_KERNEL_AVX512 0
#include "mesh/blocky_kernel.inl"

namespace quoin::blocky {

void mesh_avx2(const Job& job, Scratch& scratch, QuadBuffer& out) {
  avx2::mesh_chunk(job, scratch, out);
}

void find_faces_avx2(const Job& job, Scratch& scratch) {
  avx2::find_all_faces(job, scratch);
}

}  // namespace quoin::blocky

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

#endif
