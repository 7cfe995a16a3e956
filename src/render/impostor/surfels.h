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

/// All surfels of a field, sorted by `comes_before`; nothing where they would be more than `max_count`, or more than a
/// quarter of them on what is at most three samples thick.
///
/// Which:  where the surface crosses an edge of the lattice, along the axis of which the normal has 0.8 of its largest
///         component or more than 0.55: so wherever the largest axis changes those of both sides overlap, and there is
///         no gap.
/// Normal: as that of a traced surface.
/// Cost:   about a microsecond a surfel.
[[nodiscard]] std::optional<FieldSurfels> surfels_of(const DensityGrid& field, std::size_t max_count);

}  // namespace quoin
