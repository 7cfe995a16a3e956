#include "voxelize/inside.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

#include <quoin/core/assert.h>

namespace quoin::voxelizing {

namespace {

// Majority of six rays.
constexpr int kHalf = 3;
// Keeps the sum of six votes within int16; real meshes stay below it.
constexpr int kMostTurns = 4'000;

/// Returns the votes of a line's two rays at a centre. `before` is the sum of the steps before the centre, `all` the
/// sum of the whole line. The backward ray counts the steps before the centre; the forward ray counts the steps behind
/// it, from the other side. In a closed mesh both equal the winding number.
int votes_of(SolidVoxels rule, int before, int all, int crossed, int crossings) {
  QUOIN_ASSERT(crossed >= 0 && crossed <= crossings, "crossings of the line");
  if (rule == SolidVoxels::Parity) return (crossed & 1) + ((crossings - crossed) & 1);
  return std::clamp(2 * before - all, -kMostTurns, kMostTurns);
}

/// Iterates over the changes of a line's votes within a chunk.
class LineVotes {
 public:
  LineVotes(std::span<const Crossing> line, SolidVoxels rule, int first)
      : line_(line), rule_(rule), end_(first + kChunkEdge) {
    for (const Crossing& crossing : line) all_ += crossing.step();
    while (next_ < line.size() && line[next_].behind() <= first) before_ += line[next_++].step();
  }
  /// Returns the votes at the line's current position, initially its entry to the chunk.
  [[nodiscard]] int votes() const {
    return votes_of(rule_, before_, all_, static_cast<int>(next_), static_cast<int>(line_.size()));
  }
  /// Returns true if the votes change before the chunk's end; sets `at` to the first voxel with the new votes.
  [[nodiscard]] bool advance(int& at) {
    if (next_ >= line_.size() || line_[next_].behind() >= end_) return false;
    at = line_[next_].behind() - (end_ - kChunkEdge);
    while (next_ < line_.size() && line_[next_].behind() - (end_ - kChunkEdge) == at) before_ += line_[next_++].step();
    return true;
  }

 private:
  std::span<const Crossing> line_;
  SolidVoxels rule_;
  int end_;
  int before_ = 0;
  int all_ = 0;
  std::size_t next_ = 0;
};

using Plane = std::array<std::int16_t, kLines>;

/// The votes of the lines at their entry to a chunk.
void entering_votes(const Column& column, SolidVoxels rule, int first, Plane& votes) {
  votes.fill(0);
  if (column.begin.empty()) return;
  for (std::size_t i = 0; i < kLines; ++i) {
    const auto line = column.line(i);
    if (!line.empty()) votes[i] = static_cast<std::int16_t>(LineVotes(line, rule, first).votes());
  }
}

/// Extends the vote ranges of the chunks along a line: votes are constant between two crossings.
void add_line(std::span<const Crossing> line, SolidVoxels rule, std::span<VoteRange> chunks) {
  const int end = static_cast<int>(chunks.size()) * kChunkEdge;
  int all = 0;
  for (const Crossing& crossing : line) all += crossing.step();
  int before = 0;
  int from = 0;
  for (std::size_t next = 0; next <= line.size(); ++next) {
    const int to = next == line.size() ? end : std::min(line[next].behind(), end);
    if (from < to) {
      const int said = votes_of(rule, before, all, static_cast<int>(next), static_cast<int>(line.size()));
      const auto votes = static_cast<std::int16_t>(said);
      for (int chunk = from / kChunkEdge; chunk <= (to - 1) / kChunkEdge; ++chunk) {
        VoteRange& range = chunks[static_cast<std::size_t>(chunk)];
        range.least = std::min(range.least, votes);
        range.most = std::max(range.most, votes);
      }
      from = to;
    }
    if (next < line.size()) before += line[next].step();
  }
}

/// Returns the ranges of a column's chunks; they stay 0 to 0 without crossings.
void find_ranges(const Column& column, SolidVoxels rule, std::span<VoteRange> chunks) {
  if (column.begin.empty()) return;
  constexpr VoteRange kNone = {std::numeric_limits<std::int16_t>::max(), std::numeric_limits<std::int16_t>::min()};
  std::fill(chunks.begin(), chunks.end(), kNone);
  bool has_empty = false;
  for (std::size_t i = 0; i < kLines; ++i) {
    const auto line = column.line(i);
    if (!line.empty()) add_line(line, rule, chunks);
    has_empty |= line.empty();
  }
  if (has_empty) add_line({}, rule, chunks);
}

/// Adds the votes of lines along x, which change within a row.
void add_along_x(const Column& column, SolidVoxels rule, int first, const Plane& entering, std::int16_t* sums) {
  for (std::size_t i = 0; i < kLines; ++i, sums += kChunkEdge) {
    std::int16_t votes = entering[i];
    int from = 0;
    const auto line = column.line(i);
    if (!line.empty()) {
      LineVotes along(line, rule, first);
      int at = 0;
      while (along.advance(at)) {
        for (int x = from; x < at; ++x) sums[x] = static_cast<std::int16_t>(sums[x] + votes);
        votes = static_cast<std::int16_t>(along.votes());
        from = at;
      }
    }
    for (int x = from; x < kChunkEdge; ++x) sums[x] = static_cast<std::int16_t>(sums[x] + votes);
  }
}

/// Adds the votes of 64 lines side by side, along y or z: rows of votes that change from one row to the next.
class RowsOfVotes {
 public:
  void begin(const std::int16_t* entering) { std::copy_n(entering, kChunkEdge, now_.begin()); }
  void collect(const Column& column, std::size_t first_line, SolidVoxels rule, int first) {
    if (is_dirty_) changes_.fill(0);
    is_dirty_ = false;
    if (column.begin.empty()) return;
    for (std::size_t x = 0; x < kChunkEdge; ++x) {
      const auto line = column.line(first_line + x);
      if (line.empty()) continue;
      LineVotes along(line, rule, first);
      int before = along.votes();
      int at = 0;
      while (along.advance(at)) {
        const int after = along.votes();
        std::int16_t& change = changes_[static_cast<std::size_t>(at) * kChunkEdge + x];
        change = static_cast<std::int16_t>(change + after - before);
        before = after;
        is_dirty_ = true;
      }
    }
  }
  /// Adds the row at `step` along the lines. Rows must come in order.
  void add(std::size_t step, std::int16_t* sums) {
    QUOIN_ASSERT(step < kChunkEdge, "a row of the chunk");
    const std::int16_t* change = changes_.data() + step * kChunkEdge;
    for (std::size_t x = 0; x < kChunkEdge; ++x) {
      now_[x] = static_cast<std::int16_t>(now_[x] + change[x]);
      sums[x] = static_cast<std::int16_t>(sums[x] + now_[x]);
    }
  }

