// The kernel of raster.h for registers of any width; each lane holds a face.
//
//   Groups      boxes around 16 rectangles   | box 0 | box 1 | ...      find the tile's pixels that each may cover
//     Level       rectangles of one side       | 0 | 1 | ...              find the pixels that each may cover
//       pixels      one of each lane's rectangle, until the largest is done

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

#include <quoin/core/assert.h>

#include "core/lanes/lanes.h"
#include "render/impostor/raster/raster.h"

namespace quoin::raster {
namespace {

using namespace lanes;

constexpr std::size_t kLanes = kWidth;
constexpr float kMargin = 0.01F;  // pixels: for rounding

// Constants of all rectangles of one side.
struct Side {
  std::size_t axis;
  std::size_t u;
  std::size_t v;
  float sign;
  bool is_inclined;  // surfels
  float room;        // of the level, added to the reach
};

// Pixels, all inclusive.
struct Areas {
  F left;
  F top;
  F right;
  F bottom;
  Mask shown;
};

inline F dot(const Vector& by, const F (&q)[3]) {
  return all(by[0]) * q[0] + all(by[1]) * q[1] + all(by[2]) * q[2];
}
inline F linear(const LinearVector& vector, std::size_t axis, F x, F y) {
  return all(vector.at[axis]) + all(vector.x[axis]) * x + all(vector.y[axis]) * y;
}

// Computes a conservative bound of the pixels that boxes around `q` cover.
inline void project(const Job& job, const F (&q)[3], const F (&half)[3], Areas& areas) {
  const F ahead = dot(job.ahead, q) + all(job.ahead_at);
  const F inverse = all(1.0F) / ahead;
  const F column = (dot(job.across, q) + all(job.across_at)) * inverse;
  const F row = (dot(job.down, q) + all(job.down_at)) * inverse;
  F deep = all(0.0F);
  F wide = all(0.0F);
  F high = all(0.0F);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const F forward = all(job.ahead[axis]);
    deep = deep + half[axis] * abs(forward);
    wide = wide + half[axis] * abs(all(job.across[axis]) - column * forward);
    high = high + half[axis] * abs(all(job.down[axis]) - row * forward);
  }
  // Boxes that reach the camera's plane may be visible anywhere.
  const F nearest = ahead - deep;
  const Mask is_before = all(0.01F) * ahead < nearest;
  const F scale = all(1.0F) / nearest;
  const auto low = [&](F middle, F size, float at, int least) {
    const F edge = all(static_cast<float>(least));
    const F value = all(0.0F) - floor(all(0.0F) - (middle - size * scale + all(at - kMargin)));
    return select(is_before, min(max(value, edge), all(64.0F)), edge);
  };
  const auto high_of = [&](F middle, F size, float at, int most) {
    const F edge = all(static_cast<float>(most));
    const F value = floor(middle + size * scale + all(at + kMargin));
    return select(is_before, max(min(value, edge), all(-64.0F)), edge);
  };
  areas.left = low(column, wide, job.column_at, job.left);
  areas.top = low(row, high, job.row_at, job.top);
  areas.right = high_of(column, wide, job.column_at, job.right - 1);
  areas.bottom = high_of(row, high, job.row_at, job.bottom - 1);
  areas.shown = (areas.left <= areas.right) & (areas.top <= areas.bottom) & (all(0.0F) < ahead + deep);
}

inline float linear(const LinearVector& vector, std::size_t axis, float x, float y) {
  return vector.at[axis] + vector.x[axis] * x + vector.y[axis] * y;
}

// Follows the ray of a pixel through the bits of a cell. It enters the cell's box at `along` through a side across axis
// `side`. Returns the bit hit, and sets `along` to it; -1 if none.
inline int follow(const Job& job, const ImpostorFaces::Cell& cell, std::size_t side, float x, float y, float& along) {
  constexpr float kPast = 1e-3F;  // bits: distance past the entered side, so that rounding does not matter
  const float scale = 1.0F / job.level->step;
  float from[3];
  float steps[3];
  int at[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    from[axis] = (linear(job.point, axis, x, y) - cell.corner[static_cast<int>(axis)]) * scale;
    steps[axis] = linear(job.direction, axis, x, y) * scale;
    float entered = from[axis] + along * steps[axis];
    if (axis == side) entered += steps[axis] > 0.0F ? kPast : -kPast;
    at[axis] = static_cast<int>(std::min(std::max(entered, 0.0F), 3.0F));
  }
  for (;;) {
    const int bit = at[0] + 4 * at[1] + 16 * at[2];
    if ((cell.bits >> bit & 1U) != 0) return bit;
    std::size_t next = 3;
    float nearest = std::numeric_limits<float>::infinity();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (steps[axis] == 0.0F) continue;
      const float end = static_cast<float>(at[axis] + (steps[axis] > 0.0F ? 1 : 0));
      const float until = (end - from[axis]) / steps[axis];
      if (until < nearest) nearest = until, next = axis;
    }
    if (next == 3) return -1;
    at[next] += steps[next] > 0.0F ? 1 : -1;
    if (at[next] < 0 || at[next] > 3) return -1;
    along = std::max(along, nearest);
  }
}

