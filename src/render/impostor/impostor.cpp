#include <quoin/render/impostor.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "light/corner_light.h"
#include "render/impostor/raster/faces.h"
#include "render/impostor/snapshot.h"

namespace quoin {
namespace {

constexpr double kDistanceInRadii = 8.0;
constexpr double kUprightUpTo = 0.99;  // |v.y|: beyond, +Y is too close to the view for an upright

std::array<DVec3, kImpostorViews> all_views() {
  std::array<DVec3, kImpostorViews> views{};
  std::size_t count = 0;
  const auto add = [&](double x, double y, double z) { views[count++] = glm::normalize(DVec3(x, y, z)); };
  for (const Direction face : kDirections) views[count++] = DVec3(normal_of(face));
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-1.0, 1.0}) add(a, b, 0), add(a, 0, b), add(0, a, b);
  }
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      for (const double z : {-1.0, 1.0}) add(x, y, z);
    }
  }
  QUOIN_ASSERT(count == views.size(), "one direction per view");
  return views;
}

const std::array<DVec3, kImpostorViews>& views() {
  static const std::array<DVec3, kImpostorViews> all = all_views();
  return all;
}

}  // namespace

DVec3 impostor_view(int index) {
  QUOIN_ASSERT(index >= 0 && index < kImpostorViews, "0 <= index < kImpostorViews");
  return views()[static_cast<std::size_t>(index)];
}

std::optional<int> nearest_impostor_view(DVec3 direction) {
  if (!is_finite(direction) || direction == DVec3(0.0)) return std::nullopt;
  // Scaled first, so that products of huge or tiny directions keep their order.
  const DVec3 size = glm::abs(direction);
  direction /= std::max({size.x, size.y, size.z});
  int best = 0;
  double largest = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < kImpostorViews; ++i) {
    const double product = glm::dot(direction, impostor_view(i));
    if (product > largest) largest = product, best = i;
  }
  return best;
}

double SnapshotCamera::half_size() const {
  return reach * distance / std::sqrt(distance * distance - reach * reach);
}

SnapshotCamera snapshot_camera(const ContentSphere& content, int view, int edge) {
  QUOIN_ASSERT(edge >= 1, "at least one texel");
  const DVec3 direction = impostor_view(view);
  SnapshotCamera camera;
  camera.reach = std::max(content.radius, 1.0);
  camera.distance = kDistanceInRadii * camera.reach;
  camera.position = content.centre + direction * camera.distance;
  camera.forward = -direction;
  const DVec3 upright = std::abs(direction.y) >= kUprightUpTo ? DVec3(1, 0, 0) : DVec3(0, 1, 0);
  camera.up = glm::normalize(upright - direction * glm::dot(upright, direction));
  camera.right = glm::cross(camera.forward, camera.up);
  camera.focal = 0.5 * edge * camera.distance / camera.half_size();
  return camera;
}

std::size_t ImpostorFaces::bytes() const {
  const auto of_level = [](const Level& level) {
    return level.views.size() * (3 * sizeof(float) + 2 * sizeof(std::uint32_t)) +
           (level.reach[0].size() + level.slope[0].size()) * 2 * sizeof(float) +
           level.groups.views.size() * (6 * sizeof(float) + sizeof(std::uint32_t)) + level.cells.size() * sizeof(Cell);
  };
  std::size_t sum = sizeof(*this) + faces.size() * sizeof(Face) + surfels.size() * sizeof(Surfel) + of_level(unseen);
  for (const Level& level : levels) sum += of_level(level);
  return sum;
}

float openness_of(const ImpostorFaces::Face& face, OcclusionMode mode, DVec3 position) {
  if (face.in_field || (mode != OcclusionMode::Vertex && mode != OcclusionMode::Smooth))
    return static_cast<float>(face.open_rays) / ImpostorFaces::Face::kRays;
  if (face.occlusion == 0) return 1.0F;
  return 1.0F - occlusion_at(unpacked_corners(face.occlusion), face.voxel, face.direction, position) / 3.0F;
}

Impostor::Impostor() : faces_(std::make_shared<const ImpostorFaces>()) {}

Impostor Impostor::build(const Grid& grid, const VoxelRegistry& types, const ImpostorOptions& options) {
  return build(grid, types, OccupancyTree::build(grid, types, Occupancy::Opaque), options);
}

std::size_t Impostor::bytes() const {
  return sizeof(*this) + faces_->bytes();
}

}  // namespace quoin
