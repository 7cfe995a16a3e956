#pragma once

#include <quoin/render_vk/vulkan_image.h>

#include "window_device.h"

namespace quoin::viewer {

/// A Vulkan image that Quoin's images are copied into, to be scaled from there.
class CopiedImage {
 public:
  explicit CopiedImage(const WindowDevice& device) : device_(&device) {}
  ~CopiedImage() { free(); }
  CopiedImage(const CopiedImage&) = delete;
  CopiedImage& operator=(const CopiedImage&) = delete;

  /// Recreates the image, with undefined pixels, if its size differs.
  /// Requires: no commands that read it are running. Errors: LimitExceeded.
  [[nodiscard]] Status fit(int width, int height);

  [[nodiscard]] VkImage handle() const { return image_; }
  /// Returns the target for VulkanImage::record_copy, which leaves the image in VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL.
  [[nodiscard]] VulkanImageTarget target() const;

 private:
  VkResult make(int width, int height);
  void free();

  const WindowDevice* device_;
  VkImage image_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace quoin::viewer
