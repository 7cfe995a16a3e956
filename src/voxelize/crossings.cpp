#include "voxelize/crossings.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <string>
#include <tuple>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "core/work/progress_steps.h"

namespace quoin::voxelizing {

namespace {

// Limit of stored crossings, 4 bytes each.
constexpr double kMostCrossings = 0x1p30;

/// A corner, projected along an axis.
struct Seen {
  double u, v, w;
};

/// Returns the first integer whose centre (0.5 further) lies at or behind a position.
int first_centre(double place) {
  return static_cast<int>(std::ceil(place - 0.5));
}

/// The interval in which an edge crosses a row of lines.
struct Passing {
  double u = 0.0;
  double w = 0.0;
  bool rises = false;  ///< in v, along the triangle's sense of rotation
};

/// Returns the point where an edge passes `v`. Always computes from the lower end, so that two triangles get the same
/// bits on their shared edge. Requires: one end is at or below `v`, the other above it.
Passing passing(const Seen& from, const Seen& to, double v) {
  QUOIN_ASSERT((from.v <= v) != (to.v <= v), "an edge that passes v");
  const bool rises = from.v < to.v;
  const Seen& low = rises ? from : to;
  const Seen& high = rises ? to : from;
  const double share = (v - low.v) / (high.v - low.v);
  return {low.u + share * (high.u - low.u), low.w + share * (high.w - low.w), rises};
}

/// Returns true for a position at the centre of a voxel.
bool is_centre(double place) {
  return place - 0.5 == std::floor(place - 0.5);
}

/// Calls `touch(u, v, w)` for the lines through the topmost corner, or edge, of a triangle.
template <class Touch>
void for_each_touch_at_top(const std::array<Seen, 3>& corners, double high, int first_u, const Touch& touch) {
  const Seen* left = nullptr;
  const Seen* right = nullptr;
  for (const Seen& corner : corners) {
    if (corner.v != high) continue;
    if (left == nullptr || corner.u < left->u) left = &corner;
    if (right == nullptr || corner.u > right->u) right = &corner;
  }
  const int v = first_centre(high);
  const int end_u = std::min(static_cast<int>(std::floor(right->u - 0.5)) + 1, first_u + kChunkEdge);
  for (int u = std::max(first_centre(left->u), first_u); u < end_u; ++u) {
    const double share = right->u > left->u ? (u + 0.5 - left->u) / (right->u - left->u) : 0.0;
    touch(u, v, left->w + share * (right->w - left->w));
  }
}

/// Calls `visit(u, v, w, enters)` for the lines within [first, first + 64) that meet a triangle, and `touch(u, v, w)`
/// for lines that meet only border points that belong to another triangle.
///
/// A row of lines crosses two edges of the triangle, or none. The lines from the left edge up to but excluding the
/// right edge meet it. So each line through a shared edge or corner belongs to one triangle. In a closed mesh each edge
/// counts once up and once down, so every line has as many entering as leaving crossings.
template <class Visit, class Touch>
void for_each_crossing(const std::array<Seen, 3>& corners, bool is_mirrored, int first_u, int first_v,
                       const Visit& visit, const Touch& touch) {
  const auto [low, high] = std::minmax({corners[0].v, corners[1].v, corners[2].v});
  const auto [nearest, farthest] = std::minmax({corners[0].w, corners[1].w, corners[2].w});
  const int end_v = std::min(first_centre(high), first_v + kChunkEdge);
  for (int v = std::max(first_centre(low), first_v); v < end_v; ++v) {
    const double at = v + 0.5;
    std::array<Passing, 3> passed;
    std::size_t count = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Seen& from = corners[i];
      const Seen& to = corners[i == 2 ? 0 : i + 1];
      if ((from.v <= at) != (to.v <= at)) passed[count++] = passing(from, to, at);
    }
    if (count != 2) continue;
    if (passed[1].u < passed[0].u) std::swap(passed[0], passed[1]);
    const auto& [left, right, unused] = passed;
    const int end_u = std::min(first_centre(right.u), first_u + kChunkEdge);
    // The left edge of a triangle that turns from u to v falls; its normal then points along the line: the line leaves.
    const bool enters = left.rises != is_mirrored;
    for (int u = std::max(first_centre(left.u), first_u); u < end_u; ++u) {
      const double share = (u + 0.5 - left.u) / (right.u - left.u);
      visit(u, v, std::clamp(left.w + share * (right.w - left.w), nearest, farthest), enters);
    }
    const bool is_on_line = is_centre(right.u) && right.u >= first_u && right.u < first_u + kChunkEdge;
    if (is_on_line) touch(first_centre(right.u), v, std::clamp(right.w, nearest, farthest));
  }
  const bool has_top = low < high && is_centre(high) && high >= first_v && high < first_v + kChunkEdge;
  if (has_top) for_each_touch_at_top(corners, high, first_u, touch);
}

std::array<Seen, 3> seen_along(int axis, const Corners& corners) {
  QUOIN_ASSERT(axis >= 0 && axis < 3, "0 <= axis < 3");
  const auto [u, v] = kPlane[static_cast<std::size_t>(axis)];
  std::array<Seen, 3> seen{};
  for (std::size_t i = 0; i < 3; ++i) seen[i] = {corners[i][u], corners[i][v], corners[i][axis]};
  return seen;
}

/// Lists the triangles that the lines of each column may meet.
struct ColumnTriangles {
  std::vector<std::uint64_t> begin;
  std::vector<std::uint32_t> triangles;
};

ColumnTriangles triangles_of_columns(const Frame& frame, int axis) {
  const auto [u, v] = kPlane[static_cast<std::size_t>(axis)];
  const auto across = static_cast<std::size_t>(frame.chunks()[u]);
  const auto columns = across * static_cast<std::size_t>(frame.chunks()[v]);
  const auto visit = [&, u = u, v = v](auto&& at_column) {
    for (std::size_t i = 0; i < frame.triangle_count(); ++i) {
      const Corners c = frame.corners(i);
      const auto low = [&](int a) { return first_centre(std::min({c[0][a], c[1][a], c[2][a]})); };
      // Closed: lines through the border are touched.
      const auto end = [&](int a) {
        return static_cast<int>(std::floor(std::max({c[0][a], c[1][a], c[2][a]}) - 0.5)) + 1;
      };
      const int low_u = low(u), end_u = end(u), low_v = low(v), end_v = end(v);
      if (low_u >= end_u || low_v >= end_v) continue;
      for (int b = low_v >> kChunkShift; b <= (end_v - 1) >> kChunkShift; ++b) {
        for (int a = low_u >> kChunkShift; a <= (end_u - 1) >> kChunkShift; ++a) {
          const std::size_t column = static_cast<std::size_t>(a) + across * static_cast<std::size_t>(b);
          QUOIN_ASSERT(static_cast<std::size_t>(a) < across && column < columns, "a column of the frame");
          at_column(column, i);
        }
      }
    }
  };
  ColumnTriangles found;
  found.begin.assign(columns + 1, 0);
  visit([&](std::size_t column, std::size_t) { ++found.begin[column + 1]; });
  for (std::size_t i = 1; i <= columns; ++i) found.begin[i] += found.begin[i - 1];
  found.triangles.resize(found.begin.back());
  std::vector<std::uint64_t> next(found.begin.begin(), found.begin.end() - 1);
  visit([&](std::size_t column, std::size_t i) { found.triangles[next[column]++] = static_cast<std::uint32_t>(i); });
  return found;
}

/// A point where a line meets the surface, or touches a triangle's border.
struct Met {
  std::uint16_t line = 0;
  bool enters = false;
  std::uint32_t triangle = 0;
  double w = 0.0;
};

/// For triangles that lie between voxels and are touched: returns true if their inner side is behind them.
using Sides = std::map<std::uint32_t, bool>;

/// Moves crossings that rounding moved off the border between two voxels back onto it.
double snapped(double w) {
  constexpr double kRounding = 1e-9;
  const double border = std::round(w);
  return std::abs(w - border) < kRounding ? border : w;
}

/// Tracks the depth within the mesh along a line: the inner side of the surface is the deeper side.
class Depth {
 public:
  explicit Depth(SolidVoxels rule) : rule_(rule) {}
  /// Passes a crossing. Returns true if its inner side is behind it.
  bool is_deeper_behind(bool enters) {
    const int before = depth();
    turns_ += enters ? 1 : -1;
    ++crossings_;
    return depth() > before;
  }
  [[nodiscard]] int depth() const { return rule_ == SolidVoxels::Parity ? crossings_ & 1 : std::abs(turns_); }

