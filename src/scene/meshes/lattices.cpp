#include "scene/meshes/lattices.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include <quoin/core/assert.h>

namespace quoin {

namespace {

/// The maximum distance of a voxel corner from the lattice, in voxels.
constexpr double kTolerance = 1e-3;
/// Larger coordinates are ignored, because their sums would overflow.
constexpr double kFarthest = 1 << 29;

DBox world_box(const SceneGrid& grid, const Instance& instance) {
  DBox box;
  const IBox bounds = grid.grid.bounds();
  for (int i = 0; i < 8; ++i) box.extend(world_from_grid(instance, grid, box_corner(bounds, i)));
  return box;
}

/// A union-find structure over numbers.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }

  std::size_t find(std::size_t i) {
    QUOIN_ASSERT(i < parent_.size(), "one of the numbers");
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// Unites two sets. The least number of a set represents it.
  void unite(std::size_t a, std::size_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> parent_;
};

class Grouping {
 public:
  Grouping(const Scene& scene, const std::vector<InstanceHandle>& instances)
      : scene_(scene), instances_(instances), sets_(instances.size()) {
    for (const InstanceHandle handle : instances) {
      QUOIN_ASSERT(has_valid_transform(instance_of(handle)), "instances with a finite transform");
      boxes_.push_back(world_box(grid_of(handle), instance_of(handle)));
    }
  }

  std::vector<std::vector<LatticeMember>> find() {
    unite_those_that_touch();
    std::vector<std::vector<LatticeMember>> groups;
    std::vector<std::size_t> group_of(instances_.size());
    for (std::size_t i = 0; i < instances_.size(); ++i) {
      const std::size_t first = sets_.find(i);
      QUOIN_ASSERT(first <= i, "the least number represents a set");
      if (first != i) {
        // Relative to the first member. Small errors can add up over many neighbours. An instance with a larger total
        // error becomes a group by itself.
        const auto place = place_in_lattice(scene_, instance_of(instances_[first]), instance_of(instances_[i]));
        if (place) {
          groups[group_of[first]].push_back({instances_[i], *place});
          continue;
        }
      }
      group_of[i] = groups.size();
      groups.push_back({{instances_[i], {}}});
    }
    return groups;
  }

 private:
  [[nodiscard]] const Instance& instance_of(InstanceHandle handle) const { return scene_.instances()[handle]; }
  [[nodiscard]] const SceneGrid& grid_of(InstanceHandle handle) const {
    return scene_.grids()[instance_of(handle).grid];
  }

  /// Sweeps along the axis of the largest spread.
  void unite_those_that_touch() {
    DBox all;
    for (const DBox& box : boxes_) {
      all.extend(box.min);
      all.extend(box.max);
    }
    int axis = 0;
    for (int other = 1; other < 3; ++other) {
      if (all.max[other] - all.min[other] > all.max[axis] - all.min[axis]) axis = other;
    }
    std::vector<std::size_t> order(instances_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return boxes_[i].min[axis]; });
    std::vector<std::size_t> open;
    for (const std::size_t i : order) {
      const double begin = boxes_[i].min[axis];
      std::erase_if(open, [&](std::size_t k) { return boxes_[k].max[axis] + margin(k) < begin; });
      for (const std::size_t k : open) {
        if (sets_.find(i) != sets_.find(k) && touch(std::min(i, k), std::max(i, k))) sets_.unite(i, k);
      }
      open.push_back(i);
    }
  }

  /// Half a voxel: more than rounding, less than a gap.
  [[nodiscard]] double margin(std::size_t i) const { return 0.5 * instance_of(instances_[i]).voxel_size; }

  [[nodiscard]] bool touch(std::size_t a, std::size_t b) const {
    const double more = margin(a);
    for (int axis = 0; axis < 3; ++axis) {
      if (boxes_[a].max[axis] + more < boxes_[b].min[axis] || boxes_[b].max[axis] + more < boxes_[a].min[axis]) {
        return false;
      }
    }
    const auto place = place_in_lattice(scene_, instance_of(instances_[a]), instance_of(instances_[b]));
    if (!place) return false;
    IBox near = grid_of(instances_[a]).grid.bounds();
    near.min -= 1;
    near.max += 1;
    return !intersect(near, place->apply(grid_of(instances_[b]).grid.bounds())).empty();
  }

  const Scene& scene_;
  const std::vector<InstanceHandle>& instances_;
  std::vector<DBox> boxes_;  // in the world
  Sets sets_;
};

}  // namespace

IBox LatticePlace::apply(const IBox& box) const {
  const IVec3 a = orientation.apply(box.min) + offset;
  const IVec3 b = orientation.apply(box.max) + offset;
  return {glm::min(a, b), glm::max(a, b)};
}

LatticePlace LatticePlace::inverse() const {
  const AxisOrientation back = orientation.inverse();
  return {back, -back.apply(offset)};
}

std::optional<LatticePlace> place_in_lattice(const Scene& scene, const Instance& lattice, const Instance& instance) {
  const SceneGrid& own = scene.grids()[lattice.grid];
  const SceneGrid& other = scene.grids()[instance.grid];
  if (!(std::abs(lattice.voxel_size - instance.voxel_size) <= kTolerance * lattice.voxel_size)) return std::nullopt;
  const auto moved = [&](DVec3 point) {
    return grid_from_world(lattice, own, world_from_grid(instance, other, point));
  };
  const IBox box = other.grid.bounds();
  const DVec3 origin = moved(DVec3(box.min));
  glm::dmat3 axes(1.0);
  for (int axis = 0; axis < 3; ++axis) axes[axis] = moved(DVec3(box.min) + axes[axis]) - origin;
  const auto orientation = AxisOrientation::near_matrix(axes, 0.1);
  if (!orientation) return std::nullopt;
  LatticePlace place{*orientation};
  const DVec3 whole = glm::round(origin - place.orientation.apply(DVec3(box.min)));
  const IBox lattice_box = own.grid.bounds();
  const auto is_near = [](DVec3 point) {
    return std::max({std::abs(point.x), std::abs(point.y), std::abs(point.z)}) < kFarthest;
  };
  for (const DVec3 point : {whole, origin, moved(DVec3(box.max)), DVec3(lattice_box.min), DVec3(lattice_box.max),
                            DVec3(box.min), DVec3(box.max)}) {
    if (!is_near(point)) return std::nullopt;
  }
  place.offset = IVec3(whole);
  for (int corner = 0; corner < 8; ++corner) {
    const DVec3 at = box_corner(box, corner);
    const DVec3 off = moved(at) - (place.orientation.apply(at) + DVec3(place.offset));
    if (!(std::max({std::abs(off.x), std::abs(off.y), std::abs(off.z)}) < kTolerance)) return std::nullopt;
  }
  return place;
}

std::vector<std::vector<LatticeMember>> lattice_groups(const Scene& scene,
                                                       const std::vector<InstanceHandle>& instances) {
  return Grouping(scene, instances).find();
}

}  // namespace quoin
