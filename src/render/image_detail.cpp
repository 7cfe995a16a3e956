#include "render/image_detail.h"

#include <algorithm>
#include <limits>
#include <span>

#include <quoin/core/assert.h>

namespace quoin {
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
