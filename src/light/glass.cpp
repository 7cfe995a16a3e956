#include "light/glass.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "light/light_model.h"
#include "trace/walk.h"

namespace quoin {
namespace {

// ln of the share of light below which a body counts as closed: a sixteenth of the least step of an 8-bit picture.
constexpr double kClosed = -11.0;

constexpr double kDiagonal = 1.7320508075688774;  // of a cube of 1
constexpr double kLeastClosing = 1e-9;            // of what is clear

// Lengths of t within which two bodies touch; the rounding of placed grids.
constexpr double kTouching = 1e-6;

bool continues(const GlassBody& body, const GlassBody& next) {
  return next.type == body.type && reaches(body, next.t_enter);
}

// Puts bodies in the ray's order and makes those one that touch, of neighbouring grids.
void join_touching(std::vector<GlassBody>& bodies) {
  std::sort(bodies.begin(), bodies.end(), [](const GlassBody& a, const GlassBody& b) {
    return a.t_enter != b.t_enter ? a.t_enter < b.t_enter : a.placed < b.placed;
  });
  std::size_t kept = 0;
  for (std::size_t i = 1; i < bodies.size(); ++i) {
    if (continues(bodies[kept], bodies[i])) {
      if (bodies[i].t_exit > bodies[kept].t_exit) {
        bodies[kept].t_exit = bodies[i].t_exit;
        bodies[kept].exit_placed = bodies[i].exit_placed;
        bodies[kept].exit_face = bodies[i].exit_face;
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
    const PlacedGrid& placed = view.tracer().placed()[static_cast<std::size_t>(index)];
    const double voxels_per_cell = placed.voxels_per_cell();
    const std::size_t first = out.size();
    GridReader voxels_of(*placed.voxels);
    VoxelType type = kAir;
    double clarity = 0.0;
    // Blocks along whose diagonal it does not close: it closes at the same voxel as by single ones.
    const auto largest = [&](IVec3 voxel) {
      type = voxels_of.get(voxel);
      const double closing = -static_cast<double>(surfaces[type].log_clarity) * voxels_per_cell * kDiagonal;
      return (clarity - kClosed) / std::max(closing, kLeastClosing);
    };
    trace::visit_blocks(*placed.transparent, ray, max_t, largest, [&](const trace::WalkSpan& span) {
      const double t_exit = std::min(span.t_exit, max_t);
      const double voxels = (t_exit - span.t_enter) * length / placed.voxel_size * voxels_per_cell;
      if (!(voxels > 0.0)) return true;  // an edge that it only touches
      const GlassBody next{index,        span.voxel, span.face, type,  span.starts_inside,
                           span.t_enter, t_exit,     voxels,    index, span.exit_face};
      if (out.size() > first && continues(out.back(), next)) {
        out.back().t_exit = t_exit;
        out.back().exit_face = span.exit_face;
        out.back().voxels += voxels;
      } else {
        out.push_back(next);
      }
      clarity += surfaces[type].log_clarity * voxels;
      return clarity > kClosed;
    });
  });
  join_touching(out);
}

GlassLook look_of(const Surface& surface, const GlassBody& body) {
  const auto length = static_cast<float>(std::max(body.voxels, body.starts_inside ? 0.0 : 1.0));
  // No length, no matter how dark the material: minus infinity times 0 is not a number.
  const auto through = [&](float logarithm) { return length > 0.0F ? std::exp(logarithm * length) : 1.0F; };
  GlassLook look;
  for (int channel = 0; channel < 3; ++channel) look.passed[channel] = through(surface.log_transmittance[channel]);
  look.own = 1.0F - through(surface.log_clarity);
  return look;
}

bool reaches(const GlassBody& body, double t) {
  return t <= body.t_exit + kTouching * std::max(1.0, body.t_exit);
}

bool lies_on_opaque(const SceneView& view, const Ray& ray_in_view, const GlassBody& body, double t) {
  const PlacedGrid& placed = view.tracer().placed()[static_cast<std::size_t>(body.exit_placed)];
  return t <= body.t_exit + kRayLift * placed.voxel_size / glm::length(ray_in_view.direction);
}

Mirror mirror_at(const SceneView& view, const Ray& ray_in_view, std::int32_t placed, Direction face, float ior,
                 float other_ior) {
  const glm::dmat3& axes = view.tracer().placed()[static_cast<std::size_t>(placed)].world_axes;
  const Vec3 normal(axes * DVec3(normal_of(face)));
  const Vec3 direction(glm::normalize(ray_in_view.direction));
  const float along = glm::dot(direction, normal);
  const float cosine = std::min(std::abs(along), 1.0F);
  const float denser = std::max(ior, other_ior) / std::min(ior, other_ior);
  const float inside = std::sqrt(1.0F - (1.0F - cosine * cosine) / (denser * denser));
  const float across = (cosine - denser * inside) / (cosine + denser * inside);
  const float in_plane = (denser * cosine - inside) / (denser * cosine + inside);
  // Along a surface between equals both are 0 / 0.
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
