#include "render/light/glass_bodies.h"
#include "scene/tracer/placed_grid.h"

#include <algorithm>
#include <cmath>

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

bool continues(const GlassBody& body, VoxelType type, double t_enter) {
  return type == body.type && reaches(body, t_enter);
}

// The bodies of one placed grid along a ray, in order.
class BodiesOfGrid {
 public:
  BodiesOfGrid(const SceneView& view, const Surfaces& surfaces, std::int32_t index, const Ray& ray_in_grid,
               double max_t, double length, std::vector<GlassBody>& out)
      : placed_(placed_in(view.tracer())[static_cast<std::size_t>(index)]),
        surfaces_(surfaces),
        index_(index),
        ray_(ray_in_grid),
        max_t_(max_t),
        length_(length),
        voxels_per_cell_(placed_.voxels_per_cell()),
        out_(out) {
    QUOIN_ASSERT(placed_.voxel_size > 0.0, "a positive voxel size");
  }

  void add_voxels() {
    begin();
    GridReader voxels_of(*placed_.voxels);
    VoxelType type = kAir;
    const auto largest = [&] { return largest_block(type); };
    const auto enter = [&](IVec3 voxel) { type = voxels_of.get(voxel); };
    trace::visit_blocks(*placed_.transparent, ray_, max_t_, enter, largest, [&](const trace::WalkSpan& span) {
      const double t_exit = std::min(span.t_exit, max_t_);
      const double voxels = voxels_between(span.t_enter, t_exit);
      if (!(voxels > 0.0)) return true;  // an edge that it only touches
      if (out_.size() > first_ && continues(out_.back(), type, span.t_enter)) {
        // Most water voxels are inside the water.
        lengthen(t_exit, span.exit_face, voxels);
      } else {
        GlassBody& next = out_.emplace_back(body_of(span.voxel, type, span.t_enter, t_exit, span.starts_inside));
        next.face = span.face;
        next.exit_face = span.exit_face;
      }
      return is_seen_beyond(type, voxels);
    });
  }

  void add_field() {
    begin();
    const auto largest = [this](VoxelType type) { return largest_block(type); };
    visit_glass(*placed_.glass, ray_, max_t_, largest, [&](const GlassSpan& span) {
      GlassBody next = body_of(span.cell, span.type, span.t_enter, span.t_exit, span.starts_inside);
      next.in_field = next.exit_in_field = true;
      if (out_.size() > first_ && reaches(out_.back(), next.t_enter)) next.before = out_.back().type;
      return add(next);
    });
  }

 private:
  void begin() {
    first_ = out_.size();
    clarity_ = 0.0;
  }

  // Uses blocks only if the body does not close along their diagonal; it then closes at the same voxel as voxel by
  // voxel.
  [[nodiscard]] double largest_block(VoxelType type) const {
    const double closing = -static_cast<double>(surfaces_[type].log_clarity) * voxels_per_cell_ * kDiagonal;
    return (clarity_ - kClosed) / std::max(closing, kLeastClosing);
  }

  [[nodiscard]] GlassBody body_of(IVec3 voxel, VoxelType type, double t_enter, double t_exit,
                                  bool starts_inside) const {
    GlassBody body;
    body.placed = body.exit_placed = index_;
    body.voxel = voxel;
    body.type = type;
    body.starts_inside = starts_inside;
    body.t_enter = t_enter;
    body.t_exit = t_exit;
    body.voxels = voxels_between(t_enter, t_exit);
    return body;
  }
  [[nodiscard]] double voxels_between(double t_enter, double t_exit) const {
    return (t_exit - t_enter) * length_ / placed_.voxel_size * voxels_per_cell_;
  }

  void lengthen(double t_exit, Direction exit_face, double voxels) {
    GlassBody& body = out_.back();
    body.t_exit = t_exit;
    body.exit_face = exit_face;
    body.voxels += voxels;
  }
  bool is_seen_beyond(VoxelType type, double voxels) {
    clarity_ += static_cast<double>(surfaces_[type].log_clarity) * voxels;
    return clarity_ > kClosed;
  }

