#include <quoin/render/impostor.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "light/corner_light.h"

namespace quoin {
namespace {

constexpr double kDistanceInRadii = 8.0;
constexpr double kUprightUpTo = 0.99;  // |v.y|: beyond, +Y is too close to the view for an upright
constexpr int kBlock = 4;              // texels a side that are traced together

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
  return views;
}

const std::array<DVec3, kImpostorViews>& views() {
  static const std::array<DVec3, kImpostorViews> all = all_views();
  return all;
}

}  // namespace

DVec3 impostor_view(int index) {
  return views()[static_cast<std::size_t>(index)];
}

std::optional<int> nearest_impostor_view(DVec3 direction) {
  if (!is_finite(direction) || direction == DVec3(0.0)) return std::nullopt;
  // Scaled first, so that neither huge nor tiny directions lose the order of their products.
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

/// Fills the snapshots of an impostor.
class SnapshotTaker {
 public:
  SnapshotTaker(Impostor& impostor, const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque,
                InstructionSet instructions)
      : impostor_(&impostor),
        reader_(grid),
        types_(&types),
        opaque_(&opaque),
        instructions_(instructions),
        known_(kKnown) {}

  void take(int view) {
    camera_ = &impostor_->cameras_[static_cast<std::size_t>(view)];
    first_texel_ = static_cast<std::size_t>(view) * Impostor::kTexels;
    const Area area = area_of(impostor_->box());
    for (int y = area.top; y < area.bottom; y += kBlock) {
      for (int x = area.left; x < area.right; x += kBlock) take_block(x, y);
    }
    impostor_->find_clear_depths(view);
  }

 private:
  // What was found of a face, since several texels and views see it.
  struct KnownFace {
    IVec3 voxel{0};
    Direction face = Direction::PosX;
    VoxelType type = kAir;
    FaceLevels levels{};
  };
  static constexpr std::size_t kKnown = std::size_t{1} << 15;

  // Texels, multiples of kBlock, within which a box shows.
  struct Area {
    int left = Impostor::kEdge;
    int top = Impostor::kEdge;
    int right = 0;
    int bottom = 0;
  };
  [[nodiscard]] Area area_of(const IBox& box) const;
  void take_block(int column, int row);
  void write(std::size_t texel, const RayHit& hit, DVec3 position);
  const KnownFace& face_at(IVec3 voxel, Direction face);

  Impostor* impostor_;
  GridReader reader_;
  const VoxelRegistry* types_;
  const OccupancyTree* opaque_;
  InstructionSet instructions_;
  const SnapshotCamera* camera_ = nullptr;
  std::size_t first_texel_ = 0;
  std::vector<KnownFace> known_;
};

SnapshotTaker::Area SnapshotTaker::area_of(const IBox& box) const {
  constexpr double kHalf = 0.5 * Impostor::kEdge;
  constexpr double kRoom = 1e-6;
  const auto block_of = [](double texel) {
    return static_cast<int>(std::clamp(texel, 0.0, static_cast<double>(Impostor::kEdge))) / kBlock * kBlock;
  };
  Area area;
  for (int corner = 0; corner < 8; ++corner) {
    const DVec3 point{(corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
                      (corner & 4) != 0 ? box.max.z : box.min.z};
    const DVec3 seen = point - camera_->position;
    const double scale = camera_->focal / glm::dot(seen, camera_->forward);
    const double x = kHalf + glm::dot(seen, camera_->right) * scale;
    const double y = kHalf - glm::dot(seen, camera_->up) * scale;
    area.left = std::min(area.left, block_of(x - kRoom));
    area.top = std::min(area.top, block_of(y - kRoom));
    area.right = std::max(area.right, std::min(block_of(x + kRoom) + kBlock, Impostor::kEdge));
    area.bottom = std::max(area.bottom, std::min(block_of(y + kRoom) + kBlock, Impostor::kEdge));
  }
  return area;
}

void SnapshotTaker::take_block(int column, int row) {
  RayPacket rays;
  rays.origin_x.fill(camera_->position.x);
  rays.origin_y.fill(camera_->position.y);
  rays.origin_z.fill(camera_->position.z);
  rays.max_t.fill(std::numeric_limits<double>::infinity());
  rays.active = 0xFFFFU;
  constexpr double kHalf = 0.5 * Impostor::kEdge;
  for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
    const double x = column + static_cast<int>(i) % kBlock + 0.5 - kHalf;
    const double y = kHalf - (row + static_cast<int>(i) / kBlock + 0.5);
    const double inverse = 1.0 / std::sqrt(x * x + y * y + camera_->focal * camera_->focal);
    const DVec3 direction = (camera_->right * x + camera_->up * y + camera_->forward * camera_->focal) * inverse;
    rays.direction_x[i] = direction.x;
    rays.direction_y[i] = direction.y;
    rays.direction_z[i] = direction.z;
  }
  PacketHits hits;
  first_hits(*opaque_, rays, hits, instructions_);
  for (std::uint32_t left = hits.hit; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const Ray ray = rays.ray(lane);
    const RayHit hit = hits[lane];
    const int texel = (row + lane / kBlock) * Impostor::kEdge + column + lane % kBlock;
    write(first_texel_ + static_cast<std::size_t>(texel), hit, ray.origin + ray.direction * hit.t);
  }
}

void SnapshotTaker::write(std::size_t texel, const RayHit& hit, DVec3 position) {
  const KnownFace& face = face_at(hit.voxel, hit.face);
  impostor_->types_[texel] = face.type;
  impostor_->faces_[texel] = hit.face;
  impostor_->depth_[texel] = static_cast<float>(hit.t);
  const bool is_open = face.levels == FaceLevels{};
  const float level = is_open ? 0.0F : level_at(face.levels, hit.voxel, hit.face, position);
  impostor_->occlusion_[texel] = static_cast<std::uint8_t>(std::lround(level * (255.0F / 3.0F)));
}

const SnapshotTaker::KnownFace& SnapshotTaker::face_at(IVec3 voxel, Direction face) {
  const auto bits = [](int coordinate) { return static_cast<std::uint32_t>(coordinate); };
  const std::uint32_t hash =
      (bits(voxel.x) * 0x9E37'79B1U ^ bits(voxel.y) * 0x85EB'CA77U ^ bits(voxel.z) * 0xC2B2'AE3DU) >> 7;
  KnownFace& known = known_[(hash * 6U + static_cast<std::uint32_t>(face)) % kKnown];
  if (known.type != kAir && known.voxel == voxel && known.face == face) return known;
  known.voxel = voxel;
  known.face = face;
  known.type = reader_.get(voxel);
  known.levels = corner_levels(reader_, *types_, voxel, face);
  return known;
}

Impostor::Impostor()
    : types_(kImpostorViews * kTexels, kAir),
      faces_(kImpostorViews * kTexels, Direction::PosX),
      occlusion_(kImpostorViews * kTexels, 0),
      depth_(kImpostorViews * kTexels, std::numeric_limits<float>::infinity()),
      clear_depth_(kImpostorViews * kTiles, std::numeric_limits<float>::infinity()),
      near_depth_(kImpostorViews * kPairs, std::numeric_limits<float>::infinity()) {
  for (int view = 0; view < kImpostorViews; ++view) {
    cameras_[static_cast<std::size_t>(view)] = snapshot_camera(content_, view, kEdge);
  }
}

Impostor Impostor::build(const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque,
                         InstructionSet instructions) {
  Impostor made;
  made.content_ = content_sphere(grid);
  made.box_ = opaque.bounds();
  for (int view = 0; view < kImpostorViews; ++view) {
    made.cameras_[static_cast<std::size_t>(view)] = snapshot_camera(made.content_, view, kEdge);
  }
  if (made.is_empty()) return made;
  SnapshotTaker taker(made, grid, types, opaque, instructions);
  for (int view = 0; view < kImpostorViews; ++view) taker.take(view);
  return made;
}

Impostor Impostor::build(const Grid& grid, const VoxelRegistry& types, InstructionSet instructions) {
  return build(grid, types, OccupancyTree::build(grid, types, Occupancy::Opaque), instructions);
}

void Impostor::spread_least(std::span<const float> depth, int tile, std::span<float> out) {
  const int across = kEdge / tile;
  std::vector<float> least(out.size(), std::numeric_limits<float>::infinity());
  for (int y = 0; y < kEdge; ++y) {
    float* row = least.data() + static_cast<std::ptrdiff_t>(y / tile * across);
    const float* from = depth.data() + static_cast<std::ptrdiff_t>(y * kEdge);
    for (int x = 0; x < kEdge; ++x) row[x / tile] = std::min(row[x / tile], from[x]);
  }
  // Along rows, then along columns.
  std::vector<float> wide(out.size());
  const auto spread = [across](const std::vector<float>& from, int i, int place, int stride) {
    float value = from[static_cast<std::size_t>(i)];
    if (place > 0) value = std::min(value, from[static_cast<std::size_t>(i - stride)]);
    if (place + 1 < across) value = std::min(value, from[static_cast<std::size_t>(i + stride)]);
    return value;
  };
  const int count = across * across;
  for (int i = 0; i < count; ++i) wide[static_cast<std::size_t>(i)] = spread(least, i, i % across, 1);
  for (int i = 0; i < count; ++i) out[static_cast<std::size_t>(i)] = spread(wide, i, i / across, across);
}

void Impostor::find_clear_depths(int view) {
  const auto index = static_cast<std::size_t>(view);
  const auto depth = std::span<const float>(depth_).subspan(index * kTexels, kTexels);
  spread_least(depth, kTile, std::span(clear_depth_).subspan(index * kTiles, kTiles));
  spread_least(depth, kPair, std::span(near_depth_).subspan(index * kPairs, kPairs));
}

Snapshot Impostor::snapshot(int view) const {
  const auto index = static_cast<std::size_t>(view);
  const std::size_t first = index * kTexels;
  return {cameras_[index], std::span(types_).subspan(first, kTexels), std::span(faces_).subspan(first, kTexels),
          std::span(occlusion_).subspan(first, kTexels), std::span(depth_).subspan(first, kTexels)};
}

}  // namespace quoin
