// The kernel of rays in lockstep for x86-64 processors with AVX2, BMI and BMI2; called only where all were found.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "trace/tree_view.h"

#ifdef QUOIN_X86_KERNELS

#include <immintrin.h>

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,bmi,bmi2,popcnt"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,bmi,bmi2,popcnt")
#endif

namespace quoin::trace {
namespace {

#include "trace/lanes_avx2_pair.h"

#include "trace/kernel_common.inl"

#include "trace/lockstep_setup.inl"

#include "trace/floor_x86.inl"

#include "trace/single.inl"

#include "trace/path_ray.inl"

#include "trace/path_units.inl"

#include "trace/path_avx2.inl"

#include "trace/path_walk.inl"

#include "trace/lockstep.inl"

#include "trace/beam_paths.inl"

#include "trace/beam.inl"

#include "trace/packet_hits.inl"

#include "trace/single_hit.inl"

#include "trace/lockstep_short.inl"

}  // namespace

const Kernel kAvx2Kernel = {first_single, any_single, trace_first, trace_any};

}  // namespace quoin::trace

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

#endif
