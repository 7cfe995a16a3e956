#include <quoin/trace/density_ray.h>

#include <bit>
#include <cmath>

#include "trace/density/cell_reader.h"
#include "trace/density/cell_root.h"

namespace quoin {
namespace {

using trace::CellAsk, trace::CellCorners, trace::CellCubic;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// How many empty cells are stepped through one by one before the tree is asked for the next one that is not.
constexpr int kMaxEmptySteps = 3;
// A ray is asked about anew from the middle of a cell that it passes for at least this, in t.
constexpr double kLeastSpan = 1e-6;

// A ray's way from cell to cell at a field's surface.
class SurfaceWalk {
 public:
  SurfaceWalk(const DensityTree& tree, const Ray& ray, double max_t)
      : tree_(tree), reader_(tree.field()), cells_(tree.cells()), ray_(ray), max_t_(max_t) {
    for (int axis = 0; axis < 3; ++axis) {
      inverse_[axis] = ray.direction[axis] != 0.0 ? 1.0 / ray.direction[axis] : 0.0;
    }
  }

  // From the first cell that touches the solid.
  template <CellAsk kAsk>
  std::optional<DensityHit> find(const RayHit& first) {
    enter(first);
    for (;;) {
      for (bool is_occupied = true; is_occupied; is_occupied = cells_.is_occupied(cell_)) {
        leave();
        if (auto hit = meet<kAsk>()) return hit;
        if (!step()) return std::nullopt;
      }
      if (!find_next_cell()) return std::nullopt;
    }
  }

 private:
  void enter(const RayHit& hit) {
    cell_ = hit.voxel;
    if (hit.starts_inside) return;
    const int axis = static_cast<int>(hit.face) / 2;
    t_in_ = plane_t(axis, cell_[axis] + (ray_.direction[axis] > 0.0 ? 0 : 1));
  }
  [[nodiscard]] double plane_t(int axis, int plane) const {
    return (static_cast<double>(plane) - ray_.origin[axis]) * inverse_[axis];
  }
  // Finds where the ray leaves its cell.
  void leave() {
    t_out_ = kInfinity;
    for (int axis = 0; axis < 3; ++axis) {
      const double d = ray_.direction[axis];
      if (d == 0.0) continue;
      const double t = plane_t(axis, cell_[axis] + (d > 0.0 ? 1 : 0));
      if (t < t_out_) {
        t_out_ = t;
        axis_ = axis;
      }
    }
    // Rounding may have it leave before it came.
    t_out_ = std::max(t_out_, t_in_);
  }
  // Into the next cell; false when that lies beyond the end.
  bool step() {
    if (t_out_ > max_t_) return false;
    cell_[axis_] += ray_.direction[axis_] > 0.0 ? 1 : -1;
    t_in_ = t_out_;
    return true;
  }

  template <CellAsk kAsk>
  std::optional<DensityHit> meet() {
    const CellCorners corners = reader_.corners(cell_);
    const double span = std::min(t_out_, max_t_) - t_in_;
    const DVec3 entry = glm::clamp(ray_.origin + ray_.direction * t_in_ - DVec3(cell_), 0.0, 1.0);
    const DVec3 way = ray_.direction * span;
    const double s = trace::first_negative<kAsk>(trace::cubic_of(corners, entry, way));
    if (s < 0.0) return std::nullopt;
    DensityHit hit;
    if (kAsk == CellAsk::Whether) return hit;
    hit.t = t_in_ + s * span;
    hit.starts_inside = hit.t == 0.0 && s == 0.0;
    hit.cell = cell_;
    describe(corners, glm::clamp(entry + way * s, 0.0, 1.0), hit);
    return hit;
  }

  void describe(const CellCorners& corners, const DVec3& at, DensityHit& hit) const {
    const DVec3 gradient = trace::gradient_of(corners, at);
    const double length = glm::length(gradient);
    if (length > 0.0) hit.normal = gradient / length;
    double least = kInfinity;
    IVec3 nearest{0};
    for (int i = 0; i < 8; ++i) {
      if (!(corners[static_cast<std::size_t>(i)] < 0.0F)) continue;
      const IVec3 corner{i & 1, i >> 1 & 1, i >> 2};
      const DVec3 away = DVec3(corner) - at;
      const double square = glm::dot(away, away);
      if (square < least) {
        least = square;
        nearest = corner;
      }
    }
    hit.material = reader_.material(cell_ + nearest);
  }

  // Goes on from a cell that touches no solid to the next that does; false where there is none.
  bool find_next_cell() {
    for (int steps = 0;; ++steps) {
      leave();
      if (steps >= kMaxEmptySteps && t_out_ - t_in_ >= kLeastSpan) break;
      if (!step()) return false;
      if (cells_.is_occupied(cell_)) return true;
    }
    const double from = t_in_ + 0.5 * (t_out_ - t_in_);
    if (from > max_t_) return false;
    const Ray rest{ray_.origin + ray_.direction * from, ray_.direction};
    const std::optional<RayHit> hit = first_hit(tree_.cells(), rest, max_t_ - from);
    if (!hit) return false;
    enter(*hit);
    if (hit->starts_inside) t_in_ = from;
    return t_in_ <= max_t_;
  }

  const DensityTree& tree_;
  trace::CellReader reader_;
  trace::NearbyCells cells_;
  Ray ray_;
  double max_t_;
  double inverse_[3] = {};
  IVec3 cell_{0};
  double t_in_ = 0.0;
  double t_out_ = 0.0;
  int axis_ = 0;
};

}  // namespace

std::optional<DensityHit> first_hit(const DensityTree& tree, const Ray& ray, double max_t) {
  const std::optional<RayHit> cell = first_hit(tree.cells(), ray, max_t);
  if (!cell) return std::nullopt;
  return SurfaceWalk(tree, ray, max_t).find<CellAsk::Where>(*cell);
}

bool any_hit(const DensityTree& tree, const Ray& ray, double max_t) {
  const std::optional<RayHit> cell = first_hit(tree.cells(), ray, max_t);
  return cell && SurfaceWalk(tree, ray, max_t).find<CellAsk::Whether>(*cell);
}

void first_hits(const DensityTree& tree, const RayPacket& rays, DensityPacketHits& hits) {
  PacketHits cells;
  first_hits(tree.cells(), rays, cells);
  hits.hit = 0;
  for (std::uint32_t left = cells.hit; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const auto i = static_cast<std::size_t>(lane);
    const auto hit = SurfaceWalk(tree, rays.ray(lane), rays.max_t[i]).find<CellAsk::Where>(cells[lane]);
    if (!hit) continue;
    hits.hit |= 1U << lane;
    hits.lanes[i] = *hit;
  }
}

std::uint32_t any_hits(const DensityTree& tree, const RayPacket& rays) {
  PacketHits cells;
  first_hits(tree.cells(), rays, cells);
  std::uint32_t blocked = 0;
  for (std::uint32_t left = cells.hit; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const auto i = static_cast<std::size_t>(lane);
    const bool is_hit =
        SurfaceWalk(tree, rays.ray(lane), rays.max_t[i]).find<CellAsk::Whether>(cells[lane]).has_value();
    blocked |= std::uint32_t{is_hit} << lane;
  }
  return blocked;
}

}  // namespace quoin
