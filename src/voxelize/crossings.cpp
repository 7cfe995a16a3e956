#include "voxelize/crossings.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "core/progress_steps.h"

namespace quoin::voxelizing {

namespace {

// 4 bytes each.
constexpr double kMostCrossings = 0x1p30;

/// A corner as lines along an axis see it.
struct Seen {
  double u, v, w;
};

/// The first whole number whose centre (0.5 further) lies at or behind a place.
int first_centre(double place) {
  return static_cast<int>(std::ceil(place - 0.5));
}

/// Where an edge passes a row of lines.
struct Passing {
  double u = 0.0;
  double w = 0.0;
  bool rises = false;  ///< in v, along the triangle's sense of rotation
};

/// Requires: the edge begins at or below `v` and ends above it, or the other way round. From the lower end always, so
/// that two triangles find the same bits on the edge that they share.
Passing passing(const Seen& from, const Seen& to, double v) {
  const bool rises = from.v < to.v;
  const Seen& low = rises ? from : to;
  const Seen& high = rises ? to : from;
  const double share = (v - low.v) / (high.v - low.v);
  return {low.u + share * (high.u - low.u), low.w + share * (high.w - low.w), rises};
}

/// Calls `visit(u, v, w, enters)` for the lines within [first, first + 64) that meet a triangle.
///
/// A row of lines passes two edges of it, or none; the lines from the left one up to before the right one meet it. That
/// gives every line through a shared edge or corner to one triangle, and each edge counts once up and once down in a
/// closed mesh, so that as many crossings enter as leave on every line.
template <class Visit>
void for_each_crossing(const std::array<Seen, 3>& corners, bool is_mirrored, int first_u, int first_v, Visit&& visit) {
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
  }
}

std::array<Seen, 3> seen_along(int axis, const Corners& corners) {
  const auto [u, v] = kPlane[static_cast<std::size_t>(axis)];
  std::array<Seen, 3> seen{};
  for (std::size_t i = 0; i < 3; ++i) seen[i] = {corners[i][u], corners[i][v], corners[i][axis]};
  return seen;
}

/// Which triangles the lines of each column may meet.
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
      const auto end = [&](int a) { return first_centre(std::max({c[0][a], c[1][a], c[2][a]})); };
      const int low_u = low(u), end_u = end(u), low_v = low(v), end_v = end(v);
      if (low_u >= end_u || low_v >= end_v) continue;
      for (int b = low_v >> kChunkShift; b <= (end_v - 1) >> kChunkShift; ++b) {
        for (int a = low_u >> kChunkShift; a <= (end_u - 1) >> kChunkShift; ++a) {
          at_column(static_cast<std::size_t>(a) + across * static_cast<std::size_t>(b), i);
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

Column find_column(const Frame& frame, int axis, std::span<const std::uint32_t> triangles, int first_u, int first_v) {
  Column column;
  std::vector<std::pair<std::uint16_t, Crossing>> met;
  for (const std::uint32_t triangle : triangles) {
    // Of the three planes (x, z) alone is seen from behind.
    for_each_crossing(seen_along(axis, frame.corners(triangle)), axis == 1, first_u, first_v,
                      [&](int u, int v, double w, bool enters) {
                        const int behind = first_centre(w);
                        const int line = (u - first_u) + kChunkEdge * (v - first_v);
                        met.emplace_back(static_cast<std::uint16_t>(line),
                                         Crossing(behind, std::floor(w) < behind, enters));
                      });
  }
  if (met.empty()) return column;
  column.begin.assign(kLines + 1, 0);
  for (const auto& [line, crossing] : met) ++column.begin[line + std::size_t{1}];
  for (std::size_t i = 1; i <= kLines; ++i) column.begin[i] += column.begin[i - 1];
  column.crossings.resize(met.size());
  std::vector<std::uint32_t> next(column.begin.begin(), column.begin.end() - 1);
  for (const auto& [line, crossing] : met) column.crossings[next[line]++] = crossing;
  for (std::size_t i = 0; i < kLines; ++i) {
    std::sort(column.crossings.begin() + column.begin[i], column.crossings.begin() + column.begin[i + 1]);
  }
  return column;
}

/// Lines that triangles hide, along all axes: about as many crossings as there will be.
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

Result<Crossings> Crossings::find(const Frame& frame, Threads threads, const Progress& progress) {
  if (const double expected = expected_crossings(frame); !(expected <= kMostCrossings)) {
    return make_error(ErrorCode::LimitExceeded,
                      "the mesh would take more than 2^30 crossings of lines: its surface is " +
                          std::to_string(static_cast<std::int64_t>(std::min(expected, 1e18))) + " voxels large");
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
    found.columns_[a][index] = find_column(
        frame, axis, {triangles[a].triangles.data() + begin[index], triangles[a].triangles.data() + begin[index + 1]},
        static_cast<int>(index % across) * kChunkEdge, static_cast<int>(index / across) * kChunkEdge);
    steps.step();
  });
  if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  return found;
}

void mark_crossed(const Crossings& crossings, IVec3 chunk, ChunkBits& bits) {
  for (int axis = 0; axis < 3; ++axis) {
    const Column& column = crossings.column(axis, chunk);
    if (column.begin.empty()) continue;
    const int first = chunk[axis] * kChunkEdge;
    const auto [u_axis, v_axis] = kPlane[static_cast<std::size_t>(axis)];
    for (std::size_t line = 0; line < kLines; ++line) {
      for (const Crossing& crossing : column.line(line)) {
        const int along = crossing.voxel() - first;
        if (along < 0 || along >= kChunkEdge) continue;
        IVec3 voxel;
        voxel[axis] = along;
        voxel[u_axis] = static_cast<int>(line % kChunkEdge);
        voxel[v_axis] = static_cast<int>(line / kChunkEdge);
        bits[row_of(voxel.y, voxel.z)] |= std::uint64_t{1} << static_cast<unsigned>(voxel.x);
      }
    }
  }
}

}  // namespace quoin::voxelizing
