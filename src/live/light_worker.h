#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>

#include <quoin/live/live_light.h>
#include <quoin/render/propagated_light.h>
#include <quoin/scene/scene.h>

#include "core/work/workers.h"

namespace quoin {

/// A scene as it was at one moment, and its light.
struct LitScene {
  std::shared_ptr<const Scene> scene;
  SceneLight light;
};

/// A lit scene that LiveMeshes makes surfaces of.
struct LitState {
  LitScene lit;
  std::uint64_t number = 0;           ///< of the update that asked for it
  Workers::Clock::time_point asked;   ///< time of the update that found the first of its changes
  std::unique_ptr<LitScene> to_show;  ///< equal; becomes the light shown when the surfaces are taken
  bool is_shown = false;
};

/// The implementation of LiveLight. Either its owner asks for light and shows it, or a receiver does both:
///
///   owner       update -> worker -> ready -> take
///   receiver    update_for_receiver -> worker -> receiver(state) -> surfaces of the state are taken -> show
///
/// Threads: `update`, `update_for_receiver`, `attach` and `detach` must not overlap. Other functions: any thread.
class LightWorker {
 public:
  /// Called by the worker with each new state. Calls `note_received` when it has taken over the state.
  using Receiver = std::function<void(std::shared_ptr<LitState>)>;

  explicit LightWorker(LiveLightOptions options);

  /// As LiveLight::update and LiveLight::take. With a receiver, `update` does nothing, and `take` returns true if other
  /// light is shown than at the last call.
  void update(const Scene& scene);
  bool take();
  [[nodiscard]] const SceneLight& shown() const { return shown_.light; }
  [[nodiscard]] bool is_late() const;
  /// Waits for the update in progress. Rethrows its exception.
  void wait();

  /// Waits for an update in progress. Requires: there is no receiver.
  void attach(Receiver receiver);
  /// Returns once the receiver will not be called any more: after an update in progress. Does nothing without a
  /// receiver. Requires: the caller holds no lock that the receiver needs.
  void detach();
  [[nodiscard]] bool has_receiver() const;
  /// Asks for the state of the scene if anything that light depends on has changed, or `is_other`, unless the worker is
  /// busy. Then a later call asks for it.
  void update_for_receiver(const Scene& scene, std::uint64_t number, bool is_other);
  /// Returns true if the receiver will get another state, or has not taken over the last one.
  [[nodiscard]] bool is_state_pending() const;
  void note_received();
  /// Makes the light of a state the light shown. Does nothing the second time. Does not throw.
  void show(LitState& state);

 private:
  static constexpr Workers::Clock::time_point kNever{};

  [[nodiscard]] Workers::Clock::time_point step(Workers::Lock& lock);
  void give(Workers::Lock& lock, std::unique_ptr<LitScene> done);
  void throw_failure();
  bool read_changes(const Scene& scene, bool with_data);
  void ask(const Scene& scene, std::uint64_t number);
  [[nodiscard]] std::shared_ptr<const Scene> cancel_request();
  [[nodiscard]] bool is_idle() const { return !is_busy_ && !is_giving_; }

  // Read positions in the changes of a grid, for voxels and fields.
  struct GridCursors {
    ChangeCursor voxels;
    ChangeCursor field;
  };

  // The caller's.
  ChangeCursor followed_scene_;
  ChangeCursor followed_types_;
  std::map<GridHandle, GridCursors> followed_grids_;
  LitScene shown_;

  // Used only by the worker thread.
  Threads threads_;
  LitScene working_;

  mutable std::mutex mutex_;  // of all below
  bool is_behind_ = true;     // something changed that no snapshot has, or that could not be lit
  Workers::Clock::time_point behind_since_ = kNever;  // time of the first update that found it so
  bool is_busy_ = false;                // computing the requested light, or its receiver has not taken it over
  bool is_giving_ = false;              // calling the receiver
  std::shared_ptr<const Scene> asked_;  // to be lit
  std::uint64_t asked_number_ = 0;
  Workers::Clock::time_point asked_at_;  // as `behind_since_`, for the request
  std::unique_ptr<LitScene> ready_;      // to be taken
  std::unique_ptr<LitScene> spent_;      // was shown; the worker destroys it, which takes a while
  Receiver receiver_;
  bool is_shown_new_ = false;        // shown for a receiver since the last `take`
  std::uint64_t newest_number_ = 0;  // of the receiver's states
  std::uint64_t shown_number_ = 0;
  Workers worker_{mutex_};
};

}  // namespace quoin
