#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include <quoin/core/result.h>
#include <quoin/render_vk/vulkan_picture.h>

#include "window_device.h"

namespace quoin::viewer {

/// In pixels of a window, from its upper left corner.
struct PixelRect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// A corner of a triangle that is drawn over the picture.
struct OverlayVertex {
  float x = 0.0F;  ///< pixels of the window, from its upper left corner
  float y = 0.0F;
  float u = 0.0F;  ///< of the font's picture, 0 to 1
  float v = 0.0F;
  std::uint32_t colour = 0;  ///< sRGB bytes, red the lowest, alpha the highest; alpha is multiplied with the font's
};

/// Some triangles of an overlay.
struct OverlayDraw {
  PixelRect clip;
  std::uint32_t first_index = 0;
  std::uint32_t index_count = 0;
  std::uint32_t first_vertex = 0;  ///< is added to the indices
};

/// Flat triangles over a picture: what user interfaces are made of. Blended in sRGB, as these expect.
struct Overlay {
  std::span<const OverlayVertex> vertices;
  std::span<const std::uint16_t> indices;
  std::span<const OverlayDraw> draws;
};

/// Shows pictures in a device's window: those of a renderer on that device.
///
/// Colours: a picture's bytes are the window's.
/// Threads: the renderer's. Errors: DeviceLost; Unsupported when the window was lost; LimitExceeded.
class VulkanWindow {
 public:
  /// `vsync`: pictures wait for the display; without, where the device can, they do not. Shares `device`.
  [[nodiscard]] static Result<VulkanWindow> create(std::shared_ptr<WindowDevice> device, bool vsync = true);
  VulkanWindow(VulkanWindow&&) noexcept;
  VulkanWindow& operator=(VulkanWindow&&) noexcept;
  ~VulkanWindow();

  /// The font's picture, a byte of opacity a pixel. Requires: that many bytes.
  [[nodiscard]] Status set_font(int width, int height, std::span<const std::uint8_t> opacity);

  /// Shows a picture, stretched over `place`, on a dark ground, and the overlay over all. `width` and `height`: of the
  /// window now, in pixels; where one is 0, as in minimised windows, nothing is done. `picture` may be null, or empty.
  ///
  /// What belongs to the window's size is made anew where that has changed. Waits for the display, and until the window
  /// is drawn: `picture` may go afterwards.
  /// Requires: draws name indices, and these name vertices, that are there.
  [[nodiscard]] Status present(int width, int height, const VulkanPicture* picture, const PixelRect& place,
                               const Overlay& overlay);

 private:
  struct Impl;
  explicit VulkanWindow(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin::viewer
