// The kernel for rays in density fields. Without lanes it is empty, and its source has the walk of one ray from cell to
// cell by the planes that it crosses, for processors without the kernels' instructions and for rays that the kernels do
// not support. The walk steps only through short empty stretches, since it is slow there. The tree crosses longer ones.
//
//      tree                     planes               planes, cells without solid            tree
//   o--------->|  s  |  s  |  s  |     |     |     |   find the next cell with solid        ------->|  s  |
//      empty    look, meet_cell, step      up to kMaxEmptySteps                       empty
//
// An `s` is a cell with a solid corner. In each of them, meet_cell solves the field's cubic along the ray, from the
// ray's entry into the cell to its exit (span_).

#include "trace/kernel/ray_kernel.h"

#ifdef QUOIN_KERNEL_AVX2

#include "trace/kernel/field.inl"

namespace quoin::trace {

constinit const FieldKernel QUOIN_KERNEL(FieldKernel) = {first_in_field<true>, first_in_field<false>,
                                                         first_hits_in_field, any_hits_in_field};

}  // namespace quoin::trace

#else

#include <optional>

#include "trace/kernel/cell_cubic.inl"
#include "trace/tree_view.h"

namespace quoin::trace {
namespace {

// The maximum number of single steps through empty cells before the tree finds the next cell with solid.
constexpr int kMaxEmptySteps = 3;
// The minimum interval of t in a cell for a new tree search, which starts in the middle of the interval.
constexpr double kLeastSpan = 1e-6;

// Asks a tree of cells that lie near each other.
class NearbyCells {
 public:
  explicit NearbyCells(const OccupancyTree& tree) : nodes_(tree) {}

  [[nodiscard]] bool is_occupied(IVec3 cell) {
    const IVec3 brick = cell >> 4;
    if (brick != brick_ || !knows_) {
      brick_ = brick;
      knows_ = true;
      const ChunkNode* const chunk = nodes_.find_chunk(cell >> kChunkShift);
      const auto index = static_cast<std::size_t>((brick.x & 3) + 4 * (brick.y & 3) + 16 * (brick.z & 3));
      words_.reset();
      if (chunk != nullptr) words_ = nodes_.brick(chunk->bricks[index]);
    }
    if (!words_) return false;
    const auto word = static_cast<std::size_t>((cell.x >> 2 & 3) + 4 * (cell.y >> 2 & 3) + 16 * (cell.z >> 2 & 3));
    return ((*words_)[word] >> ((cell.x & 3) + 4 * (cell.y & 3) + 16 * (cell.z & 3)) & 1U) != 0;
  }

 private:
  TreeNodes nodes_;
  IVec3 brick_{0};
  bool knows_ = false;
  std::optional<BrickWords> words_;
};

// A ray's walk from cell to cell at a field's surface, for processors without the kernels' instructions and for
// rays that the kernels do not support.
template <bool kAsksWhere>
class SurfaceWalk {
 public:
  SurfaceWalk(const OccupancyTree& tree, const FieldView& field, const Ray& ray, double max_t)
      : tree_(tree), field_(field), cells_(tree), ray_(ray), in_cells_(cell_ray(ray, max_t)) {}

  std::optional<FieldHit> find() {
    std::optional<RayHit> next = first_hit(tree_, ray_, in_cells_.max_t);
    while (next) {
      cell_ = next->voxel;
      do {
        look();
        FieldHit hit{0.0, cell_.x, cell_.y, cell_.z, {}};
        field_.read(*field_.grid, cell_.x, cell_.y, cell_.z, hit.corners);
        hit.t = meet_cell<kAsksWhere>(in_cells_, at_, span_, hit.corners);
        if (hit.t >= 0.0) return hit;
        if (!step()) return std::nullopt;
      } while (cells_.is_occupied(cell_));
      next = find_next_cell();
    }
    return std::nullopt;
  }

 private:
  void look() {
    for (int axis = 0; axis < 3; ++axis) at_[axis] = cell_[axis];
    span_ = span_in(in_cells_, at_);
  }

  // Moves to the next cell through the plane that is crossed first. Returns false if that is beyond the end.
  bool step() {
    if (span_.t_out > in_cells_.max_t) return false;
    int axis = -1;
    double least = 0.0;
    for (int other = 0; other < 3; ++other) {
      const double d = in_cells_.direction[other];
      if (d == 0.0) continue;
      const double t = (cell_[other] + (d > 0.0 ? 1.0 : 0.0) - ray_.origin[other]) * in_cells_.inverse[other];
      if (axis < 0 || t < least) {
        axis = other;
        least = t;
      }
    }
    if (axis < 0) return false;  // too slow along every axis
    cell_[axis] += in_cells_.direction[axis] > 0.0 ? 1 : -1;
    return true;
  }

  // Moves from a cell that touches no solid to the next cell that does.
  std::optional<RayHit> find_next_cell() {
    for (int steps = 0;; ++steps) {
      look();
      if (steps >= kMaxEmptySteps && span_.t_out - span_.t_in >= kLeastSpan) break;
      if (!step()) return std::nullopt;
      if (cells_.is_occupied(cell_)) return RayHit{cell_};
    }
    const double from = span_.t_in + 0.5 * (span_.t_out - span_.t_in);
    if (from > in_cells_.max_t) return std::nullopt;
    return first_hit(tree_, {ray_.origin + ray_.direction * from, ray_.direction}, in_cells_.max_t - from);
  }

  const OccupancyTree& tree_;
  const FieldView& field_;
  NearbyCells cells_;
  Ray ray_;
  CellRay in_cells_;
  IVec3 cell_{0};
  double at_[3] = {};  // the cell again
  CellSpan<double> span_{};
};

}  // namespace

bool walk_in_field(const OccupancyTree& cells, const FieldView& field, const Ray& ray, double max_t, bool asks_where,
                   FieldHit& hit) {
  const std::optional<FieldHit> found = asks_where ? SurfaceWalk<true>(cells, field, ray, max_t).find()
                                                   : SurfaceWalk<false>(cells, field, ray, max_t).find();
  if (found) hit = *found;
  return found.has_value();
}

constinit const FieldKernel kPlainFieldKernel = {nullptr, nullptr, nullptr, nullptr};

constinit const KernelTable<FieldKernel> kFieldKernels = QUOIN_KERNEL_TABLE(FieldKernel, Avx512);

}  // namespace quoin::trace

#endif
