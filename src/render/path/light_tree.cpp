#include "render/path/light_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/hash.h>

#include "render/path/path_math.h"

namespace quoin::path {
namespace {

constexpr int kBuckets = 12;
constexpr int kDeepestSplit = 44;  // deeper nodes split in halves, so that no path is longer than 64

float sine_of(float cosine) {
  return std::sqrt(std::max(0.0F, 1.0F - cosine * cosine));
}

struct Cone {
  Vec3 axis;
  float cosine;
};

// Returns the smallest cone around two cones.
Cone unite(const Cone& a, const Cone& b) {
  constexpr Cone kAll{{0.0F, 0.0F, 1.0F}, -1.0F};
  const double of_a = arc_cosine(a.cosine);
  const double of_b = arc_cosine(b.cosine);
  const double between = arc_cosine(glm::dot(a.axis, b.axis));
  if (std::min(between + of_b, std::numbers::pi) <= of_a) return a;
  if (std::min(between + of_a, std::numbers::pi) <= of_b) return b;
  const double all = (of_a + between + of_b) / 2.0;
  if (all >= std::numbers::pi) return kAll;
  const Vec3 across = b.axis - a.axis * glm::dot(a.axis, b.axis);
  const float length = glm::length(across);
  if (!(length > 1e-6F)) return kAll;
  const SineCosine turn = of_turns(static_cast<float>((all - of_a) / (2.0 * std::numbers::pi)));
  const SineCosine half = of_turns(static_cast<float>(all / (2.0 * std::numbers::pi)));
  return {glm::normalize(a.axis * turn.cosine + across * (turn.sine / length)), half.cosine};
}

LampBounds unite(const LampBounds& a, const LampBounds& b) {
  if (!(a.power > 0.0F)) return b;
  if (!(b.power > 0.0F)) return a;
  const Cone cone = unite(Cone{a.axis, a.cos_spread}, Cone{b.axis, b.cos_spread});
  return {glm::min(a.low, b.low),           glm::max(a.high, b.high), cone.axis, cone.cosine,
          std::min(a.cos_edge, b.cos_edge), a.power + b.power};
}

// Returns the cost of a node, an estimate of the light that it may send to any point: from its power, its size and the
// spread of its directions.
float cost_of(const LampBounds& bounds, float longest, float along) {
  const auto spread = static_cast<float>(arc_cosine(bounds.cos_spread));
  const float to_edge = std::min(spread + static_cast<float>(arc_cosine(bounds.cos_edge)), kPi);
  const float sine = sine_of(bounds.cos_spread);
  const float turns = (2.0F * to_edge - spread) / (2.0F * kPi);  // angle in turns, of any value
  const SineCosine end = of_turns(turns - std::floor(turns));
  const float measure = 2.0F * kPi * (1.0F - bounds.cos_spread) +
                        kPi / 2.0F * (2.0F * to_edge * sine - end.cosine - 2.0F * spread * sine + bounds.cos_spread);
  const Vec3 size = bounds.high - bounds.low;
  const float area = 2.0F * (size.x * size.y + size.y * size.z + size.z * size.x);
  return bounds.power * measure * (longest / std::max(along, 1e-9F)) * std::max(area, 1e-12F);
}

}  // namespace

class LightTree::Builder {
 public:
  Builder(std::span<const LampBounds> lamps, LightTree& tree) : lamps_(lamps), tree_(tree), order_(lamps.size()) {}

  void run() {
    std::iota(order_.begin(), order_.end(), 0U);
    tree_.nodes_.reserve(2 * lamps_.size());
    tree_.ways_.resize(lamps_.size());
    build(0, lamps_.size(), 0, 0);
    QUOIN_ASSERT(tree_.nodes_.size() == 2 * lamps_.size() - 1, "each lamp in one leaf");
  }

