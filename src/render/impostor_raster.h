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
  std::int32_t id = 0;
  // The ray of a pixel: a point of it in the plane through the content's centre, and how it goes on.
  LinearVector point;
  LinearVector direction;
  // Depths along the camera's forward axis, in world units: `depth_at` in that plane, and how it grows a length of
  // `direction`, which is one along `forward`.
  Vector forward{};
  float depth_at = 0.0F;
  float depth_step = 1.0F;
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

/// What is nearest so far, in the order of index_of.
struct Canvas {
  alignas(64) std::array<float, kPixels> depth{};        ///< infinite: nothing
  alignas(64) std::array<std::int32_t, kPixels> id{};    ///< of the job
  alignas(64) std::array<std::int32_t, kPixels> face{};  ///< ImpostorFaces::faces
  std::array<float, kPixels / 16> furthest{};            ///< depth of each 4x4 pixels

  void clear();
};

/// Puts each face where a pixel's ray meets it, if it is nearer than what is there, or as near and of a lower id.
using Draw = void (*)(const Job& job, Canvas& canvas);

extern const Draw kDrawPlain;
extern const Draw kDrawAvx2;
extern const Draw kDrawAvx512;

/// Every one writes the same bits.
[[nodiscard]] Draw draw_of(InstructionSet instructions);

}  // namespace quoin::raster
