#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include <quoin/core/buffer.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_chunk.h>

namespace quoin {

/// How the occlusion of a vertex is estimated from 3x3x3 samples of the field around it: 0 where all is open, 1 where
/// all is solid.
enum class SmoothOcclusion : std::uint8_t {
  None,
  SolidShare,         ///< the share of the samples that are solid
  Weighted,           ///< how deep the samples lie in the solid, against the deepest, or `spread` if that is more
  WeightedPublished,  ///< against the deepest alone, as published: jumps where a sample turns slightly solid, and what
                      ///< is open has offset^power
  SoftShare,          ///< as SolidShare, but a sample of a cell that the surface crosses counts in part: without the
                      ///< steps of a count
};

/// Settings of the occlusion. Lengths, and densities as depths, are in samples of level 0, so that a surface is about
/// as dark at every level; creases narrower than a few cells of a coarse level are lost with their shape.
///
/// The samples lie `spread` apart on each axis, about the vertex moved along its unit normal n by
/// spread * (|nx| + |ny| + |nz|) + 0.1 cells, so that a flat or convex surface is exactly 0. Weighted:
/// 1 - clamp((1 - (ratio + offset)^power) / (1 - offset^power), 0, 1); as published:
/// 1 - clamp(1 - (ratio + offset)^power, 0, 1). The soft share counts a sample whose density d is less than 0 by
/// d / min(s, -spread / 8), at most 1: s is interpolated as d is, but with 0 for the corners in air. Numbers out of
/// their range count as its nearest end, NaN as the default.
struct SmoothOcclusionOptions {
  SmoothOcclusion method = SmoothOcclusion::SoftShare;
  float spread = 2.0F;  ///< 1/16 to 4, rounded to 1/65,536 of a cell; 1 and 2 cells are several times faster than
                        ///< others
  float offset = 0.4F;  ///< of the weighted forms: 0 to 0.99
  float power = 2.0F;   ///< of the weighted forms: 1/16 to 64

  bool operator==(const SmoothOcclusionOptions&) const = default;
};

/// How far, in samples of level 0, a vertex may read: an edit that is farther than this from a chunk leaves its mesh as
/// it was. `coarsest_level` is the coarsest that the chunk or a neighbour is meshed at, 0 to kMaxSmoothLevel; others
/// count as the nearest of these.
[[nodiscard]] int reach_of(const SmoothOcclusionOptions& occlusion, int coarsest_level = 0);

/// Where a mesh of one chunk ends.
enum class SmoothBorder : std::uint8_t {
  Shared,  ///< at its neighbours' meshes, without a gap: border vertices are the same bits in both
  Open,    ///< at its own last samples: reads no neighbour but for occlusion
};

/// The coarsest level of detail: cells of 8 samples.
inline constexpr int kMaxSmoothLevel = 3;

struct SmoothOptions {
  SmoothOcclusionOptions occlusion;
  SmoothBorder border = SmoothBorder::Shared;
  /// Gives a cell that two sheets of the surface cross a vertex for each, so that the mesh is manifold everywhere.
  /// Without, some edges have four triangles. Cells beside a chunk of another level keep one vertex.
  bool split_sheets = true;
  /// Where solid samples touch by an edge only, the sheets are those of one solid instead of two: what is one sample
  /// thick and runs at a slant holds together. Of use with `split_sheets` alone.
  bool join_diagonals = false;
  /// Level of detail of the chunk and its neighbours, indexed as a neighbourhood: cells are 2^level samples wide, and
  /// meshes of different levels meet without a gap. 0 to kMaxSmoothLevel; more counts as that.
  std::array<std::uint8_t, 27> levels{};
};

/// The cell of a vertex, for welding the meshes of chunks and for finding what lies around it.
///
/// bits 0-5 x, 6-11 y, 12-17 z of the cell in its chunk, in cells of that chunk's level; 18, 19, 20: the cell lies in
/// the previous chunk along x, y, z; 21-22 which of the cell's sheets, or which side of a bridge; 23-24: 0, or 1 + the
/// axis along which the vertex lies between this cell and the next, in a bridge of what is joined by an edge; the rest
/// 0.
struct SmoothCell {
  std::uint32_t bits = 0;

  static constexpr int kPreviousShift = 18;
  static constexpr int kSheetShift = 21;
  static constexpr int kBridgeShift = 23;

  [[nodiscard]] IVec3 cell() const { return {field(0, 63), field(6, 63), field(12, 63)}; }
  /// The cell's chunk relative to the mesh's: 0 or -1 on each axis.
  [[nodiscard]] IVec3 chunk_offset() const { return {-field(18, 1), -field(19, 1), -field(20, 1)}; }
  [[nodiscard]] int sheet() const { return field(kSheetShift, 3); }
  /// 0, 1 or 2: the axis across which the vertex lies between two cells; -1 where it lies in its own.
  [[nodiscard]] int bridge_axis() const { return field(kBridgeShift, 3) - 1; }

  bool operator==(const SmoothCell&) const = default;

 private:
  [[nodiscard]] int field(int shift, int mask) const { return static_cast<int>(bits >> shift) & mask; }
};

/// The surface of one chunk. Reuse one between calls: it only grows.
struct SmoothChunkMesh {
  Buffer<Vec3> positions;         ///< samples of level 0, origin at the chunk's sample (0, 0, 0); exact multiples of
                                  ///< 2^(level - 16)
  Buffer<Vec3> normals;           ///< unit, into the air
  Buffer<float> occlusion;        ///< 0 (open) to 1 (dark); empty without occlusion
  Buffer<SmoothCell> cells;       ///< where each vertex lies
  Buffer<std::uint32_t> indices;  ///< three a triangle, counter-clockwise seen from the air

  void clear();
};

/// Turns chunks of density into smooth surfaces by naive Surface Nets; holds scratch memory (about 2 MiB), so keep one
/// a thread.
///
/// Source: S. Gibson, "Constrained Elastic Surface Nets" (1998), without the relaxation; a vertex a cell at the mean of
///         the crossings of its edges.
class SmoothMesher {
 public:
  SmoothMesher();
  SmoothMesher(SmoothMesher&&) noexcept;
  SmoothMesher& operator=(SmoothMesher&&) noexcept;
  ~SmoothMesher();

  /// Replaces `out` by the surface of the centre chunk.
  ///
  /// Owned:    the quads around the crossed lattice edges that start at a sample of the chunk; the vertices are those
  ///           of cells -1 to 63, so that neighbours' meshes repeat the vertices of their common cells, bit for bit,
  ///           and no triangle.
  /// Quads:    split along the shorter diagonal (to 1/64 of a cell).
  /// Normals:  the gradient of the trilinear field at the vertex; (0, 1, 0) where that is 0.
  /// Order:    z, then the quads across x, y and z edges; the same bytes on every machine and instruction set.
  /// Cost:     O(rows of 64 samples + vertices); no allocation once `out` has grown.
  void mesh(const DensityNeighbourhood& chunks, const SmoothOptions& options, SmoothChunkMesh& out);

 private:
  struct Scratch;
  std::unique_ptr<Scratch> scratch_;
};

}  // namespace quoin
