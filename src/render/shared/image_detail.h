#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render/impostor.h>
#include <quoin/render/impostor_cache.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// An instance drawn as its grid's impostor. Lifetime: the impostor must outlive it.
struct FarInstance {
  InstanceHandle instance;
  const Impostor* impostor = nullptr;
};

/// The far instances of one image that have impostors.
struct FarImpostors {
  static constexpr std::size_t kMaxBytes = std::size_t{1} << 30;  ///< of all grids; grids beyond the limit have none

  std::vector<FarInstance> instances;
  std::map<GridHandle, std::shared_ptr<const Impostor>> kept;  ///< owns the impostors above
};

/// Requests impostors for the Far instances in `selected`, and takes the ready ones after `seconds`.
///
/// Without a time limit only the scene determines which instances have an impostor. Grids are taken in the order of the
/// instances.
[[nodiscard]] FarImpostors take_impostors(ImpostorCache& cache, const Scene& scene,
                                          std::span<const SelectedInstance> selected, double seconds,
                                          const ImpostorOptions& options);

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