 private:
  SolidVoxels rule_;
  int turns_ = 0;
  int crossings_ = 0;
};

/// Returns true if the crossings at the position of the first one go into the mesh and out again: a tip ends there.
/// `depth`: before them.
bool is_tip(std::span<const Met> line, Depth depth) {
  if (depth.depth() != 0 || line.size() < 2 || line[1].w != line[0].w) return false;
  for (std::size_t i = 0; i < line.size() && line[i].w == line[0].w; ++i) {
    static_cast<void>(depth.is_deeper_behind(line[i].enters));
  }
  return depth.depth() == 0;
}

bool is_between_voxels(double w) {
  return w == std::floor(w);
}

/// Adds the crossings of a line. Requires: sorted by w.
void add_crossings(std::span<const Met> line, SolidVoxels rule, std::vector<Crossing>& crossings, Sides& sides) {
  QUOIN_ASSERT(std::ranges::is_sorted(line, {}, &Met::w), "sorted by w");
  const std::size_t first = crossings.size();
  Depth depth(rule);
  bool is_in_tip = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Met& met = line[i];
    const int behind = first_centre(met.w);
    const bool is_between = is_between_voxels(met.w);
    if (i == 0 || line[i - 1].w != met.w) is_in_tip = is_tip(line.subspan(i), depth);
    // A tip has no inner side: it takes the greater voxel, as open surfaces do.
    const bool is_deeper_behind = depth.is_deeper_behind(met.enters) || is_in_tip;
    crossings.emplace_back(behind, is_between ? !is_deeper_behind : std::floor(met.w) < behind, met.enters);
    if (const auto side = sides.find(met.triangle); is_between && side != sides.end()) side->second = is_deeper_behind;
  }
  std::sort(crossings.begin() + static_cast<std::ptrdiff_t>(first), crossings.end());
}

