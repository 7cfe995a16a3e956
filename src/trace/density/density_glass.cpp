#include "trace/density/density_glass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "core/trilinear.h"
#include "trace/kernel/cell_cubic.inl"
#include "trace/walk.h"

namespace quoin {
namespace {

using Corners = std::array<double, 8>;

IVec3 corner(std::size_t i) {
  return {static_cast<int>(i & 1U), static_cast<int>(i >> 1 & 1U), static_cast<int>(i >> 2)};
}

// A cell of a field, with the bodies of its corners.
struct BodiesInCell {
  static constexpr VoxelType kOpaque = 0xFFFF;  // not a valid type: kMaxVoxelTypes is less

  Corners densities{};
  std::array<VoxelType, 8> body{};         // kAir, kOpaque, or a transparent type
  std::array<VoxelType, 8> transparent{};  // the distinct transparent types, ascending
  std::size_t count = 0;
  bool has_air = false;
  bool has_opaque = false;

  // Returns true if the whole cell has one transparent material.
  [[nodiscard]] bool is_full() const { return !has_air && !has_opaque && count == 1; }

  void set(std::size_t i, double density, VoxelType material, const VoxelRegistry& types) {
    QUOIN_ASSERT(i < body.size(), "one of the eight corners");
    densities[i] = density;
    body[i] = !(density < 0.0) ? kAir : types.is_transparent(material) ? material : kOpaque;
    has_air |= body[i] == kAir;
    has_opaque |= body[i] == kOpaque;
    if (body[i] == kAir || body[i] == kOpaque) return;
    const auto end = transparent.begin() + static_cast<std::ptrdiff_t>(count);
    const auto place = std::lower_bound(transparent.begin(), end, body[i]);
    if (place != end && *place == body[i]) return;
    QUOIN_ASSERT(count < transparent.size(), "one type per corner");
    std::copy_backward(place, end, end + 1);
    *place = body[i];
    ++count;
  }

  // Returns the field of one body: solid samples of other bodies have their sign flipped.
  [[nodiscard]] Corners field_of(VoxelType of) const {
    Corners field = densities;
    for (std::size_t i = 0; i < 8; ++i) {
      if (body[i] != of) field[i] = std::abs(field[i]);
    }
    return field;
  }
};

// Reads cells near each other.
class CellReader {
 public:
  explicit CellReader(const DensityGlass& glass) : glass_(&glass) {}

  void read(IVec3 cell, BodiesInCell& out) {
    out = {};
    for (std::size_t i = 0; i < 8; ++i) {
      const IVec3 sample = cell + corner(i);
      const DensityChunk* const chunk = find(chunk_of(sample));
      if (chunk == nullptr) {
        out.set(i, glass_->field().density(sample), kAir, glass_->types());
        continue;
      }
      const IVec3 at = local_of(sample);
      const double density = float_from_half(chunk->get(at.x, at.y, at.z));
      out.set(i, density, density < 0.0 ? chunk->materials().get(at) : kAir, glass_->types());
    }
  }

 private:
  const DensityChunk* find(IVec3 chunk) {
    if (chunk != at_ || !knows_) {
      at_ = chunk;
      knows_ = true;
      chunk_ = glass_->field().find_chunk(chunk);
    }
    return chunk_;
  }

  const DensityGlass* glass_;
  const DensityChunk* chunk_ = nullptr;  // at `at_`
  IVec3 at_{0};
  bool knows_ = false;
};

// The sorted ends of spans, as parameters in [0, 1].
class Crossings {
 public:
  // Adds the sign changes of a cubic.
  void add(const trace::CellCubic<double>& f) {
    const double a = 3.0 * f.c3;
    const double b = 2.0 * f.c2;
    const double discriminant = b * b - 4.0 * a * f.c1;
    double low = 0.0;
    if (discriminant > 0.0) {
      // Avoids the difference of two nearly equal numbers.
      const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
      double extremes[2] = {q / a, f.c1 / q};
      if (!(extremes[0] <= extremes[1])) std::swap(extremes[0], extremes[1]);
      for (const double extreme : extremes) {
        if (!(extreme > low && extreme < 1.0)) continue;
        add_between(f, low, extreme);
        low = extreme;
      }
    }
    add_between(f, low, 1.0);
  }
  void add(double at) {
    QUOIN_ASSERT(count_ < kMost, "room for the maximum number of crossings");
    places_[count_++] = at;
  }
  void sort() { std::sort(places_.begin(), places_.begin() + static_cast<std::ptrdiff_t>(count_)); }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] double operator[](std::size_t i) const {
    QUOIN_ASSERT(i < count_, "one of the crossings");
    return places_[i];
  }

 private:
  // The whole field, the opaque field and each pair of eight types have up to three roots each, plus the two ends.
  static constexpr std::size_t kMost = 3 + 3 + 3 * 28 + 2;

  void add_between(const trace::CellCubic<double>& f, double low, double high) {
    const bool falls = f(high) < 0.0;
    if ((f(low) < 0.0) == falls) return;
    add(trace::root_between(falls ? f : trace::CellCubic<double>{-f.c0, -f.c1, -f.c2, -f.c3}, low, high));
  }

  std::array<double, kMost> places_{};
  std::size_t count_ = 0;
};

trace::CellCubic<double> operator-(const trace::CellCubic<double>& a, const trace::CellCubic<double>& b) {
  return {a.c0 - b.c0, a.c1 - b.c1, a.c2 - b.c2, a.c3 - b.c3};
}

// The spans of a ray in a cell, from 0 at its entry to 1 at its exit.
class RayInCell {
 public:
  RayInCell(const BodiesInCell& cell, const DVec3& entry, const DVec3& way)
      : cell_(&cell), solid_(cubic(cell.densities, entry, way)) {
    if (cell.has_opaque) opaque_ = cubic(cell.field_of(BodiesInCell::kOpaque), entry, way);
    if (cell.count < 2) return;
    for (std::size_t i = 0; i < cell.count; ++i) own_[i] = cubic(cell.field_of(cell.transparent[i]), entry, way);
  }