// Stores a hit if it is nearer than the pixel's hit so far.
inline void keep(std::int32_t id, std::size_t pixel, float depth, Met met, Canvas& canvas) {
  const float nearest = canvas.depth[pixel];
  if (!(depth <= nearest)) return;
  const std::int32_t face = met.packed();
  if (depth == nearest) {
    // Rectangles in one plane may overlap, and their order differs between register widths.
    const bool is_lower = id < canvas.id[pixel] || (id == canvas.id[pixel] && face < canvas.face[pixel]);
    if (!is_lower) return;
  }
  canvas.depth[pixel] = depth;
  canvas.id[pixel] = id;
  canvas.face[pixel] = face;
}

inline void put(const Job& job, std::size_t side, float x, float y, float depth, std::uint32_t rectangle,
                Canvas& canvas) {
  const std::size_t pixel = index_of(static_cast<int>(x), static_cast<int>(y));
  if (canvas.depth[pixel] < depth || canvas.pattern[pixel] < job.share.first || canvas.pattern[pixel] >= job.share.end)
    return;
  std::uint32_t view = 0;
  if (!job.level->cells.empty()) {
    float along = (depth - job.depth_at) / job.depth_step;
    const std::uint32_t number = job.level->face[rectangle];
    QUOIN_ASSERT(number < job.level->cells.size(), "a cell of the level");
    const ImpostorFaces::Cell& cell = job.level->cells[number];
    const int bit = follow(job, cell, side, x, y, along);
    if (bit < 0) return;
    view = job.near.chosen(64 * number + static_cast<std::uint32_t>(bit));
    depth = std::max(depth, job.depth_at + along * job.depth_step);
  }
  keep(job.id, pixel, depth, {rectangle, view}, canvas);
}

// Returns index_of the pixels, which have integer coordinates.
inline I indices_of(F x, F y) {
  static_assert(kTile == 32 && kBlock == 4);
  const I column = to_int(x);
  const I row = to_int(y);
  return shift_left<7>(shift_right<2>(row)) + shift_left<4>(shift_right<2>(column)) + shift_left<2>(row & all(3)) +
         (column & all(3));
}

// Writes the faces that rays met to the canvas.
inline void put_met(const Job& job, const Side& side, F x, F y, F depth, Mask met, std::size_t first, Canvas& canvas) {
  std::uint32_t left = bits(met);
  if (left == 0) return;
  alignas(64) float depths[kLanes];
  store(depths, depth);
  if (job.share.is_whole() && job.level->cells.empty()) {
    alignas(64) std::int32_t pixels[kLanes];
    store(pixels, indices_of(x, y));
    for (; left != 0; left &= left - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(left));
      const auto pixel = static_cast<std::size_t>(pixels[lane]);
      QUOIN_ASSERT(pixel < kPixels, "a pixel of the tile");
      keep(job.id, pixel, depths[lane], {static_cast<std::uint32_t>(first + lane), 0}, canvas);
    }
    return;
  }
  alignas(64) float columns[kLanes];
  alignas(64) float rows[kLanes];
  store(columns, x), store(rows, y);
  for (; left != 0; left &= left - 1) {
    const auto lane = static_cast<std::size_t>(std::countr_zero(left));
    put(job, side.axis, columns[lane], rows[lane], depths[lane], static_cast<std::uint32_t>(first + lane), canvas);
  }
}

