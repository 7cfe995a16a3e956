#include <quoin/scene/camera.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>
#include <quoin/scene/scene.h>

namespace quoin {
namespace {

constexpr double kFramingFov = 30.0 * std::numbers::pi / 180.0;  // narrow enough to keep towers upright
constexpr double kMargin = 0.04;                                 // share of the image's width (height), on each side

struct NamedView {
  std::string_view name;
  View view;
  DVec3 forward;
};

/// `iso` looks along the diagonal of a cube, as isometric drawings do.
constexpr double kThird = 0.57735026918962576451;
const std::array<NamedView, 6> kViews = {{{"front", View::Front, {0, 0, -1}},
                                          {"back", View::Back, {0, 0, 1}},
                                          {"left", View::Left, {1, 0, 0}},
                                          {"right", View::Right, {-1, 0, 0}},
                                          {"top", View::Top, {0, -1, 0}},
                                          {"iso", View::Iso, {-kThird, -kThird, -kThird}}}};

/// Sets the axes for looking along `forward`, a unit vector: upright; with +X to the right straight up and down.
void turn(Camera& camera, DVec3 forward) {
  camera.forward = forward;
  const double level = std::hypot(forward.x, forward.z);
  camera.right = level > 0.0 ? DVec3{-forward.z / level + 0.0, 0.0, forward.x / level} : DVec3{1.0, 0.0, 0.0};
  camera.up = glm::cross(camera.right, camera.forward);
}

/// Returns the box to frame, with a positive volume.
DBox box_to_frame(const DBox& bounds) {
  if (bounds.empty()) return {DVec3{0.0}, DVec3{1.0}};
  return bounds.min == bounds.max ? DBox{bounds.min - 0.5, bounds.max + 0.5} : bounds;
}

/// A function that returns the maximum dot product of a direction (of any length) with the vectors from the middle
/// point to the points of an object.
using Reach = std::function<double(DVec3 direction)>;

/// The camera position, along one image axis and the view direction, such that all corners are visible.
struct Stand {
  double across;   ///< along the image axis, midway between the limits of the two edges
  double forward;  ///< the maximum along the view direction
};

/// Each point at depth f may lie up to `slope * (f - stand)` to either side.
Stand stand_for(const Reach& reach, DVec3 axis, DVec3 forward, double slope) {
  const double greatest = reach(axis - slope * forward);
  const double least = reach(-axis - slope * forward);
  return {0.5 * (greatest - least), -0.5 * (greatest + least) / slope};
}

/// Returns a camera that looks along `forward`, a unit vector. Its image shows the whole object, filling it except for
/// a margin.
///
/// Requires: the object has an inside; everything is finite.
Camera frame(DVec3 middle, const Reach& reach, DVec3 forward, double aspect) {
  QUOIN_ASSERT(aspect > 0.0 && std::isfinite(aspect), "a positive, finite aspect");
  QUOIN_ASSERT(std::abs(glm::length(forward) - 1.0) < 1e-6, "a unit direction");
  Camera camera;
  camera.vertical_fov_radians = kFramingFov;
  turn(camera, forward);
  const double slope = std::tan(0.5 * kFramingFov) * (1.0 - 2.0 * kMargin);
  const Stand level = stand_for(reach, camera.right, camera.forward, slope * aspect);
  const Stand upright = stand_for(reach, camera.up, camera.forward, slope);
  camera.position = middle + level.across * camera.right + upright.across * camera.up +
                    std::min(level.forward, upright.forward) * camera.forward;
  return camera;
}

/// Returns the four directions that `frame` passes to `reach`, in order.
std::array<DVec3, 4> framing_directions(DVec3 forward, double aspect) {
  // The middle and the reach are dummies; only the requested directions matter.
  std::array<DVec3, 4> asked{};
  std::size_t count = 0;
  static_cast<void>(frame(
      DVec3(0.0),
      [&](DVec3 direction) {
        QUOIN_ASSERT(count < asked.size(), "a reach is asked of four directions");
        asked[count++] = direction;
        return 1.0;
      },
      forward, aspect));
  return asked;
}

}  // namespace

Result<Camera> look_along(DVec3 position, DVec3 direction, double vertical_fov_radians) {
  if (!is_finite(position)) return make_error(ErrorCode::InvalidArgument, "camera: position must be finite");
  if (!is_finite(direction)) return make_error(ErrorCode::InvalidArgument, "camera: direction must be finite");
  if (!(vertical_fov_radians > 0.0 && vertical_fov_radians < std::numbers::pi)) {
    return make_error(ErrorCode::InvalidArgument,
                      "camera: field of view must be more than 0 and less than pi radians (180 degrees)");
  }
  // Scaled so that no square is lost.
  const double largest = std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
  if (!(largest > 0.0)) return make_error(ErrorCode::InvalidArgument, "camera: direction must not be 0");
  Camera camera;
  camera.position = position;
  camera.vertical_fov_radians = vertical_fov_radians;
  turn(camera, glm::normalize(direction / largest));
  return camera;
}

Result<Camera> look_at(DVec3 position, DVec3 target, double vertical_fov_radians) {
  if (!is_finite(target)) return make_error(ErrorCode::InvalidArgument, "camera: target must be finite");
  if (position == target) return make_error(ErrorCode::InvalidArgument, "camera: position and target must differ");
  // Halved so that the difference of the largest numbers stays finite.
  return look_along(position, 0.5 * target - 0.5 * position, vertical_fov_radians);
}

glm::dmat4 camera_from_world(const Camera& camera) {
  const glm::dmat3 camera_axes = glm::transpose(glm::dmat3(camera.right, camera.up, -camera.forward));
  glm::dmat4 matrix(camera_axes);
  matrix[3] = glm::dvec4(-(camera_axes * camera.position), 1.0);
  return matrix;
}

namespace {

/// Returns the size of a pixel of an image with the given height: in the plane 1 in front of a perspective camera, or
/// in world units.
double pixel_size(const Camera& camera, int height) {
  QUOIN_ASSERT(height > 0, "a positive image height");
  const bool is_perspective = camera.projection == Camera::Projection::Perspective;
  const double image_height = is_perspective ? 2.0 * std::tan(camera.vertical_fov_radians / 2.0) : camera.view_height;
  return image_height / height;
}

}  // namespace

std::optional<ImagePoint> image_point(const Camera& camera, DVec3 point_in_world, int width, int height) {
  QUOIN_ASSERT(width > 0 && height > 0, "a positive image size");
  const DVec3 from_camera = point_in_world - camera.position;
  double pixel = pixel_size(camera, height);
  if (camera.projection == Camera::Projection::Perspective) {
    const double ahead = glm::dot(from_camera, camera.forward);
    if (!(ahead > 0.0)) return std::nullopt;
    pixel *= ahead;
  }
  const ImagePoint point{0.5 * width + glm::dot(from_camera, camera.right) / pixel,
                         0.5 * height - glm::dot(from_camera, camera.up) / pixel, width, height};
  if (!std::isfinite(point.x) || !std::isfinite(point.y)) return std::nullopt;
  return point;
}

Ray ray_through(const Camera& camera, const ImagePoint& point) {
  const auto [x, y, width, height] = point;
  QUOIN_ASSERT(width > 0 && height > 0, "a positive image size");
  const bool is_perspective = camera.projection == Camera::Projection::Perspective;
  const double pixel = pixel_size(camera, height);
  const DVec3 across = camera.right * ((x - 0.5 * width) * pixel) + camera.up * ((0.5 * height - y) * pixel);
  if (!is_perspective) return {camera.position + across, camera.forward};
  return {camera.position, glm::normalize(camera.forward + across)};
}

std::optional<View> view_of_name(std::string_view name) {
  for (const NamedView& known : kViews) {
    if (known.name == name) return known.view;
  }
  return std::nullopt;
}

DVec3 direction_of(View view) {
  QUOIN_ASSERT(static_cast<std::size_t>(view) < kViews.size(), "one of the views");
  return kViews[static_cast<std::size_t>(view)].forward;
}

DVec3 direction_of(double azimuth_degrees, double elevation_degrees) {
  const double a = azimuth_degrees * std::numbers::pi / 180.0;
  const double e = elevation_degrees * std::numbers::pi / 180.0;
  return glm::normalize(-DVec3(std::sin(a) * std::cos(e), std::sin(e), std::cos(a) * std::cos(e)));
}

Camera frame_view(const DBox& bounds, View view, double aspect) {
  QUOIN_ASSERT(bounds.empty() || (is_finite(bounds.min) && is_finite(bounds.max)), "finite bounds");
  const DBox box = box_to_frame(bounds);
  const DVec3 half = 0.5 * (box.max - box.min);
  return frame(
      box.min + half, [half](DVec3 direction) { return glm::dot(glm::abs(direction), half); }, direction_of(view),
      aspect);
}

namespace {

/// The dot product with a point of the grid is `offset + dot(slope, point)`.
struct Functional {
  double offset = 0.0;
  DVec3 slope{0.0};

