#pragma once

#include <SDL.h>

namespace quoin::viewer {

/// Wakes the window's loop; may be called from any thread while SDL runs.
void wake_window();
/// Whether an event is of that kind.
[[nodiscard]] bool is_wake(const SDL_Event& event);

}  // namespace quoin::viewer
