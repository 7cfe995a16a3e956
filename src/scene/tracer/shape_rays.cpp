#include "scene/tracer/shape_rays.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/grid/texture.h>

namespace quoin {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
// A side that lies in the plane between two cells may be found in either: the rounding of both distances, in voxels.
constexpr double kBetweenCells = 1e-6;

double component(const Vec3& a, const DVec3& b) {
  return double{a.x} * b.x + double{a.y} * b.y + double{a.z} * b.z;
}

Direction side_of(int axis, bool is_upper) {
  return static_cast<Direction>(2 * axis + (is_upper ? 0 : 1));
}

// Finds the way of a ray, relative to the shape's voxel, through a box. Returns false if there is none.
bool cross_box(const ModelBox& box, const Ray& ray, const DVec3& inverse_direction, ShapeSpan& span) {
  DVec3 origin = ray.origin;
  DVec3 direction = ray.direction;
  DVec3 inverse = inverse_direction;
  if (box.is_turned) {
    const DVec3 from = ray.origin - DVec3(box.origin);
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3& row = box.inverse[static_cast<std::size_t>(axis)];
      origin[axis] = component(row, from);
      direction[axis] = component(row, ray.direction);
    }
    inverse = 1.0 / direction;
  }
  span.enter.t = -kFar;
  span.exit.t = kFar;
  int enter_axis = -1;
  int exit_axis = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = box.min[axis];
    const double high = box.max[axis];
    if (direction[axis] == 0.0) {
      if (origin[axis] < low || origin[axis] > high || low == high) return false;
      continue;
    }
    const bool is_forward = direction[axis] > 0.0;
    const double near = ((is_forward ? low : high) - origin[axis]) * inverse[axis];
    const double far = ((is_forward ? high : low) - origin[axis]) * inverse[axis];
    // If a ray crosses several planes at once, the last one counts, as for voxels.
    if (near >= span.enter.t) {
      span.enter.t = near;
      enter_axis = axis;
    }
    if (far < span.exit.t) {
      span.exit.t = far;
      exit_axis = axis;
    }
  }
  if (!(span.enter.t <= span.exit.t) || !(span.exit.t >= 0.0)) return false;
  if (span.enter.t == span.exit.t ? enter_axis != exit_axis : span.exit.t == 0.0) return false;
  span.enter.side = side_of(enter_axis, direction[enter_axis] < 0.0);
  span.exit.side = side_of(exit_axis, direction[exit_axis] > 0.0);
  span.enter.face = box.faces[static_cast<std::size_t>(span.enter.side)];
  span.exit.face = box.faces[static_cast<std::size_t>(span.exit.side)];
  return true;
}

// Returns where a ray, relative to the shape's voxel, crosses a face; NaN if it does not. Neighbouring faces agree
// about their common edge, except that both may contain it.
double crossing_of(const ModelFace& face, const Ray& ray) {
  bool is_left = true;
  bool is_right = true;
  for (std::size_t i = 0; i < 4; ++i) {
    const DVec3 from = DVec3(face.corners[i]) - ray.origin;
    const DVec3 to = DVec3(face.corners[(i + 1) % 4]) - ray.origin;
    const double volume = glm::dot(ray.direction, glm::cross(from, to));
    is_left = is_left && volume >= 0.0;
    is_right = is_right && volume <= 0.0;
  }
  const double along = component(face.normal, ray.direction);
  if (is_left == is_right || along == 0.0) return std::numeric_limits<double>::quiet_NaN();
  return component(face.normal, DVec3(face.corners[0]) - ray.origin) / along;
}

// Visits the ways of a ray, relative to the shape's voxel, through the closed surface of the free faces.
template <class Visit>
void cross_fluid(const ShapeModel& model, const Ray& ray, ShapeSpan& span, const Visit& visit) {
  struct Crossing {
    ShapeSpan::End end;
    bool enters = false;
  };
  std::array<Crossing, 16> crossings;
  std::size_t count = 0;
  for (std::size_t i = model.faces.size() - model.free_faces; i < model.faces.size(); ++i) {
    const double t = crossing_of(model.faces[i], ray);
    if (std::isnan(t) || count == crossings.size()) continue;
    crossings[count++] = {{t, static_cast<std::int16_t>(i), model.faces[i].direction},
                          component(model.faces[i].normal, ray.direction) < 0.0};
  }
  std::sort(crossings.begin(), crossings.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Crossing& a, const Crossing& b) { return a.end.t != b.end.t ? a.end.t < b.end.t : a.enters; });
  bool is_inside = false;
  for (std::size_t i = 0; i < count; ++i) {
    if (crossings[i].enters) {
      if (!is_inside) span.enter = crossings[i].end;
      is_inside = true;
    } else if (std::exchange(is_inside, false)) {
      span.exit = crossings[i].end;
      if (span.exit.t > 0.0 && span.exit.t > span.enter.t) visit(span);
    }
  }
}

