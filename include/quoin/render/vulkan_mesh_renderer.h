#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/render/chunk_surface.h>
#include <quoin/render/light_options.h>
#include <quoin/render/vulkan_image.h>
#include <quoin/render/vulkan_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/environment.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

enum class Wireframe : std::uint8_t {
  Off,
  /// Triangle edges over the surfaces: dark, but light on surfaces that are nearly black.
  Over,
  Only,  ///< edges only, including hidden edges
};

struct MeshImageOptions {
  int width = 1280;
  int height = 720;
  /// Coverage samples per pixel: 1, 2, 4 or 8; rounded down to a number that the device supports.
  int samples = 4;
  /// `occlusion_rays` has no effect here: every mode except Off uses the occlusion of the meshes' vertices.
  LightOptions light{};
  std::optional<Environment> environment{};  ///< replaces the scene's environment
  /// Mid: meshes of halved grids, built when an image first shows them; blocky or smooth as the full grid's meshes, or
  ///      blocky if it has none.
  /// Far: the faces of an impostor.
  DetailOptions detail{};
  /// Draws glass as in ray-marched images: rays through the VulkanRenderer's voxels find all transparent bodies behind
  /// the nearest face. If false, glass is cheaper and needs no voxels: each blocky face counts as a body one voxel
  /// thick without reflections, drawn back to front; of smooth bodies only the nearest is drawn, as one voxel thick
  /// with reflections.
  bool glass_by_rays = true;
  Wireframe wireframe = Wireframe::Off;
};

/// Draws chunk meshes by rasterisation on the device of a VulkanRenderer. A quad of a blocky mesh takes 8 bytes of
/// device memory; the vertex shader computes its corners.
///
/// Equal:    a blocky mesh equals CpuRenderer's image with `OcclusionMode::Vertex` to 2 of 255, except at silhouettes
///           and shadow edges; also glass with `glass_by_rays`. Walls of smooth glass bodies are equal to 4, away from
///           their edges. Light brighter than white counts as white behind glass. There is no inside view: only faces
///           towards the camera are drawn. Textures are sampled once per pixel and face, at any number of samples.
/// Shapes:   a visible face takes 8 bytes of device memory, and each different face of a chunk's models 112. Occlusion
///           is that of the mesh, also inside of voxels, where CpuRenderer has none with `OcclusionMode::Vertex`.
/// Cutouts:  texels that are not visible show the background. Both sides of cutout faces are drawn; the inner one has
///           the occlusion of the outer one. Rays meet the same texels.
/// Light:    rays from each visible point through the VulkanRenderer's voxels, at the image's level of detail, find
///           shadows and lamp light. Everything that casts shadows in that renderer also casts them here, drawn or not.
///           Rays from smooth surfaces start one voxel in front of the surface. Glass tints sunlight separately per
///           grid. LightModel::Propagated uses the light of the same voxels, without rays.
/// Detail:   far instances are drawn as impostors, except where all chunk meshes are loaded and have fewer quads than
///           the impostor has faces. Transparent parts come from the meshes (in smooth meshes, from the voxel faces).
///           An instance is drawn halved until its impostor is ready. Fields are drawn from their meshes, whose levels
///           LiveMeshes chooses.
/// Glass:    with `glass_by_rays`, rays continue from the nearest fragment of each pixel through the bodies of the
///           renderer's voxels, so no sorting is needed. Surfaces behind the first surface of a smooth body have the
///           orientation of its voxels, blurred. Without rays, quads are sorted by the distance of their centres, so
///           large merged quads close to each other can be drawn in the wrong order; above 1,048,576 quads per image,
///           only chunks are sorted. Translucent texels are shown without rays; with them, cubes have their mean
///           colour. Fields are always opaque. Glass is opaque if Shading is Occlusion or Normals.
/// Far:      geometry is made relative to the camera in double precision, as in CpuRenderer. The near plane is at
///           1/1024 of a voxel.
/// Lifetime: the VulkanRenderer passed to `create` must outlive it.
/// Threads:  as the VulkanRenderer: one at a time.
/// Errors:   as the VulkanRenderer.
class VulkanMeshRenderer {
 public:
  /// Creates a mesh renderer. Errors: Unsupported if the device's queue cannot draw triangles.
  [[nodiscard]] static Result<VulkanMeshRenderer> create(VulkanRenderer& renderer);
  VulkanMeshRenderer(VulkanMeshRenderer&&) noexcept;
  VulkanMeshRenderer& operator=(VulkanMeshRenderer&&) noexcept;
  ~VulkanMeshRenderer();

  /// Applies the scene's instances and types. Cost: O(instances + types).
  [[nodiscard]] Status update(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible);
  /// Uploads surfaces. If a chunk occurs several times, the last surface counts. Cost: the upload of whole chunks. For
  /// surfaces of LiveMeshes, a LiveMeshOptions::region_edge of 64 gives the fewest quads.
  /// Errors: also InvalidArgument if a surface's arrays are inconsistent; then no surface changes. After any other
  ///         error some surfaces may be new, and the rest are unchanged.
  [[nodiscard]] Status put(std::span<const SurfaceUpdate> surfaces);
  /// Removes all surfaces.
  void clear();

  /// Draws all surfaces into an image; `threads` compute levels of detail.
  ///
  /// Requires: with levels of detail, lamps or propagated light, the scene was not edited since the last update of this
  ///           renderer and of the VulkanRenderer (not checked).
  /// Errors:   also InvalidArgument for a size or sample count out of range, for an invalid camera (as in
  ///           CpuRenderer::render, and also linearly dependent axes), for an image of another renderer, and, if
  ///           shadows, lamps, propagated light, levels of detail or glass by rays are used, if the VulkanRenderer's
  ///           last update had another scene or filter. Unsupported for wireframes on a device without line drawing.
  ///           After a drawing error the image has no samples.
  [[nodiscard]] Status draw(VulkanImage& image, const Camera& camera, const MeshImageOptions& options = {},
                            Threads threads = {});

  struct Stats {
    std::size_t chunks = 0;      ///< chunks with a surface, including chunks of halved grids
    std::int64_t triangles = 0;  ///< in memory, each counted once
    /// Triangles of the last image, after culling chunks outside the view; includes impostors.
    std::int64_t drawn_triangles = 0;
    std::size_t bytes = 0;  ///< device memory of the surfaces
  };
  [[nodiscard]] Stats stats() const;

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  explicit VulkanMeshRenderer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
