#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/smooth.h>

namespace quoin {

/// Linear light, 16 bits a channel: 65,535 is 1. Eight bits would be visibly off in the darks.
using LinearRgba16 = std::array<std::uint16_t, 4>;

/// One welded surface. The vertex arrays have one entry a vertex.
struct SmoothMesh {
  std::vector<Vec3> positions;         ///< the field's coordinates, in samples
  std::vector<Vec3> normals;           ///< unit, into the air
  std::vector<float> occlusion;        ///< 0 (open) to 1 (dark); empty without occlusion
  std::vector<LinearRgba16> albedo;    ///< mean of the materials of the cell's solid samples (of coarse cells: of those
                                       ///< next to the surface), without occlusion
  std::vector<VoxelType> types;        ///< the material of most of these samples; of several, the least
  std::vector<std::uint32_t> indices;  ///< three a triangle, counter-clockwise seen from the air
};

/// How the materials of samples become the colours of a surface.
enum class SurfaceColours : std::uint8_t {
  Blended,  ///< each vertex has the mean of those around it
  Sharp,  ///< each face has that of its solid sample, as a block's; vertices between colours stand there once for each
};

struct SmoothMeshOptions {
  SmoothOcclusionOptions occlusion{};
  bool split_sheets = true;  ///< as in SmoothOptions
  SurfaceColours colours = SurfaceColours::Blended;
  /// 1: the surface of the field. Less draws each vertex to the middle of its cell, and each normal to that of its
  /// face, until at 0 the surface is that of blocks around the solid samples (which are 1/256 apart, or as much
  /// connected, where they touch by edges or corners). 0 to 1; others count as the nearest of these, NaN as 1.
  float smoothness = 1.0F;
  /// Whether what is one sample thick, solid or gap, keeps about that thickness, and what is slanted holds together
  /// (`join_diagonals`): surfaces of fields shrink it to a third. For fields of voxels. At level 0.
  bool keep_thin = false;
  /// The level of detail of a chunk, 0 to kMaxSmoothLevel; empty: 0 everywhere. Asked once a chunk, from the calling
  /// thread, also for neighbours that do not exist.
  std::function<int(IVec3 chunk)> level_of{};
};

/// Meshes a whole field, chunk by chunk, and welds the chunks' meshes.
///
/// Closed:  every edge has an even number of triangles (two, with `split_sheets` and one level), whatever the levels;
///          vertices that stand there several times, for colours or normals, counted as one.
/// Space:   the field's coordinates; beyond 2^24 samples from the origin floats lose whole samples.
/// Order:   chunks as in DensityGrid::chunks; the same bytes at any thread count.
/// Types:   materials that are not registered, and air, count as opaque white.
/// Errors:  Cancelled; LimitExceeded when it takes more than 2^32 - 2 vertices; InvalidArgument for a level out of
///          range.
[[nodiscard]] Result<SmoothMesh> build_smooth_mesh(const DensityGrid& field, const VoxelRegistry& types,
                                                   const SmoothMeshOptions& options = {}, Threads threads = {},
                                                   const Progress& progress = {});

/// Removes triangles where that moves the surface by at most `error_in_samples`, drops vertices that nothing uses any
/// more, and orders what is left for the caches of graphics processors. Returns the error reached, at most the one
/// allowed.
///
/// Error:    the greatest distance, in samples, of a vertex of the mesh before from the surface after. It is measured;
///           where meshoptimizer, which bounds a mean, goes beyond it, less is removed. A try that goes beyond it and
///           removes no more than one triangle in 1,000 ends the search.
/// Large:    a mesh of 48,000 triangles or more is searched on a sample first: at least 16 boxes of it, with about
///           12,000 triangles. If the sample loses no more than 1 % of its triangles, nothing is removed.
/// Kept:     vertices that stay keep normal, occlusion, albedo and type, and their position, but for those below.
///           Vertices of one place that differ in these count as one: lines between colours stay where they are, to the
///           error. A closed mesh stays closed.
/// Manifold: every edge of what was closed has two triangles, by places too if the error is above 0. Where removing
///           brings parts of the surface together, the vertices there are drawn a thousandth of a sample apart.
/// Order:    the same bytes on every run.
/// Requires: arrays of one length (but for empty occlusion), indices that name vertices, finite positions.
/// Errors:   InvalidArgument when the error is not a number of at least 0; Unsupported in builds without meshoptimizer.
///           The mesh is as before then.
/// Cost:     some to some tens of microseconds a triangle, on one thread.
/// Source:   M. Garland, P. Heckbert, "Surface Simplification Using Quadric Error Metrics" (1997); meshoptimizer.
[[nodiscard]] Result<float> simplify_smooth_mesh(SmoothMesh& mesh, float error_in_samples);

/// Whether this build can simplify.
[[nodiscard]] bool can_simplify();

}  // namespace quoin
