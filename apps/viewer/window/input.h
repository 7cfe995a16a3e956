#pragma once

#include <SDL.h>

#include <set>
#include <vector>

#include "commands.h"
#include "editing.h"
#include "view_state.h"

namespace quoin::viewer {

/// Turns what keyboard and mouse do into movements of the camera, strokes and commands.
class Input {
 public:
  /// `gui_has_mouse` and `gui_has_keys`: something else than the picture takes them. Commands are added to `asked`.
  void process(const SDL_Event& event, ViewState& state, bool gui_has_mouse, bool gui_has_keys,
               std::vector<Command>& asked);

  /// Once a frame, when the GUI knows what the mouse is over: whether that is the picture.
  void find_mouse(ViewState& state, bool gui_has_mouse) const;

  /// Where the keys that are held push, and how hard.
  [[nodiscard]] CameraPush push() const;
  [[nodiscard]] double boost() const;
  /// As if all keys and buttons were let go.
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
