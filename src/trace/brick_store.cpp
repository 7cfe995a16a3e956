#include "trace/brick_store.h"

#include <algorithm>

#include <quoin/core/assert.h>

namespace quoin::trace {
namespace {

constexpr unsigned kLineWords = 8;

// Returns the place of a slab's first word.
std::size_t place_of(std::size_t slab) {
  return 4 * (slab >> 2) + 16 * (slab & 3);
}

// Returns the number of lines, at most `most`, that can be omitted: all their words equal the next word, empty or full.
// Counts from the first place forwards, or from the last place backwards.
int lines_alike(const Node& words, bool is_from_last, int most) {
  const auto word_at = [&](unsigned i) {
    const unsigned place = is_from_last ? 63 - i : i;
    return words[(place & 3) + 4 * (place >> 4) + 16 * (place >> 2 & 3)];
  };
  const std::uint64_t word = word_at(0);
  if (word != 0 && word != kAll) return 0;
  const unsigned end = kLineWords * static_cast<unsigned>(most);
  unsigned alike = 1;
  while (alike <= end && word_at(alike) == word) ++alike;
  return static_cast<int>((alike - 1) / kLineWords);
}

}  // namespace

BrickStore::BrickStore() {
  static_assert(kFullBrick == BrickCode{kBrickLines} << 4);
  for (std::size_t line = kBrickLines; line < lines_.size(); ++line) lines_[line].fill(kAll);
}

bool BrickStore::is_full(BrickCode brick) const {
  const BrickRun run = BrickRun::of(brick);
  QUOIN_ASSERT(contains(run), "a brick of the store");
  const std::uint64_t* const first = lines_[run.first].data();
  return std::all_of(first, first + kLineWords * static_cast<std::size_t>(run.count()),
                     [](std::uint64_t word) { return word == kAll; });
}

std::uint32_t BrickStore::allocate(int lines) {
  QUOIN_ASSERT(lines >= kBrickLines / 2 && lines <= kBrickLines, "4 to 8 lines");
  const auto wanted = static_cast<std::size_t>(lines);
  std::vector<std::uint32_t>& same = free_[wanted];
  if (!same.empty()) {
    const std::uint32_t first = same.back();
    same.pop_back();
    return first;
  }
  constexpr auto kWhole = static_cast<std::size_t>(kBrickLines);
  if (2 * wanted == kWhole && !free_[kWhole].empty()) {
    const std::uint32_t first = free_[kWhole].back();
    free_[kWhole].pop_back();
    same.push_back(first + static_cast<std::uint32_t>(lines));
    return first;
  }
  if (lines_.size() + wanted > lines_.capacity()) {
    // After the build, doubling would leave half of the memory unused for long.
    const std::size_t spare = is_built_ ? std::max<std::size_t>(lines_.size() / 8, 64) : lines_.size();
    lines_.set_capacity(lines_.size() + wanted + spare);
  }
  lines_.append(wanted);
  return static_cast<std::uint32_t>(lines_.size() - wanted);
}

BrickCode BrickStore::put(BrickCode brick, const Node& words) {
  const int before = lines_alike(words, false, 4);
  const int after = lines_alike(words, true, 3);
  BrickRun run;
  run.shift = before > after ? -before : after;
  const BrickRun old = BrickRun::of(brick);
  if (brick > kFullBrick && old.count() == run.count()) {
    run.first = old.first;
  } else {
    release(brick);
    run.first = allocate(run.count());
    ++count_;
  }
  QUOIN_ASSERT(contains(run), "a run of the store");
  std::uint64_t* const own = lines_[run.first].data();
  const std::size_t skipped = kLineWords * static_cast<std::size_t>(std::max(-run.shift, 0));
  const std::size_t end = skipped + kLineWords * static_cast<std::size_t>(run.count());
  for (std::size_t slab = 0; slab < 16; ++slab) {
    const std::size_t place = place_of(slab);
    if (place >= skipped && place < end) std::copy_n(&words[4 * slab], 4, own + (place - skipped));
  }
  return run.code();
}

void BrickStore::release(BrickCode brick) {
  if (brick <= kFullBrick) return;
  const BrickRun run = BrickRun::of(brick);
  QUOIN_ASSERT(count_ > 0 && contains(run), "a brick of the store");
  free_[static_cast<std::size_t>(run.count())].push_back(run.first);
  --count_;
}

std::uint64_t* BrickStore::find_slab(BrickCode brick, std::size_t slab, std::span<const std::uint64_t, 4> words) {
  QUOIN_ASSERT(slab < 16 && contains(BrickRun::of(brick)), "a slab of a brick of the store");
  if (brick <= kFullBrick) return nullptr;
  const BrickRun run = BrickRun::of(brick);
  const int place = static_cast<int>(place_of(slab)) + static_cast<int>(kLineWords) * std::min(run.shift, 0);
  const int end = static_cast<int>(kLineWords) * run.count();
  if (place < 0 || place >= end) return nullptr;
  std::uint64_t* const own = lines_[run.first].data() + place;
  if (run.shift < 0 && place == 0 && own[0] != words[0]) return nullptr;
  if (run.shift > 0 && place + 4 == end && own[3] != words[3]) return nullptr;
  return own;
}

BrickCode BrickStore::put_slab(BrickCode brick, std::size_t slab, std::span<const std::uint64_t, 4> words) {
  if (std::uint64_t* const own = find_slab(brick, slab, words)) {
    std::copy(words.begin(), words.end(), own);
    return brick;
  }
  Node all = this->words(brick).node();
  std::copy(words.begin(), words.end(), all.begin() + static_cast<std::ptrdiff_t>(4 * slab));
  return put(brick, all);
}

void BrickStore::finish_build() {
  // A small reserve in large stores: untouched pages take no memory, and the first edit then moves nothing.
  lines_.set_capacity(lines_.size() + (lines_.size() < 4096 ? 0 : lines_.size() / 64));
  is_built_ = true;
}

}  // namespace quoin::trace
