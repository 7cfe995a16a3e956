#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <quoin/core/image.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/render/light_options.h>
#include <quoin/render/propagated_light.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/environment.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>

namespace [[gnu::visibility("default")]] quoin {

struct RenderOptions {
  int width = 1280;
  int height = 720;
  int samples = 1;     ///< per pixel, 1 to 4,096; in a fixed pattern that starts with the pixel's centre
  bool depth = false;  ///< fill RenderedImage::depth
  LightOptions light{};
  std::optional<Environment> environment{};  ///< replaces the scene's environment
  DetailOptions detail{};
};

struct RenderedImage {
  Image colour;
  /// Distance in world units from the camera to the first voxel (also transparent) or field surface, along the ray
  /// through each pixel's centre. Clear texels of cutout faces count as air. 0 inside a voxel or field; +infinity where
  /// the ray hits nothing. Empty unless RenderOptions::depth is set.
  FloatImage depth;
  std::int64_t rays = 0;        ///< number of rays traced, of all kinds
  std::int64_t pixels_hit = 0;  ///< pixels whose centre shows a voxel or a field
};

/// Renders images of a scene by ray marching on the CPU.
///
/// Light:       see LightOptions and `environment_of`. Computed in linear space; each sample is clamped to 0..1, the
///              samples are averaged and rounded exactly to sRGB bytes. The background is a sky that the exposure does
///              not change. The sky shows no sun under SkyModel::Fixed.
/// Transparent: consecutive voxels (or field solid) of one transparent type along a ray form one body, also across
///              chunks and grids. A body tints the background by its length: one voxel of alpha a and colour c
///              transmits (1 - a) (1 - a (1 - c)). A body of voxels counts as at least one voxel long. It shows its own
///              lit colour in proportion to its coverage, tints sunlight and does not occlude. Seen from inside, it
///              only tints and emits.
/// Textures:    VoxelProperties::faces. A transparent type whose faces are all translucent is such a body, with the
///              colour and alpha of the texel where the ray enters it. Any other textured transparent type is a hollow
///              cell: rays of all kinds meet those of its faces that meshes show, and go on through invisible texels.
///              Visible texels of cutout and opaque faces are seen from both sides, cast shadows and occlude.
///              Translucent texels are seen from outside, and tint as one voxel of glass.
/// Solid:       if the camera is inside an opaque voxel, the whole image has the voxel's unlit colour.
///
/// Holds the acceleration structures of the scene's grids: build it once and render any number of images.
/// Lifetime: the scene must outlive the renderer and must not move. After an edit of the scene, call `update` before
///           any other function.
/// Threads:  any number can render at once.
class CpuRenderer {
 public:
  /// Builds the acceleration structures of the instances that `filter` accepts. Copies only the voxel data that
  /// traversal and shading need.
  explicit CpuRenderer(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible, Threads threads = {});
  /// Deleted because the scene must outlive the renderer.
  explicit CpuRenderer(Scene&&, InstanceFilter = InstanceFilter::Visible, Threads = {}) = delete;
  CpuRenderer(CpuRenderer&&) noexcept;
  CpuRenderer& operator=(CpuRenderer&&) noexcept;
  ~CpuRenderer();

  /// Applies all changes of the scene: instances, grids, and types with all their properties. Images are then the same
  /// as from a new renderer.
  ///
  /// Requires: no render call is in progress.
  /// Cost:     SceneTracer::update, plus the types' colours. Impostors of edited grids are rebuilt when they are next
  ///           needed.
  void update(Threads threads = {});

  /// Sets the light for images with LightModel::Propagated, in place of the renderer's own light. Null: the renderer's
  /// own light. Changes of the light, like changes of the scene, appear after the next `update`.
  /// Requires: no render call is in progress.
  /// Lifetime: the light must outlive the renderer, or stay valid until another call replaces it.
  void use_light(const SceneLight* light);

  /// Renders one image. The bytes are the same for any number of threads and any instruction set.
  ///
  /// Requires: the camera's axes are perpendicular.
  /// Errors:   InvalidArgument if a size is not positive, there are more than 2^28 pixels, samples are out of range,
  ///           the camera's position is not finite, its axes are not of unit length, its field of view or view height
  ///           is out of range, the impostor edge is not 16 to 1,024, the impostor time is NaN, or `check` rejects the
  ///           light or the environment. Cancelled if `progress` returns false; it is called after every sample of a
  ///           tile.
  [[nodiscard]] Result<RenderedImage> render(const Camera& camera, const RenderOptions& options = {},
                                             Threads threads = {}, const Progress& progress = {}) const;

  /// Returns the ray tracer of the renderer, for queries (first_hit, pick) that match its images. It is out of date
  /// between an edit and `update`, and must not be used during `update`.
  /// Lifetime: as the renderer; moving the renderer does not move the tracer.
  [[nodiscard]] const SceneTracer& tracer() const;

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  std::unique_ptr<Impl> impl_;
};

/// Plane through a scene, and image size.
struct DensitySliceOptions {
  int width = 1280;  ///< pixels
  int height = 720;
  int axis = 1;     ///< world axis perpendicular to the plane: 0 x, 1 y, 2 z
  double at = 0.5;  ///< position on the axis: 0 to 1 from the minimum to the maximum of the drawn fields' bounds
  InstanceFilter instances = InstanceFilter::Visible;
};

struct DensitySlice {
  Image colour;
  std::int64_t pixels_solid = 0;  ///< pixels in a field's solid
  double position = 0.0;          ///< of the plane on its axis, in world units
};

/// Draws the densities on a plane through a scene's fields as unlit colours. Solid runs from light orange at the
/// surface to brown at the end of the density band, air from light blue to dark blue. A dark line marks the
/// surface. Where a sample spans more than four pixels, faint lines mark each whole sample of distance. Overlapping
/// fields are combined by the lowest density in samples, which is their union.
///
/// View:   all fields' bounds, seen from the positive end of the axis: for y, x points right and z down; for z, x right
///         and y up; for x, -z right and y up.
/// Errors: InvalidArgument if a size is not positive, there are more than 2^28 pixels, `axis` is not 0 to 2, `at` is
///         not 0 to 1, or no drawn instance has a field with a solid.
/// Cost:   O(pixels * instances with fields). The bytes are the same at any thread count.
[[nodiscard]] Result<DensitySlice> draw_density_slice(const Scene& scene, const DensitySliceOptions& options = {},
                                                      Threads threads = {});

}  // namespace quoin
