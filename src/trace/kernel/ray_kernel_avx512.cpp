// The kernel for x86-64 processors with AVX-512 F, BW, DQ and VL. Called only if the processor has all of them.

#include "trace/kernel/ray_kernel.h"

#ifdef QUOIN_X86_KERNELS

#include "trace/kernel/packet.inl"
#include "trace/kernel/ray_lanes_avx512.h"
#include "trace/kernel/short_ray.inl"
#include "trace/kernel/single.inl"

namespace quoin::trace {
namespace {

inline bool any_short_single(const TreeView& tree, const Ray& ray, double max_t, bool& unfinished) {
  // Tested first, since most rays are longer.
  const double length = std::abs(ray.direction.x) + std::abs(ray.direction.y) + std::abs(ray.direction.z);
  if (!(max_t * length <= kShortRayReach && max_t >= 0.0)) {
    return any_single<PathTracer>(tree, ray, max_t, unfinished);
  }
  const Blocked blocked = any_at_once(tree, ray, max_t, length);
  unfinished = false;
  // No branch on the hit itself, which is unpredictable.
  if (blocked.is_doubtful) [[unlikely]]
    return any_single<PathTracer>(tree, ray, max_t, unfinished);
  return blocked.is_sure;
}

}  // namespace

const Kernel kAvx512Kernel = {first_single<PathTracer>, any_short_single, trace_first, trace_any};

}  // namespace quoin::trace

#endif
