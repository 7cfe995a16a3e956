#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/grid/chunk.h>

#include "core/coordinates/chunk_trie.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {

/// A chunk and the grid's bookkeeping for it.
struct ChunkEntry {
  Chunk chunk;
  std::uint64_t serial = 0;  ///< serial of its last record in the grid's journal
  int counted = 0;           ///< its voxels that are not air, as counted by the grid
};

/// A box of chunks with one pointer per cell, null for missing chunks. A lookup takes constant time.
///
///   box from 5 to 12:  8 9 10 11 12 5 6 7    a chunk's cell is its coordinate modulo the box's size, so that chunks
///   from 6 to 13:      8 9 10 11 12 13 6 7   keep their cells while the box slides
class ChunkWindow {
 public:
  static constexpr std::uint32_t kOutside = ~std::uint32_t{0};
  static constexpr int kMaxSlide = 4;
  /// Sizes are powers of two along each axis, so that cells are computed by shifts.
  struct Box {
    IVec3 first{0};
    std::array<int, 3> log{};
    [[nodiscard]] int log_cells() const { return log[0] + log[1] + log[2]; }
    [[nodiscard]] IVec3 size() const { return {1 << log[0], 1 << log[1], 1 << log[2]}; }
    /// Doubles the size towards a chunk until it is inside.
    [[nodiscard]] Box grown_to(IVec3 chunk) const;
  };

  ChunkWindow();
  ChunkWindow(const ChunkWindow&) = delete;
  ChunkWindow& operator=(const ChunkWindow&) = delete;

  /// Returns the cell of a chunk, or kOutside.
  [[nodiscard]] std::uint32_t cell(int x, int y, int z) const {
    const std::uint32_t dx = static_cast<std::uint32_t>(x) - first_x_;
    const std::uint32_t dy = static_cast<std::uint32_t>(y) - first_y_;
    const std::uint32_t dz = static_cast<std::uint32_t>(z) - first_z_;
    if (dx >= size_x_ || dy >= size_y_ || dz >= size_z_) [[unlikely]]
      return kOutside;
    return (static_cast<std::uint32_t>(x) & mask_x_) + ((static_cast<std::uint32_t>(y) & mask_y_) << shift_y_) +
           ((static_cast<std::uint32_t>(z) & mask_z_) << shift_z_);
  }
  /// Returns null if there is no chunk.
  [[nodiscard]] ChunkEntry* entry(std::uint32_t cell) const {
    QUOIN_ASSERT(cell < cells(), "a cell of the window");
    return entries_[cell];
  }
  /// Returns the last epoch in which the entry was known to be unshared.
  [[nodiscard]] std::uint32_t epoch(std::uint32_t cell) const {
    QUOIN_ASSERT(cell < cells(), "a cell of the window");
    return epochs_[cell];
  }
  /// Returns the voxels of a chunk: those of an air chunk if it is missing, null if it is uniform.
  [[nodiscard]] const ChunkStorage* voxels(std::uint32_t cell) const {
    QUOIN_ASSERT(cell < cells(), "a cell of the window");
    return voxels_[cell];
  }

  [[nodiscard]] std::size_t cells() const { return entries_.size(); }
  [[nodiscard]] const Box& box() const { return box_; }
  [[nodiscard]] std::size_t bytes() const {
    return cells() * (sizeof(ChunkEntry*) + sizeof(ChunkStorage*) + sizeof(std::uint32_t));
  }

  /// Updates the cell of a chunk that came or went, or whose storage may have moved.
  void put(std::uint32_t cell, ChunkEntry* entry, std::uint32_t epoch);
  /// Clears the voxel pointer of an existing chunk. Until the next `put`, its voxels are found through its entry.
  void forget_voxels(std::uint32_t cell) {
    QUOIN_ASSERT(entry(cell) != nullptr, "an existing chunk");
    voxels_[cell] = nullptr;
  }
  /// Replaces the box by an empty one of another size or position. If it throws, nothing has changed.
  void move_to(const Box& box);
  /// Moves the box so that a chunk is inside. Returns false without a change if a chunk is in the part that the box
  /// would leave, or the distance is more than kMaxSlide layers along an axis.
  bool slide_to(IVec3 chunk);
  /// Makes the box empty.
  void close();

 private:
  void set_box(const Box& box);
  [[nodiscard]] bool is_empty_in(const IBox& chunks) const;

  const ChunkStorage* air_;
  std::uint32_t first_x_ = 0;
  std::uint32_t first_y_ = 0;
  std::uint32_t first_z_ = 0;
  std::uint32_t size_x_ = 0;
  std::uint32_t size_y_ = 0;
  std::uint32_t size_z_ = 0;
  std::uint32_t mask_x_ = 0;  // sizes minus 1
  std::uint32_t mask_y_ = 0;
  std::uint32_t mask_z_ = 0;
  int shift_y_ = 0;
  int shift_z_ = 0;
  BlockVector<const ChunkStorage*> voxels_;
  BlockVector<ChunkEntry*> entries_;
  BlockVector<std::uint32_t> epochs_;
  Box box_;
};

