#include "render/impostor/far.h"

#include <algorithm>
#include <chrono>

namespace quoin {
namespace {

// Grids that are asked for at once; no more, so that what they take beyond the limit is little.
constexpr std::size_t kAtOnce = 16;

using Clock = std::chrono::steady_clock;

// The grids of the far ones, each once, in the order of the instances.
std::vector<GridHandle> far_grids(const Scene& scene, std::span<const SelectedInstance> selected) {
  std::vector<GridHandle> grids;
  std::map<GridHandle, bool> known;
  for (const SelectedInstance& choice : selected) {
    if (choice.detail != Detail::Far) continue;
    const GridHandle grid = scene.instances()[choice.instance].grid;
    if (known.try_emplace(grid, true).second) grids.push_back(grid);
  }
  return grids;
}

}  // namespace

FarImpostors take_impostors(ImpostorCache& cache, const Scene& scene, std::span<const SelectedInstance> selected,
                            double seconds, Threads threads) {
  FarImpostors far;
  const auto begin = Clock::now();
  const std::vector<GridHandle> grids = far_grids(scene, selected);
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < grids.size() && bytes < FarImpostors::kMaxBytes; i += kAtOnce) {
    const auto some = std::span(grids).subspan(i, std::min(kAtOnce, grids.size() - i));
    for (const GridHandle grid : some) static_cast<void>(cache.find(scene, grid));
    const double left = seconds - std::chrono::duration<double>(Clock::now() - begin).count();
    if (left > 0.0) cache.build_some(scene, left, threads);
    for (const GridHandle grid : some) {
      std::shared_ptr<const Impostor> found = cache.find(scene, grid);
      if (found == nullptr) continue;
      bytes += found->bytes();
      if (bytes > FarImpostors::kMaxBytes) break;
      far.kept.emplace(grid, std::move(found));
    }
  }
  for (const SelectedInstance& choice : selected) {
    if (choice.detail != Detail::Far) continue;
    const auto found = far.kept.find(scene.instances()[choice.instance].grid);
    if (found != far.kept.end()) far.instances.push_back({choice.instance, found->second.get()});
  }
  return far;
}

}  // namespace quoin
