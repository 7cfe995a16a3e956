#pragma once

#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/light/scene_light.h>
#include <quoin/scene/scene.h>

namespace quoin {

struct LiveLightOptions {
  PropagatedLightOptions light{};
  Threads workers{};  ///< unlike elsewhere 0 means one less than the machine has, at least 1
};

/// Propagated light of a scene's grids, kept up to date on workers while the scene is edited: a frame never waits for
/// it, and shows light that is a few frames late.
///
///   LiveLight light;
///   renderer.use_light(&light.shown());
///   each frame: edit(scene); light.update(scene); light.take(); renderer.update(); renderer.render(...);
///
/// Exact:   what is shown is at any time the light of the scene as it was at one moment, voxels included
///          (GridLight::voxels), equal to a search from every lamp and all of the sky. How late it is depends on the
///          workers; once nothing is edited any more, what `take` has put there is the light of what is there.
/// Follow:  PropagatedLight::changes_since, of `shown().of(grid).light`, tells where light changed between two states.
/// Lifetime: the scene is only read within calls. Threads: all calls come from one thread, or one after the other;
///           what is shown may be read by any number until the next `take`.
class LiveLight {
 public:
  /// Errors: std::system_error where the worker cannot be started.
  explicit LiveLight(LiveLightOptions options = {});
  /// Waits for the update that is under way.
  ~LiveLight();
  LiveLight(const LiveLight&) = delete;
  LiveLight& operator=(const LiveLight&) = delete;

  /// Has workers find the light of the scene as it is now, if voxels' types, fields, grids or types are others than
  /// when it last did, unless they are still at an earlier state: call it once a frame. Data at voxels, names and
  /// places are none of light's: in what is shown they may be those of an earlier moment.
  /// Cost:   nothing where nothing changed; else that of Scene::snapshot.
  /// Errors: bad_alloc, of a worker too; what could not be lit then is, anew, after the next call.
  void update(const Scene& scene);
  /// Puts the newest light that is ready in place of what is shown. Returns whether there was any. Cost: O(1).
  bool take();
  /// As of the last `take`; open sky before. It stays in its place. Lifetime of what it gives: until the next `take`.
  [[nodiscard]] const SceneLight& shown() const;

  /// Whether, as of the last update, there is something that is not shown yet.
  [[nodiscard]] bool is_late() const;
  /// Waits until the scene's light is shown. Errors: bad_alloc.
  void finish(const Scene& scene);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
