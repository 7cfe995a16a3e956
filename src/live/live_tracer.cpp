#include <quoin/live/live_tracer.h>

#include <optional>
#include <utility>

#include "live/latest_state.h"

namespace quoin {
namespace {

// A tracer, and the snapshot that it refers to.
struct TracedScene {
  std::shared_ptr<const Scene> scene;
  SceneTracer tracer;
};

using States = LatestState<TracedScene>;

// Returns the tracer of a snapshot: the former one with the changes since then, or a new one.
std::unique_ptr<TracedScene> traced(const std::shared_ptr<const Scene>& scene, std::unique_ptr<TracedScene>& former,
                                    InstanceFilter instances, Threads threads) {
  if (former == nullptr) {
    return std::make_unique<TracedScene>(TracedScene{scene, SceneTracer(*scene, instances, threads)});
  }
  // If this throws, the former tracer is destroyed, half updated.
  std::unique_ptr<TracedScene> state = std::move(former);
  state->tracer.update(*scene, threads);
  // Releases the former snapshot here: its chunks may be the last references to unloaded ones.
  state->scene = scene;
  return state;
}

TracedScene nothing(InstanceFilter instances) {
  auto scene = std::make_shared<const Scene>();
  SceneTracer tracer(*scene, instances, {1});
  return {std::move(scene), std::move(tracer)};
}

}  // namespace

struct LiveTracer::Impl {
  explicit Impl(const LiveTracerOptions& options)
      : states(
            nothing(options.instances),
            [instances = options.instances, threads = Threads{worker_count(options.threads)}](
                const States::Request& request, std::unique_ptr<TracedScene>& former) {
              return traced(request.scene, former, instances, threads);
            },
            "tracer") {}

  // Returns true if anything that the tracer may depend on has changed since the last call.
  [[nodiscard]] bool read_changes(const Scene& scene) {
    const bool is_any = scene.has_changed_since(followed_scene) || scene.types.has_changed_since(followed_types);
    if (!is_any) return false;
    followed_scene = scene.cursor();
    followed_types = scene.types.cursor();
    return true;
  }

  ChangeCursor followed_scene;
  ChangeCursor followed_types;
  States states;
};

LiveTracer::LiveTracer(LiveTracerOptions options) : impl_(std::make_unique<Impl>(options)) {}
LiveTracer::~LiveTracer() = default;

void LiveTracer::update(const Scene& scene) {
  impl_->states.update(scene, impl_->read_changes(scene));
}

bool LiveTracer::take() {
  return impl_->states.take();
}

const SceneTracer& LiveTracer::shown() const {
  return impl_->states.shown().tracer;
}

bool LiveTracer::is_late() const {
  return impl_->states.is_late();
}

void LiveTracer::finish(const Scene& scene) {
  do {
    update(scene);
    impl_->states.wait();
  } while (is_late());
}

}  // namespace quoin
