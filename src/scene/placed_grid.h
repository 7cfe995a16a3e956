#pragma once

#include <quoin/core/vec.h>
#include <quoin/scene/scene_tracer.h>

namespace quoin {

/// Whether rays meet an instance of this grid, which may be null: see SceneTracer.
[[nodiscard]] bool can_be_traced(const Instance& instance, const SceneGrid* grid, bool hidden);

/// The instance's place; its trees are not set. Requires: it can be traced.
[[nodiscard]] PlacedGrid placed_as(const Scene& scene, InstanceHandle handle);

/// Around its voxels in the world, with room for rounding.
[[nodiscard]] DBox bounds_of(const PlacedGrid& placed);

}  // namespace quoin
