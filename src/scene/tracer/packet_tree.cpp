#include "scene/tracer/packet_tree.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

using Two = double __attribute__((vector_size(16)));
using TwoBits = std::int64_t __attribute__((vector_size(16)));
using FourDoubles = double __attribute__((vector_size(32)));

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// Exceeds the error of rounding to single precision.
constexpr float kRounding = 0x1p-22F;
constexpr float kLeastRounding = 1e-20F;
// Directions of other lengths are not scaled; such rays may hit anything.
constexpr double kShortest = 1e-30;
constexpr double kLongest = 1e30;

float rounded_up(double x) {
  const auto near = static_cast<float>(x);
  return near + (std::abs(near) * kRounding + kLeastRounding);
}
float rounded_down(double x) {
  return -rounded_up(-x);
}

Four four_of(const RayPacket::Lanes<double>& lanes, std::size_t begin, double scale) {
  FourDoubles four;
  std::memcpy(&four, lanes.data() + begin, sizeof(four));
  return __builtin_convertvector(four * scale, Four);
}

struct Range {
  double low = 0.0;
  double high = 0.0;
};

// Returns the range of the active lanes. Ignores NaN.
Range range_of(const RayPacket::Lanes<double>& lanes, const std::array<TwoBits, RayPacket::kSize / 2>& inactive) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Two low = {kFar, kFar};
  Two high = {-kFar, -kFar};
  for (std::size_t i = 0; i < inactive.size(); ++i) {
    Two two;
    std::memcpy(&two, lanes.data() + 2 * i, sizeof(two));
    two = reinterpret_cast<Two>(reinterpret_cast<TwoBits>(two) | inactive[i]);  // not a number
    low = two < low ? two : low;
    high = two > high ? two : high;
  }
  return {std::min(low[0], low[1]), std::max(high[0], high[1])};
}

}  // namespace

PacketBounds::PacketBounds(const RayPacket& rays) {
  std::array<TwoBits, RayPacket::kSize / 2> inactive;
  for (std::size_t i = 0; i < inactive.size(); ++i) {
    inactive[i] = TwoBits{static_cast<std::int64_t>(rays.active >> (2 * i) & 1U),
                          static_cast<std::int64_t>(rays.active >> (2 * i + 1) & 1U)} -
                  1;
  }
  const std::array<Range, 3> origins = {range_of(rays.origin_x, inactive), range_of(rays.origin_y, inactive),
                                        range_of(rays.origin_z, inactive)};
  const std::array<Range, 3> directions = {range_of(rays.direction_x, inactive), range_of(rays.direction_y, inactive),
                                           range_of(rays.direction_z, inactive)};
  double longest = 0.0;
  for (const Range& each : directions) longest = std::max({longest, -each.low, each.high});
  if (!(longest > 0.0)) return;
  is_usual_ = longest >= kShortest && longest <= kLongest;
  scale_ = is_usual_ ? static_cast<float>(longest) : 1.0F;
  std::size_t next_upper = limits_.size();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto add = [&](double origin, double direction, std::size_t plane) {
      const bool is_upper = direction > 0.0;
      Limit& limit = limits_[is_upper ? --next_upper : lower_count_++];
      // NaN gives no limit.
      limit.origin = is_usual_ ? rounded_down(origin) : std::numeric_limits<float>::quiet_NaN();
      limit.inverse = direction == 0.0 ? -kInfinity : static_cast<float>(double{scale_} / direction);
      limit.plane = plane;
    };
    add(origins[axis].low, directions[axis].low, axis);
    add(-origins[axis].high, -directions[axis].high, axis + 3);
  }
  QUOIN_ASSERT(next_upper == lower_count_, "six limits");
  const Range reach = range_of(rays.max_t, inactive);
  set_reach(is_usual_ ? std::max(reach.high, 0.0) : double{kInfinity});
}

PacketLanes::PacketLanes(const RayPacket& rays, const PacketBounds& bounds)
    : scale_(bounds.scale()), is_usual_(bounds.is_usual()) {
  const double inverse_scale = 1.0 / double{scale_};
  set(axes_[0], rays.origin_x, rays.direction_x, inverse_scale);
  set(axes_[1], rays.origin_y, rays.direction_y, inverse_scale);
  set(axes_[2], rays.origin_z, rays.direction_z, inverse_scale);
  for (std::size_t i = 0; i < max_t_.size(); ++i) max_t_[i] = static_cast<float>(rays.max_t[i] * double{scale_});
}

