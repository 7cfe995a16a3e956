#pragma once

// A part of a cell of a field, and how far its solid can reach.
//
//   cell: eight samples   piece: a box within it,     its solid lies below the plane
//   +--------+            with eight corners again     \ |     |   field >= level + slope * (p - middle)
//   |   __/  |            +---+                         \|     |
//   |  /solid|            |  /|                          \ air |   which is `doubt` below the field's best plane:
//   +--------+            +---+                           \----+   a quarter of it when the piece is half as large
//
// Trilinear over any such box, the field is least at a corner: a piece with no corner below 0 has no solid.

#include <array>
#include <cmath>
#include <cstddef>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>

#include "core/trilinear.h"

namespace quoin {

/// Lengths are in voxels of the grid, positions relative to the cell's least sample.
struct FieldPiece {
  IVec3 cell{0};
  DVec3 middle{0.5};
  DVec3 half{0.5};  ///< size; positive
  CellCorners corners{};
  // Set by `measure`:
  DVec3 slope{0.0};
  DVec3 rise{0.0};  ///< slope * half
  double square_of_slope = 0.0;
  double level = 0.0;
  double doubt = 0.0;
  DVec3 twist{0.0};  ///< each axis's contribution to the doubt
  // Set by the search:
  double enter = 0.0;     ///< no contact with its solid before this time
  double slack = 0.0;     ///< contact is certain after this additional time, except for the doubt
  int axis = -1;          ///< the shape's direction that separates it until then; -1: none
  bool is_exact = false;  ///< all directions were tested, not only the first few

  [[nodiscard]] bool has_solid() const {
    double least = corners[0];
    for (const double corner : corners) least = std::min(least, corner);
    return least < 0.0;
  }

  [[nodiscard]] double density(const DVec3& point) const {
    return trilinear(corners, (point - middle) / (2.0 * half) + 0.5);
  }
  /// Returns the gradient in density units per voxel.
  [[nodiscard]] DVec3 gradient(const DVec3& point) const {
    return trilinear_gradient(corners, (point - middle) / (2.0 * half) + 0.5) / (2.0 * half);
  }

  /// The plane: the corners as sums of the products of the axes' signs.
  void measure() {
    const CellCorners& d = corners;
    const double a = d[0] + d[3] + d[5] + d[6];
    const double b = d[1] + d[2] + d[4] + d[7];
    rise = DVec3(d[1] + d[3] + d[5] + d[7] - d[0] - d[2] - d[4] - d[6],
                 d[2] + d[3] + d[6] + d[7] - d[0] - d[1] - d[4] - d[5],
                 d[4] + d[5] + d[6] + d[7] - d[0] - d[1] - d[2] - d[3]) *
           0.125;
    const double xy = std::abs(d[0] + d[3] + d[4] + d[7] - d[1] - d[2] - d[5] - d[6]) * 0.125;
    const double xz = std::abs(d[0] + d[2] + d[5] + d[7] - d[1] - d[3] - d[4] - d[6]) * 0.125;
    const double yz = std::abs(d[0] + d[1] + d[6] + d[7] - d[2] - d[3] - d[4] - d[5]) * 0.125;
    const double xyz = std::abs(b - a) * 0.125;
    doubt = xy + xz + yz + xyz;
    twist = {xy + xz + xyz, xy + yz + xyz, xz + yz + xyz};
    level = (a + b) * 0.125 - doubt;
    slope = rise / half;
    square_of_slope = glm::dot(slope, slope);
  }

  /// Leaves the part from `low` to `high`, which lie within it.
  void restrict_to(const DVec3& low, const DVec3& high) {
    QUOIN_ASSERT(low.x <= high.x && low.y <= high.y && low.z <= high.z, "low <= high");
    for (int axis_of_box = 0; axis_of_box < 3; ++axis_of_box) {
      const double first = middle[axis_of_box] - half[axis_of_box];
      const double f = (low[axis_of_box] - first) / (2.0 * half[axis_of_box]);
      const double g = (high[axis_of_box] - first) / (2.0 * half[axis_of_box]);
      const std::size_t bit = std::size_t{1} << axis_of_box;
      for (std::size_t i = 0; i < 8; ++i) {
        if ((i & bit) != 0) continue;
        const double from = corners[i];
        const double by = corners[i | bit] - from;
        corners[i] = from + f * by;
        corners[i | bit] = from + g * by;
      }
    }
    middle = 0.5 * (low + high);
    half = 0.5 * (high - low);
  }

  /// Bounds on the distance from the middle to its solid, along a direction and against it. They are conservative,
  /// since they use only the plane and the sides of the piece. `along_half` is direction * half, `along_slope`
  /// direction * slope.
  struct Extent {
    double ahead = 0.0;
    double behind = 0.0;
  };
  [[nodiscard]] Extent extent(const DVec3& along_half, double along_slope) const {
    const double whole = sum(along_half);
    if (along_slope == 0.0) return {whole, whole};
    const double cut = std::min(whole, below_plane(along_half, along_slope / square_of_slope));
    return along_slope > 0.0 ? Extent{cut, whole} : Extent{whole, cut};
  }
  /// The exact bounds.
  [[nodiscard]] Extent exact_extent(const DVec3& along_half) const {
    const double whole = sum(along_half);
    Extent extent{whole, whole};
    for (int i = 0; i < 3; ++i) {
      if (rise[i] == 0.0) continue;
      const double multiple = along_half[i] / rise[i];
      double& end = multiple > 0.0 ? extent.ahead : extent.behind;
      end = std::min(end, below_plane(along_half, multiple));
    }
    return extent;
  }

 private:
  static double sum(const DVec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); }
  // Subtracting a multiple of the slope from a direction gives the same bound for the solid below the plane, which ends
  // the solid along the slope. The best multiple makes one component 0.
  [[nodiscard]] double below_plane(const DVec3& along_half, double multiple) const {
    return sum(along_half - multiple * rise) - std::abs(multiple) * level;
  }
};

}  // namespace quoin
