#include "render/impostor/level.h"

#include <cmath>
#include <utility>

#include <glm/common.hpp>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

constexpr std::size_t kGroup = ImpostorFaces::kGroup;
constexpr std::size_t kSides = ImpostorFaces::kSides;

template <class ViewsOf>
ImpostorFaces::Level level_of(const std::vector<SeenFace>& faces, const ContentSphere& content, ViewsOf views_of) {
  LevelMaker maker(content);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const std::uint32_t views = views_of(faces[i]);
    if (views != 0) maker.add(rectangle_of(faces[i], content.centre), views, static_cast<std::uint32_t>(i));
  }
  return std::move(maker).level();
}

}  // namespace

Vec3 Rectangle::half_box() const {
  const FaceFrame& frame = frame_of(direction);
  Vec3 half;
  half[frame.u] = reach[0], half[frame.v] = reach[1];
  half[frame.axis] = is_inclined ? reach[0] * std::abs(slope[0]) + reach[1] * std::abs(slope[1]) : 0.0F;
  return half;
}

Rectangle rectangle_of(const SeenFace& seen, DVec3 centre) {
  const auto [voxel, direction] = seen.face;
  const FaceFrame& frame = frame_of(direction);
  const ImpostorFaces::Surfel* const surfel = seen.surfel;
  Rectangle out;
  out.direction = direction;
  out.is_inclined = surfel != nullptr;
  for (std::size_t k = 0; surfel != nullptr && k < 2; ++k) {
    out.slope[k] = surfel->slope[k];
    out.reach[k] = surfel->half[k] + ImpostorFaces::kSurfelRoom;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_along = axis == frame.axis;
    const double of_voxel = is_along ? 0.5 + 0.5 * frame.sign : 0.5;
    const auto of_surfel = [&] { return is_along ? surfel->offset : surfel->shift[axis == frame.u ? 0 : 1]; };
    const double edge = surfel == nullptr ? of_voxel : double{of_surfel()};
    out.centre[axis] = static_cast<float>(voxel[axis] + edge - centre[axis]);
  }
  return out;
}

void LevelMaker::add(const Rectangle& rectangle, std::uint32_t views, std::uint32_t face) {
  QUOIN_ASSERT(views != 0 && rectangle.side() >= side_, "sides in their order");
  end_sides(rectangle.side());
  has_reach_ |= rectangle.is_inclined || rectangle.reach != std::array{0.5F, 0.5F};
  put(rectangle, views, face);
}

void LevelMaker::put(const Rectangle& rectangle, std::uint32_t views, std::uint32_t face) {
  const Vec3 half = rectangle.half_box();
  const bool is_first = level_.views.size() % kGroup == 0;
  low_ = is_first ? rectangle.centre - half : glm::min(low_, rectangle.centre - half);
  high_ = is_first ? rectangle.centre + half : glm::max(high_, rectangle.centre + half);
  for (std::size_t axis = 0; axis < 3; ++axis) level_.centre[axis].push_back(rectangle.centre[static_cast<int>(axis)]);
  level_.views.push_back(views);
  level_.face.push_back(face);
  for (std::size_t k = 0; k < 2; ++k) {
    level_.reach[k].push_back(rectangle.reach[k]);
    level_.slope[k].push_back(rectangle.slope[k]);
  }
  last_ = rectangle;
  if (level_.views.size() % kGroup == 0) end_group();
}

void LevelMaker::end_group() {
  ImpostorFaces::Groups& groups = level_.groups;
  QUOIN_ASSERT(!level_.views.empty() && level_.views.size() % kGroup == 0, "a full group");
  std::uint32_t views = 0;
  for (std::size_t i = level_.views.size() - kGroup; i < level_.views.size(); ++i) views |= level_.views[i];
  groups.views.push_back(views);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<int>(axis);
    groups.centre[axis].push_back(0.5F * (low_[a] + high_[a]));
    // Includes a rounding margin.
    groups.half[axis].push_back(0.5F * (high_[a] - low_[a]) + 1e-6F * level_.size);
  }
}

// Fills the last group with copies of its last rectangle that no view sees.
void LevelMaker::end_sides(std::size_t side) {
  for (; side_ < side; ++side_) {
    while (level_.views.size() % kGroup != 0) put(last_, 0, level_.face.back());
    level_.begin[side_ + 1] = static_cast<std::uint32_t>(level_.views.size());
  }
}

ImpostorFaces::Level LevelMaker::level() && {
  end_sides(kSides);
  QUOIN_ASSERT(level_.groups.views.size() * kGroup == level_.views.size(), "whole groups");
  QUOIN_ASSERT(level_.face.size() == level_.views.size(), "one face per rectangle");
  // Kernels read past the end.
  for (auto* const boxes : {&level_.groups.centre, &level_.groups.half}) {
    for (std::vector<float>& values : *boxes) values.resize(values.size() + kGroup);
  }
  if (level_.begin[kSides / 2] == level_.begin[kSides]) level_.slope = {};
  if (!has_reach_) level_.reach = {};
  return std::move(level_);
}

ImpostorFaces::Level unseen_faces(const std::vector<SeenFace>& faces, const ContentSphere& content) {
  return level_of(faces, content, [](const SeenFace& face) { return face.views == 0 ? kAllImpostorViews : 0U; });
}

ImpostorFaces::Level seen_faces(const std::vector<SeenFace>& faces, const ContentSphere& content) {
  return level_of(faces, content, [](const SeenFace& face) { return face.views; });
}

ImpostorFaces::Level all_faces(const std::vector<SeenFace>& faces, const ContentSphere& content) {
  return level_of(faces, content, [](const SeenFace&) { return kAllImpostorViews; });
}

}  // namespace quoin
