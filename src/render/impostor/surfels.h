#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <quoin/grid/density_grid.h>

#include "render/impostor/raster/faces.h"
#include "render/shell/shell.h"

namespace quoin {

/// The surface of a field in pieces: a face for each surfel, and a material.
struct FieldSurfels {
  std::vector<VoxelFace> faces;
  std::vector<ImpostorFaces::Surfel> surfels;
  std::vector<VoxelType> types;
};

/// Returns all surfels of a field, sorted by `comes_before`. Returns nullopt if there would be more than `max_count`,
/// or if more than a quarter of them lie on parts at most three samples thick.
///
/// Edges:  lattice edges that the surface crosses, if the normal's component along the edge is at least 0.8 of its
///         largest component or more than 0.55. So the surfels of both sides overlap where the largest axis changes,
///         and there is no gap.
/// Normal: the normal of the traced surface.
/// Cost:   about a microsecond per surfel.
[[nodiscard]] std::optional<FieldSurfels> surfels_of(const DensityGrid& field, std::size_t max_count);

}  // namespace quoin
