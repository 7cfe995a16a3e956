#pragma once

#include <array>
#include <cstddef>
#include <glm/vector_relational.hpp>
#include <span>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/trace/packet.h>

namespace quoin {

/// All rays of a packet as one: at distance t they lie between `origin_low + t direction_low` and
/// `origin_high + t direction_high`.
struct RayInterval {
  DVec3 origin_low{0.0};
  DVec3 origin_high{0.0};
  DVec3 direction_low{0.0};
  DVec3 direction_high{0.0};
  double max_t = 0.0;
};

/// Of the active rays. Requires: there is one.
[[nodiscard]] RayInterval interval_of(const RayPacket& rays);

/// False only when no ray of the interval meets the box from 0 to max_t.
[[nodiscard]] bool may_meet(const RayInterval& rays, const DBox& box);

/// A bounding-volume tree over boxes that finds those which a packet of rays may meet.
///
/// Source: halves at the median of the longest axis of the centres; a leaf holds up to four.
class InstanceTree {
 public:
  /// A leaf's `first` counts in `order()`. An inner node, whose `count` is 0, has its lower child in
  /// `nodes()[first - 1]`, its upper one in `nodes()[first]`. The first node is the root.
  struct Node {
    DBox box;
    std::size_t first = 0;
    std::size_t count = 0;
    int axis = 0;
  };

  InstanceTree() = default;
  /// Cost: O(n log n). Empty boxes are never visited.
  explicit InstanceTree(std::vector<DBox> boxes);

  [[nodiscard]] const std::vector<DBox>& boxes() const { return boxes_; }
  [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }
  /// The boxes' indices as the leaves have them.
  [[nodiscard]] const std::vector<std::size_t>& order() const { return order_; }

  /// The same tree with every box moved.
  [[nodiscard]] InstanceTree moved(DVec3 by) const;

  /// Calls `visit(index)` for every box that the rays may meet, nearer ones mostly first, until it answers false. It
  /// may lower `rays.max_t` on the way.
  template <class Visit>
  void visit(RayInterval& rays, Visit&& visit) const {
    if (nodes_.empty()) return;
    std::array<std::size_t, kMaxDepth> stack{};
    std::size_t height = 0;
    stack[height++] = 0;
    while (height > 0) {
      const Node& node = nodes_[stack[--height]];
      if (!may_meet(rays, node.box)) continue;
      if (node.count == 0) {
        const bool is_forward = rays.direction_low[node.axis] + rays.direction_high[node.axis] >= 0.0;
        stack[height++] = is_forward ? node.first : node.first - 1;
        stack[height++] = is_forward ? node.first - 1 : node.first;
        continue;
      }
      for (std::size_t i = node.first; i < node.first + node.count; ++i) {
        if (may_meet(rays, boxes_[order_[i]]) && !visit(order_[i])) return;
      }
    }
  }

  /// Calls `visit(index)` for every box that touches `box`, in no order.
  template <class Visit>
  void visit_box(const DBox& box, Visit&& visit) const {
    if (nodes_.empty()) return;
    const auto touches = [&](const DBox& other) {
      return glm::all(glm::lessThanEqual(box.min, other.max)) && glm::all(glm::lessThanEqual(other.min, box.max));
    };
    std::array<std::size_t, kMaxDepth> stack{};
    std::size_t height = 0;
    stack[height++] = 0;
    while (height > 0) {
      const Node& node = nodes_[stack[--height]];
      if (!touches(node.box)) continue;
      if (node.count == 0) {
        stack[height++] = node.first;
        stack[height++] = node.first - 1;
        continue;
      }
      for (std::size_t i = node.first; i < node.first + node.count; ++i) {
        if (touches(boxes_[order_[i]])) visit(order_[i]);
      }
    }
  }

 private:
  static constexpr std::size_t kMaxDepth = 72;
  static constexpr std::size_t kLeafSize = 4;
  void split(std::size_t node, std::size_t begin, std::size_t end);

  std::vector<DBox> boxes_;
  std::vector<std::size_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace quoin
