#include <quoin/scene/scene_tracer.h>

#include <algorithm>
#include <map>

#include "scene/placed_grid.h"
#include "scene/scene_tracer_impl.h"

namespace quoin {

SceneTracer::SceneTracer(const Scene& scene, bool hidden, Threads threads) : impl_(std::make_unique<Impl>()) {
  std::map<GridHandle, std::size_t> slots;
  std::vector<const SceneGrid*> grids;
  std::vector<DBox> boxes;
  std::vector<std::size_t> slot_of;
  impl_->scene = &scene;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid* grid = scene.grids().find(instance.grid);
    if (!can_be_traced(instance, grid, hidden)) continue;
    const auto [found, is_new] = slots.try_emplace(instance.grid, grids.size());
    if (is_new) grids.push_back(grid);
    slot_of.push_back(found->second);
    boxes.push_back(bounds_of(impl_->placed.emplace_back(placed_as(scene, handle))));
  }
  impl_->trees.resize(grids.size());
  parallel_for(grids.size(), threads, [&](std::size_t i) {
    const Grid& grid = grids[i]->grid;
    impl_->trees[i] = OpticalTrees::build(grid, scene.types);
  });
  for (std::size_t i = 0; i < slot_of.size(); ++i) {
    const OpticalTrees& trees = impl_->trees[slot_of[i]];
    impl_->placed[i].opaque = &trees.opaque;
    impl_->placed[i].transparent = trees.transparent ? &*trees.transparent : nullptr;
    impl_->has_transparent |= trees.transparent.has_value();
  }
  impl_->instances = InstanceTree(std::move(boxes));
}

SceneTracer::SceneTracer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

SceneTracer SceneTracer::with_detail(std::span<const SelectedInstance> selected, Threads threads) const {
  auto detailed = std::make_unique<Impl>();
  detailed->scene = impl_->scene;
  detailed->placed = impl_->placed;
  detailed->has_transparent = impl_->has_transparent;
  std::vector<DBox> boxes = impl_->instances.boxes();
  const CoarseGrids::Lock levels = impl_->coarse.make(*impl_->scene, selected, threads);
  auto next = detailed->placed.begin();
  for (const SelectedInstance& choice : selected) {
    next = std::lower_bound(next, detailed->placed.end(), choice.instance,
                            [](const PlacedGrid& placed, InstanceHandle handle) { return placed.instance < handle; });
    if (next == detailed->placed.end()) break;
    if (next->instance != choice.instance) continue;
    next->detail = choice.detail;
    const GridHandle grid = impl_->scene->instances()[choice.instance].grid;
    const CoarseLevel* level = levels.find(grid, choice.halvings);
    if (level == nullptr) continue;
    level->put_in(*next);
    boxes[static_cast<std::size_t>(next - detailed->placed.begin())] = bounds_of(*next);
  }
  detailed->instances = InstanceTree(std::move(boxes));
  return SceneTracer(std::move(detailed));
}

SceneTracer::SceneTracer(SceneTracer&&) noexcept = default;
SceneTracer& SceneTracer::operator=(SceneTracer&&) noexcept = default;
SceneTracer::~SceneTracer() = default;

const std::vector<PlacedGrid>& SceneTracer::placed() const {
  return impl_->placed;
}
bool SceneTracer::has_transparent() const {
  return impl_->has_transparent;
}

}  // namespace quoin
