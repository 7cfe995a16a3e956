#include "render/light/glass_bodies.h"
#include "scene/tracer/placed_grid.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "render/light/light_model.h"
#include "trace/density/density_glass.h"
#include "trace/walk.h"

namespace quoin {
namespace {

// Natural logarithm of the transmittance where a body starts to count as opaque: a sixteenth of the smallest step of an
// 8-bit image.
constexpr double kClosed = -11.0;

constexpr double kDiagonal = 1.7320508075688774;  // of a cube of 1
constexpr double kLeastClosing = 1e-9;            // for clear materials
constexpr double kLargestBlock = 64.0;            // of one type in a tree
constexpr double kThinnest = 1e-9;                // length in voxels of a plate, which has none

bool continues(const Surfaces& surfaces, const GlassBody& body, VoxelType type, double t_enter) {
  return surfaces.joins(type, body.type) && reaches(body, t_enter);
}

// Returns the alpha of a translucent texel, 0 to 1.
float alpha_of(Rgba8 texel) {
  return static_cast<float>(texel.a) / 255.0F;
}

// The part of a shape's glass within a cell. `look`: of the side where the ray enters; null if it has no texture.
struct ShapePart {
  double t_enter;
  double t_exit;
  double voxels;
  ShapeSpan span;
  const VoxelFace* look;
};

// The bodies of one placed grid along a ray, in order.
class BodiesOfGrid {
 public:
  BodiesOfGrid(const SceneView& view, const Surfaces& surfaces, std::int32_t index, const Ray& ray_in_grid,
               double max_t, double length, SeenThrough& out)
      : placed_(placed_in(view.tracer())[static_cast<std::size_t>(index)]),
        types_(&view.tracer().scene().types),
        surfaces_(surfaces),
        index_(index),
        ray_(ray_in_grid),
        max_t_(max_t),
        length_(length),
        voxels_per_cell_(placed_.voxels_per_cell()),
        out_(out.bodies),
        faces_(out.faces) {
    QUOIN_ASSERT(placed_.voxel_size > 0.0, "a positive voxel size");
  }

  // Finds the faces of cells. If one ends the ray, glass that is added later ends there. `first`: the first cell, if it
  // is known, as for `add_glass`.
  void add_faces(const RayHit* first) {
    GridReader voxels_of(*placed_.voxels);
    const ShapeIndex* const shapes = placed_.shapes == nullptr ? nullptr : &placed_.shapes->index;
    visit_spans(
        *placed_.face_cells, first, [](trace::Walk& walk, const trace::WalkSpan&) { walk.leave_voxel(); },
        [&](const trace::WalkSpan& span) {
          const VoxelType type = voxels_of.get(span.voxel);
          if (meet_cell(surfaces_, voxels_of, shapes, index_, type, ray_, cell_span(span), max_t_, faces_)) return true;
          max_t_ = faces_.back().t;
          return false;
        });
  }
  [[nodiscard]] double end() const { return max_t_; }

  // Two loops, so that worlds without textures and shapes pay nothing.
  void add_glass(const RayHit* first) {
    if (placed_.shapes != nullptr || (placed_.level == 0 && surfaces_.has_textured_glass())) {
      return add_other_glass(first);
    }
    add_plain_glass();
  }

  void add_field() {
    begin();
    const auto largest = [this](VoxelType type) { return largest_block(surfaces_[type].log_clarity); };
    visit_glass(*placed_.glass, ray_, max_t_, largest, [&](const GlassSpan& span) {
      GlassBody next;
      fill_in(next, span.cell, span.type, span.t_enter, span.t_exit);
      next.starts_inside = span.starts_inside;
      next.voxels = voxels_between(span.t_enter, span.t_exit);
      next.in_field = next.exit_in_field = true;
      if (out_.size() > first_ && reaches(out_.back(), next.t_enter)) next.before = out_.back().type;
      return add(next);
    });
  }

 private:
  enum class Part : std::uint8_t { Cubes, Shapes };
  static constexpr std::size_t kNoBody = std::numeric_limits<std::size_t>::max();
  // The body of the list that last got a part.
  struct LastBody {
    std::size_t index = kNoBody;
    float log_clarity = 0.0F;  // per voxel
  };
  [[nodiscard]] LastBody& last(Part part) { return last_[static_cast<std::size_t>(part)]; }

