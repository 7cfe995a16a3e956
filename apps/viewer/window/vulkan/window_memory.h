#pragma once

#include <quoin/render_vk/vulkan_image.h>

#include "window_device.h"

namespace quoin::viewer {

/// A Vulkan image that Quoin's images are copied into and shaders read.
class CopiedImage {
 public:
  static constexpr VkFormat kFormat = VK_FORMAT_R8G8B8A8_UNORM;  // unchanged bytes

  explicit CopiedImage(const WindowDevice& device) : device_(&device) {}
  ~CopiedImage() { free(); }
  CopiedImage(const CopiedImage&) = delete;
  CopiedImage& operator=(const CopiedImage&) = delete;

  /// Recreates the image, with undefined pixels, if its size differs. Returns true if it did.
  /// Requires: no commands that read it are running. Errors: LimitExceeded.
  [[nodiscard]] Result<bool> fit(int width, int height);

  [[nodiscard]] VkImageView view() const { return view_; }
  /// Returns the target for VulkanImage::record_copy, which leaves the image readable by shaders.
  [[nodiscard]] VulkanImageTarget target() const;

 private:
  VkResult make(int width, int height);
  void free();

  const WindowDevice* device_;
  VkImage image_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  VkImageView view_ = VK_NULL_HANDLE;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace quoin::viewer
