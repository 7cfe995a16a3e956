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

/// Writes an Ace of Spades map if the scene fits 512 x 64 x 512 voxels, or a Voxlap map if it fits 1024 x 256 x 1024.
/// The scene keeps its position if that is within the map, and is centred otherwise. Each column gets ground below it,
/// since the format requires it.
[[nodiscard]] Result<ModelBytes> write_vxl(const Scene& scene, const Progress& progress = {});

/// Writes one grid of full and empty voxels, with its position and voxel size.
[[nodiscard]] Result<ModelBytes> write_binvox(const Scene& scene, const Progress& progress = {});

}  // namespace quoin::models