// Meets one pixel of each lane's rectangle with the rectangle's plane. `first`: the number of lane 0's rectangle.
inline void meet(const Job& job, const Side& side, const F (&q)[3], const F (&reach)[2], F x, F y, Mask wanted,
                 std::size_t first, Canvas& canvas) {
  const F towards = linear(job.direction, side.axis, x, y);
  const F along = (q[side.axis] - linear(job.point, side.axis, x, y)) / towards;
  const F at_u = linear(job.point, side.u, x, y) + along * linear(job.direction, side.u, x, y);
  const F at_v = linear(job.point, side.v, x, y) + along * linear(job.direction, side.v, x, y);
  const F depth = all(job.depth_at) + along * all(job.depth_step);
  const Mask met = wanted & (abs(at_u - q[side.u]) <= reach[0]) & (abs(at_v - q[side.v]) <= reach[1]) &
                   (towards * all(side.sign) < all(0.0F)) & (all(0.0F) < depth);
  put_met(job, side, x, y, depth, met, first, canvas);
}

// As `meet`, for surfels: planes with a slope along each side.
inline void meet_inclined(const Job& job, const Side& side, const F (&q)[3], const F (&slope)[2], const F (&reach)[2],
                          F x, F y, Mask wanted, std::size_t first, Canvas& canvas) {
  const F direction_u = linear(job.direction, side.u, x, y);
  const F direction_v = linear(job.direction, side.v, x, y);
  const F from_u = linear(job.point, side.u, x, y) - q[side.u];
  const F from_v = linear(job.point, side.v, x, y) - q[side.v];
  const F rise = q[side.axis] - linear(job.point, side.axis, x, y) + slope[0] * from_u + slope[1] * from_v;
  const F towards = linear(job.direction, side.axis, x, y) - slope[0] * direction_u - slope[1] * direction_v;
  const F along = rise / towards;
  const F depth = all(job.depth_at) + along * all(job.depth_step);
  const Mask met = wanted & (abs(from_u + along * direction_u) <= reach[0]) &
                   (abs(from_v + along * direction_v) <= reach[1]) & (towards * all(side.sign) < all(0.0F)) &
                   (all(0.0F) < depth);
  put_met(job, side, x, y, depth, met, first, canvas);
}

// Draws the rectangle of each lane to each of its pixels.
inline void put_all(const Job& job, const Side& side, const F (&q)[3], const F (&slope)[2], const F (&reach)[2],
                    const Areas& areas, Mask shown, std::size_t first, Canvas& canvas) {
  const F none = all(-1.0F);
  const float width = greatest_of(select(shown, areas.right - areas.left, none));
  const float height = greatest_of(select(shown, areas.bottom - areas.top, none));
  const F met_reach[2] = {reach[0] + all(side.room), reach[1] + all(side.room)};
  for (float down = 0.0F; down <= height; down += 1.0F) {
    const F y = areas.top + all(down);
    const Mask in_row = shown & (y <= areas.bottom);
    for (float across = 0.0F; across <= width; across += 1.0F) {
      const F x = areas.left + all(across);
      const Mask wanted = in_row & (x <= areas.right);
      if (side.is_inclined) {
        meet_inclined(job, side, q, slope, met_reach, x, y, wanted, first, canvas);
      } else {
        meet(job, side, q, met_reach, x, y, wanted, first, canvas);
      }
    }
  }
}

void draw_group(const Job& job, const Side& side, std::size_t begin, Canvas& canvas) {
  const ImpostorFaces::Level& level = *job.level;
  QUOIN_ASSERT(begin + ImpostorFaces::kGroup <= level.count(), "a group of the level");
  const bool has_reach = !level.reach[0].empty();
  Areas areas;
  for (std::size_t first = begin; first < begin + ImpostorFaces::kGroup; first += kLanes) {
    const F q[3] = {load(level.centre[0].data() + first), load(level.centre[1].data() + first),
                    load(level.centre[2].data() + first)};
    F slope[2] = {all(0.0F), all(0.0F)};
    F reach[2] = {all(0.5F), all(0.5F)};
    if (has_reach) reach[0] = load(level.reach[0].data() + first), reach[1] = load(level.reach[1].data() + first);
    F half[3];
    half[side.u] = reach[0], half[side.v] = reach[1];
    half[side.axis] = all(0.0F);
    if (side.is_inclined) {
      slope[0] = load(level.slope[0].data() + first), slope[1] = load(level.slope[1].data() + first);
      half[side.axis] = reach[0] * abs(slope[0]) + reach[1] * abs(slope[1]);
    }
    project(job, q, half, areas);
    const auto* views = reinterpret_cast<const std::int32_t*>(level.views.data() + first);
    const Mask shown = areas.shown & test(load(views), all(static_cast<int>(job.views)));
    if (any(shown)) put_all(job, side, q, slope, reach, areas, shown, first, canvas);
  }
}

