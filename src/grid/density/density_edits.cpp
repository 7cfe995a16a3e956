#include <algorithm>
#include <cmath>

#include <quoin/core/assert.h>

#include "grid/density/density_grid_impl.h"
#include "grid/density/density_shapes.h"

namespace quoin {
namespace {

// Distances from the middle of a chunk's samples, and of a row's, to the farthest sample.
constexpr double kMiddle = 0.5 * (kChunkEdge - 1);
constexpr double kChunkRadius = 54.6;
constexpr double kRowRadius = kMiddle;

/// Returns the minimum of two distances. If they differ by less than `blend`, a parabola joins both smoothly.
///
/// Densities end at the band: a value of `band` may be anything larger, so the blend narrows to 0 towards it.
/// Source: I. Quilez, "smooth minimum": min(a, b) - h^2 / (4 k), h = max(k - |a - b|, 0).
double united(double a, double b, double blend, double band) {
  const double width = std::min(blend, band - std::max(a, b));
  if (!(width > 0.0)) return std::min(a, b);
  const double overlap = std::max(width - std::abs(a - b), 0.0);
  return std::min(a, b) - overlap * overlap / (4.0 * width);
}

bool is_length(double value) {
  return value >= 0.0 && std::isfinite(value);
}

// Sets the densities of part of a row to `combine(density, distance to the shape)`. Samples that become solid get
// `material`.
template <class Shape, class Combine>
void combine_row(const Shape& shape, IVec3 start, int first, int end, VoxelType material, SampleRow& row,
                 Combine&& combine) {
  QUOIN_ASSERT(first >= 0 && first <= end && end <= kChunkEdge, "0 <= first <= end <= 64");
  for (int x = first; x < end; ++x) {
    const auto i = static_cast<std::size_t>(x);
    const float before = row.densities[i];
    const double distance = shape.distance(DVec3(start) + DVec3{static_cast<double>(x), 0.0, 0.0});
    row.densities[i] = static_cast<float>(combine(double{before}, distance));
    if (!(before < 0.0F) && row.densities[i] < 0.0F) row.materials[i] = material;
  }
}

// Applies `combine` wherever the shape's distance is below the band; elsewhere it must leave densities as they are.
template <class Shape, class Combine>
std::int64_t apply_shape(DensityStore& store, const Shape& shape, bool adds, VoxelType material,
                         const Progress& progress, Combine&& combine) {
  const double band = store.band();
  const auto choose = [&](IVec3 chunk) {
    const double distance = shape.distance(DVec3(chunk) * double{kChunkEdge} + kMiddle);
    if (distance - kChunkRadius >= band) return ChunkEdit::Nothing;
    return adds && distance + kChunkRadius <= -band ? ChunkEdit::Solid : ChunkEdit::Rows;
  };
  const auto change = [&](IVec3 start, int first, int end, SampleRow& row) {
    if (shape.distance(DVec3(start) + DVec3{kMiddle, 0.0, 0.0}) - kRowRadius >= band) return false;
    combine_row(shape, start, first, end, material, row, combine);
    return true;
  };
  return store.edit(box_around(shape.min() - band, shape.max() + band), adds, material, choose, change, progress);
}

template <class Shape>
std::int64_t add_shape(DensityStore& store, const Shape& shape, VoxelType material, double blend,
                       const Progress& progress) {
  if (!shape.is_sound() || !is_length(blend)) return 0;
  return apply_shape(store, shape, true, material, progress,
                     [&](double a, double b) { return united(a, b, blend, store.band()); });
}

template <class Shape>
std::int64_t remove_shape(DensityStore& store, const Shape& shape, double blend) {
  if (!shape.is_sound() || !is_length(blend)) return 0;
  return apply_shape(store, shape, false, kAir, {},
                     [&](double a, double b) { return -united(-a, b, blend, store.band()); });
}

}  // namespace

bool DensityGrid::set(IVec3 sample, DensitySample value) {
  const auto replace = [&](IVec3 start, int, int, SampleRow& row) {
    const auto i = static_cast<std::size_t>(sample.x - start.x);
    row.densities[i] = value.density;
    row.materials[i] = value.material;
    return true;
  };
  const auto rows = [](IVec3) { return ChunkEdit::Rows; };
  const NoticeOfEdits notice(impl_->store, notice_);
  return impl_->store.edit(box_from(sample, sample), true, kAir, rows, replace, {}) != 0;
}

std::int64_t DensityGrid::edit_rows(
    const IBox& box, FunctionRef<void(IVec3 first, std::span<float> densities, std::span<VoxelType> materials)> change,
    const Progress& progress) {
  const auto change_part = [&](IVec3 start, int first, int end, SampleRow& row) {
    const auto from = static_cast<std::size_t>(first);
    const auto count = static_cast<std::size_t>(end - first);
    change(start + IVec3{first, 0, 0}, std::span(row.densities).subspan(from, count),
           std::span(row.materials).subspan(from, count));
    return true;
  };
  const auto rows = [](IVec3) { return ChunkEdit::Rows; };
  const NoticeOfEdits notice(impl().store, notice_);
  return impl().store.edit(box_from(box), true, kAir, rows, change_part, progress);
}

std::int64_t DensityGrid::add_sphere(DVec3 centre, double radius, VoxelType material, double blend,
                                     const Progress& progress) {
  const NoticeOfEdits notice(impl().store, notice_);
  return add_shape(impl().store, Sphere(centre, radius), material, blend, progress);
}

std::int64_t DensityGrid::remove_sphere(DVec3 centre, double radius, double blend) {
  const NoticeOfEdits notice(impl().store, notice_);
  return remove_shape(impl().store, Sphere(centre, radius), blend);
}

std::int64_t DensityGrid::add_box(DVec3 min, DVec3 max, VoxelType material, double rounding, double blend,
                                  const Progress& progress) {
  const NoticeOfEdits notice(impl().store, notice_);
  return add_shape(impl().store, RoundedBox(min, max, rounding), material, blend, progress);
}

std::int64_t DensityGrid::remove_box(DVec3 min, DVec3 max, double rounding, double blend) {
  const NoticeOfEdits notice(impl().store, notice_);
  return remove_shape(impl().store, RoundedBox(min, max, rounding), blend);
}

std::int64_t DensityGrid::flatten(DVec3 centre, double radius, const FlattenOptions& options,
                                  const Progress& progress) {
  const Brush brush(centre, radius, options.strength);
  const Plane plane(options.point, options.normal);
  if (!brush.is_sound() || !plane.is_sound()) return 0;
  const NoticeOfEdits notice(impl().store, notice_);
  DensityStore& store = impl().store;
  const double band = store.band();
  const auto choose = [&](IVec3 chunk) {
    const DVec3 middle = DVec3(chunk) * double{kChunkEdge} + kMiddle;
    if (brush.sphere().distance(middle) >= kChunkRadius) return ChunkEdit::Nothing;
    const bool stays_air = plane.distance(middle) - kChunkRadius >= band && store.find(chunk) == nullptr;
    return stays_air ? ChunkEdit::Nothing : ChunkEdit::Rows;
  };
  const auto change = [&](IVec3 start, int first, int end, SampleRow& row) {
    for (int x = first; x < end; ++x) {
      const DVec3 at = DVec3(start) + DVec3{static_cast<double>(x), 0.0, 0.0};
      const double weight = brush.weight(at);
      if (weight == 0.0) continue;
      float& density = row.densities[static_cast<std::size_t>(x)];
      const double wanted = std::clamp(plane.distance(at), -band, band);
      const auto moved = static_cast<float>(density + weight * (wanted - density));
      if (!(density < 0.0F) && moved < 0.0F) row.materials[static_cast<std::size_t>(x)] = options.material;
      density = moved;
    }
    return true;
  };
  return store.edit(box_around(brush.sphere().min(), brush.sphere().max()), true, options.material, choose, change,
                    progress);
}

}  // namespace quoin
