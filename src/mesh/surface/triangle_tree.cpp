#include "mesh/surface/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin {

namespace {

constexpr std::size_t kLeaf = 4;

float squared(Vec3 v) {
  return glm::dot(v, v);
}

float squared_distance_from_box(Vec3 point, Vec3 min, Vec3 max) {
  return squared(point - glm::clamp(point, min, max));
}

float squared_distance_from_edge(Vec3 point, Vec3 a, Vec3 b) {
  const Vec3 along = b - a;
  const float length = squared(along);
  const float t = length > 0.0F ? std::clamp(glm::dot(point - a, along) / length, 0.0F, 1.0F) : 0.0F;
  return squared(point - (a + along * t));
}

}  // namespace

TriangleTree::TriangleTree(std::span<const Vec3> positions, std::span<const std::uint32_t> indices)
    : positions_(positions), indices_(indices) {
  QUOIN_ASSERT(indices.size() % 3 == 0, "whole triangles");
  std::vector<Item> items;
  items.reserve(indices.size() / 3);
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const Vec3 a = positions[indices[i]];
    const Vec3 b = positions[indices[i + 1]];
    const Vec3 c = positions[indices[i + 2]];
    items.push_back({glm::min(glm::min(a, b), c), glm::max(glm::max(a, b), c), static_cast<std::uint32_t>(i / 3)});
  }
  if (items.empty()) return;
  nodes_.resize(1);
  build(0, items, 0);
  for (const Item& item : items) order_.push_back(item.triangle);
}

void TriangleTree::build(std::size_t node, std::span<Item> items, std::size_t first) {
  QUOIN_ASSERT(!items.empty() && node < nodes_.size(), "a node of triangles");
  Vec3 min = items[0].min;
  Vec3 max = items[0].max;
  for (const Item& item : items) {
    min = glm::min(min, item.min);
    max = glm::max(max, item.max);
  }
  nodes_[node] = {min, max, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(items.size())};
  if (items.size() <= kLeaf) return;
  const Vec3 size = max - min;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t half = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                   [axis](const Item& a, const Item& b) {
                     const float x = a.min[axis] + a.max[axis];
                     const float y = b.min[axis] + b.max[axis];
                     return x != y ? x < y : a.triangle < b.triangle;
                   });
  const std::size_t children = nodes_.size();
  nodes_.resize(children + 2);
  nodes_[node].first = static_cast<std::uint32_t>(children);
  nodes_[node].count = 0;
  build(children, items.first(half), first);
  build(children + 1, items.subspan(half), first + half);
}

float TriangleTree::squared_distance(Vec3 point, std::uint32_t triangle) const {
  QUOIN_ASSERT(std::size_t{3} * triangle + 2 < indices_.size(), "one of the triangles");
  const std::uint32_t* at = indices_.data() + std::size_t{3} * triangle;
  const Vec3 a = positions_[at[0]];
  const Vec3 b = positions_[at[1]];
  const Vec3 c = positions_[at[2]];
  const Vec3 normal = glm::cross(b - a, c - a);
  const auto is_within = [&](Vec3 from, Vec3 to) {
    return glm::dot(glm::cross(to - from, point - from), normal) >= 0.0F;
  };
  const float area = squared(normal);
  if (area > 0.0F && is_within(a, b) && is_within(b, c) && is_within(c, a)) {
    const float height = glm::dot(point - a, normal);
    return height * height / area;
  }
  return std::min({squared_distance_from_edge(point, a, b), squared_distance_from_edge(point, b, c),
                   squared_distance_from_edge(point, c, a)});
}

float TriangleTree::distance(Vec3 point, float most) const {
  if (nodes_.empty()) return most;
  float nearest = most * most;
  // The median halves each node: no tree of 2^32 triangles is deeper than this.
  std::array<std::uint32_t, 72> open;
  std::size_t depth = 0;
  open[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[open[--depth]];
    if (squared_distance_from_box(point, node.min, node.max) >= nearest) continue;
    if (node.count != 0) {
      for (std::uint32_t i = 0; i < node.count; ++i) {
        nearest = std::min(nearest, squared_distance(point, order_[node.first + i]));
      }
      continue;
    }
    const auto away = [&](std::uint32_t child) {
      return squared_distance_from_box(point, nodes_[child].min, nodes_[child].max);
    };
    QUOIN_ASSERT(depth + 2 <= open.size(), "a tree of halves is not so deep");
    std::uint32_t near = node.first;
    std::uint32_t far = near + 1;
    if (away(far) < away(near)) std::swap(near, far);
    open[depth++] = far;
    open[depth++] = near;
  }
  return std::min(std::sqrt(nearest), most);
}

}  // namespace quoin
