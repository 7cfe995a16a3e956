#include "scene/framing.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>
#include <quoin/scene/scene.h>

#include "scene/instance_axes.h"

namespace quoin {

namespace {

/// The dot product with a point of the grid is `offset + dot(slope, point)`.
struct Functional {
  double offset = 0.0;
  DVec3 slope{0.0};

  /// Returns the maximum within a box.
  [[nodiscard]] double over(IVec3 min, IVec3 max) const {
    const DVec3 corner{slope.x > 0.0 ? max.x : min.x, slope.y > 0.0 ? max.y : min.y, slope.z > 0.0 ? max.z : min.z};
    return offset + glm::dot(slope, corner);
  }
};

struct Candidate {
  double bound;  ///< upper bound of the chunk's reach
  const Chunk* voxels;
  const DensityChunk* samples;  ///< if there are no voxels
  IVec3 first;                  ///< the chunk's first voxel or sample in its grid
  IBox box;                     ///< box of the counted voxels or samples, in chunk coordinates
  Functional functional;

  [[nodiscard]] std::uint64_t row(int y, int z) const {
    QUOIN_ASSERT((samples == nullptr) != (voxels == nullptr), "either voxels or samples");
    return samples == nullptr ? ~voxels->row_mask(y, z, kAir) : samples->solid_row(y, z);
  }
  /// For fields, the solid around a sample begins after the previous sample on each axis.
  [[nodiscard]] int margin() const { return samples == nullptr ? 0 : 1; }
  [[nodiscard]] double over(IVec3 min, IVec3 max) const { return functional.over(min - margin(), max); }
};

void add_candidates(const Instance& instance, const SceneGrid& grid, DVec3 direction, DVec3 middle,
                    std::vector<Candidate>& out) {
  Functional functional;
  functional.slope = glm::transpose(world_axes(instance)) * direction * instance.voxel_size;
  functional.offset = glm::dot(direction, instance.position - middle) - glm::dot(functional.slope, grid.pivot);
  for (const IVec3 coords : grid.grid.chunks()) {
    const Chunk* chunk = grid.grid.find_chunk(coords);
    const IVec3 first = coords * kChunkEdge;
    Candidate candidate{0.0, chunk, nullptr, first, chunk->bounds(), functional};
    candidate.bound = candidate.over(first + candidate.box.min, first + candidate.box.max);
    if (!candidate.box.empty()) out.push_back(candidate);
  }
  for (const IVec3 coords : grid.field.chunks()) {
    const IVec3 first = coords * kChunkEdge;
    Candidate candidate{0.0, nullptr, grid.field.find_chunk(coords), first, kWholeChunk, functional};
    candidate.bound = candidate.over(first, first + kChunkEdge);
    out.push_back(candidate);
  }
}

/// Returns the maximum over a chunk's contents, or `least` if that is greater.
double scan(const Candidate& candidate, double least) {
  const IBox& box = candidate.box;
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      const IVec3 low = candidate.first + IVec3{box.min.x, y, z};
      const IVec3 high = candidate.first + IVec3{box.max.x, y + 1, z + 1};
      if (candidate.over(low, high) <= least) continue;
      const std::uint64_t row = candidate.row(y, z);
      if (row == 0) continue;
      const IVec3 first{candidate.first.x + std::countr_zero(row), low.y, low.z};
      const IVec3 last{candidate.first.x + kChunkEdge - std::countl_zero(row), high.y, high.z};
      least = std::max(least, candidate.over(first, last));
    }
  }
  return least;
}

double reach_of(const Scene& scene, InstanceFilter filter, DVec3 direction, DVec3 middle) {
  std::vector<Candidate> candidates;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid* grid = scene.grids().find(instance.grid);
    if (grid == nullptr || !passes(filter, scene, instance) || !has_valid_transform(instance)) continue;
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

namespace {

/// Rotates to the right as seen from the front: +Z towards +X.
DVec3 turned(DVec3 v, int turn, int turns) {
  QUOIN_ASSERT(turns > 0, "a positive number of turns");
  const double angle = 2.0 * std::numbers::pi * turn / turns;
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  return {c * v.x + s * v.z, v.y, c * v.z - s * v.x};
}

}  // namespace

SceneFraming::SceneFraming(DVec3 forward, double aspect, int turns)
    : forward_(forward), aspect_(aspect), turns_(turns) {
  QUOIN_ASSERT(std::abs(glm::length(forward) - 1.0) < 1e-6, "a unit direction");
  QUOIN_ASSERT(aspect > 0.0 && std::isfinite(aspect), "a positive, finite aspect");
  QUOIN_ASSERT(turns > 0, "a positive number of turns");
  reaches_.fill(-std::numeric_limits<double>::infinity());
}

void SceneFraming::add(const Scene& scene, InstanceFilter filter) {
  const DBox bounds = scene.bounds(filter);
  if (bounds.empty()) return;
  if (!middle_) middle_ = bounds.min + 0.5 * (bounds.max - bounds.min);
  const std::array<DVec3, 4> directions = framing_directions(forward_, aspect_);
  for (int turn = 0; turn < turns_; ++turn) {
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const double reach = reach_of(scene, filter, turned(directions[i], turn, turns_), *middle_);
      reaches_[i] = std::max(reaches_[i], reach);
    }
  }
}

Camera SceneFraming::camera(int turn) const {
  QUOIN_ASSERT(turn >= 0 && turn < turns_, "one of the turns");
  const DVec3 middle = middle_.value_or(DVec3(0.5));
  std::size_t asked = 0;
  const auto reach = [&](DVec3 direction) {
    QUOIN_ASSERT(asked < reaches_.size(), "a reach is asked of four directions");
    const double of_cube = 0.5 * (std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z));
    return middle_ ? reaches_[asked++] : of_cube;
  };
  Camera camera = frame(middle, reach, forward_, aspect_);
  camera.position = middle + turned(camera.position - middle, turn, turns_);
  for (DVec3* axis : {&camera.right, &camera.up, &camera.forward}) *axis = turned(*axis, turn, turns_);
  return camera;
}

}  // namespace quoin
