#pragma once

#include <cstddef>
#include <limits>
#include <map>
#include <span>
#include <vector>

#include <quoin/scene/scene.h>
#include <quoin/stream/streamed_world.h>

#include "stream/stream_plan.h"

namespace quoin::stream {

/// The placements of one grid in a scene, nearest first: chunks loaded for these also serve the others.
///
///   [ the nearest kNearest, checked each time | the others, checked a few at a time ]
///
/// So the cost of an update does not grow with the instances. If thousands come nearer at once, the right ones are
/// found a few updates later. Exact for up to kNearest placements.
class Placements {
 public:
  static constexpr std::size_t kNearest = 64;

  void clear();
  /// Adds or moves an instance, or removes it if it no longer places this grid.
  void put(InstanceHandle instance);
  void remove(InstanceHandle instance);
  [[nodiscard]] bool contains(InstanceHandle instance) const { return index_.contains(instance); }
  [[nodiscard]] std::vector<InstanceHandle> instances() const;
  /// Returns viewers in the grid's space, at most kNearest, nearest first if there are that many.
  [[nodiscard]] std::vector<Eye> eyes(const Scene& scene, const SceneGrid& grid, std::span<const Viewer> viewers);
  /// Makes the next `eyes` check all instances.
  void look_at_all() { looked_at_ = false; }

 private:
  struct Placed {
    InstanceHandle instance;
    double distance = std::numeric_limits<double>::infinity();  // to the nearest viewer, at the last check
  };

  void swap(std::size_t a, std::size_t b);
  void look(const Scene& scene, const SceneGrid& grid, std::span<const Viewer> viewers);

  std::vector<Placed> placed_;
  std::map<InstanceHandle, std::size_t> index_;
  std::vector<InstanceHandle> moved_;  // instances outside the nearest set that moved since the last update
  std::size_t next_ = kNearest;
  bool looked_at_ = false;
};

}  // namespace quoin::stream
