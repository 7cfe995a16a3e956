#pragma once

#include <cstdint>
#include <string>

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

}  // namespace quoin::tool
