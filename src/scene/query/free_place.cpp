// The nearest position of a box without overlaps.
//
//   voxels along the box's axes:                turned grids, and fields:
//   there the box touches something on each     cubes of displacements, the nearest first; a cube is blocked as a
//   axis along which it was moved               whole if the box, shrunk by the cube, overlaps something
//     +--+--+                                     +-------+
//     |##|##|  <- box: candidates are a few       |  +-+  |  box     +-+ the part of the box that is the same
//     +--+--+     positions for each axis,        |  +-+  |          +-+ for all displacements of the cube
//                 from the nearest on             +-------+

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <queue>
#include <type_traits>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/scene/sweep.h>

#include "scene/query/moving_shapes.h"
#include "scene/query/query_in_grid.h"
#include "scene/query/unloaded_chunks.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {
namespace {

glm::dmat3 axes_of(const OrientedBox& box) {
  return glm::mat3_cast(unit_rotation(box.rotation));
}
glm::dmat3 axes_of(const Capsule& /*capsule*/) {
  return glm::dmat3(1.0);
}

// Returns a part of the shape that stays inside it under any displacement of up to `half` along its axes, if there is
// one.
std::optional<OrientedBox> common_of(OrientedBox box, double half) {
  box.half_size -= half;
  return is_box(box) ? std::optional(box) : std::nullopt;
}
std::optional<Capsule> common_of(Capsule capsule, double half) {
  capsule.radius -= std::sqrt(3.0) * half;
  return is_capsule(capsule) ? std::optional(capsule) : std::nullopt;
}

template <class Shape>
class FreePlace {
 public:
  FreePlace(const SceneTracer& tracer, const Shape& shape, double max_distance, const QueryFilter& filter)
      : tracer_(tracer), shape_(shape), axes_(axes_of(shape)), max_distance_(max_distance), filter_(filter) {}

  [[nodiscard]] std::optional<DVec3> find() {
    if (is_free(DVec3(0.0))) return DVec3(0.0);
    if constexpr (std::is_same_v<Shape, OrientedBox>) {
      if (has_own_axes()) return among_planes();
    }
    return among_cubes();
  }

 private:
  // Displacements are along the shape's axes.
  [[nodiscard]] DVec3 in_world(DVec3 displacement) const { return axes_ * displacement; }
  [[nodiscard]] Shape at(DVec3 displacement) const {
    Shape moved = shape_;
    moved.centre += in_world(displacement);
    return moved;
  }
  [[nodiscard]] bool is_free(DVec3 displacement) const { return overlaps(tracer_, at(displacement), filter_).empty(); }

  // Returns true if all possible obstacles are voxels whose axes are parallel to the box's. Collects the positions in
  // contact with their faces.
  [[nodiscard]] bool has_own_axes() {
    const DVec3 reach = reach_of_axes(half_axes_of(shape_)) + max_distance_;
    bool are_own = true;
    const Seen seen(tracer_, filter_, QueryTypes::Colliding);
    seen.visit_near({shape_.centre - reach, shape_.centre + reach}, [&](const PlacedGrid& placed) {
      are_own =
          are_own && placed.field == nullptr && (placed.voxels->bounds().empty() || add_planes(placed, seen.types));
    });
    if (!are_own || !seen.meets_unloaded) return are_own;
    seen.visit_partial([&](const PlacedGrid& chunks) {
      const ToGrid to_chunks(chunks);
      const DVec3 around = DVec3(glm::length(reach)) / chunks.voxel_size;
      const DVec3 centre = to_chunks.point(shape_.centre);
      are_own = are_own && is_surely_loaded(*chunks.grid, {centre - around, centre + around});
    });
    return are_own;
  }

  bool add_planes(const PlacedGrid& placed, const TypesMet& types) {
    const ToGrid to_grid(placed);
    const DVec3 centre = to_grid.point(shape_.centre);
    const IBox bounds = placed.voxels->bounds();
    const PlanesOfShapes of_shapes = planes_of_shapes(placed, types, centre);
    // Tolerance for overlaps caused by rounding.
    const double room = 0x1p-50 * (glm::length(shape_.centre) + glm::length(placed.position) + max_distance_);
    for (int axis = 0; axis < 3; ++axis) {
      const DVec3 direction = to_grid.axes * axes_[axis] * placed.voxel_size;
      const DVec3 size = glm::abs(direction);
      const int of_grid = size.x > size.y ? (size.x > size.z ? 0 : 2) : size.y > size.z ? 1 : 2;
      if (!(size[of_grid] > 1.0 - 1e-12) || !(size.x + size.y + size.z < 1.0 + 1e-9)) return false;
      const double half = shape_.half_size[axis];
      const double reach = (half + max_distance_) / placed.voxel_size;
      const double first = std::max(std::floor(centre[of_grid] - reach), double(bounds.min[of_grid]));
      const double last = std::min(std::ceil(centre[of_grid] + reach), double(bounds.max[of_grid]));
      const auto add_plane = [&](double plane) {
        const double away = std::copysign(plane - centre[of_grid], (plane - centre[of_grid]) * direction[of_grid]);
        for (const double side : {-half, half}) {
          const double to = away * placed.voxel_size + side;
          add_place(axis, to + std::copysign(room, to));
        }
      };
      for (double plane = first; plane <= last; ++plane) add_plane(plane);
      for (const double plane : of_shapes[static_cast<std::size_t>(of_grid)]) add_plane(plane);
    }
    return true;
  }
  // The faces of the boxes of shapes within reach, along each axis of the grid.
  using PlanesOfShapes = std::array<std::vector<double>, 3>;
  [[nodiscard]] PlanesOfShapes planes_of_shapes(const PlacedGrid& placed, const TypesMet& types, DVec3 centre) const {
    PlanesOfShapes planes;
    if (placed.shapes == nullptr) return planes;
    const ShapeObstacles shapes(placed, types);
    const DVec3 reach((glm::length(shape_.half_size) + max_distance_) / placed.voxel_size + 1.0);
    const IBox cells = voxels_within({centre - reach, centre + reach}, shapes.bounds(placed.voxels->bounds()));
    shapes.visit_touched(cells, [&](IVec3 cell) {
      shapes.visit(cell, [&](IVec3 /*voxel*/, const DBox& box) {
        for (int axis = 0; axis < 3; ++axis) {
          std::vector<double>& along = planes[static_cast<std::size_t>(axis)];
          along.insert(along.end(), {box.min[axis], box.max[axis]});
        }
      });
    });
    for (std::vector<double>& along : planes) {
      std::sort(along.begin(), along.end());
      along.erase(std::unique(along.begin(), along.end()), along.end());
    }
    return planes;
  }
  void add_place(int axis, double along) {
    if (std::abs(along) <= max_distance_) places_[static_cast<std::size_t>(axis)].push_back(along);
  }

