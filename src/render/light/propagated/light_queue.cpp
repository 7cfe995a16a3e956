#include "render/light/propagated/light_queue.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin::propagated {

namespace {

// Longer regions do not fit into the processor's cache.
constexpr int kMostAlongX = 4;

// Voxels that a region visits in all its channels, and some more for its fixed cost.
std::int64_t cost_of(const IBox& visited, unsigned channels) {
  constexpr std::int64_t kRegion = 32'768;
  return (kRegion + volume(visited)) * std::popcount(channels);
}

// Calls `visit(chunk, box)` for the boxes in a box of chunks.
template <class Boxes, class Visit>
void visit_within(Boxes& boxes, const IBox& chunks, Visit&& visit) {
  for (int y = chunks.max.y; y-- > chunks.min.y;) {
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      auto box = boxes.lower_bound({chunks.min.x, y, z});
      for (; box != boxes.end() && box->first.y == y && box->first.z == z && box->first.x < chunks.max.x; ++box) {
        visit(box->first, box->second);
      }
    }
  }
}

}  // namespace

void LightQueue::add(const IBox& voxels, unsigned channels, const LightDomain& domain) {
  QUOIN_ASSERT(!voxels.empty() && channels != 0 && channels <= kAllChannels, "a box of voxels, some channels");
  const IVec3 first = chunk_of(voxels.min);
  const IVec3 last = chunk_of(voxels.max - 1);
  for (int z = first.z; z <= last.z; ++z) {
    for (int x = first.x; x <= last.x; ++x) {
      const LightDomain::Range range = domain.range(x, z);
      for (int y = std::max(first.y, range.begin); y <= std::min(last.y, range.end - 1); ++y) {
        const IVec3 low = IVec3(x, y, z) * kChunkEdge;
        Box& known = boxes_[{x, y, z}];
        known.voxels = unite(known.voxels, intersect(voxels, {low, low + kChunkEdge}));
        known.channels |= channels;
      }
    }
  }
}

IBox LightQueue::unknown(IVec3 chunk) const {
  const auto found = boxes_.find(chunk);
  if (found == boxes_.end()) return {};
  const IVec3 low = chunk * kChunkEdge;
  return {found->second.voxels.min - low, found->second.voxels.max - low};
}

// Returns the voxels to visit for a wanted box: with all unknown light below the chunk layer `top` that reaches it.
// Light falls from any height.
IBox LightQueue::visited(const IBox& wanted, int top) const {
  const IBox near{wanted.min - kReach, {wanted.max.x + kReach, top * kChunkEdge, wanted.max.z + kReach}};
  IBox all = wanted;
  visit_within(boxes_, {chunk_of(near.min), chunk_of(near.max - 1) + 1},
               [&](IVec3, const Box& box) { all = unite(all, intersect(box.voxels, near)); });
  return all;
}

// Adds the boxes of the next layer of chunks on one side, if that saves work.
bool LightQueue::grow(Tile& tile, int axis, bool is_up) const {
  IBox layer = tile.chunks;
  layer.min[axis] = is_up ? tile.chunks.max[axis] : tile.chunks.min[axis] - 1;
  layer.max[axis] = layer.min[axis] + 1;
  Tile larger{unite(tile.chunks, layer), tile.wanted, {}, tile.channels};
  if (larger.chunks.size().x > kMostAlongX) return false;
  std::int64_t apart = cost_of(tile.visited, tile.channels);
  bool is_free = true;
  visit_within(boxes_, layer, [&](IVec3 chunk, const Box& box) {
    is_free &= !box.is_taken;
    larger.wanted = unite(larger.wanted, box.voxels);
    larger.channels |= box.channels;
    apart += cost_of(visited(box.voxels, chunk.y + 1), box.channels);
  });
  if (!is_free || larger.wanted == tile.wanted) return false;
  larger.visited = visited(larger.wanted, boxes_.begin()->first.y + 1);
  if (!LightSolver::fits(larger.visited.size()) || cost_of(larger.visited, larger.channels) > apart) return false;
  tile = larger;
  return true;
}

LightQueue::Tile LightQueue::tile_at(Boxes::const_iterator first) const {
  const IBox& voxels = first->second.voxels;
  Tile tile{{first->first, first->first + 1}, voxels, visited(voxels, first->first.y + 1), first->second.channels};
  constexpr std::array<std::pair<int, bool>, 5> kSides{{{0, true}, {0, false}, {2, true}, {2, false}, {1, false}}};
  for (bool goes_on = true; goes_on;) {
    goes_on = false;
    for (const auto& [axis, is_up] : kSides) goes_on |= grow(tile, axis, is_up);
  }
  return tile;
}

