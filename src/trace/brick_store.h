#pragma once

// The words of a tree's bricks: runs of four to eight lines (tree_view.h), one after the other.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "trace/tree_view.h"

namespace quoin::trace {

/// Where there is no room, an eighth more than there is: twice as much would be half of it for long.
template <class T>
void make_room(std::vector<T>& all, std::size_t more = 1) {
  if (all.size() + more <= all.capacity()) return;
  all.reserve(all.size() + (all.size() / 8 > 64 ? all.size() / 8 : 64) + more);
}

/// Leaves a little room where there is much: pages that nothing was written to take no memory, and the first edit then
/// copies nothing.
template <class T>
void trim(std::vector<T>& all) {
  std::vector<T> exact;
  exact.reserve(all.size() + (all.size() < 4096 ? 0 : all.size() / 64));
  exact.assign(all.begin(), all.end());
  all.swap(exact);
}

class BrickStore {
 public:
  BrickStore();

  /// As BrickWords takes them, until a brick is put.
  [[nodiscard]] const BrickLine* middle() const { return lines_.data() + kBrickLines / 2; }
  [[nodiscard]] BrickWords words(BrickCode brick) const { return {middle(), brick}; }
  [[nodiscard]] bool is_full(BrickCode brick) const;
  /// How many there are but the empty and the full one.
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::size_t line_count() const { return lines_.size(); }
  [[nodiscard]] std::size_t bytes() const { return lines_.capacity() * sizeof(BrickLine); }

  /// A brick with these words, of cells x + 4 y + 16 z, in place of `brick`. Requires: neither all empty nor all full.
  [[nodiscard]] BrickCode put(BrickCode brick, const Node& words);
  /// Takes one back, if it is neither the empty nor the full one.
  void release(BrickCode brick);
  /// A brick with these words in one of its sixteen slabs, cells 4 `slab` and on, in place of `brick`. It may be full
  /// or empty then. Cost: some ten instructions, where the lines that are kept stay the same.
  [[nodiscard]] BrickCode put_slab(BrickCode brick, std::size_t slab, std::span<const std::uint64_t, 4> words);
  /// From now on it grows by little.
  void finish_build();

 private:
  [[nodiscard]] std::uint32_t allocate(int lines);
  // The four words of a slab among the lines; null where they are left out, or the first or last of these, which stands
  // for those left out, would change.
  std::uint64_t* find_slab(BrickCode brick, std::size_t slab, std::span<const std::uint64_t, 4> words);

  std::vector<BrickLine> lines_;
  std::array<std::vector<std::uint32_t>, kBrickLines + 1> free_;  // where runs of so many lines begin
  std::size_t count_ = 0;
  bool is_built_ = false;  // until then what is kept may double: finish_build trims it
};

}  // namespace quoin::trace