template <class Visit>
void cross_shape(const PlacedShape& shape, const Ray& ray_in_grid, const DVec3& inverse_direction, const Visit& visit) {
  const ShapeModel& model = *shape.model;
  const Ray ray{ray_in_grid.origin - DVec3(shape.voxel), ray_in_grid.direction};
  ShapeSpan span;
  span.shape = &shape;
  for (const ModelBox& box : model.boxes) {
    span.box = &box;
    if (cross_box(box, ray, inverse_direction, span)) visit(static_cast<const ShapeSpan&>(span));
  }
  if (model.free_faces == 0) return;
  span.box = nullptr;
  cross_fluid(model, ray, span, visit);
}

// Returns true if a face hides the background at a point, relative to the shape's voxel.
bool is_visible_at(const VoxelProperties& type, const ShapeModel& model, const ModelFace& face, const DVec3& point) {
  if (type.visibility == Visibility::Opaque) return true;
  const VoxelFace* const look = look_of(model, face, type.faces);
  if (look == nullptr || look->texture.is_null() || look->alpha == FaceAlpha::Translucent) return false;
  if (look->alpha == FaceAlpha::Opaque) return true;
  return shape_texel(face, *look, point).a >= kCutoutAlpha;
}

// The way of a ray from cell to cell. Each plane is crossed at the same distance as in trace::Walk, which is faster on
// long ways.
class CellSteps {
 public:
  // `inverse`: of the direction's components; unused where they are 0.
  CellSteps(const Ray& ray, const DVec3& inverse, IVec3 cell, double t)
      : ray_(ray), inverse_(inverse), cell_(cell), t_(t) {
    for (int axis = 0; axis < 3; ++axis) find_next(axis);
  }
  [[nodiscard]] IVec3 cell() const { return cell_; }
  // Return the distance of the ray's entry into the cell and, after a step, the face of entry.
  [[nodiscard]] double t() const { return t_; }
  [[nodiscard]] Direction face() const { return side_of(axis_, ray_.direction[axis_] < 0.0); }
  [[nodiscard]] double t_exit() const { return std::min(std::min(next_[0], next_[1]), next_[2]); }
  void step() {
    if (next_[0] <= next_[1]) {
      axis_ = next_[0] <= next_[2] ? 0 : 2;
    } else {
      axis_ = next_[1] <= next_[2] ? 1 : 2;
    }
    t_ = std::max(t_, next_[axis_]);
    cell_[axis_] += ray_.direction[axis_] > 0.0 ? 1 : -1;
    find_next(axis_);
  }

 private:
  void find_next(int axis) {
    const double d = ray_.direction[axis];
    const double plane = cell_[axis] + (d > 0.0 ? 1.0 : 0.0);
    next_[axis] = d != 0.0 ? (plane - ray_.origin[axis]) * inverse_[axis] : kFar;
  }

  const Ray& ray_;
  DVec3 inverse_;
  IVec3 cell_;
  double t_;
  int axis_ = 0;
  DVec3 next_{0.0};
};

// Cells that a ray passes by CellSteps before it goes on through the tree.
constexpr int kSteps = 24;

// A ray on its way through the cells that shapes touch.
class ShapeRay {
 public:
  ShapeRay(const TracedShapes& shapes, const VoxelRegistry& types, ShapeIndex::Reader& reader, const Ray& ray,
           double max_t, ShapeParts parts)
      : shapes_(shapes), types_(types), reader_(reader), ray_(ray), max_t_(max_t), parts_(parts) {
    inverse_ = 1.0 / ray.direction;
    room_ = kBetweenCells * std::min(std::min(std::abs(inverse_.x), std::abs(inverse_.y)), std::abs(inverse_.z));
  }

