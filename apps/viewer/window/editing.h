#pragma once

#include "view_state.h"

namespace quoin::viewer {

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

}  // namespace quoin::viewer
