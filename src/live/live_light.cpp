#include <quoin/live/live_light.h>

#include <exception>
#include <map>
#include <mutex>
#include <utility>

#include <quoin/core/assert.h>

#include "core/work/workers.h"

namespace quoin {
namespace {

// The light of a scene as it was at one moment.
struct LitScene {
  std::shared_ptr<const Scene> scene;
  SceneLight light;
};

// Read positions in the changes of a grid, for voxels and fields.
struct GridCursors {
  ChangeCursor voxels;
  ChangeCursor field;
};

}  // namespace

struct LiveLight::Impl {
  explicit Impl(LiveLightOptions options)
      : threads{worker_count(options.threads)}, working{nullptr, SceneLight(std::move(options.light))} {
    worker.start(1, [this](Workers::Lock& lock, unsigned /*worker*/) { return step(lock); });
  }

  [[nodiscard]] Workers::Clock::time_point step(Workers::Lock& lock);
  void throw_failure();
  bool read_changes(const Scene& scene);
  void wait() {
    std::unique_lock lock(mutex);
    worker.wait(lock, [&] { return !is_busy; });
  }

  // The caller's.
  ChangeCursor followed_scene;
  ChangeCursor followed_types;
  std::map<GridHandle, GridCursors> followed_grids;
  bool is_behind = true;  // something changed that no snapshot has
  LitScene shown;

  // Used only by the worker thread.
  Threads threads;
  LitScene working;

  mutable std::mutex mutex;            // of all below
  bool is_busy = false;                // computing the requested light
  std::shared_ptr<const Scene> asked;  // to be lit
  std::unique_ptr<LitScene> ready;     // to be taken
  std::unique_ptr<LitScene> given_up;  // was shown; the worker destroys it, which takes a while
  Workers worker{mutex};
};

Workers::Clock::time_point LiveLight::Impl::step(Workers::Lock& lock) {
  if (asked == nullptr) return Workers::kWhenWoken;
  QUOIN_ASSERT(is_busy, "a request in progress");
  std::shared_ptr<const Scene> scene = std::exchange(asked, nullptr);
  lock.unlock();
  std::unique_ptr<LitScene> done;
  std::exception_ptr failure;
  try {
    working.light.update(*scene, threads);
    working.scene = std::move(scene);
    done = std::make_unique<LitScene>(LitScene{working.scene, working.light.snapshot()});
  } catch (...) {
    failure = std::current_exception();
  }
  lock.lock();
  std::swap(ready, done);  // `done` receives the light that was not taken
  // Frees the former light here, so that the thread that takes the new one does not have to.
  std::unique_ptr<LitScene> old = std::exchange(given_up, nullptr);
  worker.keep_failure(std::move(failure));
  is_busy = false;
  worker.notify();
  lock.unlock();
  done.reset();
  old.reset();
  lock.lock();
  return Workers::kAgain;
}

// Requires: the mutex is held.
void LiveLight::Impl::throw_failure() {
  const std::exception_ptr failure = worker.take_failure();
  if (failure == nullptr) return;
  is_behind = true;
  std::rethrow_exception(failure);
}

// Returns true if light depends on any change since the last call. Scenes also report names and voxel data, which light
// ignores.
bool LiveLight::Impl::read_changes(const Scene& scene) {
  PendingChanges types(followed_types, scene.types);
  PendingChanges changes(followed_scene, scene);
  bool is_any = changes->all || !types->empty();
  if (changes->all) followed_grids.clear();
  for (const GridHandle handle : changes->all ? scene.grids().handles() : changes->grids) {
    const SceneGrid* grid = scene.grids().find(handle);
    if (grid == nullptr) {
      is_any |= followed_grids.erase(handle) > 0;
      continue;
    }
    GridCursors& followed = followed_grids[handle];
    is_any |= grid->grid.has_changed_since(followed.voxels) || grid->field.has_changed_since(followed.field);
    followed = {grid->grid.cursor(), grid->field.cursor()};
  }
  types.commit();
  changes.commit();
  return is_any;
}

LiveLight::LiveLight(LiveLightOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
LiveLight::~LiveLight() = default;

void LiveLight::update(const Scene& scene) {
  Impl& me = *impl_;
  me.is_behind |= me.read_changes(scene);
  {
    const std::lock_guard lock(me.mutex);
    me.throw_failure();
    if (!me.is_behind || me.is_busy) return;
  }
  auto snapshot = std::make_shared<const Scene>(scene.snapshot());
  {
    const std::lock_guard lock(me.mutex);
    QUOIN_ASSERT(me.asked == nullptr && !me.is_busy, "one request at a time");
    me.asked = std::move(snapshot);
    me.is_busy = true;
    me.is_behind = false;
  }
  me.worker.wake_one();
}

bool LiveLight::take() {
  Impl& me = *impl_;
  const std::lock_guard lock(me.mutex);
  if (me.ready == nullptr) return false;
  std::swap(*me.ready, me.shown);
  me.given_up = std::move(me.ready);
  return true;
}

const SceneLight& LiveLight::shown() const {
  return impl_->shown.light;
}

bool LiveLight::is_late() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->is_behind || impl_->is_busy || impl_->ready != nullptr;
}

void LiveLight::finish(const Scene& scene) {
  do {
    update(scene);
    impl_->wait();
    {
      const std::lock_guard lock(impl_->mutex);
      impl_->throw_failure();
    }
    take();
  } while (is_late());
}

}  // namespace quoin
