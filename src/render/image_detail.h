#pragma once

#include <mutex>
#include <span>
#include <vector>

#include <quoin/render/cpu_renderer.h>
#include <quoin/render/impostor_cache.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>

#include "render/impostor/far.h"

namespace quoin {

/// The level of detail of each instance in one image.
struct ImageDetail {
  std::vector<SelectedInstance> selected;  ///< with the level for tracing each; see keep_whole
  FarImpostors far;
};

/// Keeps instances drawn from impostors at full detail for tracing: shadows on an impostor use its voxels. Both spans
/// are in the order of the instances.
void keep_whole(std::span<const FarInstance> far, std::span<SelectedInstance> selected);

/// Chooses the level of detail, and keeps impostors for later images. Threads: any number may choose.
class DetailChooser {
 public:
  /// `threads`: for building impostors, as in ImpostorCacheOptions::workers.
  explicit DetailChooser(Threads threads = {}) : impostors_({FarImpostors::kMaxBytes, threads}) {}

  /// Returns an empty result without DetailOptions::policy. Requires: the scene is not edited during the call and is
  /// the same in every call.
  [[nodiscard]] ImageDetail choose(const Scene& scene, InstanceFilter filter, const Camera& camera,
                                   const RenderOptions& options);

  /// As in ImpostorCache::update_types.
  void update_types(const VoxelRegistry& types) { impostors_.update_types(types); }

 private:
  [[nodiscard]] FarImpostors take_far(const Scene& scene, const std::vector<SelectedInstance>& selected,
                                      const RenderOptions& options);

  ImpostorCache impostors_;
  std::mutex waiting_;  // held while waiting for impostors
};

}  // namespace quoin
