#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/render_vk/vulkan_handles.h>
#include <quoin/render_vk/vulkan_image.h>

namespace quoin {

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

}  // namespace quoin
