#pragma once

#include <optional>
#include <string>

#include <quoin/io/loaded_scene.h>
#include <quoin/scene/scene.h>

/// Converts scenes with a voxel size other than 1, the only size in .vox.
namespace quoin::vox {

/// Returns the common voxel size of all instances; nullopt if it is 1 or they differ.
[[nodiscard]] std::optional<double> common_voxel_size(const Scene& scene);

/// Returns the scene with voxels of size 1 and all positions divided by their size.
[[nodiscard]] Scene divided(const Scene& given, double voxel_size);
[[nodiscard]] LoadedScene divided(const LoadedScene& given, double voxel_size);

/// Returns the warning that the file does not store the voxel size.
[[nodiscard]] std::string size_warning(double voxel_size);

}  // namespace quoin::vox
