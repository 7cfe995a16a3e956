#include "scene/tracer/shape_rays.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <quoin/core/assert.h>
#include <quoin/grid/texture.h>

#include "trace/walk.h"

namespace quoin {
namespace {

// A side that lies in the plane between two cells may be found in either: the rounding of both distances, in voxels.
constexpr double kBetweenCells = 1e-6;

double component(const Vec3& a, const DVec3& b) {
  return double{a.x} * b.x + double{a.y} * b.y + double{a.z} * b.z;
}

// Returns a ray, relative to the shape's voxel, in the space of a turned box.
BoxRay turned(const ModelBox& box, const Ray& ray) {
  const DVec3 from = ray.origin - DVec3(box.origin);
  DVec3 origin;
  DVec3 direction;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3& row = box.inverse[static_cast<std::size_t>(axis)];
    origin[axis] = component(row, from);
    direction[axis] = component(row, ray.direction);
  }
  return {origin, direction};
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
void cross_fluid(const ShapeModel& model, const Ray& ray, const Visit& visit) {
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
  ShapeSpan::End enter;
  for (std::size_t i = 0; i < count; ++i) {
    const ShapeSpan::End& end = crossings[i].end;
    if (crossings[i].enters) {
      if (!is_inside) enter = end;
      is_inside = true;
    } else if (std::exchange(is_inside, false) && end.t > 0.0 && end.t > enter.t) {
      visit(enter, end);
    }
  }
}

// Calls `visit(box, enter, exit)` for the ways of a ray through the parts of a shape as far as they lie between `least`
// and `most`, and for some others through fluids, whose box is null. `straight`: the ray, from any origin.
template <class Visit>
void cross_shape(const ShapesAtVoxel& here, const ListedShape& shape, const Ray& ray_in_grid, BoxRay& straight,
                 double least, double most, const Visit& visit) {
  const Ray ray{ray_in_grid.origin - DVec3(shape.voxel(here.voxel())), ray_in_grid.direction};
  straight.set_origin(ray.origin);
  ShapeSpan::End enter;
  ShapeSpan::End exit;
  for (const ListedBox& box : here.boxes(shape)) {
    const bool is_met = box.box->is_turned ? turned(*box.box, ray).cross(box, least, most, enter, exit)
                                           : straight.cross(box, least, most, enter, exit);
    if (is_met) visit(box.box, enter, exit);
  }
  if (shape.model->free_faces == 0) return;
  cross_fluid(*shape.model, ray, [&](const ShapeSpan::End& in, const ShapeSpan::End& out) { visit(nullptr, in, out); });
}

// Returns true if a face of a type that is not opaque hides the background at a point, relative to the shape's voxel.
bool is_visible_at(const VoxelProperties& type, const ShapeModel& model, const ModelFace& face, const DVec3& point) {
  const VoxelFace* const look = look_of(model, face, type.faces);
  if (look == nullptr || look->texture.is_null() || look->alpha == FaceAlpha::Translucent) return false;
  if (look->alpha == FaceAlpha::Opaque) return true;
  return shape_texel(face, *look, point).a >= kCutoutAlpha;
}

// A ray on its way through the cells that shapes touch.
class ShapeRay {
 public:
  ShapeRay(const VoxelRegistry& types, const Ray& ray, double max_t, ShapeParts parts)
      : types_(types), ray_(ray), max_t_(max_t), parts_(parts), straight_(ray.origin, ray.direction) {
    const DVec3 inverse = glm::abs(straight_.inverse());
    room_ = kBetweenCells * std::min(std::min(inverse.x, inverse.y), inverse.z);
  }

