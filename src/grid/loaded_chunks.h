#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <quoin/core/vec.h>

#include "core/coordinates/chunk_order.h"
#include "core/coordinates/chunk_trie.h"
#include "grid/long_box.h"

namespace quoin {

/// Which chunks of a partial grid are in memory; of a grid that is not partial all are. Copies share it.
class LoadedChunks {
 public:
  /// None is, from now on.
  void begin() {
    is_partial_ = true;
    chunks_.clear();
  }
  [[nodiscard]] bool is_partial() const { return is_partial_; }
  [[nodiscard]] bool has(IVec3 chunk) const {
    return !is_partial_ || !is_inside_world(chunk) || chunks_.find(chunk.x, chunk.y, chunk.z) != nullptr;
  }
  /// Whether edits may change a chunk.
  [[nodiscard]] bool may_edit(IVec3 chunk) const { return is_inside_world(chunk) && has(chunk); }
  [[nodiscard]] bool has_around(IVec3 chunk, int distance) const {
    if (!is_partial_) return true;
    for (int z = -distance; z <= distance; ++z) {
      for (int y = -distance; y <= distance; ++y) {
        for (int x = -distance; x <= distance; ++x) {
          if (!has(chunk + IVec3{x, y, z})) return false;
        }
      }
    }
    return true;
  }
  /// Of all chunks that a box of voxels meets.
  [[nodiscard]] bool has_within(const IBox& voxels) const {
    if (!is_partial_ || voxels.empty()) return true;
    const IBox chunks = chunks_of(box_from(voxels));
    // More than there are cannot all be there; and what lies outside of the world is.
    const LongBox inside = box_from(intersect(chunks, {IVec3(kMinChunk + 1), IVec3(kMaxChunk)}));
    if (is_empty(inside)) return true;
    const auto edge = [&](std::size_t axis) { return static_cast<double>(inside.max[axis] - inside.min[axis]); };
    if (edge(0) * edge(1) * edge(2) > static_cast<double>(count())) return false;
    for (std::int64_t z = inside.min[2]; z < inside.max[2]; ++z) {
      for (std::int64_t y = inside.min[1]; y < inside.max[1]; ++y) {
        for (std::int64_t x = inside.min[0]; x < inside.max[0]; ++x) {
          if (!has({static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)})) return false;
        }
      }
    }
    return true;
  }
  [[nodiscard]] std::size_t count() const { return chunks_.size(); }
  [[nodiscard]] std::vector<IVec3> sorted() const {
    std::vector<IVec3> all;
    all.reserve(chunks_.size());
    chunks_.for_each([&](IVec3 at, const Mark&) { all.push_back(at); });
    std::sort(all.begin(), all.end(), by_zyx);
    return all;
  }
  /// Of a partial grid those in a box of chunks, sorted by z, then y, then x.
  [[nodiscard]] std::vector<IVec3> within(const IBox& chunks) const {
    std::vector<IVec3> found;
    chunks_.for_each_in(chunks, [&](IVec3 at, const Mark&) { found.push_back(at); });
    std::sort(found.begin(), found.end(), by_zyx);
    return found;
  }
  [[nodiscard]] std::size_t bytes() const { return chunks_.bytes(); }

  /// False where it is loaded, outside of the world, or the grid is not partial.
  bool add(IVec3 chunk) {
    if (!is_partial_ || has(chunk)) return false;
    chunks_.find_or_create(chunk, [](auto&) {});
    return true;
  }
  /// False where it is not loaded, or the grid is not partial.
  bool remove(IVec3 chunk) {
    return is_partial_ && chunks_.erase(chunk, [](auto&) {});
  }

 private:
  struct Mark {};
  ChunkTrie<Mark> chunks_;
  bool is_partial_ = false;
};

}  // namespace quoin
