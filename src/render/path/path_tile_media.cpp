// Glass, fog and clouds of a tile.

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>

#include "render/light/light_model.h"
#include "render/light/occlusion_directions.h"
#include "render/path/path_tile.h"
#include "render/shared/image_request.h"
#include "scene/tracer/placed_grid.h"

namespace quoin::path {
namespace {

constexpr int kMostGlass = 64;  // maximum number of glass surfaces that a path meets between two other surfaces

// Refraction at a surface between two media, without polarisation; reflectance 1 on total reflection. `eta`: the
// refractive index on the incident side over the index on the other side. `cosine`: of the incident angle, positive.
struct Refraction {
  float mirrored = 1.0F;
  float cosine = 0.0F;  // of the transmitted direction
};

Refraction refraction(float cosine, float eta) {
  QUOIN_ASSERT(cosine > 0.0F && eta > 0.0F, "a positive cosine and index");
  const float sine2 = eta * eta * std::max(0.0F, 1.0F - cosine * cosine);
  if (sine2 >= 1.0F) return {};
  const float inner = std::sqrt(1.0F - sine2);
  const float across = (eta * cosine - inner) / (eta * cosine + inner);
  const float in_plane = (cosine - eta * inner) / (cosine + eta * inner);
  return {0.5F * (across * across + in_plane * in_plane), inner};
}

}  // namespace

bool PathTile::meet_glass(std::uint32_t index, double t) {
  Path& path = paths_[index];
  find_transparent(*context_->view, *context_->surfaces, {path.origin, DVec3(path.direction)}, t, seen_);
  if (!path.is_seen) return pass_glass(index);
  float u = path.random.one(path.dimension + dimension::kGlass);
  if (path.inside == kAir && pass_clouds(index, u)) return true;
  if (path.inside != kAir) return leave_glass(index, u);
  return !seen_.bodies.empty() && enter_glass(index, u);
}

bool PathTile::pass_faces(std::uint32_t index, double max_t, std::size_t& next, float& u) {
  for (; next < seen_.faces.size() && seen_.faces[next].t <= max_t; ++next) {
    const MetFace& face = seen_.faces[next];
    if (u < face.cover) {
      hit_face(index, face);
      return true;
    }
    u = rest_of(u, face.cover);
    paths_[index].throughput *= face.passed() / (1.0F - face.cover);
  }
  return false;
}

// Light between surfaces passes straight through glass; the opaque share of the glass blocks it at random.
bool PathTile::pass_glass(std::uint32_t index) {
  Path& path = paths_[index];
  float u = path.random.one(path.dimension + dimension::kGlass);
  std::size_t next_face = 0;
  for (const GlassBody& body : seen_.bodies) {
    if (pass_faces(index, body.t_enter, next_face, u)) return true;
    std::optional<Surface> textured;
    const Surface& surface = surface_of(*context_->surfaces, body, textured);
    const double voxels = length_of(surface, body);
    const float cover = cover_of(surface, voxels);
    if (u < cover) {
      if (surface.scattering > 0.0F) {
        scatter_in(index, body, u);
        return true;
      }
      // From inside, only its emission counts.
      if (body.starts_inside) {
        add_emitted(path, surface.emitted, -1, 0.0F);
      } else {
        const Ray ray{path.origin, DVec3(path.direction)};
        hit_glass(index, body, normal_entered(*context_->view, ray, body));
      }
      return true;
    }
    u = rest_of(u, cover);
    path.throughput *= tint_of(surface, voxels);
  }
  return pass_faces(index, kInfinite, next_face, u);
}

bool PathTile::pass_clouds(std::uint32_t index, float& u) {
  const auto first_glass = std::ranges::find_if(
      seen_.bodies, [&](const GlassBody& body) { return !((*context_->surfaces)[body.type].scattering > 0.0F); });
  if (first_glass == seen_.bodies.begin() && seen_.faces.empty()) return false;
  std::size_t next_face = 0;
  for (auto body = seen_.bodies.begin(); body != first_glass; ++body) {
    if (pass_faces(index, body->t_enter, next_face, u)) return true;
    const Surface& surface = (*context_->surfaces)[body->type];
    const float cover = cover_of(surface, body->voxels);
    if (u < cover) {
      scatter_in(index, *body, u);
      return true;
    }
    u = rest_of(u, cover);
  }
  const double until = first_glass == seen_.bodies.end() ? kInfinite : first_glass->t_enter;
  if (pass_faces(index, until, next_face, u)) return true;
  seen_.bodies.erase(seen_.bodies.begin(), first_glass);
  seen_.faces.erase(seen_.faces.begin(), seen_.faces.begin() + static_cast<std::ptrdiff_t>(next_face));
  return false;
}

void PathTile::scatter_in(std::uint32_t index, const GlassBody& body, float u) {
  const Surface& surface = (*context_->surfaces)[body.type];
  const double share = free_way(u, static_cast<double>(surface.scattering)) / std::max(body.voxels, 1e-12);
  const double t = body.t_enter + (body.t_exit - body.t_enter) * std::clamp(share, 0.0, 1.0);
  add_emitted(paths_[index], surface.emitted, -1, 0.0F);
  hit_air(index, t, surface.colour, surface.anisotropy, body.placed);
}

bool PathTile::enter_glass(std::uint32_t index, float u) {
  QUOIN_ASSERT(!seen_.bodies.empty(), "a path that meets glass");
  Path& path = paths_[index];
  const GlassBody body = seen_.bodies.front();
  std::optional<Surface> textured;
  const Surface& surface = surface_of(*context_->surfaces, body, textured);
  const Ray ray{path.origin, DVec3(path.direction)};
  if (body.starts_inside) {  // the camera is inside
    path.inside = body.type;
    return leave_glass(index, u);
  }
  const DVec3 in_grid_normal = normal_entered(*context_->view, ray, body);
  const PlacedGrid& placed = context_->placed[static_cast<std::size_t>(body.placed)];
  Vec3 normal(placed.world_axes * in_grid_normal);
  const float cosine = std::clamp(-glm::dot(normal, path.direction), 1e-4F, 1.0F);
  if (path.is_first) {
    // Reflection and transmission belong to one surface: a path chooses one of them at random.
    Vertex whole;
    whole.material.colour = Vec3(1.0F);
    note_part(path, whole, surface_id(body.voxel, body.face, body.in_field, body.placed, body.type), false);
  }
  const Refraction through = refraction(cosine, 1.0F / surface.ior);
  const DVec3 point = ray.origin + ray.direction * body.t_enter;
  const double lift = kRayLift * placed.voxel_size;
  if (u < through.mirrored) {
    turn_at(path, point, path.direction + normal * (2.0F * cosine), normal, lift, kAir);
  } else {
    const double voxels = length_of(surface, body);
    const float cover = cover_of(surface, voxels);
    if (u < through.mirrored + (1.0F - through.mirrored) * cover) {
      hit_glass(index, body, in_grid_normal);
      return true;
    }
    const float eta = 1.0F / surface.ior;
    turn_at(path, point, path.direction * eta + normal * (eta * cosine - through.cosine), -normal, lift, body.type);
  }
  next_.push_back(index);
  return true;
}

// Follows a path within glass to the end of the body, or to an object inside it.
bool PathTile::leave_glass(std::uint32_t index, float u) {
  QUOIN_ASSERT(paths_[index].inside != kAir, "a path within glass");
  Path& path = paths_[index];
  const Ray ray{path.origin, DVec3(path.direction)};
  const std::vector<GlassBody>& bodies = seen_.bodies;
  const bool is_within =
      !bodies.empty() && bodies.front().starts_inside && context_->surfaces->joins(bodies.front().type, path.inside);
  if (!is_within) {  // the path left through a corner, or by rounding
    path.inside = kAir;
    if (pass_clouds(index, u)) return true;
    return !bodies.empty() && !bodies.front().starts_inside && enter_glass(index, u);
  }
  const GlassBody body = bodies.front();
  const Surface& surface = (*context_->surfaces)[body.type];
  path.throughput *= tint_of(surface, body.voxels);
  const PlacedGrid& placed = context_->placed[static_cast<std::size_t>(body.exit_placed)];
  const double lift = kRayLift * placed.voxel_size;
  // Faces of another grid, within the glass or at its end.
  std::size_t next_face = 0;
  const bool is_closed = seen_.is_closed() && seen_.end <= body.t_exit + lift;
  if (pass_faces(index, is_closed ? kInfinite : body.t_exit, next_face, u)) return true;
  if (!(body.t_exit < kInfinite)) return false;
  const bool has_next = bodies.size() > 1 && reaches(body, bodies[1].t_enter);
  const DVec3 end = ray.origin + ray.direction * body.t_exit;
  if (!has_next) {
    RayPacket ahead;
    ahead.set(0, ray, body.t_exit + lift);
    SceneHits met;
    context_->view->first_hits(ahead, met);
    const double ground = ground_at(path.origin, path.direction);
    if (met.grids.hit != 0 || ground <= body.t_exit + lift) return false;  // the glass lies on an opaque surface
  }
  const float other = has_next ? (*context_->surfaces)[bodies[1].type].ior : 1.0F;
  Vec3 normal(placed.world_axes * normal_left(*context_->view, ray, body));
  if (glm::dot(normal, path.direction) < 0.0F) normal = -normal;
  const float cosine = std::clamp(glm::dot(normal, path.direction), 1e-4F, 1.0F);
  const float eta = surface.ior / other;
  const Refraction through = refraction(cosine, eta);
  if (u < through.mirrored) {
    turn_at(path, end, path.direction - normal * (2.0F * cosine), -normal, lift, body.type);
  } else {
    turn_at(path, end, path.direction * eta + normal * (through.cosine - eta * cosine), normal, lift,
            has_next ? bodies[1].type : kAir);
  }
  next_.push_back(index);
  return true;
}

// Continues a path from a glass surface, on the side of `normal`.
void PathTile::turn_at(Path& path, const DVec3& point, Vec3 direction, Vec3 normal, double lift, VoxelType inside) {
  path.origin = point + DVec3(normal) * lift;
  path.direction = glm::normalize(direction);
  path.bin = static_cast<std::uint8_t>(bin_of(path.direction));
  path.inside = inside;
  path.dimension += kDimensions;
  path.density = kNoOther;
  path.is_first = false;
  if (path.dimension > kDimensions * (kMostGlass + 2U * path.bounces + 2U * path.scatterings))
    path.throughput = Vec3(0.0F);
}

void PathTile::hit_glass(std::uint32_t index, const GlassBody& body, const DVec3& normal_in_grid) {
  QUOIN_ASSERT(body.placed >= 0 && static_cast<std::size_t>(body.placed) < context_->placed.size(),
               "a body of one of the placed grids");
  Path& path = paths_[index];
  std::optional<Surface> textured;
  const Surface& surface = surface_of(*context_->surfaces, body, textured);
  Vertex vertex;
  vertex.path = index;
  vertex.placed = body.placed;
  const PlacedGrid& placed = context_->placed[static_cast<std::size_t>(body.placed)];
  vertex.in_grid =
      context_->view->grid_from_view(body.placed).point(path.origin + DVec3(path.direction) * body.t_enter);
  if (!body.in_field && body.model == nullptr) vertex.in_grid = on_face(vertex.in_grid, body.voxel, body.face);
  vertex.in_grid += normal_in_grid * kRayLift;
  vertex.normal = glm::normalize(Vec3(placed.world_axes * normal_in_grid));
  vertex.in_view = context_->view->view_from_grid(body.placed).point(vertex.in_grid);
  vertex.material = {surface.colour, 1.0F, 0.0F};
  if (path.is_first) sums_[path.pixel].scene_share += 1.0F;
  note_layers(path, vertex, body.t_enter, body.type);
  add_emitted(path, surface.emitted, -1, 0.0F);
  vertices_.push_back(vertex);
}

void PathTile::hit_face(std::uint32_t index, const MetFace& face) {
  Path& path = paths_[index];
  const Surface& surface = (*context_->surfaces)[face.type];
  Vertex vertex;
  vertex.path = index;
  vertex.placed = face.placed;
  const auto of_face = static_cast<std::size_t>(face.face);
  const DVec3 met = context_->view->grid_from_view(face.placed).point(path.origin + DVec3(path.direction) * face.t);
  vertex.in_grid = on_face(met, face.voxel, face.face) + DVec3(normal_of(face.face)) * kRayLift;
  vertex.normal = (*context_->face_normals)[static_cast<std::size_t>(face.placed)][of_face];
  vertex.in_view = context_->view->view_from_grid(face.placed).point(vertex.in_grid);
  vertex.material = {face.colour, surface.roughness, surface.metalness};
  if (light_.lamps != nullptr) vertex.place = memory_.place_of(face.placed, face.voxel, face.face);
  if (path.is_first) sums_[path.pixel].scene_share += 1.0F;
  if (!path.is_noted) note_part(path, vertex, surface_id(face.voxel, face.face, false, face.placed, face.type), false);
  note_layers(path, vertex, face.t, face.type);
  // Lamps are faces of opaque types.
  add_emitted(path, face.colour * context_->surfaces->faces(face.type)->sides[face.side].emission, -1, 0.0F);
  vertices_.push_back(vertex);
}

// ---- fog and clouds ------------------------------------------------------------------------------------------

PathTile::Interval PathTile::in_fog(const DVec3& origin, Vec3 direction, double max_t) const {
  const double above = origin.y - fog_top_;
  const auto up = static_cast<double>(direction.y);
  if (above >= 0.0 && up >= 0.0) return {};
  Interval way{0.0, max_t};
  if (above > 0.0) way.begin = std::min(above / -up, max_t);
  if (above < 0.0 && up > 0.0) way.end = std::min(above / -up, max_t);
  return way;
}

void PathTile::hit_air(std::uint32_t index, double t, Vec3 colour, float anisotropy, std::int32_t placed) {
  QUOIN_ASSERT(placed >= 0 && (context_->placed.empty() || static_cast<std::size_t>(placed) < context_->placed.size()),
               "one of the placed grids");
  Path& path = paths_[index];
  Vertex vertex;
  vertex.path = index;
  vertex.placed = placed;
  vertex.is_medium = true;
  vertex.anisotropy = anisotropy;
  vertex.in_view = path.origin + DVec3(path.direction) * t;
  vertex.material.colour = colour;
  if (!context_->placed.empty()) {
    vertex.in_grid = context_->view->grid_from_view(placed).point(vertex.in_view);
  }
  PixelSums& sums = sums_[path.pixel];
  if (path.is_first) {
    sums.scene_share += 1.0F;
    if (path.is_first_sample) sums.depth = static_cast<float>(t);
  }
  // Fog has no normal, and the pixel does not show the surface behind.
  if (!path.is_noted) sums.albedo += colour;
  path.is_noted = true;
  vertices_.push_back(vertex);
}

void PathTile::note_behind(Path& path, const SceneHits& hits, int lane, double t) {
  if (!path.is_first) return;
  const auto i = static_cast<std::size_t>(lane);
  Vertex whole;
  whole.material.colour = Vec3(1.0F);
  if (context_->surfaces->has_cells_of_faces()) {
    find_transparent(*context_->view, *context_->surfaces, {path.origin, DVec3(path.direction)}, t, seen_);
    if (seen_.is_closed()) {
      const MetFace& face = seen_.faces.back();
      note_part(path, whole, surface_id(face.voxel, face.face, false, face.placed, face.type), false);
      return;
    }
  }
  if ((hits.grids.hit >> lane & 1U) != 0 && hits.grids.t[i] <= t) {
    const IVec3 voxel{hits.grids.x[i], hits.grids.y[i], hits.grids.z[i]};
    const bool in_field = (hits.in_field >> lane & 1U) != 0;
    const PlacedGrid& placed = context_->placed[static_cast<std::size_t>(hits.placed[i])];
    const VoxelType type = in_field ? hits.material[i] : placed.voxels->get(voxel);
    note_part(path, whole, surface_id(voxel, hits.grids.face[i], in_field, hits.placed[i], type), false);
  } else {
    note_part(path, whole, t < kInfinite ? kGroundSurface : SurfaceParts::kSky, false);
  }
}

}  // namespace quoin::path
