#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/voxelize/triangle_mesh.h>

namespace quoin {

/// Where the voxels of a mesh lie: voxel (i, j, k) is the cube from `origin + voxel_size * (i, j, k)` to one further.
struct VoxelLattice {
  DVec3 origin{0.0};        ///< in the mesh's unit
  double voxel_size = 1.0;  ///< likewise

  [[nodiscard]] DVec3 grid_from_mesh(DVec3 point) const { return (point - origin) / voxel_size; }
};

/// A lattice in which the mesh's longest side takes `voxels`, from voxel (0, 0, 0) on: the mesh lies in the middle of
/// as many voxels as hold it along each axis. Along the longest its outermost points are a thousandth of a voxel from
/// the sides, so that what is flat there lies in one layer, not between two.
///
/// Errors: InvalidArgument where `voxels` is not positive or the mesh has no triangle; LimitExceeded beyond 2^14.
[[nodiscard]] Result<VoxelLattice> lattice_of_size(const TriangleMesh& mesh, int voxels);
/// A lattice whose voxels have this size and which the mesh's origin is a corner of, so that meshes of one space fit
/// together. Its own origin is a whole number of voxels from there, at or below the mesh's least corner.
///
/// Errors: InvalidArgument where the size is not positive and finite or the mesh has no triangle; LimitExceeded where
///         its longest side has more than 2^14 voxels.
[[nodiscard]] Result<VoxelLattice> lattice_of_voxel(const TriangleMesh& mesh, double voxel_size);

/// Which voxels a surface takes.
enum class SurfaceVoxels : std::uint8_t {
  None,
  /// 6-separating, thin: voxels with a point of the surface on one of the three lines through their centre, from face
  /// to face. No path from voxel to voxel through faces crosses a closed surface. Where the surface lies between two
  /// voxels it takes the one on its inner side (of an open surface the greater one), so that a cube whose sides lie
  /// between voxels has the voxels within it and no more. Where it lies on centres it takes all voxels that it passes:
  /// a cube from 0.5 to 3.5 has 4 voxels along each side. Tips and pieces that no such line meets are left out, with a
  /// warning.
  Separating6,
  /// 26-separating, thick: voxels whose closed cube has a point of the surface, so that no path through edges and
  /// corners crosses it either. Where the surface lies between voxels it takes all of them.
  Separating26,
};

/// Which voxels are within a mesh.
enum class SolidVoxels : std::uint8_t {
  None,
  /// Those whose centre has a winding number of more than one half, either way: how often the surface goes round it, as
  /// the mean of what six rays along the axes meet, each triangle counted by the side it is met from. What crosses
  /// itself is one solid, holes are bridged, and whole parts may be turned inside out; a shell within another that is
  /// turned the other way is a cavity.
  Winding,
  /// Those from whose centre most of the six rays meet an odd number of triangles: for meshes whose triangles face any
  /// way. What two parts share counts as outside, and so does what one encloses within another.
  Parity,
};

struct VoxelizeOptions {
  VoxelLattice lattice{};
  SurfaceVoxels surface = SurfaceVoxels::Separating6;
  SolidVoxels solid = SolidVoxels::Winding;
  std::size_t max_types = kMaxVoxelTypes;  ///< that are added, at most
};

/// Voxels of a mesh, and what was noticed.
struct VoxelizedMesh {
  Grid grid;
  std::vector<std::string> warnings;  ///< one line each
};

/// The voxels of a mesh: its surface, what it encloses, or both.
///
/// Space:    voxels of `options.lattice`; only those around the mesh's bounds are asked.
/// Exact:    what lines through centres meet is found by a rule that gives a point on a shared edge to exactly one of
///           its triangles, so that closed meshes have no leaks; a centre on the surface counts as its greater side.
/// Colours:  of a voxel within 1.25 of the surface, that of the surface's nearest point: material times texture times
///           vertices, in linear light; of a texture the mean of what a voxel covers (a level of halved pictures,
///           between pixels bilinear). Deeper voxels take the mean colour of the surface, of
///           a mesh of one material and at most 256 colours the nearest of these.
/// Cut-outs: where alpha says there is no surface a surface voxel is left out; what is enclosed stays.
/// Types:    one for each colour and material is added to `types`. Where there are more than `max_types`, or than there
///           can be, near colours become one (median cut), with a warning.
/// Order:    the same voxels and types at any thread count.
/// Memory:   some 60 bytes a triangle, 12 bytes for each voxel of the surface, 32 for each chunk of the mesh's box,
///           1 MiB a thread, the grid.
/// Cost:     about 0.2 s for 70,000 triangles in 512^3 on one thread, 1 s with colours.
/// Errors:   those of check_mesh; InvalidArgument for a lattice without a size; LimitExceeded beyond 2^14 voxels along
///           an axis, 2^32 crossings of lines, or types; Cancelled.
/// Source:   the test of cube and triangle: M. Schwarz, H.-P. Seidel, "Fast Parallel Surface and Solid Voxelization on
///           GPUs" (2010). What separates: S. Laine, "A Topological Approach to Voxelization" (2013). The winding
///           number: A. Jacobson, L. Kavan, O. Sorkine-Hornung, "Robust Inside-Outside Segmentation using Generalized
///           Winding Numbers" (2013).
[[nodiscard]] Result<VoxelizedMesh> voxelize(const TriangleMesh& mesh, const VoxelizeOptions& options,
                                             VoxelRegistry& types, Threads threads = {}, const Progress& progress = {});

struct DistanceFieldOptions {
  VoxelLattice lattice{};
  SolidVoxels solid = SolidVoxels::Winding;  ///< what is negative; not None
  float band = 8.0F;                         ///< DensityGrid's, in samples
  std::size_t max_types = kMaxVoxelTypes;    ///< that are added, at most
};

/// A mesh as a field, and what was noticed.
struct FieldOfMesh {
  DensityGrid field;
  std::vector<std::string> warnings;  ///< one line each
};

/// The signed distance to a mesh, in voxels: a smooth, editable field.
///
/// Space:     sample (i, j, k) lies at the centre of voxel (i, j, k): point p of the field is p + 0.5 of the lattice.
/// Density:   the distance to the nearest triangle, within the band; negative where `voxelize` would find the centre
///            solid. Where holes of a mesh are bridged far from any triangle, the field jumps from band to -band.
/// Materials: one for each colour, of solid samples as of voxels in `voxelize`; alpha means nothing.
/// Cost:      about 5 s for 70,000 triangles in 512^3 on one thread, and a third of that with a band of 3.
/// The rest:  as `voxelize`. Errors: also InvalidArgument without a rule for what is solid or for a band that is not
///            within (0, 64].
[[nodiscard]] Result<FieldOfMesh> distance_field(const TriangleMesh& mesh, const DistanceFieldOptions& options,
                                                 VoxelRegistry& types, Threads threads = {},
                                                 const Progress& progress = {});

}  // namespace quoin
