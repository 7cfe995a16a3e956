#include "render/impostor/seen.h"

#include <algorithm>
#include <array>

namespace quoin {
namespace {

constexpr std::size_t kGroup = ImpostorFaces::kGroup;
// Texels: how far from its middle a face is taken to reach where voxels are smaller than texels.
constexpr double kRoom = 0.5;

// Copies of the last face that no view saw, from `at` to `end`.
void fill_up(ImpostorFaces::Level& level, std::size_t& at, std::size_t end) {
  for (; at < end; ++at) {
    for (auto& coordinates : level.centre) coordinates[at] = coordinates[at - 1];
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
    for (std::size_t i = begin; i < begin + kGroup; ++i) groups.views[group] |= level.views[i];
  }
}

// The numbers of places that each direction takes: of its faces that are there, filled up to whole groups.
template <class ViewsOf>
std::array<std::size_t, 6> places_of(const std::vector<SeenFace>& faces, ViewsOf views_of) {
  std::array<std::size_t, 6> count{};
  for (const SeenFace& face : faces) {
    count[static_cast<std::size_t>(face.face.direction)] += static_cast<std::size_t>(views_of(face) != 0);
  }
  for (std::size_t& each : count) each = (each + kGroup - 1) / kGroup * kGroup;
  return count;
}

void resize(ImpostorFaces::Level& level, std::size_t size) {
  for (auto& coordinates : level.centre) coordinates.resize(size);
  level.views.resize(size);
  level.face.resize(size);
}

template <class ViewsOf>
ImpostorFaces::Level level_of(const std::vector<SeenFace>& faces, const ContentSphere& content, double half,
                              ViewsOf views_of) {
  ImpostorFaces::Level level;
  level.size = static_cast<float>(content.radius);
  level.half = static_cast<float>(half);
  const std::array<std::size_t, 6> places = places_of(faces, views_of);
  for (std::size_t side = 0; side < 6; ++side) {
    level.begin[side + 1] = level.begin[side] + static_cast<std::uint32_t>(places[side]);
  }
  resize(level, level.begin[6]);
  std::size_t at = 0;
  std::size_t side = 0;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const std::uint32_t views = views_of(faces[i]);
    if (views == 0) continue;
    const auto [voxel, direction] = faces[i].face;
    for (; side < static_cast<std::size_t>(direction); ++side) fill_up(level, at, level.begin[side + 1]);
    const FaceFrame& frame = frame_of(direction);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double edge = axis == frame.axis ? 0.5 + 0.5 * frame.sign : 0.5;
      const auto a = static_cast<int>(axis);
      level.centre[axis][at] = static_cast<float>(voxel[a] + edge - content.centre[a]);
    }
    level.views[at] = views;
    level.face[at++] = static_cast<std::uint32_t>(i);
  }
  for (; side < 6; ++side) fill_up(level, at, level.begin[side + 1]);
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
