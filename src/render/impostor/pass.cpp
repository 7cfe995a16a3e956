#include "render/impostor/pass.h"
#include "scene/tracer/placed_grid.h"

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

// Its index in SceneTracer::placed; -1 where it is not there.
std::int32_t index_of(const std::vector<PlacedGrid>& placed, InstanceHandle instance) {
  const auto found =
      std::lower_bound(placed.begin(), placed.end(), instance,
                       [](const PlacedGrid& grid, InstanceHandle handle) { return grid.instance < handle; });
  if (found == placed.end() || found->instance != instance) return -1;
  return static_cast<std::int32_t>(found - placed.begin());
}

}  // namespace

std::vector<std::int32_t> placed_of(const SceneTracer& tracer, std::span<const FarInstance> far) {
  std::vector<std::int32_t> indices;
  for (const FarInstance& instance : far) {
    const std::int32_t index = index_of(placed_in(tracer), instance.instance);
    if (index >= 0) indices.push_back(index);
  }
  return indices;
}

ImpostorPass::ImpostorPass(const SceneTracer& tracer, std::span<const FarInstance> far, const Camera& camera, int width,
                           int height)
    : width_(width),
      height_(height),
      across_((width + kTile - 1) / kTile),
      down_((height + kTile - 1) / kTile),
      draw_(raster::draw()) {
  const std::vector<PlacedGrid>& placed = placed_in(tracer);
  const ImpostorScreen screen(camera, width, height);
  for (const FarInstance& instance : far) {
    const std::int32_t index = index_of(placed, instance.instance);
    if (index < 0 || instance.impostor == nullptr) continue;
    const auto drawn = screen.drawn(placed[static_cast<std::size_t>(index)], index, *instance.impostor);
    if (drawn) drawn_.push_back(*drawn);
  }
  std::stable_sort(drawn_.begin(), drawn_.end(),
                   [](const DrawnImpostor& a, const DrawnImpostor& b) { return a.placed < b.placed; });
  fill_bins();
}

void ImpostorPass::fill_bins() {
  bins_.resize(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_));
  std::vector<std::uint32_t> order(drawn_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return drawn_[a].nearest < drawn_[b].nearest; });
  for (const std::uint32_t i : order) {
    const PixelArea& area = drawn_[i].area;
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
    const DrawnImpostor& drawn = drawn_[i];
    const PixelArea& area = drawn.area;
    job.id = static_cast<std::int32_t>(i);
    job.left = std::max(area.left - column, 0), job.right = std::min(area.right - column, kTile);
    job.top = std::max(area.top - row, 0), job.bottom = std::min(area.bottom - row, kTile);
    if (is_hidden(drawn, job, canvas)) continue;
    job.level = &drawn.faces->levels[drawn.level];
    job.views = drawn.views;
    raster::set_aim(drawn.aim, x, y, job);
    draw_(job, canvas);
    if (!drawn.has_unseen()) continue;
    job.level = &drawn.faces->unseen;
    job.views = ~0U;
    draw_(job, canvas);
  }
}

bool ImpostorPass::is_hidden(const DrawnImpostor& drawn, const raster::Job& job, const raster::Canvas& canvas) {
  for (int y = job.top / kBlock; y <= (job.bottom - 1) / kBlock; ++y) {
    for (int x = job.left / kBlock; x <= (job.right - 1) / kBlock; ++x) {
      if (!(canvas.furthest[raster::index_of(x * kBlock, y * kBlock) / kLanes] < drawn.nearest)) return false;
    }
  }
  return true;
}

double ImpostorPass::distance_to(const DrawnImpostor& drawn, std::size_t number, const Ray& ray) {
  const ImpostorFaces::Face& face = drawn.faces->faces[number];
  if (face.in_field) return distance_to_surfel(drawn, face, drawn.faces->surfel_of(number), ray);
  const FaceFrame& frame = frame_of(face.direction);
  const int axis = frame.axis;
  const double plane = face.voxel[axis] + (frame.sign > 0 ? 1.0 : 0.0) - drawn.faces->centre[axis];
  const DVec3 row{drawn.axes[0][axis], drawn.axes[1][axis], drawn.axes[2][axis]};
  return ((plane - drawn.offset[axis]) * drawn.aim.voxel_size - glm::dot(row, ray.origin)) /
         glm::dot(row, ray.direction);
}

double ImpostorPass::distance_to_surfel(const DrawnImpostor& drawn, const ImpostorFaces::Face& face,
                                        const ImpostorFaces::Surfel& surfel, const Ray& ray) {
  const FaceFrame& frame = frame_of(face.direction);
  DVec3 upright(0.0);
  upright[frame.axis] = 1.0;
  upright[frame.u] = -double{surfel.slope[0]};
  upright[frame.v] = -double{surfel.slope[1]};
  DVec3 centre = DVec3(face.voxel) - drawn.faces->centre;
  centre[frame.axis] += double{surfel.offset};
  centre[frame.u] += double{surfel.shift[0]};
  centre[frame.v] += double{surfel.shift[1]};
  const DVec3 in_view = upright * drawn.axes;  // the transposed matrix times it
  return (glm::dot(upright, centre - drawn.offset) * drawn.aim.voxel_size - glm::dot(in_view, ray.origin)) /
         glm::dot(in_view, ray.direction);
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
    const DrawnImpostor& drawn = drawn_[static_cast<std::size_t>(canvas.id[first + i])];
    const auto number = static_cast<std::size_t>(canvas.face[first + i]);
    const ImpostorFaces::Face& face = drawn.faces->faces[number];
    const double t = distance_to(drawn, number, rays.ray(lane));
    const bool is_hit = (hits.grids.hit & bit) != 0;
    if (is_hit ? hits.grids.t[i] < t || (hits.grids.t[i] == t && hits.placed[i] < drawn.placed) : rays.max_t[i] < t) {
      continue;
    }
    hits.grids.set(lane, {face.voxel, face.direction, t, false});
    hits.grids.starts_inside &= ~bit;
    hits.placed[i] = drawn.placed;
    hits.in_field &= ~bit;
    if (face.in_field) {
      const Vec3 normal = drawn.faces->surfel_of(number).normal;
      hits.normal_x[i] = normal.x, hits.normal_y[i] = normal.y, hits.normal_z[i] = normal.z;
      hits.material[i] = face.type;
      hits.in_field |= bit;
    }
    faces.found |= bit;
    faces.face[i] = &face;
  }
}

}  // namespace quoin
