#include "sdl_window.h"

#include <algorithm>

namespace quoin::viewer {

namespace {

std::string sdl_says() {
  std::string text = SDL_GetError();
  for (char& c : text) {
    if (c == '\n') c = ' ';
  }
  return text.empty() ? "no reason given" : text;
}

}  // namespace

Result<std::unique_ptr<SdlVideo>> SdlVideo::start() {
  // Interrupts are the caller's to handle; the screen may go dark when nobody is there.
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_VIDEO_ALLOW_SCREENSAVER, "1");
  SDL_SetHint(SDL_HINT_VIDEO_X11_NET_WM_BYPASS_COMPOSITOR, "0");
  SDL_SetHint(SDL_HINT_MOUSE_FOCUS_CLICKTHROUGH, "1");
  const auto no_display = [](const std::string& why) {
    return fail(ErrorCode::Unsupported,
                "no display to open a window on (" + why + "); `quoin render` draws pictures without one");
  };
  const auto is_set = [](const char* name) {
    const char* value = SDL_getenv(name);
    return value != nullptr && *value != '\0';
  };
#ifdef __linux__
  // Asked first, since libraries below SDL print their own complaints.
  if (!is_set("DISPLAY") && !is_set("WAYLAND_DISPLAY") && !is_set("SDL_VIDEODRIVER")) {
    return no_display("neither DISPLAY nor WAYLAND_DISPLAY is set");
  }
#endif
  if (SDL_Init(SDL_INIT_VIDEO) != 0) return no_display(sdl_says());
  auto video = std::unique_ptr<SdlVideo>(new SdlVideo());
  // Where there is nothing else, SDL opens windows that nobody sees. Tests ask for these by name.
  const std::string driver = SDL_GetCurrentVideoDriver();
  const bool is_unseen = driver == "offscreen" || driver == "dummy";
  if (is_unseen && !is_set("SDL_VIDEODRIVER")) return no_display("neither X nor Wayland answers");
  return video;
}

SdlVideo::~SdlVideo() {
  SDL_Quit();
}

Result<SdlWindow> SdlWindow::open(int width, int height) {
  SdlWindow made;
  const Uint32 flags = SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI;
  made.window_.reset(SDL_CreateWindow("Quoin", SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED, width, height, flags));
  if (!made.window_) return fail(ErrorCode::Unsupported, "cannot open a window: " + sdl_says());
  SDL_SetWindowMinimumSize(made.window(), 320, 240);
  made.renderer_.reset(SDL_CreateRenderer(made.window(), -1, SDL_RENDERER_PRESENTVSYNC));
  if (!made.renderer_) made.renderer_.reset(SDL_CreateRenderer(made.window(), -1, SDL_RENDERER_SOFTWARE));
  if (!made.renderer_) return fail(ErrorCode::Unsupported, "cannot draw in a window: " + sdl_says());
  SDL_RendererInfo info{};
  SDL_GetRendererInfo(made.renderer(), &info);
  made.has_vsync_ = (info.flags & SDL_RENDERER_PRESENTVSYNC) != 0 && (info.flags & SDL_RENDERER_SOFTWARE) == 0;
  return made;
}

bool SdlWindow::is_minimised() const {
  return (SDL_GetWindowFlags(window()) & (SDL_WINDOW_MINIMIZED | SDL_WINDOW_HIDDEN)) != 0;
}

SDL_Point SdlWindow::output_size() const {
  SDL_Point size{0, 0};
  if (SDL_GetRendererOutputSize(renderer(), &size.x, &size.y) != 0) return {0, 0};
  return size;
}

double SdlWindow::pixels_per_unit() const {
  int width = 0;
  int height = 0;
  SDL_GetWindowSize(window(), &width, &height);
  const SDL_Point output = output_size();
  return width > 0 && output.x > 0 ? static_cast<double>(output.x) / width : 1.0;
}

void SdlWindow::set_title(const std::string& title) {
  if (title != SDL_GetWindowTitle(window())) SDL_SetWindowTitle(window(), title.c_str());
}

bool SdlWindow::set_picture(const Image& picture) {
  if (picture.width <= 0 || picture.height <= 0) return false;
  if (!picture_ || picture_size_.x != picture.width || picture_size_.y != picture.height) {
    picture_.reset(SDL_CreateTexture(renderer(), SDL_PIXELFORMAT_RGB24, SDL_TEXTUREACCESS_STREAMING, picture.width,
                                     picture.height));
    if (!picture_) return false;
    picture_size_ = {picture.width, picture.height};
    SDL_SetTextureScaleMode(picture_.get(), SDL_ScaleModeLinear);
  }
  return SDL_UpdateTexture(picture_.get(), nullptr, picture.rgb.data(), 3 * picture.width) == 0;
}

void SdlWindow::draw_picture(const SDL_Rect& place) {
  SDL_SetRenderDrawColor(renderer(), 24, 26, 30, 255);
  SDL_RenderClear(renderer());
  if (picture_ && place.w > 0 && place.h > 0) SDL_RenderCopy(renderer(), picture_.get(), nullptr, &place);
}

}  // namespace quoin::viewer
