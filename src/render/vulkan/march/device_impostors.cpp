#include "render/vulkan/march/device_impostors.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "core/caches.h"
#include "render/vulkan/march/device_scene.h"
#include "render/vulkan/trees/shader_data.h"

namespace quoin::vulkan {
namespace {

constexpr std::uint32_t kFacesAGroup = 512;  // as in far.comp
constexpr std::uint32_t kSides = ImpostorFaces::kSides;
constexpr std::uint32_t kIsSurfel = 8;  // as in far.glsl
constexpr std::uint32_t kSurfelHalvesShift = 4;
constexpr std::uint32_t kIsPiece = 1U << 28;
constexpr float kPieceHalves = 16'384.0F;
constexpr std::uint32_t kFromBehind = 1U << 31;  // as in shapes.glsl

Vec4 vec4_of(const raster::Vector& v, float w = 0.0F) {
  return {v[0], v[1], v[2], w};
}

// Packs rectangles without the fillers of groups, which no view saw.
std::vector<ShaderFarFace> packed(const ImpostorFaces& impostor, const ImpostorFaces::Level& level, std::size_t first,
                                  std::size_t count) {
  QUOIN_ASSERT(first + count <= level.count(), "rectangles of the level");
  std::vector<ShaderFarFace> faces;
  faces.reserve(count);
  std::uint32_t direction = 0;
  for (std::size_t i = first; i < first + count; ++i) {
    while (i >= level.begin[direction + 1]) ++direction;
    QUOIN_ASSERT(direction < kSides, "a side of the level");
    ShaderFarFace& face = faces.emplace_back();
    face.centre = {level.centre[0][i], level.centre[1][i], level.centre[2][i], 0.0F};
    face.face = level.face[i];
    face.views = level.views[i];
    face.direction = direction;
    if (direction < kSides / 2) {
      const bool has_reach = !level.reach[0].empty();
      face.centre.w = has_reach ? level.reach[0][i] : 0.5F;
      face.along_v = has_reach ? level.reach[1][i] : 0.5F;
      continue;
    }
    face.direction = (direction - kSides / 2) | kIsSurfel;
    if (impostor.shape_of(level.face[i]) != nullptr) face.direction |= kIsPiece;
    for (std::size_t k = 0; k < 2; ++k) {
      const float half = impostor.surfel_of(level.face[i]).half[k];
      QUOIN_ASSERT(half >= 0.0F && half <= 1.5F, "half a side of at most one sample, or three voxels of a shape");
      face.direction |= static_cast<std::uint32_t>(std::lround(1024.0F * half)) << (kSurfelHalvesShift + 12 * k);
    }
    face.centre.w = level.slope[0][i];
    face.along_v = level.slope[1][i];
  }
  return faces;
}

std::vector<ShaderFarCell> packed(std::span<const ImpostorFaces::Cell> cells) {
  std::vector<ShaderFarCell> out;
  out.reserve(cells.size());
  for (const ImpostorFaces::Cell& cell : cells) out.push_back({Vec4(cell.corner, 0.0F), cell.bits, cell.face});
  return out;
}

// Finds the sides that the pieces of an impostor's shapes show: for each surfel the side plus 1, or 0 for those of
// fields. Empty without shapes.
Result<std::vector<std::uint32_t>> sides_of(const ImpostorFaces& impostor, DeviceShapes& shapes) {
  std::vector<std::uint32_t> sides(impostor.shapes.size());
  const std::size_t first = impostor.faces.size() - sides.size();
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const ImpostorFaces::ShapeSide* const shape = impostor.shape_of(first + i);
    if (shape == nullptr) continue;
    QUOIN_ASSERT(impostor.types.has_value() && shape->face >= 0, "the types of the shapes, and a side");
    const VoxelType type = impostor.faces[first + i].type;
    const auto face = static_cast<std::size_t>(shape->face);
    const auto side = shapes.side_of(*shape->model, type, (*impostor.types)[type].shapes, face);
    if (!side) return side.error();
    const bool is_behind = glm::dot(impostor.surfels[i].normal, shape->model->faces[face].normal) < 0.0F;
    sides[i] = (*side | (is_behind ? kFromBehind : 0)) + 1;
  }
  return sides;
}

std::int32_t packed_halves(const std::array<float, 2>& half) {
  const auto part = [&](std::size_t k) { return static_cast<std::uint32_t>(std::lround(kPieceHalves * half.at(k))); };
  return std::bit_cast<std::int32_t>(part(0) | part(1) << 16);
}

// `sides`: as `sides_of`.
std::vector<ShaderVoxelFace> packed(const ImpostorFaces& impostor, std::span<const std::uint32_t> sides,
                                    std::size_t first, std::size_t count) {
  std::vector<ShaderVoxelFace> faces;
  faces.reserve(count);
  const std::size_t voxel_faces = impostor.faces.size() - impostor.surfels.size();
  for (std::size_t i = first; i < first + count; ++i) {
    // A surfel has the data of a voxel face first, then its shape.
    const std::size_t number = i < voxel_faces ? i : voxel_faces + (i - voxel_faces) / 3;
    const std::size_t part = i < voxel_faces ? 0 : (i - voxel_faces) % 3;
    if (part > 0) {
      const ImpostorFaces::Surfel& surfel = impostor.surfel_of(number);
      const bool is_first = part == 1;
      const std::array<float, 3> numbers = is_first ? std::array{surfel.offset, surfel.slope[0], surfel.slope[1]}
                                                    : std::array{surfel.shift[0], surfel.shift[1], 0.0F};
      const auto bits = [&](std::size_t k) { return std::bit_cast<std::int32_t>(numbers.at(k)); };
      ShaderVoxelFace& out = faces.emplace_back();
      out = {{bits(0), bits(1), bits(2)}, is_first ? octahedral(surfel.normal) : 0};
      if (is_first || sides.empty()) continue;
      out.voxel.z = packed_halves(surfel.half);
      out.what = sides[number - voxel_faces];
      continue;
    }
    const ImpostorFaces::Face& face = impostor.faces[number];
    faces.push_back({face.voxel, std::uint32_t{face.type} | std::uint32_t{face.occlusion} << 16 |
                                     static_cast<std::uint32_t>(face.direction) << 24 |
                                     std::uint32_t{face.open_rays} << 27});
  }
  return faces;
}

// Returns the number of entries of an impostor's face list.
std::size_t entries_of(const ImpostorFaces& impostor) {
  return impostor.faces.size() + 2 * impostor.surfels.size();
}

// Returns bits of the directions whose faces may point against any ray of the area. A linear function has its extremes
// in a corner.
std::uint32_t seen_sides(const raster::Job& job, const PixelArea& area) {
  const auto width = static_cast<float>(area.right - area.left);
  const auto height = static_cast<float>(area.bottom - area.top);
  std::uint32_t seen = 0;
  for (std::uint32_t side = 0; side < 6; ++side) {
    const std::size_t axis = side / 2;
    const float sign = side % 2 == 0 ? 1.0F : -1.0F;
    for (const float x : {0.0F, width}) {
      for (const float y : {0.0F, height}) {
        const float along = job.direction.at[axis] + job.direction.x[axis] * x + job.direction.y[axis] * y;
        seen |= std::uint32_t{along * sign < 1e-6F} << side;
      }
    }
  }
  return seen;
}

// Sets the rays, relative to the upper left corner of the area.
void set_aim(const DrawnImpostor& drawn, int width, int height, ShaderFar& far) {
  raster::Job job;
  raster::set_aim(drawn.aim, drawn.area.left - 0.5 * width, drawn.area.top - 0.5 * height, job);
  far.point = vec4_of(job.point.at, job.depth_at);
  far.point_x = vec4_of(job.point.x);
  far.point_y = vec4_of(job.point.y);
  far.direction = vec4_of(job.direction.at, job.depth_step);
  far.direction_x = vec4_of(job.direction.x);
  far.direction_y = vec4_of(job.direction.y);
  far.across = vec4_of(job.across, job.across_at);
  far.down = vec4_of(job.down, job.down_at);
  far.ahead = vec4_of(job.ahead, job.ahead_at);
  far.at = {job.column_at, job.row_at, drawn.faces->levels[drawn.level].room(), static_cast<float>(drawn.coarser)};
  for (ShaderFarLevel* level : {&far.level, &far.coarser, &far.unseen}) level->sides = seen_sides(job, drawn.area);
  far.area = {drawn.area.left, drawn.area.top, drawn.area.right, drawn.area.bottom};
}

std::uint32_t groups_of(std::uint32_t faces) {
  return (faces + kFacesAGroup - 1) / kFacesAGroup;
}

}  // namespace

