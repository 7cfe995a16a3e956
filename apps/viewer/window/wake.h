#pragma once

#include <SDL.h>

namespace quoin::viewer {

/// Wakes the window's loop. Can be called from any thread while SDL runs.
void wake_window();
/// Returns true if an event comes from `wake_window`.
[[nodiscard]] bool is_wake(const SDL_Event& event);

}  // namespace quoin::viewer
