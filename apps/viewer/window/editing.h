#pragma once

#include "view_state.h"

namespace quoin::viewer {

/// Turns presses and moves of the mouse into strokes, once a frame and only when the picture's rays are up to date.
class Editing {
 public:
  void press(const MousePlace& mouse);
  void move(const MousePlace& mouse);
  void release() { is_released_ = true; }
  [[nodiscard]] bool is_busy() const { return is_pressed_; }

  /// Does what can be done of what was asked for.
  void advance(ViewState& state);
  /// Ends a stroke, as far as it has come.
  void abandon(ViewState& state);

 private:
  void begin(ViewState& state);
  void go_on(ViewState& state);

  bool is_pressed_ = false;
  bool is_begun_ = false;
  bool is_moved_ = false;
  bool is_released_ = false;
  MousePlace from_;
  MousePlace to_;
};

/// One step back or forward.
void undo(ViewState& state);
void redo(ViewState& state);

}  // namespace quoin::viewer
