#include "scene/framing.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/scene/scene.h>

#include "scene/instance_axes.h"

namespace quoin {

namespace {

/// The dot product with a point of the grid is `offset + dot(slope, point)`.
struct Functional {
  double offset = 0.0;
  DVec3 slope{0.0};

  /// The greatest within a box.
  [[nodiscard]] double over(IVec3 min, IVec3 max) const {
    const DVec3 corner{slope.x > 0.0 ? max.x : min.x, slope.y > 0.0 ? max.y : min.y, slope.z > 0.0 ? max.z : min.z};
    return offset + glm::dot(slope, corner);
  }
};

struct Candidate {
  double bound;  ///< no voxel of the chunk reaches further
  const Chunk* chunk;
  IVec3 first;  ///< the chunk's first voxel in its grid
  Functional functional;
};

void add_candidates(const Instance& instance, const SceneGrid& grid, DVec3 direction, DVec3 middle,
                    std::vector<Candidate>& out) {
  Functional functional;
  functional.slope = glm::transpose(world_axes(instance)) * direction * instance.voxel_size;
  functional.offset = glm::dot(direction, instance.position - middle) - glm::dot(functional.slope, grid.pivot);
  for (const IVec3 coords : grid.grid.chunks()) {
    const Chunk* chunk = grid.grid.find_chunk(coords);
    const IVec3 first = coords * kChunkEdge;
    const IBox box = chunk->bounds();
    if (!box.empty()) out.push_back({functional.over(first + box.min, first + box.max), chunk, first, functional});
  }
}

/// The greatest over the voxels of a chunk, if that is more than `least`; else `least`.
double scan(const Candidate& candidate, double least) {
  const IBox box = candidate.chunk->bounds();
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      const IVec3 low = candidate.first + IVec3{box.min.x, y, z};
      const IVec3 high = candidate.first + IVec3{box.max.x, y + 1, z + 1};
      if (candidate.functional.over(low, high) <= least) continue;
      const std::uint64_t voxels = ~candidate.chunk->row_mask(y, z, kAir);
      if (voxels == 0) continue;
      const IVec3 first{candidate.first.x + std::countr_zero(voxels), low.y, low.z};
      const IVec3 last{candidate.first.x + kChunkEdge - std::countl_zero(voxels), high.y, high.z};
      least = std::max(least, candidate.functional.over(first, last));
    }
  }
  return least;
}

double reach_of(const Scene& scene, InstanceFilter filter, DVec3 direction, DVec3 middle) {
  std::vector<Candidate> candidates;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid* grid = scene.grids().find(instance.grid);
    if (grid == nullptr || !passes(filter, instance) || !has_place(instance)) continue;
    add_candidates(instance, *grid, direction, middle, candidates);
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.bound > b.bound; });
  double greatest = -std::numeric_limits<double>::infinity();
  for (const Candidate& candidate : candidates) {
    if (candidate.bound <= greatest) break;
    greatest = scan(candidate, greatest);
  }
  return greatest;
}

}  // namespace

Camera frame_scene(const Scene& scene, View view, double aspect, InstanceFilter filter) {
  const DBox bounds = scene.bounds(filter);
  if (bounds.empty()) return frame_view(bounds, view, aspect);
  const DVec3 middle = bounds.min + 0.5 * (bounds.max - bounds.min);
  const auto reach = [&](DVec3 direction) { return reach_of(scene, filter, direction, middle); };
  return frame(middle, reach, view, aspect);
}

}  // namespace quoin
