// The kernel of impostors for x86-64 processors with AVX2, BMI and BMI2; called only where all were found.

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "render/impostor_raster.h"

#ifdef QUOIN_X86_KERNELS

#include <immintrin.h>

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,bmi,bmi2,popcnt"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,bmi,bmi2,popcnt")
#endif

namespace quoin::raster {
namespace {

#include "core/lanes_avx2.h"

#include "render/impostor_raster.inl"

}  // namespace

const Draw kDrawAvx2 = draw_faces;

}  // namespace quoin::raster

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

#endif
