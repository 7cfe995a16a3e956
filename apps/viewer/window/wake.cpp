#include "wake.h"

namespace quoin::viewer {

namespace {

Uint32 wake_type() {
  static const Uint32 type = SDL_RegisterEvents(1);
  return type;
}

}  // namespace

void wake_window() {
  SDL_Event event{};
  event.type = wake_type();
  // A full queue wakes the loop anyway.
  SDL_PushEvent(&event);
}

bool is_wake(const SDL_Event& event) {
  return event.type == wake_type();
}

}  // namespace quoin::viewer
