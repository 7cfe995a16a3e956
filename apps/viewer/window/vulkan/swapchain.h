#pragma once

#include <memory>
#include <vector>

#include "window_device.h"

namespace quoin::viewer {

/// The swapchain of a window at one size, with a framebuffer per image.
class Swapchain {
 public:
  /// `old` may be null; it is retired even if this fails. `pass` is a pass of `make_pass`. Returns null while the
  /// window has no pixels. Requires: width and height are positive.
  [[nodiscard]] static Result<std::unique_ptr<Swapchain>> create(const WindowDevice& device, VkRenderPass pass,
                                                                 int width, int height, bool vsync,
                                                                 const Swapchain* old);
  ~Swapchain();
  Swapchain(const Swapchain&) = delete;
  Swapchain& operator=(const Swapchain&) = delete;

  /// Returns a surface format that shows bytes unchanged. Errors: Unsupported.
  [[nodiscard]] static Result<VkSurfaceFormatKHR> format_of(const WindowDevice& device);
  /// Creates a render pass that draws over an image in VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL and leaves it ready to
  /// present. The caller destroys it. Errors: those of format_of, LimitExceeded.
  [[nodiscard]] static Result<VkRenderPass> make_pass(const WindowDevice& device);

  [[nodiscard]] VkSwapchainKHR handle() const { return handle_; }
  [[nodiscard]] VkExtent2D extent() const { return extent_; }
  [[nodiscard]] VkImage image(std::uint32_t image) const { return images_[image].handle; }
  [[nodiscard]] VkFramebuffer framebuffer(std::uint32_t image) const { return images_[image].framebuffer; }
  /// Signalled when an image has been drawn. One per image, because presentation may still wait for the previous one.
  [[nodiscard]] VkSemaphore drawn(std::uint32_t image) const { return images_[image].drawn; }

 private:
  struct OneImage {
    VkImage handle = VK_NULL_HANDLE;
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