void PacketLanes::set(Axis& axis, const RayPacket::Lanes<double>& origin, const RayPacket::Lanes<double>& direction,
                      double inverse_scale) {
  // Zero components become the smallest positive number, so that no distance is 0 / 0.
  constexpr float kSlowest = 1e-37F;
  for (std::size_t i = 0; i < kFours; ++i) {
    const Four at = four_of(origin, 4 * i, 1.0);
    const Four along = four_of(direction, 4 * i, inverse_scale);
    const Four room = (at < 0.0F ? -at : at) * kRounding + kLeastRounding;
    axis.origin_low[i] = at - room;
    axis.origin_high[i] = at + room;
    const Four size = along < 0.0F ? -along : along;
    axis.inverse[i] = 1.0F / (size < kSlowest ? Four{} + kSlowest : along);
  }
}

std::uint32_t PacketLanes::meet(const FourBoxes& boxes, std::size_t box) const {
  QUOIN_ASSERT(box < 4, "one of the four boxes");
  if (!is_usual_) return ~std::uint32_t{0};
  std::uint32_t met = 0;
  for (std::size_t i = 0; i < kFours; ++i) {
    Four low{};
    Four high;
    std::memcpy(&high, max_t_.data() + 4 * i, sizeof(high));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Axis& along = axes_[axis];
      const Four begin = (-boxes[axis + 3][box] - along.origin_high[i]) * along.inverse[i];
      const Four end = (boxes[axis][box] - along.origin_low[i]) * along.inverse[i];
      const Four enter = begin < end ? begin : end;
      const Four leave = begin < end ? end : begin;
      low = enter > low ? enter : low;
      high = leave < high ? leave : high;
    }
    met |= bits_of(low <= high * kDistanceRoom + kLeastDistance) << (4 * i);
  }
  return met;
}

// Converts the nodes of an InstanceTree, two levels into one.
class PacketTree::Builder {
 public:
  Builder(const InstanceTree& tree, DVec3 origin, const std::vector<bool>& left_out, std::vector<Node>& nodes)
      : tree_(tree), origin_(origin), left_out_(left_out), nodes_(nodes) {}

  // Returns the box of the node's contents. If there are none, returns an empty box and adds no node.
  DBox make(std::size_t from) {
    const std::size_t at = nodes_.size();
    nodes_.emplace_back().boxes.fill(Four{} - kInfinity);
    DBox around;
    const InstanceTree::Node& node = tree_.nodes()[from];
    if (node.count != 0) {
      take_boxes(at, node, around);
    } else {
      for (const std::size_t child : {node.first - 1, node.first}) take_child(at, child, around);
    }
    if (around.empty()) nodes_.resize(at);
    return around;
  }

 private:
  void take_boxes(std::size_t at, const InstanceTree::Node& leaf, DBox& around) {
    for (std::size_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
      const std::size_t box = tree_.order()[i];
      if (!left_out_.empty() && left_out_[box]) continue;
      put(at, tree_.boxes()[box], static_cast<std::uint32_t>(box), true, around);
    }
  }

  // Returns a leaf itself, or both children of an inner node.
  void take_child(std::size_t at, std::size_t child, DBox& around) {
    const InstanceTree::Node& node = tree_.nodes()[child];
    const std::size_t low = node.count != 0 ? child : node.first - 1;
    const std::size_t high = node.count != 0 ? child : node.first;
    for (std::size_t from = low; from <= high; ++from) {
      const auto next = static_cast<std::uint32_t>(nodes_.size());
      const DBox box = make(from);
      if (!box.empty()) put(at, box, next, false, around);
    }
  }

  void put(std::size_t at, const DBox& box, std::uint32_t child, bool is_box, DBox& around) {
    Node& node = nodes_[at];
    const auto slot = static_cast<std::size_t>(std::popcount(node.present));
    QUOIN_ASSERT(slot < node.children.size(), "four children at most");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<int>(axis);
      node.boxes[axis][slot] = rounded_up(box.max[i] - origin_[i]);
      node.boxes[axis + 3][slot] = rounded_up(origin_[i] - box.min[i]);
    }
    node.children[slot] = child;
    node.is_box |= std::uint32_t{is_box} << slot;
    node.present |= 1U << slot;
    around = {glm::min(around.min, box.min), glm::max(around.max, box.max)};
  }

  const InstanceTree& tree_;
  DVec3 origin_;
  const std::vector<bool>& left_out_;
  std::vector<Node>& nodes_;
};

PacketTree::PacketTree(const InstanceTree& tree, DVec3 origin, const std::vector<bool>& left_out) {
  QUOIN_ASSERT(left_out.empty() || left_out.size() == tree.boxes().size(), "one entry per box, or none");
  QUOIN_ASSERT(tree.boxes().size() <= std::numeric_limits<std::uint32_t>::max(), "indices of 32 bits");
  if (tree.nodes().empty()) return;
  nodes_.reserve(tree.nodes().size());
  Builder(tree, origin, left_out, nodes_).make(0);
}

}  // namespace quoin