// Returns true if the stored hits are nearer than `depth` in all blocks that an area touches.
inline bool is_hidden(int left, int top, int right, int bottom, float depth, const Canvas& canvas) {
  for (int y = top / kBlock; y <= bottom / kBlock; ++y) {
    for (int x = left / kBlock; x <= right / kBlock; ++x) {
      if (!(canvas.furthest[static_cast<std::size_t>(y * (kTile / kBlock) + x)] < depth)) return false;
    }
  }
  return true;
}

void draw_side(const Job& job, const Side& side, std::size_t begin, std::size_t end, Canvas& canvas) {
  const ImpostorFaces::Groups& groups = job.level->groups;
  Areas areas;
  alignas(64) float least[kLanes];  // depth
  alignas(64) std::int32_t edges[4][kLanes];
  for (std::size_t first = begin; first < end; first += kLanes) {
    F q[3];
    F half[3];
    F near = all(0.0F);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      q[axis] = load(groups.centre[axis].data() + first);
      half[axis] = load(groups.half[axis].data() + first);
      near = near + q[axis] * all(job.forward[axis]) - half[axis] * abs(all(job.forward[axis]));
    }
    project(job, q, half, areas);
    std::uint32_t shown = bits(areas.shown);
    if (end - first < kLanes) shown &= (1U << (end - first)) - 1U;
    if (shown == 0) continue;
    store(least, near * all(job.depth_step) + all(job.depth_at));
    store(edges[0], to_int(areas.left)), store(edges[1], to_int(areas.top));
    store(edges[2], to_int(areas.right)), store(edges[3], to_int(areas.bottom));
    for (; shown != 0; shown &= shown - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(shown));
      if ((groups.views[first + i] & job.views) == 0) continue;
      if (is_hidden(edges[0][i], edges[1][i], edges[2][i], edges[3][i], least[i], canvas)) continue;
      draw_group(job, side, (first + i) * ImpostorFaces::kGroup, canvas);
    }
  }
}

void find_furthest(const Job& job, Canvas& canvas) {
  for (int y = job.top / kBlock; y <= (job.bottom - 1) / kBlock; ++y) {
    for (int x = job.left / kBlock; x <= (job.right - 1) / kBlock; ++x) {
      const std::size_t first = index_of(x * kBlock, y * kBlock);
      F most = load(canvas.depth.data() + first);
      for (std::size_t i = kLanes; i < 16; i += kLanes) most = max(most, load(canvas.depth.data() + first + i));
      canvas.furthest[first / 16] = greatest_of(most);
    }
  }
}

// Returns true if any ray goes against the normal. A linear function has its extremes in a corner.
bool is_seen(const Job& job, const Side& side) {
  const auto at = [&](int x, int y) {
    const float direction = job.direction.at[side.axis] + job.direction.x[side.axis] * static_cast<float>(x) +
                            job.direction.y[side.axis] * static_cast<float>(y);
    return direction * side.sign < 1e-6F;
  };
  return at(job.left, job.top) || at(job.right, job.top) || at(job.left, job.bottom) || at(job.right, job.bottom);
}

void draw_faces(const Job& job, Canvas& canvas) {
  QUOIN_ASSERT(job.level != nullptr, "a level to draw");
  QUOIN_ASSERT(job.left >= 0 && job.left < job.right && job.right <= kTile && job.top >= 0 && job.top < job.bottom &&
                   job.bottom <= kTile,
               "pixels of the tile");
  for (std::size_t i = 0; i < ImpostorFaces::kSides; ++i) {
    const std::size_t begin = job.level->begin[i] / ImpostorFaces::kGroup;
    const std::size_t end = job.level->begin[i + 1] / ImpostorFaces::kGroup;
    if (begin == end) continue;
    const bool is_inclined = i >= ImpostorFaces::kSides / 2;
    const FaceFrame& frame = kFaceFrames[i % (ImpostorFaces::kSides / 2)];
    const Side side{frame.axis, frame.u, frame.v, static_cast<float>(frame.sign), is_inclined, job.level->room()};
    if (is_inclined || is_seen(job, side)) draw_side(job, side, begin, end, canvas);
  }
  find_furthest(job, canvas);
}

}  // namespace

constinit const Draw QUOIN_KERNEL(Draw) = draw_faces;

#ifndef QUOIN_KERNEL_AVX2
constinit const KernelTable<Draw> kDraws = QUOIN_KERNEL_TABLE(Draw, Avx512);
#endif

}  // namespace quoin::raster
