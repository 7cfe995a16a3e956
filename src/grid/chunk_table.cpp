#include "grid/chunk_table.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <new>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

constexpr std::size_t kFewCells = 64;
constexpr std::size_t kCellsPerChunk = 8;
// A window that exceeds its allowed size by this factor is shrunk. The factor prevents resizing for a single chunk.
constexpr std::size_t kSlack = 4;

ChunkWindow::Box box_between(IVec3 first, IVec3 last) {
  ChunkWindow::Box box{first, {}};
  for (int axis = 0; axis < 3; ++axis) {
    const auto size = static_cast<unsigned>(last[axis] - first[axis]);
    box.log.at(static_cast<std::size_t>(axis)) = std::bit_width(size);
  }
  return box;
}

const ChunkStorage& all_air() {
  static const ChunkStorage air = [] {
    ChunkStorage made;
    made.palette = {kAir};
    made.slabs.fill(ChunkStorage::kUniformSlab | 0U);
    return made;
  }();
  return air;
}

}  // namespace

ChunkWindow::Box ChunkWindow::Box::grown_to(IVec3 chunk) const {
  Box grown = *this;
  for (int axis = 0; axis < 3; ++axis) {
    int& log_size = grown.log.at(static_cast<std::size_t>(axis));
    for (; chunk[axis] < grown.first[axis]; ++log_size) grown.first[axis] -= 1 << log_size;
    while (chunk[axis] - grown.first[axis] >= 1 << log_size) ++log_size;
  }
  return grown;
}

// The static air chunk is created before the first window, so it outlives all windows.
ChunkWindow::ChunkWindow() : air_(&all_air()) {}

void ChunkWindow::put(std::uint32_t cell, ChunkEntry* entry, std::uint32_t epoch) {
  QUOIN_ASSERT(cell < cells(), "a cell of the window");
  entries_[cell] = entry;
  epochs_[cell] = epoch;
  voxels_[cell] = entry == nullptr ? air_ : ChunkStorage::of(entry->chunk);
}

void ChunkWindow::move_to(const Box& box) {
  QUOIN_ASSERT(box.log_cells() < 31, "cell numbers fit in 32 bits");
  const std::size_t cells = std::size_t{1} << box.log_cells();
  BlockVector<ChunkEntry*> entries(cells, nullptr);
  BlockVector<std::uint32_t> epochs(cells, 0);
  voxels_ = BlockVector<const ChunkStorage*>(cells, air_);
  entries_ = std::move(entries);
  epochs_ = std::move(epochs);
  set_box(box);
}

void ChunkWindow::set_box(const Box& box) {
  QUOIN_ASSERT(cells() == std::size_t{1} << box.log_cells(), "a cell per chunk of the box");
  box_ = box;
  first_x_ = static_cast<std::uint32_t>(box.first.x);
  first_y_ = static_cast<std::uint32_t>(box.first.y);
  first_z_ = static_cast<std::uint32_t>(box.first.z);
  size_x_ = 1U << box.log[0];
  size_y_ = 1U << box.log[1];
  size_z_ = 1U << box.log[2];
  mask_x_ = size_x_ - 1;
  mask_y_ = size_y_ - 1;
  mask_z_ = size_z_ - 1;
  shift_y_ = box.log[0];
  shift_z_ = box.log[0] + box.log[1];
}

bool ChunkWindow::is_empty_in(const IBox& chunks) const {
  for (int z = chunks.min.z; z < chunks.max.z; ++z) {
    for (int y = chunks.min.y; y < chunks.max.y; ++y) {
      for (int x = chunks.min.x; x < chunks.max.x; ++x) {
        if (entries_[cell(x, y, z)] != nullptr) return false;
      }
    }
  }
  return true;
}

bool ChunkWindow::slide_to(IVec3 chunk) {
  const IVec3 size = box_.size();
  Box slid = box_;
  for (int axis = 0; axis < 3; ++axis) {
    IBox left{box_.first, box_.first + size};
    const int before = left.min[axis] - chunk[axis];
    const int behind = chunk[axis] - left.max[axis] + 1;
    const int layers = std::max(before, behind);
    if (layers <= 0) continue;
    if (layers > kMaxSlide || layers > size[axis]) return false;
    slid.first[axis] += before > 0 ? -layers : layers;
    if (before > 0) {
      left.min[axis] = left.max[axis] - layers;
    } else {
      left.max[axis] = left.min[axis] + layers;
    }
    if (!is_empty_in(left)) return false;
  }
  set_box(slid);
  return true;
}