/// Sorts by line, then along it. Returns where each line begins.
std::vector<std::uint32_t> sort_by_lines(std::vector<Met>& met) {
  std::vector<std::uint32_t> begin(kLines + 1, 0);
  for (const Met& each : met) ++begin[each.line + std::size_t{1}];
  for (std::size_t i = 1; i <= kLines; ++i) begin[i] += begin[i - 1];
  std::vector<Met> sorted(met.size());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (const Met& each : met) sorted[next[each.line]++] = each;
  const auto comes_before = [](const Met& a, const Met& b) {
    return std::tie(a.w, a.enters, a.triangle) < std::tie(b.w, b.enters, b.triangle);
  };
  for (std::size_t i = 0; i < kLines; ++i) {
    std::sort(sorted.begin() + begin[i], sorted.begin() + begin[i + 1], comes_before);
  }
  met = std::move(sorted);
  return begin;
}

Column column_of(std::span<const Met> met, std::vector<std::uint32_t> begin, SolidVoxels rule, Sides& sides) {
  Column column;
  column.begin = std::move(begin);
  column.crossings.reserve(met.size());
  for (std::size_t i = 0; i < kLines; ++i) {
    add_crossings(met.subspan(column.begin[i], column.begin[i + 1] - column.begin[i]), rule, column.crossings, sides);
  }
  return column;
}

/// Returns twice the area of a triangle projected along an axis, positive if it turns from u to v.
double seen_area(const std::array<Seen, 3>& c) {
  return (c[1].u - c[0].u) * (c[2].v - c[0].v) - (c[1].v - c[0].v) * (c[2].u - c[0].u);
}

Column find_column(const Frame& frame, int axis, SolidVoxels rule, std::span<const std::uint32_t> triangles,
                   int first_u, int first_v) {
  std::vector<Met> met;
  std::vector<Met> touched;
  const auto line_of = [&](int u, int v) {
    QUOIN_ASSERT(u >= first_u && u < first_u + kChunkEdge && v >= first_v && v < first_v + kChunkEdge,
                 "one of the lines");
    return static_cast<std::uint16_t>((u - first_u) + kChunkEdge * (v - first_v));
  };
  for (const std::uint32_t triangle : triangles) {
    const std::array<Seen, 3> seen = seen_along(axis, frame.corners(triangle));
    const bool is_mirrored = axis == 1;  // only the plane (x, z) is seen from behind
    const auto visit = [&](int u, int v, double w, bool enters) {
      met.push_back({line_of(u, v), enters, triangle, snapped(w)});
    };
    const double area = seen_area(seen);
    const auto touch = [&](int u, int v, double w) {
      // A triangle seen edge-on shares its border with triangles that are not.
      if (area != 0.0) touched.push_back({line_of(u, v), (area < 0.0) != is_mirrored, triangle, snapped(w)});
    };
    for_each_crossing(seen, is_mirrored, first_u, first_v, visit, touch);
  }
  std::vector<std::uint32_t> begin = met.empty() ? std::vector<std::uint32_t>() : sort_by_lines(met);
  // A line that touches one triangle may cross its neighbour.
  std::erase_if(touched, [&](const Met& each) {
    constexpr double kSame = 1e-9;
    if (begin.empty()) return false;
    const auto line = std::span(met).subspan(begin[each.line], begin[each.line + std::size_t{1}] - begin[each.line]);
    return std::ranges::any_of(line, [&](const Met& m) { return std::abs(m.w - each.w) <= kSame; });
  });
  Sides sides;
  for (const Met& each : touched) {
    if (is_between_voxels(each.w)) sides.emplace(each.triangle, each.enters);
  }
  Column column = begin.empty() ? Column() : column_of(met, std::move(begin), rule, sides);
  // Triangles of both directions that touch a line at one point end in a tip.
  std::map<std::pair<std::uint16_t, double>, unsigned> directions;
  for (const Met& each : touched) directions[{each.line, each.w}] |= each.enters ? 1U : 2U;
  for (const Met& each : touched) {
    const bool is_tip = directions[{each.line, each.w}] == 3U;
    const bool is_before = is_between_voxels(each.w) && !is_tip && !sides[each.triangle];
    column.touched.emplace_back(each.line, static_cast<int>(std::floor(each.w)) - (is_before ? 1 : 0));
  }
  return column;
}

