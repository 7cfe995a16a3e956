#include "scene/tracer/instance_tree.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

constexpr std::size_t kNoLeaf = std::numeric_limits<std::size_t>::max();
// Maximum ratio of search costs before the tree is rebuilt.
constexpr double kMaxWorse = 1.5;

// Narrows [low, high] to the interval of t in which `origin + t * direction` is at most `limit`.
void clip(double origin, double direction, double limit, double& low, double& high) {
  if (direction > 0.0) {
    high = std::min(high, (limit - origin) / direction);
  } else if (direction < 0.0) {
    low = std::max(low, (limit - origin) / direction);
  } else if (origin > limit) {
    high = -1.0;
  }
}

// Half of a box's surface.
double area_of(const DBox& box) {
  if (box.empty()) return 0.0;
  const DVec3 size = box.max - box.min;
  return size.x * size.y + size.y * size.z + size.z * size.x;
}

}  // namespace

bool may_meet(const Ray& ray, double max_t, const DBox& box) {
  // Room for the rounding of far boxes and long rays.
  constexpr double kRoom = 1e-9;
  double low = 0.0;
  double high = max_t;
  for (int axis = 0; axis < 3; ++axis) {
    clip(ray.origin[axis], ray.direction[axis], box.max[axis], low, high);
    clip(-ray.origin[axis], -ray.direction[axis], -box.min[axis], low, high);
  }
  return high >= 0.0 && low <= high * (1.0 + kRoom) + kRoom;
}

// A sort item: a box and its centre.
struct InstanceTree::Item {
  DVec3 twice_centre{0.0};
  std::size_t box = 0;
};

InstanceTree::InstanceTree(BlockVector<DBox> boxes) : boxes_(std::move(boxes)) {
  build();
}

void InstanceTree::build() {
  order_.clear();
  nodes_.clear();
  leaf_of_.assign(boxes_.size(), kNoLeaf);
  areas_ = built_cost_ = 0.0;
  std::vector<Item> items;
  items.reserve(boxes_.size());
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    if (boxes_[i].empty()) continue;
    const DVec3 twice_centre = boxes_[i].min + boxes_[i].max;
    // A box that is infinite on both sides has no centre, but needs a sort key.
    items.push_back({is_finite(twice_centre) ? twice_centre : DVec3(0.0), i});
  }
  if (items.empty()) return;
  order_.resize(items.size());
  nodes_.reserve(items.size());
  nodes_.emplace_back();
  split(0, items, 0);
  for (std::size_t i = nodes_.size(); i-- > 0;) fit(nodes_[i]);
  for (const Node& node : nodes_) areas_ += area_of(node.box);
  built_cost_ = search_cost();
}

// Returns the expected number of nodes that a ray through the whole tree visits (surface area heuristic).
double InstanceTree::search_cost() const {
  QUOIN_ASSERT(!nodes_.empty(), "a tree with boxes");
  const double whole = area_of(nodes_.front().box);
  return whole > 0.0 ? areas_ / whole : 0.0;
}

void InstanceTree::fit(Node& node) const {
  if (node.count == 0) {
    QUOIN_ASSERT(node.first > 1 && node.first < nodes_.size(), "children follow their parent");
    const DBox& a = nodes_[node.first - 1].box;
    const DBox& b = nodes_[node.first].box;
    node.box = {glm::min(a.min, b.min), glm::max(a.max, b.max)};
    return;
  }
  QUOIN_ASSERT(node.first + node.count <= order_.size(), "a leaf of the boxes");
  node.box = {};
  for (std::size_t i = node.first; i < node.first + node.count; ++i) {
    const DBox& each = boxes_[order_[i]];
    node.box = {glm::min(node.box.min, each.min), glm::max(node.box.max, each.max)};
  }
}

void InstanceTree::change(std::span<const Change> changes) {
  if (changes.empty()) return;
  bool is_stale = false;
  std::vector<bool> above(nodes_.size());
  for (const Change& change : changes) {
    QUOIN_ASSERT(change.index < boxes_.size(), "one of the boxes");
    boxes_[change.index] = change.box;
    const std::size_t leaf = leaf_of_[change.index];
    is_stale |= (leaf == kNoLeaf) != change.box.empty();
    if (leaf == kNoLeaf) continue;
    for (std::size_t node = leaf; !above[node]; node = nodes_[node].parent) above[node] = true;
  }
  if (is_stale) return build();
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    if (!above[i]) continue;
    areas_ -= area_of(nodes_[i].box);
    fit(nodes_[i]);
    areas_ += area_of(nodes_[i].box);
  }
  // Written so that NaN also rebuilds.
  if (!nodes_.empty() && !(search_cost() <= kMaxWorse * built_cost_)) build();
}

// Makes the nodes below the one for `items`, whose boxes begin at `begin` in `order_`.
void InstanceTree::split(std::size_t node, std::span<Item> items, std::size_t begin) {
  QUOIN_ASSERT(!items.empty() && node < nodes_.size(), "a node with boxes");
  if (items.size() <= kLeafSize) {
    nodes_[node].first = begin;
    nodes_[node].count = items.size();
    for (const Item& item : items) {
      leaf_of_[item.box] = node;
      order_[begin++] = item.box;
    }
    return;
  }
  DBox centres;
  for (const Item& item : items) centres.extend(item.twice_centre);
  const DVec3 size = centres.max - centres.min;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t middle = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(middle), items.end(),
                   [axis](const Item& a, const Item& b) {
                     const double at_a = a.twice_centre[axis];
                     const double at_b = b.twice_centre[axis];
                     return at_a != at_b ? at_a < at_b : a.box < b.box;
                   });
  QUOIN_ASSERT(begin + items.size() <= order_.size(), "each box stands in one leaf");
  const std::size_t upper = nodes_.size() + 1;
  nodes_[node].axis = axis;
  nodes_[node].first = upper;
  nodes_.resize(nodes_.size() + 2);
  nodes_[upper - 1].parent = nodes_[upper].parent = node;
  split(upper - 1, items.first(middle), begin);
  split(upper, items.subspan(middle), begin + middle);
}

}  // namespace quoin
