#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render_vk/vulkan_picture.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// A device that Vulkan offers.
struct VulkanDevice {
  std::string name;
  std::string kind;     ///< discrete, integrated, virtual, cpu or other
  std::string missing;  ///< what it lacks of what Quoin needs; empty: nothing
};

/// The devices of this machine, in Vulkan's order.
///
/// Errors: Unsupported when the library was built without Vulkan, when there is no loader, or no driver.
[[nodiscard]] Result<std::vector<VulkanDevice>> vulkan_devices();

/// A window that a device is to show pictures in, as a library for windows knows it.
struct VulkanSurface {
  std::vector<std::string> extensions;  ///< that the library wants of Vulkan's instance
  /// Makes the window's VkSurfaceKHR for a VkInstance; 0 where that fails. The renderer destroys it.
  std::function<std::uint64_t(void* instance)> make;
};

struct VulkanOptions {
  /// A number counts in `vulkan_devices`, anything else is a part of a name, in capitals or not. Empty: the first of
  /// the best kind (discrete, integrated, virtual, cpu, other) that lacks nothing.
  std::string device;
  /// Voxels lie in blocks of device memory of this size, as many as it takes. At least 64 KiB.
  std::uint64_t block_bytes = std::uint64_t{64} << 20;
  /// Told what the validation layer says, which is then loaded: each message is a mistake in Quoin. May be called from
  /// any thread that uses the renderer.
  std::function<void(const std::string& message)> on_validation_message;
  /// For VulkanWindow: only devices that can show pictures there will do. Without `make`, none.
  VulkanSurface surface;
};

/// Takes the pictures that CpuRenderer takes, on a graphics device.
///
/// Equal:   every option means the same, and so does every error; a channel of a pixel differs by 2 at most but at
///          silhouettes, where single precision can take a ray past another voxel: less than a pixel in a thousand,
///          unless whole rows of rays run within the faces of voxels. Counts of rays differ as little.
/// Detail:  grids are halved and impostors built on the processor, when a picture first asks for them, from the scene
///          of the last update: pictures with `RenderOptions::detail` require that it is still there, unedited.
/// Device:  computes with 32-bit numbers, relative to the camera, and addresses memory by pointers; so what it needs is
///          Vulkan 1.2 with bufferDeviceAddress, and worlds are as large as its memory, whatever its limits to buffers.
/// Errors:  LimitExceeded when a memory is full; Unsupported when the device was lost, after which a new renderer is
///          needed.
/// Threads: one at a time.
class VulkanRenderer {
 public:
  /// Errors: Unsupported, saying what is missing: Vulkan in this build, its loader, a driver, a device of that number
  ///         or name, a feature of the device, the validation layer.
  [[nodiscard]] static Result<VulkanRenderer> create(const VulkanOptions& options = {});
  VulkanRenderer(VulkanRenderer&&) noexcept;
  VulkanRenderer& operator=(VulkanRenderer&&) noexcept;
  ~VulkanRenderer();

  [[nodiscard]] const VulkanDevice& device() const;

  /// Has the device draw `scene` from now on, as it is now; nothing of it is needed afterwards but for levels of detail
  /// (see above). Draws the instances that `filter` lets pass.
  ///
  /// What changed the journals of the scene and its grids tell; it may be another scene each time.
  /// Cost:   the first time O(chunks); then O(chunks of edited grids), and uploads of the chunks that were edited.
  /// Errors: as above, and Unsupported for grids that span more than 2^29 voxels; then the device holds nothing.
  [[nodiscard]] Status update(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible,
                              Threads threads = {});
  /// Bytes that the last `update` sent to the device.
  [[nodiscard]] std::uint64_t uploaded_bytes() const;

  /// One picture, as CpuRenderer::render; `options.threads` are for what detail needs.
  [[nodiscard]] Result<Picture> render(const Camera& camera, const RenderOptions& options,
                                       const Progress& progress = {});

  /// Draws into a picture that stays on the device: adds `options.samples` samples a pixel to those that it has, or
  /// begins it anew where `is_new`, the size is another, or what it shows was not drawn by this. Sample after sample it
  /// becomes the picture that `render` takes with as many; after an error, Cancelled too, it has none.
  ///
  /// Requires: unless it begins anew, camera, light and scene are those of its other samples.
  /// Errors:   those of `render`, and LimitExceeded for more than 4,096 samples; `options.depth` means nothing.
  [[nodiscard]] Status draw(VulkanPicture& picture, const Camera& camera, const RenderOptions& options, bool is_new,
                            const Progress& progress = {});

  struct Impl;
  [[nodiscard]] Impl& impl() { return *impl_; }

 private:
  explicit VulkanRenderer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
