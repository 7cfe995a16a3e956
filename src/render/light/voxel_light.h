#pragma once

// Light at surfaces, for any source of voxel light. `Voxels` has
//  std::uint16_t word(IVec3), packed light, and bool passes(IVec3), true if light passes the voxel.

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/propagated_light.h>
#include <quoin/render/surface_light.h>

namespace quoin {

/// Spreads a packed word to one byte per level: sky, red, green, blue.
[[nodiscard]] constexpr std::uint32_t level_bytes(std::uint16_t word) {
  const std::uint32_t w = word;
  return (w & 0xFU) | (w & 0xF0U) << 4 | (w & 0xF00U) << 8 | (w & 0xF000U) << 12;
}

/// A voxel in front of a face: its levels in bytes, and a flag that light passes it.
struct FrontLight {
  std::uint32_t levels = 0;
  bool passes = false;
};

/// Returns the light of a corner, in twelfths, from the voxels in front that touch it: the voxel before the face, its
/// two neighbours along the edges, and the diagonal one.
[[nodiscard]] constexpr std::uint32_t corner_light(const FrontLight& own, const FrontLight& side1,
                                                   const FrontLight& side2, const FrontLight& across) {
  if (!own.passes) return 0;
  std::uint32_t sum = own.levels;
  std::uint32_t count = 1;
  const auto add = [&](const FrontLight& each, bool is_reached) {
    if (!is_reached) return;
    sum += each.levels;
    ++count;
  };
  add(side1, side1.passes);
  add(side2, side2.passes);
  add(across, across.passes && (side1.passes || side2.passes));
  return sum * (12U / count);
}

/// The corners of a face whose front voxel is `front`, which may lie farther away.
template <class Voxels>
[[nodiscard]] FaceLight face_light(Voxels& voxels, IVec3 front, Direction face) {
  const FaceFrame& frame = frame_of(face);
  std::array<std::array<FrontLight, 3>, 3> around{};  // [v][u]
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      IVec3 at = front;
      at[frame.u] += du;
      at[frame.v] += dv;
      FrontLight& each = around[static_cast<std::size_t>(dv + 1)][static_cast<std::size_t>(du + 1)];
      each.passes = voxels.passes(at);
      if (each.passes) each.levels = level_bytes(voxels.word(at));
    }
  }
  const auto corner = [&](std::size_t u, std::size_t v) {
    return corner_light(around[1][1], around[1][u], around[v][1], around[v][u]);
  };
  return {corner(0, 0), corner(2, 0), corner(2, 2), corner(0, 2)};
}

/// Light at a point of a face, between its corners. `u`, `v`: 0 to 1 along its edges.
[[nodiscard]] inline MeanLevels light_between(const FaceLight& corners, float u, float v) {
  std::array<float, 4> levels{};
  for (std::size_t c = 0; c < 4; ++c) {
    const auto at = [&](std::size_t corner) { return static_cast<float>(corners[corner] >> 8 * c & 255U); };
    const float low = at(0) + u * (at(1) - at(0));
    const float high = at(3) + u * (at(2) - at(3));
    levels[c] = (low + v * (high - low)) * (1.0F / 12.0F);
  }
  return {levels[0], levels[1], levels[2], levels[3]};
}

/// A place on a face, of a voxel or of a cell of (2^level)^3 of them.
struct FacePlace {
  IVec3 front{0};  ///< the voxel before it
  float u = 0.0F;  ///< in that voxel, along the face's edges
  float v = 0.0F;

  /// `inside`: in the cell, 0 to 1.
  FacePlace(IVec3 cell, Direction face, DVec3 inside, int level) : front(cell << level) {
    QUOIN_ASSERT(level >= 0 && level < 31, "cells with an edge of 31 bits");
    const FaceFrame& frame = frame_of(face);
    const int edge = 1 << level;
    front[frame.axis] += frame.sign > 0 ? edge : -1;
    const auto go_along = [&](int axis) {
      const float along = static_cast<float>(std::clamp(inside[axis], 0.0, 1.0)) * static_cast<float>(edge);
      const int whole = std::min(static_cast<int>(along), edge - 1);
      front[axis] += whole;
      return along - static_cast<float>(whole);
    };
    u = go_along(frame.u);
    v = go_along(frame.v);
  }
};

/// Returns the light of a position on a face. A halved cell can be solid while some of its voxels are air. The search
/// for light in front of such a face therefore goes as far as the width of the cell.
template <class Voxels>
[[nodiscard]] MeanLevels light_on_face(Voxels& voxels, FacePlace place, Direction face, int level) {
  for (int step = 1; step < 1 << level && !voxels.passes(place.front); ++step) place.front += normal_of(face);
  return light_between(face_light(voxels, place.front, face), place.u, place.v);
}

/// The eight voxels around a point; the point's coordinates are integers at voxel centres. Bit x + 2 y + 4 z is the
/// voxel offset by (x, y, z).
struct VoxelsAround {
  IVec3 low{0};
  std::array<float, 8> nearness{};

  explicit VoxelsAround(DVec3 point) : low(voxel_of(point)) {
    for (std::size_t i = 0; i < 8; ++i) {
      double share = 1.0;
      for (int axis = 0; axis < 3; ++axis) {
        const double up = point[axis] - low[axis];
        share *= (i >> axis & 1U) != 0 ? up : 1.0 - up;
      }
      nearness[i] = static_cast<float>(share);
    }
  }
  [[nodiscard]] IVec3 voxel(std::size_t i) const {
    return low + IVec3(static_cast<int>(i & 1U), static_cast<int>(i >> 1 & 1U), static_cast<int>(i >> 2 & 1U));
  }
};