  // Looks at the shapes of one cell. Returns true if there is a hit, which is then the nearest one.
  bool meet_shapes(const ShapesAtVoxel& here, double t_enter, double t_exit) {
    begin_ = t_enter - room_;
    end_ = std::min(t_exit + room_, max_t_);
    for (const ListedShape& shape : here.listed()) {
      if (parts_ == ShapeParts::Opaque && !shape.is_opaque) continue;
      if (shape.is_inner && parts_ != ShapeParts::Visible) continue;
      if (parts_ == ShapeParts::Colliding && !types_[shape.type].collides) continue;
      const auto take_part = [&](const ModelBox* box, const End& enter, const End& exit) {
        if (parts_ == ShapeParts::Visible) return take_visible({here.voxel(), &shape, box}, enter, exit);
        if (parts_ != ShapeParts::Colliding || box == nullptr || box->collides) {
          take_solid({here.voxel(), &shape, box}, enter);
        }
      };
      cross_shape(here, shape, ray_, straight_, std::max(begin_, 0.0), end_, take_part);
    }
    return found_;
  }

  // Looks at all cells from where the walk is on. `walk`: through the voxels that shapes touch.
  bool meet_cells(trace::Walk& walk, ShapeIndex::Reader& reader) {
    while (walk.find(max_t_)) {
      if (meet_cell(reader.at(walk.voxel()), walk)) return true;
      if (!walk.is_within(max_t_)) return false;
    }
    return false;
  }
  // Looks at the cell where the walk is, and leaves it.
  bool meet_cell(const ShapesAtVoxel& here, trace::Walk& walk) {
    const double t_enter = walk.t();
    walk.leave_voxel();
    return meet_shapes(here, t_enter, walk.t());
  }

  // Returns the inverse of the direction's components: infinite where they are 0.
  [[nodiscard]] const DVec3& inverse() const { return straight_.inverse(); }

  [[nodiscard]] ShapeHit hit() const {
    const ShapeModel& model = *best_.shape->model;
    ShapeHit hit;
    hit.t = std::max(best_end_.t, 0.0);
    hit.voxel = best_.shape->voxel(best_.touched);
    hit.model = &model;
    hit.type = best_.shape->type;
    hit.starts_inside = is_inside_;
    hit.face = is_inside_ ? std::int16_t{-1} : best_end_.face;
    if (is_inside_) {
      hit.direction = nearest_direction(-ray_.direction);
      hit.normal = Vec3(normal_of(hit.direction));
      return hit;
    }
    // The common case first.
    const bool is_straight = best_.box != nullptr && !best_.box->is_turned;
    if (is_straight && !is_exit_ && hit.face >= 0) {
      hit.direction = best_end_.side;
      hit.normal = model.faces[static_cast<std::size_t>(hit.face)].normal;
      return hit;
    }
    const Vec3 normal = ShapeSpan{{hit.voxel, hit.type, &model}, best_.box, {}, {}}.normal(best_end_);
    hit.normal = is_exit_ ? -normal : normal;
    hit.direction = nearest_direction(DVec3(hit.normal));
    return hit;
  }

 private:
  using End = ShapeSpan::End;
  // A part of a shape. `touched`: the voxel in which the ray meets it. `box`: null for fluids.
  struct Part {
    IVec3 touched;
    const ListedShape* shape;
    const ModelBox* box;
  };

  void take(const Part& part, const End& end, double t, bool is_exit, bool is_inside) {
    if (found_ && !(t < best_end_.t)) return;
    found_ = true;
    best_ = part;
    best_end_ = {t, end.face, end.side};
    is_exit_ = is_exit;
    is_inside_ = is_inside;
  }
  [[nodiscard]] bool is_in_cell(double t) const { return t >= begin_ && t <= end_; }
  // Returns true if the ray, up to `max_t`, meets a side here that is drawn and visible.
  [[nodiscard]] bool is_visible(const Part& part, const End& end) const {
    if (end.face < 0 || !(end.t >= 0.0) || !is_in_cell(end.t)) return false;
    const ListedShape& shape = *part.shape;
    if (shape.is_opaque) return true;
    const DVec3 point = ray_.origin - DVec3(shape.voxel(part.touched)) + end.t * ray_.direction;
    return is_visible_at(types_[shape.type], *shape.model, shape.model->faces[static_cast<std::size_t>(end.face)],
                         point);
  }
  void take_visible(const Part& part, const End& enter, const End& exit) {
    if (enter.t < 0.0 && part.shape->is_opaque) {
      if (is_in_cell(0.0)) take(part, enter, 0.0, false, true);
    } else if (is_visible(part, enter)) {
      take(part, enter, enter.t, false, false);
    } else if ((enter.t < exit.t || enter.face < 0) && is_visible(part, exit)) {
      // Both sides of a plate are at one place: the ray meets the side that it looks at.
      take(part, exit, exit.t, true, false);
    }
  }
  void take_solid(const Part& part, const End& enter) {
    const double t = std::max(enter.t, 0.0);
    if (is_in_cell(t)) take(part, enter, t, false, enter.t < 0.0);
  }

