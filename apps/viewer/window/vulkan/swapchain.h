#pragma once

#include <memory>
#include <vector>

#include "window_device.h"

namespace quoin::viewer {

/// The images of a window, of one size, to be drawn by a render pass and then shown.
class Swapchain {
 public:
  /// `old` may be null and is retired, whatever comes of it. `pass`: of `format_of`. Null while the window has no
  /// pixels. Requires: width and height are positive.
  [[nodiscard]] static Result<std::unique_ptr<Swapchain>> create(const WindowDevice& device, VkRenderPass pass,
                                                                 int width, int height, bool vsync,
                                                                 const Swapchain* old);
  ~Swapchain();
  Swapchain(const Swapchain&) = delete;
  Swapchain& operator=(const Swapchain&) = delete;

  /// How images of the device's window store colours: bytes that are shown as they are. Errors: Unsupported.
  [[nodiscard]] static Result<VkSurfaceFormatKHR> format_of(const WindowDevice& device);

  [[nodiscard]] VkSwapchainKHR handle() const { return handle_; }
  [[nodiscard]] VkExtent2D extent() const { return extent_; }
  [[nodiscard]] VkFramebuffer framebuffer(std::uint32_t image) const { return images_[image].framebuffer; }
  /// Signalled when an image has been drawn. One an image: whoever shows it may still wait for the last one.
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
