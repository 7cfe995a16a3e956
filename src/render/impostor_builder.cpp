#include "render/impostor_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <quoin/trace/packet.h>

#include "light/corner_light.h"
#include "render/snapshot_rays.h"

namespace quoin {
namespace {

constexpr int kEdge = Impostor::kEdge;
// Texels: how far from its middle a face is taken to reach where voxels are smaller than texels.
constexpr double kRoom = 0.5;

// The bits of 21-bit numbers, three places apart.
std::uint64_t spread(std::uint64_t bits) {
  bits &= 0x1F'FFFF;
  bits = (bits | bits << 32) & 0x001F'0000'0000'FFFF;
  bits = (bits | bits << 16) & 0x001F'0000'FF00'00FF;
  bits = (bits | bits << 8) & 0x100F'00F0'0F00'F00F;
  bits = (bits | bits << 4) & 0x10C3'0C30'C30C'30C3;
  return (bits | bits << 2) & 0x1249'2492'4924'9249;
}

std::uint8_t packed_levels(const FaceLevels& levels) {
  unsigned packed = 0;
  for (std::size_t i = 0; i < 4; ++i) packed |= static_cast<unsigned>(levels[i]) << 2 * i;
  return static_cast<std::uint8_t>(packed);
}

// Whether a texel of the finest snapshot stands for those around it in one of half the size, that often halved.
bool is_sample(int level, int column, int row) {
  const int mask = (1 << level) - 1;
  const int middle = (1 << level) / 2;
  return (column & mask) == middle && (row & mask) == middle;
}

// Adds a face without views, at `position`, until there are whole groups.
void fill_up(ImpostorFaces::Level& level) {
  while (level.views.size() % ImpostorFaces::kGroup != 0) {
    for (auto& coordinates : level.centre) coordinates.push_back(coordinates.back());
    level.views.push_back(0);
    level.face.push_back(level.face.back());
  }
}

void find_groups(ImpostorFaces::Level& level) {
  for (std::size_t begin = 0; begin < level.views.size(); begin += ImpostorFaces::kGroup) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto first = level.centre[axis].begin() + static_cast<std::ptrdiff_t>(begin);
      const auto [low, high] = std::minmax_element(first, first + ImpostorFaces::kGroup);
      level.groups.centre[axis].push_back(0.5F * (*low + *high));
      level.groups.half[axis].push_back(0.5F * (*high - *low) + level.half);
    }
    std::uint32_t views = 0;
    for (std::size_t i = begin; i < begin + ImpostorFaces::kGroup; ++i) views |= level.views[i];
    level.groups.views.push_back(views);
  }
  const std::size_t room = level.groups.views.size() + ImpostorFaces::kGroup;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    level.groups.centre[axis].resize(room);
    level.groups.half[axis].resize(room);
  }
}

}  // namespace

std::size_t ImpostorBuilder::PlaceHash::operator()(const Place& place) const {
  const auto bits = [](int coordinate) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(coordinate)); };
  std::uint64_t hash = bits(place.voxel.x) * 0x9E37'79B9'7F4A'7C15U;
  hash = (hash ^ bits(place.voxel.y)) * 0xC2B2'AE3D'27D4'EB4FU;
  hash = (hash ^ bits(place.voxel.z) ^ static_cast<std::uint64_t>(place.direction) << 40) * 0x9E37'79B9'7F4A'7C15U;
  return hash ^ hash >> 32;
}

ImpostorBuilder::ImpostorBuilder(const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque,
                                 const ContentSphere& content)
    : grid_(&grid), types_(&types), opaque_(&opaque), content_(content) {}

ImpostorFaces ImpostorBuilder::build(InstructionSet instructions) {
  for (int view = 0; view < kImpostorViews; ++view) take(view, instructions);
  add_neighbours();
  sort();
  ImpostorFaces faces;
  faces.centre = content_.centre;
  for (int level = 0; level < kLevels; ++level) put_level(level, faces);
  put_faces(faces);
  return faces;
}

void ImpostorBuilder::take(int view, InstructionSet instructions) {
  const SnapshotCamera camera = snapshot_camera(content_, view, kEdge);
  const TexelArea area = texels_of(camera, opaque_->bounds(), kEdge);
  PacketHits hits;
  for (int row = area.top; row < area.bottom; row += kTexelBlock) {
    for (int column = area.left; column < area.right; column += kTexelBlock) {
      first_hits(*opaque_, rays_of_texels(camera, kEdge, column, row), hits, instructions);
      for (std::uint32_t left = hits.hit; left != 0; left &= left - 1) {
        const int lane = std::countr_zero(left);
        const auto i = static_cast<std::size_t>(lane);
        see({{hits.x[i], hits.y[i], hits.z[i]}, hits.face[i]}, view, column + lane % kTexelBlock,
            row + lane / kTexelBlock);
      }
    }
  }
}

