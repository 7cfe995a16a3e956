#include "scene/coarse_grids.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <quoin/scene/scene_tracer.h>

namespace quoin {
namespace {

bool has_transparent_types(const Grid& grid, const VoxelRegistry& types) {
  const std::vector<VoxelType> all = grid.types();
  return std::any_of(all.begin(), all.end(), [&](VoxelType type) { return types.is_transparent(type); });
}

}  // namespace

OpticalTrees OpticalTrees::build(const Grid& grid, const VoxelRegistry& types) {
  OpticalTrees trees;
  trees.opaque = OccupancyTree::build(grid, types, Occupancy::Opaque);
  if (has_transparent_types(grid, types)) {
    trees.transparent.emplace(OccupancyTree::build(grid, types, Occupancy::Transparent));
  }
  return trees;
}

void CoarseLevel::put_in(PlacedGrid& placed) const {
  const double cell = std::ldexp(1.0, halvings);
  placed.voxels = voxels;
  placed.opaque = &trees.opaque;
  placed.transparent = trees.transparent ? &*trees.transparent : nullptr;
  placed.pivot = placed.grid->pivot / cell;
  placed.voxel_size *= cell;
  placed.halvings = halvings;
}

void CoarseGrids::Entry::make(const Grid& grid, const VoxelRegistry& types, int halvings, Threads threads) {
  if (version != grid.version()) levels.clear();
  version = grid.version();
  if (static_cast<int>(levels.size()) >= halvings) return;
  pyramid.update(grid, types, halvings, threads);
  for (int level = static_cast<int>(levels.size()) + 1; level <= pyramid.levels(); ++level) {
    const Grid& voxels = pyramid.level(level);
    levels.push_back(std::make_unique<CoarseLevel>(CoarseLevel{&voxels, level, OpticalTrees::build(voxels, types)}));
  }
}

const CoarseLevel* CoarseGrids::Lock::find(GridHandle grid, int halvings) const {
  const auto found = grids_->entries_.find(grid);
  if (halvings <= 0 || found == grids_->entries_.end() || found->second.levels.empty()) return nullptr;
  const auto& levels = found->second.levels;
  return levels[std::min(static_cast<std::size_t>(halvings), levels.size()) - 1].get();
}

CoarseGrids::Lock CoarseGrids::make(const Scene& scene, std::span<const SelectedInstance> selected, Threads threads) {
  Lock lock(*this);
  std::map<GridHandle, int> wanted;
  for (const SelectedInstance& choice : selected) {
    if (choice.halvings <= 0) continue;
    int& most = wanted[scene.instances()[choice.instance].grid];
    most = std::max(most, choice.halvings);
  }
  std::vector<std::pair<GridHandle, int>> tasks(wanted.begin(), wanted.end());
  for (const auto& [grid, halvings] : tasks) entries_[grid];
  const Threads inner = tasks.size() > 1 ? Threads{1} : threads;
  parallel_for(tasks.size(), threads, [&](std::size_t i) {
    const auto& [handle, halvings] = tasks[i];
    entries_.find(handle)->second.make(scene.grids()[handle].grid, scene.types, halvings, inner);
  });
  return lock;
}

}  // namespace quoin
