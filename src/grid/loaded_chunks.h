#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <quoin/core/vec.h>

#include "core/coordinates/chunk_order.h"
#include "core/coordinates/chunk_trie.h"
#include "core/coordinates/long_box.h"

namespace quoin {

/// The loaded chunks of a partial grid. In a grid that is not partial, all chunks count as loaded. Shared with copies.
class LoadedChunks {
 public:
  /// Makes the grid partial with no chunk loaded.
  void begin() {
    is_partial_ = true;
    chunks_.clear();
  }
  [[nodiscard]] bool is_partial() const { return is_partial_; }
  [[nodiscard]] bool has(IVec3 chunk) const {
    return !is_partial_ || !is_inside_world(chunk) || chunks_.find(chunk.x, chunk.y, chunk.z) != nullptr;
  }
  /// Returns true if edits may change the chunk.
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
  /// Returns true if all chunks that a box of voxels overlaps are loaded.
  [[nodiscard]] bool has_within(const IBox& voxels) const {
    if (!is_partial_ || voxels.empty()) return true;
    const IBox chunks = chunks_of(box_from(voxels));
    // A box with more chunks than are loaded contains an unloaded one. Chunks outside of the world count as loaded.
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
  /// Returns the loaded chunks of a partial grid in a box of chunks, sorted by z, y, x.
  [[nodiscard]] std::vector<IVec3> within(const IBox& chunks) const {
    std::vector<IVec3> found;
    chunks_.for_each_in(chunks, [&](IVec3 at, const Mark&) { found.push_back(at); });
    std::sort(found.begin(), found.end(), by_zyx);
    return found;
  }
  [[nodiscard]] std::size_t bytes() const { return chunks_.bytes(); }

  /// Returns false if the chunk is already loaded or outside of the world, or the grid is not partial.
  bool add(IVec3 chunk) {
    if (!is_partial_ || has(chunk)) return false;
    chunks_.find_or_create(chunk, [](auto&) {});
    return true;
  }
  /// Returns false if the chunk is not loaded or the grid is not partial.
  bool remove(IVec3 chunk) {
    return is_partial_ && chunks_.erase(chunk, [](auto&) {});
  }

 private:
  struct Mark {};
  ChunkTrie<Mark> chunks_;
  bool is_partial_ = false;
};

}  // namespace quoin
