#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <unordered_map>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>

namespace quoin::propagated {

/// The chunks whose light is stored: chunks at most one away from a chunk with voxels, and the gaps between them in
/// each column. Space above them, and columns without them, are open sky; space below is dark. Light that leaves the
/// domain reaches no surface, since a chunk is wider than the range of light.
class LightDomain {
 public:
  struct Range {
    int begin = 0;
    int end = 0;
    bool operator==(const Range&) const = default;
  };
  /// A column whose range of chunks is another than before.
  struct Change {
    int x, z;
    Range before, now;
  };

  [[nodiscard]] bool has_voxels(IVec3 chunk) const {
    const auto column = columns_.find({chunk.x, 0, chunk.z});
    return column != columns_.end() && column->second.count(chunk.y) > 0;
  }
  /// Records that a chunk has voxels now, or has none any more. Appends the columns whose stored range changed.
  void set(IVec3 chunk, bool has_voxels, std::vector<Change>& changed) {
    std::set<int>& column = columns_[{chunk.x, 0, chunk.z}];
    const bool is_news = has_voxels ? column.insert(chunk.y).second : column.erase(chunk.y) > 0;
    if (column.empty()) columns_.erase({chunk.x, 0, chunk.z});
    for (int z = chunk.z - 1; is_news && z <= chunk.z + 1; ++z) {
      for (int x = chunk.x - 1; x <= chunk.x + 1; ++x) {
        const Range before = range(x, z);
        const Range now = found_range(x, z);
        if (before == now) continue;
        changed.push_back({x, z, before, now});
        ranges_[{x, 0, z}] = now;
        if (now == Range{}) ranges_.erase({x, 0, z});
      }
    }
  }

  /// y of the chunks of a column; empty for one that is open to the sky.
  [[nodiscard]] Range range(int x, int z) const {
    const auto found = ranges_.find({x, 0, z});
    return found == ranges_.end() ? Range{} : found->second;
  }
  [[nodiscard]] bool holds(IVec3 chunk) const {
    const Range found = range(chunk.x, chunk.z);
    return chunk.y >= found.begin && chunk.y < found.end;
  }
  /// Packed light of a chunk that it does not hold.
  [[nodiscard]] std::uint16_t beyond(IVec3 chunk) const {
    QUOIN_ASSERT(!holds(chunk), "a chunk that is not held");
    const Range found = range(chunk.x, chunk.z);
    const bool is_below = found.begin != found.end && chunk.y < found.begin;
    return is_below ? 0 : 15;
  }
  void clear() {
    columns_.clear();
    ranges_.clear();
  }

 private:
  [[nodiscard]] Range found_range(int x, int z) const {
    std::optional<Range> all;
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dx = -1; dx <= 1; ++dx) {
        const auto found = columns_.find({x + dx, 0, z + dz});
        if (found == columns_.end()) continue;
        QUOIN_ASSERT(!found->second.empty(), "a column has chunks");
        const int begin = *found->second.begin() - 1;
        const int end = *found->second.rbegin() + 2;
        all = all ? Range{std::min(all->begin, begin), std::max(all->end, end)} : Range{begin, end};
      }
    }
    return all.value_or(Range{});
  }

  std::unordered_map<IVec3, std::set<int>, CoordinateHash> columns_;  // [x, 0, z]: y of chunks with voxels
  std::unordered_map<IVec3, Range, CoordinateHash> ranges_;           // [x, 0, z]: non-empty ranges
};

}  // namespace quoin::propagated
