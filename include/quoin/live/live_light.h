#pragma once

#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/render/propagated_light.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

class [[gnu::visibility("hidden")]] LightWorker;
class LiveMeshes;

struct LiveLightOptions {
  PropagatedLightOptions light{};
  Threads threads{};  ///< workers that each update uses
};

/// Propagated light of a scene's grids. One background thread computes updates, with several threads each, while the
/// scene is edited. Frames never wait for light; the light shown is a few frames late.
///
///   LiveLight light;
///   renderer.use_light(&light.shown());
///   each frame: edit(scene); light.update(scene); light.take(); renderer.update(); renderer.render(...);
///
/// Exact:    the light shown is always the exact light of the scene at one moment, including its voxels
///           (GridLight::voxels). The delay depends on the threads. Once edits stop, `take` eventually shows the light
///           of the current scene.
/// Meshes:   LiveMeshes::use_light shows this light together with the surfaces of the same moment. Then call only
///           `update` and `take` of LiveMeshes: they also update and show the light.
/// Follow:   PropagatedLight::changes_since, on `shown().of(grid).light`, reports where light changed between two
///           states.
/// Lifetime: the scene is read only during calls.
/// Threads:  calls must not overlap. Any number of threads can read the shown light until the next `take`, also of a
///           LiveMeshes that uses this light.
class LiveLight {
 public:
  /// Errors: std::system_error if the background thread cannot be started.
  explicit LiveLight(LiveLightOptions options = {});
  /// Waits for the update in progress; cancels a later one. If LiveMeshes uses the light, its worker continues until
  /// LiveMeshes no longer does.
  ~LiveLight();
  LiveLight(const LiveLight&) = delete;
  LiveLight& operator=(const LiveLight&) = delete;

  /// Starts computing the light of the current scene in the background if voxel types, fields, grids or type properties
  /// have changed, unless an earlier update is still running. Call it and `take` once per frame: no update begins
  /// before the last result is taken. Voxel data, names and instance positions do not affect light and can be out of
  /// date in the light shown.
  /// Does nothing while LiveMeshes uses this light.
  /// Cost:   no work if nothing changed; otherwise a copy of the grids and instances that changed since the last update
  ///         began, and for the first update Scene::snapshot.
  /// Errors: bad_alloc, also from the background thread; the next call then computes the missing light from scratch.
  void update(const Scene& scene);
  /// Shows the newest completed light. Returns true if there was new light. While LiveMeshes uses this light, returns
  /// true if LiveMeshes::take has shown new light since the last call. Cost: O(1).
  bool take();
  /// Returns the light as of the last `take`, also of LiveMeshes; open sky before the first. The reference stays valid.
  /// Lifetime: a GridLight from it is valid until the next `take`, also of LiveMeshes.
  [[nodiscard]] const SceneLight& shown() const;

  /// Returns true if, as of the last update, the scene has changes whose light is not shown yet.
  [[nodiscard]] bool is_late() const;
  /// Waits until the light of the scene is shown. Does nothing while LiveMeshes uses this light: LiveMeshes::finish and
  /// LiveMeshes::take show it. Errors: bad_alloc.
  void finish(const Scene& scene);

 private:
  friend class LiveMeshes;
  std::shared_ptr<LightWorker> worker_;
};

}  // namespace quoin
