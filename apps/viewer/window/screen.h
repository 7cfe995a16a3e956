#pragma once

#include <SDL.h>

#include <memory>
#include <string>
#include <string_view>

#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/render/vulkan_renderer.h>

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

/// Owns SDL's video system.
class SdlVideo {
 public:
  /// Errors: Unsupported if there is no display.
  [[nodiscard]] static Result<std::unique_ptr<SdlVideo>> start();
  SdlVideo(const SdlVideo&) = delete;
  SdlVideo& operator=(const SdlVideo&) = delete;
  ~SdlVideo();

 private:
  SdlVideo() = default;
};

/// Returns SDL's last error message on one line.
[[nodiscard]] std::string sdl_says();

/// Wakes the window's loop. Can be called from any thread while SDL runs.
void wake_window();
/// Returns true if an event comes from `wake_window`.
[[nodiscard]] bool is_wake(const SDL_Event& event);

/// A window that shows images and the GUI. Sizes are in output pixels.
class Screen {
 public:
  Screen() = default;
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  virtual ~Screen() = default;

  [[nodiscard]] SDL_Window* window() const { return window_.get(); }
  [[nodiscard]] bool is_minimised() const;
  /// Returns the output pixels per window unit, the unit of mouse positions.
  [[nodiscard]] double pixels_per_unit() const;
  void set_title(const std::string& title);

  /// Returns the width and height of the output; 0 if there is none.
  [[nodiscard]] virtual SDL_Point output_size() const = 0;
  /// Returns true if `show` waits for the display.
  [[nodiscard]] virtual bool has_vsync() const = 0;
  /// Returns the device that shows the window and can draw for it, or null.
  [[nodiscard]] virtual std::shared_ptr<VulkanRenderer> renderer() const { return nullptr; }

  /// Prepares to draw the GUI of the current Dear ImGui context, with its fonts.
  virtual Status open_gui() = 0;
  /// Ends drawing it. Required before the context is destroyed.
  virtual void close_gui() = 0;
  /// Sets the image, in memory or on the device.
  virtual Status show_image(const ViewFrame& frame) = 0;
  virtual void forget_image() = 0;
  /// Shows the image with the GUI over it. Scales the image smoothly to `place`; shows a plain background without one.
  virtual Status show(const SDL_Rect& place, const ImDrawData& gui) = 0;

 protected:
  /// Errors: Unsupported, with SDL's message.
  Status open_window(int width, int height, Uint32 flags);

 private:
  SdlPointer<SDL_Window> window_;
};

/// Returns true if an OpenGL renderer of that name (GL_RENDERER) is a software renderer.
[[nodiscard]] bool is_software_opengl(std::string_view name);

/// Opens a window drawn by SDL, with its software renderer if OpenGL is rendered in software too. `width` and `height`
/// are in display units. Errors: Unsupported.
[[nodiscard]] Result<std::unique_ptr<Screen>> open_sdl_screen(int width, int height);

/// Opens a window drawn by a graphics device. `device` is as in VulkanOptions::device. Errors: Unsupported.
[[nodiscard]] Result<std::unique_ptr<Screen>> open_vulkan_screen(int width, int height, const std::string& device);

}  // namespace quoin::viewer
