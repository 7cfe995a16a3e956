#include "render/impostor/far.h"

#include <algorithm>
#include <limits>

namespace quoin {
namespace {

// Number of grids to wait for at once without a time limit; small, so that memory beyond the limit stays small.
constexpr std::size_t kAtOnce = 16;

// Returns the grids of the far instances, each once, in the order of the instances.
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
                            double seconds, const ImpostorOptions& options) {
  FarImpostors far;
  const std::vector<GridHandle> grids = far_grids(scene, selected);
  const bool is_unlimited = seconds == std::numeric_limits<double>::infinity();
  const std::size_t at_once = is_unlimited ? kAtOnce : std::max<std::size_t>(grids.size(), 1);
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < grids.size() && bytes < FarImpostors::kMaxBytes; i += at_once) {
    const auto some = std::span(grids).subspan(i, std::min(at_once, grids.size() - i));
    for (const GridHandle grid : some) static_cast<void>(cache.find(scene, grid, options));
    cache.wait(scene, seconds);
    for (const GridHandle grid : some) {
      std::shared_ptr<const Impostor> found = cache.find(scene, grid, options);
      if (found == nullptr || found->is_left_to_rays()) continue;
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
