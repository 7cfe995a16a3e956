#pragma once

#include <memory>
#include <vector>

#include "window_device.h"

namespace quoin::viewer {

/// The swapchain of a window at one size, with a framebuffer per image.
class Swapchain {
 public:
  /// `old` may be null; it is retired even if this fails. `pass` has the format of `format_of`. Returns null while the
  /// window has no pixels. Requires: width and height are positive.
  [[nodiscard]] static Result<std::unique_ptr<Swapchain>> create(const WindowDevice& device, VkRenderPass pass,
                                                                 int width, int height, bool vsync,
                                                                 const Swapchain* old);
  ~Swapchain();
  Swapchain(const Swapchain&) = delete;
  Swapchain& operator=(const Swapchain&) = delete;

  /// Returns a surface format that shows bytes unchanged. Errors: Unsupported.
  [[nodiscard]] static Result<VkSurfaceFormatKHR> format_of(const WindowDevice& device);

  [[nodiscard]] VkSwapchainKHR handle() const { return handle_; }
  [[nodiscard]] VkExtent2D extent() const { return extent_; }
  [[nodiscard]] VkFramebuffer framebuffer(std::uint32_t image) const { return images_[image].framebuffer; }
  /// Signalled when an image has been drawn. One per image, because presentation may still wait for the previous one.
  [[nodiscard]] VkSemaphore drawn(std::uint32_t image) const { return images_[image].drawn; }

 private:
  struct OneImage {
    VkImageView view = VK_NULL_HANDLE;
    VkFramebuffer framebuffer = VK_NULL_HANDLE;
    VkSemaphore drawn = VK_NULL_HANDLE;
  };

  explicit Swapchain(const WindowDevice& device) : device_(&device) {}
  VkResult open(VkRenderPass pass, VkExtent2D wanted, bool vsync, VkSwapchainKHR old);
  VkResult add_image(VkImage image, VkFormat format, VkRenderPass pass);
  [[nodiscard]] VkPresentModeKHR mode(bool vsync) const;

  const WindowDevice* device_;
  VkSwapchainKHR handle_ = VK_NULL_HANDLE;
  VkExtent2D extent_{};
  std::vector<OneImage> images_;
};

}  // namespace quoin::viewer
