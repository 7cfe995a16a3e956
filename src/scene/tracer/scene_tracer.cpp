#include <quoin/scene/scene_tracer.h>

#include <algorithm>
#include <set>
#include <utility>

#include "core/moved_from.h"
#include "scene/tracer/placed_grid.h"
#include "scene/tracer/scene_tracer_impl.h"

namespace quoin {

SceneTracer::SceneTracer(const Scene& scene, InstanceFilter filter, Threads threads) : impl_(std::make_unique<Impl>()) {
  impl_of(impl_).scene = &scene;
  impl_of(impl_).filter = filter;
  impl_of(impl_).update(threads);
}

bool SceneTracer::update(Threads threads) {
  return impl_of(impl_).update(threads);
}

SceneTracer::SceneTracer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

SceneTracer SceneTracer::with_detail(std::span<const SelectedInstance> selected, Threads threads) const {
  auto detailed = std::make_unique<Impl>();
  detailed->scene = impl_of(impl_).scene;
  detailed->filter = impl_of(impl_).filter;
  detailed->placed = impl_of(impl_).placed;
  detailed->has_transparent = impl_of(impl_).has_transparent;
  detailed->unloaded = impl_of(impl_).unloaded;
  std::vector<InstanceTree::Change> halved;
  const HalvedGridCache::Lock levels = impl_of(impl_).coarse.make(*impl_of(impl_).scene, selected, threads);
  auto next = detailed->placed.begin();
  for (const SelectedInstance& choice : selected) {
    next = std::lower_bound(next, detailed->placed.end(), choice.instance,
                            [](const PlacedGrid& placed, InstanceHandle handle) { return placed.instance < handle; });
    if (next == detailed->placed.end()) break;
    if (next->instance != choice.instance) continue;
    next->detail = choice.detail;
    const GridHandle grid = impl_of(impl_).scene->instances()[choice.instance].grid;
    const CoarseLevel* level = levels.find(grid, choice.level);
    if (level == nullptr) continue;
    level->put_in(*next);
    halved.push_back({static_cast<std::size_t>(next - detailed->placed.begin()), bounds_in_world(*next, level->tight)});
  }
  detailed->instances = impl_of(impl_).instances;
  detailed->instances.change(halved);
  return SceneTracer(std::move(detailed));
}

SceneTracer::SceneTracer(SceneTracer&&) noexcept = default;
SceneTracer& SceneTracer::operator=(SceneTracer&&) noexcept = default;
SceneTracer::~SceneTracer() = default;

const Scene& SceneTracer::scene() const {
  return *impl_of(impl_).scene;
}
const SceneTracer::Impl& SceneTracer::impl() const {
  return impl_of(impl_);
}

const std::vector<PlacedGrid>& placed_in(const SceneTracer& tracer) {
  return tracer.impl().placed;
}
bool SceneTracer::has_transparent() const {
  return impl_of(impl_).has_transparent;
}
std::size_t SceneTracer::bytes() const {
  std::set<const OccupancyTree*> trees;
  const auto add_cells = [&](const DensityTree* field) {
    if (field != nullptr) trees.insert(&field->cells());
  };
  for (const PlacedGrid& placed : impl_of(impl_).placed) {
    trees.insert({placed.opaque, placed.transparent});
    add_cells(placed.field);
    add_cells(placed.opaque_field);
  }
  trees.erase(nullptr);
  std::size_t total = 0;
  for (const OccupancyTree* tree : trees) total += tree->bytes();
  return total;
}

}  // namespace quoin