void ChunkWindow::close() {
  voxels_ = {};
  entries_ = {};
  epochs_ = {};
  box_ = {};
  size_x_ = size_y_ = size_z_ = 0;
}

// Starts at an epoch without nodes that are known to be unshared.
ChunkTable::ChunkTable(const ChunkTable& other)
    : trie_(other.trie_), outside_(other.size()), is_planned_(false), epoch_(2) {
  other.epoch_.fetch_add(1, std::memory_order_relaxed);
}

// Updates the window after a leaf's entries moved in memory.
void ChunkTable::put_leaf(Leaf& leaf) {
  ChunkTrie<ChunkEntry>::for_each_of(leaf, [&](IVec3 at, ChunkEntry& entry) {
    const std::uint32_t cell = window_.cell(at.x, at.y, at.z);
    if (cell != ChunkWindow::kOutside) window_.put(cell, &entry, epoch());
  });
}

ChunkTable::Slot ChunkTable::find_shared_to_edit(const IVec3& chunk, std::uint32_t cell) {
  if (!is_planned_) {
    is_planned_ = true;
    plan();
    cell = window_.cell(chunk.x, chunk.y, chunk.z);
  }
  ChunkEntry* entry = trie_.find_to_edit(chunk, [this](Leaf& leaf) { put_leaf(leaf); });
  if (cell != ChunkWindow::kOutside) window_.put(cell, entry, epoch());
  return {entry, cell};
}

ChunkTable::Slot ChunkTable::find_or_create(const IVec3& chunk) {
  if (const Slot slot = find_to_edit(chunk); slot.entry != nullptr) return slot;
  ChunkEntry& made = trie_.find_or_create(chunk, [this](Leaf& leaf) { put_leaf(leaf); });
  place(chunk, made);
  QUOIN_ASSERT(outside_ <= size(), "at most as many entries outside as in total");
  return {&made, window_.cell(chunk.x, chunk.y, chunk.z)};
}

VoxelType ChunkTable::voxel(int x, int y, int z) const {
  const int local_x = x & (kChunkEdge - 1);
  const int local_y = y & (kChunkEdge - 1);
  const int local_z = z & (kChunkEdge - 1);
  const std::uint32_t cell = window_.cell(x >> kChunkShift, y >> kChunkShift, z >> kChunkShift);
  if (cell == ChunkWindow::kOutside) [[unlikely]] {
    if (outside_ == 0) return kAir;
    const ChunkEntry* entry = trie_.find(x >> kChunkShift, y >> kChunkShift, z >> kChunkShift);
    return entry == nullptr ? kAir : entry->chunk.get(local_x, local_y, local_z);
  }
  if (const ChunkStorage* voxels = window_.voxels(cell)) [[likely]]
    return voxels->type(local_x, local_y, local_z);
  QUOIN_ASSERT(window_.entry(cell) != nullptr, "missing chunks have the voxels of air");
  return window_.entry(cell)->chunk.get(local_x, local_y, local_z);
}

void ChunkTable::erase(const IVec3& chunk) {
  const std::uint32_t cell = window_.cell(chunk.x, chunk.y, chunk.z);
  const bool was_there = trie_.erase(chunk, [this](Leaf& leaf) { put_leaf(leaf); });
  if (cell != ChunkWindow::kOutside) {
    window_.put(cell, nullptr, 0);
  } else if (was_there) {
    QUOIN_ASSERT(outside_ != 0, "entries outside the windows are counted");
    --outside_;
    outside_changed();
  }
  if (window_.cells() > kSlack * max_cells()) plan();
}

void ChunkTable::clear() {
  trie_.clear();
  window_.close();
  outside_ = 0;
  outside_since_plan_ = 0;
}

std::size_t ChunkTable::max_cells() const {
  return std::max(kFewCells, kCellsPerChunk * size());
}

bool ChunkTable::fits(const ChunkWindow::Box& box) const {
  return box.log_cells() < 31 && std::size_t{1} << box.log_cells() <= max_cells();
}

// Adds a new chunk. If the window cannot grow to contain it, the chunk stays outside until so many are outside that a
// new plan is worth its cost.
void ChunkTable::place(const IVec3& chunk, ChunkEntry& entry) {
  const std::uint32_t cell = window_.cell(chunk.x, chunk.y, chunk.z);
  if (cell != ChunkWindow::kOutside) return window_.put(cell, &entry, epoch());
  ++outside_;
  if (slide_to(chunk)) return window_.put(window_.cell(chunk.x, chunk.y, chunk.z), &entry, epoch());
  if (window_.cells() != 0) {
    const ChunkWindow::Box grown = window_.box().grown_to(chunk);
    try {
      if (fits(grown)) return move_to(grown);
    } catch (const std::bad_alloc&) {
    }
  }
  outside_changed();
}

