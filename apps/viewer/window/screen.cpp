#include "screen.h"

namespace quoin::viewer {

std::string sdl_says() {
  std::string text = SDL_GetError();
  for (char& c : text) {
    if (c == '\n') c = ' ';
  }
  return text.empty() ? "no reason given" : text;
}

Result<std::unique_ptr<SdlVideo>> SdlVideo::start() {
  // The caller handles interrupts, and the screen saver stays enabled.
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_VIDEO_ALLOW_SCREENSAVER, "1");
  SDL_SetHint(SDL_HINT_VIDEO_X11_NET_WM_BYPASS_COMPOSITOR, "0");
  SDL_SetHint(SDL_HINT_MOUSE_FOCUS_CLICKTHROUGH, "1");
  const auto no_display = [](const std::string& why) {
    return make_error(ErrorCode::Unsupported,
                      "cannot open a window: no display (" + why + "); `quoin render` needs none");
  };
  const auto is_set = [](const char* name) {
    const char* value = SDL_getenv(name);
    return value != nullptr && *value != '\0';
  };
#ifdef __linux__
  // Checked first, because libraries below SDL print their own errors.
  if (!is_set("DISPLAY") && !is_set("WAYLAND_DISPLAY") && !is_set("SDL_VIDEODRIVER")) {
    return no_display("neither DISPLAY nor WAYLAND_DISPLAY is set");
  }
#endif
  if (SDL_Init(SDL_INIT_VIDEO) != 0) return no_display(sdl_says());
  auto video = std::unique_ptr<SdlVideo>(new SdlVideo());
  // Without a display SDL falls back to invisible windows. Tests request these by name.
  const std::string driver = SDL_GetCurrentVideoDriver();
  const bool is_unseen = driver == "offscreen" || driver == "dummy";
  if (is_unseen && !is_set("SDL_VIDEODRIVER")) return no_display("neither X nor Wayland responds");
  return video;
}

SdlVideo::~SdlVideo() {
  SDL_Quit();
}

bool Screen::is_minimised() const {
  return (SDL_GetWindowFlags(window()) & (SDL_WINDOW_MINIMIZED | SDL_WINDOW_HIDDEN)) != 0;
}

double Screen::pixels_per_unit() const {
  int width = 0;
  int height = 0;
  SDL_GetWindowSize(window(), &width, &height);
  const SDL_Point output = output_size();
  return width > 0 && output.x > 0 ? static_cast<double>(output.x) / width : 1.0;
}

void Screen::set_title(const std::string& title) {
  if (title != SDL_GetWindowTitle(window())) SDL_SetWindowTitle(window(), title.c_str());
}

Status Screen::open_window(int width, int height, Uint32 flags) {
  constexpr int kCentred = static_cast<int>(SDL_WINDOWPOS_CENTERED);
  const Uint32 all = flags | SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI;
  window_.reset(SDL_CreateWindow("Quoin", kCentred, kCentred, width, height, all));
  if (!window_) return make_error(ErrorCode::Unsupported, "cannot open a window: " + sdl_says());
  SDL_SetWindowMinimumSize(window(), 320, 240);
  return {};
}

}  // namespace quoin::viewer
