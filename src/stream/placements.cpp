#include "stream/placements.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

namespace quoin::stream {
namespace {

// World units: placements farther away are ignored.
constexpr double kMaxRadius = 1e12;
// Number of other placements checked per update.
constexpr std::size_t kSlice = 256;

void add_eyes(const Instance& instance, const SceneGrid& grid, std::span<const Viewer> viewers,
              std::vector<Eye>& eyes) {
  for (const Viewer& viewer : viewers) {
    if (!is_finite(viewer.position) || !(viewer.radius > 0.0)) continue;
    Eye eye;
    eye.position = grid_from_world(instance, grid, viewer.position);
    eye.radius = std::min(viewer.radius, kMaxRadius) / instance.voxel_size;
    eye.voxel_size = instance.voxel_size;
    const double length = glm::length(viewer.direction);
    if (std::isfinite(length) && length > 0.0) {
      eye.direction = glm::normalize(grid_from_world_direction(instance, viewer.direction / length));
    }
    if (is_finite(eye.position) && std::isfinite(eye.radius)) eyes.push_back(eye);
  }
}

double distance_of(const Eye& eye, const SceneGrid& grid) {
  return glm::length(eye.position - grid.pivot) * eye.voxel_size;
}

double distance_of(const Instance& instance, const SceneGrid& grid, std::span<const Viewer> viewers) {
  double least = std::numeric_limits<double>::infinity();
  for (const Viewer& viewer : viewers) {
    const double distance =
        glm::length(grid_from_world(instance, grid, viewer.position) - grid.pivot) * instance.voxel_size;
    if (distance < least) least = distance;  // false of NaN
  }
  return least;
}

}  // namespace

void Placements::clear() {
  placed_.clear();
  index_.clear();
  moved_.clear();
  looked_at_ = false;
}

void Placements::put(InstanceHandle instance) {
  const auto [found, is_new] = index_.try_emplace(instance, placed_.size());
  if (is_new) placed_.push_back({instance});
  if (found->second >= kNearest) moved_.push_back(instance);
}

void Placements::swap(std::size_t a, std::size_t b) {
  QUOIN_ASSERT(a < placed_.size() && b < placed_.size(), "two of the placements");
  std::swap(placed_[a], placed_[b]);
  index_[placed_[a].instance] = a;
  index_[placed_[b].instance] = b;
}

void Placements::remove(InstanceHandle instance) {
  const auto found = index_.find(instance);
  if (found == index_.end()) return;
  const std::size_t at = found->second;
  QUOIN_ASSERT(at < placed_.size() && placed_[at].instance == instance, "an index that matches the list");
  if (at + 1 != placed_.size()) swap(at, placed_.size() - 1);
  placed_.pop_back();
  index_.erase(instance);
  // The set of nearest placements has changed, even if another placement moved last.
  if (at < kNearest && placed_.size() > kNearest) looked_at_ = false;
}

std::vector<InstanceHandle> Placements::instances() const {
  QUOIN_ASSERT(index_.size() == placed_.size(), "an index of every placement");
  std::vector<InstanceHandle> all;
  all.reserve(placed_.size());
  for (const auto& [instance, at] : index_) all.push_back(instance);
  return all;
}

// Moves placements that are nearer than the farthest of the nearest set into that set.
void Placements::look(const Scene& scene, const SceneGrid& grid, std::span<const Viewer> viewers) {
  QUOIN_ASSERT(placed_.size() > kNearest, "more placements than are checked each time");
  const auto measure = [&](std::size_t at) {
    const Instance* const instance = scene.instances().find(placed_[at].instance);
    placed_[at].distance =
        instance == nullptr ? std::numeric_limits<double>::infinity() : distance_of(*instance, grid, viewers);
  };
  if (!looked_at_) {
    for (std::size_t i = 0; i < placed_.size(); ++i) measure(i);
    const auto end = placed_.begin() + static_cast<std::ptrdiff_t>(kNearest);
    std::nth_element(placed_.begin(), end, placed_.end(), [](const Placed& a, const Placed& b) {
      return a.distance != b.distance ? a.distance < b.distance : a.instance < b.instance;
    });
    for (std::size_t i = 0; i < placed_.size(); ++i) index_[placed_[i].instance] = i;
    moved_.clear();
    looked_at_ = true;
    return;
  }
  for (std::size_t i = 0; i < kNearest; ++i) measure(i);
  const auto bring = [&](std::size_t at) {
    measure(at);
    const auto near = std::span(placed_).first(kNearest);
    const auto farthest = std::ranges::max_element(near, {}, &Placed::distance);
    if (placed_[at].distance < farthest->distance) swap(at, static_cast<std::size_t>(farthest - near.begin()));
  };
  for (const InstanceHandle instance : std::exchange(moved_, {})) {
    const auto found = index_.find(instance);
    if (found != index_.end() && found->second >= kNearest) bring(found->second);
  }
  for (std::size_t i = 0; i < std::min(kSlice, placed_.size() - kNearest); ++i) {
    if (next_ >= placed_.size()) next_ = kNearest;
    bring(next_++);
  }
}

std::vector<Eye> Placements::eyes(const Scene& scene, const SceneGrid& grid, std::span<const Viewer> viewers) {
  if (placed_.size() > kNearest) look(scene, grid, viewers);
  // The order depends only on the instances.
  std::vector<InstanceHandle> near;
  for (std::size_t i = 0; i < std::min(kNearest, placed_.size()); ++i) near.push_back(placed_[i].instance);
  std::sort(near.begin(), near.end());
  std::vector<Eye> eyes;
  for (const InstanceHandle handle : near) {
    const Instance* const instance = scene.instances().find(handle);
    if (instance != nullptr) add_eyes(*instance, grid, viewers, eyes);
  }
  if (eyes.size() <= kNearest) return eyes;
  std::ranges::stable_sort(eyes, {}, [&](const Eye& eye) { return distance_of(eye, grid); });
  eyes.resize(kNearest);
  return eyes;
}

}  // namespace quoin::stream
