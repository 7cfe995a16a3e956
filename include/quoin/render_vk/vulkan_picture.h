#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/render/path_tracer.h>
#include <quoin/render_vk/vulkan_device.h>

namespace quoin {

/// A VkImage of a program, as a picture is put into it (VulkanPicture::record_copy), and where.
///
/// The image is two-dimensional, of one sample, made with VK_IMAGE_USAGE_TRANSFER_DST_BIT on the renderer's device, and
/// belongs to the queue family that the commands run on.
struct VulkanImageTarget {
  VulkanImageHandle image{};  ///< VkImage
  /// VkFormat: VK_FORMAT_R8G8B8A8_UNORM or _SRGB, VK_FORMAT_B8G8R8A8_UNORM or _SRGB. Bytes are the picture's, which are
  /// sRGB, in each of them.
  std::uint32_t format = 0;
  int width = 0;  ///< of the mip level, in pixels
  int height = 0;
  int x = 0;  ///< the pixel that the picture's upper left one becomes; all of the picture lies in the image
  int y = 0;
  std::uint32_t mip_level = 0;
  std::uint32_t array_layer = 0;
  std::uint32_t layout_before = 0;  ///< VkImageLayout that it is in. VK_IMAGE_LAYOUT_UNDEFINED (0): all else may go
  std::uint32_t layout_after = 0;   ///< VkImageLayout that it is left in; not UNDEFINED or PREINITIALIZED
};

class VulkanRenderer;
namespace vulkan {
struct Access;
}

/// A picture that stays in device memory: drawn by one renderer and its VulkanMeshRenderers, put into images of a
/// program that draws by Vulkan, or read.
///
/// Lifetime: the renderer it was made for must outlive it.
/// Threads:  that renderer's.
class VulkanPicture {
 public:
  /// Of no size yet: whoever draws it decides.
  explicit VulkanPicture(VulkanRenderer& renderer);
  VulkanPicture(VulkanPicture&&) noexcept;
  VulkanPicture& operator=(VulkanPicture&&) noexcept;
  ~VulkanPicture();

  [[nodiscard]] int width() const;
  [[nodiscard]] int height() const;
  [[nodiscard]] int samples() const;        ///< a pixel, so far; 0: nothing is to be seen yet
  [[nodiscard]] std::int64_t rays() const;  ///< of every kind, for all samples so far
  [[nodiscard]] std::size_t bytes() const;  ///< of device memory

  /// Errors: InvalidArgument when nothing was drawn; those of VulkanRenderer.
  [[nodiscard]] Result<Image> read() const;

  /// Becomes a picture that was drawn elsewhere. Errors: InvalidArgument for one without pixels; those of
  /// VulkanRenderer.
  [[nodiscard]] Status write(const Image& image);

  /// Records into a program's own command buffer what puts the picture into a program's own image; so it can stand
  /// between whatever else the program draws, and whoever submits it says what is waited for.
  ///
  /// Bytes:    the picture's, with alpha 255; never scaled or converted. Pixels beside the picture keep theirs unless
  ///           `target.layout_before` is UNDEFINED.
  /// Order:    all that was done with the image before on that queue comes first, and all that follows comes after it:
  ///           the commands begin and end with barriers, which also change the layout.
  /// Changes:  for B8G8R8A8 the compute pipeline that is bound and the constants that are pushed; and the picture keeps
  ///           a second copy of its bytes in device memory from then on.
  /// Requires: `commands` is being recorded, outside of a render pass, for the renderer's device and queue family.
  ///           Until it has run, the picture is neither drawn, written nor destroyed, nor its renderer.
  /// Cost:     recording: O(1); running: a copy of 4 bytes a pixel, two for B8G8R8A8.
  /// Errors:   InvalidArgument when nothing was drawn, a handle is null, the image has no size, the picture does not
  ///           lie within it, or `layout_after` is none; Unsupported for other formats, naming the format;
  ///           LimitExceeded when a memory is full. After an error nothing was recorded.
  [[nodiscard]] Status record_copy(VkCommandBuffer_T* commands, const VulkanImageTarget& target) const;

  /// The same at once, on the renderer's queue: comes back when the image has the picture.
  /// Requires: what the program has submitted and still uses the image went to that queue.
  /// Errors:   as above, and those of VulkanRenderer.
  [[nodiscard]] Status copy_to(const VulkanImageTarget& target) const;

 private:
  friend struct vulkan::Access;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The samples of a picture by paths, which stay in device memory, so that more can be added to them: it converges
/// while one looks at it.
///
/// Memory:   80 bytes a pixel of the device's, 112 with layers, and 180 besides with PathOptions::denoise.
/// Lifetime: the renderer it was made for must outlive it.
/// Threads:  that renderer's.
class VulkanPathPicture {
 public:
  /// Of no size yet: VulkanRenderer::draw_paths decides.
  explicit VulkanPathPicture(VulkanRenderer& renderer);
  VulkanPathPicture(VulkanPathPicture&&) noexcept;
  VulkanPathPicture& operator=(VulkanPathPicture&&) noexcept;
  ~VulkanPathPicture();

  [[nodiscard]] int width() const;
  [[nodiscard]] int height() const;
  [[nodiscard]] int samples() const;        ///< a pixel, so far; 0: nothing is to be seen yet
  [[nodiscard]] std::size_t bytes() const;  ///< of device memory

  /// What the samples so far come to, to be developed: PathTracer::render's picture with as many. With
  /// PathOptions::denoise its noise is taken out here, on the processor.
  ///
  /// Errors: InvalidArgument when nothing was drawn; those of VulkanRenderer.
  [[nodiscard]] Result<PathPicture> read(Threads threads = {}) const;

 private:
  friend struct vulkan::Access;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
