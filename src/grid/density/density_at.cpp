#include <cmath>

#include "grid/density/density_grid_impl.h"
#include "grid/density/trilinear.h"

namespace quoin {
namespace {

/// A cell between samples and a point in it.
struct Cell {
  IVec3 low{0};
  DVec3 fraction{0.0};

  /// Returns whether all corners have int32 coordinates; NaN has none.
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
  const IVec3 local = local_of(low);
  const bool is_in_one_chunk = local.x < kChunkEdge - 1 && local.y < kChunkEdge - 1 && local.z < kChunkEdge - 1;
  const DensityStore::Entry* entry = is_in_one_chunk ? store.find(chunk_of(low)) : nullptr;
  for (int i = 0; i < 8; ++i) {
    const IVec3 offset{i & 1, i >> 1 & 1, i >> 2};
    const IVec3 p = local + offset;
    const Half half = !is_in_one_chunk   ? store.get(low + offset)
                      : entry == nullptr ? store.far()
                                         : entry->samples.get(p.x, p.y, p.z);
    corners[static_cast<std::size_t>(i)] = float_from_half(half);
  }
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
