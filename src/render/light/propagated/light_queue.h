#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include <quoin/core/vec.h>

#include "render/light/propagated/light_solver.h"
#include "render/light/propagated/light_store.h"

namespace quoin::propagated {

/// Boxes of chunks whose light is unknown, and the order in which to solve them: from above, since sky light falls.
///
/// A region is one box or several neighbouring ones. It also covers the unknown light within reach, which it solves as
/// well but does not write. Sides with known light need no such margin:
///
///     queued boxes      +--------+ . .      a region that wants a: the part of b within 14 is its margin;
///                       |   a    |b .       above it and to its left, the light is known
///                       +--------+ . .
///                       . . c . . .
class LightQueue {
 public:
  /// Queues the parts of a box of voxels that lie in the domain. The box of a chunk grows to contain all its parts.
  /// `channels`: bit c is set for each channel whose light is unknown.
  void add(const IBox& voxels, unsigned channels, const LightDomain& domain);
  [[nodiscard]] bool empty() const { return boxes_.empty(); }
  void clear() {
    boxes_.clear();
    taken_.clear();
  }
  /// Returns the box of a chunk whose light is unknown, in chunk coordinates; empty if all of it is known.
  [[nodiscard]] IBox unknown(IVec3 chunk) const;

  /// Returns up to `most` regions of the highest chunks of the queue that do not depend on each other. Regions that are
  /// solved at the same time need margins towards each other, so one by one is the least work.
  /// Requires: `remove_solved` was called after the regions of the call before were solved.
  [[nodiscard]] std::vector<LightRegion> next(std::size_t most);
  /// Removes the boxes of the last regions.
  void remove_solved();

 private:
  // By descending y, so that the first chunk is one of the highest; then z, then x.
  struct FromAbove {
    bool operator()(IVec3 a, IVec3 b) const {
      if (a.y != b.y) return a.y > b.y;
      return a.z != b.z ? a.z < b.z : a.x < b.x;
    }
  };
  struct Box {
    IBox voxels;            // in grid coordinates
    unsigned channels = 0;  // bit c: channel c is unknown
    bool is_taken = false;  // a region of the last `next` wants it
  };
  using Boxes = std::map<IVec3, Box, FromAbove>;
  struct Tile {
    IBox chunks;
    IBox wanted;
    IBox visited;
    unsigned channels;
  };
  [[nodiscard]] IBox visited(const IBox& wanted, int top) const;
  [[nodiscard]] bool grow(Tile& tile, int axis, bool is_up) const;
  [[nodiscard]] Tile tile_at(Boxes::const_iterator first) const;

  Boxes boxes_;
  std::vector<IVec3> taken_;
};

/// Merges boxes that touch, if that is not much more work. Leaves the boxes that can each be solved as a whole, and
/// queues all others, or all if there are more than 1,024. If it throws, `boxes` and `queue` are unspecified.
void sort_boxes(std::vector<LightBoxes>& boxes, LightQueue& queue, const LightDomain& domain);

}  // namespace quoin::propagated
