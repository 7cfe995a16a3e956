#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/vec.h>

#include "render/path/kernel/shade.h"

namespace quoin::path {

/// The data of one lamp in a light tree.
struct LampBounds {
  Vec3 low{0.0F};
  Vec3 high{0.0F};
  Vec3 axis{0.0F, 0.0F, 1.0F};  ///< emission axis, unit
  float cos_spread = 1.0F;      ///< cosine of the largest angle between the axis and the lamp's normals; -1: all
                                ///< directions
  float cos_edge = 0.0F;        ///< cosine of the angle between a normal and the edge of its light; -1: no edge
  float power = 0.0F;           ///< positive
};

/// Chooses a random lamp for a point, in proportion to an estimate of its light there.
///
/// Source: A. Conty Estevez, C. Kulla, "Importance sampling of many lights with adaptive tree splitting" (2018), with
///         bounds that cost a square root instead of the six of M. Pharr et al., "Physically based rendering" (4th
///         ed.), 12.6.3.
class LightTree {
 public:
  LightTree() = default;
  /// Cost: O(lamps log(lamps)).
  explicit LightTree(std::span<const LampBounds> lamps);

  [[nodiscard]] bool empty() const { return nodes_.empty(); }

  struct Choice {
    std::int32_t lamp = -1;  ///< none
    float probability = 0.0F;
  };
  /// Nodes of the upper levels are numbered: the root is 0, the children of node i are 2 i + 1 and 2 i + 2.
  static constexpr int kTopLevels = 6;
  static constexpr std::size_t kTopNodes = (std::size_t{1} << (kTopLevels + 1)) - 1;
  /// Returns shares of 1 for all upper nodes.
  [[nodiscard]] static const float* whole_shares();

  /// `shares`: the learned shares of the upper nodes. Requires: 0 <= u < 1; `normal` is unit. Cost: O(log(lamps)).
  [[nodiscard]] Choice choose(Vec3 point, Vec3 normal, float u, const float* shares = whole_shares()) const;
  /// Returns the probability that `choose` selects the lamp.
  [[nodiscard]] float probability(std::uint32_t lamp, Vec3 point, Vec3 normal,
                                  const float* shares = whole_shares()) const;

  /// Calls `visit(number)` for the upper nodes above a lamp, and for the lamp's own node.
  template <class Visit>
  void for_each_top_node(std::uint32_t lamp, Visit&& visit) const {
    QUOIN_ASSERT(lamp < ways_.size(), "a lamp of the tree");
    std::uint64_t way = ways_[lamp];
    std::size_t number = 0;
    visit(number);
    std::int32_t at = 0;
    for (int level = 0; level < kTopLevels && at >= 0; ++level, way >>= 1) {
      const auto side = static_cast<std::size_t>(way & 1U);
      number = 2 * number + 1 + side;
      visit(number);
      at = branches_[static_cast<std::size_t>(at)].next[side];
    }
  }

  struct Node {
    LampBounds bounds;
    std::int32_t second = -1;  ///< of an inner node: the second child; the first child follows directly
    std::int32_t lamp = -1;    ///< of a leaf
  };
  // For kernels, which implement `choose` for many points at once; null for a tree without lamps.
  [[nodiscard]] const LampBranch* branches() const { return branches_.empty() ? nullptr : branches_.data(); }
  // For renderers with their own choice.
  [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }
  /// [lamp]: one bit per level from the root, 1: the second child.
  [[nodiscard]] std::span<const std::uint64_t> ways() const { return ways_; }

 private:
  class Builder;
  [[nodiscard]] static LampMeasures measures_of(const LampBounds& bounds);
  [[nodiscard]] static float importance(const LampMeasures& of, Vec3 point, Vec3 normal);
  void set_branches();

  std::vector<Node> nodes_;
  std::vector<LampBranch> branches_;  // the inner nodes; a single lamp has one, whose second child has no power
  std::vector<std::uint64_t> ways_;   // [lamp]: one bit per level, 1: the second child
};

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
