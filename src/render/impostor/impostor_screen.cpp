#include "render/impostor/impostor_screen.h"
#include "scene/tracer/placed_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>

#include "render/impostor/snapshot.h"

namespace quoin {
namespace {

constexpr double kRoom = 1.0 + 1e-6;  // for rounding
// Returns the minimum number of voxels per pixel for cells of 2^`log2_width` voxels. The bits of cells of 2 and 4
// voxels are exact; wider bits are at most a sixteenth of a pixel, so that outlines of 8 pixels stay
// (docs/decisions/120).
double least_voxels(int log2_width) {
  if (log2_width <= 2) return log2_width < 1 ? 0.0 : 3.0 * std::exp2(log2_width);
  return 4.0 * std::exp2(log2_width);
}
// The factor of distance, up to the end of a level's range, over which the next level fades in.
constexpr double kFade = 1.3;
constexpr std::int32_t kAllPixels = 1 << 24;

// Returns an upper bound of a sphere's extent to one side, projected to distance 1. (across, deep): the sphere's centre
// from the camera. Requires: the sphere is in front of the camera's plane.
double upper_tangent(double across, double deep, double radius) {
  QUOIN_ASSERT(deep > radius, "a sphere in front of the camera's plane");
  const double edge = across + radius;
  return edge / (edge > 0.0 ? deep - radius : deep + radius);
}

int clamped(double pixel, int size) {
  return static_cast<int>(std::clamp(pixel, 0.0, static_cast<double>(size)));
}

// Chooses the coarsest level for a number of voxels per pixel, and the share of the next level.
void choose_level(double voxels, DrawnImpostor& drawn) {
  QUOIN_ASSERT(drawn.faces != nullptr && voxels >= 0.0, "faces, and a number of voxels");
  const auto least = [&](std::size_t level) {
    return least_voxels(drawn.faces->first_width + static_cast<int>(level));
  };
  while (drawn.level + 1 < ImpostorFaces::kLevels && voxels >= least(drawn.level + 1)) ++drawn.level;
  if (drawn.level + 1 == ImpostorFaces::kLevels) return;
  const double next = least(drawn.level + 1);
  const double share = 1.0 - std::log(next / voxels) / std::log(kFade);
  drawn.coarser = static_cast<std::int32_t>(std::clamp(share, 0.0, 1.0) * (kAllPixels - 1));
}

// Returns the views at the corners of the spherical triangle around a direction: a face of the cube around the grid,
// one of its edges and one of its corners. Their frequencies are the weights that make up the direction. `towards`:
// from the content to the camera, any length except 0.
raster::NearViews near_views(DVec3 towards) {
  const DVec3 size = glm::abs(towards);
  std::array<int, 3> order = {0, 1, 2};
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return size[a] > size[b]; });
  raster::NearViews near;
  std::array<double, 3> shares{};
  DVec3 view(0.0);
  for (std::size_t i = 0; i < 3; ++i) {
    const int axis = order.at(i);
    view[axis] = towards[axis] < 0.0 ? -1.0 : 1.0;
    near.view.at(i) = static_cast<std::uint8_t>(*nearest_impostor_view(view));
    const double next = i < 2 ? size[order.at(i + 1)] : 0.0;
    shares.at(i) = (size[axis] - next) * std::sqrt(static_cast<double>(i + 1));
  }
  const double sum = shares[0] + shares[1] + shares[2];
  QUOIN_ASSERT(sum > 0.0, "a direction other than 0");
  for (std::size_t i = 0; i < 2; ++i) {
    near.share.at(i) = static_cast<std::uint16_t>(std::lround(shares.at(i) / sum * (1 << 14)));
  }
  return near;
}

}  // namespace

// The properties of a content sphere that decide if and where it is drawn.
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
      focal_(height / (is_perspective_ ? 2.0 * std::tan(camera.vertical_fov_radians / 2.0) : camera.view_height)) {
  QUOIN_ASSERT(width > 0 && height > 0, "a positive image size");
}

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

std::span<const DrawnImpostor::Part> DrawnImpostor::parts(std::array<Part, kMaxParts>& room) const {
  std::size_t count = 0;
  const auto add = [&](std::size_t number, raster::Share share) {
    if (share.first < share.end && faces->level(number).count() > 0) room.at(count++) = {number, share};
  };
  add(level, {coarser, kAllPixels});
  if (level + 1 < ImpostorFaces::kLevels) add(level + 1, {0, coarser});
  if (level == 0) add(ImpostorFaces::kLevels, {coarser, kAllPixels});
  return std::span(room).first(count);
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
  if (!is_finite(axes * centre) || centre == DVec3(0.0)) return std::nullopt;
  DrawnImpostor drawn;
  drawn.area = *area;
  drawn.placed = index;
  drawn.faces = &impostor.faces();
  drawn.near = near_views(axes * (is_perspective_ ? -centre : -camera_.forward));
  choose_level((is_perspective_ ? sphere.seen.z : 1.0) / (focal_ * size), drawn);
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
