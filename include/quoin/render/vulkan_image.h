#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/render/path_tracer.h>
#include <quoin/render/vulkan_device.h>

namespace [[gnu::visibility("default")]] quoin {

/// An application's VkImage, and the position in it to copy an image to (VulkanImage::record_copy).
///
/// Requires: a two-dimensional image with one sample per pixel, created with VK_IMAGE_USAGE_TRANSFER_DST_BIT on the
///           renderer's device, and owned by the queue family that runs the commands.
struct VulkanImageTarget {
  VulkanImageHandle image{};  ///< VkImage
  /// VkFormat, one of VK_FORMAT_R8G8B8A8_UNORM or _SRGB, VK_FORMAT_B8G8R8A8_UNORM or _SRGB. The copied bytes are sRGB
  /// in each of these formats.
  std::uint32_t format = 0;
  int width = 0;  ///< of the mip level, in pixels
  int height = 0;
  /// Pixel of the target for the upper left pixel of the copy. The copy must lie within the target.
  int x = 0;
  int y = 0;
  std::uint32_t mip_level = 0;
  std::uint32_t array_layer = 0;
  /// Current VkImageLayout. VK_IMAGE_LAYOUT_UNDEFINED (0): the other pixels may be discarded.
  std::uint32_t layout_before = 0;
  std::uint32_t layout_after = 0;  ///< VkImageLayout after the copy; not UNDEFINED or PREINITIALIZED
};

class VulkanRenderer;

/// An image in device memory. A renderer and its VulkanMeshRenderers draw into it. It can be copied to the images of a
/// Vulkan application, or read.
///
/// Lifetime: the renderer it was created for must outlive it.
/// Threads:  as the renderer: one at a time.
class VulkanImage {
 public:
  /// Creates an empty image. Drawing sets its size.
  explicit VulkanImage(VulkanRenderer& renderer);
  VulkanImage(VulkanImage&&) noexcept;
  VulkanImage& operator=(VulkanImage&&) noexcept;
  ~VulkanImage();

  [[nodiscard]] int width() const;
  [[nodiscard]] int height() const;
  [[nodiscard]] int samples() const;        ///< per pixel, so far; 0: the image is empty
  [[nodiscard]] std::int64_t rays() const;  ///< of every kind, for all samples so far
  [[nodiscard]] std::size_t bytes() const;  ///< device memory

  /// Reads the image back. Errors: InvalidArgument if the image is empty; otherwise as VulkanRenderer.
  [[nodiscard]] Result<Image> read() const;

  /// Uploads an image. Errors: InvalidArgument for an image without pixels; otherwise as VulkanRenderer.
  [[nodiscard]] Status write(const Image& image);

  /// Records a copy to an application's image into the application's own command buffer. The copy can stand between
  /// other commands; the application submits and synchronises the command buffer.
  ///
  /// Bytes:    copied unscaled and unconverted, with alpha 255. Pixels of the target outside the copy are kept unless
  ///           `target.layout_before` is UNDEFINED.
  /// Order:    the commands begin and end with barriers, which also change the layout. They run after all earlier
  ///           accesses to the target on that queue and before all later ones.
  /// Changes:  for B8G8R8A8, the bound compute pipeline and the push constants. The image then also keeps its bytes a
  ///           second time in device memory.
  /// Requires: `commands` is recording, outside a render pass, for the renderer's device and queue family. Until it has
  ///           run, do not draw, write or destroy the image or destroy its renderer.
  /// Cost:     recording: O(1); running: a copy of 4 bytes per pixel, two copies for B8G8R8A8.
  /// Errors:   InvalidArgument if the image is empty, a handle is null, the target has no size, the copy does not fit
  ///           in it or `layout_after` is invalid. Unsupported for other formats, naming the format. LimitExceeded if
  ///           memory is full. After an error no command is recorded.
  [[nodiscard]] Status record_copy(VkCommandBuffer_T* commands, const VulkanImageTarget& target) const;

  /// Copies to an application's image immediately, on the renderer's queue. Returns when the copy is complete.
  /// Requires: all submitted work that still uses the target went to that queue.
  /// Errors:   as record_copy and as VulkanRenderer.
  [[nodiscard]] Status copy_to(const VulkanImageTarget& target) const;

  // For Quoin's own sources.
  struct [[gnu::visibility("hidden")]] Impl;
  [[nodiscard]] Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// The accumulated samples of a path-traced image in device memory. Samples can be added over time, so that a view
/// converges while the user watches.
///
/// Memory:   80 bytes of device memory per pixel, 112 with layers, plus 180 with PathOptions::denoise.
/// Lifetime: the renderer it was created for must outlive it.
/// Threads:  as the renderer: one at a time.
class VulkanPathImage {
 public:
  /// Creates an empty image. VulkanRenderer::draw_paths sets its size.
  explicit VulkanPathImage(VulkanRenderer& renderer);
  VulkanPathImage(VulkanPathImage&&) noexcept;
  VulkanPathImage& operator=(VulkanPathImage&&) noexcept;
  ~VulkanPathImage();

  [[nodiscard]] int width() const;
  [[nodiscard]] int height() const;
  [[nodiscard]] int samples() const;        ///< per pixel, so far; 0: the image is empty
  [[nodiscard]] std::size_t bytes() const;  ///< device memory

  /// Returns the image of the samples so far, ready for `develop`. It equals PathTracer::render with as many samples.
  /// With PathOptions::denoise, this call removes the noise, on the CPU.
  ///
  /// Errors: InvalidArgument if the image is empty; otherwise as VulkanRenderer.
  [[nodiscard]] Result<PathImage> read(Threads threads = {}) const;

  // For Quoin's own sources.
  struct [[gnu::visibility("hidden")]] Impl;
  [[nodiscard]] Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