  /// Returns the maximum within a box.
  [[nodiscard]] double over(IVec3 min, IVec3 max) const {
    const DVec3 corner{slope.x > 0.0 ? max.x : min.x, slope.y > 0.0 ? max.y : min.y, slope.z > 0.0 ? max.z : min.z};
    return offset + glm::dot(slope, corner);
  }
};

struct Candidate {
  double bound;  ///< upper bound of the chunk's reach
  const Chunk* voxels;
  const DensityChunk* samples;  ///< if there are no voxels
  IVec3 first;                  ///< the chunk's first voxel or sample in its grid
  IBox box;                     ///< box of the counted voxels or samples, in chunk coordinates
  Functional functional;

  [[nodiscard]] std::uint64_t row(int y, int z) const {
    QUOIN_ASSERT((samples == nullptr) != (voxels == nullptr), "either voxels or samples");
    return samples == nullptr ? ~voxels->row_mask(y, z, kAir) : samples->solid_row(y, z);
  }
  /// For fields, the solid around a sample begins after the previous sample on each axis.
  [[nodiscard]] int margin() const { return samples == nullptr ? 0 : 1; }
  [[nodiscard]] double over(IVec3 min, IVec3 max) const { return functional.over(min - margin(), max); }
};

void add_candidates(const Instance& instance, const SceneGrid& grid, DVec3 direction, DVec3 middle,
                    std::vector<Candidate>& out) {
  Functional functional;
  functional.slope = glm::transpose(world_axes(instance)) * direction * instance.voxel_size;
  functional.offset = glm::dot(direction, instance.position - middle) - glm::dot(functional.slope, grid.pivot);
  for (const IVec3 coords : grid.grid.chunks()) {
    const Chunk* chunk = grid.grid.find_chunk(coords);
    const IVec3 first = coords * kChunkEdge;
    Candidate candidate{0.0, chunk, nullptr, first, chunk->bounds(), functional};
    candidate.bound = candidate.over(first + candidate.box.min, first + candidate.box.max);
    if (!candidate.box.empty()) out.push_back(candidate);
  }
  for (const IVec3 coords : grid.field.chunks()) {
    const IVec3 first = coords * kChunkEdge;
    Candidate candidate{0.0, nullptr, grid.field.find_chunk(coords), first, kWholeChunk, functional};
    candidate.bound = candidate.over(first, first + kChunkEdge);
    out.push_back(candidate);
  }
}

/// Returns the maximum over a chunk's contents, or `least` if that is greater.
double scan(const Candidate& candidate, double least) {
  const IBox& box = candidate.box;
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      const IVec3 low = candidate.first + IVec3{box.min.x, y, z};
      const IVec3 high = candidate.first + IVec3{box.max.x, y + 1, z + 1};
      if (candidate.over(low, high) <= least) continue;
      const std::uint64_t row = candidate.row(y, z);
      if (row == 0) continue;
      const IVec3 first{candidate.first.x + std::countr_zero(row), low.y, low.z};
      const IVec3 last{candidate.first.x + kChunkEdge - std::countl_zero(row), high.y, high.z};
      least = std::max(least, candidate.over(first, last));
    }
  }
  return least;
}

