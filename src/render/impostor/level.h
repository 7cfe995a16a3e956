#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/scene/level_of_detail.h>

#include "render/impostor/raster/faces.h"
#include "render/impostor/seen.h"

namespace quoin {

inline constexpr std::uint32_t kAllImpostorViews = (1U << kImpostorViews) - 1U;

/// A rectangle of a level: along two axes of the grid, or inclined to them (a surfel).
struct Rectangle {
  Vec3 centre{0.0F};  ///< voxels from the content's centre
  Direction direction = Direction::PosX;
  std::array<float, 2> reach = {0.5F, 0.5F};  ///< from the middle to the sides along kFaceFrames' u and v
  std::array<float, 2> slope{};               ///< rise along the direction's axis per voxel along u and v
  bool is_inclined = false;

  /// Half the sides of the box around it.
  [[nodiscard]] Vec3 half_box() const;
  [[nodiscard]] std::size_t side() const {
    return static_cast<std::size_t>(direction) + (is_inclined ? ImpostorFaces::kSides / 2 : 0);
  }
};

/// Returns the rectangle of a face or surfel. `centre` is the content's.
[[nodiscard]] Rectangle rectangle_of(const SeenFace& seen, DVec3 centre);

/// Collects the rectangles of a level.
class LevelMaker {
 public:
  explicit LevelMaker(const ContentSphere& content) { level_.size = static_cast<float>(content.radius); }

  /// Requires: sides come in their order; `views` has a bit set. `face`: see ImpostorFaces::Level::face.
  void add(const Rectangle& rectangle, std::uint32_t views, std::uint32_t face);
  [[nodiscard]] ImpostorFaces::Level level() &&;

 private:
  void put(const Rectangle& rectangle, std::uint32_t views, std::uint32_t face);
  void end_sides(std::size_t side);
  void end_group();

  ImpostorFaces::Level level_;
  std::size_t side_ = 0;  // minimum side of the next rectangle
  Rectangle last_;
  Vec3 low_{0.0F};  // of the current group
  Vec3 high_{0.0F};
  bool has_reach_ = false;
};

}  // namespace quoin
