#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include <quoin/core/vec.h>

#include "core/coordinates/chunk_order.h"
#include "core/coordinates/chunk_trie.h"
#include "core/coordinates/long_box.h"

namespace quoin {

/// The loaded chunks of a partial grid. In a grid that is not partial, all chunks count as loaded. Shared with copies.
///
///   . . . . o .      extent (box)   chunks that must be loaded before their content is known
///   +-------+ .      o (others)     such chunks outside of the box
///   | m . m | .      m (marks)      loaded
///   +-------+ .      .              outside of the box: air without a mark, which counts as loaded
class LoadedChunks {
 public:
  /// Makes the grid partial with no chunk loaded. Every chunk must be loaded.
  void begin() {
    is_partial_ = true;
    extent_ = bounds_ = all_chunks();
    marks_.clear();
    others_.clear();
  }
  [[nodiscard]] bool is_partial() const { return is_partial_; }
  [[nodiscard]] bool has(IVec3 chunk) const {
    if (!is_partial_ || !is_inside_world(chunk)) return true;
    if (marks_.find(chunk.x, chunk.y, chunk.z) != nullptr) return true;
    return !extent_.contains(chunk) && others_.find(chunk.x, chunk.y, chunk.z) == nullptr;
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
    const IBox chunks = intersect(chunks_of(box_from(voxels)), all_chunks());
    if (chunks.empty()) return true;
    bool has_others = true;
    others_.for_each_in(chunks, [&](IVec3 at, const Mark&) { has_others = has_others && has(at); });
    return has_others && has_all_of(intersect(chunks, extent_));
  }
  /// Returns the number of marks: the loaded chunks, except edited ones outside of the extent.
  [[nodiscard]] std::size_t count() const { return marks_.size(); }
  /// Calls `visit(chunk)` for each chunk with a mark.
  template <class Visit>
  void for_each(Visit&& visit) const {
    marks_.for_each([&](IVec3 at, const Mark&) { visit(at); });
  }
  /// Returns the chunks of a box with marks, sorted by z, y, x. Without a chunk outside of the extent in the box, these
  /// are all loaded chunks in it.
  [[nodiscard]] std::vector<IVec3> within(const IBox& chunks) const {
    std::vector<IVec3> found;
    marks_.for_each_in(chunks, [&](IVec3 at, const Mark&) { found.push_back(at); });
    std::sort(found.begin(), found.end(), by_zyx);
    return found;
  }
  /// Returns true if all loaded chunks of a box of chunks have marks.
  [[nodiscard]] bool has_marks_only(const IBox& chunks) const {
    return is_partial_ && intersect(chunks, extent_) == chunks;
  }
  /// Returns a box of all chunks that are not loaded, or may be unloaded; empty if the grid is not partial.
  [[nodiscard]] IBox bounds() const { return is_partial_ ? bounds_ : IBox{}; }
  [[nodiscard]] std::size_t bytes() const { return marks_.bytes() + others_.bytes(); }

  /// Returns false if the chunk is already loaded or outside of the world, or the grid is not partial.
  bool add(IVec3 chunk) {
    if (!is_partial_ || has(chunk)) return false;
    marks_.find_or_create(chunk, [](auto&) {});
    return true;
  }
  /// Returns false if the chunk is not loaded or outside of the world, or the grid is not partial. A chunk outside of
  /// the extent must be loaded from then on.
  bool remove(IVec3 chunk) {
    if (!is_partial_ || !may_edit(chunk)) return false;
    if (!extent_.contains(chunk)) add_other(chunk);
    marks_.erase(chunk, [](auto&) {});
    return true;
  }
  /// Requires: the grid is partial, and chunks with content have marks.
  void set_extent(const IBox& chunks, std::span<const IVec3> others) {
    QUOIN_ASSERT(is_partial_, "a partial grid");
    const IBox inside = intersect(chunks, all_chunks());
    extent_ = bounds_ = inside.empty() ? IBox{} : inside;
    others_.clear();
    for (const IVec3 other : others) {
      if (is_inside_world(other) && !extent_.contains(other)) add_other(other);
    }
  }
  /// Marks a chunk as loaded. Requires: the grid is partial.
  void mark(IVec3 chunk) {
    marks_.find_or_create(chunk, [](auto&) {});
  }

 private:
  struct Mark {};

  // Requires: the box lies in the extent.
  [[nodiscard]] bool has_all_of(const IBox& chunks) const {
    if (chunks.empty()) return true;
    // A box with more chunks than are loaded contains an unloaded one.
    const DVec3 size = DVec3(chunks.max) - DVec3(chunks.min);
    if (size.x * size.y * size.z > static_cast<double>(marks_.size())) return false;
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) {
          if (marks_.find(x, y, z) == nullptr) return false;
        }
      }
    }
    return true;
  }
  static IBox all_chunks() { return {IVec3(kMinChunk + 1), IVec3(kMaxChunk)}; }
  void add_other(IVec3 chunk) {
    others_.find_or_create(chunk, [](auto&) {});
    bounds_ = unite(bounds_, {chunk, chunk + 1});
  }

  ChunkTrie<Mark> marks_;
  ChunkTrie<Mark> others_;
  IBox extent_;
  IBox bounds_;  // of the extent and the others
  bool is_partial_ = false;
};

}  // namespace quoin