  // Looks at the shapes of one cell. Returns true if there is a hit, which is then the nearest one.
  bool meet_shapes(std::span<const PlacedShape> shapes, double t_enter, double t_exit) {
    begin_ = t_enter - room_;
    end_ = std::min(t_exit + room_, max_t_);
    for (const PlacedShape& shape : shapes) {
      if (parts_ == ShapeParts::Opaque && types_[shape.type].visibility != Visibility::Opaque) continue;
      if (parts_ == ShapeParts::Colliding && !types_[shape.type].collides) continue;
      cross_shape(shape, ray_, inverse_, [&](const ShapeSpan& span) {
        if (parts_ == ShapeParts::Visible) return take_visible(span);
        if (parts_ != ShapeParts::Colliding || span.collides()) take_solid(span);
      });
    }
    return found_;
  }

  // Looks at all cells from `t_begin` on.
  bool meet_cells(double t_begin = 0.0) {
    const Ray rest{ray_.origin + t_begin * ray_.direction, ray_.direction};
    visit_hits(shapes_.touched, rest, max_t_ - t_begin, [&](const VoxelSpan& span) {
      return !meet_shapes(reader_.at(span.voxel), t_begin + span.t_enter, t_begin + span.t_exit);
    });
    return found_;
  }
  // As above, from the ray's origin. Faster if a shape is near.
  bool meet_near_cells() {
    const IBox bounds = shapes_.touched.bounds();
    for (int axis = 0; axis < 3; ++axis) {
      const double at = ray_.origin[axis];
      if (!(at > bounds.min[axis] - kSteps && at < bounds.max[axis] + kSteps)) return meet_cells();
    }
    CellSteps steps(ray_, inverse_, voxel_of(ray_.origin), 0.0);
    for (int i = 0; i < kSteps; ++i, steps.step()) {
      if (steps.t() > max_t_) return false;
      const std::span<const PlacedShape> here = reader_.at(steps.cell());
      if (!here.empty() && meet_shapes(here, steps.t(), steps.t_exit())) return true;
    }
    return meet_cells(steps.t());
  }

  // Returns the inverse of the direction's components: infinite where they are 0.
  [[nodiscard]] const DVec3& inverse() const { return inverse_; }

  [[nodiscard]] ShapeHit hit() const {
    const PlacedShape& shape = *best_.shape;
    ShapeHit hit{std::max(best_t_, 0.0), shape.voxel, shape.model, Vec3(0.0F), shape.type, -1, Direction::PosX, false};
    if (is_inside_) {
      hit.starts_inside = true;
      hit.direction = nearest_direction(-ray_.direction);
      hit.normal = Vec3(normal_of(hit.direction));
      return hit;
    }
    const ShapeSpan::End& end = is_exit_ ? best_.exit : best_.enter;
    hit.face = end.face;
    hit.normal = is_exit_ ? -best_.normal(end) : best_.normal(end);
    hit.direction = nearest_direction(DVec3(hit.normal));
    return hit;
  }

 private:
  void take(const ShapeSpan& span, double t, bool is_exit, bool is_inside) {
    if (found_ && !(t < best_t_)) return;
    found_ = true;
    best_ = span;
    best_t_ = t;
    is_exit_ = is_exit;
    is_inside_ = is_inside;
  }
  [[nodiscard]] bool is_in_cell(double t) const { return t >= begin_ && t <= end_; }
  // Returns true if the ray, up to `max_t`, meets a side here that is drawn and visible.
  [[nodiscard]] bool is_visible(const ShapeSpan& span, const ShapeSpan::End& end) const {
    if (end.face < 0 || !(end.t >= 0.0) || !is_in_cell(end.t)) return false;
    const PlacedShape& shape = *span.shape;
    const DVec3 point = ray_.origin - DVec3(shape.voxel) + end.t * ray_.direction;
    return is_visible_at(types_[shape.type], *shape.model, shape.model->faces[static_cast<std::size_t>(end.face)],
                         point);
  }
  // Both sides of a plate are at one place: the ray meets the side that it looks at.
  static bool is_seen_from_inside(const ShapeSpan& span) { return span.enter.t < span.exit.t || span.enter.face < 0; }
  void take_visible(const ShapeSpan& span) {
    const bool is_opaque = types_[span.shape->type].visibility == Visibility::Opaque;
    if (span.starts_inside() && is_opaque) {
      if (is_in_cell(0.0)) take(span, 0.0, false, true);
    } else if (is_visible(span, span.enter)) {
      take(span, span.enter.t, false, false);
    } else if (is_seen_from_inside(span) && is_visible(span, span.exit)) {
      take(span, span.exit.t, true, false);
    }
  }
  void take_solid(const ShapeSpan& span) {
    const double t = std::max(span.enter.t, 0.0);
    if (is_in_cell(t)) take(span, t, false, span.starts_inside());
  }