bool ChunkTable::slide_to(const IVec3& chunk) {
  if (window_.cells() == 0) return false;
  const ChunkWindow::Box before = window_.box();
  if (!window_.slide_to(chunk)) return false;
  const ChunkWindow::Box& now = window_.box();
  for (int axis = 0; axis < 3; ++axis) {
    const int layers = now.first[axis] - before.first[axis];
    if (layers == 0) continue;
    IBox come{now.first, now.first + now.size()};
    if (layers > 0) {
      come.min[axis] = come.max[axis] - layers;
    } else {
      come.max[axis] = come.min[axis] - layers;
    }
    take_in(come);
  }
  return true;
}

// Puts chunks from outside into the window if they now fit.
void ChunkTable::take_in(const IBox& chunks) {
  trie_.for_each_in(chunks, [&](IVec3 at, const ChunkEntry& entry) {
    const std::uint32_t cell = window_.cell(at.x, at.y, at.z);
    if (window_.entry(cell) != nullptr) return;  // already added by another axis
    window_.put(cell, const_cast<ChunkEntry*>(&entry), 0);
    QUOIN_ASSERT(outside_ != 0, "entries outside the windows are counted");
    --outside_;
  });
}

// Plans the window again after a quarter of the chunks changed outside of it, so that the total cost is a few visits
// per change.
void ChunkTable::outside_changed() {
  ++outside_since_plan_;
  if (4 * outside_since_plan_ >= size()) plan();
}

// Returns a box of all chunks. One walk over the tree: a plan runs while a frame waits.
ChunkWindow::Box ChunkTable::box_of_all() const {
  IVec3 low(std::numeric_limits<int>::max());
  IVec3 high(std::numeric_limits<int>::min());
  trie_.for_each([&](IVec3 at, const ChunkEntry&) {
    low = glm::min(low, at);
    high = glm::max(high, at);
  });
  return box_between(low, high);
}

// Returns a box of all chunks except `left_out` at either end of each axis.
ChunkWindow::Box ChunkTable::box_of_most(std::size_t left_out) const {
  QUOIN_ASSERT(2 * left_out < size(), "a box of at least one chunk");
  std::array<std::vector<int>, 3> places;
  for (std::vector<int>& along : places) along.reserve(size());
  trie_.for_each([&](IVec3 at, const ChunkEntry&) {
    for (int axis = 0; axis < 3; ++axis) places[static_cast<std::size_t>(axis)].push_back(at[axis]);
  });
  IVec3 first(0);
  IVec3 last(0);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<int>& along = places[static_cast<std::size_t>(axis)];
    const auto low = along.begin() + static_cast<std::ptrdiff_t>(left_out);
    const auto high = along.end() - 1 - static_cast<std::ptrdiff_t>(left_out);
    std::nth_element(along.begin(), low, along.end());
    first[axis] = *low;
    std::nth_element(low, high, along.end());
    last[axis] = *high;
  }
  return box_between(first, last);
}

// If memory for a new window is short, the current window stays. Chunks outside are found in the tree.
void ChunkTable::plan() {
  try {
    try_to_plan();
  } catch (const std::bad_alloc&) {
  }
}

// Moves the window to all chunks or, failing that, to most of them. If they are too far apart, the window stays,
// provided that it contains most of them.
void ChunkTable::try_to_plan() {
  outside_since_plan_ = 0;
  if (empty()) return window_.close();
  if (const ChunkWindow::Box box = box_of_all(); fits(box)) return move_to(box);
  if (const ChunkWindow::Box box = box_of_most(size() / 16); fits(box)) return move_to(box);
  if (window_.cells() <= kSlack * max_cells() && 2 * outside_ <= size()) return;
  window_.close();
  outside_ = size();
}

void ChunkTable::move_to(const ChunkWindow::Box& box) {
  window_.move_to(box);
  outside_ = 0;
  // If no node was ever shared, no entry needs another check.
  const std::uint32_t known = epoch() == 1 ? 1 : 0;
  trie_.for_each([&](IVec3 at, const ChunkEntry& entry) {
    const std::uint32_t cell = window_.cell(at.x, at.y, at.z);
    if (cell != ChunkWindow::kOutside) {
      // The entry's epoch ensures that its path is checked before a shared entry is changed.
      window_.put(cell, const_cast<ChunkEntry*>(&entry), known);
    } else {
      ++outside_;
    }
  });
  QUOIN_ASSERT(outside_ <= size(), "at most as many entries outside as in total");
}

}  // namespace quoin
