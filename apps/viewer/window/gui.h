#pragma once

#include <SDL.h>
#include <imgui.h>

#include <array>

#include "screen.h"

namespace quoin::viewer {

/// Dear ImGui for a screen, which draws it.
class Gui {
 public:
  /// `scale` enlarges everything; `screen` must outlive it.
  Gui(Screen& screen, double scale);
  Gui(const Gui&) = delete;
  Gui& operator=(const Gui&) = delete;
  ~Gui();

  void process(const SDL_Event& event);
  void begin_frame();
  /// Returns the drawing commands since `begin_frame`, valid until the next `begin_frame`.
  const ImDrawData& end_frame();

  /// Returns the outcome of opening the GUI. Errors: those of Screen::open_gui.
  [[nodiscard]] const Status& status() const { return status_; }
  [[nodiscard]] double scale() const { return scale_; }
  [[nodiscard]] bool wants_mouse() const { return ImGui::GetIO().WantCaptureMouse; }
  [[nodiscard]] bool wants_keys() const { return ImGui::GetIO().WantTextInput; }

 private:
  void load_font();
  void note_button(const SDL_MouseButtonEvent& button);

  Screen* screen_;
  double scale_;
  Status status_;
  ImVec2 mouse_{-1e6F, -1e6F};
  std::array<bool, 3> is_down_{};  // left, right, middle, after the events so far
  std::array<int, 3> clicks_{};    // SDL's click counts of the buttons pressed since the last frame
};

/// Returns the GUI scale for the display that shows the screen's window: 1 at about 96 dots per inch.
[[nodiscard]] double scale_of_display(const Screen& screen);

}  // namespace quoin::viewer