  const VoxelRegistry& types_;
  const Ray& ray_;
  double max_t_;
  ShapeParts parts_;
  BoxRay straight_;
  double room_;
  double begin_ = 0.0;
  double end_ = 0.0;
  Part best_;
  End best_end_;
  bool found_ = false;
  bool is_exit_ = false;
  bool is_inside_ = false;
};

}  // namespace

Vec3 ShapeSpan::normal(const End& end) const {
  if (end.face >= 0) return shape.model->faces[static_cast<std::size_t>(end.face)].normal;
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

void visit_shape(const ShapesAtVoxel& here, const ListedShape& shape, const Ray& ray_in_grid, BoxRay& straight,
                 FunctionRef<void(const ShapeSpan&)> visit) {
  const PlacedShape placed{shape.voxel(here.voxel()), shape.type, shape.model};
  cross_shape(here, shape, ray_in_grid, straight, 0.0, std::numeric_limits<double>::infinity(),
              [&](const ModelBox* box, const ShapeSpan::End& enter, const ShapeSpan::End& exit) {
                visit({placed, box, enter, exit});
              });
}

bool first_shape(const TracedShapes& shapes, const VoxelRegistry& types, const Ray& ray_in_grid, double max_t,
                 ShapeParts parts, ShapeHit& hit) {
  if (!trace::is_usable(ray_in_grid, max_t)) return false;
  ShapeIndex::Reader reader(shapes.index);
  trace::Walk walk(shapes.touched, ray_in_grid);
  if (!walk.enter(shapes.touched.bounds(), max_t)) return false;
  ShapeRay ray(types, ray_in_grid, max_t, parts);
  if (!ray.meet_cells(walk, reader)) return false;
  hit = ray.hit();
  return true;
}

namespace {

// A voxel that a ray enters at `t` through a plane of `axis`; -1: it starts there. Without default values, so that
// packets of them need not be cleared.
struct Entry {
  IVec3 voxel;
  double t;
  int axis;
};

// Adds the rest of a ray that enters a voxel to a packet. Its origin is within the voxel, for any rounding.
void keep_rest(const Ray& ray, const Entry& entry, double max_t, int lane, RayPacket& rest) {
  const auto i = static_cast<std::size_t>(lane);
  DVec3 at = ray.origin + entry.t * ray.direction;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = entry.voxel[axis];
    const double high = low + (1.0 - 0x1p-20);
    if (axis == entry.axis) at[axis] = ray.direction[axis] > 0.0 ? low : high;
    at[axis] = at[axis] < low ? low : at[axis] > high ? high : at[axis];
  }
  rest.origin_x[i] = at.x, rest.origin_y[i] = at.y, rest.origin_z[i] = at.z;
  rest.max_t[i] = std::max(max_t - entry.t, 0.0);
  rest.active |= 1U << lane;
}

// Returns the entry of a whole ray into a voxel that its rest enters through a face.
Entry entry_through(const RayHit& hit, const Ray& ray, const DVec3& inverse) {
  const int axis = frame_of(hit.face).axis;
  const double plane = hit.voxel[axis] + (ray.direction[axis] > 0.0 ? 0.0 : 1.0);
  return {hit.voxel, (plane - ray.origin[axis]) * inverse[axis], axis};
}

// The rays of a packet among the solids of a grid: opaque voxels and shapes. The rest of a ray that passes shapes
// starts in the first voxel that no shape touches, so that the kernels for packets find its next solid. Neighbouring
// rays share the last reads of lists and trees.
class SolidRays {
 public:
  SolidRays(const TracedShapes& shapes, const Grid& voxels, const VoxelRegistry& types, const RayPacket& packet)
      : types_(types),
        voxels_(voxels),
        packet_(&packet),
        rest_(packet),
        shapes_(shapes.index),
        walk_(shapes.solid),
        bounds_(unite(shapes.solid.bounds(), shapes.touched.bounds())) {
    rest_.active = 0;
  }
  void set_packet(const RayPacket& packet) {
    packet_ = &packet;
    rest_ = packet;
    rest_.active = 0;
  }

  enum class Way : std::uint8_t { InShape, InCube, Ends, GoesOn };

  // Follows a ray through the voxels that shapes touch, beginning with one of them and its shapes. If the ray goes on
  // in another voxel, its rest starts there.
  Way follow(int lane, const Entry& entry, ShapesAtVoxel here, ShapeRay& ray, const Ray& in_grid) {
    const double max_t = max_t_of(lane);
    walk_.set_ray(in_grid, ray.inverse());
    walk_.begin(bounds_, entry.voxel, entry.t, entry.axis);
    do {
      if (is_opaque(here)) return Way::InCube;
      if (ray.meet_cell(here, walk_)) return Way::InShape;
      if (!walk_.is_within(max_t)) return Way::Ends;
      here = shapes_at(walk_.voxel());
    } while (!here.empty());
    keep_rest(lane, in_grid, max_t);
    return Way::GoesOn;
  }
  // Find the first solid on the rest of a ray, and on a ray from its origin on.
  Way find_in_rest(int lane, ShapeRay& ray, const Ray& in_grid) {
    const Entry& entry = entry_of(lane);
    walk_.set_ray(in_grid, ray.inverse());
    walk_.begin(bounds_, entry.voxel, entry.t, entry.axis);
    return find(lane, ray);
  }
  Way find_from_origin(int lane, ShapeRay& ray, const Ray& in_grid) {
    walk_.set_ray(in_grid, ray.inverse());
    return walk_.enter(bounds_, max_t_of(lane)) ? find(lane, ray) : Way::Ends;
  }

  // Returns the shapes that touch a voxel. Neighbouring rays often ask for the same.
  [[nodiscard]] const ShapesAtVoxel& shapes_at(IVec3 voxel) {
    // By single numbers: a vector would be stored and loaded again, in parts of different size.
    if (!is_known_ || voxel.x != known_at_[0] || voxel.y != known_at_[1] || voxel.z != known_at_[2]) {
      known_ = shapes_.at(voxel);
      known_at_[0] = voxel.x, known_at_[1] = voxel.y, known_at_[2] = voxel.z;
      is_known_ = true;
    }
    return known_;
  }
  // Returns the opaque voxel that the last ray met.
  [[nodiscard]] RayHit cube(const Ray& in_grid) const {
    return {walk_.voxel(), trace::face_of(walk_, in_grid), walk_.t(), walk_.axis() < 0};
  }
  // The rests of the rays that go on; these rays are active.
  [[nodiscard]] RayPacket& rest() { return rest_; }
  // Returns the voxel in which the rest of a ray starts.
  [[nodiscard]] const Entry& entry_of(int lane) const { return entries_[static_cast<std::size_t>(lane)]; }
  // Returns the entry into a voxel that the rest of a ray hits, by the whole ray's distance.
  [[nodiscard]] Entry entry_of(int lane, const RayHit& hit, const ShapeRay& ray, const Ray& in_grid) const {
    return hit.starts_inside ? entry_of(lane) : entry_through(hit, in_grid, ray.inverse());
  }

 private:
  // Requires: a solid voxel that shapes touch. A shape of another voxel may reach into an opaque one.
  [[nodiscard]] bool is_opaque(const ShapesAtVoxel& here) const {
    return !here.has_own() && types_.is_opaque(voxels_.get(here.voxel()));
  }
  [[nodiscard]] double max_t_of(int lane) const { return packet_->max_t[static_cast<std::size_t>(lane)]; }

  Way find(int lane, ShapeRay& ray) {
    const double max_t = max_t_of(lane);
    while (walk_.find(max_t)) {
      const ShapesAtVoxel here = shapes_at(walk_.voxel());
      if (here.empty() || is_opaque(here)) return Way::InCube;
      if (ray.meet_cell(here, walk_)) return Way::InShape;
      if (!walk_.is_within(max_t)) break;
    }
    return Way::Ends;
  }

  void keep_rest(int lane, const Ray& in_grid, double max_t) {
    Entry& entry = entries_[static_cast<std::size_t>(lane)];
    entry = {walk_.voxel(), walk_.t(), walk_.axis()};
    quoin::keep_rest(in_grid, entry, max_t, lane, rest_);
  }

  const VoxelRegistry& types_;
  const Grid& voxels_;
  const RayPacket* packet_;
  RayPacket rest_;
  RayPacket::Lanes<Entry> entries_;
  ShapeIndex::Reader shapes_;
  ShapesAtVoxel known_;
  std::array<int, 3> known_at_{};
  bool is_known_ = false;
  trace::Walk walk_;
  IBox bounds_;
};

// A kernel takes about the time in which single walks trace this many rays.
constexpr int kFewRays = 3;

// Takes the hits of a packet over from `SolidRays`.
struct FoundSolids {
  PacketHits& hits;
  RayPacket::Lanes<ShapeHit>& in_shapes;
  std::uint32_t in_shape = 0;

  void take(int lane, SolidRays::Way way, const SolidRays& rays, const ShapeRay& ray, const Ray& in_grid) {
    const std::uint32_t bit = 1U << lane;
    hits.hit &= ~bit;
    hits.starts_inside &= ~bit;
    if (way == SolidRays::Way::InCube) hits.set(lane, rays.cube(in_grid));
    if (way != SolidRays::Way::InShape) return;
    const ShapeHit& hit = in_shapes[static_cast<std::size_t>(lane)] = ray.hit();
    hits.set(lane, {hit.voxel, hit.direction, hit.t, hit.starts_inside});
    in_shape |= bit;
  }
};

// Finds the solids on the rests of rays.
void find_rest(const TracedShapes& shapes, const VoxelRegistry& types, const RayPacket& packet, SolidRays& rays,
               FoundSolids& found) {
  while (rays.rest().active != 0) {
    PacketHits next;
    const bool are_few = std::popcount(rays.rest().active) < kFewRays;
    next.hit = rays.rest().active;
    if (!are_few) first_hits(shapes.solid, rays.rest(), next);
    rays.rest().active = 0;
    for (std::uint32_t left = next.hit; left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      const Ray in_grid = packet.ray(lane);
      ShapeRay ray(types, in_grid, packet.max_t[static_cast<std::size_t>(lane)], ShapeParts::Visible);
      if (are_few) {
        found.take(lane, rays.find_in_rest(lane, ray, in_grid), rays, ray, in_grid);
        continue;
      }
      const Entry entry = rays.entry_of(lane, next[lane], ray, in_grid);
      const ShapesAtVoxel here = rays.shapes_at(entry.voxel);
      if (here.empty()) {
        const Direction face = side_of(entry.axis, in_grid.direction[entry.axis] < 0.0);
        found.hits.set(lane, {entry.voxel, face, entry.t, false});
      } else {
        found.take(lane, rays.follow(lane, entry, here, ray, in_grid), rays, ray, in_grid);
      }
    }
  }
}

// Finds the first solids of the rays whose first solid voxel, in `hits`, is touched by shapes.
std::uint32_t first_of_touching(const TracedShapes& shapes, const Grid& voxels, const VoxelRegistry& types,
                                const RayPacket& packet, std::uint32_t touching, PacketHits& hits,
                                RayPacket::Lanes<ShapeHit>& in_shapes) {
  SolidRays rays(shapes, voxels, types, packet);
  FoundSolids found{hits, in_shapes};
  for (; touching != 0; touching &= touching - 1) {
    const int lane = std::countr_zero(touching);
    const auto i = static_cast<std::size_t>(lane);
    const Ray in_grid = packet.ray(lane);
    ShapeRay ray(types, in_grid, packet.max_t[i], ShapeParts::Visible);
    const bool starts_inside = (hits.starts_inside >> lane & 1U) != 0;
    const IVec3 voxel{hits.x[i], hits.y[i], hits.z[i]};
    const Entry entry{voxel, hits.t[i], starts_inside ? -1 : frame_of(hits.face[i]).axis};
    found.take(lane, rays.follow(lane, entry, rays.shapes_at(voxel), ray, in_grid), rays, ray, in_grid);
  }
  find_rest(shapes, types, packet, rays, found);
  return found.in_shape;
}

}  // namespace

std::uint32_t first_solids(const TracedShapes& shapes, const Grid& voxels, const VoxelRegistry& types,
                           const RayPacket& rays_in_grid, PacketHits& hits, RayPacket::Lanes<ShapeHit>& in_shapes) {
  first_hits(shapes.solid, rays_in_grid, hits);
  ShapeIndex::Reader reader(shapes.index);
  IVec3 last{0};
  ShapesAtVoxel here;
  std::uint32_t touching = 0;
  for (std::uint32_t left = hits.hit; left != 0; left &= left - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(left));
    const bool is_last = left != hits.hit && hits.x[i] == last.x && hits.y[i] == last.y && hits.z[i] == last.z;
    if (!is_last) {
      last = {hits.x[i], hits.y[i], hits.z[i]};
      here = reader.at(last);
    }
    if (!here.empty()) touching |= 1U << i;
  }
  return touching == 0 ? 0 : first_of_touching(shapes, voxels, types, rays_in_grid, touching, hits, in_shapes);
}

