#include "render/impostor/seen.h"

#include <algorithm>

namespace quoin {
namespace {

constexpr std::size_t kGroup = ImpostorFaces::kGroup;
// Texels: how far from its middle a face is taken to reach where voxels are smaller than texels.
constexpr double kRoom = 0.5;

// Adds copies of the last face that no view saw until there are whole groups.
void fill_up(ImpostorFaces::Level& level) {
  while (level.views.size() % kGroup != 0) {
    for (auto& coordinates : level.centre) coordinates.push_back(coordinates.back());
    level.views.push_back(0);
    level.face.push_back(level.face.back());
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

template <class ViewsOf>
ImpostorFaces::Level level_of(const std::vector<SeenFace>& faces, const ContentSphere& content, double half,
                              ViewsOf views_of) {
  ImpostorFaces::Level level;
  level.size = static_cast<float>(content.radius);
  level.half = static_cast<float>(half);
  std::size_t direction = 0;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const std::uint32_t views = views_of(faces[i]);
    if (views == 0) continue;
    const auto [voxel, own] = faces[i].face;
    for (; direction <= static_cast<std::size_t>(own); ++direction) {
      fill_up(level);
      level.begin[direction] = static_cast<std::uint32_t>(level.views.size());
    }
    const DVec3 middle = DVec3(voxel) + 0.5 + 0.5 * DVec3(normal_of(own)) - content.centre;
    for (int axis = 0; axis < 3; ++axis) {
      level.centre[static_cast<std::size_t>(axis)].push_back(static_cast<float>(middle[axis]));
    }
    level.views.push_back(views);
    level.face.push_back(static_cast<std::uint32_t>(i));
  }
  fill_up(level);
  for (; direction <= 6; ++direction) level.begin[direction] = static_cast<std::uint32_t>(level.views.size());
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

ImpostorFaces::Level all_faces(const std::vector<SeenFace>& faces, const ContentSphere& content) {
  return level_of(faces, content, 0.5, [](const SeenFace&) { return ~0U; });
}

}  // namespace quoin
