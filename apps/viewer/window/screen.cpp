#include "screen.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

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

namespace {

Uint32 wake_type() {
  static const Uint32 type = SDL_RegisterEvents(1);
  return type;
}

}  // namespace

void wake_window() {
  SDL_Event event{};
  event.type = wake_type();
  // A full queue wakes the loop anyway.
  SDL_PushEvent(&event);
}

bool is_wake(const SDL_Event& event) {
  return event.type == wake_type();
}

namespace {

class SdlScreen final : public Screen {
 public:
  /// Errors: Unsupported.
  Status open(int width, int height);

  [[nodiscard]] SDL_Point output_size() const override;
  [[nodiscard]] bool has_vsync() const override { return has_vsync_; }
  Status open_gui() override;
  void close_gui() override { font_.reset(); }
  Status show_image(const ViewFrame& frame) override;
  void forget_image() override { image_.reset(); }
  Status show(const SDL_Rect& place, const ImDrawData& gui) override;

 private:
  void open_renderer();
  Status set_image(const Image& image);
  void draw(const ImDrawData& data);
  void draw(const ImDrawList& list, const ImDrawCmd& command, const ImDrawData& data);

  SdlPointer<SDL_Renderer> renderer_;
  SdlPointer<SDL_Texture> image_;
  SdlPointer<SDL_Texture> font_;
  SDL_Point image_size_{0, 0};
  bool has_vsync_ = false;
};

Error cannot(const std::string& what) {
  return make_error(ErrorCode::Unsupported, "cannot " + what + ": " + sdl_says());
}

// Returns GL_RENDERER if the renderer uses OpenGL, else an empty string.
std::string opengl_name(SDL_Renderer* renderer) {
  using GetString = const unsigned char* (*)(unsigned);
  constexpr unsigned kRenderer = 0x1F01;
  SDL_RendererInfo info{};
  if (SDL_GetRendererInfo(renderer, &info) != 0 || !std::string_view(info.name).starts_with("opengl")) return "";
  const auto get_string = reinterpret_cast<GetString>(SDL_GL_GetProcAddress("glGetString"));
  const unsigned char* const name = get_string != nullptr ? get_string(kRenderer) : nullptr;
  return name != nullptr ? reinterpret_cast<const char*>(name) : "";
}

// The renderer that SDL prefers, unless that is OpenGL on the processor: SDL's own software renderer takes less of it.
// OpenGL stays if the software renderer cannot show anything, as on Wayland.
void SdlScreen::open_renderer() {
  const auto open_preferred = [this] { renderer_.reset(SDL_CreateRenderer(window(), -1, SDL_RENDERER_PRESENTVSYNC)); };
  open_preferred();
  const char* const chosen = SDL_GetHint(SDL_HINT_RENDER_DRIVER);
  const bool is_chosen = chosen != nullptr && *chosen != '\0';
  const bool is_slow = renderer_ && !is_chosen && is_software_opengl(opengl_name(renderer_.get()));
  if (renderer_ && !is_slow) return;
  // Without this hint SDL would show the software renderer's image through OpenGL.
  if (is_slow) SDL_SetHint(SDL_HINT_FRAMEBUFFER_ACCELERATION, "0");
  renderer_.reset();
  renderer_.reset(SDL_CreateRenderer(window(), -1, SDL_RENDERER_SOFTWARE));
  if (!renderer_ && is_slow) open_preferred();
}

Status SdlScreen::open(int width, int height) {
  if (Status opened = open_window(width, height, 0); !opened) return opened;
  open_renderer();
  if (!renderer_) return cannot("draw in a window");
  SDL_RendererInfo info{};
  SDL_GetRendererInfo(renderer_.get(), &info);
  has_vsync_ = (info.flags & SDL_RENDERER_PRESENTVSYNC) != 0 && (info.flags & SDL_RENDERER_SOFTWARE) == 0;
  return {};
}

SDL_Point SdlScreen::output_size() const {
  SDL_Point size{0, 0};
  if (SDL_GetRendererOutputSize(renderer_.get(), &size.x, &size.y) != 0) return {0, 0};
  return size;
}

Status SdlScreen::open_gui() {
  unsigned char* opacity = nullptr;
  int width = 0;
  int height = 0;
  ImGui::GetIO().Fonts->GetTexDataAsAlpha8(&opacity, &width, &height);
  font_.reset(SDL_CreateTexture(renderer_.get(), SDL_PIXELFORMAT_ABGR8888, SDL_TEXTUREACCESS_STATIC, width, height));
  if (!font_) return cannot("store the font");
  std::vector<std::uint32_t> pixels;
  const std::span all(opacity, static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (const std::uint8_t one : all) pixels.push_back(std::uint32_t{one} << 24 | 0x00FF'FFFFU);
  SDL_UpdateTexture(font_.get(), nullptr, pixels.data(), 4 * width);
  SDL_SetTextureBlendMode(font_.get(), SDL_BLENDMODE_BLEND);
  SDL_SetTextureScaleMode(font_.get(), SDL_ScaleModeLinear);
  return {};
}

Status SdlScreen::show_image(const ViewFrame& frame) {
  if (!frame.on_device) return set_image(frame.colour);
  const auto read = frame.on_device->read();
  if (!read) return read.error();
  return set_image(*read);
}

Status SdlScreen::set_image(const Image& image) {
  if (image.width <= 0 || image.height <= 0) return {};
  if (!image_ || image_size_.x != image.width || image_size_.y != image.height) {
    image_.reset(SDL_CreateTexture(renderer_.get(), SDL_PIXELFORMAT_RGB24, SDL_TEXTUREACCESS_STREAMING, image.width,
                                   image.height));
    if (!image_) return cannot("store an image");
    image_size_ = {image.width, image.height};
    SDL_SetTextureScaleMode(image_.get(), SDL_ScaleModeLinear);
  }
  if (SDL_UpdateTexture(image_.get(), nullptr, image.rgb.data(), 3 * image.width) != 0) return cannot("show an image");
  return {};
}

Status SdlScreen::show(const SDL_Rect& place, const ImDrawData& gui) {
  SDL_SetRenderDrawColor(renderer_.get(), 24, 26, 30, 255);
  SDL_RenderClear(renderer_.get());
  if (image_ && place.w > 0 && place.h > 0) SDL_RenderCopy(renderer_.get(), image_.get(), nullptr, &place);
  draw(gui);
  SDL_RenderPresent(renderer_.get());
  return {};
}

void SdlScreen::draw(const ImDrawData& data) {
  SDL_Renderer* renderer = renderer_.get();
  SDL_RenderSetScale(renderer, data.FramebufferScale.x, data.FramebufferScale.y);
  for (int i = 0; i < data.CmdListsCount; ++i) {
    const ImDrawList& list = *data.CmdLists[i];
    for (const ImDrawCmd& command : list.CmdBuffer) {
      if (command.UserCallback == nullptr) draw(list, command, data);
    }
  }
  SDL_RenderSetClipRect(renderer, nullptr);
  SDL_RenderSetScale(renderer, 1.0F, 1.0F);
}

void SdlScreen::draw(const ImDrawList& list, const ImDrawCmd& command, const ImDrawData& data) {
  const float left = std::max(command.ClipRect.x - data.DisplayPos.x, 0.0F);
  const float top = std::max(command.ClipRect.y - data.DisplayPos.y, 0.0F);
  const float right = std::min(command.ClipRect.z - data.DisplayPos.x, data.DisplaySize.x);
  const float bottom = std::min(command.ClipRect.w - data.DisplayPos.y, data.DisplaySize.y);
  if (right <= left || bottom <= top) return;
  const int x = static_cast<int>(left);
  const int y = static_cast<int>(top);
  const SDL_Rect clip{x, y, static_cast<int>(std::ceil(right)) - x, static_cast<int>(std::ceil(bottom)) - y};
  SDL_RenderSetClipRect(renderer_.get(), &clip);
  const ImDrawVert* vertices = list.VtxBuffer.Data + command.VtxOffset;
  const ImDrawIdx* indices = list.IdxBuffer.Data + command.IdxOffset;
  SDL_RenderGeometryRaw(renderer_.get(), font_.get(), &vertices->pos.x, sizeof(ImDrawVert),
                        reinterpret_cast<const SDL_Color*>(&vertices->col), sizeof(ImDrawVert), &vertices->uv.x,
                        sizeof(ImDrawVert), list.VtxBuffer.Size - static_cast<int>(command.VtxOffset), indices,
                        static_cast<int>(command.ElemCount), sizeof(ImDrawIdx));
}

}  // namespace

bool is_software_opengl(std::string_view name) {
  return std::ranges::any_of(std::array{"llvmpipe", "softpipe", "swrast", "Software Rasterizer"},
                             [name](std::string_view driver) { return name.find(driver) != std::string_view::npos; });
}

Result<std::unique_ptr<Screen>> open_sdl_screen(int width, int height) {
  auto screen = std::make_unique<SdlScreen>();
  if (Status opened = screen->open(width, height); !opened) return opened.error();
  return screen;
}

}  // namespace quoin::viewer
