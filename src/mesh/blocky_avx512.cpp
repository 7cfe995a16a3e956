// The mesher's kernel for x86-64 processors with AVX-512 F, BW, DQ, VL, VBMI, VBMI2, VPOPCNTDQ and GFNI; called only
// where all were found.

#include "grid/packed_row.h"
#include "mesh/blocky_scratch.h"

#ifdef QUOIN_X86_KERNELS

#include <algorithm>
#include <array>

#include <immintrin.h>

#if defined(__clang__)
#pragma clang attribute push(                                                                                             \
        __attribute__((target(                                                                                            \
                "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi,avx512vbmi2,avx512vpopcntdq,gfni,avx2,bmi,bmi2,popcnt"))), \
            apply_to = function)
#else
#pragma GCC push_options
// GCC 12's own header reads what it leaves undefined on purpose (GCC bug 105593).
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC target( \
        "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi,avx512vbmi2,avx512vpopcntdq,gfni,avx2,bmi,bmi2,popcnt")
#endif

#define QUOIN_KERNEL avx512
#define QUOIN_KERNEL_AVX2 1
#define QUOIN_KERNEL_AVX512 1
#include "mesh/blocky_kernel.inl"

namespace quoin::blocky {

void mesh_avx512(const Job& job, Scratch& scratch, QuadBuffer& out) {
  avx512::mesh_chunk(job, scratch, out);
}

void find_faces_avx512(const Job& job, Scratch& scratch) {
  avx512::find_all_faces(job, scratch);
}

}  // namespace quoin::blocky

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

#endif
