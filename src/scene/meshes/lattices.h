#pragma once

#include <optional>
#include <vector>

#include <quoin/core/axis_orientation.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// The placement of one grid's voxels in the lattice of another: rotated or mirrored about the origin, then moved by
/// whole voxels. Maps points of the first grid to points of the second.
struct LatticePlace {
  AxisOrientation orientation;
  IVec3 offset{0};

  [[nodiscard]] IBox apply(const IBox& box) const;
  [[nodiscard]] LatticePlace inverse() const;
};

/// Returns the placement of an instance's grid in the lattice of another's. Returns nothing if a corner of the
/// instance's voxels is more than a thousandth of a voxel off the lattice.
[[nodiscard]] std::optional<LatticePlace> place_in_lattice(const Scene& scene, const Instance& lattice,
                                                           const Instance& instance);

/// One of several instances that form one body.
struct LatticeMember {
  InstanceHandle instance;
  LatticePlace place;  ///< in the lattice of the first member
};

/// Groups instances whose voxels lie on one lattice and whose boxes touch or overlap, directly or through other
/// members. An instance without such a neighbour is a group by itself. Members are in the order of `instances`, groups
/// in the order of their first members.
/// Requires: each instance has a place and a grid. Cost: O(n log n + pairs of boxes that overlap along one axis).
[[nodiscard]] std::vector<std::vector<LatticeMember>> lattice_groups(const Scene& scene,
                                                                     const std::vector<InstanceHandle>& instances);

}  // namespace quoin