namespace {

// Returns the rays of a packet, active in `rays`, that hit visible parts of shapes, or an opaque voxel whose hit rounds
// differently. All hit voxels that shapes touch.
std::uint32_t blocked_by_shapes(const TracedShapes& shapes, const VoxelRegistry& types, const RayPacket& packet,
                                std::uint32_t active, SolidRays& rays) {
  using Way = SolidRays::Way;
  RayPacket& rest = rays.rest();
  rest.active = 0;
  std::uint32_t blocked = 0;
  const auto take = [&](int lane, Way way) {
    if (way == Way::InShape || way == Way::InCube) blocked |= 1U << lane;
  };
  for (std::uint32_t left = active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const Ray in_grid = packet.ray(lane);
    ShapeRay ray(types, in_grid, packet.max_t[static_cast<std::size_t>(lane)], ShapeParts::Visible);
    const IVec3 voxel = voxel_of(in_grid.origin);
    const ShapesAtVoxel here = rays.shapes_at(voxel);
    take(lane, here.empty() ? rays.find_from_origin(lane, ray, in_grid)
                            : rays.follow(lane, {voxel, 0.0, -1}, here, ray, in_grid));
  }
  if (std::popcount(rest.active) >= kFewRays) rest.active = any_hits(shapes.touched, rest);
  for (std::uint32_t left = rest.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const Ray in_grid = packet.ray(lane);
    ShapeRay ray(types, in_grid, packet.max_t[static_cast<std::size_t>(lane)], ShapeParts::Visible);
    take(lane, rays.find_in_rest(lane, ray, in_grid));
  }
  return blocked;
}

}  // namespace

