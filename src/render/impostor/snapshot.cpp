#include "render/impostor/snapshot.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "core/srgb.h"
#include "render/light/corner_light.h"
#include "scene/surfaces.h"

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

TexelArea texels_of(const SnapshotCamera& camera, const IBox& box, int edge) {
  QUOIN_ASSERT(!box.empty() && edge >= 1, "a box, and at least one texel");
  const double half = 0.5 * edge;
  constexpr double kRoom = 1e-6;
  const auto block_of = [&](double texel) {
    return static_cast<int>(std::clamp(texel, 0.0, static_cast<double>(edge))) / kTexelBlock * kTexelBlock;
  };
  TexelArea area{edge, edge, 0, 0};
  for (int corner = 0; corner < 8; ++corner) {
    const DVec3 seen = box_corner(box, corner) - camera.position;
    const double scale = camera.focal / glm::dot(seen, camera.forward);
    const double x = half + glm::dot(seen, camera.right) * scale;
    const double y = half - glm::dot(seen, camera.up) * scale;
    area.left = std::min(area.left, block_of(x - kRoom));
    area.top = std::min(area.top, block_of(y - kRoom));
    area.right = std::max(area.right, std::min(block_of(x + kRoom) + kTexelBlock, edge));
    area.bottom = std::max(area.bottom, std::min(block_of(y + kRoom) + kTexelBlock, edge));
  }
  return area;
}

RayPacket rays_of_texels(const SnapshotCamera& camera, int edge, int column, int row) {
  QUOIN_ASSERT(column >= 0 && column < edge && row >= 0 && row < edge, "a texel of the snapshot");
  RayPacket rays;
  rays.origin_x.fill(camera.position.x);
  rays.origin_y.fill(camera.position.y);
  rays.origin_z.fill(camera.position.z);
  rays.max_t.fill(std::numeric_limits<double>::infinity());
  rays.active = 0;
  const double half = 0.5 * edge;
  RayPacket::Lanes<double> scale;
  RayPacket::Lanes<double> x;
  RayPacket::Lanes<double> y;
  for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
    const int texel_x = column + static_cast<int>(i) % kTexelBlock;
    const int texel_y = row + static_cast<int>(i) / kTexelBlock;
    if (texel_x < edge && texel_y < edge) rays.active |= 1U << i;
    x[i] = texel_x + 0.5 - half;
    y[i] = half - (texel_y + 0.5);
    scale[i] = 1.0 / std::sqrt(x[i] * x[i] + y[i] * y[i] + camera.focal * camera.focal);
  }
  const auto turn = [&](int axis, RayPacket::Lanes<double>& out) {
    const double forward = camera.forward[axis] * camera.focal;
    for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
      out[i] = (camera.right[axis] * x[i] + camera.up[axis] * y[i] + forward) * scale[i];
    }
  };
  turn(0, rays.direction_x), turn(1, rays.direction_y), turn(2, rays.direction_z);
  return rays;
}

