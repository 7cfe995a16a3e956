#pragma once

#include <algorithm>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/scene/scene.h>

#include "core/work/workers.h"

namespace quoin {

/// A state that one background thread derives from a scene while the scene is edited: its light, its tracer. The owner
/// shows the newest completed state. An update begins only when the last result was taken, so that there are never more
/// than two states.
///
///   owner    update(scene): spare, brought up to date -> asked     take(): ready <-> shown, the former one -> former
///   worker   copy of asked -> spare     make(asked, former) -> ready
///
/// The owner copies the changes since the last request only, however large the scene is.
///
/// State:    movable; a move must not throw.
/// Lifetime: the scene is read only during calls.
/// Threads:  `update`, `take`, `cancel` and `wait` must not overlap. Other functions: any thread. `make` runs on the
///           worker, which then has the former state for itself. Many threads may read the shown state at once, until
///           the next `take`.
template <class State>
class LatestState {
 public:
  /// A scene at one moment, whose state is to be made.
  struct Request {
    std::shared_ptr<const Scene> scene;
    std::uint64_t number = 0;          ///< as passed to `update`
    Workers::Clock::time_point since;  ///< time of the `update` that found the first of its changes
  };
  /// Makes the state of a request. `former` is the last state that `take` replaced, or null; the function may move it
  /// away to bring it up to date. Otherwise the worker destroys it, after the new state can be taken. The function may
  /// also pass its state on and return null; then there is nothing to take.
  using Make = std::function<std::unique_ptr<State>(Request request, std::unique_ptr<State>& former)>;
  /// `name`: of the worker, as Workers::Options. Errors: std::system_error if the background thread cannot be started.
  LatestState(State first, Make make, const char* name = "state") : make_(std::move(make)), shown_(std::move(first)) {
    worker_.start(1, [this](Workers::Lock& lock, unsigned /*worker*/) { return step(lock); }, {.name = name});
  }

  /// Starts an update to the scene as it is now, if `has_changed` is or was true since the last one started. Does
  /// nothing else while an update is requested or in progress.
  /// Errors: bad_alloc, also from the worker; the next call then starts an update.
  void update(const Scene& scene, bool has_changed, std::uint64_t number = 0) {
    std::shared_ptr<Scene> snapshot;
    {
      const std::lock_guard lock(mutex_);
      if (has_changed) note_behind(Workers::Clock::now());
      throw_failure();
      if (!is_behind_ || is_busy_) return;
      std::swap(snapshot, spare_);
    }
    if (snapshot != nullptr) {
      scene.update_snapshot(*snapshot, changes_);
    } else {
      snapshot = std::make_shared<Scene>(scene.snapshot());
    }
    {
      const std::lock_guard lock(mutex_);
      QUOIN_ASSERT(asked_.scene == nullptr && !is_busy_, "one request at a time");
      asked_ = {std::move(snapshot), number, behind_since_};
      is_busy_ = true;
      is_behind_ = false;
    }
    worker_.wake_one();
  }

  /// Shows the newest completed state. Returns true if there was a new one. Cost: O(1).
  bool take() {
    {
      const std::lock_guard lock(mutex_);
      if (ready_ == nullptr) return false;
      QUOIN_ASSERT(former_ == nullptr, "the update that made a result took the former state");
      std::swap(*ready_, shown_);
      former_ = std::move(ready_);
      if (asked_.scene == nullptr) return true;
    }
    worker_.wake_one();
    return true;
  }
  [[nodiscard]] const State& shown() const { return shown_; }
  /// Exchanges the shown state for one that `make` has passed on. Must not overlap with `take`, nor with reads.
  void exchange_shown(State& other) { std::swap(shown_, other); }

