#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/core/hash.h>

#include "core/instruction_set.h"
#include "render/impostor/raster/impostor_faces.h"

/// Draws the faces of an impostor into a square of an image: in single precision relative to the content's centre, in
/// voxels, with one vector register of faces at a time.
namespace quoin::raster {

inline constexpr int kTile = 32;  ///< pixels per side
inline constexpr int kBlock = 4;
inline constexpr std::size_t kPixels = std::size_t{kTile} * kTile;

/// Returns the index of pixel (x, y) in a tile's arrays: 4x4 pixels together, lane x + 4 y.
[[nodiscard]] constexpr std::size_t index_of(int x, int y) {
  QUOIN_ASSERT(x >= 0 && x < kTile && y >= 0 && y < kTile, "a pixel of the tile");
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

/// The pixels that show one of two levels: Pattern numbers from `first` up to, but not including, `end`.
struct Share {
  std::int32_t first = 0;
  std::int32_t end = 1 << 24;
  [[nodiscard]] bool is_whole() const { return first == 0 && end == 1 << 24; }
};

/// Numbers of 24 bits for the pixels of an image. Each range of them is spread evenly over the image, and over the
/// samples of each pixel.
///
/// Source: the sequence R2, as in `sample_point`.
struct Pattern {
  static constexpr std::uint32_t kColumn = 12'664'745;  ///< 0.7548776662 of 2^24
  static constexpr std::uint32_t kRow = 9'560'333;      ///< 0.5698402910
  static constexpr std::uint32_t kSample = 10'368'889;  ///< 0.6180339887

  /// `sample`: of the point within the pixel.
  [[nodiscard]] static constexpr std::int32_t at(int column, int row, std::uint32_t sample) {
    return static_cast<std::int32_t>(
        (static_cast<std::uint32_t>(column) * kColumn + static_cast<std::uint32_t>(row) * kRow + sample * kSample) &
        0xFF'FFFFU);
  }
};

/// The three views around a direction, and their frequencies in units of 1/2^14.
struct NearViews {
  std::array<std::uint8_t, 3> view{};
  std::array<std::uint16_t, 2> share{1 << 14, 0};  ///< of the first two

  /// Returns the view whose face lights a bit of a cell, chosen pseudo-randomly.
  [[nodiscard]] std::uint32_t chosen(std::uint32_t number) const {
    const std::uint32_t at = mix_bits(number) >> 18;
    if (at < share[0]) return view[0];
    return at < std::uint32_t{share[0]} + share[1] ? view[1] : view[2];
  }
};

/// The input of a draw: faces and viewpoint.
struct Job {
  const ImpostorFaces::Level* level = nullptr;
  std::uint32_t views = 0;  ///< only faces that one of these views saw are drawn
  std::int32_t id = 0;
  Share share;  ///< of the pixels
  NearViews near;
  // A pixel's ray: its point in the plane through the content's centre, and its direction.
  LinearVector point;
  LinearVector direction;
  // Depths along the camera's forward axis, in world units: `depth_at` in that plane, and the increase per length of
  // `direction`, whose component along `forward` is 1.
  Vector forward{};
  float depth_at = 0.0F;
  float depth_step = 1.0F;
  // The position of a point q in the tile: ((across . q + across_at), (down . q + down_at)) / (ahead . q + ahead_at),
  // plus (column_at, row_at). In pixels, with samples at integers.
  Vector across{};
  Vector down{};
  Vector ahead{};
  float across_at = 0.0F;
  float down_at = 0.0F;
  float ahead_at = 1.0F;
  float column_at = 0.0F;
  float row_at = 0.0F;
  // Pixels where it may be visible; `right` and `bottom` exclusive.
  int left = 0;
  int top = 0;
  int right = kTile;
  int bottom = kTile;
};

/// A camera in the space of an impostor's grid.
struct Aim {
  // Its axes, unit, in the grid's frame.
  DVec3 right{1.0, 0.0, 0.0};
  DVec3 down{0.0, -1.0, 0.0};
  DVec3 forward{0.0, 0.0, -1.0};
  DVec3 centre{0.0};  ///< of the content, along these, in voxels
  bool is_perspective = true;
  double focal = 1.0;       ///< pixels per voxel; in perspective at distance 1
  double voxel_size = 1.0;  ///< world units
};

/// Sets all camera-dependent data. Pixel (0, 0) of the tile lies at (`x`, `y`) pixels from the image's centre.
void set_aim(const Aim& aim, double x, double y, Job& job);

/// A hit: the number of a rectangle of a level and, for a cell, the view whose face lights it.
struct Met {
  std::uint32_t rectangle = 0;
  std::uint32_t view = 0;

  [[nodiscard]] static constexpr Met of(std::int32_t packed) {
    const auto bits = static_cast<std::uint32_t>(packed);
    return {bits >> 5, bits & 31U};
  }
  [[nodiscard]] constexpr std::int32_t packed() const {
    QUOIN_ASSERT(rectangle < 1U << 26 && view < 32, "a number of 26 bits and a view of 5 bits");
    return static_cast<std::int32_t>(rectangle << 5 | view);
  }
};

/// Returns the face that lights a hit: an index into ImpostorFaces::faces.
[[nodiscard]] inline std::uint32_t face_of(const ImpostorFaces::Level& level, Met met) {
  QUOIN_ASSERT(met.rectangle < level.face.size(), "a rectangle of the level");
  const std::uint32_t at = level.face[met.rectangle];
  QUOIN_ASSERT(level.cells.empty() || (at < level.cells.size() && met.view < kImpostorViews), "a cell, and a view");
  return level.cells.empty() ? at : level.cells[at].face[met.view];
}

/// The nearest hit of each pixel so far, in the order of index_of.
struct Canvas {
  alignas(64) std::array<float, kPixels> depth{};        ///< infinite: no hit
  alignas(64) std::array<std::int32_t, kPixels> id{};    ///< of the job
  alignas(64) std::array<std::int32_t, kPixels> face{};  ///< see Met
  std::array<float, kPixels / 16> furthest{};            ///< depth of each 4x4 pixels
  std::array<std::int32_t, kPixels> pattern{};           ///< see Pattern; 0 if all parts are drawn whole

  void clear();
  /// Sets the pattern of the tile from (`column`, `row`) of an image. Cost: 1 microsecond.
  void set_pattern(int column, int row, std::uint32_t sample);
};

/// Writes each face to the pixels whose rays meet it, if it is nearer than the stored hit. Ties go to the lower id,
/// then to the lower face.
using Draw = void (*)(const Job& job, Canvas& canvas);

// The wider kernels exist only in builds that compile them. `kDraws` contains the available ones.
extern const Draw kPlainDraw;
extern const Draw kAvx2Draw;
extern const Draw kAvx512Draw;
extern const KernelTable<Draw> kDraws;

/// Returns the kernel with the widest instructions that this machine has. Every kernel writes the same bits.
[[nodiscard]] inline Draw draw() {
  return kDraws.widest();
}

}  // namespace quoin::raster
