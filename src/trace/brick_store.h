#pragma once

// The words of a tree's bricks: consecutive runs of four to eight lines (tree_view.h).

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/memory/large_array.h"
#include "trace/tree_view.h"

namespace quoin::trace {

class BrickStore {
 public:
  BrickStore();

  /// The pointer that BrickWords takes, valid until the next `put` or `put_slab`.
  [[nodiscard]] const BrickLine* middle() const { return lines_.data() + kBrickLines / 2; }
  [[nodiscard]] BrickWords words(BrickCode brick) const { return {middle(), brick}; }
  [[nodiscard]] bool is_full(BrickCode brick) const;
  /// The number of bricks, without the empty and the full brick.
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::size_t line_count() const { return lines_.size(); }
  [[nodiscard]] std::size_t bytes() const { return lines_.capacity() * sizeof(BrickLine); }

  /// Replaces `brick` by a brick with these words, by cell x + 4 y + 16 z. Requires: the words are neither all empty
  /// nor all full.
  [[nodiscard]] BrickCode put(BrickCode brick, const Node& words);
  /// Releases a brick, unless it is the empty or the full one.
  void release(BrickCode brick);
  /// Replaces the words of one of the sixteen slabs of `brick`, cells 4 `slab` and on. The result may be full or empty.
  /// Cost: about ten instructions if the stored lines stay the same.
  [[nodiscard]] BrickCode put_slab(BrickCode brick, std::size_t slab, std::span<const std::uint64_t, 4> words);
  /// From now on, the store grows in small steps.
  void finish_build();

 private:
  [[nodiscard]] std::uint32_t allocate(int lines);
  [[nodiscard]] bool contains(const BrickRun& run) const {
    return run.first + static_cast<std::size_t>(run.count()) <= lines_.size();
  }
  // Returns the four stored words of a slab. Returns null if they are omitted, or if the change affects the first or
  // last stored word, which also represents the omitted ones.
  std::uint64_t* find_slab(BrickCode brick, std::size_t slab, std::span<const std::uint64_t, 4> words);

  LargeArray<BrickLine> lines_{2 * kBrickLines};
  std::array<std::vector<std::uint32_t>, kBrickLines + 1> free_;  // first lines of free runs, by run length
  std::size_t count_ = 0;
  bool is_built_ = false;  // before finish_build, the capacity doubles when it must grow; finish_build trims it
};

}  // namespace quoin::trace
