#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <tsl/robin_map.h>

#include <quoin/grid/chunk.h>

namespace quoin {

/// A chunk, and what a grid keeps beside it.
struct ChunkEntry {
  Chunk chunk;
  std::uint64_t version = 0;
  std::uint64_t neighbourhood_version = 0;
  bool is_dirty = false;  ///< its coordinates stand in the grid's list of dirty chunks
};

/// A box of chunks in which one is found by its place: a pointer for every chunk of the box, there or not.
class ChunkWindow {
 public:
  static constexpr std::uint32_t kOutside = ~std::uint32_t{0};
  /// Powers of two along each axis, so that a place is found by shifts.
  struct Box {
    IVec3 first{0};
    std::array<int, 3> log{};
    [[nodiscard]] int log_cells() const { return log[0] + log[1] + log[2]; }
    /// Doubled on the sides of a chunk until it is inside.
    [[nodiscard]] Box grown_to(IVec3 chunk) const;
  };

  ChunkWindow();
  ChunkWindow(const ChunkWindow&) = delete;
  ChunkWindow& operator=(const ChunkWindow&) = delete;

  /// Where a chunk stands, or kOutside.
  [[nodiscard]] std::uint32_t cell(int x, int y, int z) const {
    const std::uint32_t dx = static_cast<std::uint32_t>(x) - first_x_;
    const std::uint32_t dy = static_cast<std::uint32_t>(y) - first_y_;
    const std::uint32_t dz = static_cast<std::uint32_t>(z) - first_z_;
    if (dx >= size_x_ || dy >= size_y_ || dz >= size_z_) [[unlikely]]
      return kOutside;
    return dx + (dy << shift_y_) + (dz << shift_z_);
  }
  /// Null where there is no chunk.
  [[nodiscard]] ChunkEntry* entry(std::uint32_t cell) const { return entries_[cell]; }
  /// The voxels of a chunk; those of a chunk of air where there is none; null where the chunk is uniform.
  [[nodiscard]] const Chunk::Mixed* voxels(std::uint32_t cell) const { return voxels_[cell]; }

  [[nodiscard]] std::size_t cells() const { return entries_.size(); }
  [[nodiscard]] const Box& box() const { return box_; }
  [[nodiscard]] std::size_t bytes() const { return cells() * (sizeof(ChunkEntry*) + sizeof(Chunk::Mixed*)); }

  /// A chunk that came or went, or whose storage may have moved.
  void put(std::uint32_t cell, ChunkEntry* entry);
  /// Of a chunk that is there; until it is put again its voxels are found through its entry.
  void forget_voxels(std::uint32_t cell) { voxels_[cell] = nullptr; }
  /// Another box, in which no chunk stands yet. When it throws, all is as it was.
  void move_to(const Box& box);
  /// A box of nothing.
  void close();

 private:
  const Chunk::Mixed* air_;
  std::uint32_t first_x_ = 0;
  std::uint32_t first_y_ = 0;
  std::uint32_t first_z_ = 0;
  std::uint32_t size_x_ = 0;
  std::uint32_t size_y_ = 0;
  std::uint32_t size_z_ = 0;
  int shift_y_ = 0;
  int shift_z_ = 0;
  std::vector<const Chunk::Mixed*> voxels_;
  std::vector<ChunkEntry*> entries_;
  Box box_;
};

/// The chunks of a grid by their coordinates: in a hash table, and those that lie close together in a window besides.
///
/// The window grows with the chunks and goes where they go, without the outermost eighth along each axis where these
/// lie too far out, and never has more than 8 places a chunk (or 64), 32 where chunks were dropped. What lies outside
/// it is found by its hash.
/// Threads: any number may read; a change needs it to itself.
class ChunkTable {
 public:
  ChunkTable();
  ChunkTable(const ChunkTable&) = delete;
  ChunkTable& operator=(const ChunkTable&) = delete;

  [[nodiscard]] ChunkEntry* find(int x, int y, int z) const {
    const std::uint32_t cell = window_.cell(x, y, z);
    if (cell != ChunkWindow::kOutside) [[likely]]
      return window_.entry(cell);
    return outside_ == 0 ? nullptr : find_by_hash(x, y, z);
  }
  [[nodiscard]] ChunkEntry* find(const IVec3& chunk) const { return find(chunk.x, chunk.y, chunk.z); }
  [[nodiscard]] ChunkEntry& find_or_create(const IVec3& chunk);
  /// Of one voxel, by its own coordinates.
  [[nodiscard]] VoxelType voxel(int x, int y, int z) const;

  /// To be called before a change during which the chunk may be read: it is then read through its entry.
  void voxels_will_change(const IVec3& chunk) {
    const std::uint32_t cell = window_.cell(chunk.x, chunk.y, chunk.z);
    if (cell != ChunkWindow::kOutside) window_.forget_voxels(cell);
  }
  /// To be called after every change of a chunk's voxels.
  void voxels_changed(const IVec3& chunk, ChunkEntry& entry) {
    const std::uint32_t cell = window_.cell(chunk.x, chunk.y, chunk.z);
    if (cell != ChunkWindow::kOutside && window_.voxels(cell) != entry.chunk.mixed()) window_.put(cell, &entry);
  }
  void erase(const IVec3& chunk);
  void clear();

  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] bool empty() const { return entries_.empty(); }
  /// Bytes held, those of the entries excluded.
  [[nodiscard]] std::size_t bytes() const;
  /// Places of the window.
  [[nodiscard]] std::size_t window_cells() const { return window_.cells(); }
  /// Chunks that do not stand in the window.
  [[nodiscard]] std::size_t outside() const { return outside_; }

  /// Calls `visit(chunk, entry)` for each, in no order that means anything.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [at, entry] : entries_) visit(at, *entry);
  }

 private:
  // Spreads chunks over the table. The three products do not wait for each other, and a voxel that is looked up because
  // of the one before waits for all of this.
  struct Hash {
    std::size_t operator()(IVec3 c) const {
      const auto times = [](int i, std::uint64_t factor) { return static_cast<std::uint32_t>(i) * factor; };
      const std::uint64_t sum =
          times(c.x, 0x9E37'79B9'7F4A'7C15U) + times(c.y, 0xC2B2'AE3D'27D4'EB4FU) + times(c.z, 0x1656'67B1'9E37'79F9U);
      return static_cast<std::size_t>(sum >> 32);
    }
  };

  [[nodiscard]] ChunkEntry* find_by_hash(int x, int y, int z) const;
  [[nodiscard]] std::size_t most_cells() const;
  [[nodiscard]] bool fits(const ChunkWindow::Box& box) const;
  [[nodiscard]] ChunkWindow::Box box_of_most(std::size_t left_out) const;
  void place(const IVec3& chunk, ChunkEntry& entry);
  void outside_changed();
  void plan();
  void try_to_plan();
  void move_to(const ChunkWindow::Box& box);

  tsl::robin_map<IVec3, std::unique_ptr<ChunkEntry>, Hash> entries_;
  ChunkWindow window_;
  std::size_t outside_ = 0;
  std::size_t outside_since_plan_ = 0;
};

}  // namespace quoin