void DeviceImpostors::release(Entry& entry) {
  memory_->release(entry.whole.place);
  memory_->release(entry.next.place);
}

void DeviceImpostors::clear() {
  for (auto& [grid, entry] : entries_) release(entry);
  entries_.clear();
}

void DeviceImpostors::follow(const Scene& scene) {
  for (auto next = entries_.begin(); next != entries_.end();) {
    const auto each = next++;
    Entry& entry = each->second;
    const SceneGrid* grid = scene.grids().find(each->first);
    if (grid != nullptr && !grid->grid.changes_since(entry.grid).all && !grid->field.changes_since(entry.field).all) {
      continue;
    }
    release(entry);
    entries_.erase(each);
  }
}

Status DeviceImpostors::begin(const std::shared_ptr<const Impostor>& impostor, DeviceShapes& shapes, Sent& sent) {
  QUOIN_ASSERT(impostor != nullptr, "an impostor to send");
  memory_->release(sent.place);
  sent = {};
  const ImpostorFaces& from = impostor->faces();
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < sent.levels.size(); ++i) {
    const std::size_t count = from.level(i).count();
    sent.levels[i] = {bytes, static_cast<std::uint32_t>(count), 0, 0, from.level(i).step, 0};
    bytes += count * sizeof(ShaderFarFace);
  }
  for (std::size_t i = 0; i < sent.levels.size(); ++i) {
    sent.levels[i].cells = from.level(i).cells.empty() ? 0 : bytes;
    bytes += from.level(i).cells.size() * sizeof(ShaderFarCell);
  }
  const auto place = memory_->allocate(bytes + entries_of(from) * sizeof(ShaderVoxelFace), "uploading impostors");
  if (!place) return place.error();
  sent.place = *place;
  for (ShaderFarLevel& level : sent.levels) {
    level.faces += place->address;
    if (level.cells != 0) level.cells += place->address;
  }
  sent.faces = place->address + bytes;
  auto sides = sides_of(from, shapes);
  if (!sides) return sides.error();
  sent.sides = std::move(*sides);
  sent.impostor = impostor;
  return {};
}