  const TracedShapes& shapes_;
  const VoxelRegistry& types_;
  ShapeIndex::Reader& reader_;
  const Ray& ray_;
  double max_t_;
  ShapeParts parts_;
  double room_;
  DVec3 inverse_{0.0};  // of the direction; infinite where that is 0
  double begin_ = 0.0;
  double end_ = 0.0;
  ShapeSpan best_;
  double best_t_ = 0.0;
  bool found_ = false;
  bool is_exit_ = false;
  bool is_inside_ = false;
};

}  // namespace

Vec3 ShapeSpan::normal(const End& end) const {
  if (end.face >= 0) return shape->model->faces[static_cast<std::size_t>(end.face)].normal;
  QUOIN_ASSERT(box != nullptr, "a free surface has a face");
  if (!box->is_turned) return Vec3(normal_of(end.side));
  const FaceFrame& frame = frame_of(end.side);
  return glm::normalize(box->inverse[frame.axis]) * static_cast<float>(frame.sign);
}

// The coordinates are an affine map, known at the corners.
ShapeUv shape_uv(const ModelFace& face, const VoxelFace& look, const DVec3& point) {
  const auto& corners = face.corners;
  // A corner may be there twice.
  const std::size_t middle = corners[1] == corners[2] ? 2 : 1;
  const DVec3 first = DVec3(corners[middle]) - DVec3(corners[0]);
  const DVec3 second = DVec3(corners[middle + 1]) - DVec3(corners[middle]);
  const DVec3 from = point - DVec3(corners[0]);
  const double aa = glm::dot(first, first);
  const double ab = glm::dot(first, second);
  const double bb = glm::dot(second, second);
  const double a = glm::dot(from, first);
  const double b = glm::dot(from, second);
  const double scale = 1.0 / (aa * bb - ab * ab);
  const double along_first = (a * bb - b * ab) * scale;
  const double along_second = (b * aa - a * ab) * scale;
  ShapeUv result;
  std::array<float, 2> uv{};
  double square = 0.0;
  for (std::size_t i = 0; i < 2; ++i) {
    const double begin = face.uv[0][i];
    const double step = face.uv[middle][i] - begin;
    uv[i] = static_cast<float>(begin + along_first * step +
                               along_second * (double{face.uv[middle + 1][i]} - double{face.uv[middle][i]}));
    square += step * step;
  }
  result.uv = texture_uv(face, look, uv);
  result.square_density = square / aa;
  return result;
}

Rgba8 shape_texel(const ModelFace& face, const VoxelFace& look, const DVec3& point) {
  QUOIN_ASSERT(!look.texture.is_null(), "a face with a texture");
  const std::array<float, 2> uv = shape_uv(face, look, point).uv;
  const auto size = static_cast<std::uint32_t>(look.texture.size());
  return look.texture.level(0)[texel_number(uv[1], 1.0, size) * std::size_t{size} + texel_number(uv[0], 1.0, size)];
}

void visit_shape(const PlacedShape& shape, const Ray& ray_in_grid, FunctionRef<void(const ShapeSpan&)> visit) {
  cross_shape(shape, ray_in_grid, 1.0 / ray_in_grid.direction, visit);
}

bool first_shape(const TracedShapes& shapes, const VoxelRegistry& types, const Ray& ray_in_grid, double max_t,
                 ShapeParts parts, ShapeHit& hit) {
  ShapeIndex::Reader reader(shapes.index);
  ShapeRay ray(shapes, types, reader, ray_in_grid, max_t, parts);
  if (!ray.meet_cells()) return false;
  hit = ray.hit();
  return true;
}

namespace {

// The solids of a grid: opaque voxels and shapes. Both readers remember the last chunk.
struct Solids {
  Solids(const TracedShapes& of, const Grid& grid, const VoxelRegistry& registry)
      : tree(of.solid), types(registry), voxels(grid), shapes(of.index) {}