std::vector<LightRegion> LightQueue::next(std::size_t most) {
  QUOIN_ASSERT(!boxes_.empty() && taken_.empty(), "boxes to be solved");
  const int highest = boxes_.begin()->first.y;
  std::vector<LightRegion> regions;
  for (auto first = boxes_.begin(); first != boxes_.end() && first->first.y == highest; ++first) {
    if (regions.size() == most) break;
    if (first->second.is_taken) continue;
    const Tile tile = tile_at(first);
    visit_within(boxes_, tile.chunks, [&](IVec3 chunk, Box& box) {
      box.is_taken = true;
      taken_.push_back(chunk);
    });
    LightRegion& region = regions.emplace_back();
    region.all = {LightSolver::widened({tile.visited, tile.wanted}), tile.wanted};
    for (std::size_t c = 0; c < kChannels; ++c) {
      if ((tile.channels >> c & 1U) != 0) region.channels[c] = region.all;
    }
  }
  return regions;
}

void LightQueue::remove_solved() {
  for (const IVec3 chunk : taken_) boxes_.erase(chunk);
  taken_.clear();
}

namespace {

// Boxes that touch or share a chunk slab, so that their results would overwrite each other.
struct Cluster {
  LightBoxes boxes;
  IBox all;
  IBox slabs;  // around it and its rim
  bool is_alone = true;

  explicit Cluster(const LightBoxes& one) : boxes(one), all(around_all(one)) {
    const IVec3 size{kChunkEdge, 4, 4};
    slabs = {(all.min - 1) & ~(size - 1), (all.max + size) & ~(size - 1)};
  }
  [[nodiscard]] bool touches(const Cluster& other) const { return !intersect(slabs, other.slabs).empty(); }
  // Returns true if it is not much work to solve both as one box.
  [[nodiscard]] bool joins(const Cluster& other) const {
    constexpr std::int64_t kWaste = 200'000;
    const IBox united = unite(all, other.all);
    return LightSolver::fits(united.size()) && volume(united) <= volume(all) + volume(other.all) + kWaste;
  }
  void add(const Cluster& other) {
    for (std::size_t c = 0; c < kChannels; ++c) boxes[c] = unite(boxes[c], other.boxes[c]);
    all = unite(all, other.all);
    slabs = unite(slabs, other.slabs);
  }
};

// Adds a cluster: merges it with others, or marks it and those that it touches as not alone.
void add_cluster(Cluster cluster, std::vector<Cluster>& clusters) {
  for (std::size_t i = 0; i < clusters.size();) {
    if (!clusters[i].touches(cluster) || !clusters[i].joins(cluster)) {
      ++i;
      continue;
    }
    cluster.add(clusters[i]);
    clusters.erase(clusters.begin() + static_cast<std::ptrdiff_t>(i));
    i = 0;
  }
  clusters.push_back(cluster);
}

void mark_neighbours(std::vector<Cluster>& clusters) {
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    clusters[i].is_alone &= LightSolver::fits(clusters[i].all.size());
    for (std::size_t j = 0; j < i; ++j) {
      if (!clusters[i].touches(clusters[j])) continue;
      clusters[i].is_alone = false;
      clusters[j].is_alone = false;
    }
  }
}

}  // namespace

void sort_boxes(std::vector<LightBoxes>& boxes, LightQueue& queue, const LightDomain& domain) {
  constexpr std::size_t kMany = 1024;
  std::vector<Cluster> clusters;
  const bool are_many = boxes.size() > kMany;
  for (const LightBoxes& each : boxes) {
    are_many ? clusters.push_back(Cluster(each)) : add_cluster(Cluster(each), clusters);
  }
  if (!are_many) mark_neighbours(clusters);
  boxes.clear();
  for (const Cluster& cluster : clusters) {
    if (!are_many && cluster.is_alone) {
      boxes.push_back(cluster.boxes);
      continue;
    }
    for (std::size_t c = 0; c < kChannels; ++c) {
      if (!cluster.boxes[c].empty()) queue.add(cluster.boxes[c], 1U << c, domain);
    }
  }
}

}  // namespace quoin::propagated
