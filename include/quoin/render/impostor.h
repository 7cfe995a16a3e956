#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>
#include <quoin/trace/occupancy_tree.h>

namespace [[gnu::visibility("default")]] quoin {

/// Number of view directions of an impostor. The views are, in this order:
///
/// Faces:   +X -X +Y -Y +Z -Z.
/// Edges:   for a in {-1, 1}, for b in {-1, 1}: (a,b,0), (a,0,b), (0,a,b).
/// Corners: x outermost, then y, then z; each -1, then 1.
inline constexpr int kImpostorViews = 26;

class DensityTree;
struct [[gnu::visibility("hidden")]] ImpostorFaces;

struct ImpostorOptions {
  /// Texels per side of a view; doubled for grids wider than this number of voxels. Requires: 16 to 1,024.
  int edge = 128;
};

/// A compact representation of a grid's opaque surface (voxels, shapes and field), made from 26 rendered views.
/// Renderers draw it in place of the grid where the grid is small in the image.
///
/// Each face is drawn as it is where a pixel spans few voxels. Where a pixel spans many voxels, the surface is drawn in
/// cells of 2, 4, 8, 16 or 32 voxels. A cell has 4^3 bits that mark the surface inside the cell. For each of the 26
/// views, it also has a face that the view sees there. A ray steps through the bits; because they contain the whole
/// surface, there are no holes. The bit that the ray hits is lit with the face of one of the three views around the
/// direction to the camera. As the distance grows, one cell size fades into the next, pixel by pixel; no image depends
/// on earlier images. Impostors hold types, not colours: drawing uses the registry's current colours. Transparent
/// voxels are left out; the renderer traces them.
///
/// Sides of shapes are stored as rectangles of their own sizes and slopes. Sides with cutouts become several
/// rectangles, in sixteenths of a voxel. They show the means of their textures. Sides of glass are left out like
/// transparent voxels.
///
/// A field's surface is stored as pieces of its tangent planes (surfels), one per crossed edge of the sample lattice,
/// with the normal of the traced surface.
///
/// Copies share their data.
///
/// Memory:  about 70 bytes per face.
/// Threads: any number can read at once.
/// Source:  surfels as in H. Pfister et al., "Surfels: surface elements as rendering primitives" (2000), also sampled
///          from layered views; view-dependent shading as in C. Buehler et al., "Unstructured lumigraph rendering"
///          (2001).
class Impostor {
 public:
  /// Creates an impostor without a grid.
  Impostor();

  /// Renders all views on the calling thread.
  ///
  /// Requires: `opaque` is the grid's tree of opaque voxels (not checked); the grid is not edited during the call.
  /// Cost:     about 10 ns per face and view plus nine short rays per face; for grids with very many faces about 0.15
  ///           microseconds per covered texel.
  [[nodiscard]] static Impostor build(const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque,
                                      const ImpostorOptions& options = {});
  /// Renders all views. Builds the tree of opaque voxels itself.
  [[nodiscard]] static Impostor build(const Grid& grid, const VoxelRegistry& types,
                                      const ImpostorOptions& options = {});

  /// Renders all views of the opaque voxels, the shapes and the field.
  /// Cost: as above, plus two microseconds per surfel of the field and 10 ns per surfel and view.
  [[nodiscard]] static Impostor build(const SceneGrid& grid, const VoxelRegistry& types,
                                      const ImpostorOptions& options = {});

  /// Returns the impostor of the same grid after an edit, bit for bit as `build` with the same options returns it.
  /// Processes only texels and faces near the changes, unless much has changed, the content's sphere is different or
  /// there are very many faces; then it processes all.
  ///
  /// Requires: this impostor was built from the grid or a snapshot of it, without a field, with types of the same
  ///           visibility and shapes; `changes` are all changes since, and no shape has another state. Only fields are
  ///           checked for. Grids with shapes are processed whole.
  /// Cost:     about 20 ns per face, plus the parts that the edit can affect.
  [[nodiscard]] Impostor rebuilt(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes) const;

  [[nodiscard]] const ImpostorOptions& options() const { return options_; }
  /// Returns the sphere around all voxels of the grid, including transparent voxels, its shapes, which may reach out of
  /// their voxels, and its field.
  [[nodiscard]] const ContentSphere& content() const { return content_; }
  /// Returns the smallest box of the grid around the opaque voxels, the voxels that shapes touch and the opaque part of
  /// the field.
  [[nodiscard]] const IBox& bounds() const { return box_; }
  /// Returns true if the impostor has no face: the grid has no opaque surface, or must_be_traced() is true.
  [[nodiscard]] bool empty() const { return box_.empty(); }
  /// Returns true if the impostor is empty because the grid must be traced instead. This is the case for a field with
  /// more faces than texels, and for a field with more than a quarter of its surface on features at most three samples
  /// thick, because tangent planes show thin features badly.
  [[nodiscard]] bool must_be_traced() const { return must_be_traced_; }
  /// Returns the bytes held, including bytes shared with copies.
  [[nodiscard]] std::size_t bytes() const;

  // For Quoin's own sources.
  [[nodiscard]] const ImpostorFaces& faces() const { return *faces_; }

 private:
  static Impostor build(const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque,
                        const DensityTree* field, const IBox& whole, const ImpostorOptions& options);

  ImpostorOptions options_;
  ContentSphere content_;
  IBox box_;
  bool must_be_traced_ = false;
  std::shared_ptr<const ImpostorFaces> faces_;
};

/// One of the 26 views of a grid's opaque voxels and shapes, for custom textures and images. Rows start at the top.
struct ImpostorImage {
  /// Camera in grid coordinates, in voxels: 8 radii (radius of at least 1 voxel) from the content's centre, which it
  /// looks at. The content's sphere exactly fits the image. The image's up direction is the grid's +Y, or +X in the
  /// views from directly above and below.
  Camera camera;
  Image colour;  ///< the types' own colours (sides of shapes: means of their textures), unlit; black where no voxel is
                 ///< visible
  /// Distance from the camera in voxels; +infinity where no voxel is visible.
  FloatImage depth;
  /// 255 if a voxel is visible, else 0. Distinguishes black voxels from holes.
  std::vector<std::uint8_t> coverage;
};

/// Renders all 26 views, `options.edge` texels per side. For a grid without opaque voxels the images are empty.
/// Cost: about 0.15 microseconds per texel that the content's box covers, on several threads.
[[nodiscard]] std::vector<ImpostorImage> impostor_images(const Grid& grid, const VoxelRegistry& types,
                                                         const ImpostorOptions& options = {}, Threads threads = {});

}  // namespace quoin