  [[nodiscard]] Crossings crossings() const {
    Crossings all;
    all.add(0.0);
    all.add(1.0);
    if (cell_->has_air) all.add(solid_);
    if (opaque_) all.add(*opaque_);
    for (std::size_t i = 0; i < (cell_->count < 2 ? 0 : cell_->count); ++i) {
      for (std::size_t k = 0; k < i; ++k) all.add(own_[i] - own_[k]);
    }
    all.sort();
    return all;
  }

  // Returns the transparent material at `s`, or kAir if there is none.
  [[nodiscard]] VoxelType at(double s) const {
    if (!(solid_(s) < 0.0) || (opaque_ && (*opaque_)(s) < 0.0)) return kAir;
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < cell_->count; ++i) {
      if (own_[i](s) < own_[nearest](s)) nearest = i;
    }
    return cell_->transparent[nearest];
  }

 private:
  static trace::CellCubic<double> cubic(const Corners& field, const DVec3& entry, const DVec3& way) {
    double corners[8];
    std::copy(field.begin(), field.end(), corners);
    const double from[3] = {entry.x, entry.y, entry.z};
    const double along[3] = {way.x, way.y, way.z};
    return trace::cubic_of(corners, from, along);
  }

  const BodiesInCell* cell_;
  trace::CellCubic<double> solid_;
  std::optional<trace::CellCubic<double>> opaque_;
  std::array<trace::CellCubic<double>, 8> own_{};  // of the cell's transparent materials, if there are several
};

// Visits the spans of one cell with several materials, where the ray is inside from `t_enter` to `t_exit`.
bool visit_cell(const BodiesInCell& cell, const Ray& ray, const trace::WalkSpan& span, double t_exit,
                FunctionRef<bool(const GlassSpan&)> visit) {
  const double length = t_exit - span.t_enter;
  QUOIN_ASSERT(length > 0.0, "a ray that crosses the cell");
  const DVec3 entry = glm::clamp(ray.origin + ray.direction * span.t_enter - DVec3(span.voxel), 0.0, 1.0);
  const RayInCell in_cell(cell, entry, ray.direction * length);
  const Crossings crossings = in_cell.crossings();
  // Ends at the cell's boundary use the distances of the neighbouring cells, bit for bit.
  const auto t_of = [&](double s) { return s <= 0.0 ? span.t_enter : s >= 1.0 ? t_exit : span.t_enter + s * length; };
  for (std::size_t i = 0; i + 1 < crossings.count();) {
    const double from = crossings[i];
    const VoxelType type = in_cell.at(0.5 * (from + crossings[i + 1]));
    ++i;
    while (i + 1 < crossings.count() && in_cell.at(0.5 * (crossings[i] + crossings[i + 1])) == type) ++i;
    if (type == kAir || !(crossings[i] > from)) continue;
    const bool starts_inside = span.starts_inside && from <= 0.0;
    if (!visit({span.voxel, type, t_of(from), t_of(crossings[i]), starts_inside})) return false;
  }
  return true;
}

DVec3 unit_or_zero(const DVec3& v) {
  const double length = glm::length(v);
  return length > 0.0 ? v / length : DVec3(0.0);
}

}  // namespace

DensityGlass::DensityGlass(const DensityGrid& field, const VoxelRegistry& types)
    : field_(&field), types_(types), cells_(OccupancyTree::build(field, types)) {}

void DensityGlass::update(const VoxelRegistry& types, const DensityChanges& changes) {
  types_ = types;
  cells_.update(*field_, types, changes);
}

void visit_glass(const DensityGlass& glass, const Ray& ray, double max_t, FunctionRef<double(VoxelType)> largest,
                 FunctionRef<bool(const GlassSpan&)> visit) {
  CellReader reader(glass);
  BodiesInCell cell;
  const auto enter = [&](const trace::WalkSpan& begun) { reader.read(begun.voxel, cell); };
  const auto largest_here = [&] { return cell.is_full() ? largest(cell.transparent[0]) : 1.0; };
  trace::visit_blocks(glass.cells(), ray, max_t, enter, largest_here, [&](const trace::WalkSpan& span) {
    const double t_exit = std::min(span.t_exit, max_t);
    if (!(t_exit > span.t_enter)) return true;  // the ray only touches an edge
    if (!cell.is_full()) return visit_cell(cell, ray, span, t_exit, visit);
    return visit({span.voxel, cell.transparent[0], span.t_enter, t_exit, span.starts_inside});
  });
}

DVec3 glass_normal(const DensityGlass& glass, IVec3 cell, const DVec3& point, VoxelType type, VoxelType other) {
  QUOIN_ASSERT(type != kAir, "a transparent material");
  if (other == kAir) {
    DensityHit hit;
    hit.normal = unit_or_zero(glass.field().gradient_at(point));
    return smooth_normal(glass.field(), point, hit);
  }
  BodiesInCell bodies;
  CellReader(glass).read(cell, bodies);
  const DVec3 at = glm::clamp(point - DVec3(cell), 0.0, 1.0);
  return unit_or_zero(trilinear_gradient(bodies.field_of(type), at) - trilinear_gradient(bodies.field_of(other), at));
}

}  // namespace quoin
