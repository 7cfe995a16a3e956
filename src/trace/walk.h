#pragma once

#include <optional>

#include <quoin/trace/ray.h>

namespace quoin::trace {

/// `first_hit` in double precision, one step at a time, for rays of any length in worlds of any size.
[[nodiscard]] std::optional<RayHit> walk_to_first_hit(const OccupancyTree& tree, const Ray& ray, double max_t);

/// The face that looks most against a direction; x before y before z.
[[nodiscard]] Direction facing(const DVec3& direction);

}  // namespace quoin::trace
