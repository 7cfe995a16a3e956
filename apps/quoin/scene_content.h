#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <quoin/scene/scene.h>

namespace quoin::tool {

/// How much there is in a scene, each model counted once.
struct SceneContent {
  std::int64_t voxels = 0;
  std::int64_t solid_samples = 0;  ///< of fields
};

[[nodiscard]] std::int64_t solid_samples(const Scene& scene);
[[nodiscard]] std::int64_t voxels_with_data(const Scene& scene);

/// "Voxels: 1,234", "Solid samples: 5,678" or both, in one line without its end.
[[nodiscard]] std::string content_text(const SceneContent& content);

/// Adds a warning when lamps are left out of meshes.
void warn_of_lamps(const Scene& scene, std::vector<std::string>& warnings);
/// Adds a warning when data of voxels is left out of meshes.
void warn_of_data(std::int64_t voxels, std::vector<std::string>& warnings);
/// Adds a warning when values that a game keeps in a world are left out.
void warn_of_values(std::size_t values, std::vector<std::string>& warnings);
/// Adds a warning when hidden instances are left out by `filter`.
void warn_of_left_out(const Scene& scene, InstanceFilter filter, std::vector<std::string>& warnings);

}  // namespace quoin::tool