 private:
  LampBounds build(std::size_t begin, std::size_t end, std::uint64_t way, int level) {
    const std::size_t at = tree_.nodes_.size();
    tree_.nodes_.emplace_back();
    if (end - begin == 1) {
      const std::uint32_t lamp = order_[begin];
      tree_.nodes_[at] = {lamps_[lamp], -1, static_cast<std::int32_t>(lamp)};
      QUOIN_ASSERT(level <= 64, "a way has a bit a level");
      tree_.ways_[lamp] = way;
      return lamps_[lamp];
    }
    const std::size_t middle = split(begin, end, level);
    QUOIN_ASSERT(begin < middle && middle < end, "two parts with lamps");
    const LampBounds first = build(begin, middle, way, level + 1);
    const auto second_at = static_cast<std::int32_t>(tree_.nodes_.size());
    const LampBounds second = build(middle, end, way | std::uint64_t{1} << level, level + 1);
    const LampBounds both = unite(first, second);
    tree_.nodes_[at] = {both, second_at, -1};
    return both;
  }

  [[nodiscard]] Vec3 middle_of(std::uint32_t lamp) const { return (lamps_[lamp].low + lamps_[lamp].high) * 0.5F; }

  struct Plane {
    int axis = -1;
    int bucket = 0;
    float low = 0.0F;
    float scale = 0.0F;
    [[nodiscard]] int bucket_of(float place) const {
      return std::clamp(static_cast<int>((place - low) * scale), 0, kBuckets - 1);
    }
  };

  [[nodiscard]] std::size_t split(std::size_t begin, std::size_t end, int level) {
    const auto at = [this](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    if (level < kDeepestSplit) {
      const Plane plane = best_plane(begin, end);
      if (plane.axis >= 0) {
        const auto second = std::stable_partition(at(begin), at(end), [&](std::uint32_t lamp) {
          return plane.bucket_of(middle_of(lamp)[plane.axis]) <= plane.bucket;
        });
        const auto middle = static_cast<std::size_t>(second - order_.begin());
        if (middle != begin && middle != end) return middle;
      }
    }
    return begin + (end - begin) / 2;
  }

  [[nodiscard]] Plane best_plane(std::size_t begin, std::size_t end) const {
    Vec3 low(std::numeric_limits<float>::max());
    Vec3 high(-std::numeric_limits<float>::max());
    for (std::size_t i = begin; i < end; ++i) {
      low = glm::min(low, middle_of(order_[i]));
      high = glm::max(high, middle_of(order_[i]));
    }
    const Vec3 size = high - low;
    Plane best;
    float least = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      if (!(size[axis] > 0.0F)) continue;
      Plane plane{axis, 0, low[axis], static_cast<float>(kBuckets) / size[axis]};
      std::array<LampBounds, kBuckets> buckets{};
      for (std::size_t i = begin; i < end; ++i) {
        LampBounds& bucket = buckets[static_cast<std::size_t>(plane.bucket_of(middle_of(order_[i])[axis]))];
        bucket = unite(bucket, lamps_[order_[i]]);
      }
      std::array<LampBounds, kBuckets> from_above{};
      from_above.back() = buckets.back();
      for (std::size_t i = kBuckets - 1; i-- > 0;) from_above[i] = unite(buckets[i], from_above[i + 1]);
      LampBounds below;
      for (plane.bucket = 0; plane.bucket + 1 < kBuckets; ++plane.bucket) {
        below = unite(below, buckets[static_cast<std::size_t>(plane.bucket)]);
        const LampBounds& above = from_above[static_cast<std::size_t>(plane.bucket) + 1];
        if (!(below.power > 0.0F) || !(above.power > 0.0F)) continue;
        const float cost = cost_of(below, largest(size), size[axis]) + cost_of(above, largest(size), size[axis]);
        if (cost < least) least = cost, best = plane;
      }
    }
    return best;
  }