/// Returns the projected area of all triangles along all axes, an estimate of the number of crossings.
double expected_crossings(const Frame& frame) {
  double area = 0.0;
  for (std::size_t i = 0; i < frame.triangle_count(); ++i) {
    const Corners c = frame.corners(i);
    const DVec3 normal = glm::abs(glm::cross(c[1] - c[0], c[2] - c[0]));
    area += 0.5 * (normal.x + normal.y + normal.z);
  }
  return area;
}

}  // namespace

Result<Crossings> Crossings::find(const Frame& frame, SolidVoxels rule, Threads threads, const Progress& progress) {
  if (const double expected = expected_crossings(frame); !(expected <= kMostCrossings)) {
    return make_error(ErrorCode::LimitExceeded,
                      "the mesh needs more than 2^30 line crossings: its surface spans about " +
                          std::to_string(static_cast<std::int64_t>(std::min(expected, 1e18))) + " voxels");
  }
  Crossings found;
  found.chunks_ = frame.chunks();
  std::array<ColumnTriangles, 3> triangles;
  parallel_for(3, threads, [&](std::size_t axis) {
    triangles[axis] = triangles_of_columns(frame, static_cast<int>(axis));
    found.columns_[axis].resize(triangles[axis].begin.size() - 1);
  });
  std::vector<std::pair<int, std::size_t>> work;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < found.columns_[static_cast<std::size_t>(axis)].size(); ++i) work.emplace_back(axis, i);
  }
  ProgressSteps steps(progress, work.size());
  parallel_for(work.size(), threads, [&](std::size_t i) {
    if (steps.cancelled()) return;
    const auto [axis, index] = work[i];
    const auto a = static_cast<std::size_t>(axis);
    const auto across = static_cast<std::size_t>(frame.chunks()[kPlane[a][0]]);
    const std::vector<std::uint64_t>& begin = triangles[a].begin;
    found.columns_[a][index] =
        find_column(frame, axis, rule,
                    {triangles[a].triangles.data() + begin[index], triangles[a].triangles.data() + begin[index + 1]},
                    static_cast<int>(index % across) * kChunkEdge, static_cast<int>(index / across) * kChunkEdge);
    steps.step();
  });
  if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  return found;
}

void mark_crossed(const Crossings& crossings, IVec3 chunk, ChunkBits& bits) {
  for (int axis = 0; axis < 3; ++axis) {
    const Column& column = crossings.column(axis, chunk);
    const int first = chunk[axis] * kChunkEdge;
    const auto [u_axis, v_axis] = kPlane[static_cast<std::size_t>(axis)];
    const auto mark = [&, u_axis = u_axis, v_axis = v_axis](std::size_t line, int along) {
      if (along < first || along >= first + kChunkEdge) return;
      IVec3 voxel;
      voxel[axis] = along - first;
      voxel[u_axis] = static_cast<int>(line % kChunkEdge);
      voxel[v_axis] = static_cast<int>(line / kChunkEdge);
      bits[row_of(voxel.y, voxel.z)] |= std::uint64_t{1} << static_cast<unsigned>(voxel.x);
    };
    for (const auto& [line, voxel] : column.touched) mark(line, voxel);
    if (column.begin.empty()) continue;
    for (std::size_t line = 0; line < kLines; ++line) {
      for (const Crossing& crossing : column.line(line)) mark(line, crossing.voxel());
    }
  }
}

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
