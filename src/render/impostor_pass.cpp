#include "render/impostor_pass.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace quoin {
namespace {

constexpr int kBlock = CameraRays::kBlock;
constexpr std::size_t kLanes = RayPacket::kSize;
constexpr double kRoom = 1.0 + 1e-6;  // for rounding
// Faces are drawn from snapshots with at least as many texels a pixel.
constexpr double kTexelsAPixel = 3.0;
// Views whose faces are drawn, by level: more make fewer holes and cost more.
constexpr std::array<int, ImpostorFaces::kLevels> kViews = {26, 6, 4, 4, 4};

// Its index in SceneTracer::placed; -1 where it is not there.
std::int32_t index_of(const std::vector<PlacedGrid>& placed, InstanceHandle instance) {
  const auto found =
      std::lower_bound(placed.begin(), placed.end(), instance,
                       [](const PlacedGrid& grid, InstanceHandle handle) { return grid.instance < handle; });
  if (found == placed.end() || found->instance != instance) return -1;
  return static_cast<std::int32_t>(found - placed.begin());
}

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

std::vector<std::int32_t> placed_of(const SceneTracer& tracer, std::span<const FarInstance> far) {
  std::vector<std::int32_t> indices;
  for (const FarInstance& instance : far) {
    const std::int32_t index = index_of(tracer.placed(), instance.instance);
    if (index >= 0) indices.push_back(index);
  }
  return indices;
}

// What of a content's sphere decides whether and where it is drawn.
struct ImpostorPass::Screen {
  DVec3 seen{0.0};  // the centre: right, down, forward
  double radius = 0.0;
  double diameter = 0.0;  // pixels
};

ImpostorPass::ImpostorPass(const SceneTracer& tracer, std::span<const FarInstance> far, const Camera& camera, int width,
                           int height, InstructionSet instructions)
    : camera_(camera),
      is_perspective_(camera.projection == Camera::Projection::Perspective),
      width_(width),
      height_(height),
      focal_(height / (is_perspective_ ? 2.0 * std::tan(camera.vertical_fov / 2.0) : camera.view_height)),
      across_((width + kTile - 1) / kTile),
      down_((height + kTile - 1) / kTile),
      draw_(raster::draw_of(instructions)) {
  const std::vector<PlacedGrid>& placed = tracer.placed();
  for (const FarInstance& instance : far) {
    const std::int32_t index = index_of(placed, instance.instance);
    if (index < 0 || instance.impostor == nullptr) continue;
    add(placed[static_cast<std::size_t>(index)], index, *instance.impostor);
  }
  std::stable_sort(drawn_.begin(), drawn_.end(), [](const Drawn& a, const Drawn& b) { return a.placed < b.placed; });
  fill_bins();
}

bool ImpostorPass::find_area(const Screen& screen, Area& area) const {
  const DVec3 seen = screen.seen;
  const double radius = screen.radius;
  if (!is_finite(seen) || !(seen.z > 0.0) || !std::isfinite(radius) || !(0.5 * screen.diameter >= 1.0)) return false;
  if (is_perspective_ && seen.z <= radius) {  // around the camera's plane: it may be anywhere
    area = {0, 0, width_, height_};
    return true;
  }
  const auto reach = [&](double across) {
    return is_perspective_ ? upper_tangent(across, seen.z, radius) : across + radius;
  };
  area.left = clamped(std::floor(0.5 * width_ - reach(-seen.x) * focal_), width_);
  area.right = clamped(std::ceil(0.5 * width_ + reach(seen.x) * focal_), width_);
  area.top = clamped(std::floor(0.5 * height_ - reach(-seen.y) * focal_), height_);
  area.bottom = clamped(std::ceil(0.5 * height_ + reach(seen.y) * focal_), height_);
  return area.left < area.right && area.top < area.bottom;
}

void ImpostorPass::add(const PlacedGrid& placed, std::int32_t index, const Impostor& impostor) {
  if (impostor.is_empty() || placed.halvings != 0) return;
  const ContentSphere& content = impostor.content();
  const DVec3 position = placed.position - camera_.position;
  const DVec3 centre = position + placed.world_axes * (content.centre - placed.pivot) * placed.voxel_size;
  const double size = placed.voxel_size;
  Screen screen;
  screen.seen = {glm::dot(centre, camera_.right), -glm::dot(centre, camera_.up), glm::dot(centre, camera_.forward)};
  screen.radius = content.radius * size;
  screen.diameter = 2.0 * screen.radius * focal_ / (is_perspective_ ? screen.seen.z : 1.0);
  Drawn drawn;
  if (!find_area(screen, drawn.area)) return;
  const glm::dmat3 axes = glm::transpose(placed.world_axes);
  const DVec3 towards_camera = axes * (is_perspective_ ? -centre : -camera_.forward);
  if (!is_finite(towards_camera) || towards_camera == DVec3(0.0)) return;
  const std::size_t level = level_for(impostor.faces().edge, screen.diameter);
  drawn.placed = index;
  drawn.faces = &impostor.faces();
  drawn.nearest = screen.seen.z - screen.radius * kRoom;
  drawn.axes = axes;
  drawn.offset = axes * centre * (-1.0 / size);
  drawn.aim.right = axes * camera_.right, drawn.aim.down = axes * -camera_.up,
  drawn.aim.forward = axes * camera_.forward;
  drawn.aim.centre = screen.seen / size;
  drawn.aim.is_perspective = is_perspective_;
  drawn.aim.focal = is_perspective_ ? focal_ : focal_ * size;
  drawn.aim.voxel_size = size;
  drawn.level = &impostor.faces().levels[level];
  drawn.views = nearest_views(towards_camera, kViews[level]);
  drawn_.push_back(drawn);
}

void ImpostorPass::fill_bins() {
  bins_.resize(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_));
  std::vector<std::uint32_t> order(drawn_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return drawn_[a].nearest < drawn_[b].nearest; });
  for (const std::uint32_t i : order) {
    const Area& area = drawn_[i].area;
    for (int y = area.top / kTile; y <= (area.bottom - 1) / kTile; ++y) {
      for (int x = area.left / kTile; x <= (area.right - 1) / kTile; ++x) {
        bins_[static_cast<std::size_t>(y * across_ + x)].push_back(i);
      }
    }
  }
}

