#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <quoin/scene/scene.h>

namespace quoin::tool {

/// The amount of content in a scene. Each model counts once.
struct SceneContent {
  std::int64_t voxels = 0;
  std::int64_t solid_samples = 0;  ///< in fields
};

[[nodiscard]] std::int64_t solid_samples(const Scene& scene);
[[nodiscard]] std::int64_t voxels_with_data(const Scene& scene);

/// Returns "Voxels: 1,234", "Solid samples: 5,678" or both, without a line end.
[[nodiscard]] std::string content_text(const SceneContent& content);

/// Adds a warning if the scene has lamps, which meshes leave out.
void warn_of_lamps(const Scene& scene, std::vector<std::string>& warnings);
/// Adds a warning if voxels have data, which meshes leave out.
void warn_of_data(std::int64_t voxels, std::vector<std::string>& warnings);
/// Adds a warning if a game stores values in the world, which other files leave out.
void warn_of_values(std::size_t values, std::vector<std::string>& warnings);
/// Adds a warning if `filter` leaves out hidden instances.
void warn_of_left_out(const Scene& scene, InstanceFilter filter, std::vector<std::string>& warnings);

}  // namespace quoin::tool
