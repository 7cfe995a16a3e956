#pragma once

#include <cstdint>
#include <memory>

#include <quoin/core/image.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/light/light_options.h>
#include <quoin/light/scene_light.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>

namespace quoin {

struct RenderOptions {
  int width = 1280;
  int height = 720;
  int samples = 1;     ///< a pixel, 1 to 4,096; spread by a fixed pattern that begins with the centre
  bool depth = false;  ///< whether Picture::depth is filled
  LightOptions light{};
  DetailOptions detail{};
};

struct Picture {
  Image colour;
  /// Euclidean distance along the ray through each pixel's centre in world units, to the first voxel of any kind,
  /// transparent ones too, or surface of a field; 0 inside of either; +infinity where nothing was hit. Empty unless
  /// asked for.
  FloatImage depth;
  std::int64_t rays = 0;        ///< of every kind
  std::int64_t pixels_hit = 0;  ///< whose centre shows a voxel or a field
};

/// Takes pictures of a scene by ray marching on the processor.
///
/// Light:       see LightOptions; computed linearly, each sample clamped to 0..1, averaged, and rounded to sRGB bytes
///              exactly. Behind the scene is a sky, which the exposure does not change, and the sun only with
///              LightOptions::sky_follows_sun.
/// Transparent: a run of voxels, or of a field's solid, of one type is one body, whatever chunks and grids it crosses.
///              It tints what is behind it by its length (one voxel of alpha a and colour c lets
///              (1 - a) (1 - a (1 - c)) through; none of voxels counts as less than one), shows its own lit colour for
///              what it covers, tints the sun's light and does not occlude. From inside it tints and glows, no more.
/// Solid:       from inside an opaque voxel everything is that voxel's own colour, unlit.
///
/// Holds the traversal structures of the scene's grids; build it once and take as many pictures as you like.
/// Lifetime: the scene must outlive it, in its place; after an edit of the scene `update` comes before anything else.
/// Threads:  any number may take pictures at once.
class CpuRenderer {
 public:
  /// Copies nothing of the voxels but what traversal and shading need. Draws the instances that `filter` lets pass.
  explicit CpuRenderer(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible, Threads threads = {});
  explicit CpuRenderer(Scene&&, InstanceFilter = InstanceFilter::Visible, Threads = {}) = delete;  // it must outlive it
  CpuRenderer(CpuRenderer&&) noexcept;
  CpuRenderer& operator=(CpuRenderer&&) noexcept;
  ~CpuRenderer();

  /// Takes over whatever was changed in the scene: instances, grids, and types in all their properties. Pictures are
  /// then those of a renderer that was built anew.
  ///
  /// Requires: no picture is being taken.
  /// Cost:     that of SceneTracer::update, and the types' colours. Impostors of edited grids are built anew when they
  ///           are needed.
  void update(Threads threads = {});

  /// Has pictures with LightModel::Propagated show light that the caller keeps, in place of light of its own;
  /// null: its own. Until `update` takes over what changed in the light, as in the scene, it stays as it is.
  /// Requires: no picture is being taken. Lifetime: the light must outlive the renderer, or its use.
  void use_light(const SceneLight* light);

  /// One picture. The same bytes for any number of threads and any instruction set.
  ///
  /// Requires: the camera's axes are perpendicular.
  /// Errors:   InvalidArgument when a size is not positive, there are more than 2^28 pixels, samples are out of range,
  ///           the camera's position is not finite, its axes are not of unit length, its angle or height is
  ///           impossible, or `check` refuses the light; Cancelled when `progress` returns false, which is asked after
  ///           every sample of a tile.
  [[nodiscard]] Result<Picture> render(const Camera& camera, const RenderOptions& options = {}, Threads threads = {},
                                       const Progress& progress = {}) const;

  /// What its rays go through, for queries (first_hit, pick) that shall see what pictures show. Out of date after an
  /// edit until `update`; not to be asked during one. Lifetime: that of the renderer; moving it leaves the tracer where
  /// it is.
  [[nodiscard]] const SceneTracer& tracer() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
