#include "render_vk/march/device_impostors.h"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include "render_vk/march/device_scene.h"

namespace quoin::vulkan {
namespace {

constexpr std::uint32_t kFacesAGroup = 512;  // as far.comp has it
constexpr std::uint32_t kAllViews = (1U << kImpostorViews) - 1U;

Vec4 to_vec4(const raster::Vector& v, float w = 0.0F) {
  return {v[0], v[1], v[2], w};
}

std::vector<ShaderFarFace> faces_of(const ImpostorFaces::Level& level) {
  std::vector<ShaderFarFace> faces;
  for (std::uint32_t direction = 0; direction < 6; ++direction) {
    for (std::size_t i = level.begin[direction]; i < level.begin[direction + 1]; ++i) {
      if (level.views[i] == 0) continue;  // fills a group up
      faces.push_back({{level.centre[0][i], level.centre[1][i], level.centre[2][i], 0.0F},
                       level.face[i],
                       level.views[i],
                       direction});
    }
  }
  return faces;
}

std::vector<ShaderVoxelFace> faces_of(const ImpostorFaces& impostor) {
  std::vector<ShaderVoxelFace> faces;
  faces.reserve(impostor.faces.size());
  for (const ImpostorFaces::Face& face : impostor.faces) {
    faces.push_back({face.voxel, std::uint32_t{face.type} | std::uint32_t{face.occlusion} << 16 |
                                     static_cast<std::uint32_t>(face.direction) << 24 |
                                     std::uint32_t{face.open_rays} << 27});
  }
  return faces;
}

// From a face's middle to where rays still meet it; as draw_faces has it.
float reach_of(const ImpostorFaces::Level& level) {
  return level.half + 1e-5F + 2e-6F * level.size;
}

// Bits of the directions whose faces any ray of the area may go against. What is linear is least or greatest in a
// corner.
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

// Rays from the upper left corner of the area on.
void set_aim(const DrawnImpostor& drawn, int width, int height, ShaderFar& far) {
  raster::Job job;
  raster::set_aim(drawn.aim, drawn.area.left - 0.5 * width, drawn.area.top - 0.5 * height, job);
  far.point = to_vec4(job.point.at, job.depth_at);
  far.point_x = to_vec4(job.point.x);
  far.point_y = to_vec4(job.point.y);
  far.direction = to_vec4(job.direction.at, job.depth_step);
  far.direction_x = to_vec4(job.direction.x);
  far.direction_y = to_vec4(job.direction.y);
  far.across = to_vec4(job.across, job.across_at);
  far.down = to_vec4(job.down, job.down_at);
  far.ahead = to_vec4(job.ahead, job.ahead_at);
  far.at = {job.column_at, job.row_at, 0.0F, 0.0F};
  for (ShaderFarLevel* level : {&far.level, &far.unseen}) {
    level->views = (level->views & kAllViews) | seen_sides(job, drawn.area) << kImpostorViews;
  }
  far.area = {drawn.area.left, drawn.area.top, drawn.area.right, drawn.area.bottom};
}

std::uint32_t groups_of(std::uint32_t faces) {
  return (faces + kFacesAGroup - 1) / kFacesAGroup;
}

}  // namespace

Status DeviceImpostors::put(const std::shared_ptr<const Impostor>& impostor, Entry& entry) {
  entry.last_use = picture_;
  if (entry.impostor == impostor) return {};
  memory_->release(entry.place);
  entry.impostor = nullptr;
  const ImpostorFaces& from = impostor->faces();
  std::vector<ShaderFarFace> all;
  for (std::size_t i = 0; i < entry.levels.size(); ++i) {
    const bool is_unseen = i == ImpostorFaces::kLevels;
    const std::vector<ShaderFarFace> some = faces_of(is_unseen ? from.unseen : from.levels[i]);
    entry.levels[i] = {all.size() * sizeof(ShaderFarFace), static_cast<std::uint32_t>(some.size()), ~0U};
    all.insert(all.end(), some.begin(), some.end());
  }
  const std::vector<ShaderVoxelFace> faces = faces_of(from);
  const auto of_levels = std::as_bytes(std::span(all));
  const auto of_faces = std::as_bytes(std::span(faces));
  const auto place = memory_->allocate(of_levels.size() + of_faces.size(), "uploading impostors");
  if (!place) return place.error();
  entry.place = *place;
  for (ShaderFarLevel& level : entry.levels) level.faces += place->address;
  entry.faces = place->address + of_levels.size();
  Status done = memory_->write(entry.place, of_levels);
  if (done) done = memory_->write(entry.place, of_faces, of_levels.size());
  if (done) entry.impostor = impostor;
  return done;
}

Status DeviceImpostors::draw(const Scene& scene, const FarImpostors& far, const ImpostorScreen& screen, int width,
                             int height, Placement& placement) {
  ++picture_;
  std::uint64_t number = 0;
  auto next = placement.placed.begin();
  for (const FarInstance& instance : far.instances) {
    next = find_placed(next, placement.placed.end(), instance.instance);
    if (next == placement.placed.end()) break;
    if (next->placed.instance != instance.instance) continue;
    next->is_far = true;
    const auto index = static_cast<std::int32_t>(next - placement.placed.begin());
    const auto drawn = screen.drawn(next->placed, index, *instance.impostor);
    if (!drawn) continue;
    const GridHandle grid = scene.instances()[instance.instance].grid;
    if (Status done = put(far.kept.find(grid)->second, entries_[grid]); !done) return done;
    ShaderFar shown = shader_far(entries_[grid], *drawn);
    set_aim(*drawn, width, height, shown);
    shown.origin = IVec4(next->origin, index);
    shown.first_number = static_cast<std::uint32_t>(number);
    placement.far.push_back(shown);
    number += drawn->faces->faces.size();
    if (number <= std::numeric_limits<std::uint32_t>::max()) continue;
    return make_error(ErrorCode::LimitExceeded, "vulkan: impostors of more than 2^32 faces in a picture");
  }
  return {};
}

// What it is drawn from.
ShaderFar DeviceImpostors::shader_far(const Entry& entry, const DrawnImpostor& drawn) {
  const ImpostorFaces::Level& level = drawn.faces->levels[drawn.level];
  const ImpostorFaces::Level& unseen = drawn.faces->unseen;
  ShaderFar far;
  far.size = {level.half, unseen.half, reach_of(level), reach_of(unseen)};
  far.level = entry.levels[drawn.level];
  far.level.views = drawn.views;
  if (drawn.has_unseen()) far.unseen = entry.levels.back();
  far.faces = entry.faces;
  return far;
}

void DeviceImpostors::drop_unused(std::uint64_t max_bytes) {
  std::uint64_t held = bytes();
  while (held > max_bytes) {
    const auto oldest = std::min_element(entries_.begin(), entries_.end(), [](const auto& a, const auto& b) {
      return a.second.last_use < b.second.last_use;
    });
    if (oldest == entries_.end() || oldest->second.last_use == picture_) return;
    held -= oldest->second.place.size;
    memory_->release(oldest->second.place);
    entries_.erase(oldest);
  }
}

std::uint64_t DeviceImpostors::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& [grid, entry] : entries_) sum += entry.place.size;
  return sum;
}

FarTiles far_tiles(const std::vector<ShaderFar>& far, int edge, int width, int height) {
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
        for (std::uint32_t is_unseen = 0; is_unseen < 2; ++is_unseen) {
          const std::uint32_t groups = groups_of((is_unseen == 0 ? far[i].level : far[i].unseen).count);
          if (groups == 0) continue;
          lists[tile].push_back({static_cast<std::uint32_t>(2 * i + is_unseen), tiles.ranges[tile].groups});
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
