#pragma once

#include <cstddef>

#include <glm/mat3x3.hpp>
#include <quoin/core/function_ref.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>

namespace [[gnu::visibility("default")]] quoin {

class ConnectedPieces;

/// The mass of a rigid body, as physics engines take it.
///
///   const auto body = mass_properties(pieces, i, [&](VoxelType type) { return table[type]; }).scaled(0.25);
///   make_body(body.mass, body.centre, body.inertia);   // voxels of a quarter of a unit, table: mass per cubic unit
///
/// Units: lengths are in voxels (samples, for a field), and a density is the mass of one voxel. For world units, return
///        masses per cubic world unit and call `scaled`. If densities are masses per voxel, do not call it: `mass` is
///        right, `centre` still has to be multiplied by the voxel size, and `inertia` by its square.
/// Space: the grid's own. Voxel (x, y, z) fills the cube from there to (x + 1, y + 1, z + 1). Samples are points.
struct MassProperties {
  double mass = 0.0;
  DVec3 centre{0.0};  ///< centre of mass; 0 if the mass is 0
  /// The inertia tensor about the centre of mass, along the grid's axes; symmetric. On the diagonal it holds the
  /// moments of inertia, for example the sum of mass * (y^2 + z^2) for x. Other elements hold products of inertia with
  /// their sign changed.
  glm::dmat3 inertia{0.0};

  /// Returns the properties of the body when voxels are `voxel_size` world units wide (Instance::voxel_size) and
  /// densities are masses per cubic world unit. The centre is then in world units from the grid's origin.
  /// Requires: voxel_size > 0.
  [[nodiscard]] MassProperties scaled(double voxel_size) const;
};

/// Returns the density of a type: finite, at least 0. Its unit is up to the caller, see MassProperties. Called once per
/// type, on the calling thread. A table is `[&](VoxelType type) { return table[type]; }`.
using DensityOfType = FunctionRef<double(VoxelType)>;

/// Returns the mass properties of all voxels of a grid, with uniform density within each voxel. In a partial grid, only
/// loaded chunks count.
///
/// Exact: moments are counted in integers per chunk and type. Only the sums over chunks and types round.
/// Cost:  O(rows of 64 voxels with voxels + runs of equal types in them). A uniform chunk costs no time per voxel.
[[nodiscard]] MassProperties mass_properties(const Grid& grid, DensityOfType density);

/// As above, for one piece, in the state of the last update. An extracted piece (ConnectedPieces::extract) has the same
/// properties. Requires: piece < pieces.size().
[[nodiscard]] MassProperties mass_properties(const ConnectedPieces& pieces, std::size_t piece, DensityOfType density);

/// Returns the mass properties of the solid of a field. `density` is also called with air, for solid samples without a
/// material. Samples beyond the field's chunks are air.
///
/// Rule:  a cell between eight solid samples is solid. A cell with solid and other samples consists of 4x4x4 parts: a
///        part is solid if the trilinear field is negative at its centre. The solid part of a cell has the mean of the
///        densities of its solid samples.
/// Cost:  O(rows of 64 cells with solid + cells that the surface crosses, 64 values each).
[[nodiscard]] MassProperties mass_properties(const DensityGrid& field, DensityOfType density);

}  // namespace quoin