  // A combination of one position per axis, 0 included.
  [[nodiscard]] std::optional<DVec3> among_planes() {
    for (std::vector<double>& along : places_) {
      along.push_back(0.0);
      std::sort(along.begin(), along.end(),
                [](double a, double b) { return std::abs(a) != std::abs(b) ? std::abs(a) < std::abs(b) : a > b; });
      along.erase(std::unique(along.begin(), along.end()), along.end());
    }
    struct Candidate {
      double square;
      std::array<std::size_t, 3> which;
      bool operator<(const Candidate& other) const {
        return square != other.square ? square > other.square : which > other.which;
      }
    };
    std::priority_queue<Candidate> next;
    const auto displacement = [&](const std::array<std::size_t, 3>& which) {
      return DVec3(places_[0][which[0]], places_[1][which[1]], places_[2][which[2]]);
    };
    const auto push = [&](std::array<std::size_t, 3> which, std::size_t axis) {
      if (++which[axis] >= places_[axis].size()) return;
      const DVec3 d = displacement(which);
      if (glm::dot(d, d) <= max_distance_ * max_distance_) next.push({glm::dot(d, d), which});
    };
    next.push({0.0, {}});
    while (!next.empty()) {
      const std::array<std::size_t, 3> which = next.top().which;
      next.pop();
      if (is_free(displacement(which))) return in_world(displacement(which));
      // Pushes each candidate only once: advances the last axis used and those after it.
      push(which, 2);
      if (which[2] == 0) push(which, 1);
      if (which[2] == 0 && which[1] == 0) push(which, 0);
    }
    return std::nullopt;
  }

  // Displacements from `middle` - `half` to `middle` + `half`.
  struct Cube {
    DVec3 middle{0.0};
    double half = 0.0;
    double least = 0.0;  // length of one of them
    bool operator<(const Cube& other) const { return least > other.least; }
  };

  [[nodiscard]] bool is_blocked(const Cube& cube) const {
    const std::optional<Shape> common = common_of(at(cube.middle), cube.half);
    return common && !overlaps(tracer_, *common, filter_).empty();
  }

  // Moves from a free position back towards the start, sliding along obstacles.
  [[nodiscard]] DVec3 nearer(DVec3 free) const {
    SlideOptions options;
    options.pushes_out = false;
    options.filter = filter_;
    options.max_contacts = 8;
    options.skin = std::min(options.skin, 0.01 * max_distance_);
    const DVec3 back = move_and_slide(tracer_, at(free), -in_world(free), options).centre - shape_.centre;
    return glm::length(back) < glm::length(free) ? back : in_world(free);
  }

  [[nodiscard]] std::optional<DVec3> among_cubes() {
    const double finest = max_distance_ / 64.0;
    double shortest = std::nextafter(max_distance_, std::numeric_limits<double>::infinity());
    std::optional<DVec3> best;
    std::priority_queue<Cube> next;
    next.push({DVec3(0.0), max_distance_, 0.0});
    while (!next.empty() && next.top().least < shortest) {
      const Cube cube = next.top();
      next.pop();
      if (is_blocked(cube)) continue;
      if (glm::length(cube.middle) < shortest && is_free(cube.middle)) {
        best = nearer(cube.middle);
        shortest = glm::length(*best) - finest;
      }
      if (cube.half <= finest) continue;
      for (int i = 0; i < 8; ++i) {
        const double half = 0.5 * cube.half;
        const DVec3 middle = cube.middle + half * (2.0 * DVec3(i & 1, i >> 1 & 1, i >> 2) - 1.0);
        const double least = glm::length(glm::max(glm::abs(middle) - half, 0.0));
        if (least < shortest) next.push({middle, half, least});
      }
    }
    return best;
  }

  const SceneTracer& tracer_;
  const Shape& shape_;
  const glm::dmat3 axes_;
  const double max_distance_;
  const QueryFilter& filter_;
  std::array<std::vector<double>, 3> places_;  // along each of the box's axes
};

}  // namespace

std::optional<DVec3> depenetration(const SceneTracer& tracer, const OrientedBox& box, double max_distance,
                                   const QueryFilter& filter) {
  if (!is_box(box) || !std::isfinite(max_distance) || max_distance < 0.0) return std::nullopt;
  return FreePlace(tracer, box, max_distance, filter).find();
}

std::optional<DVec3> depenetration(const SceneTracer& tracer, const Capsule& capsule, double max_distance,
                                   const QueryFilter& filter) {
  if (!is_capsule(capsule) || !std::isfinite(max_distance) || max_distance < 0.0) return std::nullopt;
  return FreePlace(tracer, capsule, max_distance, filter).find();
}

}  // namespace quoin
