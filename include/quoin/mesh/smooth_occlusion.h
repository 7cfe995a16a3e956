#pragma once

#include <memory>
#include <span>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/mesh/smooth.h>

namespace [[gnu::visibility("default")]] quoin {

/// Positions and normals for an occlusion query, in any order.
///
/// Normals point into the air. A normal whose length differs from 1 by more than about 0.0005 is normalised; a normal
/// without direction (0, NaN, infinite) counts as (0, 1, 0).
struct SmoothSamples {
  std::span<const Vec3> positions;  ///< in samples of level 0, relative to `origin`
  std::span<const Vec3> normals;    ///< as many as positions
  IVec3 origin{0};                  ///< in samples; floats resolve 1/65,536 of a sample up to 256 samples from here
  int level = 0;                    ///< level of detail, clamped to 0 to kMaxSmoothLevel
};

/// Returns the occlusion of a field at a position, from 0 (open) to 1 (dark), as SmoothChunkMesh::occlusion. Use it for
/// meshes from other meshers. The light that arrives is 1 minus the occlusion. Always 0 with SmoothOcclusion::None.
///
///            const float light = 1.0F - smooth_occlusion(field, vertex.position, vertex.normal);
///
/// Bits:  at a vertex's position, normal and level, the result equals the mesher's occlusion bit for bit. Positions are
///        rounded to whole 1/65,536 of a cell (2^level samples), as vertices are.
/// Space: the field's coordinates, in samples of level 0. A position that is NaN or outside the int32 range is far air:
///        0, or offset^power with WeightedPublished.
/// Cost:  one or two microseconds; for many positions, call the overload for spans.
[[nodiscard]] float smooth_occlusion(const DensityGrid& field, DVec3 position, Vec3 normal,
                                     const SmoothOcclusionOptions& options = {}, int level = 0);

/// Writes the occlusion of all positions: `out[i]` belongs to position i.
///
/// Order:    the same bits at any thread count and on any instruction set, independent of the other positions.
/// Cost:     for many positions per chunk, as in a mesh, twice the mesher's cost for spreads of 1 and 2, and the same
///           cost for other spreads.
/// Memory:   8 bytes per position and 2 MiB per thread.
/// Requires: as many normals as positions; `out` has at least as many elements; fewer than 2^32 positions.
/// Errors:   Cancelled; `out` is then partly written.
[[nodiscard]] Status smooth_occlusion(const DensityGrid& field, const SmoothSamples& samples,
                                      const SmoothOcclusionOptions& options, std::span<float> out, Threads threads = {},
                                      const Progress& progress = {});

/// Computes occlusion for one chunk and its neighbours, for meshers that go chunk by chunk. Holds about 2 MiB of
/// scratch memory: keep one per thread.
class SmoothOccluder {
 public:
  SmoothOccluder();
  SmoothOccluder(SmoothOccluder&&) noexcept;
  SmoothOccluder& operator=(SmoothOccluder&&) noexcept;
  ~SmoothOccluder();

  /// Writes the occlusion of all positions. `samples.origin` is relative to the centre chunk's sample (0, 0, 0).
  /// Positions can lie in the chunk and up to one cell (2^level samples) around it; positions farther away count as far
  /// air.
  /// Requires: as smooth_occlusion.
  /// Cost:     no allocation once the scratch memory has grown.
  void occlude(const DensityNeighbourhood& chunks, const SmoothSamples& samples, const SmoothOcclusionOptions& options,
               std::span<float> out);

 private:
  struct [[gnu::visibility("hidden")]] Scratch;
  std::unique_ptr<Scratch> scratch_;
};

}  // namespace quoin