namespace {

// Returns true if a ray meets glass of the shapes that touch a voxel, at or after its origin.
bool meets_glass(const TracedShapes& shapes, const ShapesAtVoxel& here, const Ray& ray, BoxRay& straight) {
  bool is_met = false;
  for (const ListedShape& shape : here.listed()) {
    if (shape.type >= shapes.is_glass.size() || shapes.is_glass[shape.type] == 0) continue;
    cross_shape(here, shape, ray, straight, 0.0, std::numeric_limits<double>::infinity(),
                [&](const ModelBox*, const ShapeSpan::End&, const ShapeSpan::End&) { is_met = true; });
  }
  return is_met;
}

// Returns the entry of a ray into the voxel behind that of its origin.
Entry entry_behind(const Ray& ray, IVec3 voxel, const DVec3& inverse) {
  std::array<double, 3> next;
  for (int axis = 0; axis < 3; ++axis) {
    const double plane = voxel[axis] + (ray.direction[axis] > 0.0 ? 1.0 : 0.0);
    next[static_cast<std::size_t>(axis)] = ray.direction[axis] == 0.0 ? std::numeric_limits<double>::infinity()
                                                                      : (plane - ray.origin[axis]) * inverse[axis];
  }
  int axis = next[0] <= next[1] ? 0 : 1;
  if (next[2] < next[static_cast<std::size_t>(axis)]) axis = 2;
  voxel[axis] += ray.direction[axis] > 0.0 ? 1 : -1;
  return {voxel, next[static_cast<std::size_t>(axis)], axis};
}

}  // namespace

