#include <cmath>

#include "core/trilinear.h"
#include "grid/density/cell_corners.h"
#include "grid/density/density_grid_impl.h"

namespace quoin {
namespace {

/// A cell between samples and a point in it.
struct Cell {
  IVec3 low{0};
  DVec3 fraction{0.0};

  /// Returns true if all corners have int32 coordinates; false for NaN.
  bool locate(DVec3 point) {
    constexpr double kLow = -2'147'483'648.0;
    constexpr double kHigh = 2'147'483'647.0;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(point[axis] >= kLow && point[axis] < kHigh)) return false;
      const double whole = std::floor(point[axis]);
      low[axis] = static_cast<int>(whole);
      fraction[axis] = point[axis] - whole;
    }
    return true;
  }
};

CellCorners corners_of(const DensityStore& store, IVec3 low) {
  CellCorners corners{};
  const auto find_chunk = [&](IVec3 chunk) {
    const DensityStore::Entry* const entry = store.find(chunk);
    return entry == nullptr ? nullptr : &entry->samples;
  };
  read_cell_corners(
      low, 1, find_chunk, [&] { return store.band(); }, corners.data());
  return corners;
}

}  // namespace

float DensityGrid::density_at(DVec3 point) const {
  Cell cell;
  if (!cell.locate(point)) return band();
  return static_cast<float>(trilinear(corners_of(impl_->store, cell.low), cell.fraction));
}

DVec3 DensityGrid::gradient_at(DVec3 point) const {
  Cell cell;
  if (!cell.locate(point)) return DVec3(0.0);
  return trilinear_gradient(corners_of(impl_->store, cell.low), cell.fraction);
}

}  // namespace quoin
