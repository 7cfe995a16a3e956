#include "render/impostor/seen.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace quoin {
namespace {

constexpr std::size_t kGroup = ImpostorFaces::kGroup;
constexpr std::size_t kSides = ImpostorFaces::kSides;
// Texels: how far from its middle a face is taken to reach where voxels are smaller than texels.
constexpr double kRoom = 0.5;

// Copies of the last face that no view saw, from `at` to `end`.
void fill_up(ImpostorFaces::Level& level, std::size_t& at, std::size_t end) {
  for (; at < end; ++at) {
    for (auto& coordinates : level.centre) coordinates[at] = coordinates[at - 1];
    for (auto* const shapes : {&level.slope, &level.reach}) {
      for (auto& each : *shapes) {
        if (!each.empty()) each[at] = each[at - 1];
      }
    }
    level.face[at] = level.face[at - 1];
  }
}

void find_groups(ImpostorFaces::Level& level) {
  ImpostorFaces::Groups& groups = level.groups;
  const std::size_t count = level.views.size() / kGroup;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    groups.centre[axis].resize(count + kGroup);
    groups.half[axis].resize(count + kGroup);
  }
  groups.views.resize(count);
  for (std::size_t group = 0; group < count; ++group) {
    const std::size_t begin = group * kGroup;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* first = level.centre[axis].data() + begin;
      const auto [low, high] = std::minmax_element(first, first + kGroup);
      groups.centre[axis][group] = 0.5F * (*low + *high);
      groups.half[axis][group] = 0.5F * (*high - *low) + level.half;
    }
    if (begin >= level.begin[kSides / 2]) {
      // What is inclined rises to both sides.
      float most = 0.0F;
      for (std::size_t i = begin; i < begin + kGroup; ++i) {
        most = std::max(most, std::abs(level.slope[0][i]) + std::abs(level.slope[1][i]));
      }
      for (auto& half : groups.half) half[group] += (level.half + 1.0F) * (1.0F + most);
    }
    for (std::size_t i = begin; i < begin + kGroup; ++i) groups.views[group] |= level.views[i];
  }
}

// The numbers of places that each side takes: of its faces that are there, filled up to whole groups.
template <class ViewsOf>
std::array<std::size_t, kSides> places_of(const std::vector<SeenFace>& faces, ViewsOf views_of) {
  std::array<std::size_t, kSides> count{};
  for (const SeenFace& face : faces) count[face.side()] += static_cast<std::size_t>(views_of(face) != 0);
  for (std::size_t& each : count) each = (each + kGroup - 1) / kGroup * kGroup;
  return count;
}

void resize(ImpostorFaces::Level& level, std::size_t size) {
  for (auto& coordinates : level.centre) coordinates.resize(size);
  level.views.resize(size);
  level.face.resize(size);
}

// Puts a face, or a surfel, at a place of a level.
void put_face(const SeenFace& seen, DVec3 centre, ImpostorFaces::Level& level, std::size_t at) {
  const auto [voxel, direction] = seen.face;
  const FaceFrame& frame = frame_of(direction);
  const ImpostorFaces::Surfel* const surfel = seen.surfel;
  for (std::size_t k = 0; surfel != nullptr && k < 2; ++k) {
    level.slope[k][at] = surfel->slope[k];
    level.reach[k][at] = surfel->half[k] + (level.half - 0.5F) + ImpostorFaces::kSurfelRoom;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool is_along = axis == frame.axis;
    const double of_voxel = is_along ? 0.5 + 0.5 * frame.sign : 0.5;
    const auto of_surfel = [&] { return is_along ? surfel->offset : surfel->shift[axis == frame.u ? 0 : 1]; };
    const double edge = surfel == nullptr ? of_voxel : double{of_surfel()};
    const auto a = static_cast<int>(axis);
    level.centre[axis][at] = static_cast<float>(voxel[a] + edge - centre[a]);
  }
}

template <class ViewsOf>
ImpostorFaces::Level level_of(const std::vector<SeenFace>& faces, const ContentSphere& content, double half,
                              ViewsOf views_of) {
  ImpostorFaces::Level level;
  level.size = static_cast<float>(content.radius);
  level.half = static_cast<float>(half);
  const std::array<std::size_t, kSides> places = places_of(faces, views_of);
  for (std::size_t side = 0; side < kSides; ++side) {
    level.begin[side + 1] = level.begin[side] + static_cast<std::uint32_t>(places[side]);
  }
  resize(level, level.begin[kSides]);
  if (level.begin[kSides] != level.begin[kSides / 2]) {
    for (auto& slopes : level.slope) slopes.resize(level.begin[kSides]);
    for (auto& reaches : level.reach) reaches.resize(level.begin[kSides]);
  }
  std::size_t at = 0;
  std::size_t side = 0;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const std::uint32_t views = views_of(faces[i]);
    if (views == 0) continue;
    for (; side < faces[i].side(); ++side) fill_up(level, at, level.begin[side + 1]);
    put_face(faces[i], content.centre, level, at);
    level.views[at] = views;
    level.face[at++] = static_cast<std::uint32_t>(i);
  }
  for (; side < kSides; ++side) fill_up(level, at, level.begin[side + 1]);
  find_groups(level);
  return level;
}

}  // namespace

ImpostorFaces::Level faces_of_level(const std::vector<SeenFace>& faces, std::size_t level, int edge,
                                    const ContentSphere& content) {
  const double texel = snapshot_camera(content, 0, edge).half_size() * 2.0 / edge;
  const double half = texel > 1.0 ? std::max(0.5, kRoom * texel) : 0.5;
  return level_of(faces, content, half, [&](const SeenFace& face) { return face.views[level]; });
}

ImpostorFaces::Level unseen_faces(const std::vector<SeenFace>& faces, const ContentSphere& content) {
  return level_of(faces, content, 0.5, [](const SeenFace& face) { return face.views[0] == 0 ? ~0U : 0U; });
}

ImpostorFaces::Level seen_faces(const std::vector<SeenFace>& faces, const ContentSphere& content) {
  return level_of(faces, content, 0.5, [](const SeenFace& face) { return face.views[0]; });
}

ImpostorFaces::Level all_faces(const std::vector<SeenFace>& faces, const ContentSphere& content) {
  return level_of(faces, content, 0.5, [](const SeenFace&) { return ~0U; });
}

}  // namespace quoin