 private:
  std::array<std::int16_t, kChunkEdge> now_{};
  Plane changes_{};
  bool is_dirty_ = false;
};

void add_along_y_and_z(const Crossings& crossings, IVec3 chunk, SolidVoxels rule, const std::array<Plane, 3>& entering,
                       std::vector<std::int16_t>& sums) {
  RowsOfVotes rows;
  for (int axis = 1; axis < 3; ++axis) {
    const Column& column = crossings.column(axis, chunk);
    // Along y planes of one z, along z planes of one y.
    const std::size_t along = axis == 1 ? kChunkEdge : kLines;
    const std::size_t across = axis == 1 ? kLines : kChunkEdge;
    for (std::size_t plane = 0; plane < kChunkEdge; ++plane) {
      rows.collect(column, plane * kChunkEdge, rule, chunk[axis] * kChunkEdge);
      rows.begin(entering[static_cast<std::size_t>(axis)].data() + plane * kChunkEdge);
      for (std::size_t step = 0; step < kChunkEdge; ++step) rows.add(step, sums.data() + plane * across + step * along);
    }
  }
}

bool is_inside(int votes) {
  return std::abs(votes) > kHalf;
}

}  // namespace

Inside::Inside(const Crossings& crossings, SolidVoxels rule, Threads threads) : crossings_(&crossings), rule_(rule) {
  QUOIN_ASSERT(rule != SolidVoxels::None, "a rule for solid voxels");
  for (int axis = 0; axis < 3; ++axis) {
    const auto columns = crossings.columns(axis);
    const auto along = static_cast<std::size_t>(crossings.chunks()[axis]);
    std::vector<VoteRange>& ranges = ranges_[static_cast<std::size_t>(axis)];
    ranges.resize(columns.size() * along);
    parallel_for(columns.size(), threads,
                 [&](std::size_t i) { find_ranges(columns[i], rule, std::span(ranges).subspan(i * along, along)); });
  }
}

Filled Inside::find(IVec3 chunk, InsideScratch& scratch, ChunkBits& bits) const {
  int least = 0;
  int most = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<std::size_t>(crossings_->chunks()[axis]);
    const VoteRange& range = ranges_[static_cast<std::size_t>(axis)][crossings_->column_index(axis, chunk) * along +
                                                                     static_cast<std::size_t>(chunk[axis])];
    least += range.least;
    most += range.most;
  }
  if (least > kHalf || most < -kHalf) return Filled::All;
  if (least >= -kHalf && most <= kHalf) return Filled::None;
  std::array<Plane, 3> entering;
  for (int axis = 0; axis < 3; ++axis) {
    entering_votes(crossings_->column(axis, chunk), rule_, chunk[axis] * kChunkEdge,
                   entering[static_cast<std::size_t>(axis)]);
  }
  scratch.votes.assign(kChunkVoxels, 0);
  add_along_x(crossings_->column(0, chunk), rule_, chunk.x * kChunkEdge, entering[0], scratch.votes.data());
  add_along_y_and_z(*crossings_, chunk, rule_, entering, scratch.votes);
  std::uint64_t some = 0;
  std::uint64_t all = ~std::uint64_t{0};
  const std::int16_t* votes = scratch.votes.data();
  for (std::uint64_t& row : bits) {
    row = 0;
    for (unsigned x = 0; x < kChunkEdge; ++x, ++votes) row |= std::uint64_t{is_inside(*votes)} << x;
    some |= row;
    all &= row;
  }
  if (some == 0) return Filled::None;
  return all == ~std::uint64_t{0} ? Filled::All : Filled::Some;
}

}  // namespace quoin::voxelizing