Status DeviceImpostors::send_some(Sent& sent, std::size_t& faces_left) {
  const ImpostorFaces& from = sent.impostor->faces();
  Status done;
  while (done && sent.part < kParts && faces_left > 0) {
    constexpr std::size_t kLevels = ImpostorFaces::kLevels + 1;
    const bool is_level = sent.part < kLevels;
    const bool is_cells = !is_level && sent.part < 2 * kLevels;
    const ImpostorFaces::Level& level = from.level(sent.part % kLevels);
    const std::size_t all = is_level ? level.count() : is_cells ? level.cells.size() : entries_of(from);
    QUOIN_ASSERT(sent.at <= all, "a position in the part");
    const std::size_t count = std::min(all - sent.at, faces_left);
    if (is_cells) {
      const std::vector<ShaderFarCell> some = packed(std::span(level.cells).subspan(sent.at, count));
      const std::uint64_t first = sent.levels[sent.part % kLevels].cells - sent.place.address;
      if (count > 0)
        done = memory_->write(sent.place, std::as_bytes(std::span(some)), first + sent.at * sizeof(ShaderFarCell));
    } else if (is_level) {
      const std::vector<ShaderFarFace> some = packed(from, level, sent.at, count);
      const std::uint64_t first = sent.levels[sent.part].faces - sent.place.address;
      done = memory_->write(sent.place, std::as_bytes(std::span(some)), first + sent.at * sizeof(ShaderFarFace));
    } else {
      const std::vector<ShaderVoxelFace> some = packed(from, sent.sides, sent.at, count);
      const std::uint64_t first = sent.faces - sent.place.address;
      done = memory_->write(sent.place, std::as_bytes(std::span(some)), first + sent.at * sizeof(ShaderVoxelFace));
    }
    faces_left -= count;
    sent.at += count;
    if (sent.at < all) continue;
    ++sent.part;
    sent.at = 0;
  }
  return done;
}

