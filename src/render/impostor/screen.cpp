#include "render/impostor/screen.h"
#include "scene/tracer/placed_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "render/impostor/snapshot.h"

namespace quoin {
namespace {

constexpr double kRoom = 1.0 + 1e-6;  // for rounding
// Faces are drawn from snapshots with at least as many texels a pixel.
constexpr double kTexelsAPixel = 3.0;
// Views whose faces are drawn, by level: more make fewer holes and cost more.
constexpr std::array<int, ImpostorFaces::kLevels> kViews = {26, 6, 4, 4, 4};

// How far to one side of a camera a sphere at (across, deep) may be seen, at a distance of 1: never less than it is.
// Requires: the sphere is in front of the camera's plane.
double upper_tangent(double across, double deep, double radius) {
  const double edge = across + radius;
  return edge / (edge > 0.0 ? deep - radius : deep + radius);
}

int clamped(double pixel, int size) {
  return static_cast<int>(std::clamp(pixel, 0.0, static_cast<double>(size)));
}

// The nearest views to a direction, as bits. Requires: it is finite and not 0.
std::uint32_t nearest_views(DVec3 direction, int count) {
  const DVec3 size = glm::abs(direction);
  direction /= std::max({size.x, size.y, size.z});
  std::array<std::pair<double, int>, kImpostorViews> order;
  for (int i = 0; i < kImpostorViews; ++i)
    order[static_cast<std::size_t>(i)] = {-glm::dot(direction, impostor_view(i)), i};
  std::partial_sort(order.begin(), order.begin() + count, order.end());
  std::uint32_t views = 0;
  for (int i = 0; i < count; ++i) views |= 1U << order[static_cast<std::size_t>(i)].second;
  return views;
}

// The coarsest level with kTexelsAPixel texels for each pixel that the content spans; the finest where none has.
std::size_t level_for(int edge, double diameter_pixels) {
  int level = 0;
  while (level + 1 < ImpostorFaces::kLevels && (edge >> (level + 1)) >= kTexelsAPixel * diameter_pixels) ++level;
  return static_cast<std::size_t>(level);
}

}  // namespace

// What of a content's sphere decides whether and where it is drawn.
struct ImpostorScreen::Sphere {
  DVec3 seen{0.0};  // the centre: right, down, forward
  double radius = 0.0;
  double diameter = 0.0;  // pixels
};

ImpostorScreen::ImpostorScreen(const Camera& camera, int width, int height)
    : camera_(camera),
      is_perspective_(camera.projection == Camera::Projection::Perspective),
      width_(width),
      height_(height),
      focal_(height / (is_perspective_ ? 2.0 * std::tan(camera.vertical_fov_radians / 2.0) : camera.view_height)) {}

std::optional<PixelArea> ImpostorScreen::area_of(const Sphere& sphere) const {
  const DVec3 seen = sphere.seen;
  const double radius = sphere.radius;
  if (!is_finite(seen) || !(seen.z > 0.0) || !std::isfinite(radius) || !(0.5 * sphere.diameter >= 1.0)) {
    return std::nullopt;
  }
  // Around the camera's plane it may be anywhere.
  if (is_perspective_ && seen.z <= radius) return PixelArea{0, 0, width_, height_};
  const auto reach = [&](double across) {
    return is_perspective_ ? upper_tangent(across, seen.z, radius) : across + radius;
  };
  PixelArea area;
  area.left = clamped(std::floor(0.5 * width_ - reach(-seen.x) * focal_), width_);
  area.right = clamped(std::ceil(0.5 * width_ + reach(seen.x) * focal_), width_);
  area.top = clamped(std::floor(0.5 * height_ - reach(-seen.y) * focal_), height_);
  area.bottom = clamped(std::ceil(0.5 * height_ + reach(seen.y) * focal_), height_);
  if (area.left >= area.right || area.top >= area.bottom) return std::nullopt;
  return area;
}

std::optional<DrawnImpostor> ImpostorScreen::drawn(const PlacedGrid& placed, std::int32_t index,
                                                   const Impostor& impostor) const {
  if (impostor.empty() || placed.level != 0) return std::nullopt;
  const ContentSphere& content = impostor.content();
  const DVec3 position = placed.position - camera_.position;
  const DVec3 centre = position + placed.world_axes * (content.centre - placed.pivot) * placed.voxel_size;
  const double size = placed.voxel_size;
  Sphere sphere;
  sphere.seen = {glm::dot(centre, camera_.right), -glm::dot(centre, camera_.up), glm::dot(centre, camera_.forward)};
  sphere.radius = content.radius * size;
  sphere.diameter = 2.0 * sphere.radius * focal_ / (is_perspective_ ? sphere.seen.z : 1.0);
  const std::optional<PixelArea> area = area_of(sphere);
  if (!area) return std::nullopt;
  const glm::dmat3 axes = glm::transpose(placed.world_axes);
  const DVec3 towards_camera = axes * (is_perspective_ ? -centre : -camera_.forward);
  if (!is_finite(towards_camera) || towards_camera == DVec3(0.0)) return std::nullopt;
  DrawnImpostor drawn;
  drawn.area = *area;
  drawn.placed = index;
  drawn.faces = &ImpostorFaces::of(impostor);
  drawn.level = level_for(ImpostorFaces::of(impostor).edge, sphere.diameter);
  drawn.views = nearest_views(towards_camera, kViews[drawn.level]);
  drawn.nearest = sphere.seen.z - sphere.radius * kRoom;
  drawn.axes = axes;
  drawn.offset = axes * centre * (-1.0 / size);
  drawn.aim.right = axes * camera_.right, drawn.aim.down = axes * -camera_.up;
  drawn.aim.forward = axes * camera_.forward;
  drawn.aim.centre = sphere.seen / size;
  drawn.aim.is_perspective = is_perspective_;
  drawn.aim.focal = is_perspective_ ? focal_ : focal_ * size;
  drawn.aim.voxel_size = size;
  return drawn;
}

}  // namespace quoin