void first_glass(const TracedShapes& shapes, const OccupancyTree& glass_voxels, const RayPacket& rays_in_grid,
                 PacketHits& hits) {
  first_hits(glass_voxels, rays_in_grid, hits);
  if (hits.starts_inside == 0) return;
  RayPacket rest = rays_in_grid;
  rest.active = 0;
  RayPacket::Lanes<Entry> entries;
  ShapeIndex::Reader reader(shapes.index);
  for (std::uint32_t left = hits.starts_inside; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const auto i = static_cast<std::size_t>(lane);
    const IVec3 voxel{hits.x[i], hits.y[i], hits.z[i]};
    const ShapesAtVoxel here = reader.at(voxel);
    if (!here.has_own()) continue;  // or the voxel is a cube of glass
    const Ray ray = rays_in_grid.ray(lane);
    BoxRay straight(ray.origin, ray.direction);
    if (meets_glass(shapes, here, ray, straight)) continue;
    entries[i] = entry_behind(ray, voxel, straight.inverse());
    hits.hit &= ~(1U << lane);
    if (entries[i].t <= rays_in_grid.max_t[i]) keep_rest(ray, entries[i], rays_in_grid.max_t[i], lane, rest);
  }
  hits.starts_inside &= hits.hit;
  if (rest.active == 0) return;
  PacketHits next;
  first_hits(glass_voxels, rest, next);
  for (std::uint32_t left = next.hit; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const Ray ray = rays_in_grid.ray(lane);
    const RayHit hit = next[lane];
    const Entry entry =
        hit.starts_inside ? entries[static_cast<std::size_t>(lane)] : entry_through(hit, ray, 1.0 / ray.direction);
    hits.set(lane, {entry.voxel, side_of(entry.axis, ray.direction[entry.axis] < 0.0), entry.t, false});
  }
}