Status DeviceImpostors::put(const std::shared_ptr<const Impostor>& impostor, DeviceShapes& shapes, Entry& entry,
                            std::size_t& faces_left) {
  const bool is_known = entry.last_use == image_;
  entry.last_use = image_;
  if (is_known || entry.whole.impostor == impostor) return {};
  // Finishes a started transfer first: otherwise one edit per frame would keep it from ever completing. A caller that
  // waits gets the latest impostor.
  const bool waits = faces_left == std::numeric_limits<std::size_t>::max();
  if (entry.next.impostor == nullptr || (waits && entry.next.impostor != impostor)) {
    // The old impostor is not drawn again.
    if (waits) {
      memory_->release(entry.whole.place);
      entry.whole = {};
    }
    if (Status done = begin(impostor, shapes, entry.next); !done) return done;
  }
  std::size_t left = faces_left;
  if (Status done = send_some(entry.next, left); !done) return done;
  if (!waits) faces_left = left;
  if (entry.next.part < kParts) return {};
  memory_->release(entry.whole.place);
  entry.whole = std::exchange(entry.next, {});
  entry.whole.sides = {};
  return {};
}

Result<std::vector<FarInstance>> DeviceImpostors::send(const Scene& scene, const FarImpostors& far, bool waits,
                                                       DeviceShapes& shapes) {
  ++image_;
  std::size_t faces_left = waits ? std::numeric_limits<std::size_t>::max() : kFacesPerImage;
  // Missing impostors come first: a constantly edited impostor would delay them forever.
  for (const bool is_first : {true, false}) {
    for (const auto& [grid, impostor] : far.kept) {
      const auto [found, is_new] = entries_.try_emplace(grid);
      Entry& entry = found->second;
      if (is_new) {
        entry.grid = scene.grids()[grid].grid.cursor();
        entry.field = scene.grids()[grid].field.cursor();
      }
      if ((entry.whole.impostor == nullptr) != is_first) continue;
      if (Status done = put(impostor, shapes, entry, faces_left); !done) return done.error();
    }
  }
  if (Status done = shapes.send(); !done) return done.error();
  std::vector<FarInstance> sent;
  for (const FarInstance& instance : far.instances) {
    const Sent& whole = entries_.find(scene.instances()[instance.instance].grid)->second.whole;
    if (whole.impostor != nullptr) sent.push_back({instance.instance, whole.impostor.get()});
  }
  return sent;
}

Status DeviceImpostors::draw(const Scene& scene, std::span<const FarInstance> sent, const ImpostorScreen& screen,
                             int width, int height, Placement& placement) const {
  std::uint64_t number = 0;
  auto next = placement.placed.begin();
  for (const FarInstance& instance : sent) {
    next = find_placed(next, placement.placed.end(), instance.instance);
    if (next == placement.placed.end()) break;
    if (next->placed.instance != instance.instance) continue;
    next->is_far = true;
    const auto index = static_cast<std::int32_t>(next - placement.placed.begin());
    const auto drawn = screen.drawn(next->placed, index, *instance.impostor);
    if (!drawn) continue;
    const Entry& entry = entries_.find(scene.instances()[instance.instance].grid)->second;
    next->impostor = drawn->faces;
    next->impostor_level = drawn->level;
    ShaderFar shown = shader_far(entry.whole, *drawn);
    set_aim(*drawn, width, height, shown);
    shown.origin = IVec4(next->origin, index);
    shown.centre = Vec4(Vec3(drawn->faces->centre - DVec3(next->origin)), 0.0F);
    shown.first_number = static_cast<std::uint32_t>(number);
    placement.far.push_back(shown);
    number += std::uint64_t{shown.level.count} + shown.coarser.count + shown.unseen.count;
    // Shaders put the chosen view below the number.
    if (number <= std::numeric_limits<std::uint32_t>::max() / 4) continue;
    return make_error(ErrorCode::LimitExceeded, "vulkan: an image shows more than 2^30 impostor rectangles");
  }
  return {};
}

