#include "render/impostor/seen.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <tsl/robin_map.h>

#include <quoin/trace/packet.h>

#include "render/impostor/raster.h"
#include "render/impostor/snapshot.h"

namespace quoin {
namespace {

using Views = std::array<std::uint32_t, ImpostorFaces::kLevels>;

// Whether a texel of the finest snapshot stands for those around it in one that is so often halved.
bool is_sample(int level, int column, int row) {
  const int mask = (1 << level) - 1;
  const int middle = (1 << level) / 2;
  return (column & mask) == middle && (row & mask) == middle;
}

void mark(Views& views, std::uint32_t bit, int column, int row) {
  views[0] |= bit;
  for (int level = 1; level < ImpostorFaces::kLevels; ++level) {
    if (is_sample(level, column, row)) views[static_cast<std::size_t>(level)] |= bit;
  }
}

raster::Aim aim_of(const SnapshotCamera& camera) {
  raster::Aim aim;
  aim.right = camera.right, aim.down = -camera.up, aim.forward = camera.forward;
  aim.centre = {0.0, 0.0, camera.distance};
  aim.focal = camera.focal;
  return aim;
}

// The views of each of the faces, in their order.
class ShellViews {
 public:
  ShellViews(const std::vector<SeenFace>& faces, const IBox& box, const ContentSphere& content, int edge)
      : level_(all_faces(faces, content)),
        box_(box),
        content_(content),
        edge_(edge),
        draw_(raster::draw()),
        views_(faces.size()) {}

  std::vector<Views> take() {
    for (int view = 0; view < kImpostorViews; ++view) take(view);
    return std::move(views_);
  }

 private:
  void take(int view) {
    const SnapshotCamera camera = snapshot_camera(content_, view, edge_);
    const raster::Aim aim = aim_of(camera);
    const TexelArea area = texels_of(camera, box_, edge_);
    raster::Job job;
    job.level = &level_;
    job.views = ~0U;
    for (int row = 0; row < edge_; row += raster::kTile) {
      for (int column = 0; column < edge_; column += raster::kTile) {
        job.left = std::max(area.left - column, 0), job.right = std::min(area.right - column, raster::kTile);
        job.top = std::max(area.top - row, 0), job.bottom = std::min(area.bottom - row, raster::kTile);
        if (job.left >= job.right || job.top >= job.bottom) continue;
        canvas_.clear();
        raster::set_aim(aim, column + 0.5 - 0.5 * edge_, row + 0.5 - 0.5 * edge_, job);
        draw_(job, canvas_);
        mark_tile(1U << view, column, row, job);
      }
    }
  }

  void mark_tile(std::uint32_t bit, int column, int row, const raster::Job& job) {
    for (int y = job.top; y < job.bottom; ++y) {
      for (int x = job.left; x < job.right; ++x) {
        const std::size_t i = raster::index_of(x, y);
        if (std::isinf(canvas_.depth[i])) continue;
        mark(views_[static_cast<std::size_t>(canvas_.face[i])], bit, column + x, row + y);
      }
    }
  }

  ImpostorFaces::Level level_;
  IBox box_;
  ContentSphere content_;
  int edge_;
  raster::Draw draw_;
  raster::Canvas canvas_;
  std::vector<Views> views_;
};

// The face beside another at the edge towards `sign` along `axis`: in the same plane, or around the edge.
VoxelFace face_beside(const VoxelFace& face, int axis, int sign, const OccupancyTree& opaque) {
  IVec3 beside = face.voxel;
  beside[axis] += sign;
  const IVec3 front = beside + normal_of(face.direction);
  const auto towards = [&](int along) { return static_cast<Direction>(2 * axis + (along > 0 ? 0 : 1)); };
  if (opaque.is_occupied(front)) return {front, towards(-sign)};
  if (opaque.is_occupied(beside)) return {beside, face.direction};
  return {face.voxel, towards(sign)};
}

struct FaceHash {
  std::size_t operator()(const VoxelFace& face) const {
    const auto bits = [](int coordinate) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(coordinate)); };
    std::uint64_t hash = bits(face.voxel.x) * 0x9E37'79B9'7F4A'7C15U;
    hash = (hash ^ bits(face.voxel.y)) * 0xC2B2'AE3D'27D4'EB4FU;
    hash = (hash ^ bits(face.voxel.z) ^ static_cast<std::uint64_t>(face.direction) << 40) * 0x9E37'79B9'7F4A'7C15U;
    return hash ^ hash >> 32;
  }
};

