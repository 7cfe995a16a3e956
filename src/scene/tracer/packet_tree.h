#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>
#include <quoin/trace/packet.h>

#include "scene/tracer/instance_tree.h"

namespace quoin {

/// Four numbers side by side.
using Four = float __attribute__((vector_size(16)));
using FourBits = std::int32_t __attribute__((vector_size(16)));

/// Bit i: number i of a comparison is true.
[[nodiscard]] inline unsigned bits_of(FourBits mask) {
#if defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(mask)));
#else
  return (static_cast<unsigned>(mask[0]) & 1U) | (static_cast<unsigned>(mask[1]) & 2U) |
         (static_cast<unsigned>(mask[2]) & 4U) | (static_cast<unsigned>(mask[3]) & 8U);
#endif
}

/// The planes of four boxes: the upper ends along x, y and z, and the negated lower ends.
using FourBoxes = std::array<Four, 6>;

/// Distances are scaled in single precision, so that the longest component of any direction is 1. These constants
/// exceed the rounding errors of the few steps from a plane to its distance:
inline constexpr float kDistanceRoom = 1.0F + 2e-6F;
inline constexpr float kLeastDistance = 1e-37F;

/// Bounds of all active rays of a packet.
class PacketBounds {
 public:
  explicit PacketBounds(const RayPacket& rays);

  /// Returns the factor for distances along the rays. 0: no ray has a direction.
  [[nodiscard]] float scale() const { return scale_; }
  /// Returns true if single precision can represent the lengths of the directions; otherwise the rays may hit anything.
  [[nodiscard]] bool is_usual() const { return is_usual_; }
  /// Sets the maximum distance of all rays, in ray units.
  void set_reach(double max_t) { max_t_ = std::min(static_cast<float>(max_t * double{scale_}), kFarthest); }
  /// Returns true if a box that begins at `near` (scaled) is within reach.
  [[nodiscard]] bool reaches(float near) const { return near <= max_t_ * kDistanceRoom + kLeastDistance; }

  /// Clears bit i only if no ray hits box i. `near` receives the lower bounds of the hit distances (scaled).
  [[nodiscard]] unsigned meet(const FourBoxes& boxes, Four& near) const {
    Four low{};
    Four high = Four{} + max_t_;
    std::size_t i = 0;
    for (; i < lower_count_; ++i) {
      const Four t = (boxes[limits_[i].plane] - limits_[i].origin) * limits_[i].inverse;
      low = t > low ? t : low;
    }
    for (; i < limits_.size(); ++i) {
      const Four t = (boxes[limits_[i].plane] - limits_[i].origin) * limits_[i].inverse;
      high = t < high ? t : high;
    }
    near = low;
    return bits_of(low <= high * kDistanceRoom + kLeastDistance);
  }

 private:
  // `origin + t * direction` is at most the plane: for a direction above 0 until t, for any other from t on.
  struct Limit {
    float origin = 0.0F;
    float inverse = 0.0F;
    std::size_t plane = 0;
  };
  static constexpr float kFarthest = 1e38F;
  float scale_ = 0.0F;
  bool is_usual_ = false;
  float max_t_ = 0.0F;
  std::size_t lower_count_ = 0;  // the lower limits come first in `limits_`
  std::array<Limit, 6> limits_;
};

/// The single rays of a packet.
class PacketLanes {
 public:
  PacketLanes(const RayPacket& rays, const PacketBounds& bounds);

  void set_reach(int lane, double max_t) {
    QUOIN_ASSERT(lane >= 0 && lane < RayPacket::kSize, "0 <= lane < kSize");
    max_t_[static_cast<std::size_t>(lane)] = static_cast<float>(max_t * double{scale_});
  }
  /// Clears bit i only if ray i, active or not, misses the given box.
  [[nodiscard]] std::uint32_t meet(const FourBoxes& boxes, std::size_t box) const;

 private:
  static constexpr std::size_t kFours = RayPacket::kSize / 4;
  // The origin lies between these two.
  struct Axis {
    std::array<Four, kFours> origin_low;
    std::array<Four, kFours> origin_high;
    std::array<Four, kFours> inverse;
  };
  static void set(Axis& axis, const RayPacket::Lanes<double>& origin, const RayPacket::Lanes<double>& direction,
                  double inverse_scale);

  std::array<Axis, 3> axes_;
  alignas(16) RayPacket::Lanes<float> max_t_{};
  float scale_;
  bool is_usual_;
};

/// An InstanceTree for packets of rays near one point: tests four boxes at a time, in single precision.
///
/// Boxes are rounded outwards, so that no hit is missed. Space: the tree's, with `origin` in the middle.
class PacketTree {
 public:
  PacketTree() = default;
  /// Omits each box whose entry in `left_out` (one per box, or empty) is set. Cost: O(n).
  PacketTree(const InstanceTree& tree, DVec3 origin, const std::vector<bool>& left_out = {});

  /// Calls `visit(index, boxes, box)` for every box that the rays may hit, from near to far, until it returns false.
  /// `box` is the index within the four `boxes`. `visit` may lower the reach of the rays.
  template <class Visit>
  void visit(const PacketBounds& rays, Visit&& visit) const {
    if (nodes_.empty() || !(rays.scale() > 0.0F)) return;
    std::array<Entry, kMaxHeight> stack;
    stack[0] = {0, kWhole, 0.0F};
    std::size_t height = 1;
    while (height > 0) {
      const Entry top = stack[--height];
      if (!rays.reaches(top.near)) continue;
      if (top.slot != kWhole) {
        const Node& node = nodes_[top.node];
        if (!visit(static_cast<std::size_t>(node.children[top.slot]), node.boxes, std::size_t{top.slot})) return;
        continue;
      }
      height = push_children(rays, top.node, stack.data(), height);
    }
  }

 private:
  // Four levels for each of at most 2^32 boxes' 32 halvings, two at a time.
  static constexpr std::size_t kMaxHeight = 72;
  struct Node {
    FourBoxes boxes;
    std::array<std::uint32_t, 4> children{};  // nodes, or indices of boxes
    std::uint32_t is_box = 0;                 // bits: the child is a box, not a node
    std::uint32_t present = 0;                // bits: the child exists
  };
  // A pending node, or one of its boxes.
  static constexpr std::uint32_t kWhole = 4;
  struct Entry {
    std::uint32_t node;
    std::uint32_t slot;
    float near;
  };

  // The nearest child is pushed last, on top.
  std::size_t push_children(const PacketBounds& rays, std::uint32_t index, Entry* stack, std::size_t height) const {
    const Node& node = nodes_[index];
    Four near;
    const unsigned met = rays.meet(node.boxes, near);
    const std::size_t base = height;
    QUOIN_ASSERT(base + static_cast<std::size_t>(std::popcount(met & node.present)) <= kMaxHeight,
                 "room for the boxes");
    for (std::uint32_t left = met & node.present; left != 0; left &= left - 1) {
      const auto slot = static_cast<std::uint32_t>(std::countr_zero(left));
      std::size_t at = height++;
      for (; at > base && stack[at - 1].near < near[slot]; --at) stack[at] = stack[at - 1];
      const bool is_box = (node.is_box >> slot & 1U) != 0;
      stack[at] = {is_box ? index : node.children[slot], is_box ? slot : kWhole, near[slot]};
    }
    return height;
  }

  class Builder;
  std::vector<Node> nodes_;
};

}  // namespace quoin
