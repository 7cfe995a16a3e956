#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/vec.h>

#include "core/coordinates/chunk_order.h"
#include "core/coordinates/chunk_trie.h"
#include "core/coordinates/long_box.h"

namespace quoin {

/// A set of chunks that copies share. An entry of its tree has a bit for each chunk of a cube of 4^3. A change copies
/// few nodes: one below the root covers 16^3 chunks.
/// Threads: as ChunkTrie.
class ChunkBits {
 public:
  [[nodiscard]] bool contains(IVec3 chunk) const {
    const Cube* const cube = cubes_.find(chunk.x >> 2, chunk.y >> 2, chunk.z >> 2);
    return cube != nullptr && (cube->chunks & bit_of(chunk)) != 0;
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t bytes() const { return cubes_.bytes(); }
  void insert(IVec3 chunk) {
    if (contains(chunk)) return;
    cubes_.find_or_create(cube_of(chunk), [](auto&) {}).chunks |= bit_of(chunk);
    ++size_;
  }
  void erase(IVec3 chunk) {
    if (!contains(chunk)) return;
    Cube& cube = cubes_.find_or_create(cube_of(chunk), [](auto&) {});
    cube.chunks &= ~bit_of(chunk);
    --size_;
    if (cube.chunks == 0) cubes_.erase(cube_of(chunk), [](auto&) {});
  }
  void clear() {
    cubes_.clear();
    size_ = 0;
  }
  /// Returns true if both are one set: copies without changes since, or empty. Cost: O(1).
  [[nodiscard]] bool shares_all_with(const ChunkBits& other) const { return cubes_.shares_all_with(other.cubes_); }
  /// Returns true if both have the same chunks.
  [[nodiscard]] bool is_same(const ChunkBits& other) const {
    bool has_all = size_ == other.size_;
    for_each([&](IVec3 chunk) { has_all = has_all && other.contains(chunk); });
    return has_all;
  }
  /// Calls `visit(chunk)` for each chunk. The order depends only on the coordinates.
  template <class Visit>
  void for_each(Visit&& visit) const {
    cubes_.for_each([&](IVec3 at, const Cube& cube) { visit_cube(at, cube, visit); });
  }
  template <class Visit>
  void for_each_in(const IBox& chunks, Visit&& visit) const {
    if (chunks.empty()) return;
    const IBox cubes{cube_of(chunks.min), cube_of(chunks.max - 1) + 1};
    cubes_.for_each_in(cubes, [&](IVec3 at, const Cube& cube) {
      visit_cube(at, cube, [&](IVec3 chunk) {
        if (chunks.contains(chunk)) visit(chunk);
      });
    });
  }

 private:
  struct Cube {
    std::uint64_t chunks = 0;
  };
  static IVec3 cube_of(IVec3 chunk) { return {chunk.x >> 2, chunk.y >> 2, chunk.z >> 2}; }
  static std::uint64_t bit_of(IVec3 chunk) {
    return std::uint64_t{1} << ((chunk.x & 3) | (chunk.y & 3) << 2 | (chunk.z & 3) << 4);
  }
  template <class Visit>
  static void visit_cube(IVec3 at, const Cube& cube, Visit&& visit) {
    for (std::uint64_t left = cube.chunks; left != 0; left &= left - 1) {
      const int bit = std::countr_zero(left);
      visit(at * 4 + IVec3{bit & 3, bit >> 2 & 3, bit >> 4});
    }
  }

  ChunkTrie<Cube> cubes_;
  std::size_t size_ = 0;
};

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
    return marks_.contains(chunk) || (!extent_.contains(chunk) && !others_.contains(chunk));
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
    others_.for_each_in(chunks, [&](IVec3 at) { has_others = has_others && has(at); });
    return has_others && has_all_of(intersect(chunks, extent_));
  }
  /// Returns the number of marks: the loaded chunks, except edited ones outside of the extent.
  [[nodiscard]] std::size_t count() const { return marks_.size(); }
  /// Calls `visit(chunk)` for each chunk with a mark.
  template <class Visit>
  void for_each(Visit&& visit) const {
    marks_.for_each(visit);
  }
  /// Returns the chunks of a box with marks, sorted by z, y, x. Without a chunk outside of the extent in the box, these
  /// are all loaded chunks in it.
  [[nodiscard]] std::vector<IVec3> within(const IBox& chunks) const {
    std::vector<IVec3> found;
    marks_.for_each_in(chunks, [&](IVec3 at) { found.push_back(at); });
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
    marks_.insert(chunk);
    return true;
  }
  /// Returns false if the chunk is not loaded or outside of the world, or the grid is not partial. A chunk outside of
  /// the extent must be loaded from then on.
  bool remove(IVec3 chunk) {
    if (!is_partial_ || !may_edit(chunk)) return false;
    if (!extent_.contains(chunk)) add_other(chunk);
    marks_.erase(chunk);
    return true;
  }
  [[nodiscard]] bool is_same(const LoadedChunks& other) const {
    return is_partial_ == other.is_partial_ && extent_ == other.extent_ && marks_.is_same(other.marks_) &&
           others_.is_same(other.others_);
  }
  /// Calls `change(list)` for two lists and returns both results. Two lists that share all chunks are changed once, and
  /// share them again. If `change` throws for the second of two lists, the first stays changed.
  template <class Change>
  static std::pair<bool, bool> change_both(LoadedChunks& one, LoadedChunks& other, Change&& change) {
    const bool is_shared = one.marks_.shares_all_with(other.marks_) && one.others_.shares_all_with(other.others_) &&
                           one.extent_ == other.extent_ && one.is_partial_ == other.is_partial_;
    if (!is_shared) {
      const bool has_changed = change(one);
      return {has_changed, change(other)};
    }
    other = LoadedChunks();  // else the change would copy nodes that only these two share
    const auto share = [&] { other = one; };
    bool has_changed = false;
    try {
      has_changed = change(one);
    } catch (...) {
      share();
      throw;
    }
    share();
    return {has_changed, has_changed};
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
  void mark(IVec3 chunk) { marks_.insert(chunk); }

 private:
  // Requires: the box lies in the extent.
  [[nodiscard]] bool has_all_of(const IBox& chunks) const {
    if (chunks.empty()) return true;
    // A box with more chunks than are loaded contains an unloaded one.
    const DVec3 size = DVec3(chunks.max) - DVec3(chunks.min);
    if (size.x * size.y * size.z > static_cast<double>(marks_.size())) return false;
    for (int z = chunks.min.z; z < chunks.max.z; ++z) {
      for (int y = chunks.min.y; y < chunks.max.y; ++y) {
        for (int x = chunks.min.x; x < chunks.max.x; ++x) {
          if (!marks_.contains({x, y, z})) return false;
        }
      }
    }
    return true;
  }
  static IBox all_chunks() { return {IVec3(kMinChunk + 1), IVec3(kMaxChunk)}; }
  void add_other(IVec3 chunk) {
    others_.insert(chunk);
    bounds_ = unite(bounds_, {chunk, chunk + 1});
  }

  ChunkBits marks_;
  ChunkBits others_;
  IBox extent_;
  IBox bounds_;  // of the extent and the others
  bool is_partial_ = false;
};

}  // namespace quoin