double reach_of(const Scene& scene, InstanceFilter filter, DVec3 direction, DVec3 middle) {
  std::vector<Candidate> candidates;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid* grid = scene.grids().find(instance.grid);
    if (grid == nullptr || !passes(filter, scene, instance) || !has_valid_transform(instance)) continue;
    add_candidates(instance, *grid, direction, middle, candidates);
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.bound > b.bound; });
  double greatest = -std::numeric_limits<double>::infinity();
  for (const Candidate& candidate : candidates) {
    if (candidate.bound <= greatest) break;
    greatest = scan(candidate, greatest);
  }
  return greatest;
}

}  // namespace

Camera frame_scene(const Scene& scene, View view, double aspect, InstanceFilter filter) {
  const DBox bounds = scene.bounds(filter);
  if (bounds.empty()) return frame_view(bounds, view, aspect);
  const DVec3 middle = bounds.min + 0.5 * (bounds.max - bounds.min);
  const auto reach = [&](DVec3 direction) { return reach_of(scene, filter, direction, middle); };
  return frame(middle, reach, direction_of(view), aspect);
}

namespace {

/// Rotates to the right as seen from the front: +Z towards +X.
DVec3 turned(DVec3 v, int turn, int turns) {
  QUOIN_ASSERT(turns > 0, "a positive number of turns");
  const double angle = 2.0 * std::numbers::pi * turn / turns;
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  return {c * v.x + s * v.z, v.y, c * v.z - s * v.x};
}

}  // namespace

