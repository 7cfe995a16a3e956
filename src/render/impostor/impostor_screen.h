#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <quoin/render/impostor.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene_tracer.h>

#include "render/impostor/raster/impostor_faces.h"
#include "render/impostor/raster/raster.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {

/// A pixel rectangle of an image, `right` and `bottom` exclusive.
struct PixelArea {
  int left = 0;
  int top = 0;
  int right = 0;
  int bottom = 0;
};

/// A far instance as drawn in one image.
struct DrawnImpostor {
  std::int32_t placed = 0;  ///< index into SceneTracer::placed
  const ImpostorFaces* faces = nullptr;
  std::size_t level = 0;  ///< of the rectangles
  /// The share of pixels, of 2^24, that show the next coarser level instead, to hide the transition. Depends only on
  /// the distance.
  std::int32_t coarser = 0;
  raster::NearViews near;
  PixelArea area;        ///< where it may be visible
  double nearest = 0.0;  ///< depth
  raster::Aim aim;
  glm::dmat3 axes{1.0};  ///< a point p of the view is axes * p / voxel_size + offset in the grid, about the
  DVec3 offset{0.0};     ///< content's centre

  /// A level and the pixels that show it.
  struct Part {
    std::size_t level = 0;  ///< of ImpostorFaces::level
    raster::Share share;
  };
  static constexpr std::size_t kMaxParts = 3;
  /// Returns the parts to draw, in order. Unseen faces are drawn with level 0.
  [[nodiscard]] std::span<const Part> parts(std::array<Part, kMaxParts>& room) const;
};

/// An image with impostors.
class ImpostorScreen {
 public:
  ImpostorScreen(const Camera& camera, int width, int height);

  /// Returns nullopt for instances that draw_impostors skips or that are not visible. `impostor` must outlive the
  /// result.
  [[nodiscard]] std::optional<DrawnImpostor> drawn(const PlacedGrid& placed, std::int32_t index,
                                                   const Impostor& impostor) const;

 private:
  struct Sphere;
  // Returns the sphere's area in the image; nullopt if it is not drawn.
  [[nodiscard]] std::optional<PixelArea> area_of(const Sphere& sphere) const;

  Camera camera_;
  bool is_perspective_;
  int width_;
  int height_;
  double focal_;  // perspective: pixels at distance 1; orthographic: pixels per world unit
};

}  // namespace quoin
