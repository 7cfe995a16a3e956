#pragma once

#include <optional>
#include <vector>

#include <quoin/core/axis_orientation.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// How the voxels of one grid lie in the lattice of another: turned or mirrored about the origin, then moved by whole
/// voxels. Points of the one are taken to points of the other.
struct LatticePlace {
  AxisOrientation orientation;
  IVec3 offset{0};

  [[nodiscard]] IBox apply(const IBox& box) const;
  [[nodiscard]] LatticePlace inverse() const;
};

/// How an instance's grid lies in the lattice of another's, if its voxels coincide with that lattice's, to a thousandth
/// of a voxel at every corner of the instance's voxels; else nothing.
[[nodiscard]] std::optional<LatticePlace> place_in_lattice(const Scene& scene, const Instance& lattice,
                                                           const Instance& instance);

/// An instance as one of several that make up one body.
struct LatticeMember {
  InstanceHandle instance;
  LatticePlace place;  ///< in the lattice of the first member
};

/// Groups of instances whose voxels lie on one lattice and whose boxes touch or overlap, or are connected by others
/// for which that holds; those that are alone are groups of one. Members are in the order of `instances`, groups in
/// that of their first members.
/// Requires: each instance has a place and a grid. Cost: O(n log n + pairs of boxes that overlap along one axis).
[[nodiscard]] std::vector<std::vector<LatticeMember>> lattice_groups(const Scene& scene,
                                                                     const std::vector<InstanceHandle>& instances);

}  // namespace quoin
