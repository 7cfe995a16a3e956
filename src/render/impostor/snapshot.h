#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/impostor.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/trace/occupancy_tree.h>
#include <quoin/trace/packet.h>

#include "render/impostor/raster/impostor_faces.h"
#include "scene/tracer/shape_rays.h"
#include "scene/tracer/tree_cache.h"

namespace quoin {

/// The opaque voxels and shapes of a grid, for rays in its space. Lifetime: owns nothing.
struct SolidVoxels {
  const Grid* grid = nullptr;
  const VoxelRegistry* types = nullptr;
  const OccupancyTree* opaque = nullptr;
  const TracedShapes* shapes = nullptr;  ///< null if there are none

  /// Returns a box around the opaque voxels and the voxels that shapes touch.
  [[nodiscard]] IBox bounds() const {
    return shapes == nullptr ? opaque->bounds() : unite(opaque->bounds(), shapes->touched.bounds());
  }
  /// As `first_solids`, which see; also without shapes.
  std::uint32_t first_hits(const RayPacket& rays, PacketHits& hits, RayPacket::Lanes<ShapeHit>& in_shapes) const {
    if (shapes != nullptr) return first_solids(*shapes, *grid, *types, rays, hits, in_shapes);
    quoin::first_hits(*opaque, rays, hits);
    return 0;
  }
  /// Returns the rays that hit anything.
  [[nodiscard]] std::uint32_t any_hits(const RayPacket& rays) const {
    if (shapes == nullptr) return quoin::any_hits(*opaque, rays);
    std::uint32_t blocked = 0;
    any_solids(*shapes, *opaque, *grid, *types, std::span(&rays, 1), std::span(&blocked, 1));
    return blocked;
  }
};

/// Returns the unit vector from the content's centre towards a view's camera, in grid coordinates.
/// Requires: 0 <= index < kImpostorViews.
[[nodiscard]] DVec3 impostor_view(int index);

/// Returns the view with the largest dot product with `direction` (any length); the first on ties. It is at most about
/// 27.57 degrees away. Empty if `direction` is zero or not finite.
[[nodiscard]] std::optional<int> nearest_impostor_view(DVec3 direction);

/// The camera of a snapshot, in the grid's frame: a pinhole at `position` that looks at the content's centre.
struct SnapshotCamera {
  DVec3 position{0.0};
  DVec3 right{1.0, 0.0, 0.0};
  DVec3 up{0.0, 1.0, 0.0};
  DVec3 forward{0.0, 0.0, -1.0};
  double focal = 1.0;     ///< in texels: the content's sphere just fits the snapshot
  double reach = 1.0;     ///< R: the radius of the content, at least 1 voxel
  double distance = 8.0;  ///< from the content's centre: 8 R

  /// Half the side of the square at the content's centre that the snapshot shows, in voxels.
  [[nodiscard]] double half_size() const;
};

/// Returns the camera of a view. Up is the grid's +Y, or its +X if the view is within 8 degrees of the Y axis.
[[nodiscard]] SnapshotCamera snapshot_camera(const ContentSphere& content, int view, int edge);

/// One view of a grid's opaque voxels and shapes: the hit of each texel, rows from the top. A texel with type air hit
/// no voxel; its depth is infinite.
struct Snapshot {
  SnapshotCamera camera;
  int edge = 0;                                  ///< texels per side
  std::vector<VoxelType> types;                  ///< also coverage: distinguishes black voxels from holes
  std::vector<Direction> faces;                  ///< of the voxel seen
  std::vector<std::uint8_t> occlusion;           ///< interpolated from the corners of voxel faces: 0 open, 255 dark
  std::vector<float> depth;                      ///< voxels, Euclidean, from the snapshot's camera
  std::vector<ImpostorFaces::ShapeSide> shapes;  ///< the sides of shapes seen; empty if the grid has none
};

/// Requires: `solid.opaque` is the grid's tree of opaque voxels; 0 <= view < kImpostorViews; 1 <= edge <= 4096.
[[nodiscard]] Snapshot take_snapshot(const SolidVoxels& solid, int view, int edge = 128);

/// Texels of a snapshot, `right` and `bottom` exclusive.
struct TexelArea {
  int left = 0;
  int top = 0;
  int right = 0;
  int bottom = 0;
};

/// Returns the whole 4x4 blocks that contain a box in a snapshot of `edge` texels per side.
[[nodiscard]] TexelArea texels_of(const SnapshotCamera& camera, const IBox& box, int edge);

/// Returns the rays of a snapshot's 4x4 texels from (`column`, `row`); lane x + 4 y. Texels outside are inactive.
[[nodiscard]] RayPacket rays_of_texels(const SnapshotCamera& camera, int edge, int column, int row);

inline constexpr int kTexelBlock = 4;

}  // namespace quoin
