#pragma once

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

#include "io/placed/placed_grids.h"

// Writes scenes as files of other programs; docs/formats/models.md lists the supported content of each. Unsupported
// content causes a warning, or an error if the file would look different.
//
// Quoin reads back the same voxels at the same positions, with their colours except for .binvox.
// Errors of all: Unsupported for density fields, rotations that are not multiples of 90 degrees, and voxels of
// different sizes; LimitExceeded beyond the format's limits; Cancelled.

namespace quoin::models {

/// Qubicle's .qb: a matrix for each instance, with runs.
[[nodiscard]] Result<ModelBytes> write_qb(const Scene& scene, const Progress& progress = {});

/// Goxel's .gox, version 2: a layer for each instance, and for each material of it.
[[nodiscard]] Result<ModelBytes> write_goxel(const Scene& scene, const Progress& progress = {});

/// A map of Ace of Spades where 512 x 64 x 512 voxels hold it, of Voxlap's where 1024 x 256 x 1024 do. It stays at its
/// place where that is within the map, and is moved to its middle otherwise. Below each column there is ground, since
/// the format knows no column without.
[[nodiscard]] Result<ModelBytes> write_vxl(const Scene& scene, const Progress& progress = {});

/// One grid of full and empty voxels, with its place and their size.
[[nodiscard]] Result<ModelBytes> write_binvox(const Scene& scene, const Progress& progress = {});

}  // namespace quoin::models