const std::vector<std::uint32_t>& ImpostorPass::bin_of(int column, int row) const {
  return bins_[static_cast<std::size_t>(row / kTile * across_ + column / kTile)];
}

void ImpostorPass::draw(int column, int row, PixelPoint point, raster::Canvas& canvas) const {
  canvas.clear();
  const double x = column + point.x - 0.5 * width_;
  const double y = row + point.y - 0.5 * height_;
  raster::Job job;
  for (const std::uint32_t i : bin_of(column, row)) {
    const Drawn& drawn = drawn_[i];
    const Area& area = drawn.area;
    job.id = static_cast<std::int32_t>(i);
    job.left = std::max(area.left - column, 0), job.right = std::min(area.right - column, kTile);
    job.top = std::max(area.top - row, 0), job.bottom = std::min(area.bottom - row, kTile);
    if (is_hidden(drawn, job, canvas)) continue;
    job.level = drawn.level;
    job.views = drawn.views;
    raster::set_aim(drawn.aim, x, y, job);
    draw_(job, canvas);
    if (drawn.level != drawn.faces->levels.data()) continue;
    job.level = &drawn.faces->unseen;
    job.views = ~0U;
    draw_(job, canvas);
  }
}

bool ImpostorPass::is_hidden(const Drawn& drawn, const raster::Job& job, const raster::Canvas& canvas) {
  for (int y = job.top / kBlock; y <= (job.bottom - 1) / kBlock; ++y) {
    for (int x = job.left / kBlock; x <= (job.right - 1) / kBlock; ++x) {
      if (!(canvas.furthest[raster::index_of(x * kBlock, y * kBlock) / kLanes] < drawn.nearest)) return false;
    }
  }
  return true;
}

double ImpostorPass::distance_to(const Drawn& drawn, const ImpostorFaces::Face& face, const Ray& ray) {
  const FaceFrame& frame = frame_of(face.direction);
  const int axis = frame.axis;
  const double plane = face.voxel[axis] + (frame.sign > 0 ? 1.0 : 0.0) - drawn.faces->centre[axis];
  const DVec3 row{drawn.axes[0][axis], drawn.axes[1][axis], drawn.axes[2][axis]};
  return ((plane - drawn.offset[axis]) * drawn.aim.voxel_size - glm::dot(row, ray.origin)) /
         glm::dot(row, ray.direction);
}

void ImpostorPass::find(int column, int row, const RayPacket& rays, const raster::Canvas& canvas, SceneHits& hits,
                        FarFaces& faces) const {
  faces.found = 0;
  const std::size_t first = raster::index_of(column % kTile, row % kTile);
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const auto i = static_cast<std::size_t>(lane);
    const std::uint32_t bit = 1U << lane;
    if (std::isinf(canvas.depth[first + i])) continue;
    const Drawn& drawn = drawn_[static_cast<std::size_t>(canvas.id[first + i])];
    const ImpostorFaces::Face& face = drawn.faces->faces[static_cast<std::size_t>(canvas.face[first + i])];
    const double t = distance_to(drawn, face, rays.ray(lane));
    const bool is_hit = (hits.grids.hit & bit) != 0;
    if (is_hit ? hits.grids.t[i] < t || (hits.grids.t[i] == t && hits.placed[i] < drawn.placed) : rays.max_t[i] < t) {
      continue;
    }
    hits.grids.set(lane, {face.voxel, face.direction, t, false});
    hits.grids.starts_inside &= ~bit;
    hits.placed[i] = drawn.placed;
    faces.found |= bit;
    faces.face[i] = &face;
  }
}

}  // namespace quoin
