#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include <quoin/core/memory.h>
#include <quoin/grid/density_grid.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/smooth.h>
#include <quoin/render/chunk_surface.h>
#include <quoin/render/propagated_light.h>
#include <quoin/scene/smooth_scene.h>

#include "mesh/surface/face_materials.h"
#include "render/chunks/voxel_densities.h"

namespace quoin {

/// The options of chunk surfaces, as in LiveMeshOptions.
struct ChunkSurfaceOptions {
  SurfaceStyle style = SurfaceStyle::Blocky;
  bool merge = true;
  ShapeUse shapes = ShapeUse::Faces;
  int region_edge = 64;
  LightMerging light_merging = LightMerging::Linear;
  SmoothOcclusionOptions occlusion{};
  SurfaceColours colours = SurfaceColours::Sharp;
  double detail_distance = std::numeric_limits<double>::infinity();

  bool operator==(const ChunkSurfaceOptions&) const = default;
};

using SurfaceClock = std::chrono::steady_clock;

/// The state of a field at one moment.
using FieldSnapshot = std::shared_ptr<const DensityGrid>;

/// The densities of single bodies, per chunk of a field; empty if nothing is transparent.
using FieldBodies = std::unordered_map<IVec3, std::shared_ptr<BodyChunks>, CoordinateHash>;

/// A grid's light at one moment, and the voxels that it was computed from.
struct LitVoxels {
  PropagatedLight light;
  Grid voxels;
};
using LightSnapshot = std::shared_ptr<const LitVoxels>;

/// The source of surfaces: the voxels or the field of a grid.
struct SurfaceKey {
  GridHandle grid;
  SurfaceContent content = SurfaceContent::Voxels;

  bool operator==(const SurfaceKey&) const = default;
  bool operator<(const SurfaceKey& other) const {
    return grid == other.grid ? content < other.content : grid < other.grid;
  }
};

/// A chunk to be meshed, with all inputs, and later its surface.
struct SurfaceJob {
  SurfaceKey source;
  IVec3 chunk{0};
  std::uint64_t serial = 0;
  double distance = 0.0;          ///< from the eye; the nearest job comes first
  bool is_in_epoch = false;       ///< of an edited chunk: its inputs must not change, and it comes before all others
  SurfaceClock::time_point seen;  ///< time of the edit

  GridSnapshot voxels;  ///< the grid; null for fields
  LightSnapshot light;  ///< blocky; null if no light is used
  std::shared_ptr<const VoxelRegistry> types;
  VoxelDensities densities;                           ///< smooth
  std::shared_ptr<const SurfaceMaterials> materials;  ///< smooth surfaces and fields
  /// Smooth: density stamps of the last surface. If the stamps match, meshing is skipped.
  std::optional<DensityStamps> last_stamps;
  std::uint64_t last_collected = 0;           ///< the job that made the last surface
  std::uint64_t type_generation = 0;          ///< generation of `types` and `materials`
  std::uint64_t data_generation = 0;          ///< smooth: VoxelChunk::data_generation when the job was made
  FieldSnapshot field;                        ///< fields only; uses `materials` too
  std::shared_ptr<const FieldBodies> bodies;  ///< bodies of `field`
  std::array<std::uint8_t, 27> levels{};      ///< fields: levels of detail, in neighbourhood order

  enum class Outcome : std::uint8_t { Meshed, AsBefore, OutOfMemory };
  Outcome outcome = Outcome::Meshed;
  std::shared_ptr<ChunkSurface> surface;  ///< null if there is no surface
};

/// Scratch memory that a worker keeps between chunks.
struct SurfaceWorkspace {
  std::optional<BlockyMesher> blocky;
  std::optional<SmoothMesher> smooth;
  QuadBuffer quads;
  QuadBuffer cut_quads;
  QuadBuffer lit_quads;
  BlockVector<FaceLight> face_light;  // of `lit_quads`
  ShapeFaceBuffer shapes;
  BlockVector<FaceLight> shape_light;  // of `shapes`
  LightSnapshot lit;                   // with the types
  std::shared_ptr<const VoxelRegistry> lit_types;
  std::optional<SurfaceLight> surface_light;  // of both; it remembers rows from chunk to chunk
  SmoothChunkMesh mesh;
};

/// Makes the surface of a job's chunk.
void make_chunk_surface(const ChunkSurfaceOptions& options, SurfaceJob& job, SurfaceWorkspace& workspace);

/// Returns the content that the surface of a job was made from. Requires: `make_chunk_surface` made it last with this
/// workspace. Lifetime: as the job and the workspace, until either is used again.
[[nodiscard]] SurfaceContext surface_context(const SurfaceJob& job, SurfaceWorkspace& workspace);

}  // namespace quoin