  std::span<const LampBounds> lamps_;
  LightTree& tree_;
  std::vector<std::uint32_t> order_;
};

LightTree::LightTree(std::span<const LampBounds> lamps) {
  if (lamps.empty()) return;
  Builder(lamps, *this).run();
  set_branches();
}

void LightTree::set_branches() {
  std::vector<std::int32_t> number(nodes_.size());  // of a node, as LampBranch::next
  std::int32_t inner = 0;
  for (std::size_t i = 0; i < nodes_.size(); ++i) number[i] = nodes_[i].lamp >= 0 ? ~nodes_[i].lamp : inner++;
  if (nodes_.size() == 1) {
    branches_.push_back({measures_of(nodes_[0].bounds), {}, {number[0], number[0]}, {1, 2}});
    return;
  }
  std::vector<std::size_t> top(nodes_.size(), kTopNodes);  // of nodes that have a number
  top[0] = 0;
  branches_.reserve(static_cast<std::size_t>(inner));
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i].lamp >= 0) continue;
    const auto second = static_cast<std::size_t>(nodes_[i].second);
    LampBranch& branch = branches_.emplace_back(LampBranch{measures_of(nodes_[i + 1].bounds),
                                                           measures_of(nodes_[second].bounds),
                                                           {number[i + 1], number[second]},
                                                           {0, 0}});
    if (2 * top[i] + 2 >= kTopNodes) continue;
    top[i + 1] = 2 * top[i] + 1;
    top[second] = 2 * top[i] + 2;
    branch.top[0] = static_cast<std::int32_t>(top[i + 1]);
    branch.top[1] = static_cast<std::int32_t>(top[second]);
  }
  QUOIN_ASSERT(branches_.size() == static_cast<std::size_t>(inner), "one branch per inner node");
}

LampMeasures LightTree::measures_of(const LampBounds& bounds) {
  const Vec3 half = (bounds.high - bounds.low) * 0.5F;
  const Vec3 middle = bounds.low + half;
  const bool is_one_sided = bounds.cos_edge > -1.0F && bounds.cos_spread > 0.9999F;
  const Vec3 axis = is_one_sided ? bounds.axis : Vec3(0.0F);
  LampMeasures measures;
  for (int i = 0; i < 3; ++i) measures.middle[i] = middle[i], measures.half[i] = half[i], measures.axis[i] = axis[i];
  measures.power = bounds.power;
  measures.squared = std::max(glm::dot(half, half), 1e-12F);
  measures.beyond = is_one_sided ? glm::dot(half, glm::abs(axis)) : std::numeric_limits<float>::infinity();
  return measures;
}

// Returns the form factor of the node's centre, times its power: exact for small nodes, and never 0 if a part of the
// box lies in front of the point and the point in front of a part of it. Cost: one square root.
float LightTree::importance(const LampMeasures& of, Vec3 point, Vec3 normal) {
  const auto vec = [](const float(&v)[3]) { return Vec3(v[0], v[1], v[2]); };
  const Vec3 way = vec(of.middle) - point;
  const float distance2 = std::max(glm::dot(way, way), of.squared);
  // The extent of the box in front of the surface, and the point's distance in front of the lamps; both at least a
  // small
  // part of their distance.
  const float distance = std::sqrt(distance2);
  const float before =
      is_black(glm::abs(normal)) ? distance : glm::dot(way, normal) + glm::dot(vec(of.half), glm::abs(normal));
  const float shone = of.beyond - glm::dot(way, vec(of.axis));
  if (!(before > 0.0F) || !(shone > 0.0F)) return 0.0F;
  return of.power * std::min(before, distance) * std::min(shone, distance) / (distance2 * distance2);
}

const float* LightTree::whole_shares() {
  static const std::vector<float> shares(kTopNodes, 1.0F);
  return shares.data();
}

LightTree::Choice LightTree::choose(Vec3 point, Vec3 normal, float u, const float* shares) const {
  QUOIN_ASSERT(u >= 0.0F && u < 1.0F && shares != nullptr, "0 <= u < 1, and a table of shares");
  if (branches_.empty()) return {};
  LampBlock block;
  for (int i = 0; i < 3; ++i) block.point[i][0] = point[i], block.normal[i][0] = normal[i];
  block.u[0] = u;
  block.active = 1;
  kernel().choose_lamps(branches_.data(), shares, block);
  return {block.lamp[0], block.probability[0]};
}

