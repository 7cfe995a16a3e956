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

namespace quoin {

/// Where the occlusion of a field is wanted: a position and a normal a place, in any order.
///
/// Normals point into the air. Those whose length is off 1 by more than about 0.0005 are made unit; those without a
/// direction (0, NaN, infinite) count as (0, 1, 0).
struct SmoothPlaces {
  std::span<const Vec3> positions;  ///< in samples of level 0, from `origin`
  std::span<const Vec3> normals;    ///< as many as positions
  IVec3 origin{0};                  ///< in samples; floats hold 1/65,536 of a sample up to 256 samples from here
  int level = 0;                    ///< of detail, 0 to kMaxSmoothLevel; others count as the nearest of these
};

/// How dark a field is at a place, for meshes of other makers: 0 (open) to 1 (dark), as SmoothChunkMesh::occlusion;
/// what of the light arrives is 1 minus that. 0 with SmoothOcclusion::None.
///
///            const float light = 1.0F - smooth_occlusion(field, vertex.position, vertex.normal);
///
/// Bits:      at a vertex' position, normal and level, to the bit what the mesher stores for it. Positions count in
///            whole 1/65,536 of a cell (2^level samples), as vertices do; fractions beyond are rounded.
/// Space:     the field's coordinates, in samples of level 0. A position that is NaN or outside the int32 range is far
///            air: 0, or as published offset^power.
/// Cost:      one or two microseconds; of many places ask for all at once.
[[nodiscard]] float smooth_occlusion(const DensityGrid& field, DVec3 position, Vec3 normal,
                                     const SmoothOcclusionOptions& options = {}, int level = 0);

/// The same of many places: `out[i]` is that of place i. `origin` is where positions of 0 lie in the field.
///
/// Order:     the same bits at any thread count, with any instruction set, whatever else is asked for.
/// Cost:      where many lie in a chunk, as in a mesh, twice what occlusion costs the mesher with spreads of 1 and 2,
///            the same with others. Memory: 8 bytes a place, and 2 MiB a thread.
/// Requires:  as many normals as positions, and room for as many in `out`; less than 2^32.
/// Errors:    Cancelled; some of `out` may be written then.
[[nodiscard]] Status smooth_occlusion(const DensityGrid& field, const SmoothPlaces& places,
                                      const SmoothOcclusionOptions& options, std::span<float> out, Threads threads = {},
                                      const Progress& progress = {});

/// The same of one chunk and its neighbours, for meshers that go chunk by chunk; holds scratch memory (about 2 MiB), so
/// keep one a thread.
class SmoothOccluder {
 public:
  SmoothOccluder();
  SmoothOccluder(SmoothOccluder&&) noexcept;
  SmoothOccluder& operator=(SmoothOccluder&&) noexcept;
  ~SmoothOccluder();

  /// `origin` is where positions of 0 lie, from the centre chunk's sample (0, 0, 0). Places may lie in the chunk and
  /// a cell (2^level samples) around it; those farther off count as far air.
  /// Requires: as smooth_occlusion. Cost: no allocation once it has grown.
  void occlude(const DensityNeighbourhood& chunks, const SmoothPlaces& places, const SmoothOcclusionOptions& options,
               std::span<float> out);

 private:
  struct Scratch;
  std::unique_ptr<Scratch> scratch_;
};

}  // namespace quoin
