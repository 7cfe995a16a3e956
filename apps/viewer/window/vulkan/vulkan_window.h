#pragma once

#include <SDL_rect.h>

#include <memory>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/render/vulkan_image.h>

#include "window_device.h"

struct ImDrawData;

namespace quoin::viewer {

/// Shows images of a renderer in the window of the same device.
///
/// Colours: the bytes of an image are shown unchanged.
/// Threads: the renderer's. Errors: DeviceLost; Unsupported when the window was lost; LimitExceeded.
class VulkanWindow {
 public:
  /// `vsync` waits for the display; without it images are shown at once if the device can. Shares `device`.
  [[nodiscard]] static Result<VulkanWindow> create(std::shared_ptr<WindowDevice> device, bool vsync = true);
  VulkanWindow(VulkanWindow&&) noexcept;
  VulkanWindow& operator=(VulkanWindow&&) noexcept;
  ~VulkanWindow();

  /// Prepares to draw the GUI of the current Dear ImGui context, with its fonts. Errors: LimitExceeded.
  [[nodiscard]] Status open_gui();
  /// Ends drawing it. Required before the context is destroyed.
  void close_gui();

  /// Shows an image, stretched over `place`, on a dark background, and the GUI over it if `open_gui` has succeeded.
  /// `width` and `height` are the window's current size; does nothing if one is 0, as in minimised windows. All sizes
  /// are in pixels. `image` may be null or empty.
  ///
  /// Rebuilds the swapchain if the window's size has changed. Waits for the display and until the window is drawn;
  /// `image` may be freed afterwards.
  [[nodiscard]] Status present(int width, int height, const VulkanImage* image, const SDL_Rect& place,
                               const ImDrawData& gui);

 private:
  struct Impl;
  explicit VulkanWindow(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

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
