#include "render/shared/image_detail.h"

#include <algorithm>
#include <limits>
#include <span>

#include <quoin/core/assert.h>

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
      if (found == nullptr || found->must_be_traced()) continue;
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

namespace {

std::vector<SelectedInstance> select(const Scene& scene, InstanceFilter filter, const Camera& camera,
                                     const RenderOptions& options) {
  QUOIN_ASSERT(options.detail.policy.has_value(), "options with a detail policy");
  DetailPolicy policy = *options.detail.policy;
  policy.instances = filter;
  std::vector<SelectedInstance> selected;
  DetailSelector without_memory;
  DetailSelector& selector = options.detail.selector != nullptr ? *options.detail.selector : without_memory;
  selector.select(scene, camera, options.width, options.height, policy, selected);
  return selected;
}

}  // namespace

void keep_whole(std::span<const FarInstance> far, std::span<SelectedInstance> selected) {
  auto next = far.begin();
  for (SelectedInstance& choice : selected) {
    if (next == far.end()) return;
    if (choice.instance != next->instance) continue;
    choice.level = 0;
    ++next;
  }
  QUOIN_ASSERT(next == far.end(), "far instances in the order of the selection");
}

ImageDetail DetailChooser::choose(const Scene& scene, InstanceFilter filter, const Camera& camera,
                                  const RenderOptions& options) {
  ImageDetail detail;
  if (!options.detail.policy) return detail;
  detail.selected = select(scene, filter, camera, options);
  detail.far = take_far(scene, detail.selected, options);
  return detail;
}

FarImpostors DetailChooser::take_far(const Scene& scene, const std::vector<SelectedInstance>& selected,
                                     const RenderOptions& options) {
  const auto is_far = [](const SelectedInstance& choice) { return choice.detail == Detail::Far; };
  if (std::none_of(selected.begin(), selected.end(), is_far)) return {};
  // Only one image waits at a time. Otherwise an image could end a round that protects another image's impostors.
  std::unique_lock lock(waiting_, std::defer_lock);
  if (options.detail.impostor_seconds == std::numeric_limits<double>::infinity()) lock.lock();
  return take_impostors(impostors_, scene, selected, options.detail.impostor_seconds, {options.detail.impostor_edge});
}

}  // namespace quoin
