#pragma once

#include <SDL_rect.h>

#include <memory>

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

}  // namespace quoin::viewer
