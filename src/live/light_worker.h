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
#include "live/latest_state.h"

namespace quoin {

/// A scene as it was at one moment, and its light.
struct LitScene {
  std::shared_ptr<const Scene> scene;
  SceneLight light;
};

/// A lit scene that LiveMeshes makes surfaces of.
struct LitState {
  LitScene lit;
  std::uint64_t number = 0;          ///< of the update that asked for it
  Workers::Clock::time_point asked;  ///< time of the update that found the first of its changes
  std::shared_ptr<LitScene>
      to_show;  ///< equal; becomes the light shown when the surfaces are taken. Null: it was shown
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
  [[nodiscard]] const SceneLight& shown() const { return states_.shown().light; }
  [[nodiscard]] bool is_late() const;
  /// Waits for the update in progress, and shows its light unless there is a receiver. Rethrows its exception.
  void wait() { states_.wait(); }

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
  [[nodiscard]] bool is_state_pending() const { return states_.is_late(); }
  void note_received() { states_.note_passed_on(); }
  /// Makes the light of a state the light shown. The worker destroys the former one. Does nothing the second time. Does
  /// not throw.
  void show(LitState& state);

 private:
  using States = LatestState<LitScene>;

  [[nodiscard]] std::unique_ptr<LitScene> make(States::Request request);
  bool read_changes(const Scene& scene, bool with_data);

  // Read positions in the changes of a grid, for voxels and fields.
  struct GridCursors {
    ChangeCursor voxels;
    ChangeCursor field;
  };

  // The caller's.
  ChangeCursor followed_scene_;
  ChangeCursor followed_types_;
  std::map<GridHandle, GridCursors> followed_grids_;
  SceneChanges changes_;  // kept for its memory

  // Used only by the worker thread.
  Threads threads_;
  LitScene working_;

  mutable std::mutex mutex_;   // of the next members
  Receiver receiver_;          // gets the states; the worker may call it without the mutex until `detach` has waited
  bool is_shown_new_ = false;  // shown for a receiver since the last `take`
  std::uint64_t newest_number_ = 0;  // of the receiver's states
  std::uint64_t shown_number_ = 0;

  States states_;  // last: its worker ends first
};

}  // namespace quoin
