#pragma once

#include <SDL.h>
#include <imgui.h>

#include "sdl_window.h"

namespace quoin::viewer {

/// Dear ImGui in an SdlWindow, drawn by SDL's own renderer.
class Gui {
 public:
  /// `scale` enlarges everything; `window` must outlive it.
  Gui(SdlWindow& window, double scale);
  Gui(const Gui&) = delete;
  Gui& operator=(const Gui&) = delete;
  ~Gui();

  void process(const SDL_Event& event);
  void begin_frame();
  /// Draws what was asked for since `begin_frame`.
  void end_frame();

  [[nodiscard]] double scale() const { return scale_; }
  [[nodiscard]] bool wants_mouse() const { return ImGui::GetIO().WantCaptureMouse; }
  [[nodiscard]] bool wants_keys() const { return ImGui::GetIO().WantTextInput; }

 private:
  void load_font();
  void draw(const ImDrawData& data);
  void draw(const ImDrawList& list, const ImDrawCmd& command, const ImDrawData& data);

  SdlWindow* window_;
  double scale_;
  SdlPointer<SDL_Texture> font_;
  ImVec2 mouse_{-1e6F, -1e6F};
};

/// How large things should be on the display that shows the window: 1 where it has some 96 dots an inch.
[[nodiscard]] double scale_of_display(const SdlWindow& window);

}  // namespace quoin::viewer
