#pragma once

#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>

namespace [[gnu::visibility("default")]] quoin {

struct LiveTracerOptions {
  InstanceFilter instances = InstanceFilter::Visible;  ///< instances that rays can hit
  Threads threads{};                                   ///< workers that each update uses
};

/// A tracer of a scene. One background thread computes updates, with several threads each, while the scene is edited.
/// Frames never wait for trees; the tracer shown is a few frames late.
///
///   LiveTracer tracer;
///   each frame: edit(scene); tracer.update(scene); tracer.take(); first_hit(tracer.shown(), ray); ...
///
/// Exact:    the tracer shown always equals a tracer built from the scene at one moment, `shown().scene()`. Results
///           have the instance positions, voxels and types at that moment. The delay depends on the threads. Once edits
///           stop, `take` eventually shows the current scene.
/// Late:     results are a few frames old. A body that moves by them can end up inside a voxel that was placed
///           meanwhile; `depenetration` finds the way out. If this must not happen, use a SceneTracer; its updates are
///           fast enough for small scenes.
/// Memory:   twice as much as a SceneTracer. One tracer is shown while the other is updated, so each change is applied
///           twice, once to each.
/// Lifetime: the scene is read only during calls.
/// Threads:  calls must not overlap. Any number of threads can use the shown tracer until the next `take`.
class LiveTracer {
 public:
  /// Errors: std::system_error if the background thread cannot be started.
  explicit LiveTracer(LiveTracerOptions options = {});
  /// Waits for the update in progress.
  ~LiveTracer();
  LiveTracer(const LiveTracer&) = delete;
  LiveTracer& operator=(const LiveTracer&) = delete;

  /// Starts updating the tracer to the current scene in the background if the scene or its types have changed, unless
  /// an earlier update is still running. Call it once per frame, before `take`. If the last result was not taken, the
  /// update begins after `take`.
  /// Cost:   no work if nothing changed; otherwise a copy of the grids and instances that changed since the last update
  ///         began, and for the first update Scene::snapshot.
  /// Errors: bad_alloc, also from the background thread; the next call then starts a new update, which may build the
  ///         tracer from scratch.
  void update(const Scene& scene);
  /// Shows the newest completed tracer. Returns true if there was a new one. Cost: O(1).
  bool take();
  /// Returns the tracer as of the last `take`; of an empty scene before the first. The reference stays valid.
  /// Lifetime: its placed grids and its scene are valid until the next `take`.
  [[nodiscard]] const SceneTracer& shown() const;

  /// Returns true if, as of the last update, the scene has changes that the tracer shown does not have yet.
  [[nodiscard]] bool is_late() const;
  /// Waits until the tracer of the scene is shown. Errors: bad_alloc.
  void finish(const Scene& scene);

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
