#include <quoin/scene/level_of_detail.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "scene/frustum.h"

namespace quoin {
namespace {

// Halvings until a cell spans at least `policy.voxel_pixels`.
int halvings_for(double voxel_pixels, const DetailPolicy& policy) {
  int halvings = 0;
  double cell_pixels = voxel_pixels;
  while (halvings < kCoarsestHalving && !(cell_pixels >= policy.voxel_pixels)) {
    ++halvings;
    cell_pixels *= 2.0;
  }
  return halvings;
}

// What the camera's picture makes of lengths.
class PixelScale {
 public:
  PixelScale(const Camera& camera, int height)
      : is_perspective_(camera.projection == Camera::Projection::Perspective),
        scale_(is_perspective_ ? 0.5 * height / std::tan(camera.vertical_fov / 2.0) : height / camera.view_height) {}

  [[nodiscard]] ScreenSize of(double distance, double radius, double voxel_size) const {
    if (!is_perspective_) return {voxel_size * scale_, 2.0 * radius * scale_};
    // From inside the content a voxel may be arbitrarily near; never infinite, which counts as nothing to see.
    constexpr double kNearest = 1e-3;  // voxels
    const double nearest = std::max(distance - radius, kNearest * voxel_size);
    return {voxel_size / nearest * scale_, 2.0 * radius / std::max(distance, kNearest * voxel_size) * scale_};
  }

 private:
  bool is_perspective_;
  double scale_;  // pixels: perspective of a unit at distance 1, else of a unit
};

// What is chosen of an instance, and remembered until the next time.
struct Choice {
  std::uint32_t generation = std::numeric_limits<std::uint32_t>::max();  // of the instance; none: nothing chosen yet
  std::uint8_t halvings = 0;
  bool is_far = false;
};

bool is_far(const ScreenSize& size, const DetailPolicy& policy) {
  return !(size.diameter_pixels > policy.far_pixels) || !std::isfinite(size.diameter_pixels);
}

ScreenSize scaled(const ScreenSize& size, double by) {
  return {size.voxel_pixels * by, size.diameter_pixels * by};
}

// The last choice stays while a size within the hysteresis of this one would give it.
Choice chosen_by_pixels(const ScreenSize& size, const DetailPolicy& policy, const Choice* last) {
  Choice choice;
  if (last == nullptr || !(policy.hysteresis > 0.0)) {
    choice.halvings = static_cast<std::uint8_t>(halvings_for(size.voxel_pixels, policy));
    choice.is_far = is_far(size, policy);
    return choice;
  }
  const ScreenSize larger = scaled(size, 1.0 + policy.hysteresis);
  const ScreenSize smaller = scaled(size, 1.0 / (1.0 + policy.hysteresis));
  const int fewest = halvings_for(larger.voxel_pixels, policy);
  const int most = halvings_for(smaller.voxel_pixels, policy);
  choice.halvings = static_cast<std::uint8_t>(std::clamp<int>(last->halvings, fewest, most));
  choice.is_far = last->is_far ? is_far(smaller, policy) : is_far(larger, policy);
  return choice;
}

}  // namespace

ContentSphere content_sphere(const Grid& grid) {
  const IBox box = grid.bounds();
  if (box.empty()) return {};
  const DVec3 low(box.min);
  const DVec3 high(box.max);
  return {0.5 * (low + high), 0.5 * glm::length(high - low)};
}

Detail detail_by_radius(double distance, double radius, const DetailPolicy& policy) {
  if (distance <= policy.near_radii * radius) return Detail::Near;
  return distance <= policy.mid_radii * radius ? Detail::Mid : Detail::Far;
}

Detail detail_by_pixels(const ScreenSize& size, const DetailPolicy& policy) {
  if (!std::isfinite(size.voxel_pixels) || is_far(size, policy)) return Detail::Far;
  return size.voxel_pixels < policy.voxel_pixels ? Detail::Mid : Detail::Near;
}

struct DetailSelector::Impl {
  struct Content {
    bool is_known = false;
    std::uint32_t generation = 0;  // of the grid
    std::uint64_t version = 0;
    ContentSphere sphere;
  };
  std::vector<Content> contents;  // by the grids' slots
  std::vector<Choice> choices;    // by the instances' slots

  void look_at_grids(const Scene& scene);
  Choice choose(InstanceHandle handle, const ScreenSize& size, double distance, double radius,
                const DetailPolicy& policy);
};

void DetailSelector::Impl::look_at_grids(const Scene& scene) {
  for (const GridHandle handle : scene.grids().handles()) {
    if (handle.index >= contents.size()) contents.resize(handle.index + std::size_t{1});
    const SceneGrid& grid = scene.grids()[handle];
    Content& content = contents[handle.index];
    const std::uint64_t version = grid.grid.version();
    if (!content.is_known || content.generation != handle.generation || content.version != version) {
      content = {true, handle.generation, version, content_sphere(grid.grid)};
    }
  }
}

Choice DetailSelector::Impl::choose(InstanceHandle handle, const ScreenSize& size, double distance, double radius,
                                    const DetailPolicy& policy) {
  if (handle.index >= choices.size()) choices.resize(handle.index + std::size_t{1});
  Choice& last = choices[handle.index];
  Choice choice;
  if (policy.rule == DetailPolicy::Rule::ByPixels) {
    choice = chosen_by_pixels(size, policy, last.generation == handle.generation ? &last : nullptr);
  } else {
    const Detail detail = detail_by_radius(distance, radius, policy);
    choice.is_far = detail == Detail::Far;
    const int halvings = std::max(halvings_for(size.voxel_pixels, policy), 1);
    choice.halvings = static_cast<std::uint8_t>(detail == Detail::Near ? 0 : halvings);
  }
  choice.generation = handle.generation;
  last = choice;
  return choice;
}

DetailSelector::DetailSelector() : impl_(std::make_unique<Impl>()) {}
DetailSelector::DetailSelector(DetailSelector&&) noexcept = default;
DetailSelector& DetailSelector::operator=(DetailSelector&&) noexcept = default;
DetailSelector::~DetailSelector() = default;

void DetailSelector::select(const Scene& scene, const Camera& camera, int width, int height, const DetailPolicy& policy,
                            std::vector<SelectedInstance>& out) {
  out.clear();
  impl_->look_at_grids(scene);
  const Frustum frustum(camera, width, height);
  const PixelScale pixels(camera, height);
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid* grid = scene.grids().find(instance.grid);
    if (grid == nullptr || !(instance.visible || policy.hidden) || !(instance.voxel_size > 0.0)) continue;
    const ContentSphere& content = impl_->contents[instance.grid.index].sphere;
    if (content.radius == 0.0) continue;
    DVec3 offset = (content.centre - grid->pivot) * instance.voxel_size;
    if (instance.mirrored) offset.x = -offset.x;
    // The difference of two far positions is taken first: it is small, and mostly exact.
    const DVec3 centre = (instance.position - camera.position) + instance.rotation * offset;
    const double radius = content.radius * instance.voxel_size;
    if (!is_finite(centre) || !std::isfinite(radius) || !frustum.meets(centre, radius)) continue;
    const double distance = glm::length(centre);
    const ScreenSize size = pixels.of(distance, radius, instance.voxel_size);
    const Choice choice = impl_->choose(handle, size, distance, radius, policy);
    const Detail detail = choice.is_far ? Detail::Far : choice.halvings > 0 ? Detail::Mid : Detail::Near;
    out.push_back({handle, detail, choice.halvings, distance});
  }
}

}  // namespace quoin
