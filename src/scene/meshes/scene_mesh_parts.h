#pragma once

// Shared parts of blocky and smooth scene meshes.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/axis_orientation.h>
#include <quoin/core/progress.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_meshes.h>

namespace quoin {

/// Checks the drawn instances. Errors: InvalidArgument, naming the first instance with an invalid placement.
[[nodiscard]] Status check_instances(const Scene& scene, InstanceFilter filter);

/// Returns an instance's transform from points relative to its grid's pivot to the world, with a unit rotation.
[[nodiscard]] Similarity similarity_of(const Instance& instance);

/// Places instances, and takes the groups above them into the meshes.
class MeshHierarchy {
 public:
  MeshHierarchy(const Scene& scene, SceneMeshes& meshes) : scene_(scene), meshes_(meshes) {}
  /// Returns the placement of an instance for a part.
  [[nodiscard]] MeshPlacement place(InstanceHandle handle, std::size_t part);

 private:
  [[nodiscard]] std::optional<std::size_t> group_of(GroupHandle handle);
  [[nodiscard]] std::string layer_name(LayerHandle handle) const;

  const Scene& scene_;
  SceneMeshes& meshes_;
  std::map<GroupHandle, std::size_t> groups_;
};

/// The surfaces of one grid: opaque, then all transparent.
using SmoothBodies = std::array<SmoothMesh, 2>;

/// Appends the vertices and triangles of a mesh to another. If the other has no triangles, `more` replaces it.
void append(SmoothMesh& all, SmoothMesh more);

/// Creates a part from the non-empty surfaces of a grid.
[[nodiscard]] MeshPart part_of_bodies(std::string name, SmoothBodies bodies, const DVec3& pivot);

struct SurfaceOptions {
  const SmoothMeshOptions& mesh;
  std::optional<float> simplify_error;
};

/// Meshes a field, simplifies the mesh if requested, and counts the result.
[[nodiscard]] Result<SmoothMesh> surface_of(const DensityGrid& field, const VoxelRegistry& types,
                                            const SurfaceOptions& wanted, MeshStats& stats, Threads threads,
                                            const Progress& progress);

/// Simplifies a mesh if an error is given, and keeps the vertices' `tags` (may be empty) in step. Counts the result.
[[nodiscard]] Status simplify_and_count(SmoothMesh& mesh, std::optional<float> error, std::vector<std::uint32_t>& tags,
                                        MeshStats& stats);

/// Adds a part for each grid's field with a surface, and its placements: those of the grid's instances, in their order.
/// Each transparent material is a separate closed body; bodies meet as in images.
[[nodiscard]] Status add_fields(const Scene& scene, const std::vector<GridHandle>& grids, InstanceFilter filter,
                                const SurfaceOptions& wanted, MeshHierarchy& hierarchy, SceneMeshes& meshes,
                                Threads threads, const Progress& progress);

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
