#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>

#include "render/path/lamps/light_tree.h"

namespace quoin::path {

/// How much of what lamps would send to a place gets there, as far as paths found out that passed it: a tree over lamps
/// knows of no walls. By it the tree is corrected, node by node of its upper levels, so that fewer rays end at walls.
///
///   place      one side of 8^3 voxels
///     table    [node of LightTree::kTopLevels]: its share, 1 where nothing is known
///
/// What is noted counts from the next `learn` on; until then shares stay as they are, so that a path may ask for the
/// chance of a lamp that it meets. What is chosen remains right whatever the shares, which are never 0.
class LampMemory {
 public:
  LampMemory();

  /// The number of a place; 0 for those of which nothing is remembered, since there are too many. `of`: tells what the
  /// voxels belong to.
  [[nodiscard]] std::int32_t place_of(std::int32_t of, IVec3 voxel, Direction side);
  /// [place][node]: `LightTree::kTopNodes` a place.
  [[nodiscard]] const float* tables() const { return tables_.data(); }
  [[nodiscard]] const float* table(std::int32_t place) const {
    return tables_.data() + static_cast<std::size_t>(place) * LightTree::kTopNodes;
  }

  /// That a sample of a lamp would have brought so much light, divided by its chance, and whether a wall was between.
  void note(const LightTree& tree, std::int32_t place, std::int32_t lamp, float light, bool is_blocked);
  /// Requires: lamps that are chosen from here on are chosen by numbers that those of before tell nothing of, also not
  /// as later ones of one low-discrepancy sequence: these go where earlier ones were not.
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
  std::vector<Light> lights_;        // as the tables
  std::vector<std::int32_t> slots_;  // of places by hash; a power of two; 0: free
};

}  // namespace quoin::path
