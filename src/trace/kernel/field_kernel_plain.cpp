// Rays in fields for any processor, one at a time: the walk of trace/kernel/field_walk.inl.

#include "trace/kernel/field_walk.inl"
#include "trace/kernel/kernel.h"

namespace quoin::trace {

bool walk_in_field(const OccupancyTree& cells, const FieldView& field, const Ray& ray, double max_t, bool asks_where,
                   FieldHit& hit) {
  const std::optional<FieldHit> found = asks_where ? SurfaceWalk<true>(cells, field, ray, max_t).find()
                                                   : SurfaceWalk<false>(cells, field, ray, max_t).find();
  if (found) hit = *found;
  return found.has_value();
}

const FieldKernel kPlainFieldKernel = {nullptr, nullptr, nullptr, nullptr};

}  // namespace quoin::trace
