#pragma once

#include <SDL.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/render_vk/vulkan_renderer.h>

#include "viewer/view_backend.h"

struct ImDrawData;

namespace quoin::viewer {

struct SdlDelete {
  void operator()(SDL_Window* window) const { SDL_DestroyWindow(window); }
  void operator()(SDL_Renderer* renderer) const { SDL_DestroyRenderer(renderer); }
  void operator()(SDL_Texture* texture) const { SDL_DestroyTexture(texture); }
};
template <class T>
using SdlPointer = std::unique_ptr<T, SdlDelete>;

/// SDL's video system, from here to the end of its life.
class SdlVideo {
 public:
  /// Errors: Unsupported where there is no display.
  [[nodiscard]] static Result<std::unique_ptr<SdlVideo>> start();
  SdlVideo(const SdlVideo&) = delete;
  SdlVideo& operator=(const SdlVideo&) = delete;
  ~SdlVideo();

 private:
  SdlVideo() = default;
};

/// What SDL says of its last failure, on one line.
[[nodiscard]] std::string sdl_says();

/// A window and how pictures get into it. Sizes are in pixels of the output.
class Screen {
 public:
  Screen() = default;
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  virtual ~Screen() = default;

  [[nodiscard]] SDL_Window* window() const { return window_.get(); }
  [[nodiscard]] bool is_minimised() const;
  /// Pixels of the output for each of the window's units, in which mice are measured.
  [[nodiscard]] double pixels_per_unit() const;
  void set_title(const std::string& title);

  /// Width and height of the output; 0 where there is none.
  [[nodiscard]] virtual SDL_Point output_size() const = 0;
  /// Whether `show` waits for the display.
  [[nodiscard]] virtual bool has_vsync() const = 0;
  /// The device that shows the window and can draw for it; null where none does.
  [[nodiscard]] virtual std::shared_ptr<VulkanRenderer> renderer() const { return nullptr; }

  /// The font's picture, a byte of opacity a pixel.
  virtual Status set_font(int width, int height, std::span<const std::uint8_t> opacity) = 0;
  /// Takes over a picture, of either kind.
  virtual Status set_picture(const ViewFrame& frame) = 0;
  virtual void forget_picture() = 0;
  /// Shows the picture, stretched smoothly where its size is another, or a plain backdrop where there is none, and the
  /// GUI over it.
  virtual Status show(const SDL_Rect& place, const ImDrawData& gui) = 0;

 protected:
  /// Errors: Unsupported, with SDL's words.
  Status open_window(int width, int height, Uint32 flags);

 private:
  SdlPointer<SDL_Window> window_;
};

/// Returns true if an OpenGL renderer of that name (GL_RENDERER) draws by the processor.
[[nodiscard]] bool is_software_opengl(std::string_view name);

/// Opens a window that SDL draws in, by its software renderer where OpenGL would draw by the processor as well. `width`
/// and `height` are in the display's units. Errors: Unsupported.
[[nodiscard]] Result<std::unique_ptr<Screen>> open_sdl_screen(int width, int height);

/// A window that a graphics device draws in and shows. `device` as VulkanOptions::device. Errors: Unsupported.
[[nodiscard]] Result<std::unique_ptr<Screen>> open_vulkan_screen(int width, int height, const std::string& device);

}  // namespace quoin::viewer