ImpostorBuilder::Seen& ImpostorBuilder::seen_at(const Place& place) {
  if (last_ < seen_.size() && seen_[last_].place == place) return seen_[last_];
  const auto [found, is_new] = index_.try_emplace(place, static_cast<std::uint32_t>(seen_.size()));
  if (is_new) seen_.push_back({place, {}});
  last_ = found->second;
  return seen_[last_];
}

void ImpostorBuilder::see(const Place& place, int view, int column, int row) {
  Seen& seen = seen_at(place);
  const std::uint32_t bit = 1U << view;
  seen.views[0] |= bit;
  for (int level = 1; level < kLevels; ++level) {
    if (is_sample(level, column, row)) seen.views[static_cast<std::size_t>(level)] |= bit;
  }
}

ImpostorBuilder::Place ImpostorBuilder::neighbour(const Place& place, int axis, int sign) const {
  IVec3 beside = place.voxel;
  beside[axis] += sign;
  const IVec3 normal = normal_of(place.direction);
  const auto towards = [&](int along) { return static_cast<Direction>(2 * axis + (along > 0 ? 0 : 1)); };
  if (opaque_->is_occupied(beside + normal)) return {beside + normal, towards(-sign)};
  if (opaque_->is_occupied(beside)) return {beside, place.direction};
  return {place.voxel, towards(sign)};
}

void ImpostorBuilder::add_neighbours() {
  std::vector<Seen> found = seen_;
  for (const Seen& seen : found) {
    const FaceFrame& frame = frame_of(seen.place.direction);
    for (const int axis : {frame.u, frame.v}) {
      for (const int sign : {-1, 1}) {
        Seen& beside = seen_at(neighbour(seen.place, axis, sign));
        beside.views[0] |= seen.views[0];
      }
    }
  }
}

void ImpostorBuilder::sort() {
  const IVec3 least = opaque_->bounds().min;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
  keys.reserve(seen_.size());
  for (const Seen& seen : seen_) {
    std::uint64_t key = static_cast<std::uint64_t>(seen.place.direction) << 61;
    // Of worlds beyond 2^20 voxels only the upper bits: the order is only there to keep neighbours together.
    for (int axis = 0; axis < 3; ++axis) {
      const auto coordinate = static_cast<std::uint64_t>(std::int64_t{seen.place.voxel[axis]} - least[axis]);
      key |= spread(std::min<std::uint64_t>(coordinate, 0xF'FFFF)) << axis;
    }
    keys.emplace_back(key, static_cast<std::uint32_t>(keys.size()));
  }
  std::sort(keys.begin(), keys.end());
  std::vector<Seen> sorted;
  sorted.reserve(seen_.size());
  for (const auto& [key, i] : keys) sorted.push_back(seen_[i]);
  seen_ = std::move(sorted);
}

void ImpostorBuilder::put_level(int level, ImpostorFaces& faces) const {
  const auto at = static_cast<std::size_t>(level);
  ImpostorFaces::Level& out = faces.levels[at];
  const double texel = snapshot_camera(content_, 0, kEdge >> level).half_size() * 2.0 / (kEdge >> level);
  out.half = static_cast<float>(texel > 1.0 ? std::max(0.5, kRoom * texel) : 0.5);
  out.size = static_cast<float>(content_.radius);
  std::uint32_t index = 0;  // of the finest level, fillers and all
  std::uint32_t direction = 0;
  for (const Seen& seen : seen_) {
    for (; direction <= static_cast<std::uint32_t>(seen.place.direction); ++direction) {
      fill_up(out);
      index = (index + 15U) / 16U * 16U;
      out.begin[direction] = static_cast<std::uint32_t>(out.views.size());
    }
    const std::uint32_t face = index++;
    if (seen.views[at] == 0) continue;
    const DVec3 middle = DVec3(seen.place.voxel) + 0.5 + 0.5 * DVec3(normal_of(seen.place.direction)) - faces.centre;
    for (int axis = 0; axis < 3; ++axis) {
      out.centre[static_cast<std::size_t>(axis)].push_back(static_cast<float>(middle[axis]));
    }
    out.views.push_back(seen.views[at]);
    out.face.push_back(face);
  }
  fill_up(out);
  for (; direction <= 6; ++direction) out.begin[direction] = static_cast<std::uint32_t>(out.views.size());
  find_groups(out);
}

void ImpostorBuilder::put_faces(ImpostorFaces& faces) const {
  GridReader reader(*grid_);
  faces.faces.resize(faces.levels[0].views.size());
  std::uint32_t index = 0;
  Direction last = Direction::PosX;
  for (const Seen& seen : seen_) {
    if (seen.place.direction != last) index = (index + 15U) / 16U * 16U;
    last = seen.place.direction;
    const FaceLevels levels = corner_levels(reader, *types_, seen.place.voxel, seen.place.direction);
    faces.faces[index++] = {seen.place.voxel, reader.get(seen.place.voxel), packed_levels(levels), seen.place.direction};
  }
}

}  // namespace quoin
