// The Surface Nets kernel for x86-64 processors with AVX-512 F, BW, DQ, VL and VBMI2; called only where all were found.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "mesh/smooth_cell.h"
#include "mesh/smooth_cell_occlusion.h"
#include "mesh/smooth_scratch.h"

#ifdef QUOIN_X86_KERNELS

#include <immintrin.h>

#if defined(__clang__)
#pragma clang attribute push(                                                                           \
        __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,avx2,bmi,bmi2,popcnt"))), \
            apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,avx2,bmi,bmi2,popcnt")
#endif

namespace quoin::smooth {
namespace {

#include "mesh/smooth_lanes_avx512.h"

#include "mesh/smooth_scalar.inl"

#include "mesh/smooth_vectors.inl"

void decode_row(const Half* from, float* to, int count) {
  for (int i = 0; i < count; i += kWidth) store(to + i, load_halves(from + i));
}

#include "mesh/smooth_points.inl"

#include "mesh/smooth_occlusion.inl"

#include "mesh/smooth_slices.inl"

}  // namespace

void mesh_avx512(Work& work, SmoothChunkMesh& out) {
  mesh_slices(work, out);
}

}  // namespace quoin::smooth

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

#endif
