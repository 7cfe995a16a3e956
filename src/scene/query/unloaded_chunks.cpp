#include "scene/query/unloaded_chunks.h"

namespace quoin {
namespace {

// Walks along a ray from chunk to chunk, in double precision. Each crossing distance is computed from the origin.
class ChunkWalk {
 public:
  ChunkWalk(const Ray& ray, const IBox& box) : ray_(ray), box_(box) {}

  // Moves to the entry of the ray into the box. Returns false if it misses the box, or enters it beyond `max_t`.
  bool enter(double max_t) {
    if (box_.empty()) return false;
    double exit_t = max_t;
    for (int axis = 0; axis < 3; ++axis) {
      const double o = ray_.origin[axis];
      const double d = ray_.direction[axis];
      const double low = box_.min[axis];
      const double high = box_.max[axis];
      if (d == 0.0) {
        if (o < low || o >= high) return false;
        continue;
      }
      if (d > 0.0 ? o < low : o >= high) {
        const double t = ((d > 0.0 ? low : high) - o) / d;
        if (t >= t_) {
          t_ = t;
          axis_ = axis;
        }
      }
      exit_t = std::min(exit_t, ((d > 0.0 ? high : low) - o) / d);
    }
    if (!(t_ <= exit_t)) return false;
    for (int axis = 0; axis < 3; ++axis) {
      const double at = ray_.origin[axis] + t_ * ray_.direction[axis];
      chunk_[axis] = static_cast<int>(std::clamp(std::floor(at), double(box_.min[axis]), double(box_.max[axis]) - 1.0));
      if (axis == axis_) chunk_[axis] = ray_.direction[axis] > 0.0 ? box_.min[axis] : box_.max[axis] - 1;
      find_next(axis);
    }
    return true;
  }
  // Moves to the next chunk. Returns false if the ray leaves the box or passes `max_t`.
  bool step(double max_t) {
    axis_ = 0;
    for (int axis = 1; axis < 3; ++axis) {
      if (next_[axis] < next_[axis_]) axis_ = axis;
    }
    t_ = next_[axis_];
    if (!(t_ <= max_t) || std::isinf(t_)) return false;
    chunk_[axis_] += ray_.direction[axis_] > 0.0 ? 1 : -1;
    find_next(axis_);
    return box_.contains(chunk_);
  }

  [[nodiscard]] IVec3 chunk() const { return chunk_; }
  [[nodiscard]] RayHit hit() const {
    if (axis_ < 0) return {chunk_, nearest_direction(-ray_.direction), 0.0, true};
    DVec3 normal(0.0);
    normal[axis_] = ray_.direction[axis_] > 0.0 ? -1.0 : 1.0;
    return {chunk_, nearest_direction(normal), t_, false};
  }

 private:
  void find_next(int axis) {
    const double d = ray_.direction[axis];
    const double plane = static_cast<double>(chunk_[axis]) + (d > 0.0 ? 1.0 : 0.0);
    // Rounding may move a start past the plane that it has not crossed.
    next_[axis] = d == 0.0 ? std::numeric_limits<double>::infinity() : std::max((plane - ray_.origin[axis]) / d, t_);
  }

  const Ray& ray_;
  IBox box_;
  double t_ = 0.0;
  int axis_ = -1;  // of the last crossed plane
  IVec3 chunk_{0};
  DVec3 next_{0.0};
};

}  // namespace

std::optional<RayHit> first_unloaded(const SceneGrid& grid, const Ray& ray_in_chunks, double max_t) {
  const IBox extent = extent_of(grid);
  std::optional<RayHit> first;
  for_each_corner(grid, [&](DVec3 offset, const UnloadedReader& reader) {
    const Ray ray{ray_in_chunks.origin + offset, ray_in_chunks.direction};
    const double most = first ? first->t : max_t;
    ChunkWalk walk(ray, extent);
    if (!walk.enter(most)) return;
    do {
      if (reader.get(walk.chunk()) == kAir) continue;
      const RayHit hit = walk.hit();
      if (!first || hit.t < first->t || (hit.starts_inside && !first->starts_inside)) first = hit;
      return;
    } while (walk.step(most));
  });
  return first;
}

}  // namespace quoin
