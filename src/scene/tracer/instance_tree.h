#pragma once

#include <array>
#include <cstddef>
#include <glm/vector_relational.hpp>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/trace/ray.h>

namespace quoin {

/// Returns false only if the ray misses the box from 0 to `max_t`.
[[nodiscard]] bool may_meet(const Ray& ray, double max_t, const DBox& box);

/// A bounding-volume tree over boxes.
///
/// Source: halves at the median of the longest axis of the centres; a leaf holds up to four.
class InstanceTree {
 public:
  /// A leaf's `first` counts in `order`. An inner node has its lower child in `nodes()[first - 1]`, its upper one in
  /// `nodes()[first]`, both behind itself.
  struct Node {
    DBox box;
    std::size_t first = 0;
    std::size_t count = 0;  ///< 0: an inner node
    std::size_t parent = 0;
    int axis = 0;
  };
  struct Change {
    std::size_t index = 0;
    DBox box;
  };

  InstanceTree() = default;
  /// Cost: O(n log n). Empty boxes are never visited.
  explicit InstanceTree(BlockVector<DBox> boxes);

  [[nodiscard]] const BlockVector<DBox>& boxes() const { return boxes_; }
  [[nodiscard]] const BlockVector<Node>& nodes() const { return nodes_; }
  [[nodiscard]] const BlockVector<std::size_t>& order() const { return order_; }

  /// Replaces boxes. Refits only the nodes above them. Rebuilds the tree if the nodes have grown so much that searches
  /// would be slow, or if a box became empty or non-empty.
  ///
  /// Cost: at most O(changes * log n), plus one bit per node; O(n log n) for a rebuild.
  void change(std::span<const Change> changes);

  /// Calls `visit(index)` for every box that the ray may hit from 0 to `max_t`, roughly from near to far, until it
  /// returns false. `visit` may lower `max_t`.
  template <class Visit>
  void visit(const Ray& ray, double& max_t, Visit&& visit) const {
    if (nodes_.empty()) return;
    std::array<std::size_t, kMaxDepth> stack{};
    std::size_t height = 0;
    stack[height++] = 0;
    while (height > 0) {
      const Node& node = nodes_[stack[--height]];
      if (!may_meet(ray, max_t, node.box)) continue;
      if (node.count == 0) {
        QUOIN_ASSERT(height + 2 <= kMaxDepth, "a tree of halves is not so deep");
        const bool is_forward = ray.direction[node.axis] >= 0.0;
        stack[height++] = is_forward ? node.first : node.first - 1;
        stack[height++] = is_forward ? node.first - 1 : node.first;
        continue;
      }
      for (std::size_t i = node.first; i < node.first + node.count; ++i) {
        if (may_meet(ray, max_t, boxes_[order_[i]]) && !visit(order_[i])) return;
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
        QUOIN_ASSERT(height + 2 <= kMaxDepth, "a tree of halves is not so deep");
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
  struct Item;
  void build();
  void split(std::size_t node, std::span<Item> items, std::size_t begin);
  void fit(Node& node) const;
  [[nodiscard]] double search_cost() const;

  BlockVector<DBox> boxes_;
  BlockVector<std::size_t> order_;
  BlockVector<Node> nodes_;
  BlockVector<std::size_t> leaf_of_;  // by box: its leaf's index; kNoLeaf for an empty one
  double built_cost_ = 0.0;           // `search_cost` after the last rebuild
  double areas_ = 0.0;                // of all nodes' boxes
};

}  // namespace quoin
