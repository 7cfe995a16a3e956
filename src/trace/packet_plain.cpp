// The kernel of rays in lockstep for any processor.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "trace/tree_view.h"

namespace quoin::trace {
namespace {

#include "trace/lanes_plain.h"

#include "trace/kernel.inl"

#include "trace/single.inl"

#include "trace/single_hit.inl"

#include "trace/short.inl"

}  // namespace

const Kernel kPlainKernel = {first_single, any_single, trace_first, trace_any};

}  // namespace quoin::trace
