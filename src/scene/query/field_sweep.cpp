#include "scene/query/field_sweep.h"

#include <limits>

namespace quoin {

const DensityChunk* FieldCells::chunk_of_sample(IVec3 sample) {
  const IVec3 at = chunk_of(sample);
  if (!knows_chunk_ || at != chunk_at_) {
    chunk_ = field().find_chunk(at);
    chunk_at_ = at;
    knows_chunk_ = true;
  }
  return chunk_;
}

bool FieldCells::counts_at(IVec3 sample) {
  const DensityChunk* const chunk = chunk_of_sample(sample);
  if (chunk == nullptr) return false;
  const IVec3 local = local_of(sample);
  return types_.are_all() || types_.holds_solid(chunk->materials().get(local.x, local.y, local.z));
}

float FieldCells::density(IVec3 sample) {
  const DensityChunk* const chunk = chunk_of_sample(sample);
  const IVec3 local = local_of(sample);
  return chunk == nullptr ? field().band() : float_from_half(chunk->get(local.x, local.y, local.z));
}

bool FieldCells::read(IVec3 cell, CellCorners& corners) {
  if (!tree_.cells().is_occupied(cell)) return false;
  const IVec3 local = local_of(cell);
  const bool is_in_one_chunk = std::max({local.x, local.y, local.z}) < kChunkEdge - 1;
  for (int row = 0; row < 4; ++row) {
    const IVec3 sample = cell + IVec3{0, row & 1, row >> 1};
    const auto i = static_cast<std::size_t>(2 * row);
    const DensityChunk* const chunk = is_in_one_chunk ? chunk_of_sample(cell) : nullptr;
    const Half* const samples = chunk == nullptr ? nullptr : chunk->row(local_of(sample).y, local_of(sample).z);
    if (samples != nullptr) {
      corners[i] = double{float_from_half(samples[local.x])};
      corners[i + 1] = double{float_from_half(samples[local.x + 1])};
    } else {
      corners[i] = double{density(sample)};
      corners[i + 1] = double{density(sample + IVec3{1, 0, 0})};
    }
  }
  for (int i = 0; i < 8; ++i) {
    if (corners[static_cast<std::size_t>(i)] < 0.0 && counts_at(cell + IVec3{i & 1, i >> 1 & 1, i >> 2})) return true;
  }
  return false;
}

VoxelType FieldCells::material(IVec3 cell, const DVec3& point) {
  double least = std::numeric_limits<double>::infinity();
  IVec3 nearest = cell;
  for (int i = 0; i < 8; ++i) {
    const IVec3 corner{i & 1, i >> 1 & 1, i >> 2};
    const DVec3 away = DVec3(corner) - point;
    const double square = glm::dot(away, away);
    if (!(square < least) || !(field().density(cell + corner) < 0.0F) || !counts_at(cell + corner)) continue;
    least = square;
    nearest = cell + corner;
  }
  return field().material(nearest);
}

template <class Moving>
void FieldSweep<Moving>::check(const IBox& near, double from, double to) {
  const double until = std::min(to, most_);
  const Shape shape(shape_, until);
  FieldSearch<Shape> search(shape);
  CellCorners corners;
  for (int z = near.min.z; z < near.max.z; ++z) {
    for (int y = near.min.y; y < near.max.y; ++y) {
      for (int x = near.min.x; x < near.max.x; ++x) {
        if (cells_.read({x, y, z}, corners)) search.add({x, y, z}, corners, from, until);
      }
    }
  }
  const auto contact = search.first(until);
  if (contact && contact->fraction < best_.fraction) best_ = *contact;
}

template <class Moving>
DVec3 FieldSweep<Moving>::normal() const {
  return Shape(shape_, most_).normal(best_, cells_.field());
}

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

DVec3 nearest_within(const MovingBox& box, const DVec3& point) {
  const DVec3 at = glm::clamp((point - box.centre) * box.axes, -box.half_size, box.half_size);
  return box.centre + box.axes * at;
}
DVec3 nearest_within(const MovingCapsule& capsule, const DVec3& point) {
  const DVec3 on_line = capsule.nearest_of_line(capsule.centre, point);
  const DVec3 away = point - on_line;
  const double length = glm::length(away);
  return length > capsule.radius ? on_line + away * (capsule.radius / length) : point;
}

// The point of least density in a shape at rest, among the corners of its intersection with each cell. Exact for a box
// along the grid's axes.
struct Deepest {
  DVec3 point{0.0};
  double density = 0.0;
};

template <class Moving>
Deepest deepest_in(const DensityTree& tree, const TypesMet& types, const Moving& shape) {
  FieldCells cells(tree, types);
  const DBox bounds = bounds_between(shape, reach_of(shape), 0.0, 0.0);
  const IBox near = voxels_within(bounds, cells.bounds());
  Deepest deepest;
  CellCorners corners;
  for (int z = near.min.z; z < near.max.z; ++z) {
    for (int y = near.min.y; y < near.max.y; ++y) {
      for (int x = near.min.x; x < near.max.x; ++x) {
        if (!cells.read({x, y, z}, corners)) continue;
        const DVec3 cell(x, y, z);
        const DVec3 low = glm::clamp(bounds.min, cell, cell + 1.0);
        const DVec3 high = glm::clamp(bounds.max, cell, cell + 1.0);
        for (int i = 0; i < 8; ++i) {
          const DVec3 corner((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                             (i & 4) != 0 ? high.z : low.z);
          const DVec3 point = nearest_within(shape, corner);
          const double density = tree.field().density_at(point);
          if (density < deepest.density) deepest = {point, density};
        }
      }
    }
  }
  return deepest;
}

// Returns the distance along a direction after which the shape is free; infinity if more than `most`.
template <class Moving>
double depth_along(const DensityTree& tree, const TypesMet& types, const Moving& shape, DVec3 direction, double guess,
                   double most) {
  for (double length = guess;; length *= 2.0) {
    Moving back = shape;
    back.centre += direction * std::min(length, most);
    back.displacement = -direction * std::min(length, most);
    FieldSweep<Moving> sweep(tree, types, back, 1.0);
    follow_way(back, 1.0, sweep);
    // Free at the start of the way back: the first contact on the way back is the last solid that the shape leaves.
    if (!sweep.best().starts_inside) return std::min(length, most) * (1.0 - std::min(sweep.best().fraction, 1.0));
    if (length >= most) return kInfinity;
  }
}

// Returns the unit gradient of the field around a point, from samples beyond its cell; 0 if the field is constant
// there.
DVec3 direction_out(const DensityGrid& field, DVec3 point) {
  DVec3 gradient(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    DVec3 step(0.0);
    step[axis] = 0.5;
    gradient[axis] = double{field.density_at(point + step)} - double{field.density_at(point - step)};
  }
  const double length = glm::length(gradient);
  return length > 0.0 ? gradient / length : DVec3(0.0);
}

}  // namespace

template <class Moving>
WayOut way_out(const DensityTree& tree, const TypesMet& types, const Moving& shape, const FieldContact& contact) {
  const DVec3 reach = reach_of(shape);
  const double most = 2.0 * glm::length(reach) + 2.0;
  Deepest deepest = deepest_in(tree, types, shape);
  if (!(deepest.density < 0.0)) deepest.point = DVec3(contact.piece.cell) + contact.point;
  const DVec3 gradient = direction_out(tree.field(), deepest.point);
  const double guess = std::min(0.25 - 2.0 * deepest.density, most);
  if (gradient != DVec3(0.0)) {
    const double depth = depth_along(tree, types, shape, gradient, guess, most);
    if (depth < kInfinity) return {gradient, std::max(depth, kFieldTouch)};
  }
  WayOut best{gradient, kInfinity};
  for (int i = 0; i < 6; ++i) {
    DVec3 direction(0.0);
    direction[i / 2] = i % 2 == 0 ? 1.0 : -1.0;
    const double depth = depth_along(tree, types, shape, direction, guess, most);
    if (depth < best.depth) best = {direction, std::max(depth, kFieldTouch)};
  }
  if (best.depth < kInfinity) return best;
  return {gradient != DVec3(0.0) ? gradient : DVec3(0.0, 1.0, 0.0), 1.0};
}

template class FieldSweep<MovingBox>;
template class FieldSweep<MovingCapsule>;
template WayOut way_out(const DensityTree&, const TypesMet&, const MovingBox&, const FieldContact&);
template WayOut way_out(const DensityTree&, const TypesMet&, const MovingCapsule&, const FieldContact&);

}  // namespace quoin
