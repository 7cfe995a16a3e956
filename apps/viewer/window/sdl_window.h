#pragma once

#include <SDL.h>

#include <memory>
#include <string>

#include <quoin/core/image.h>
#include <quoin/core/result.h>

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

/// A window, what draws in it, and the picture that it shows. Sizes are in pixels of the output.
class SdlWindow {
 public:
  /// `width` and `height` are in the display's units. Errors: Unsupported, with SDL's words.
  [[nodiscard]] static Result<SdlWindow> open(int width, int height);

  [[nodiscard]] SDL_Window* window() const { return window_.get(); }
  [[nodiscard]] SDL_Renderer* renderer() const { return renderer_.get(); }
  [[nodiscard]] bool has_vsync() const { return has_vsync_; }
  [[nodiscard]] bool is_minimised() const;
  /// Width and height of the output; 0 where there is none.
  [[nodiscard]] SDL_Point output_size() const;
  /// Pixels of the output for each of the window's units, in which mice are measured.
  [[nodiscard]] double pixels_per_unit() const;
  void set_title(const std::string& title);

  /// Takes over a picture. False when the display has no memory for it.
  bool set_picture(const Image& picture);
  void forget_picture() { picture_.reset(); }
  /// Draws the picture, stretched smoothly where its size is another, or a plain backdrop where there is none.
  void draw_picture(const SDL_Rect& place);

 private:
  SdlPointer<SDL_Window> window_;
  SdlPointer<SDL_Renderer> renderer_;
  SdlPointer<SDL_Texture> picture_;
  SDL_Point picture_size_{0, 0};
  bool has_vsync_ = false;
};

}  // namespace quoin::viewer
