#pragma once

#include <array>
#include <cstddef>
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

namespace [[gnu::visibility("default")]] quoin {

/// Linear colour, 16 bits per channel: 65,535 is 1. Eight bits would show banding in dark colours.
using LinearRgba16 = std::array<std::uint16_t, 4>;
/// Converts an sRGB colour to linear light. Alpha is linear already.
[[nodiscard]] LinearRgba16 linear_colour_of(Rgba8 colour);

/// The materials of a vertex and their weights: those of the samples whose mean colour is its albedo, at most the four
/// most frequent. Neighbouring chunks give the vertices that they share equal materials and weights.
struct VertexMaterials {
  static constexpr std::size_t kSlots = 4;
  std::array<VoxelType, kSlots> types{};       ///< ascending; slots without a material come last, with kAir
  std::array<std::uint8_t, kSlots> weights{};  ///< 255 in total; slots without a material have 0

  bool operator==(const VertexMaterials&) const = default;
};

/// A welded surface. The vertex arrays have one entry per vertex.
struct SmoothMesh {
  std::vector<Vec3> positions;   ///< the field's coordinates, in samples
  std::vector<Vec3> normals;     ///< unit length, towards the air
  std::vector<float> occlusion;  ///< 0 (open) to 1 (dark); empty with SmoothOcclusion::None
  /// Mean colour of the materials of the cell's solid samples, without occlusion. Coarse cells use only the solid
  /// samples next to the surface. Materials with textures count with the mean colours that these have on a surface of
  /// this normal (TriplanarRule).
  std::vector<LinearRgba16> albedo;
  std::vector<VoxelType> types;        ///< most frequent material of these samples; the lowest on ties
  std::vector<std::uint32_t> indices;  ///< three per triangle, counter-clockwise seen from the air
  /// For textures; empty without SmoothMeshOptions::materials. Graphics hardware needs them aligned: align_materials.
  std::vector<VertexMaterials> materials;
};

/// Selects how the materials of samples become surface colours.
enum class SurfaceColours : std::uint8_t {
  Blended,  ///< each vertex has the mean colour of the samples around it
  /// Each face has the colour of its solid sample, like a block. Vertices between colours are duplicated, once per
  /// colour.
  Sharp,
};

struct SmoothMeshOptions {
  SmoothOcclusionOptions occlusion{};
  bool split_sheets = true;  ///< as in SmoothOptions
  SurfaceColours colours = SurfaceColours::Blended;
  /// Blends between blocks and the smooth surface, 0 to 1. At 1 the mesh is the surface of the field. Lower values move
  /// each vertex towards the centre of its cell and each normal towards the normal of its face. At 0 the mesh is the
  /// block surface around the solid samples; blocks that touch only by an edge or corner are 1/256 apart, or joined by
  /// as much. Values out of range are clamped; NaN means 1.
  float smoothness = 1.0F;
  /// Keeps solids and gaps one sample thick at about that thickness and keeps slanted ones connected
  /// (`join_diagonals`). Without it they shrink to a third. Meant for fields made from voxels. Applies at level 0.
  bool keep_thin = false;
  /// Returns the level of detail of a chunk, 0 to kMaxSmoothLevel. Empty: 0 everywhere. Called once per chunk on the
  /// calling thread, also for neighbours that do not exist.
  std::function<int(IVec3 chunk)> level_of{};
  bool materials = false;  ///< fills SmoothMesh::materials
};

/// Meshes a whole field, chunk by chunk, and welds the chunk meshes.
///
/// Closed: every edge has an even number of triangles at any mix of levels; exactly two with `split_sheets` and a
///         single level. Vertices duplicated for colours or normals count as one.
/// Space:  the field's coordinates. Beyond 2^24 samples from the origin, floats cannot represent whole samples.
/// Order:  chunks as in DensityGrid::chunks; the same bytes at any thread count.
/// Types:  unregistered materials and air count as opaque white.
/// Errors: Cancelled; LimitExceeded if the mesh needs more than 2^32 - 2 vertices; InvalidArgument for a level out of
///         range.
[[nodiscard]] Result<SmoothMesh> build_smooth_mesh(const DensityGrid& field, const VoxelRegistry& types,
                                                   const SmoothMeshOptions& options = {}, Threads threads = {},
                                                   const Progress& progress = {});

/// Simplifies a mesh: removes triangles while the surface moves by at most `error_in_samples`, drops unused vertices
/// and orders the rest for GPU vertex caches. Returns the error reached, which is at most the error allowed.
///
/// Error:    the greatest distance, in samples, of an original vertex from the simplified surface. It is measured,
///           because meshoptimizer bounds only a mean. If an attempt exceeds the limit, fewer triangles are removed.
///           The search ends with an attempt that exceeds the limit and removes at most one triangle in 1,000.
/// Large:    a mesh of 48,000 triangles or more is first simplified on a sample: at least 16 boxes with about 12,000
///           triangles. If the sample loses at most 1 % of its triangles, the mesh stays as it is.
/// Kept:     remaining vertices keep normal, occlusion, albedo and type, and their position except as under Manifold.
///           Vertices of equal position that differ in these attributes count as one, so colour borders move by at most
///           the error. A closed mesh stays closed.
/// Manifold: every edge of a closed mesh keeps two triangles; if the error is above 0, also after welding by position.
///           If removal brings parts of the surface together, their vertices are moved a thousandth of a sample
///           apart.
/// Order:    the same bytes on every run.
/// Requires: vertex arrays of equal length (occlusion can be empty), valid indices, finite positions.
/// Errors:   InvalidArgument if the error is negative or NaN; Unsupported in builds without meshoptimizer. The mesh is
///           unchanged after an error.
/// Cost:     from a few microseconds to tens of microseconds per triangle, on one thread.
/// Source:   M. Garland, P. Heckbert, "Surface Simplification Using Quadric Error Metrics" (1997); meshoptimizer.
[[nodiscard]] Result<float> simplify_smooth_mesh(SmoothMesh& mesh, float error_in_samples);
/// As above. `tags`: one number per vertex, which stays with the vertex, or empty.
[[nodiscard]] Result<float> simplify_smooth_mesh(SmoothMesh& mesh, float error_in_samples,
                                                 std::vector<std::uint32_t>& tags);

/// Prepares the materials of a mesh for interpolation: afterwards the three vertices of each triangle have the same
/// types in the same slots, some with weight 0. Vertices between triangles of different materials are duplicated, with
/// equal positions, normals and weights. Call it after `simplify_smooth_mesh`. A mesh without materials stays as it is.
///
/// Many: where more than four materials meet in a triangle, it keeps the four with the greatest sums of weights (of
///       equal ones the lowest types). The weights of the others go to the heaviest one of their vertex that is kept,
///       or to the first one.
/// Cost: O(vertices + triangles).
void align_materials(SmoothMesh& mesh);

/// Returns true if this build can simplify (has meshoptimizer).
[[nodiscard]] bool can_simplify();

}  // namespace quoin