  // Flat, as the only loop of its kind would be: with two loops GCC no longer inlines the walk (3 % of an image).
  __attribute__((flatten)) void add_plain_glass() {
    begin();
    GridReader voxels_of(*placed_.voxels);
    VoxelType type = kAir;
    const auto largest = [&] { return largest_block(surfaces_[type].log_clarity); };
    const auto enter = [&](const trace::WalkSpan& begun) { type = voxels_of.get(begun.voxel); };
    trace::visit_blocks(*placed_.glass_voxels, ray_, max_t_, enter, largest, [&](const trace::WalkSpan& span) {
      return add_span(span, type, surfaces_[type].log_clarity, nullptr, back_reached(type, span.t_enter));
    });
  }

  // With textured glass and shapes.
  __attribute__((noinline)) void add_other_glass(const RayHit* first) {
    begin();
    GridReader voxels_of(*placed_.voxels);
    const bool has_textures = placed_.level == 0 && surfaces_.has_textured_glass();
    std::optional<ShapeIndex::Reader> shapes;
    if (placed_.shapes != nullptr) shapes.emplace(placed_.shapes->index);
    std::optional<BoxRay> straight;
    VoxelType type = kAir;
    float log_clarity = 0.0F;
    bool is_textured = false;
    Rgba8 texel;
    ShapesAtVoxel here;
    const auto largest = [&] { return largest_block(log_clarity); };
    const auto enter = [&](const trace::WalkSpan& begun) {
      type = voxels_of.get(begun.voxel);
      log_clarity = surfaces_[type].log_clarity;
      is_textured = false;
      const TypeFaces* const faces = has_textures ? surfaces_.faces(type) : nullptr;
      if (faces == nullptr || faces->content != CellContent::TexturedGlass) return;
      is_textured = enter_textured(*faces, type, begun, texel, log_clarity);
    };
    const auto leave = [&](trace::Walk& walk, const trace::WalkSpan& begun) {
      const int size = walk.block_size();
      // Shapes touch no voxel of a larger block.
      here = size > 1 || !shapes ? ShapesAtVoxel() : shapes->at(begun.voxel);
      if (!here.empty()) return walk.leave_voxel();
      enter(begun);
      walk.leave_block(size, largest);
    };
    const auto add_cubes = [&](const trace::WalkSpan& span) {
      GlassBody* const body = body_reached(Part::Cubes, type, span.t_enter);
      return add_span(span, type, log_clarity, is_textured ? &texel : nullptr, body);
    };
    visit_spans(*placed_.glass_voxels, first, leave, [&](const trace::WalkSpan& span) {
      if (here.empty()) return add_cubes(span);
      if (!straight) straight.emplace(ray_.origin, ray_.direction);
      if (!here.has_own() && is_glass_cube(voxels_of.get(span.voxel), span.voxel)) {
        enter(span);
        if (!add_cubes(span)) return false;
      }
      return add_shapes(here, span, *straight);
    });
  }

  template <class Leave, class Visit>
  void visit_spans(const OccupancyTree& tree, const RayHit* first, const Leave& leave, const Visit& visit) {
    if (first == nullptr) return trace::visit_spans(tree, ray_, max_t_, leave, visit);
    trace::Walk walk(tree, ray_);
    walk.begin(tree.bounds(), first->voxel, first->t, first->starts_inside ? -1 : frame_of(first->face).axis);
    trace::visit_spans(walk, ray_, max_t_, leave, visit);
  }

  // Returns true if a voxel that shapes of others touch is itself a cube of glass.
  [[nodiscard]] bool is_glass_cube(VoxelType type, IVec3 voxel) const {
    if (!types_->is_transparent(type)) return false;
    if (types_->is_shaped(type)) return placed_.shapes->index.is_cube(voxel);
    const TypeFaces* const faces = surfaces_.faces(type);
    return faces == nullptr || faces->content != CellContent::Faces;
  }

  // Adds the glass of the shapes that touch a cell. Returns false if nothing behind it is visible.
  bool add_shapes(const ShapesAtVoxel& here, const trace::WalkSpan& cell, BoxRay& straight) {
    const std::vector<std::uint8_t>& is_glass = placed_.shapes->is_glass;
    parts_.clear();
    for (const ListedShape& shape : here.listed()) {
      if (shape.type >= is_glass.size() || is_glass[shape.type] == 0) continue;
      visit_shape(here, shape, ray_, straight, [&](const ShapeSpan& span) { note_part(span, cell); });
    }
    if (parts_.size() > 1) {
      std::sort(parts_.begin(), parts_.end(),
                [](const ShapePart& a, const ShapePart& b) { return a.t_enter < b.t_enter; });
    }
    return std::ranges::all_of(parts_, [this](const ShapePart& part) { return add(part); });
  }

