#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include <quoin/core/result.h>
#include <quoin/render_vk/vulkan_image.h>

#include "window_device.h"

namespace quoin::viewer {

/// A rectangle in window pixels, from the upper left corner.
struct PixelRect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// A vertex of a triangle over the image.
struct OverlayVertex {
  float x = 0.0F;  ///< window pixels, from the upper left corner
  float y = 0.0F;
  float u = 0.0F;  ///< font image coordinates, 0 to 1
  float v = 0.0F;
  std::uint32_t colour = 0;  ///< sRGB bytes, red the lowest, alpha the highest; alpha is multiplied with the font's
};

/// A draw call of an overlay.
struct OverlayDraw {
  PixelRect clip;
  std::uint32_t first_index = 0;
  std::uint32_t index_count = 0;
  std::uint32_t first_vertex = 0;  ///< added to the indices
};

/// Triangles over an image, such as a GUI's. Blended in sRGB, as GUIs expect.
struct Overlay {
  std::span<const OverlayVertex> vertices;
  std::span<const std::uint16_t> indices;
  std::span<const OverlayDraw> draws;
};

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

  /// Sets the font image, one byte of opacity per pixel. Requires: `opacity` has width * height bytes.
  [[nodiscard]] Status set_font(int width, int height, std::span<const std::uint8_t> opacity);

  /// Shows an image, stretched over `place`, on a dark background, and the overlay over it. `width` and `height` are
  /// the window's current size in pixels; does nothing if one is 0, as in minimised windows. `image` may be null or
  /// empty.
  ///
  /// Rebuilds the swapchain if the window's size has changed. Waits for the display and until the window is drawn;
  /// `image` may be freed afterwards.
  /// Requires: the indices and vertices of all draw calls exist.
  [[nodiscard]] Status present(int width, int height, const VulkanImage* image, const PixelRect& place,
                               const Overlay& overlay);

 private:
  struct Impl;
  explicit VulkanWindow(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin::viewer
