#pragma once

#include <string>
#include <vector>

#include <quoin/scene/scene.h>

namespace quoin::tool {

/// Adds a warning when lamps are left out of meshes.
void warn_of_lamps(const Scene& scene, std::vector<std::string>& warnings);
/// Adds a warning when data of voxels is left out of meshes.
void warn_of_data(const Scene& scene, std::vector<std::string>& warnings);
/// Adds a warning when hidden instances are left out by `filter`.
void warn_of_left_out(const Scene& scene, InstanceFilter filter, std::vector<std::string>& warnings);

}  // namespace quoin::tool