// Faces as rays meet them.
class MetFaces {
 public:
  void take(const OccupancyTree& opaque, const ContentSphere& content, int view, int edge) {
    const SnapshotCamera camera = snapshot_camera(content, view, edge);
    const TexelArea area = texels_of(camera, opaque.bounds(), edge);
    PacketHits hits;
    for (int row = area.top; row < area.bottom; row += kTexelBlock) {
      for (int column = area.left; column < area.right; column += kTexelBlock) {
        first_hits(opaque, rays_of_texels(camera, edge, column, row), hits);
        for (std::uint32_t left = hits.hit; left != 0; left &= left - 1) {
          const int lane = std::countr_zero(left);
          const auto i = static_cast<std::size_t>(lane);
          SeenFace& seen = at({{hits.x[i], hits.y[i], hits.z[i]}, hits.face[i]});
          mark(seen.views, 1U << view, column + lane % kTexelBlock, row + lane / kTexelBlock);
        }
      }
    }
  }

  void add_neighbours(const OccupancyTree& opaque) {
    const std::vector<SeenFace> found = faces_;
    for (const SeenFace& seen : found) {
      const FaceFrame& frame = frame_of(seen.face.direction);
      for (const int axis : {frame.u, frame.v}) {
        for (const int sign : {-1, 1}) at(face_beside(seen.face, axis, sign, opaque)).views[0] |= seen.views[0];
      }
    }
  }

  std::vector<SeenFace> faces() && { return std::move(faces_); }

 private:
  SeenFace& at(const VoxelFace& face) {
    if (last_ < faces_.size() && faces_[last_].face == face) return faces_[last_];
    const auto [found, is_new] = index_.try_emplace(face, static_cast<std::uint32_t>(faces_.size()));
    if (is_new) faces_.push_back({face, {}});
    last_ = found->second;
    return faces_[last_];
  }

  std::vector<SeenFace> faces_;
  tsl::robin_map<VoxelFace, std::uint32_t, FaceHash> index_;
  std::uint32_t last_ = 0;
};

// The bits of 21-bit numbers, three places apart.
std::uint64_t spread(std::uint64_t bits) {
  bits &= 0x1F'FFFF;
  bits = (bits | bits << 32) & 0x001F'0000'0000'FFFF;
  bits = (bits | bits << 16) & 0x001F'0000'FF00'00FF;
  bits = (bits | bits << 8) & 0x100F'00F0'0F00'F00F;
  bits = (bits | bits << 4) & 0x10C3'0C30'C30C'30C3;
  return (bits | bits << 2) & 0x1249'2492'4924'9249;
}

// By direction, then along a curve that keeps neighbours together.
std::vector<SeenFace> sorted(const std::vector<SeenFace>& faces, IVec3 least) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
  keys.reserve(faces.size());
  for (const SeenFace& seen : faces) {
    std::uint64_t key = static_cast<std::uint64_t>(seen.face.direction) << 61;
    for (int axis = 0; axis < 3; ++axis) {
      const auto coordinate = static_cast<std::uint64_t>(std::int64_t{seen.face.voxel[axis]} - least[axis]);
      key |= spread(std::min<std::uint64_t>(coordinate, 0xF'FFFF)) << axis;
    }
    keys.emplace_back(key, static_cast<std::uint32_t>(keys.size()));
  }
  std::sort(keys.begin(), keys.end());
  std::vector<SeenFace> out;
  out.reserve(faces.size());
  for (const auto& [key, i] : keys) out.push_back(faces[i]);
  return out;
}

}  // namespace

std::vector<SeenFace> faces_seen_of(const ImpostorShell& shell, const IBox& box, const ContentSphere& content,
                                    int edge) {
  const std::vector<VoxelFace> all = shell.faces();
  std::vector<SeenFace> faces(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) faces[i].face = all[i];
  const std::vector<Views> views = ShellViews(faces, box, content, edge).take();
  for (std::size_t i = 0; i < all.size(); ++i) faces[i].views = views[i];
  return faces;
}

std::vector<SeenFace> faces_seen_by_rays(const OccupancyTree& opaque, const ContentSphere& content, int edge) {
  MetFaces met;
  for (int view = 0; view < kImpostorViews; ++view) met.take(opaque, content, view, edge);
  met.add_neighbours(opaque);
  return sorted(std::move(met).faces(), opaque.bounds().min);
}

}  // namespace quoin