Snapshot take_snapshot(const SolidVoxels& solid, int view, int edge) {
  QUOIN_ASSERT(view >= 0 && view < kImpostorViews);
  QUOIN_ASSERT(edge >= 1 && edge <= 4096);
  const auto texels = static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge);
  Snapshot snapshot;
  const IBox bounds = solid.bounds();
  snapshot.camera = snapshot_camera(content_sphere(unite(solid.grid->bounds(), bounds)), view, edge);
  snapshot.edge = edge;
  snapshot.types.assign(texels, kAir);
  snapshot.faces.assign(texels, Direction::PosX);
  snapshot.occlusion.assign(texels, 0);
  snapshot.depth.assign(texels, std::numeric_limits<float>::infinity());
  if (bounds.empty()) return snapshot;
  if (solid.shapes != nullptr) snapshot.shapes.resize(texels);
  GridReader reader(*solid.grid);
  PacketHits hits;
  RayPacket::Lanes<ShapeHit> in_shapes;
  const TexelArea area = texels_of(snapshot.camera, bounds, edge);
  for (int row = area.top; row < area.bottom; row += kTexelBlock) {
    for (int column = area.left; column < area.right; column += kTexelBlock) {
      const RayPacket rays = rays_of_texels(snapshot.camera, edge, column, row);
      const std::uint32_t of_shapes = solid.first_hits(rays, hits, in_shapes);
      for (std::uint32_t left = hits.hit; left != 0; left &= left - 1) {
        const int lane = std::countr_zero(left);
        const Ray ray = rays.ray(lane);
        const RayHit hit = hits[lane];
        const auto texel = static_cast<std::size_t>((row + lane / kTexelBlock) * edge + column + lane % kTexelBlock);
        FaceOcclusion corners{};
        bool has_corners = true;
        if ((of_shapes >> lane & 1U) != 0) {
          const ShapeHit& shape = in_shapes[static_cast<std::size_t>(lane)];
          snapshot.shapes[texel] = {shape.model, shape.face};
          has_corners = snapshot.shapes[texel].on_side();
        }
        if (has_corners) corners = corner_occlusion(reader, *solid.types, hit.voxel, hit.face);
        const float occlusion = occlusion_at(corners, hit.voxel, hit.face, ray.origin + ray.direction * hit.t);
        snapshot.types[texel] = reader.get(hit.voxel);
        snapshot.faces[texel] = hit.face;
        snapshot.occlusion[texel] = static_cast<std::uint8_t>(std::lround(occlusion * (255.0F / 3.0F)));
        snapshot.depth[texel] = static_cast<float>(hit.t);
      }
    }
  }
  return snapshot;
}

namespace {

Camera camera_of(const SnapshotCamera& from, int edge) {
  Camera camera;
  camera.position = from.position;
  camera.right = from.right, camera.up = from.up, camera.forward = from.forward;
  camera.vertical_fov_radians = 2.0 * std::atan(0.5 * edge / from.focal);
  return camera;
}

ImpostorImage rendered_of(const Snapshot& snapshot, const VoxelRegistry& types) {
  const Rgba8 unknown{255, 0, 255, 255};
  const std::size_t texels = snapshot.types.size();
  ImpostorImage image;
  image.camera = camera_of(snapshot.camera, snapshot.edge);
  image.colour = {snapshot.edge, snapshot.edge, std::vector<std::uint8_t>(3 * texels)};
  image.depth = {snapshot.edge, snapshot.edge, snapshot.depth};
  image.coverage.resize(texels);
  for (std::size_t i = 0; i < texels; ++i) {
    const VoxelType type = snapshot.types[i];
    if (type == kAir) continue;
    Rgba8 colour = type < types.size() ? types[type].colour : unknown;
    if (!snapshot.shapes.empty() && snapshot.shapes[i].face >= 0) {
      const auto [model, face] = snapshot.shapes[i];
      const VoxelFace* const look = look_of(*model, model->faces[static_cast<std::size_t>(face)], types[type].faces);
      if (look != nullptr) colour = srgb_colour(mean_colour(*look));
    }
    image.coverage[i] = 255;
    image.colour.rgb[3 * i] = colour.r, image.colour.rgb[3 * i + 1] = colour.g;
    image.colour.rgb[3 * i + 2] = colour.b;
  }
  return image;
}

}  // namespace

std::vector<ImpostorImage> impostor_images(const Grid& grid, const VoxelRegistry& types, const ImpostorOptions& options,
                                           Threads threads) {
  TreeCache trees(ShapedVoxels::ByShape);
  trees.update(grid, types);
  const SolidVoxels solid{&grid, &types, &trees.opaque(), trees.shapes()};
  std::vector<ImpostorImage> images(kImpostorViews);
  parallel_for(images.size(), threads, [&](std::size_t view) {
    images[view] = rendered_of(take_snapshot(solid, static_cast<int>(view), options.edge), types);
  });
  return images;
}

}  // namespace quoin
