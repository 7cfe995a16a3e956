#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/core/instruction_set.h>

#include "render/impostor_faces.h"

/// Draws the faces of an impostor into a square of a picture: in single precision relative to the content's centre, in
/// voxels, sixteen pixels at once.
namespace quoin::raster {

inline constexpr int kTile = 32;  ///< pixels a side
inline constexpr int kBlock = 4;
inline constexpr std::size_t kPixels = std::size_t{kTile} * kTile;

/// Where pixel (x, y) lies among the numbers of a tile: 4x4 pixels together, lane x + 4 y.
[[nodiscard]] constexpr std::size_t index_of(int x, int y) {
  const int block = y / kBlock * (kTile / kBlock) + x / kBlock;
  return static_cast<std::size_t>(block * kBlock * kBlock + y % kBlock * kBlock + x % kBlock);
}

using Vector = std::array<float, 3>;

/// A vector that depends linearly on the pixel: at + x * x + y * y.
struct LinearVector {
  Vector at{};
  Vector x{};
  Vector y{};
};

/// What is drawn from where.
struct Job {
  const ImpostorFaces::Level* level = nullptr;
  std::uint32_t views = 0;  ///< faces that none of these saw are left out
  // The ray of a pixel: a point of it in the plane through the content's centre, and how it goes on; its depth there is
  // 0 and grows by 1 a length of `direction`.
  LinearVector point;
  LinearVector direction;
  float least_depth = 0.0F;  ///< what is nearer is behind the camera
  // Where a point q lies in the tile: ((across . q + across_at), (down . q + down_at)) / (ahead . q + ahead_at), plus
  // (column_at, row_at). In pixels, whose samples lie at whole numbers.
  Vector across{};
  Vector down{};
  Vector ahead{};
  float across_at = 0.0F;
  float down_at = 0.0F;
  float ahead_at = 1.0F;
  float column_at = 0.0F;
  float row_at = 0.0F;
  // Pixels in which it may show; `right` and `bottom` exclusive.
  int left = 0;
  int top = 0;
  int right = kTile;
  int bottom = kTile;
};

/// What is nearest so far.
struct Canvas {
  alignas(64) std::array<float, kPixels> depth{};
  alignas(64) std::array<std::int32_t, kPixels> face{};  ///< ImpostorFaces::faces; -1: none
};

/// Puts each face that is nearer than `canvas.depth` where a pixel's ray meets it.
using Draw = void (*)(const Job& job, Canvas& canvas);

extern const Draw kDrawPlain;
extern const Draw kDrawAvx2;
extern const Draw kDrawAvx512;

/// Every one writes the same bits.
[[nodiscard]] Draw draw_of(InstructionSet instructions);

}  // namespace quoin::raster
