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

namespace [[gnu::visibility("default")]] quoin {

/// The voxel lattice of a mesh: voxel (i, j, k) is the cube of edge `voxel_size` with its minimum corner at `origin +
/// voxel_size * (i, j, k)`.
struct VoxelLattice {
  DVec3 origin{0.0};        ///< in mesh units
  double voxel_size = 1.0;  ///< in mesh units

  [[nodiscard]] DVec3 grid_from_mesh(DVec3 point) const { return (point - origin) / voxel_size; }
};

/// Returns a lattice in which the mesh's longest side takes `voxels` voxels, starting at voxel (0, 0, 0). Along each
/// axis, the mesh is centred in the smallest number of voxels that holds it. Along the longest axis, its outermost
/// points are a thousandth of a voxel inside the sides, so that flat sides fill one layer and do not fall between two.
///
/// Errors: InvalidArgument if `voxels` is not positive or the mesh has no triangles; LimitExceeded beyond 2^14.
[[nodiscard]] Result<VoxelLattice> lattice_of_size(const TriangleMesh& mesh, int voxels);
/// Returns a lattice with this voxel size that has a voxel corner at the mesh's origin, so that meshes in one space fit
/// together. The lattice's origin is a whole number of voxels from there, at or below the mesh's minimum corner.
///
/// Errors: InvalidArgument if the size is not positive and finite or the mesh has no triangles; LimitExceeded if the
///         longest side has more than 2^14 voxels.
[[nodiscard]] Result<VoxelLattice> lattice_of_voxel(const TriangleMesh& mesh, double voxel_size);

/// The rule that selects the voxels of a surface.
enum class SurfaceVoxels : std::uint8_t {
  None,
  /// 6-separating, thin: the surface crosses one of the three lines through the voxel's centre between opposite faces.
  /// No face-connected path of other voxels crosses a closed surface. A surface between two voxels selects the inner
  /// one (for an open surface, the one with the greater coordinate), so a cube with sides between voxels gives exactly
  /// the voxels inside it. A surface on voxel centres selects all voxels that it crosses: a cube from 0.5 to 3.5 gives
  /// 4 voxels per side. Tips and fragments that no such line hits are left out, with a warning.
  Separating6,
  /// 26-separating, thick: the voxel's closed cube touches the surface. No path through edges and corners crosses it
  /// either. A surface between voxels selects all of them.
  Separating26,
};

/// The rule that selects the voxels inside a mesh.
enum class SolidVoxels : std::uint8_t {
  None,
  /// Voxels whose centre has an absolute winding number above one half. The winding number is the mean over six
  /// axis-aligned rays; each hit triangle counts by the side that faces the ray. A self-intersecting mesh is one solid,
  /// holes are bridged, and entire parts may be inside out. A shell inside another one with opposite orientation is a
  /// cavity.
  Winding,
  /// Voxels from whose centre most of the six rays hit an odd number of triangles: for meshes with inconsistent
  /// triangle orientation. The overlap of two parts is outside, and so is a part enclosed by another.
  Parity,
};

struct VoxelizeOptions {
  VoxelLattice lattice{};
  SurfaceVoxels surface = SurfaceVoxels::Separating6;
  SolidVoxels solid = SolidVoxels::Winding;
  std::size_t max_types = kMaxVoxelTypes;  ///< maximum number of added types
};

/// The voxels of a mesh, with warnings.
struct VoxelizedMesh {
  Grid grid;
  std::vector<std::string> warnings;  ///< one line each
};

/// Voxelises a mesh: its surface, its interior, or both.
///
/// Space:    voxels of `options.lattice`; only voxels around the mesh's bounds are tested.
/// Exact:    lines through voxel centres are intersected with a rule that assigns a point on a shared edge to exactly
///           one triangle, so closed meshes do not leak. A centre on the surface belongs to its greater side.
/// Colours:  a voxel within 1.25 voxels of the surface takes the colour of the nearest surface point: material times
///           texture times vertex colour, in linear light. Textures are averaged over the voxel's footprint (trilinear
///           mipmaps). Deeper voxels take the mean colour of the surface, or, for a mesh of one material and at most
///           256 colours, the nearest of these colours.
/// Cut-outs: surface voxels without a surface by alpha are left out; enclosed voxels stay.
/// Types:    one type per colour and material is added to `types`. Beyond `max_types`, or the registry's capacity,
///           similar colours are merged (median cut), with a warning.
/// Order:    the same voxels and types at any thread count.
/// Memory:   about 60 bytes per triangle, 12 bytes per surface voxel, 32 bytes per chunk of the mesh's box, 1 MiB per
///           thread, and the grid.
/// Cost:     about 0.2 s for 70,000 triangles in 512^3 on one thread; 1 s with colours.
/// Errors:   those of check_mesh; InvalidArgument for an invalid lattice; LimitExceeded beyond 2^14 voxels along an
///           axis, 2^32 line crossings, or too many types; Cancelled.
/// Source:   cube and triangle test: M. Schwarz, H.-P. Seidel, "Fast Parallel Surface and Solid Voxelization on GPUs"
///           (2010). Separation: S. Laine, "A Topological Approach to Voxelization" (2013). Winding number: A.
///           Jacobson, L. Kavan, O. Sorkine-Hornung, "Robust Inside-Outside Segmentation using Generalized Winding
///           Numbers" (2013).
[[nodiscard]] Result<VoxelizedMesh> voxelize(const TriangleMesh& mesh, const VoxelizeOptions& options,
                                             VoxelRegistry& types, Threads threads = {}, const Progress& progress = {});

struct DistanceFieldOptions {
  VoxelLattice lattice{};
  SolidVoxels solid = SolidVoxels::Winding;  ///< the negative side of the field; must not be None
  float band = 8.0F;                         ///< DensityGrid's band, in samples
  std::size_t max_types = kMaxVoxelTypes;    ///< maximum number of added types
};

/// The distance field of a mesh, with warnings.
struct MeshDistanceField {
  DensityGrid field;
  std::vector<std::string> warnings;  ///< one line each
};

/// Computes the signed distance to a mesh, in voxels, as a smooth, editable field.
///
/// Space:     sample (i, j, k) is the centre of voxel (i, j, k): point p of the field is p + 0.5 in the lattice.
/// Density:   the distance to the nearest triangle, within the band; negative at centres that `voxelize` finds solid.
///            If a hole is bridged far from all triangles, the field jumps from band to -band there.
/// Materials: one per colour, for solid samples, as in `voxelize`; alpha is ignored.
/// Cost:      about 5 s for 70,000 triangles in 512^3 on one thread; a third of that with a band of 3.
/// Otherwise: as `voxelize`.
/// Errors:    also InvalidArgument for SolidVoxels::None, or a band outside (0, 64].
[[nodiscard]] Result<MeshDistanceField> distance_field(const TriangleMesh& mesh, const DistanceFieldOptions& options,
                                                       VoxelRegistry& types, Threads threads = {},
                                                       const Progress& progress = {});

}  // namespace quoin