// Returns the shader data for drawing an impostor.
ShaderFar DeviceImpostors::shader_far(const Sent& sent, const DrawnImpostor& drawn) {
  ShaderFar far;
  std::array<DrawnImpostor::Part, DrawnImpostor::kMaxParts> room;
  for (const DrawnImpostor::Part& part : drawn.parts(room)) {
    const bool is_unseen = part.level == ImpostorFaces::kLevels;
    (is_unseen ? far.unseen : part.level == drawn.level ? far.level : far.coarser) = sent.levels.at(part.level);
  }
  const raster::NearViews& near = drawn.near;
  far.near = {std::uint32_t{near.view[0]} | std::uint32_t{near.view[1]} << 8 | std::uint32_t{near.view[2]} << 16,
              near.share[0], near.share[1], 0};
  far.faces = sent.faces;
  far.voxel_faces = static_cast<std::uint32_t>(drawn.faces->faces.size() - drawn.faces->surfels.size());
  return far;
}

void DeviceImpostors::drop_unused(std::uint64_t max_bytes) {
  drop_oldest(
      entries_, bytes(), max_bytes, [&](auto each) { return each->second.last_use != image_; },
      [](auto each) { return each->second.whole.place.size + each->second.next.place.size; },
      [&](auto each) {
        release(each->second);
        entries_.erase(each);
      });
}

std::uint64_t DeviceImpostors::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& [grid, entry] : entries_) sum += entry.whole.place.size + entry.next.place.size;
  return sum;
}

FarTiles far_tiles(const std::vector<ShaderFar>& far, int edge, int width, int height) {
  QUOIN_ASSERT(edge > 0 && width > 0 && height > 0, "a positive tile and image size");
  const int across = (width + edge - 1) / edge;
  const int down = (height + edge - 1) / edge;
  std::vector<std::vector<ShaderFarPart>> lists(static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
  FarTiles tiles;
  tiles.ranges.resize(lists.size());
  for (std::size_t i = 0; i < far.size(); ++i) {
    const IVec4 area = far[i].area;
    for (int y = area.y / edge; y <= (area.w - 1) / edge; ++y) {
      for (int x = area.x / edge; x <= (area.z - 1) / edge; ++x) {
        const auto tile = static_cast<std::size_t>(y * across + x);
        QUOIN_ASSERT(x >= 0 && x < across && y >= 0 && y < down, "a tile of the image");
        const std::array parts = {far[i].level, far[i].coarser, far[i].unseen};
        for (std::size_t part = 0; part < parts.size(); ++part) {
          const std::uint32_t groups = groups_of(parts.at(part).count);
          if (groups == 0) continue;
          lists[tile].push_back({static_cast<std::uint32_t>(4 * i + part), tiles.ranges[tile].groups});
          tiles.ranges[tile].groups += groups;
        }
      }
    }
  }
  for (std::size_t tile = 0; tile < lists.size(); ++tile) {
    tiles.ranges[tile].first = static_cast<std::uint32_t>(tiles.parts.size());
    tiles.ranges[tile].count = static_cast<std::uint32_t>(lists[tile].size());
    tiles.parts.insert(tiles.parts.end(), lists[tile].begin(), lists[tile].end());
  }
  return tiles;
}

}  // namespace quoin::vulkan
