#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include <quoin/core/buffer.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_chunk.h>

namespace [[gnu::visibility("default")]] quoin {

/// Method that estimates the occlusion of a vertex from the 3x3x3 samples of the field around it. All methods give 0 in
/// the open and 1 inside a solid.
enum class SmoothOcclusion : std::uint8_t {
  None,
  SolidShare,  ///< share of the samples that are solid
  /// Depth of the samples in the solid, relative to the deepest sample, or to `spread` if that is greater.
  Weighted,
  /// Depth relative to the deepest sample alone, as published. Jumps where a sample turns slightly solid; open
  /// positions have offset^power.
  WeightedPublished,
  /// As SolidShare, but samples of cells that the surface crosses count in part, so that there are no visible steps.
  SoftShare,
};

/// Settings of ambient occlusion. Lengths, and densities as depths, are in samples of level 0, so that a surface is
/// about equally dark at every level. Creases narrower than a few cells of a coarse level disappear together with their
/// shape.
///
/// The samples lie `spread` apart on each axis. Their centre is the vertex, moved along its unit normal n by
/// spread * (|nx| + |ny| + |nz|) + 0.1 cells, so that a flat or convex surface has exactly 0.
///
/// Weighted:  1 - clamp((1 - (ratio + offset)^power) / (1 - offset^power), 0, 1).
/// Published: 1 - clamp(1 - (ratio + offset)^power, 0, 1).
/// Soft:      a sample of density d < 0 counts d / min(s, -spread / 8), at most 1. s is interpolated as d is, with 0 at
///            the corners in air.
///
/// Values out of range are clamped; NaN means the default.
struct SmoothOcclusionOptions {
  SmoothOcclusion method = SmoothOcclusion::SoftShare;
  /// 1/16 to 4, rounded to 1/65,536 of a cell; 1 and 2 cells are several times faster than other values.
  float spread = 2.0F;
  float offset = 0.4F;  ///< of the weighted methods: 0 to 0.99
  float power = 2.0F;   ///< of the weighted methods: 1/16 to 64

  bool operator==(const SmoothOcclusionOptions&) const = default;
};

/// Returns the distance, in samples of level 0, within which a vertex may read. An edit farther than this from a chunk
/// leaves the chunk's mesh unchanged. `coarsest_level` is the coarsest level of the chunk and its neighbours, clamped
/// to [0, kMaxSmoothLevel].
[[nodiscard]] int reach_of(const SmoothOcclusionOptions& occlusion, int coarsest_level = 0);

/// Selects how the mesh of one chunk meets its neighbours.
enum class SmoothBorder : std::uint8_t {
  Shared,  ///< no gap to the neighbours' meshes: border vertices have the same bits in both
  Open,    ///< ends at the chunk's last samples; reads neighbours only for occlusion
};

/// Coarsest level of detail: cells of 8 samples.
inline constexpr int kMaxSmoothLevel = 3;

struct SmoothOptions {
  SmoothOcclusionOptions occlusion;
  SmoothBorder border = SmoothBorder::Shared;
  /// Gives a cell that two sheets of the surface cross one vertex per sheet, so that the mesh is manifold. If false,
  /// some edges have four triangles. Cells next to a chunk of another level keep one vertex.
  bool split_sheets = true;
  /// Joins solid samples that touch only along an edge into one solid instead of two, so that slanted features one
  /// sample thick stay connected. Takes effect only with `split_sheets`.
  bool join_diagonals = false;
  /// Levels of detail of the chunk and its neighbours, indexed as a neighbourhood. Cells are 2^level samples wide.
  /// Meshes of different levels meet without a gap. 0 to kMaxSmoothLevel; higher values are clamped.
  std::array<std::uint8_t, 27> levels{};
};

/// The cell of a vertex, for welding chunk meshes and for finding the samples around it.
///
///   bits    content
///   0-17    cell in its chunk, in cells of that chunk's level: x in 0-5, y in 6-11, z in 12-17
///   18-20   the cell lies in the previous chunk along x (18), y (19), z (20)
///   21-22   sheet of the cell, or side of a bridge
///   23-24   0, or for a vertex in a bridge (join_diagonals) 1 + the axis along which
///           it lies between this cell and the next
///   25-31   0
struct SmoothCell {
  std::uint32_t bits = 0;

  static constexpr int kPreviousShift = 18;
  static constexpr int kSheetShift = 21;
  static constexpr int kBridgeShift = 23;

  [[nodiscard]] IVec3 cell() const { return {field(0, 63), field(6, 63), field(12, 63)}; }
  /// Returns the cell's chunk relative to the mesh's chunk: 0 or -1 on each axis.
  [[nodiscard]] IVec3 chunk_offset() const { return {-field(18, 1), -field(19, 1), -field(20, 1)}; }
  [[nodiscard]] int sheet() const { return field(kSheetShift, 3); }
  /// Returns the axis (0, 1 or 2) along which a bridge vertex lies between two cells; -1 for other vertices.
  [[nodiscard]] int bridge_axis() const { return field(kBridgeShift, 3) - 1; }

  bool operator==(const SmoothCell&) const = default;

 private:
  [[nodiscard]] int field(int shift, int mask) const { return static_cast<int>(bits >> shift) & mask; }
};

/// The surface of one chunk. Reuse a mesh between calls: its capacity only grows.
struct SmoothChunkMesh {
  /// Samples of level 0, origin at the chunk's sample (0, 0, 0); exact multiples of 2^(level - 16).
  Buffer<Vec3> positions;
  Buffer<Vec3> normals;           ///< unit length, towards the air
  Buffer<float> occlusion;        ///< 0 (open) to 1 (dark); empty with SmoothOcclusion::None
  Buffer<SmoothCell> cells;       ///< cell of each vertex
  Buffer<std::uint32_t> indices;  ///< three per triangle, counter-clockwise seen from the air

  void clear();
};

/// Meshes chunks of density with naive Surface Nets. Holds about 2 MiB of scratch memory: keep one mesher per thread.
///
/// Source: S. Gibson, "Constrained Elastic Surface Nets" (1998), without the relaxation: one vertex per cell at the
///         mean of its edge crossings.
class SmoothMesher {
 public:
  SmoothMesher();
  SmoothMesher(SmoothMesher&&) noexcept;
  SmoothMesher& operator=(SmoothMesher&&) noexcept;
  ~SmoothMesher();

  /// Replaces `out` with the surface of the centre chunk.
  ///
  /// Owned:   the quads around each lattice edge that starts at a sample of the chunk and crosses the surface. Vertices
  ///          belong to cells -1 to 63. Meshes of neighbouring chunks repeat the vertices of their common cells bit for
  ///          bit. No triangle occurs in two meshes.
  /// Quads:   split along the shorter diagonal (to 1/64 of a cell).
  /// Normals: the gradient of the trilinear field at the vertex; (0, 1, 0) where the gradient is 0.
  /// Order:   z, then the quads across x, y and z edges; the same bytes on every machine and instruction set.
  /// Cost:    O(rows of 64 samples + vertices); no allocation once `out` has grown.
  void mesh(const DensityNeighbourhood& chunks, const SmoothOptions& options, SmoothChunkMesh& out);

 private:
  struct [[gnu::visibility("hidden")]] Scratch;
  std::unique_ptr<Scratch> scratch_;
};

}  // namespace quoin