  // Finds the texel of textured glass that continues or begins with a span, and its absorption. Returns false if the
  // ray began inside.
  [[nodiscard]] bool enter_textured(const TypeFaces& faces, VoxelType type, const trace::WalkSpan& begun, Rgba8& texel,
                                    float& log_clarity) {
    if (const GlassBody* const body = body_reached(Part::Cubes, type, begun.t_enter)) {
      log_clarity = last(Part::Cubes).log_clarity;
      return body->is_textured;
    }
    if (begun.starts_inside) return false;
    const FaceTexels& side = faces.sides[static_cast<std::size_t>(begun.face)];
    texel = side.texel(ray_.origin + ray_.direction * begun.t_enter, begun.voxel, 0);
    log_clarity = std::log(1.0F - side.cover(texel));
    return true;
  }
  static CellSpan cell_span(const trace::WalkSpan& span) {
    return {span.voxel, span.behind, span.face, span.exit_face, span.starts_inside, span.t_enter, span.t_exit};
  }

  // Adds a span to a body, or if that is null as a new one with a texel, if there is one. Returns false if nothing
  // behind it is visible.
  bool add_span(const trace::WalkSpan& span, VoxelType type, float log_clarity, const Rgba8* texel, GlassBody* body) {
    const double t_exit = std::min(span.t_exit, max_t_);
    const double voxels = voxels_between(span.t_enter, t_exit);
    if (!(voxels > 0.0)) return true;  // an edge that it only touches
    if (body != nullptr) {
      // Most water voxels are inside the water.
      lengthen(*body, t_exit, span.exit_face, voxels);
    } else {
      GlassBody& next = out_.emplace_back();  // filled in place
      fill_in(next, span.voxel, type, span.t_enter, t_exit);
      next.starts_inside = span.starts_inside;
      next.voxels = voxels;
      next.face = span.face;
      next.exit_face = span.exit_face;
      last(Part::Cubes) = {out_.size() - 1, log_clarity};
      if (texel != nullptr) {
        next.is_textured = true;
        next.texel = *texel;
      }
    }
    return is_seen_beyond(log_clarity, voxels);
  }

  void begin() {
    first_ = out_.size();
    clarity_ = 0.0;
    last_ = {};
  }

  // Returns the newest body if content of a type that begins at `t_enter` continues it; else null.
  [[nodiscard]] GlassBody* back_reached(VoxelType type, double t_enter) {
    return out_.size() > first_ && continues(surfaces_, out_.back(), type, t_enter) ? &out_.back() : nullptr;
  }

  // As above. Content also continues the last body that got content of its own kind: a pane that reaches into a cube of
  // glass splits neither.
  [[nodiscard]] GlassBody* body_reached(Part part, VoxelType type, double t_enter) {
    LastBody& own = last(part);
    if (GlassBody* const back = back_reached(type, t_enter)) {
      if (own.index != out_.size() - 1) own = last(part == Part::Cubes ? Part::Shapes : Part::Cubes);
      QUOIN_ASSERT(own.index == out_.size() - 1, "the newest body has cubes or shapes");
      return back;
    }
    if (own.index == kNoBody) return nullptr;
    GlassBody& body = out_[own.index];
    return continues(surfaces_, body, type, t_enter) ? &body : nullptr;
  }

  // Uses blocks only if the body does not close along their diagonal; it then closes at the same voxel as voxel by
  // voxel.
  [[nodiscard]] double largest_block(float log_clarity) const {
    const double closing = -static_cast<double>(log_clarity) * voxels_per_cell_ * kDiagonal;
    return (clarity_ - kClosed) / std::max(closing, kLeastClosing);
  }

  void fill_in(GlassBody& body, IVec3 voxel, VoxelType type, double t_enter, double t_exit) const {
    body.placed = body.exit_placed = index_;
    body.voxel = voxel;
    body.type = type;
    body.t_enter = t_enter;
    body.t_exit = t_exit;
  }
  [[nodiscard]] double voxels_between(double t_enter, double t_exit) const {
    return (t_exit - t_enter) * length_ / placed_.voxel_size * voxels_per_cell_;
  }

