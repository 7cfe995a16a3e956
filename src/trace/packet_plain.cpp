// The kernel of rays in lockstep for any processor.

#include <bit>
#include <cmath>

#include "trace/tree_view.h"

namespace quoin::trace {
namespace {

#include "trace/lanes_plain.h"

#include "trace/kernel.inl"

}  // namespace

const Kernel kPlainKernel = {trace_first, trace_any};

}  // namespace quoin::trace
