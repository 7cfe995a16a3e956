#pragma once

#include <SDL.h>

#include <set>
#include <vector>

#include "commands.h"
#include "editing.h"
#include "view_state.h"

namespace quoin::viewer {

/// Turns keyboard and mouse input into camera movements, strokes and commands.
class Input {
 public:
  /// Handles an event; the GUI takes mouse or keys if `gui_has_mouse` or `gui_has_keys`. Adds commands to `asked`.
  void process(const SDL_Event& event, ViewState& state, bool gui_has_mouse, bool gui_has_keys,
               std::vector<Command>& asked);

  /// Updates whether the mouse is over the image. Called once per frame, after the GUI has found the part under it.
  void find_mouse(ViewState& state, bool gui_has_mouse) const;

  /// Returns the direction of the held keys.
  [[nodiscard]] CameraPush push() const;
  [[nodiscard]] double boost() const;
  /// Releases all keys and buttons.
  void release_all();

  Editing editing;

 private:
  enum class Drag : std::uint8_t { None, Turn, Pan, Sun, Stroke };

  void key_down(const SDL_Keysym& key, bool gui_has_keys, std::vector<Command>& asked);
  void button_down(const SDL_MouseButtonEvent& button, ViewState& state);
  void motion(const SDL_MouseMotionEvent& motion, ViewState& state);
  void wheel(const SDL_MouseWheelEvent& wheel, ViewState& state);
  void end_drag();
  void note_mouse(int x, int y, ViewState& state, bool gui_has_mouse);

  std::set<SDL_Scancode> held_;
  Drag drag_ = Drag::None;
  Uint8 drag_button_ = 0;
  SDL_Point mouse_{0, 0};  // in the window's units
  bool is_in_window_ = false;
};

}  // namespace quoin::viewer