  // Returns false if nothing behind the body is visible.
  bool add(const GlassBody& next) {
    if (!(next.voxels > 0.0)) return true;  // an edge that it only touches
    if (out_.size() > first_ && continues(out_.back(), next.type, next.t_enter)) {
      lengthen(next.t_exit, next.exit_face, next.voxels);
    } else {
      out_.push_back(next);
    }
    return is_seen_beyond(next.type, next.voxels);
  }

  const PlacedGrid& placed_;
  const Surfaces& surfaces_;
  std::int32_t index_;
  const Ray& ray_;
  double max_t_;
  double length_;  // of the ray's direction, in the world
  double voxels_per_cell_;
  std::vector<GlassBody>& out_;
  std::size_t first_ = 0;
  double clarity_ = 0.0;
};

// Sorts bodies along the ray and joins those of neighbouring grids that touch.
void join_touching(std::vector<GlassBody>& bodies) {
  std::sort(bodies.begin(), bodies.end(), [](const GlassBody& a, const GlassBody& b) {
    return a.t_enter != b.t_enter ? a.t_enter < b.t_enter : a.placed < b.placed;
  });
  std::size_t kept = 0;
  for (std::size_t i = 1; i < bodies.size(); ++i) {
    if (continues(bodies[kept], bodies[i].type, bodies[i].t_enter)) {
      if (bodies[i].t_exit > bodies[kept].t_exit) {
        bodies[kept].t_exit = bodies[i].t_exit;
        bodies[kept].exit_placed = bodies[i].exit_placed;
        bodies[kept].exit_face = bodies[i].exit_face;
        bodies[kept].exit_in_field = bodies[i].exit_in_field;
      }
      bodies[kept].voxels += bodies[i].voxels;
    } else {
      bodies[++kept] = bodies[i];
    }
  }
  if (!bodies.empty()) bodies.resize(kept + 1);
}

}  // namespace

void find_glass(const SceneView& view, const Surfaces& surfaces, const Ray& ray_in_view, double max_t,
                std::vector<GlassBody>& out) {
  out.clear();
  const double length = glm::length(ray_in_view.direction);
  view.visit_transparent(ray_in_view, max_t, [&](std::int32_t index, const Ray& ray) {
    QUOIN_ASSERT(static_cast<std::size_t>(index) < placed_in(view.tracer()).size(), "one of the placed grids");
    const PlacedGrid& placed = placed_in(view.tracer())[static_cast<std::size_t>(index)];
    BodiesOfGrid bodies(view, surfaces, index, ray, max_t, length, out);
    if (placed.transparent != nullptr) bodies.add_voxels();
    if (placed.glass != nullptr) bodies.add_field();
  });
  join_touching(out);
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
  if (!body.in_field) return DVec3(normal_of(body.face));
  const DVec3 point = view.grid_from_view(body.placed).point(ray_in_view.origin + ray_in_view.direction * body.t_enter);
  const PlacedGrid& placed = placed_in(view.tracer())[static_cast<std::size_t>(body.placed)];
  QUOIN_ASSERT(placed.glass != nullptr, "a grid with transparent field parts");
  return glass_normal(*placed.glass, body.voxel, point, body.type, body.before);
}

DVec3 normal_left(const SceneView& view, const Ray& ray_in_view, const GlassBody& body) {
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

Vec3 transmittance_along(const SceneView& view, const Surfaces& surfaces, const Ray& ray_in_view, double max_t) {
  Vec3 passed(1.0F);
  std::vector<GlassBody> bodies;
  find_glass(view, surfaces, ray_in_view, max_t, bodies);
  for (const GlassBody& body : bodies) passed *= look_of(surfaces[body.type], body).passed;
  return passed;
}

}  // namespace quoin