  const OccupancyTree& tree;
  const VoxelRegistry& types;
  GridReader voxels;
  ShapeIndex::Reader shapes;
};

// Finds the first solid after a ray's first cell. Returns true for a shape; else sets `next` to an opaque voxel, if
// there is one.
bool meet_solid_behind(ShapeRay& ray, Solids& solids, const Ray& in_grid, double max_t, CellSteps& steps,
                       std::optional<RayHit>& next) {
  bool is_met = false;
  // Returns true if the ray ends in a cell.
  const auto meet = [&](IVec3 cell, Direction face, double t_enter, double t_exit) {
    if (solids.types.is_opaque(solids.voxels.get(cell))) {
      next = RayHit{cell, face, t_enter, false};
      return true;
    }
    const std::span<const PlacedShape> here = solids.shapes.at(cell);
    is_met = !here.empty() && ray.meet_shapes(here, t_enter, t_exit);
    return is_met;
  };
  for (int i = 0; i < kSteps; ++i) {
    steps.step();
    if (steps.t() > max_t) return false;
    if (meet(steps.cell(), steps.face(), steps.t(), steps.t_exit())) return is_met;
  }
  steps.step();
  const double begin = steps.t();
  if (begin > max_t) return false;
  const Ray rest{in_grid.origin + begin * in_grid.direction, in_grid.direction};
  visit_hits(solids.tree, rest, max_t - begin, [&](const VoxelSpan& span) {
    const Direction face = span.starts_inside ? steps.face() : span.face;
    return !meet(span.voxel, face, begin + span.t_enter, begin + span.t_exit);
  });
  return is_met;
}

}  // namespace

std::uint32_t first_solids(const TracedShapes& shapes, const Grid& voxels, const VoxelRegistry& types,
                           const RayPacket& rays_in_grid, PacketHits& hits, RayPacket::Lanes<ShapeHit>& in_shapes) {
  first_hits(shapes.solid, rays_in_grid, hits);
  Solids solids(shapes, voxels, types);
  std::uint32_t in_shape = 0;
  for (std::uint32_t left = hits.hit; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const auto i = static_cast<std::size_t>(lane);
    const IVec3 cell{hits.x[i], hits.y[i], hits.z[i]};
    const std::span<const PlacedShape> here = solids.shapes.at(cell);
    if (here.empty()) continue;
    // A shape of another voxel may reach into an opaque one.
    if (here.front().voxel != cell && types.is_opaque(solids.voxels.get(cell))) continue;
    const Ray in_grid = rays_in_grid.ray(lane);
    const double max_t = rays_in_grid.max_t[i];
    ShapeRay ray(shapes, types, solids.shapes, in_grid, max_t, ShapeParts::Visible);
    CellSteps steps(in_grid, ray.inverse(), cell, hits.t[i]);
    std::optional<RayHit> next;
    if (ray.meet_shapes(here, hits.t[i], steps.t_exit()) ||
        meet_solid_behind(ray, solids, in_grid, max_t, steps, next)) {
      const ShapeHit& hit = in_shapes[i] = ray.hit();
      next = RayHit{hit.voxel, hit.direction, hit.t, hit.starts_inside};
      in_shape |= 1U << lane;
    }
    const std::uint32_t bit = 1U << lane;
    hits.hit &= ~bit;
    hits.starts_inside &= ~bit;
    if (next) hits.set(lane, *next);
  }
  return in_shape;
}

// Most rays that miss both kinds of solids are done after one tree.
void any_solids(const TracedShapes& shapes, const OccupancyTree& opaque, const VoxelRegistry& types,
                std::span<const RayPacket> packets_in_grid, std::span<std::uint32_t> blocked) {
  any_hits(shapes.solid, packets_in_grid, blocked);
  ShapeIndex::Reader reader(shapes.index);
  for (std::size_t number = 0; number < packets_in_grid.size(); ++number) {
    if (blocked[number] == 0) continue;
    const RayPacket& packet = packets_in_grid[number];
    RayPacket rays = packet;
    rays.active = blocked[number];
    blocked[number] = any_hits(opaque, rays);
    for (std::uint32_t left = rays.active & ~blocked[number]; left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      const Ray in_grid = packet.ray(lane);
      ShapeRay ray(shapes, types, reader, in_grid, packet.max_t[static_cast<std::size_t>(lane)], ShapeParts::Visible);
      if (ray.meet_near_cells()) blocked[number] |= 1U << lane;
    }
  }
}

}  // namespace quoin