  /// Returns true if, as of the last `update`, the scene has changes that are not shown yet. A state that `make` has
  /// passed on counts as shown.
  [[nodiscard]] bool is_late() const {
    const std::lock_guard lock(mutex_);
    return is_behind_ || is_busy_ || ready_ != nullptr;
  }
  /// Called by `make` when it has passed its state on: from now on, `update` can request the next one.
  void note_passed_on() {
    const std::lock_guard lock(mutex_);
    if (asked_.scene == nullptr) is_busy_ = false;
  }
  /// Cancels a request that the worker has not begun, waits for an update in progress, and drops its result. The next
  /// `update` starts another one.
  void cancel() {
    Request cancelled;  // both are destroyed without the lock
    std::unique_ptr<State> dropped;
    std::unique_lock lock(mutex_);
    if (asked_.scene != nullptr) {
      is_busy_ = false;  // a request is made only when the earlier one is done
      std::swap(cancelled, asked_);
    }
    note_behind(cancelled.scene != nullptr ? cancelled.since : Workers::Clock::now());
    worker_.wait(lock, [&] { return is_idle(); });
    dropped = std::move(ready_);
  }
  /// Waits until no update is requested or in progress, and shows its result. Errors: as `update`.
  void wait() {
    take();  // a requested update may wait for it
    {
      std::unique_lock lock(mutex_);
      worker_.wait(lock, [&] { return is_idle(); });
      throw_failure();
    }
    take();
  }
  /// Returns the queue of objects that the worker destroys.
  [[nodiscard]] const std::shared_ptr<ReleaseQueue>& releases() const { return worker_.releases(); }

 private:
  // Requires: the lock is free.
  void keep_spare(std::shared_ptr<Scene> spare) {
    const std::lock_guard lock(mutex_);
    std::swap(spare_, spare);
  }
  [[nodiscard]] Workers::Clock::time_point step(Workers::Lock& lock) {
    if (asked_.scene == nullptr || ready_ != nullptr) return Workers::kWhenWoken;
    QUOIN_ASSERT(is_busy_, "a request in progress");
    Request request = std::exchange(asked_, {});
    const Workers::Clock::time_point since = request.since;
    std::unique_ptr<State> former = std::move(former_);
    is_making_ = true;
    lock.unlock();
    std::unique_ptr<State> done;
    std::exception_ptr failure;
    try {
      keep_spare(std::make_shared<Scene>(request.scene->snapshot()));
      done = make_(std::move(request), former);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    ready_ = std::move(done);
    if (failure != nullptr) note_behind(since);
    worker_.keep_failure(std::move(failure));
    is_making_ = false;
    if (asked_.scene == nullptr) is_busy_ = false;
    worker_.notify();
    lock.unlock();
    // Frees the former state here, so that the thread that takes the new one does not have to.
    former.reset();
    lock.lock();
    return Workers::kAgain;
  }

  // These require that the mutex is held.
  void throw_failure() {
    const std::exception_ptr failure = worker_.take_failure();
    if (failure != nullptr) std::rethrow_exception(failure);
  }
  void note_behind(Workers::Clock::time_point since) {
    behind_since_ = is_behind_ ? std::min(behind_since_, since) : since;
    is_behind_ = true;
  }
  [[nodiscard]] bool is_idle() const { return !is_busy_ && !is_making_; }

  Make make_;

  State shown_;           // the owner's
  SceneChanges changes_;  // the owner's, kept for its memory

  mutable std::mutex mutex_;                 // of all below
  bool is_behind_ = false;                   // something changed that no snapshot has, or an update failed
  Workers::Clock::time_point behind_since_;  // if so: time of the first update that found it
  bool is_busy_ = false;                     // an update is requested or in progress, and its state not passed on
  bool is_making_ = false;                   // `make` runs
  Request asked_;                            // an update that has not begun
  std::shared_ptr<Scene> spare_;             // as the last request's scene; becomes the next one. Null: none is ready
  std::unique_ptr<State> ready_;             // to be taken
  std::unique_ptr<State> former_;            // was shown; belongs to the next update
  Workers worker_{mutex_};
};

}  // namespace quoin
