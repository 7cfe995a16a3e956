#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>

#include <tsl/robin_map.h>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>

namespace quoin {

/// One box per chunk and the box around all of them, updated at a cost of O(log chunks) per change. For each of the six
/// sides, a map counts the chunk boxes that end at each coordinate.
class ChunkBoxes {
 public:
  /// Sets the box of a chunk; an empty box removes the chunk. If it throws, put the chunk again; all others are
  /// unchanged.
  void put(IVec3 chunk, const IBox& box) {
    try {
      const auto found = boxes_.find(chunk);
      if (found == boxes_.end()) {
        if (box.empty()) return;
        boxes_.emplace(chunk, box);
        if (is_counted_) count(box, 1);
      } else if (box.empty()) {
        if (is_counted_) count(found->second, -1);
        boxes_.erase(found);
      } else {
        if (is_counted_) count_move(found->second, box);
        found.value() = box;
      }
    } catch (...) {
      is_counted_ = false;
      throw;
    }
  }

  /// Returns the box around all boxes. Cost: O(chunks) the first time, O(chunks log chunks) the second time. Counting
  /// starts with the second call, so that containers that never change do not pay for it.
  [[nodiscard]] IBox bounds() {
    IBox around;
    if (!was_asked_) {
      was_asked_ = true;
      for (const auto& [chunk, box] : boxes_) around = unite(around, box);
      return around;
    }
    if (!is_counted_) {
      mins_ = maxs_ = {};
      for (const auto& [chunk, box] : boxes_) count(box, 1);
      is_counted_ = true;
    }
    for (int axis = 0; axis < 3 && !boxes_.empty(); ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      QUOIN_ASSERT(!mins_[i].empty() && !maxs_[i].empty(), "every box is counted");
      around.min[axis] = mins_[i].begin()->first;
      around.max[axis] = maxs_[i].rbegin()->first;
    }
    return around;
  }

  /// Returns the box of a chunk, or null if it has none. Valid until the next `put`.
  [[nodiscard]] const IBox* find(IVec3 chunk) const {
    const auto found = boxes_.find(chunk);
    return found == boxes_.end() ? nullptr : &found->second;
  }
  [[nodiscard]] std::size_t size() const { return boxes_.size(); }
  [[nodiscard]] auto begin() const { return boxes_.begin(); }
  [[nodiscard]] auto end() const { return boxes_.end(); }
  [[nodiscard]] std::size_t bytes() const { return boxes_.bucket_count() * (sizeof(IVec3) + sizeof(IBox)); }

 private:
  void count(const IBox& box, int by) {
    for (int axis = 0; axis < 3; ++axis) {
      count(mins_[static_cast<std::size_t>(axis)], box.min[axis], by);
      count(maxs_[static_cast<std::size_t>(axis)], box.max[axis], by);
    }
  }
  // Most boxes that change keep some of their sides.
  void count_move(const IBox& from, const IBox& to) {
    const auto move = [](std::map<int, int>& ends, int before, int now) {
      if (before == now) return;
      count(ends, before, -1);
      count(ends, now, 1);
    };
    for (int axis = 0; axis < 3; ++axis) {
      move(mins_[static_cast<std::size_t>(axis)], from.min[axis], to.min[axis]);
      move(maxs_[static_cast<std::size_t>(axis)], from.max[axis], to.max[axis]);
    }
  }
  static void count(std::map<int, int>& ends, int at, int by) {
    const auto found = ends.try_emplace(at, 0).first;
    found->second += by;
    QUOIN_ASSERT(found->second >= 0, "only counted boxes are removed");
    if (found->second == 0) ends.erase(found);
  }

  tsl::robin_map<IVec3, IBox, CoordinateHash, std::equal_to<IVec3>, BlockAllocator<std::pair<IVec3, IBox>>> boxes_;
  bool was_asked_ = false;
  bool is_counted_ = false;
  std::array<std::map<int, int>, 3> mins_;  // number of chunk boxes that begin at a coordinate
  std::array<std::map<int, int>, 3> maxs_;  // number that end there
};

}  // namespace quoin