float LightTree::probability(std::uint32_t lamp, Vec3 point, Vec3 normal, const float* shares) const {
  QUOIN_ASSERT(lamp < ways_.size() && shares != nullptr, "a lamp of the tree, and a table of shares");
  std::int32_t at = 0;
  float probability = 1.0F;
  for (std::uint64_t way = ways_[lamp]; at >= 0; way >>= 1) {
    const LampBranch& branch = branches_[static_cast<std::size_t>(at)];
    const float of_first = importance(branch.first, point, normal) * shares[branch.top[0]];
    const float of_second = importance(branch.second, point, normal) * shares[branch.top[1]];
    const float both = of_first + of_second;
    if (!(both > 0.0F)) return 0.0F;
    const float share = of_first / both;
    probability *= (way & 1U) != 0 ? 1.0F - share : share;
    at = branch.next[way & 1U];
  }
  return probability;
}

namespace {

constexpr int kPlaceShift = 3;
// The prior assumes that all lamps are visible: it weighs like this many samples of mean light.
constexpr float kBelief = 0.5F;
constexpr float kLeastNodeShare = 0.05F;

}  // namespace

LampMemory::LampMemory()
    : places_(1), tables_(LightTree::kTopNodes, 1.0F), lights_(LightTree::kTopNodes), slots_(2 * kMostPlaces) {}

std::int32_t LampMemory::place_of(std::int32_t of, IVec3 voxel, Direction side) {
  const IVec3 block = voxel >> kPlaceShift;
  std::uint32_t hash = mix_bits(static_cast<std::uint32_t>(of) * 8U + static_cast<std::uint32_t>(side));
  for (const int coordinate : {block.x, block.y, block.z}) {
    hash = mix_bits(hash ^ static_cast<std::uint32_t>(coordinate));
  }
  std::size_t slot = hash & (slots_.size() - 1);
  for (; slots_[slot] > 0; slot = (slot + 1) & (slots_.size() - 1)) {
    const Place& place = places_[static_cast<std::size_t>(slots_[slot])];
    if (place.block == block && place.of == of && place.side == side) return slots_[slot];
  }
  if (places_.size() == kMostPlaces) return 0;
  slots_[slot] = static_cast<std::int32_t>(places_.size());
  Place& place = places_.emplace_back();
  place.of = of;
  place.block = block;
  place.side = side;
  tables_.resize(places_.size() * LightTree::kTopNodes, 1.0F);
  lights_.resize(tables_.size());
  return slots_[slot];
}

void LampMemory::note(const LightTree& tree, std::int32_t place, std::int32_t lamp, float light, bool is_blocked) {
  if (place == 0 || !(light < 1e30F)) return;
  const auto at = static_cast<std::size_t>(place);
  QUOIN_ASSERT(place > 0 && at < places_.size(), "a place that was returned");
  places_[at].is_new = true;
  places_[at].samples += 1.0F;
  Light* const lights = lights_.data() + at * LightTree::kTopNodes;
  tree.for_each_top_node(static_cast<std::uint32_t>(lamp), [&](std::size_t node) {
    lights[node].sent += light;
    if (!is_blocked) lights[node].arrived += light;
  });
}

void LampMemory::learn() {
  for (std::size_t at = 1; at < places_.size(); ++at) {
    Place& place = places_[at];
    if (!place.is_new) continue;
    place.is_new = false;
    const Light* const lights = lights_.data() + at * LightTree::kTopNodes;
    float* const table = tables_.data() + at * LightTree::kTopNodes;
    const float belief = kBelief * lights[0].sent / place.samples;
    if (!(belief > 1e-30F)) continue;
    for (std::size_t node = 0; node < LightTree::kTopNodes; ++node) {
      const float share = (lights[node].arrived + belief) / (lights[node].sent + belief);
      table[node] = std::max(share, kLeastNodeShare);
    }
  }
}

}  // namespace quoin::path
