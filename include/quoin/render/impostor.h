#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene_tracer.h>

namespace quoin {

/// Directions from which an impostor is seen: the faces +X -X +Y -Y +Z -Z; the edges, for a in (-1, 1), for b in
/// (-1, 1): (a,b,0), (a,0,b), (0,a,b); the corners, x outermost, then y, z, each -1 then 1.
inline constexpr int kImpostorViews = 26;

/// The unit vector from the content's centre towards the snapshot's camera, in the grid's own frame.
/// Requires: 0 <= index < kImpostorViews.
[[nodiscard]] DVec3 impostor_view(int index);

/// The view whose direction has the largest dot product with `direction` (of any length), the first one on ties; at
/// most about 27.57 degrees away. None when `direction` is zero or not finite.
[[nodiscard]] std::optional<int> nearest_impostor_view(DVec3 direction);

/// From where a snapshot is taken, in the grid's frame: a pinhole at `position` that looks at the content's centre.
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

/// Upright along the grid's +Y; along its +X where the view is within 8 degrees of the Y axis.
[[nodiscard]] SnapshotCamera snapshot_camera(const ContentSphere& content, int view, int edge);

/// One view of a grid's opaque voxels: what each texel sees, rows from the top. A texel whose type is air saw nothing;
/// its depth is infinite.
struct Snapshot {
  SnapshotCamera camera;
  int edge = 0;                         ///< texels a side
  std::vector<VoxelType> types;         ///< coverage of its own: a black voxel is no hole
  std::vector<Direction> faces;         ///< of the voxel seen
  std::vector<std::uint8_t> occlusion;  ///< that a blocky mesh's vertices give there: 0 open, 255 dark
  std::vector<float> depth;             ///< voxels, Euclidean, from the snapshot's camera
};

/// Requires: `opaque` is the grid's tree of opaque voxels; 0 <= view < kImpostorViews; 1 <= edge <= 4096.
[[nodiscard]] Snapshot take_snapshot(const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque,
                                     int view, int edge = 128);

struct ImpostorFaces;

/// What 26 snapshots from all around see of a grid's opaque voxels, by which it is drawn where it is small in the
/// picture.
///
/// A texel of a snapshot knows exactly which face of which voxel it saw. An impostor holds these faces, each once, with
/// the views that saw it, and draws those that the views nearest to the camera's direction saw: as exact squares where
/// voxels are larger than texels, as squares of a texel's size where they are smaller. The texels of coarser snapshots,
/// each of half as many a side, are among those of the finest one, so their faces serve for grids that span fewer
/// pixels. Holds types and not colours: what the registry says of a type counts when it is drawn. Transparent voxels
/// are left out: whoever draws an impostor traces them besides.
/// Copies share what they hold. Memory: 36 bytes a face and 20 for each coarser size that shows it.
/// Threads: any number may read at once.
/// Source: surfels of H. Pfister et al., "Surfels: surface elements as rendering primitives" (2000), taken from layered
///         views as there, but of known shape.
class Impostor {
 public:
  static constexpr int kEdge = 128;  ///< texels a side of the finest snapshots; twice as many for larger grids

  /// Of no grid.
  Impostor();

  /// Takes all snapshots, on the calling thread. Cost: some 10 ns for each face and view, and nine short rays a face;
  /// of grids with very many faces about 0.15 microseconds a covered texel.
  ///
  /// Requires: `opaque` is the grid's tree of opaque voxels; the grid is not edited meanwhile.
  static Impostor build(const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque);
  /// The same, with a tree of its own.
  static Impostor build(const Grid& grid, const VoxelRegistry& types);

  /// Around all voxels of the grid, transparent ones too.
  [[nodiscard]] const ContentSphere& content() const { return content_; }
  /// Of the opaque voxels.
  [[nodiscard]] const IBox& box() const { return box_; }
  [[nodiscard]] bool is_empty() const { return box_.empty(); }
  [[nodiscard]] std::size_t bytes() const;
  [[nodiscard]] const ImpostorFaces& faces() const { return *faces_; }

 private:
  ContentSphere content_;
  IBox box_;
  std::shared_ptr<const ImpostorFaces> faces_;
};

/// An instance that is drawn by its grid's impostor.
struct FarInstance {
  InstanceHandle instance;
  const Impostor* impostor = nullptr;
};

/// Draws far instances into a picture that has been taken without them.
///
/// Each is drawn from the views nearest to the direction in which its own frame sees the camera, and every pixel's ray
/// is met with the faces that these saw, so that silhouettes, depth and roll are right between views. Light is that of
/// CpuRenderer, with shadows traced through all of `scene`; but where occlusion comes from rays, it is the share of
/// nine rays of 6 voxels from the face's middle that meet nothing of the grid.
///
/// Depth:    nearer than what the picture holds wins; among far instances at equal depth the lower handle. Pixels that
///           show nothing of an instance keep their colour and depth.
/// Left out: instances whose content's centre is at or behind the camera's plane or not finite, or whose content's
///           radius spans less than a pixel; those that `scene` does not hold or holds halved; transparent voxels.
///
/// Requires: the camera and options are such that CpuRenderer accepts them; `picture` has their size, and depth.
///           One sample a pixel is taken, at its centre.
void draw_impostors(const SceneTracer& scene, const VoxelRegistry& types, std::span<const FarInstance> far,
                    const Camera& camera, const RenderOptions& options, Picture& picture);

}  // namespace quoin
