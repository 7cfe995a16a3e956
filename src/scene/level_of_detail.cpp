#include <quoin/scene/level_of_detail.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "core/coordinates/unit_rotation.h"
#include "core/moved_from.h"
#include "scene/frustum.h"

namespace quoin {
namespace {

// Returns the number of halvings that keep a cell within `policy.cell_pixels`.
int halvings_for(double voxel_pixels, const DetailPolicy& policy) {
  static_assert(kMaxGridLevel == 4);
  // Halving and doubling are exact: 16 times a size is within the limit if the size is within its sixteenth.
  const double cell = policy.cell_pixels;
  return static_cast<int>(voxel_pixels <= 0.5 * cell) + static_cast<int>(voxel_pixels <= 0.25 * cell) +
         static_cast<int>(voxel_pixels <= 0.125 * cell) + static_cast<int>(voxel_pixels <= 0.0625 * cell);
}

// Converts lengths to pixels in the camera's image.
class PixelScale {
 public:
  PixelScale(const Camera& camera, int height)
      : is_perspective_(camera.projection == Camera::Projection::Perspective),
        scale_(is_perspective_ ? 0.5 * height / std::tan(camera.vertical_fov_radians / 2.0)
                               : height / camera.view_height) {}

  [[nodiscard]] ScreenSize of(double distance, double radius, double voxel_size) const {
    if (!is_perspective_) return {voxel_size * scale_, 2.0 * radius * scale_};
    // Inside the content a voxel may be arbitrarily near. The size stays finite, because infinite sizes count as
    // invisible.
    constexpr double kNearest = 1e-3;  // voxels
    const double nearest = std::max(distance - radius, kNearest * voxel_size);
    return {voxel_size / nearest * scale_, 2.0 * radius / std::max(distance, kNearest * voxel_size) * scale_};
  }

 private:
  bool is_perspective_;
  double scale_;  // pixels: perspective of a unit at distance 1, else of a unit
};

// The level of detail chosen for an instance, kept for the next call.
struct Choice {
  std::uint64_t generation = 0;  // of the instance; 0: no choice yet
  std::uint8_t level = 0;
  Detail detail = Detail::Near;
};

bool is_far(const ScreenSize& size, const DetailPolicy& policy) {
  // Sizes are never negative, so a comparison with infinity tests that they are finite. It is false for NaN.
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return !(size.voxel_pixels < kInfinity && size.diameter_pixels < kInfinity && size.voxel_pixels > -kInfinity) ||
         size.diameter_pixels <= policy.far_pixels;
}

// The measurements of an instance in a view.
struct Measure {
  ScreenSize size;
  double distance = 0.0;
  double radius = 0.0;

  // Returns the measurements as seen through a lens.
  [[nodiscard]] Measure zoomed(double by) const {
    return {{size.voxel_pixels * by, size.diameter_pixels * by}, distance / by, radius};
  }
  [[nodiscard]] Detail detail(const DetailPolicy& policy) const {
    return policy.rule == DetailPolicy::Rule::ByPixels ? detail_by_pixels(size, policy)
                                                       : detail_by_radius(distance, radius, policy);
  }
  [[nodiscard]] int halvings(const DetailPolicy& policy) const {
    const int least = policy.rule == DetailPolicy::Rule::ByPixels ? 0 : 1;
    return std::max(halvings_for(size.voxel_pixels, policy), least);
  }
};

// Keeps the last choice while a measure within the hysteresis of the current measure would give it.
Choice chosen(const Measure& measure, const DetailPolicy& policy, const Choice* last) {
  const bool has_room = last != nullptr && policy.hysteresis > 0.0;
  const double room = has_room ? 1.0 + policy.hysteresis : 1.0;
  const Measure larger = measure.zoomed(room);
  Choice choice;
  choice.detail = larger.detail(policy);
  int halvings = larger.halvings(policy);
  if (has_room) {
    const Measure smaller = measure.zoomed(1.0 / room);
    if (choice.detail != Detail::Far) {
      choice.detail = std::clamp(last->detail, choice.detail, smaller.detail(policy));
    }
    halvings = std::clamp<int>(last->level, halvings, smaller.halvings(policy));
  }
  choice.level = static_cast<std::uint8_t>(choice.detail == Detail::Near ? 0 : halvings);
  return choice;
}

}  // namespace

ContentSphere content_sphere(const Grid& grid) {
  return content_sphere(grid.bounds());
}

ContentSphere content_sphere(const SceneGrid& grid) {
  return content_sphere(grid.bounds());
}

ContentSphere content_sphere(const IBox& bounds) {
  if (bounds.empty()) return {};
  const DVec3 low(bounds.min);
  const DVec3 high(bounds.max);
  return {0.5 * (low + high), 0.5 * glm::length(high - low)};
}

Detail detail_by_radius(double distance, double radius, const DetailPolicy& policy) {
  if (distance <= policy.near_radii * radius) return Detail::Near;
  return distance <= policy.mid_radii * radius ? Detail::Mid : Detail::Far;
}

Detail detail_by_pixels(const ScreenSize& size, const DetailPolicy& policy) {
  if (is_far(size, policy)) return Detail::Far;
  return size.voxel_pixels < policy.voxel_pixels ? Detail::Mid : Detail::Near;
}

struct DetailSelector::Impl {
  struct Content {
    std::uint64_t generation = 0;  // of the grid's handle
    bool is_there = false;         // now
    ContentSphere sphere;
    DVec3 from_pivot{0.0};  // the sphere's centre, in voxels
  };
  std::vector<Content> contents;  // by the grids' slots
  std::vector<Choice> choices;    // by the instances' slots

