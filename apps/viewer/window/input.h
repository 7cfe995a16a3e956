#pragma once

#include <SDL.h>

#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "view_state.h"

namespace quoin::viewer {

/// The commands of keys and menus.
enum class Command : std::uint8_t {
  Open,
  Save,
  SaveAs,
  Screenshot,
  Quit,
  Undo,
  Redo,
  ToolLook,
  ToolPlace,
  ToolRemove,
  ToolPaint,
  ToolSmooth,
  ToolFlatten,
  BrushSmaller,
  BrushLarger,
  BrushShape,
  PickType,
  CameraMode,
  Focus,
  ViewFront,
  ViewBack,
  ViewLeft,
  ViewRight,
  ViewTop,
  ViewIso,
  DrawRays,
  DrawBlocks,
  DrawSmooth,
  DrawDensity,
  DrawPaths,
  NextWireframe,
  NextShading,
  DetailColours,
  Panel,
  Help,
};

struct CommandInfo {
  Command command;
  const char* name;  ///< label in menus
  const char* keys;  ///< key names to show
  SDL_Keycode key;
  bool with_control;
  bool with_shift;
};

/// Returns all commands in the order of the help.
[[nodiscard]] std::span<const CommandInfo> commands();
[[nodiscard]] const CommandInfo& info_of(Command command);

/// Returns the command of a key, if it has one.
[[nodiscard]] std::optional<Command> command_of(const SDL_Keysym& key);

/// Turns mouse presses and moves into strokes, once per frame and only when picking is up to date.
class Editing {
 public:
  void press(const MousePosition& mouse);
  void move(const MousePosition& mouse);
  void release() { is_released_ = true; }
  [[nodiscard]] bool is_busy() const { return is_pressed_; }

  /// Applies the mouse input since the last call as far as possible.
  void advance(ViewState& state);
  /// Ends the stroke and keeps its edits so far.
  void abandon(ViewState& state);

 private:
  void begin(ViewState& state);
  void go_on(ViewState& state);

  bool is_pressed_ = false;
  bool is_begun_ = false;
  bool is_moved_ = false;
  bool is_released_ = false;
  MousePosition from_;
  MousePosition to_;
};

/// Undo or redo one step.
void undo(ViewState& state);
void redo(ViewState& state);

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