  static void lengthen(GlassBody& body, double t_exit, Direction exit_face, double voxels) {
    body.exit_in_shape = false;
    body.t_exit = t_exit;
    body.exit_face = exit_face;
    body.voxels += voxels;
  }
  bool is_seen_beyond(float log_clarity, double voxels) {
    clarity_ += static_cast<double>(log_clarity) * voxels;
    return clarity_ > kClosed;
  }

  // Notes the part of a shape's glass within a cell.
  void note_part(const ShapeSpan& span, const VoxelSpan& cell) {
    const ShapeModel& model = *span.shape.model;
    const bool is_plate = span.enter.t == span.exit.t;
    const double t_enter = std::max(span.enter.t, cell.t_enter);
    const double t_exit = std::min({span.exit.t, cell.t_exit, max_t_});
    if (is_plate ? t_enter != span.enter.t || t_exit != span.exit.t : !(t_enter < t_exit)) return;
    const bool starts_inside = span.starts_inside();
    if (!starts_inside && span.enter.face < 0) return;
    const ModelFace* const face = starts_inside ? nullptr : &model.faces[static_cast<std::size_t>(span.enter.face)];
    const VoxelFace* const look = face == nullptr ? nullptr : look_of(model, *face, (*types_)[span.shape.type].faces);
    const bool has_texture = look != nullptr && !look->texture.is_null();
    if (has_texture && look->alpha != FaceAlpha::Translucent) return;  // no glass
    const double voxels = is_plate ? kThinnest : voxels_between(t_enter, t_exit);
    parts_.push_back({t_enter, t_exit, voxels, span, has_texture ? look : nullptr});
  }

  // Return false if nothing behind the body, or part, is visible.
  bool add(const GlassBody& next) {
    if (!(next.voxels > 0.0)) return true;  // an edge that it only touches
    if (GlassBody* const body = back_reached(next.type, next.t_enter)) {
      if (next.t_exit <= body->t_exit) return true;
      lengthen(*body, next.t_exit, next.exit_face, next.voxels);
    } else {
      out_.push_back(next);
    }
    return is_seen_beyond(surfaces_[next.type].log_clarity, next.voxels);
  }
  bool add(const ShapePart& part) {
    if (!(part.voxels > 0.0)) return true;  // an edge that it only touches
    const ShapeSpan& span = part.span;
    GlassBody* body = body_reached(Part::Shapes, span.shape.type, part.t_enter);
    if (body != nullptr) {
      if (part.t_exit <= body->t_exit) return true;  // within it: the same box in another cell, or crossing plates
      lengthen(*body, part.t_exit, direction_of(span, span.exit), part.voxels);
    } else {
      body = &begin_body(part);
    }
    body->exit_in_shape = true;
    body->exit_normal = span.normal(span.exit);
    return is_seen_beyond(last(Part::Shapes).log_clarity, part.voxels);
  }

  GlassBody& begin_body(const ShapePart& part) {
    const ShapeSpan& span = part.span;
    GlassBody& body = out_.emplace_back();
    fill_in(body, span.shape.voxel, span.shape.type, part.t_enter, part.t_exit);
    body.starts_inside = span.starts_inside();
    body.voxels = part.voxels;
    body.model = span.shape.model;
    body.shape_face = body.starts_inside ? std::int16_t{-1} : span.enter.face;
    body.normal = span.normal(span.enter);
    body.face = direction_of(span, span.enter);
    body.exit_face = direction_of(span, span.exit);
    last(Part::Shapes) = {out_.size() - 1, surfaces_[body.type].log_clarity};
    if (part.look == nullptr) return body;
    const DVec3 point = ray_.origin + ray_.direction * span.enter.t - DVec3(body.voxel);
    body.is_textured = true;
    body.texel = shape_texel(body.model->faces[static_cast<std::size_t>(span.enter.face)], *part.look, point);
    body.look = part.look;
    last(Part::Shapes).log_clarity = std::log(1.0F - alpha_of(body.texel));
    return body;
  }

  // Returns the direction nearest to the normal at an end.
  static Direction direction_of(const ShapeSpan& span, const ShapeSpan::End& end) {
    if (span.box != nullptr && !span.box->is_turned) return end.side;
    return nearest_direction(DVec3(span.normal(end)));
  }