// Rays that miss both kinds of solids are done after one tree, or rays that hit opaque voxels are.
void any_solids(const TracedShapes& shapes, const OccupancyTree& opaque, const Grid& voxels, const VoxelRegistry& types,
                std::span<const RayPacket> packets_in_grid, std::span<std::uint32_t> blocked, MostRays expected) {
  const bool begins_with_opaque = expected == MostRays::Hit;
  const OccupancyTree& other = begins_with_opaque ? shapes.solid : opaque;
  any_hits(begins_with_opaque ? opaque : shapes.solid, packets_in_grid, blocked);
  std::optional<SolidRays> rays;
  for (std::size_t number = 0; number < packets_in_grid.size(); ++number) {
    const RayPacket& packet = packets_in_grid[number];
    std::uint32_t left = begins_with_opaque ? packet.active & ~blocked[number] : blocked[number];
    if (left == 0) continue;
    if (rays) {
      rays->set_packet(packet);
    } else {
      rays.emplace(shapes, voxels, types, packet);
    }
    rays->rest().active = left;
    const std::uint32_t met = any_hits(other, rays->rest());
    std::uint32_t touching = 0;  // voxels that shapes touch, before any opaque ones
    if (begins_with_opaque) {
      touching = met;
    } else {
      blocked[number] = met;
      touching = left & ~met;
    }
    if (touching != 0) blocked[number] |= blocked_by_shapes(shapes, types, packet, touching, *rays);
  }
}

}  // namespace quoin
