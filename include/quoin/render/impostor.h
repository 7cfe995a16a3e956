#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/trace/occupancy_tree.h>

namespace quoin {

/// Directions from which an impostor is seen: the faces +X -X +Y -Y +Z -Z; the edges, for a in {-1, 1}, for b in
/// {-1, 1}: (a,b,0), (a,0,b), (0,a,b); the corners, x outermost, then y, z, each -1 then 1.
inline constexpr int kImpostorViews = 26;

/// The unit vector from the content's centre towards a view's camera, in the grid's own frame.
/// Requires: 0 <= index < kImpostorViews.
[[nodiscard]] DVec3 impostor_view(int index);

/// The view whose direction has the largest dot product with `direction` (of any length), the first one on ties; at
/// most about 27.57 degrees away. None when `direction` is zero or not finite.
[[nodiscard]] std::optional<int> nearest_impostor_view(DVec3 direction);

class DensityTree;
struct ImpostorFaces;

struct ImpostorOptions {
  /// Texels a side of the snapshots; twice as many for grids that are wider than so many voxels. Requires: 16 to 1,024.
  int edge = 128;
};

/// The opaque surface of a grid and its field as 26 snapshots from all around see it, by which the grid is drawn where
/// it is small in the image.
///
/// Where a pixel spans few voxels, each face is drawn as it is. Where it spans many, the surface is drawn in cells of
/// 2, 4, 8, 16 or 32 voxels: each has 4^3 bits that say where in it the surface lies, and for each of the 26 views a
/// face that this view saw there. A ray is followed through the bits, which contain the whole surface, so there are no
/// holes; the bit that it meets is lit with the face of one of the three views around the direction to the camera. One
/// size of cells fades into the next as the distance grows, pixel by pixel; no image depends on the images before it.
/// Impostors hold types and not colours: the registry's colours at the time of drawing count. Transparent voxels are
/// left out; the renderer traces them.
///
/// The surface of a field is held in pieces of its tangent planes (surfels), one at each edge of the lattice of samples
/// that it crosses, with the normal of the traced surface.
///
/// Copies share what they hold. Memory: about 70 bytes per face.
/// Threads: any number may read at once.
/// Source: surfels of H. Pfister et al., "Surfels: surface elements as rendering primitives" (2000), taken from layered
///         views as there; shading chosen from views as C. Buehler et al., "Unstructured lumigraph rendering" (2001).
class Impostor {
 public:
  /// Of no grid.
  Impostor();

  /// Takes all snapshots, on the calling thread. Cost: some 10 ns for each face and view, and nine short rays a face;
  /// of grids with very many faces about 0.15 microseconds a covered texel.
  ///
  /// Requires: `opaque` is the grid's tree of opaque voxels, which is not checked; the grid is not edited meanwhile.
  [[nodiscard]] static Impostor build(const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque,
                                      const ImpostorOptions& options = {});
  /// The same, with a tree of its own.
  [[nodiscard]] static Impostor build(const Grid& grid, const VoxelRegistry& types,
                                      const ImpostorOptions& options = {});

  /// Of what is opaque of voxels and field. Cost: besides, two microseconds a piece of the field's surface, 10 ns for
  /// each view.
  [[nodiscard]] static Impostor build(const SceneGrid& grid, const VoxelRegistry& types,
                                      const ImpostorOptions& options = {});

  /// The impostor of the same grid after an edit: what `build` with the same options would give, bit by bit. Only
  /// texels and faces near what changed are looked at again, unless much changed, the content's sphere is another, or
  /// there are very many faces: then all are.
  ///
  /// Requires: this one was built of that grid or a snapshot of it, without a field, with types of the same visibility;
  ///           `changes` are those since. None of this is checked.
  /// Cost: some 20 ns a face, and what an edit can have changed.
  [[nodiscard]] Impostor rebuilt(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes) const;

  [[nodiscard]] const ImpostorOptions& options() const { return options_; }
  /// Around all voxels of the grid, transparent ones too, and its field.
  [[nodiscard]] const ContentSphere& content() const { return content_; }
  /// The smallest box of the grid around the opaque voxels and what is opaque of the field.
  [[nodiscard]] const IBox& bounds() const { return box_; }
  /// Whether it has no face: what is opaque of the grid is nothing, or left to rays.
  [[nodiscard]] bool empty() const { return box_.empty(); }
  /// It is empty and the grid is to be traced: it has a field with more faces than there are texels, or more than a
  /// quarter of whose surface is of what is at most three samples thick, which tangent planes do not show well.
  [[nodiscard]] bool is_left_to_rays() const { return is_left_to_rays_; }
  /// Bytes held, those that copies share too.
  [[nodiscard]] std::size_t bytes() const;

 private:
  friend struct ImpostorFaces;
  static Impostor build(const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque,
                        const DensityTree* field, const IBox& whole, const ImpostorOptions& options);

  ImpostorOptions options_;
  ContentSphere content_;
  IBox box_;
  bool is_left_to_rays_ = false;
  std::shared_ptr<const ImpostorFaces> faces_;
};

/// What one of the 26 views sees of a grid's opaque voxels, for textures and pictures of one's own: rows from the top.
struct ImpostorPicture {
  /// In the grid's frame, in voxels: 8 radii (of at least 1 voxel) from the content's centre, which it looks at; the
  /// content's sphere just fits the picture. Upright along the grid's +Y, along +X in views from straight above and
  /// below.
  Camera camera;
  Image colour;                        ///< the types' own colours, unlit; black where nothing is seen
  FloatImage depth;                    ///< voxels, Euclidean, from the camera; +infinity where nothing is seen
  std::vector<std::uint8_t> coverage;  ///< 255 where a voxel is seen, else 0: a black voxel is no hole
};

/// All 26, of `options.edge` texels a side; of a grid without opaque voxels they show nothing.
/// Cost: about 0.15 microseconds a texel that the content's box covers, on several threads.
[[nodiscard]] std::vector<ImpostorPicture> impostor_pictures(const Grid& grid, const VoxelRegistry& types,
                                                             const ImpostorOptions& options = {}, Threads threads = {});

/// An instance that is drawn by its grid's impostor. Lifetime: the impostor must outlive it.
struct FarInstance {
  InstanceHandle instance;
  const Impostor* impostor = nullptr;
};

/// Draws far instances into a picture that has been taken without them.
///
/// Each is drawn from the views nearest to the direction in which its own frame sees the camera, and every pixel's ray
/// is met with the faces that these saw, so that silhouettes, depth and roll are right between views. Light is that of
/// CpuRenderer, with shadows traced through all of `scene`; but where occlusion comes from rays, it is the share of
/// nine rays of 6 voxels from the face's middle that meet nothing of the grid; and lamps add nothing, nor does
/// propagated light.
///
/// Depth:    nearer than what the picture holds wins; among far instances at equal depth the lower handle. Pixels that
///           show nothing of an instance keep their colour and depth.
/// Left out: instances whose content's centre is at or behind the camera's plane or not finite, or whose content's
///           radius spans less than a pixel; those that `scene` does not hold or holds halved; what is transparent of
///           voxels and fields.
///
/// Requires: the camera and options are such that CpuRenderer accepts them, of LightModel::Rays; `picture` has
///           their size, and depth. One sample a pixel is taken, at its centre.
void draw_impostors(const SceneTracer& scene, std::span<const FarInstance> far, const Camera& camera,
                    const RenderOptions& options, Picture& picture, Threads threads = {});

}  // namespace quoin
