#include "gui.h"

#include <imgui_impl_sdl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <utility>

namespace quoin::viewer {

namespace {

constexpr float kFontSize = 15.0F;

// Debian, Fedora and Arch keep fonts in different folders. Without any of these, ImGui uses its small built-in font.
constexpr std::array kFonts = {
    "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf",
    "/usr/share/fonts/TTF/DejaVuSans.ttf", "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf",
    "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf"};

const char* find_font() {
  std::error_code ignored;
  for (const char* path : kFonts) {
    if (std::filesystem::is_regular_file(path, ignored)) return path;
  }
  return nullptr;
}

void set_style(float scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 0.0F;
  style.PopupRounding = 5.0F;
  style.FrameRounding = 4.0F;
  style.GrabRounding = 4.0F;
  style.ScrollbarRounding = 4.0F;
  style.WindowBorderSize = 0.0F;
  style.WindowPadding = {12.0F, 10.0F};
  style.FramePadding = {8.0F, 4.0F};
  style.ItemSpacing = {8.0F, 6.0F};
  style.Colors[ImGuiCol_TextDisabled] = {0.62F, 0.65F, 0.70F, 1.0F};
  const ImVec4 accent{0.28F, 0.49F, 0.79F, 1.0F};
  style.Colors[ImGuiCol_WindowBg] = {0.105F, 0.115F, 0.135F, 1.0F};
  style.Colors[ImGuiCol_PopupBg] = {0.13F, 0.14F, 0.165F, 1.0F};
  style.Colors[ImGuiCol_MenuBarBg] = {0.14F, 0.15F, 0.175F, 1.0F};
  style.Colors[ImGuiCol_FrameBg] = {0.19F, 0.205F, 0.24F, 1.0F};
  style.Colors[ImGuiCol_TitleBgActive] = {0.17F, 0.19F, 0.23F, 1.0F};
  style.Colors[ImGuiCol_HeaderHovered] = {0.24F, 0.29F, 0.38F, 1.0F};
  style.Colors[ImGuiCol_ModalWindowDimBg] = {0.0F, 0.0F, 0.0F, 0.45F};
  style.Colors[ImGuiCol_Header] = {0.19F, 0.21F, 0.25F, 1.0F};
  style.Colors[ImGuiCol_Button] = {0.23F, 0.26F, 0.31F, 1.0F};
  style.Colors[ImGuiCol_ButtonHovered] = {0.30F, 0.36F, 0.45F, 1.0F};
  for (const ImGuiCol colour : {ImGuiCol_ButtonActive, ImGuiCol_SliderGrab, ImGuiCol_CheckMark,
                                ImGuiCol_SliderGrabActive, ImGuiCol_PlotHistogram}) {
    style.Colors[colour] = accent;
  }
  style.ScaleAllSizes(scale);
}

}  // namespace

double scale_of_display(const Screen& screen) {
  // If the output has more pixels than the window has units, that ratio already includes the display's scale.
  float dots_per_inch = 96.0F;
  const int display = SDL_GetWindowDisplayIndex(screen.window());
  if (screen.pixels_per_unit() > 1.01 || display < 0) return 1.0;
  if (SDL_GetDisplayDPI(display, nullptr, &dots_per_inch, nullptr) != 0) return 1.0;
  const double scale = std::round(dots_per_inch / 96.0 * 4.0) / 4.0;
  // Displays often report a wrong size, so moderate values keep the default scale.
  return scale < 1.5 ? 1.0 : std::min(scale, 3.0);
}

Gui::Gui(Screen& screen, double scale) : screen_(&screen), scale_(scale) {
  ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;
  io.LogFilename = nullptr;
  io.BackendRendererName = "quoin";
  io.BackendFlags |= ImGuiBackendFlags_RendererHasVtxOffset;
  io.ConfigWindowsMoveFromTitleBarOnly = true;
  set_style(static_cast<float>(scale));
  ImGui_ImplSDL2_InitForSDLRenderer(screen.window());
  load_font();
  status_ = screen_->open_gui();
}

Gui::~Gui() {
  screen_->close_gui();
  ImGui_ImplSDL2_Shutdown();
  ImGui::DestroyContext();
}

void Gui::load_font() {
  ImGuiIO& io = ImGui::GetIO();
  // The font is rasterised in pixels, to be sharp, and placed in window units.
  const auto pixels_per_unit = static_cast<float>(screen_->pixels_per_unit());
  const float size = std::round(kFontSize * static_cast<float>(scale_) * pixels_per_unit);
  static const std::array<ImWchar, 7> ranges = {0x20, 0x17F, 0x370, 0x52F, 0x2010, 0x2193, 0};
  const char* path = find_font();
  if (path == nullptr || io.Fonts->AddFontFromFileTTF(path, size, nullptr, ranges.data()) == nullptr) {
    ImFontConfig config;
    config.SizePixels = size;
    io.Fonts->AddFontDefault(&config);
  }
  io.FontGlobalScale = 1.0F / pixels_per_unit;
}

void Gui::process(const SDL_Event& event) {
  ImGui_ImplSDL2_ProcessEvent(&event);
  if (event.type == SDL_MOUSEMOTION) mouse_ = {static_cast<float>(event.motion.x), static_cast<float>(event.motion.y)};
  if (event.type == SDL_MOUSEBUTTONDOWN) {
    mouse_ = {static_cast<float>(event.button.x), static_cast<float>(event.button.y)};
  }
  if (event.type == SDL_MOUSEBUTTONDOWN || event.type == SDL_MOUSEBUTTONUP) note_button(event.button);
  if (event.type != SDL_WINDOWEVENT) return;
  if (event.window.event == SDL_WINDOWEVENT_LEAVE) mouse_ = {-1e6F, -1e6F};
  if (event.window.event == SDL_WINDOWEVENT_FOCUS_LOST) is_down_ = {};
}

void Gui::note_button(const SDL_MouseButtonEvent& button) {
  constexpr std::array kButtons = {SDL_BUTTON_LEFT, SDL_BUTTON_RIGHT, SDL_BUTTON_MIDDLE};  // in ImGui's order
  for (std::size_t i = 0; i < kButtons.size(); ++i) {
    if (button.button != kButtons.at(i)) continue;
    is_down_.at(i) = button.type == SDL_MOUSEBUTTONDOWN;
    if (is_down_.at(i)) clicks_.at(i) = button.clicks;
  }
}

void Gui::begin_frame() {
  ImGui_ImplSDL2_NewFrame();
  // The backend gets the output size from OpenGL, which may not be the renderer.
  const auto ratio = static_cast<float>(screen_->pixels_per_unit());
  ImGui::GetIO().DisplayFramebufferScale = {ratio, ratio};
  // It also reads the mouse from the display, whose state may be newer than the events of this frame.
  ImGuiIO& io = ImGui::GetIO();
  io.MousePos = mouse_;
  for (std::size_t i = 0; i < is_down_.size(); ++i) io.MouseDown[i] = is_down_.at(i);
  ImGui::NewFrame();
  // ImGui counts clicks by frame times, which are late during long frames. The events have the exact times.
  for (std::size_t i = 0; i < clicks_.size(); ++i) {
    const int clicks = std::exchange(clicks_.at(i), 0);
    if (clicks == 0 || !io.MouseClicked[i]) continue;
    io.MouseClickedCount[i] = io.MouseClickedLastCount[i] = static_cast<ImU16>(clicks);
    io.MouseDoubleClicked[i] = clicks == 2;
  }
}

const ImDrawData& Gui::end_frame() {
  ImGui::Render();
  return *ImGui::GetDrawData();
}

}  // namespace quoin::viewer