  // An instance whose content intersects the camera's frustum.
  struct Seen {
    InstanceHandle instance;
    DVec3 centre{0.0};  // of the content, from the camera
    double radius = 0.0;
    double voxel_size = 0.0;
  };
  std::vector<Seen> seen;  // room for every instance

  ChangeCursor followed;  // of the scene

  void look_at_grids(const Scene& scene);
  void look_at_grid(GridHandle handle, const SceneGrid& grid);
  std::span<const Seen> look_at_instances(const Scene& scene, DVec3 camera, const Frustum& frustum,
                                          InstanceFilter filter);
  Choice choose(InstanceHandle handle, const Measure& measure, const DetailPolicy& policy);
};

void DetailSelector::Impl::look_at_grids(const Scene& scene) {
  PendingChanges changes(followed, scene);
  if (changes->all) {
    for (Content& content : contents) content.is_there = false;
    scene.grids().for_each([&](GridHandle handle, const SceneGrid& grid) { look_at_grid(handle, grid); });
  }
  for (const GridHandle handle : changes->grids) {
    const SceneGrid* grid = scene.grids().find(handle);
    if (grid != nullptr) {
      look_at_grid(handle, *grid);
    } else if (handle.index < contents.size() && contents[handle.index].generation == handle.generation) {
      contents[handle.index].is_there = false;
    }
  }
  changes.commit();
}

void DetailSelector::Impl::look_at_grid(GridHandle handle, const SceneGrid& grid) {
  if (handle.index >= contents.size()) contents.resize(handle.index + std::size_t{1});
  Content& content = contents[handle.index];
  content.sphere = content_sphere(grid);
  content.generation = handle.generation;
  content.is_there = content.sphere.radius > 0.0;
  content.from_pivot = content.sphere.centre - grid.pivot;
}

// Writes each instance before its visibility is known, because the branch is unpredictable (saves a tenth of the time).
std::span<const DetailSelector::Impl::Seen> DetailSelector::Impl::look_at_instances(const Scene& scene, DVec3 camera,
                                                                                    const Frustum& frustum,
                                                                                    InstanceFilter filter) {
  if (seen.size() < scene.instances().size()) seen.resize(scene.instances().size());
  std::size_t count = 0;
  scene.instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    if (instance.grid.index >= contents.size() || !passes(filter, scene, instance)) return;
    const Content& content = contents[instance.grid.index];
    const double voxel_size = instance.voxel_size;
    if (!content.is_there || content.generation != instance.grid.generation || !(voxel_size > 0.0)) return;
    DVec3 offset = content.from_pivot * voxel_size;
    if (instance.mirrored) offset.x = -offset.x;
    // The difference of two far positions is taken first: it is small, and mostly exact.
    const DVec3 centre = (instance.position - camera) + unit_rotation(instance.rotation) * offset;
    const double radius = content.sphere.radius * voxel_size;
    QUOIN_ASSERT(count < seen.size(), "room for every instance");
    seen[count] = {handle, centre, radius, voxel_size};
    count += static_cast<std::size_t>(is_finite(centre + radius) && frustum.meets(centre, radius));
  });
  return {seen.data(), count};
}

Choice DetailSelector::Impl::choose(InstanceHandle handle, const Measure& measure, const DetailPolicy& policy) {
  if (handle.index >= choices.size()) choices.resize(handle.index + std::size_t{1});
  QUOIN_ASSERT(handle.generation != 0, "the handle of an instance");
  Choice& last = choices[handle.index];
  Choice choice = chosen(measure, policy, last.generation == handle.generation ? &last : nullptr);
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
  QUOIN_ASSERT(width > 0 && height > 0, "a positive image size");
  out.clear();
  impl_of(impl_).look_at_grids(scene);
  const Frustum frustum(camera, width, height);
  const PixelScale pixels(camera, height);
  for (const Impl::Seen& seen : impl_of(impl_).look_at_instances(scene, camera.position, frustum, policy.instances)) {
    const double distance = glm::length(seen.centre);
    const Measure measure{pixels.of(distance, seen.radius, seen.voxel_size), distance, seen.radius};
    const Choice choice = impl_of(impl_).choose(seen.instance, measure, policy);
    out.push_back({seen.instance, choice.detail, choice.level, distance});
  }
}

}  // namespace quoin
