#include "render/impostor_pass.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace quoin {
namespace {

constexpr int kBlock = 4;
constexpr double kRoom = 1.0 + 1e-6;  // for rounding

// Its index in SceneTracer::placed; -1 where it is not there.
std::int32_t index_of(const std::vector<PlacedGrid>& placed, InstanceHandle instance) {
  const auto found =
      std::lower_bound(placed.begin(), placed.end(), instance,
                       [](const PlacedGrid& grid, InstanceHandle handle) { return grid.instance < handle; });
  if (found == placed.end() || found->instance != instance) return -1;
  return static_cast<std::int32_t>(found - placed.begin());
}

// The pixels from the middle that a sphere of radius 1 at (across, deep) may reach to one side: never less than it
// does. Requires: the sphere is in front of the camera's plane.
double upper_tangent(double across, double deep, double radius) {
  const double edge = across + radius;
  return edge / (edge > 0.0 ? deep - radius : deep + radius);
}

int clamped(double pixel, int size) {
  return static_cast<int>(std::clamp(pixel, 0.0, static_cast<double>(size)));
}

}  // namespace

std::vector<std::int32_t> placed_of(const SceneTracer& tracer, std::span<const FarInstance> far) {
  std::vector<std::int32_t> indices;
  for (const FarInstance& instance : far) {
    const std::int32_t index = index_of(tracer.placed(), instance.instance);
    if (index >= 0) indices.push_back(index);
  }
  return indices;
}

// The camera, with distances on the screen in pixels.
struct ImpostorPass::Screen {
  Camera camera;
  int width = 0;
  int height = 0;
  double focal = 0.0;  // perspective: pixels at distance 1; orthographic: pixels a world unit

  Screen(const Camera& of_camera, int picture_width, int picture_height)
      : camera(of_camera), width(picture_width), height(picture_height) {
    const bool is_perspective = camera.projection == Camera::Projection::Perspective;
    focal = height / (is_perspective ? 2.0 * std::tan(camera.vertical_fov / 2.0) : camera.view_height);
  }

  // Whether the sphere around `centre` (in view space) is to be drawn, and where on the screen it may lie.
  bool find_area(DVec3 centre, double radius, Area& area) const {
    const DVec3 seen{glm::dot(centre, camera.right), -glm::dot(centre, camera.up), glm::dot(centre, camera.forward)};
    if (!is_finite(seen) || !(seen.z > 0.0) || !std::isfinite(radius)) return false;
    const bool is_perspective = camera.projection == Camera::Projection::Perspective;
    if (!(radius * focal / (is_perspective ? seen.z : 1.0) >= 1.0)) return false;
    if (is_perspective && seen.z <= radius) {  // around the camera's plane: it may be anywhere
      area = {0, 0, width, height};
      return true;
    }
    const auto reach = [&](double across) {
      return is_perspective ? upper_tangent(across, seen.z, radius) : across + radius;
    };
    area.left = clamped(std::floor(0.5 * width - reach(-seen.x) * focal), width);
    area.right = clamped(std::ceil(0.5 * width + reach(seen.x) * focal), width);
    area.top = clamped(std::floor(0.5 * height - reach(-seen.y) * focal), height);
    area.bottom = clamped(std::ceil(0.5 * height + reach(seen.y) * focal), height);
    return area.left < area.right && area.top < area.bottom;
  }
};

ImpostorPass::ImpostorPass(const SceneTracer& tracer, std::span<const FarInstance> far, const Camera& camera, int width,
                           int height)
    : across_((width + kTile - 1) / kTile), down_((height + kTile - 1) / kTile) {
  const Screen screen(camera, width, height);
  const std::vector<PlacedGrid>& placed = tracer.placed();
  for (const FarInstance& instance : far) {
    const std::int32_t index = index_of(placed, instance.instance);
    if (index < 0 || instance.impostor == nullptr) continue;
    add(screen, placed[static_cast<std::size_t>(index)], index, *instance.impostor);
  }
  std::stable_sort(drawn_.begin(), drawn_.end(), [](const Drawn& a, const Drawn& b) { return a.near_t < b.near_t; });
  fill_bins();
}

