#include <quoin/live/live_light.h>

#include <memory>
#include <mutex>
#include <utility>

#include <quoin/core/assert.h>

#include "core/work/workers.h"
#include "live/light_worker.h"

namespace quoin {

LightWorker::LightWorker(LiveLightOptions options)
    : threads_{worker_count(options.threads)},
      working_{nullptr, SceneLight(std::move(options.light))},
      states_(
          LitScene{nullptr, SceneLight()},
          [this](States::Request request, std::unique_ptr<LitScene>& /*former*/) { return make(std::move(request)); },
          "light") {}

// Returns the light of a request, or null if the receiver has it.
std::unique_ptr<LitScene> LightWorker::make(States::Request request) {
  working_.light.update(*request.scene, threads_);
  working_.scene = std::move(request.scene);
  auto done = std::make_unique<LitScene>(LitScene{working_.scene, working_.light.snapshot()});
  {
    const std::lock_guard lock(mutex_);
    if (receiver_ == nullptr) return done;
    newest_number_ = request.number;
  }
  auto state = std::make_shared<LitState>(
      LitState{{done->scene, done->light.snapshot()}, request.number, request.since, nullptr});
  state->to_show = states_.releases()->defer(std::shared_ptr<LitScene>(std::move(done)));
  receiver_(std::move(state));  // `detach` waits for the call
  return nullptr;
}

// Returns true if light depends on any change since the last call; `with_data`: or meshes do. Light depends on data if
// types have shapes. Scenes also report names and other voxel data.
bool LightWorker::read_changes(const Scene& scene, bool with_data) {
  PendingChanges types(followed_types_, scene.types);
  PendingChanges changes(followed_scene_, scene, changes_);
  with_data = (with_data && scene.types.has_remesh_on_data()) || scene.types.has_shapes();
  bool is_any = changes->all || !types->empty();
  if (changes->all) {
    followed_grids_.clear();
    changes->grids = scene.grids().handles();
  }
  for (const GridHandle handle : changes->grids) {
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

void LightWorker::update(const Scene& scene) {
  if (!has_receiver()) states_.update(scene, read_changes(scene, false));
}

void LightWorker::update_for_receiver(const Scene& scene, std::uint64_t number, bool is_other) {
  QUOIN_ASSERT(has_receiver(), "a receiver");
  const bool is_changed = read_changes(scene, true);
  states_.update(scene, is_changed || is_other, number);
}

bool LightWorker::take() {
  {
    const std::lock_guard lock(mutex_);
    if (receiver_ != nullptr) return std::exchange(is_shown_new_, false);
  }
  return states_.take();
}

bool LightWorker::is_late() const {
  const std::lock_guard lock(mutex_);
  return states_.is_late() || (receiver_ != nullptr && shown_number_ != newest_number_);
}

void LightWorker::attach(Receiver receiver) {
  QUOIN_ASSERT(!has_receiver() && receiver != nullptr, "one receiver at a time");
  states_.cancel();
  const std::lock_guard lock(mutex_);
  receiver_ = std::move(receiver);
  newest_number_ = shown_number_ = 0;
}

void LightWorker::detach() {
  if (!has_receiver()) return;
  states_.cancel();
  const std::lock_guard lock(mutex_);
  receiver_ = nullptr;
}

bool LightWorker::has_receiver() const {
  const std::lock_guard lock(mutex_);
  return receiver_ != nullptr;
}

void LightWorker::show(LitState& state) {
  if (state.to_show == nullptr) return;
  const std::lock_guard lock(mutex_);
  states_.exchange_shown(*state.to_show);
  state.to_show.reset();
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
  } while (is_late());
}

}  // namespace quoin
