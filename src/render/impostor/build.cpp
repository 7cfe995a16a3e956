#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include <quoin/trace/packet.h>

#include "light/corner_light.h"
#include "light/occlusion_directions.h"
#include "render/impostor/seen.h"
#include "render/impostor/shell.h"

namespace quoin {
namespace {

constexpr std::int64_t kMaxVoxels = std::int64_t{1} << 26;  // of the box that faces are found in all at once

// Texels a side: so many that one is no larger than a voxel, as far as the memory for that is worth it.
int edge_for(const ContentSphere& content) {
  const double voxels = 2.0 * snapshot_camera(content, 0, Impostor::kEdge).half_size();
  return voxels <= Impostor::kEdge ? Impostor::kEdge : 2 * Impostor::kEdge;
}

std::uint8_t packed(const FaceOcclusion& corners) {
  unsigned all = 0;
  for (std::size_t i = 0; i < 4; ++i) all |= static_cast<unsigned>(corners[i]) << 2 * i;
  return static_cast<std::uint8_t>(all);
}

// How many of the rays of OcclusionDirections reach open space from the middle of each face; by sixteens, which mostly
// are of one direction.
void count_open_rays(const OccupancyTree& opaque, std::vector<ImpostorFaces::Face>& faces) {
  constexpr double kLift = 0.01;
  constexpr int kRays = ImpostorFaces::Face::kRays;
  const OcclusionDirections directions(kRays);
  RayPacket rays;
  rays.max_t.fill(LightOptions{}.occlusion_distance);
  for (std::size_t begin = 0; begin < faces.size(); begin += RayPacket::kSize) {
    const std::size_t size = std::min<std::size_t>(RayPacket::kSize, faces.size() - begin);
    rays.active = (1U << size) - 1U;
    for (std::size_t i = 0; i < size; ++i) {
      const ImpostorFaces::Face& face = faces[begin + i];
      const DVec3 origin = DVec3(face.voxel) + 0.5 + (0.5 + kLift) * DVec3(normal_of(face.direction));
      rays.origin_x[i] = origin.x, rays.origin_y[i] = origin.y, rays.origin_z[i] = origin.z;
    }
    std::array<int, RayPacket::kSize> open{};
    for (int ray = 0; ray < kRays; ++ray) {
      for (std::size_t i = 0; i < size; ++i) {
        const DVec3 direction = directions.fixed(static_cast<std::size_t>(faces[begin + i].direction), ray);
        rays.direction_x[i] = direction.x, rays.direction_y[i] = direction.y, rays.direction_z[i] = direction.z;
      }
      const std::uint32_t blocked = any_hits(opaque, rays);
      for (std::size_t i = 0; i < size; ++i) open[i] += (blocked >> i & 1U) == 0;
    }
    for (std::size_t i = 0; i < size; ++i) faces[begin + i].open_rays = static_cast<std::uint8_t>(open[i] & 15);
  }
}

template <class IsOpaque>
void put_faces(const std::vector<SeenFace>& seen, GridReader& reader, IsOpaque is_opaque, ImpostorFaces& out) {
  out.faces.reserve(seen.size());
  for (const SeenFace& each : seen) {
    const auto [voxel, direction] = each.face;
    ImpostorFaces::Face& face = out.faces.emplace_back();
    face.voxel = voxel;
    face.direction = direction;
    face.type = reader.get(voxel);
    face.occlusion = packed(corner_occlusion(is_opaque, voxel, direction));
  }
}

}  // namespace

Impostor Impostor::build(const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque) {
  Impostor made;
  made.content_ = content_sphere(grid);
  made.box_ = opaque.bounds();
  if (made.is_empty()) return made;
  auto faces = std::make_shared<ImpostorFaces>();
  const int edge = edge_for(made.content_);
  // Beyond that, a ray for each texel takes less time.
  const std::int64_t max_faces = std::int64_t{kImpostorViews} * edge * edge;
  const std::optional<ImpostorShell> shell = ImpostorShell::build(opaque, kMaxVoxels, max_faces);
  const std::vector<SeenFace> seen =
      shell ? faces_seen_of(*shell, made.box_, made.content_, edge) : faces_seen_by_rays(opaque, made.content_, edge);
  faces->edge = edge;
  faces->centre = made.content_.centre;
  for (std::size_t level = 0; level < faces->levels.size(); ++level) {
    faces->levels[level] = faces_of_level(seen, level, edge >> level, made.content_);
  }
  faces->unseen = unseen_faces(seen, made.content_);
  GridReader reader(grid);
  if (shell) {
    put_faces(
        seen, reader, [&](IVec3 voxel) { return shell->is_occupied(voxel); }, *faces);
  } else {
    put_faces(
        seen, reader, [&](IVec3 voxel) { return types.is_opaque(reader.get(voxel)); }, *faces);
  }
  count_open_rays(opaque, faces->faces);
  made.faces_ = std::move(faces);
  return made;
}

}  // namespace quoin
