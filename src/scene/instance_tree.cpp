#include "scene/instance_tree.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

namespace quoin {
namespace {

// Narrows [low, high] to the t at which `origin + t * direction` is at most `limit`.
void clip(double origin, double direction, double limit, double& low, double& high) {
  if (direction > 0.0) {
    high = std::min(high, (limit - origin) / direction);
  } else if (direction < 0.0) {
    low = std::max(low, (limit - origin) / direction);
  } else if (origin > limit) {
    high = -1.0;
  }
}

}  // namespace

RayInterval interval_of(const RayPacket& rays) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  RayInterval all{DVec3(kInfinity), DVec3(-kInfinity), DVec3(kInfinity), DVec3(-kInfinity), 0.0};
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const Ray ray = rays.ray(lane);
    all.origin_low = glm::min(all.origin_low, ray.origin);
    all.origin_high = glm::max(all.origin_high, ray.origin);
    all.direction_low = glm::min(all.direction_low, ray.direction);
    all.direction_high = glm::max(all.direction_high, ray.direction);
    all.max_t = std::max(all.max_t, rays.max_t[static_cast<std::size_t>(lane)]);
  }
  return all;
}

bool may_meet(const RayInterval& rays, const DBox& box) {
  // Room for the rounding of far boxes and long rays.
  constexpr double kRoom = 1e-9;
  double low = 0.0;
  double high = rays.max_t;
  for (int axis = 0; axis < 3; ++axis) {
    clip(rays.origin_low[axis], rays.direction_low[axis], box.max[axis], low, high);
    clip(-rays.origin_high[axis], -rays.direction_high[axis], -box.min[axis], low, high);
  }
  return high >= 0.0 && low <= high * (1.0 + kRoom) + kRoom;
}

InstanceTree::InstanceTree(std::vector<DBox> boxes) : boxes_(std::move(boxes)) {
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    if (!boxes_[i].empty()) order_.push_back(i);
  }
  if (order_.empty()) return;
  nodes_.emplace_back();
  split(0, 0, order_.size());
}

InstanceTree InstanceTree::moved(DVec3 by) const {
  InstanceTree tree = *this;
  for (DBox& box : tree.boxes_) box = {box.min + by, box.max + by};
  for (Node& node : tree.nodes_) node.box = {node.box.min + by, node.box.max + by};
  return tree;
}

void InstanceTree::split(std::size_t node, std::size_t begin, std::size_t end) {
  DBox box;
  DBox centres;
  for (std::size_t i = begin; i < end; ++i) {
    const DBox& each = boxes_[order_[i]];
    box.extend(each.min);
    box.extend(each.max);
    centres.extend(each.min + each.max);
  }
  nodes_[node].box = box;
  if (end - begin <= kLeafSize) {
    nodes_[node].first = begin;
    nodes_[node].count = end - begin;
    return;
  }
  const DVec3 size = centres.max - centres.min;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](std::size_t a, std::size_t b) {
    const double centre_a = boxes_[a].min[axis] + boxes_[a].max[axis];
    const double centre_b = boxes_[b].min[axis] + boxes_[b].max[axis];
    return centre_a != centre_b ? centre_a < centre_b : a < b;
  });
  const std::size_t upper = nodes_.size() + 1;
  nodes_[node].axis = axis;
  nodes_[node].first = upper;
  nodes_.resize(nodes_.size() + 2);
  split(upper - 1, begin, middle);
  split(upper, middle, end);
}

}  // namespace quoin