  const PlacedGrid& placed_;
  const VoxelRegistry* types_;
  const Surfaces& surfaces_;
  std::int32_t index_;
  const Ray& ray_;
  double max_t_;
  double length_;  // of the ray's direction, in the world
  double voxels_per_cell_;
  std::vector<GlassBody>& out_;
  std::vector<MetFace>& faces_;
  std::vector<ShapePart> parts_;  // in the cell that the ray is in
  std::size_t first_ = 0;
  double clarity_ = 0.0;
  std::array<LastBody, 2> last_{};  // by Part
};

// Sorts bodies along the ray and joins those of neighbouring grids that touch.
void join_touching(const Surfaces& surfaces, std::vector<GlassBody>& bodies) {
  std::sort(bodies.begin(), bodies.end(), [](const GlassBody& a, const GlassBody& b) {
    return a.t_enter != b.t_enter ? a.t_enter < b.t_enter : a.placed < b.placed;
  });
  std::size_t kept = 0;
  for (std::size_t i = 1; i < bodies.size(); ++i) {
    if (continues(surfaces, bodies[kept], bodies[i].type, bodies[i].t_enter)) {
      if (bodies[i].t_exit > bodies[kept].t_exit) {
        bodies[kept].t_exit = bodies[i].t_exit;
        bodies[kept].exit_placed = bodies[i].exit_placed;
        bodies[kept].exit_face = bodies[i].exit_face;
        bodies[kept].exit_in_field = bodies[i].exit_in_field;
        bodies[kept].exit_in_shape = bodies[i].exit_in_shape;
        bodies[kept].exit_normal = bodies[i].exit_normal;
      }
      bodies[kept].voxels += bodies[i].voxels;
    } else {
      bodies[++kept] = bodies[i];
    }
  }
  if (!bodies.empty()) bodies.resize(kept + 1);
}

// Sorts the faces, and removes everything behind the first face that hides it.
void end_at_first_closed(SeenThrough& seen) {
  std::vector<MetFace>& faces = seen.faces;
  std::stable_sort(faces.begin(), faces.end(), [](const MetFace& a, const MetFace& b) { return a.t < b.t; });
  const auto closed = std::ranges::find_if(faces, [](const MetFace& face) { return face.cover >= 1.0F; });
  if (closed == faces.end()) return;
  faces.erase(closed + 1, faces.end());
  seen.end = faces.back().t;
  std::erase_if(seen.bodies, [&](const GlassBody& body) { return body.t_enter >= seen.end; });
  for (GlassBody& body : seen.bodies) {
    if (!(body.t_exit > seen.end)) continue;
    body.voxels *= (seen.end - body.t_enter) / (body.t_exit - body.t_enter);
    body.t_exit = seen.end;
  }
}

}  // namespace

void find_transparent(const SceneView& view, const Surfaces& surfaces, const Ray& ray_in_view, double max_t,
                      SeenThrough& out) {
  out.clear();
  out.end = max_t;
  const double length = glm::length(ray_in_view.direction);
  int lists = 0;  // of bodies, each in order and joined
  view.visit_transparent(ray_in_view, max_t, [&](std::int32_t index, const Ray& ray) {
    QUOIN_ASSERT(static_cast<std::size_t>(index) < placed_in(view.tracer()).size(), "one of the placed grids");
    const PlacedGrid& placed = placed_in(view.tracer())[static_cast<std::size_t>(index)];
    BodiesOfGrid bodies(view, surfaces, index, ray, out.end, length, out);
    lists += (placed.glass_voxels != nullptr ? 1 : 0) + (placed.glass != nullptr ? 1 : 0);
    if (placed.face_cells != nullptr) bodies.add_faces(nullptr);
    out.end = bodies.end();
    if (placed.glass_voxels != nullptr) bodies.add_glass(nullptr);
    if (placed.glass != nullptr) bodies.add_field();
  });
  if (lists > 1) join_touching(surfaces, out.bodies);
  if (!out.faces.empty()) end_at_first_closed(out);
}

void find_transparent(const SceneView& view, const Surfaces& surfaces, const ThroughHits& hits, int lane, double max_t,
                      SeenThrough& out) {
  const Ray ray = hits.rays.ray(lane);
  if (!hits.has_first) return find_transparent(view, surfaces, ray, max_t, out);
  out.clear();
  out.end = max_t;
  const PlacedGrid& placed = placed_in(view.tracer()).front();
  BodiesOfGrid bodies(view, surfaces, 0, ray, max_t, glm::length(ray.direction) * placed.voxel_size, out);
  const auto first = [&](const PacketHits& of, const auto& add) {
    if ((of.hit >> lane & 1U) == 0) return;
    const RayHit hit = of[lane];
    if (hit.t <= bodies.end()) add(&hit);
  };
  first(hits.first_faces, [&](const RayHit* hit) { bodies.add_faces(hit); });
  out.end = bodies.end();
  first(hits.first_glass, [&](const RayHit* hit) { bodies.add_glass(hit); });
  if (placed.glass != nullptr) bodies.add_field();
  if (placed.glass_voxels != nullptr && placed.glass != nullptr) join_touching(surfaces, out.bodies);
  if (!out.faces.empty()) end_at_first_closed(out);
}

namespace {

// Returns true if a cell of faces ends a ray, beginning with the first one that it hits, of a packet's `hits`.
bool ends_at_face(const PlacedGrid& placed, const Surfaces& surfaces, std::int32_t index, const RayPacket& rays,
                  const PacketHits& hits, int lane, GridReader& voxels, std::vector<MetFace>& room) {
  const auto i = static_cast<std::size_t>(lane);
  const Ray ray = rays.ray(lane);
  const double max_t = rays.max_t[i];
  const ShapeIndex* const shapes = placed.shapes == nullptr ? nullptr : &placed.shapes->index;
  const bool starts_inside = (hits.starts_inside >> lane & 1U) != 0;
  trace::Walk walk(*placed.face_cells, ray);
  walk.begin(placed.face_cells->bounds(), {hits.x[i], hits.y[i], hits.z[i]}, hits.t[i],
             starts_inside ? -1 : frame_of(hits.face[i]).axis);
  do {
    CellSpan cell{walk.voxel(), {}, trace::face_of(walk, ray), Direction::PosX, walk.axis() < 0, walk.t(), 0.0};
    walk.leave_voxel();
    cell.behind = walk.voxel();
    cell.exit_face = opposite(trace::face_of(walk, ray));
    cell.t_exit = walk.t();
    room.clear();
    if (!meet_cell(surfaces, voxels, shapes, index, voxels.get(cell.first), ray, cell, max_t, room)) return true;
  } while (walk.is_within(max_t) && walk.find(max_t));
  return false;
}

}  // namespace

std::uint32_t ends_at_faces(const SceneView& view, const Surfaces& surfaces, std::int32_t home,
                            const RayPacket& rays_in_grid, std::uint32_t& met) {
  met = 0;
  std::vector<MetFace> room;
  return view.visit_face_cells(home, rays_in_grid,
                               [&](std::int32_t index, const RayPacket& rays, const PacketHits& hits) {
                                 const PlacedGrid& placed = placed_in(view.tracer())[static_cast<std::size_t>(index)];
                                 GridReader voxels(*placed.voxels);
                                 std::uint32_t ended = 0;
                                 for (std::uint32_t left = hits.hit; left != 0; left &= left - 1) {
                                   const int lane = std::countr_zero(left);
                                   if (ends_at_face(placed, surfaces, index, rays, hits, lane, voxels, room))
                                     ended |= 1U << lane;
                                 }
                                 met |= hits.hit;
                                 return ended;
                               });
}

Surface textured_surface(const Surfaces& surfaces, const GlassBody& body) {
  QUOIN_ASSERT(body.is_textured, "textured glass");
  Surface surface = surfaces[body.type];
  if (body.look != nullptr) {
    surface.colour = linear_colour(body.texel) * linear_colour(body.look->tint);
    surface.emitted = surface.colour * (surface.emission * emission_factor(*body.look));
    set_absorption(alpha_of(body.texel), surface);
    return surface;
  }
  const TypeFaces* const faces = surfaces.faces(body.type);
  QUOIN_ASSERT(faces != nullptr, "a type with textures");
  const FaceTexels& side = faces->sides[static_cast<std::size_t>(body.face)];
  surface.colour = side.colour(body.texel);
  surface.emitted = surface.colour * side.emission;
  set_absorption(side.cover(body.texel), surface);
  return surface;
}

GlassLook look_of(const Surface& surface, const GlassBody& body) {
  const auto length = static_cast<float>(std::max(body.voxels, body.starts_inside || body.in_field ? 0.0 : 1.0));
  // A length of 0 is handled separately: minus infinity times 0 is NaN.
  const auto through = [&](float logarithm) { return length > 0.0F ? std::exp(logarithm * length) : 1.0F; };
  GlassLook look;
  for (int channel = 0; channel < 3; ++channel) look.passed[channel] = through(surface.log_transmittance[channel]);
  look.own = 1.0F - through(surface.log_clarity);
  return look;
}

bool lies_on_opaque(const SceneView& view, const Ray& ray_in_view, const GlassBody& body, double t) {
  QUOIN_ASSERT(static_cast<std::size_t>(body.exit_placed) < placed_in(view.tracer()).size(), "a body in the view");
  const PlacedGrid& placed = placed_in(view.tracer())[static_cast<std::size_t>(body.exit_placed)];
  return t <= body.t_exit + kRayLift * placed.voxel_size / glm::length(ray_in_view.direction);
}

DVec3 normal_entered(const SceneView& view, const Ray& ray_in_view, const GlassBody& body) {
  if (body.model != nullptr) return DVec3(body.normal);
  if (!body.in_field) return DVec3(normal_of(body.face));
  const DVec3 point = view.grid_from_view(body.placed).point(ray_in_view.origin + ray_in_view.direction * body.t_enter);
  const PlacedGrid& placed = placed_in(view.tracer())[static_cast<std::size_t>(body.placed)];
  QUOIN_ASSERT(placed.glass != nullptr, "a grid with transparent field parts");
  return glass_normal(*placed.glass, body.voxel, point, body.type, body.before);
}

DVec3 normal_left(const SceneView& view, const Ray& ray_in_view, const GlassBody& body) {
  if (body.exit_in_shape) return DVec3(body.exit_normal);
  if (!body.exit_in_field) return DVec3(normal_of(body.exit_face));
  const DVec3 point =
      view.grid_from_view(body.exit_placed).point(ray_in_view.origin + ray_in_view.direction * body.t_exit);
  const PlacedGrid& placed = placed_in(view.tracer())[static_cast<std::size_t>(body.exit_placed)];
  QUOIN_ASSERT(placed.glass != nullptr, "a grid with transparent field parts");
  return glass_normal(*placed.glass, IVec3(0), point, body.type, kAir);
}

Mirror mirror_at(const SceneView& view, const Ray& ray_in_view, std::int32_t placed, const DVec3& normal_in_grid,
                 float ior, float other_ior) {
  QUOIN_ASSERT(ior > 0.0F && other_ior > 0.0F, "positive indices of refraction");
  QUOIN_ASSERT(static_cast<std::size_t>(placed) < placed_in(view.tracer()).size(), "one of the placed grids");
  const glm::dmat3& axes = placed_in(view.tracer())[static_cast<std::size_t>(placed)].world_axes;
  const Vec3 normal(axes * normal_in_grid);
  const Vec3 direction(glm::normalize(ray_in_view.direction));
  const float along = glm::dot(direction, normal);
  const float cosine = std::min(std::abs(along), 1.0F);
  const float denser = std::max(ior, other_ior) / std::min(ior, other_ior);
  const float inside = std::sqrt(1.0F - (1.0F - cosine * cosine) / (denser * denser));
  const float across = (cosine - denser * inside) / (cosine + denser * inside);
  const float in_plane = (denser * cosine - inside) / (denser * cosine + inside);
  // Along a surface between equal media both are 0 / 0.
  const float share = denser > 1.0F ? 0.5F * (across * across + in_plane * in_plane) : 0.0F;
  return {share, direction.y - 2.0F * along * normal.y};
}

Vec3 transmittance_along(const SceneView& view, const Surfaces& surfaces, const ThroughHits& hits, int lane,
                         double max_t, SeenThrough& room) {
  Vec3 passed(1.0F);
  find_transparent(view, surfaces, hits, lane, max_t, room);
  if (room.is_closed()) return Vec3(0.0F);
  std::optional<Surface> textured;
  for (const GlassBody& body : room.bodies) passed *= look_of(surface_of(surfaces, body, textured), body).passed;
  for (const MetFace& face : room.faces) passed *= face.passed();
  return passed;
}

}  // namespace quoin
