#include <quoin/live/live_light.h>

#include <exception>
#include <map>
#include <mutex>
#include <utility>

#include <quoin/core/assert.h>

#include "core/work/workers.h"
#include "live/light_worker.h"

namespace quoin {

LightWorker::LightWorker(LiveLightOptions options)
    : shown_{nullptr, SceneLight()},
      threads_{worker_count(options.threads)},
      working_{nullptr, SceneLight(std::move(options.light))} {
  worker_.start(1, [this](Workers::Lock& lock, unsigned /*worker*/) { return step(lock); }, {.name = "light"});
}

Workers::Clock::time_point LightWorker::step(Workers::Lock& lock) {
  if (asked_ == nullptr) return Workers::kWhenWoken;
  QUOIN_ASSERT(is_busy_, "a request in progress");
  std::shared_ptr<const Scene> scene = std::exchange(asked_, nullptr);
  const Workers::Clock::time_point asked = asked_at_;
  lock.unlock();
  std::unique_ptr<LitScene> done;
  std::exception_ptr failure;
  try {
    working_.light.update(*scene, threads_);
    working_.scene = std::move(scene);
    done = std::make_unique<LitScene>(LitScene{working_.scene, working_.light.snapshot()});
  } catch (...) {
    failure = std::current_exception();
  }
  lock.lock();
  try {
    if (done != nullptr) give(lock, std::move(done));
  } catch (...) {
    failure = std::current_exception();
  }
  if (failure != nullptr) {
    is_behind_ = true;
    behind_since_ = asked;
  }
  worker_.keep_failure(std::move(failure));
  if (asked_ == nullptr) is_busy_ = false;
  worker_.notify();
  // Frees the former light here, so that the thread that takes the new one does not have to.
  std::unique_ptr<LitScene> old = std::exchange(spent_, nullptr);
  lock.unlock();
  old.reset();
  lock.lock();
  return Workers::kAgain;
}

// Requires: the lock is held; it is released meanwhile.
void LightWorker::give(Workers::Lock& lock, std::unique_ptr<LitScene> done) {
  if (receiver_ == nullptr) {
    std::swap(ready_, done);  // `done` receives the light that was not taken
    lock.unlock();
    done.reset();
    lock.lock();
    return;
  }
  const Receiver& receiver = receiver_;  // `detach` waits for the call
  const std::uint64_t number = newest_number_ = asked_number_;
  const Workers::Clock::time_point asked = asked_at_;
  is_giving_ = true;
  lock.unlock();
  std::exception_ptr failure;
  try {
    auto state =
        std::make_shared<LitState>(LitState{{done->scene, done->light.snapshot()}, number, asked, std::move(done)});
    receiver(std::move(state));
  } catch (...) {
    failure = std::current_exception();
  }
  lock.lock();
  is_giving_ = false;
  if (failure != nullptr) std::rethrow_exception(failure);
}

// Requires: the mutex is held.
void LightWorker::throw_failure() {
  const std::exception_ptr failure = worker_.take_failure();
  if (failure != nullptr) std::rethrow_exception(failure);
}

// Returns true if light depends on any change since the last call; `with_data`: or meshes do. Scenes also report names
// and other voxel data.
bool LightWorker::read_changes(const Scene& scene, bool with_data) {
  PendingChanges types(followed_types_, scene.types);
  PendingChanges changes(followed_scene_, scene);
  with_data &= scene.types.has_remesh_on_data();
  bool is_any = changes->all || !types->empty();
  if (changes->all) followed_grids_.clear();
  for (const GridHandle handle : changes->all ? scene.grids().handles() : changes->grids) {
    const SceneGrid* grid = scene.grids().find(handle);
    if (grid == nullptr) {
      is_any |= followed_grids_.erase(handle) > 0;
      continue;
    }
    GridCursors& followed = followed_grids_[handle];
    is_any |= grid->grid.has_changed_since(followed.voxels) || grid->field.has_changed_since(followed.field);
    is_any |= with_data && grid->grid.has_data_changed_since(followed.voxels);
    followed = {grid->grid.cursor(), grid->field.cursor()};
  }
  types.commit();
  changes.commit();
  return is_any;
}

void LightWorker::ask(const Scene& scene, std::uint64_t number) {
  {
    const std::lock_guard lock(mutex_);
    if (is_behind_ && behind_since_ == kNever) behind_since_ = Workers::Clock::now();
    throw_failure();
    if (!is_behind_ || is_busy_) return;
  }
  auto snapshot = std::make_shared<const Scene>(scene.snapshot());
  {
    const std::lock_guard lock(mutex_);
    QUOIN_ASSERT(asked_ == nullptr && !is_busy_, "one request at a time");
    asked_ = std::move(snapshot);
    asked_number_ = number;
    asked_at_ = std::exchange(behind_since_, kNever);
    is_busy_ = true;
    is_behind_ = false;
  }
  worker_.wake_one();
}

void LightWorker::update(const Scene& scene) {
  if (has_receiver()) return;
  const bool is_changed = read_changes(scene, false);
  {
    const std::lock_guard lock(mutex_);
    is_behind_ |= is_changed;
  }
  ask(scene, 0);
}

void LightWorker::update_for_receiver(const Scene& scene, std::uint64_t number, bool is_other) {
  const bool is_changed = read_changes(scene, true);
  {
    const std::lock_guard lock(mutex_);
    QUOIN_ASSERT(receiver_ != nullptr, "a receiver");
    is_behind_ |= is_changed || is_other;
  }
  ask(scene, number);
}

bool LightWorker::take() {
  const std::lock_guard lock(mutex_);
  if (receiver_ != nullptr) return std::exchange(is_shown_new_, false);
  if (ready_ == nullptr) return false;
  std::swap(*ready_, shown_);
  spent_ = std::move(ready_);
  return true;
}

bool LightWorker::is_late() const {
  const std::lock_guard lock(mutex_);
  return is_behind_ || is_busy_ || ready_ != nullptr || (receiver_ != nullptr && shown_number_ != newest_number_);
}

void LightWorker::wait() {
  std::unique_lock lock(mutex_);
  worker_.wait(lock, [&] { return is_idle(); });
  throw_failure();
}

void LightWorker::attach(Receiver receiver) {
  std::shared_ptr<const Scene> cancelled;  // destroyed without the lock
  std::unique_lock lock(mutex_);
  QUOIN_ASSERT(receiver_ == nullptr && receiver != nullptr, "one receiver at a time");
  cancelled = cancel_request();
  worker_.wait(lock, [&] { return is_idle(); });
  receiver_ = std::move(receiver);
  ready_.reset();
  is_behind_ = true;
  newest_number_ = shown_number_ = 0;
}

void LightWorker::detach() {
  std::shared_ptr<const Scene> cancelled;  // destroyed without the lock
  std::unique_lock lock(mutex_);
  if (receiver_ == nullptr) return;
  cancelled = cancel_request();
  worker_.wait(lock, [&] { return is_idle(); });
  receiver_ = nullptr;
  is_behind_ = true;
}

// Cancels a request that the worker has not begun, and returns its scene. Requires: the mutex is held.
std::shared_ptr<const Scene> LightWorker::cancel_request() {
  if (asked_ == nullptr) return nullptr;
  is_busy_ = false;  // a request is made only when the earlier one was received
  is_behind_ = true;
  behind_since_ = asked_at_;
  return std::exchange(asked_, nullptr);
}

bool LightWorker::has_receiver() const {
  const std::lock_guard lock(mutex_);
  return receiver_ != nullptr;
}

bool LightWorker::is_state_pending() const {
  const std::lock_guard lock(mutex_);
  return is_behind_ || is_busy_;
}

void LightWorker::note_received() {
  const std::lock_guard lock(mutex_);
  if (asked_ == nullptr) is_busy_ = false;
}

void LightWorker::show(LitState& state) {
  const std::lock_guard lock(mutex_);
  if (std::exchange(state.is_shown, true)) return;
  std::swap(*state.to_show, shown_);
  spent_ = std::move(state.to_show);
  shown_number_ = state.number;
  is_shown_new_ = true;
}

LiveLight::LiveLight(LiveLightOptions options) : worker_(std::make_shared<LightWorker>(std::move(options))) {}
LiveLight::~LiveLight() = default;

void LiveLight::update(const Scene& scene) {
  worker_->update(scene);
}

bool LiveLight::take() {
  return worker_->take();
}

const SceneLight& LiveLight::shown() const {
  return worker_->shown();
}

bool LiveLight::is_late() const {
  return worker_->is_late();
}

void LiveLight::finish(const Scene& scene) {
  if (worker_->has_receiver()) return;
  do {
    update(scene);
    worker_->wait();
    take();
  } while (is_late());
}

}  // namespace quoin