/// The chunks of a grid by their coordinates: all in a tree, and those close together also in a window.
///
/// The window grows and moves with the chunks. It slides if chunks appear on one side and disappear on the other, as
/// around a moving player. Otherwise it is rebuilt; outliers in the outermost eighth along each axis are then left out.
/// It has at most 8 cells per chunk (or 64), 32 after chunks were removed. Chunks outside of it are found in the tree.
///
/// A copy shares the tree's nodes and has no window until it is changed. Change entries only through `find_to_edit` or
/// `find_or_create`, which copy shared nodes. The copies have other addresses, so a pointer to an entry is valid only
/// until the next of these calls.
/// Threads: any number may read and copy at once; a change needs exclusive access.
class ChunkTable {
 public:
  /// Returns an entry to change; `entry` is null if there is none.
  struct Slot {
    ChunkEntry* entry = nullptr;
    std::uint32_t cell = ChunkWindow::kOutside;
  };

  ChunkTable() = default;
  ChunkTable(const ChunkTable& other);
  ChunkTable& operator=(const ChunkTable&) = delete;

  [[nodiscard]] const ChunkEntry* find(int x, int y, int z) const {
    const std::uint32_t cell = window_.cell(x, y, z);
    if (cell != ChunkWindow::kOutside) [[likely]]
      return window_.entry(cell);
    return outside_ == 0 ? nullptr : trie_.find(x, y, z);
  }
  [[nodiscard]] const ChunkEntry* find(const IVec3& chunk) const { return find(chunk.x, chunk.y, chunk.z); }
  [[nodiscard]] Slot find_to_edit(const IVec3& chunk) {
    const std::uint32_t cell = window_.cell(chunk.x, chunk.y, chunk.z);
    if (cell != ChunkWindow::kOutside) [[likely]] {
      ChunkEntry* entry = window_.entry(cell);
      if (entry == nullptr || window_.epoch(cell) == epoch()) [[likely]]
        return {entry, cell};
    }
    return find_shared_to_edit(chunk, cell);
  }
  [[nodiscard]] Slot find_or_create(const IVec3& chunk);
  /// Returns the type of a voxel.
  [[nodiscard]] VoxelType voxel(int x, int y, int z) const;

  /// Call before a change during which the chunk may be read. It is then read through its entry.
  void voxels_will_change(const Slot& slot) {
    if (slot.cell != ChunkWindow::kOutside) window_.forget_voxels(slot.cell);
  }
  /// Call after every change of a chunk's voxels.
  void voxels_changed(const Slot& slot) {
    QUOIN_ASSERT(slot.entry != nullptr, "an existing chunk");
    if (slot.cell != ChunkWindow::kOutside && window_.voxels(slot.cell) != ChunkStorage::of(slot.entry->chunk)) {
      window_.put(slot.cell, slot.entry, epoch());
    }
  }
  void erase(const IVec3& chunk);
  void clear();

  [[nodiscard]] std::size_t size() const { return trie_.size(); }
  [[nodiscard]] bool empty() const { return trie_.size() == 0; }
  /// Returns the bytes held, excluding the chunks' voxels.
  [[nodiscard]] std::size_t bytes() const { return trie_.bytes() + window_.bytes(); }
  /// Returns the number of the window's cells.
  [[nodiscard]] std::size_t window_cells() const { return window_.cells(); }
  /// Returns the number of chunks outside of the window.
  [[nodiscard]] std::size_t outside() const { return outside_; }

  /// Calls `visit(chunk, entry)` for each entry. The order depends only on the coordinates.
  template <class Visit>
  void for_each(Visit&& visit) const {
    trie_.for_each(visit);
  }
  template <class Visit>
  void for_each_in(const IBox& chunks, Visit&& visit) const {
    trie_.for_each_in(chunks, visit);
  }

 private:
  using Leaf = ChunkTrie<ChunkEntry>::Leaf;

  [[nodiscard]] std::uint32_t epoch() const { return epoch_.load(std::memory_order_relaxed); }
  Slot find_shared_to_edit(const IVec3& chunk, std::uint32_t cell);
  void put_leaf(Leaf& leaf);
  [[nodiscard]] std::size_t max_cells() const;
  [[nodiscard]] bool fits(const ChunkWindow::Box& box) const;
  [[nodiscard]] ChunkWindow::Box box_of_all() const;
  [[nodiscard]] ChunkWindow::Box box_of_most(std::size_t left_out) const;
  void place(const IVec3& chunk, ChunkEntry& entry);
  bool slide_to(const IVec3& chunk);
  void take_in(const IBox& chunks);
  void outside_changed();
  void plan();
  void try_to_plan();
  void move_to(const ChunkWindow::Box& box);

  ChunkTrie<ChunkEntry> trie_;
  ChunkWindow window_;
  std::size_t outside_ = 0;
  std::size_t outside_since_plan_ = 0;
  bool is_planned_ = true;  // false: a copy that was not changed yet
  // Incremented by every copy. An entry known to be unshared since then has this epoch; 0 is never used.
  mutable std::atomic<std::uint32_t> epoch_{1};
};

}  // namespace quoin