void ImpostorPass::add(const Screen& screen, const PlacedGrid& placed, std::int32_t index, const Impostor& impostor) {
  if (impostor.is_empty() || placed.halvings != 0) return;
  const ContentSphere& content = impostor.content();
  const DVec3 position = placed.position - screen.camera.position;
  const DVec3 centre = position + placed.world_axes * (content.centre - placed.pivot) * placed.voxel_size;
  const double radius = content.radius * placed.voxel_size;
  Area area;
  if (!screen.find_area(centre, radius, area)) return;
  const bool is_perspective = screen.camera.projection == Camera::Projection::Perspective;
  const glm::dmat3 axes = glm::transpose(placed.world_axes) / placed.voxel_size;
  const DVec3 towards_camera = axes * (is_perspective ? -centre : -screen.camera.forward);
  if (!is_finite(towards_camera) || towards_camera == DVec3(0.0)) return;
  const double distance = is_perspective ? glm::length(centre) : glm::dot(centre, screen.camera.forward);
  drawn_.push_back({index, &impostor, area, distance - radius * kRoom, centre, radius * radius * kRoom, axes,
                    placed.pivot - axes * position, ImpostorSearch(impostor, towards_camera)});
}

void ImpostorPass::fill_bins() {
  bins_.resize(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_));
  for (std::size_t i = 0; i < drawn_.size(); ++i) {
    const Area& area = drawn_[i].area;
    for (int y = area.top / kTile; y <= (area.bottom - 1) / kTile; ++y) {
      for (int x = area.left / kTile; x <= (area.right - 1) / kTile; ++x) {
        bins_[static_cast<std::size_t>(y * across_ + x)].push_back(static_cast<std::uint32_t>(i));
      }
    }
  }
}

const std::vector<std::uint32_t>& ImpostorPass::bin_of(int column, int row) const {
  return bins_[static_cast<std::size_t>(row / kTile * across_ + column / kTile)];
}

void ImpostorPass::find(int column, int row, const RayPacket& rays_in_view, SceneHits& hits, FarTexels& texels) const {
  texels.found = 0;
  for (const std::uint32_t i : bin_of(column, row)) {
    const Drawn& drawn = drawn_[i];
    const Area& area = drawn.area;
    if (area.left >= column + kBlock || area.right <= column || area.top >= row + kBlock || area.bottom <= row) {
      continue;
    }
    find_one(drawn, rays_in_view, hits, texels);
  }
}

void ImpostorPass::find_one(const Drawn& drawn, const RayPacket& rays, SceneHits& hits, FarTexels& texels) {
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const auto i = static_cast<std::size_t>(lane);
    const std::uint32_t bit = 1U << lane;
    const bool is_hit = (hits.grids.hit & bit) != 0;
    const double max_t = is_hit ? hits.grids.t[i] : rays.max_t[i];
    if (max_t < drawn.near_t) continue;
    const Ray ray = rays.ray(lane);
    const DVec3 to_centre = drawn.centre - ray.origin;
    const DVec3 beside = to_centre - ray.direction * glm::dot(to_centre, ray.direction);
    if (glm::dot(beside, beside) > drawn.radius_squared) continue;
    const DVec3 direction = drawn.axes * ray.direction;
    const DVec3 origin = drawn.axes * ray.origin + drawn.offset;
    FoundTexel found;
    if (!drawn.search.find(origin, direction, max_t, found)) continue;
    if (is_hit && found.t == max_t && hits.placed[i] < drawn.placed) continue;
    const Snapshot snapshot = drawn.impostor->snapshot(found.view);
    const auto texel = static_cast<std::size_t>(found.texel);
    const Direction face = snapshot.faces[texel];
    const DVec3 inside = origin + direction * found.t - 0.5 * DVec3(normal_of(face));
    const DVec3 voxel =
        glm::clamp(glm::floor(inside), DVec3(drawn.impostor->box().min), DVec3(drawn.impostor->box().max) - 1.0);
    hits.grids.set(lane, {IVec3(voxel), face, found.t, false});
    hits.grids.starts_inside &= ~bit;
    hits.placed[i] = drawn.placed;
    texels.found |= bit;
    texels.type[i] = snapshot.types[texel];
    texels.openness[i] = 1.0F - static_cast<float>(snapshot.occlusion[texel]) / 255.0F;
  }
}

}  // namespace quoin
