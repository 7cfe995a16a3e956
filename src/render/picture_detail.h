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

/// How the instances of one picture are drawn.
struct PictureDetail {
  std::vector<SelectedInstance> selected;  ///< traced so often halved; see keep_whole
  FarImpostors far;
};

/// Has those that are drawn from impostors stay whole where they are traced: shadows onto what an impostor shows are
/// those of its voxels. Both in the order of the instances.
void keep_whole(std::span<const FarInstance> far, std::span<SelectedInstance> selected);

/// Chooses that, and keeps impostors from picture to picture. Threads: any number may choose.
class DetailChooser {
 public:
  /// `threads`: those that build impostors; as ImpostorCacheOptions::workers.
  explicit DetailChooser(Threads threads = {}) : impostors_({FarImpostors::kMaxBytes, threads}) {}

  /// Nothing without DetailOptions::policy. Requires: nobody edits the scene meanwhile; it is always the same one.
  [[nodiscard]] PictureDetail choose(const Scene& scene, InstanceFilter filter, const Camera& camera,
                                     const RenderOptions& options);

  /// As ImpostorCache::update_types.
  void update_types(const VoxelRegistry& types) { impostors_.update_types(types); }

 private:
  [[nodiscard]] FarImpostors take_far(const Scene& scene, const std::vector<SelectedInstance>& selected,
                                      const RenderOptions& options);

  ImpostorCache impostors_;
  std::mutex waiting_;  // for impostors, however long that takes
};

}  // namespace quoin