SceneFraming::SceneFraming(DVec3 forward, double aspect, int turns)
    : forward_(forward), aspect_(aspect), turns_(turns) {
  QUOIN_ASSERT(std::abs(glm::length(forward) - 1.0) < 1e-6, "a unit direction");
  QUOIN_ASSERT(aspect > 0.0 && std::isfinite(aspect), "a positive, finite aspect");
  QUOIN_ASSERT(turns > 0, "a positive number of turns");
  reaches_.fill(-std::numeric_limits<double>::infinity());
}

void SceneFraming::add(const Scene& scene, InstanceFilter filter) {
  const DBox bounds = scene.bounds(filter);
  if (bounds.empty()) return;
  if (!middle_) middle_ = bounds.min + 0.5 * (bounds.max - bounds.min);
  const std::array<DVec3, 4> directions = framing_directions(forward_, aspect_);
  for (int turn = 0; turn < turns_; ++turn) {
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const double reach = reach_of(scene, filter, turned(directions[i], turn, turns_), *middle_);
      reaches_[i] = std::max(reaches_[i], reach);
    }
  }
}

Camera SceneFraming::camera(int turn) const {
  QUOIN_ASSERT(turn >= 0 && turn < turns_, "one of the turns");
  const DVec3 middle = middle_.value_or(DVec3(0.5));
  std::size_t asked = 0;
  const auto reach = [&](DVec3 direction) {
    QUOIN_ASSERT(asked < reaches_.size(), "a reach is asked of four directions");
    const double of_cube = 0.5 * (std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z));
    return middle_ ? reaches_[asked++] : of_cube;
  };
  Camera camera = frame(middle, reach, forward_, aspect_);
  camera.position = middle + turned(camera.position - middle, turn, turns_);
  for (DVec3* axis : {&camera.right, &camera.up, &camera.forward}) *axis = turned(*axis, turn, turns_);
  return camera;
}

}  // namespace quoin
