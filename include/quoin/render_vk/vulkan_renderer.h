#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render_vk/vulkan_device.h>
#include <quoin/render_vk/vulkan_picture.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// Of a renderer's blocks of device memory, where nothing else is said.
inline constexpr std::uint64_t kVulkanBlockBytes = std::uint64_t{64} << 20;

struct VulkanOptions {
  /// Of `vulkan_devices`, as `choose_vulkan_device` understands it.
  std::string device{};
  /// Voxels lie in blocks of device memory of this size, as many as it takes. Requires: at least 64 KiB.
  std::uint64_t block_bytes = kVulkanBlockBytes;
  /// Told what the validation layer says, which is then loaded: each message is a mistake in Quoin. May be called from
  /// any thread that uses the renderer.
  std::function<void(const std::string& message)> on_validation_message{};
};

/// What becomes of the samples that a picture has when more are drawn.
enum class Accumulation : std::uint8_t {
  Continue,  ///< new ones are added to them
  Restart,   ///< they are forgotten
};

/// Takes the pictures that CpuRenderer takes, on a graphics device: one of its own, or a program's.
///
/// Equal:   every option means the same but OcclusionMode::Smooth, which is Unsupported, and so does every error; a
///          channel of a pixel differs by 2 at most but at
///          silhouettes, where single precision can take a ray past another voxel: less than a pixel in a thousand,
///          unless whole rows of rays run within the faces of voxels. Counts of rays differ as little.
/// Detail:  grids are halved and impostors built on the processor, when a picture first asks for them, from the scene
///          of the last update: pictures with `DetailOptions::policy`, and the first with lamps or propagated
///          light, require that it is still there, unedited.
/// Device:  computes with 32-bit numbers, relative to the camera, and addresses memory by pointers; so what it needs is
///          Vulkan 1.2 with bufferDeviceAddress, and worlds are as large as its memory, whatever its limits to buffers.
/// Errors:  LimitExceeded when a memory is full; DeviceLost, after which a new renderer is needed; Unsupported for what
///          the driver refuses otherwise.
/// Lifetime: must outlive its pictures and mesh renderers; a borrowed device must outlive it, and the scene of the last
///          update the pictures that `Detail` speaks of.
/// Threads: one at a time.
class VulkanRenderer {
 public:
  /// Errors: Unsupported, saying what is missing: Vulkan in this build, its loader, a driver, a device of that number
  ///         or name, a feature of the device, the validation layer.
  [[nodiscard]] static Result<VulkanRenderer> create(const VulkanOptions& options = {});

  /// On a program's own device, beside which any number of renderers may stand. The renderer submits to `device.queue`,
  /// guarded by `device.with_queue`, and waits for what it submits, never for the whole device.
  ///
  /// Requires: instance and device were made as `vulkan_requirements` says; `block_bytes` as in VulkanOptions.
  /// Errors:   InvalidArgument when a handle is null or there is no such queue family; Unsupported as above.
  [[nodiscard]] static Result<VulkanRenderer> create(const BorrowedVulkanDevice& device,
                                                     std::uint64_t block_bytes = kVulkanBlockBytes);
  VulkanRenderer(VulkanRenderer&&) noexcept;
  VulkanRenderer& operator=(VulkanRenderer&&) noexcept;
  ~VulkanRenderer();

  [[nodiscard]] const VulkanDeviceInfo& device() const;

  /// Has the device draw `scene` from now on, as it is now; nothing of it is needed afterwards but for levels of detail
  /// (see above). Draws the instances that `filter` lets pass.
  ///
  /// What changed the journals of the scene and its grids tell; it may be another scene each time.
  /// Cost:   the first time O(chunks); then O(chunks of edited grids), and uploads of the chunks that were edited.
  /// Errors: as above, and Unsupported for grids that span more than 2^29 voxels; then the device holds nothing.
  /// Memory: of a field 700 bytes for each 4^3 cells at its surface, beside its tree.
  [[nodiscard]] Status update(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible,
                              Threads threads = {});
  /// As CpuRenderer::use_light; also of the renderer's VulkanMeshRenderers.
  void use_light(const SceneLight* light);
  /// Bytes that the last `update` sent to the device.
  [[nodiscard]] std::uint64_t uploaded_bytes() const;

  /// One picture, as CpuRenderer::render; `threads` are for what detail needs.
  [[nodiscard]] Result<Picture> render(const Camera& camera, const RenderOptions& options = {}, Threads threads = {},
                                       const Progress& progress = {});

  /// Draws into a picture that stays on the device: adds `options.samples` samples a pixel to those that it has, or
  /// begins it anew, with Accumulation::Restart, if the size is another, or if what it shows was not drawn by this.
  /// Sample after sample it becomes the picture that `render` takes with as many; after an error, Cancelled too, it has
  /// none.
  ///
  /// Requires: unless it begins anew, camera, light and scene are those of its other samples; of the scene this is not
  ///           checked.
  /// Errors:   those of `render`, LimitExceeded for more than 4,096 samples, and InvalidArgument for a picture of
  ///           another renderer; `options.depth` means nothing.
  [[nodiscard]] Status draw(VulkanPicture& picture, const Camera& camera, const RenderOptions& options,
                            Accumulation accumulation, Threads threads = {}, const Progress& progress = {});

  /// One picture by paths, as PathTracer::render, of the scene of the last `update`, which must still be there,
  /// unedited, since faces that glow are found in it.
  ///
  /// Equal:  the same paths: they have the same random numbers, and part only where single precision takes one past
  ///         another voxel. So a picture has the processor's light and the processor's noise, but for such paths.
  /// Errors: those of PathTracer::render; those above.
  /// Memory: VulkanPathPicture's.
  [[nodiscard]] Result<PathPicture> render_paths(const Camera& camera, const PathOptions& options = {},
                                                 Threads threads = {}, const Progress& progress = {});

  /// Adds `options.samples` samples a pixel to those of a picture by paths, or begins it anew, with
  /// Accumulation::Restart, if the size is another, or after an error, Cancelled too.
  ///
  /// Requires: unless it begins anew, camera and options, but for the count of samples, are those of its other samples;
  ///           so is the scene, of which this is not checked.
  /// Errors:   those of `render_paths`; LimitExceeded for more than 65,536 samples, and InvalidArgument for a picture
  ///           of another renderer.
  [[nodiscard]] Status draw_paths(VulkanPathPicture& picture, const Camera& camera, const PathOptions& options,
                                  Accumulation accumulation, const Progress& progress = {});

 private:
  friend struct vulkan::Access;
  struct Impl;
  explicit VulkanRenderer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
