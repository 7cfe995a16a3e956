#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/light/light_options.h>
#include <quoin/live/live_meshes.h>
#include <quoin/render_vk/vulkan_picture.h>
#include <quoin/render_vk/vulkan_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>

namespace quoin {

enum class Wireframe : std::uint8_t {
  Off,
  Over,  ///< the edges of triangles over the surfaces: dark, but on what is nearly black
  Only,  ///< the edges alone; hidden ones too
};

struct MeshPictureOptions {
  int width = 1280;
  int height = 720;
  int samples = 4;  ///< a pixel, of coverage: 1, 2, 4 or 8; the device's next lower number is taken
  /// `occlusion_rays` means nothing here: any occlusion but Off is that of the meshes' vertices.
  LightOptions light{};
  /// Mid: meshes of halved grids, made when a picture first shows them, blocky
  /// or smooth as those of the full grid that were put, else blocky; Far: the faces of an impostor.
  DetailOptions detail{};
  /// Whether glass is what marched pictures show: all that is transparent from the nearest face on, found by rays
  /// through the VulkanRenderer's voxels. Else each blocky face counts as a body one voxel thick without a surface,
  /// drawn from back to front, and of smooth bodies only the nearest is drawn, as one voxel thick with its surface:
  /// cheap, and without need of voxels.
  bool glass_by_rays = true;
  Wireframe wireframe = Wireframe::Off;
};

/// Draws chunks' meshes by rasterisation, on the device of a VulkanRenderer: a quad of a blocky mesh takes 8 bytes
/// there, and its corners are made when it is drawn.
///
/// Equal:  a blocky mesh is CpuRenderer's picture with `OcclusionMode::Vertex`, to 2 of 255, but at silhouettes and
///         edges of shadows; glass with `glass_by_rays`. Walls of smooth bodies of glass are the same to 4, away from
///         their edges. What is brighter than white counts as white behind glass. There is no inside: only faces that
///         look towards the camera are drawn.
/// Light:  shadows, and the light of lamps, are found by rays from what a pixel shows through the voxels that the
///         VulkanRenderer has, in the detail of the picture: whatever casts shadows there casts them here, drawn or
///         not. Those of smooth surfaces start one voxel before them. Glass tints the sun by each grid by itself.
///         LightModel::Propagated is of the same voxels, without rays.
/// Detail: of far instances the impostor is drawn, but where all chunks' meshes are there and have fewer quads than it
///         has faces, and of the meshes what is transparent; of a smooth one that is its voxels' faces. Until its
///         impostor is there an instance is drawn halved.
/// Glass:  by rays each pixel is seen through from its nearest fragment on, through the bodies that the renderer's
///         voxels make, so nothing is put in order. The surfaces behind a smooth body's first have the upright of the
///         voxels there, blurred. Face by face, quads are put in order by the distances of their middles, so large
///         merged ones that lie close may be drawn in the wrong one; of more than 1,048,576 in a picture only the
///         chunks are. Fields are opaque, whatever their types; and so is glass where values are shown.
/// Far:    what is drawn is made relative to the camera in double precision, as CpuRenderer does. What is nearer than
///         1/1024 of a voxel is cut off.
/// Lifetime: the renderer it was made for must outlive it.
/// Threads:  that renderer's.
/// Errors:   as there.
class VulkanMeshRenderer {
 public:
  /// Errors: Unsupported when the device's queue draws no triangles.
  [[nodiscard]] static Result<VulkanMeshRenderer> create(VulkanRenderer& renderer);
  VulkanMeshRenderer(VulkanMeshRenderer&&) noexcept;
  VulkanMeshRenderer& operator=(VulkanMeshRenderer&&) noexcept;
  ~VulkanMeshRenderer();

  /// Takes over instances and types. Cost: O(instances + types).
  [[nodiscard]] Status update(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible);
  /// Takes over surfaces; of one chunk the last. Cost: the upload of these.
  /// Errors: also InvalidArgument when a surface's arrays contradict each other; then nothing is changed. After another
  /// error some surfaces may have been taken over, and the others are what they were.
  [[nodiscard]] Status put(std::span<const SurfaceUpdate> surfaces);
  /// Forgets all surfaces.
  void clear();

  /// Draws all there is; `threads` are for what detail needs.
  ///
  /// Requires: with levels of detail, lamps or propagated light the scene was not edited since the last update of this
  ///           and of the VulkanRenderer; this is not checked.
  /// Errors:   also InvalidArgument for sizes and samples that cannot be, for cameras as CpuRenderer::render and those
  ///           whose axes lie in one plane, for a picture of another renderer, and with shadows, lamps, propagated
  ///           light, levels of detail or glass by rays, if there is any, when the VulkanRenderer was not last updated
  ///           with the same scene and filter; Unsupported for wireframes where the device has no lines. After an
  ///           error in drawing the picture has no samples.
  [[nodiscard]] Status draw(VulkanPicture& picture, const Camera& camera, const MeshPictureOptions& options = {},
                            Threads threads = {});

  struct Stats {
    std::size_t chunks = 0;            ///< with a surface, those of halved grids too
    std::int64_t triangles = 0;        ///< in memory, each once
    std::int64_t drawn_triangles = 0;  ///< of the last picture, after leaving out chunks beside it; impostors' too
    std::size_t bytes = 0;             ///< of surfaces, in device memory
  };
  [[nodiscard]] Stats stats() const;

 private:
  struct Impl;
  explicit VulkanMeshRenderer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
