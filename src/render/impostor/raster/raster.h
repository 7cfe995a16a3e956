#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "render/impostor/raster/faces.h"

/// Draws the faces of an impostor into a square of a picture: in single precision relative to the content's centre, in
/// voxels, a register of faces at once.
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

/// A camera, as the grid of an impostor sees it.
struct Aim {
  // Its axes, unit, in the grid's frame.
  DVec3 right{1.0, 0.0, 0.0};
  DVec3 down{0.0, -1.0, 0.0};
  DVec3 forward{0.0, 0.0, -1.0};
  DVec3 centre{0.0};  ///< of the content, along these, in voxels
  bool is_perspective = true;
  double focal = 1.0;       ///< pixels a voxel, in perspective at a distance of one
  double voxel_size = 1.0;  ///< world units
};

/// Sets all that depends on the camera. Pixel (0, 0) of the tile lies at (`x`, `y`) pixels from the picture's middle.
void set_aim(const Aim& aim, double x, double y, Job& job);

/// What is nearest so far, in the order of index_of.
struct Canvas {
  alignas(64) std::array<float, kPixels> depth{};        ///< infinite: nothing
  alignas(64) std::array<std::int32_t, kPixels> id{};    ///< of the job
  alignas(64) std::array<std::int32_t, kPixels> face{};  ///< ImpostorFaces::faces
  std::array<float, kPixels / 16> furthest{};            ///< depth of each 4x4 pixels

  void clear();
};

/// Puts each face where a pixel's ray meets it, if it is nearer than what is there, or as near and of a lower id, or
/// the lower face of that id.
using Draw = void (*)(const Job& job, Canvas& canvas);

extern const Draw kDrawPlain;
extern const Draw kDrawAvx2;
extern const Draw kDrawAvx512;

/// That of the widest instructions that this machine has. Every one writes the same bits.
[[nodiscard]] Draw draw();

}  // namespace quoin::raster