/// Returns the voxels of the eight that are reachable from `one` through faces within `passing`.
[[nodiscard]] constexpr std::uint32_t connected_of_eight(std::uint32_t one, std::uint32_t passing) {
  QUOIN_ASSERT(passing < 256 && (one & ~passing) == 0, "some of the eight voxels");
  for (;;) {
    const std::uint32_t moved = (one & 0x55U) << 1 | (one & 0xAAU) >> 1 | (one & 0x33U) << 2 | (one & 0xCCU) >> 2 |
                                (one & 0x0FU) << 4 | (one & 0xF0U) >> 4;
    const std::uint32_t more = (one | moved) & passing;
    if (more == one) return one;
    one = more;
  }
}

/// Computes the light at a point in front of a surface. Returns false if all eight voxels around are opaque. If the
/// point is the centre of an opaque voxel, or between the centres of several, voxels that pass light have equal shares.
template <class Voxels>
[[nodiscard]] bool light_around(Voxels& voxels, DVec3 point, MeanLevels& out) {
  VoxelsAround around(point);
  std::uint32_t passing = 0;
  std::size_t nearest = 8;
  for (std::size_t i = 0; i < 8; ++i) {
    if (!voxels.passes(around.voxel(i))) continue;
    passing |= 1U << i;
    if (nearest == 8 || around.nearness[i] > around.nearness[nearest]) nearest = i;
  }
  if (nearest == 8) return false;
  if (around.nearness[nearest] == 0.0F) around.nearness.fill(1.0F);
  const std::uint32_t counted = connected_of_eight(1U << nearest, passing);
  std::array<float, 4> sum{};
  float all = 0.0F;
  for (std::size_t i = 0; i < 8; ++i) {
    if ((counted >> i & 1U) == 0) continue;
    const std::uint32_t levels = level_bytes(voxels.word(around.voxel(i)));
    for (std::size_t c = 0; c < 4; ++c) sum[c] += around.nearness[i] * static_cast<float>(levels >> 8 * c & 255U);
    all += around.nearness[i];
  }
  out = {sum[0] / all, sum[1] / all, sum[2] / all, sum[3] / all};
  return true;
}

/// Returns the light of a surface at a point with a unit normal; `step` is the size of its samples in level 0 samples.
/// Dark if no air is near.
template <class Voxels>
[[nodiscard]] MeanLevels light_before(Voxels& voxels, DVec3 point, Vec3 normal, int step) {
  MeanLevels levels;
  const DVec3 in_front = point + 0.5 * step * DVec3(normal);
  if (!light_around(voxels, in_front, levels)) static_cast<void>(light_around(voxels, point, levels));
  return levels;
}

/// Reads the light of voxels and their light-passing masks in rows of 64 along x. Each row has one slot in the cache.
/// Lifetime: `light`, `grid` and `types` must outlive it unchanged.
class LightRows {
 public:
  LightRows(const PropagatedLight& light, const Grid& grid, const VoxelRegistry& types)
      : light_(&light), grid_(&grid), types_(&types), rows_(kRows) {}

  struct Row {
    IVec3 at{0};  // x in chunks
    bool is_known = false;
    std::uint64_t passing = 0;
    std::array<std::uint16_t, kChunkEdge> words{};
  };

  /// Returns the row of a voxel. Lifetime: until the next call.
  [[nodiscard]] const Row& row_of(IVec3 voxel) {
    const IVec3 at{voxel.x >> kChunkShift, voxel.y, voxel.z};
    Row& row = rows_[place_of(at)];
    if (!row.is_known || row.at != at) look_up(voxel, at, row);
    return row;
  }
  [[nodiscard]] std::uint16_t word(IVec3 voxel) { return row_of(voxel).words[index_of(voxel)]; }
  [[nodiscard]] bool passes(IVec3 voxel) { return (row_of(voxel).passing >> index_of(voxel) & 1U) != 0; }
  [[nodiscard]] FrontLight front(IVec3 voxel) {
    const Row& row = row_of(voxel);
    if ((row.passing >> index_of(voxel) & 1U) == 0) return {};
    return {level_bytes(row.words[index_of(voxel)]), true};
  }

 private:
  static constexpr std::size_t kRows = 8'192;  // the rows of two neighbouring chunks

  [[nodiscard]] static std::size_t place_of(IVec3 at) {
    return static_cast<std::size_t>((at.y & 63) | (at.z & 63) << 6 | (at.x & 1) << 12);
  }
  [[nodiscard]] static std::size_t index_of(IVec3 voxel) {
    return static_cast<std::size_t>(voxel.x & (kChunkEdge - 1));
  }
  void look_up(IVec3 voxel, IVec3 at, Row& row) const {
    row.at = at;
    row.is_known = true;
    light_->read_row(voxel, row.words);
    row.passing = ~std::uint64_t{0};
    const Chunk* chunk = grid_->find_chunk(chunk_of(voxel));
    if (chunk == nullptr) return;
    std::array<VoxelType, kChunkEdge> held;
    const IVec3 local = local_of(voxel);
    chunk->read_row(local.y, local.z, held);
    for (std::size_t x = 0; x < held.size(); ++x) row.passing &= ~(std::uint64_t{types_->is_opaque(held[x])} << x);
  }

  const PropagatedLight* light_;
  const Grid* grid_;
  const VoxelRegistry* types_;
  BlockVector<Row> rows_;
};

}  // namespace quoin
