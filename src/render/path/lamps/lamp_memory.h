#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/vec.h>

#include "render/path/lamps/light_tree.h"

namespace quoin::path {

/// The share of lamp light that reaches a place, learned from earlier paths. A light tree ignores walls; the shares
/// correct its upper levels, so that fewer shadow rays end at walls.
///
///   place      one side of 8^3 voxels
///     table    [node of LightTree::kTopLevels]: its share, 1 if unknown
///
/// Notes take effect at the next `learn`. Until then shares are constant, so a path can query the probability of a hit
/// lamp. Estimates are unbiased for all shares, which are never 0.
class LampMemory {
 public:
  LampMemory();

  /// Returns the number of a place; 0 for places beyond the limit, which are not remembered. `of`: identifies the
  /// voxels' owner.
  [[nodiscard]] std::int32_t place_of(std::int32_t of, IVec3 voxel, Direction side);
  /// [place][node]: `LightTree::kTopNodes` per place.
  [[nodiscard]] const float* tables() const { return tables_.data(); }
  [[nodiscard]] const float* table(std::int32_t place) const {
    QUOIN_ASSERT(place >= 0 && static_cast<std::size_t>(place) < places_.size(), "a place that was returned");
    return tables_.data() + static_cast<std::size_t>(place) * LightTree::kTopNodes;
  }

  /// Records a lamp sample: its light divided by its probability, and if a wall blocked it.
  void note(const LightTree& tree, std::int32_t place, std::int32_t lamp, float light, bool is_blocked);
  /// Applies the notes. Requires: later lamp choices use random numbers independent of all earlier ones. Later points
  /// in a low-discrepancy sequence are not independent: they fill the gaps between the earlier points.
  void learn();

 private:
  static constexpr std::size_t kMostPlaces = 1'024;

  struct Light {
    float sent = 0.0F;
    float arrived = 0.0F;
  };
  struct Place {
    std::int32_t of = 0;
    IVec3 block{0};
    Direction side = Direction::PosX;
    bool is_new = false;  // something was noted
    float samples = 0.0F;
  };

  std::vector<Place> places_;
  std::vector<float> tables_;
  std::vector<Light> lights_;        // indexed like the tables
  std::vector<std::int32_t> slots_;  // of places by hash; a power of two; 0: free
};

}  // namespace quoin::path
