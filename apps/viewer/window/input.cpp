#include "input.h"

#include <algorithm>
#include <array>

#include "viewer/sun.h"

namespace quoin::viewer {

namespace {

constexpr double kBoost = 4.0;

struct PushKey {
  SDL_Scancode code;
  CameraPush push;
};

// By scancode, independent of the keyboard layout.
constexpr std::array kPushKeys = {PushKey{SDL_SCANCODE_W, {0, 0, 1}},     PushKey{SDL_SCANCODE_S, {0, 0, -1}},
                                  PushKey{SDL_SCANCODE_D, {1, 0, 0}},     PushKey{SDL_SCANCODE_A, {-1, 0, 0}},
                                  PushKey{SDL_SCANCODE_E, {0, 1, 0}},     PushKey{SDL_SCANCODE_Q, {0, -1, 0}},
                                  PushKey{SDL_SCANCODE_SPACE, {0, 1, 0}}, PushKey{SDL_SCANCODE_UP, {0, 0, 1}},
                                  PushKey{SDL_SCANCODE_DOWN, {0, 0, -1}}, PushKey{SDL_SCANCODE_RIGHT, {1, 0, 0}},
                                  PushKey{SDL_SCANCODE_LEFT, {-1, 0, 0}}};

constexpr double kWalkersFov = 1.15;  // radians

}  // namespace

void ViewState::set_camera_mode(CameraMode mode) {
  if (mode == CameraMode::Walk && camera.mode != mode) {
    const DBox bounds = this->bounds(camera.camera().position);
    DVec3 feet(0.0);
    if (!bounds.empty()) {
      const DVec3 middle = 0.5 * bounds.min + 0.5 * bounds.max;
      feet = {middle.x, bounds.max.y, middle.z};
    }
    if (hover) feet = hover->position;
    walker.stand(feet, bounds);
    fov_before_walk = camera.camera().vertical_fov_radians;
    camera.look_level(kWalkersFov);
  }
  if (mode != CameraMode::Walk && camera.mode == CameraMode::Walk) camera.set_vertical_fov(fov_before_walk);
  camera.mode = mode;
  settings.camera_mode = mode;
}

void Input::note_mouse(int x, int y, ViewState& state, bool gui_has_mouse) {
  mouse_ = {x, y};
  is_in_window_ = true;
  find_mouse(state, gui_has_mouse);
}

void Input::find_mouse(ViewState& state, bool gui_has_mouse) const {
  MousePosition& place = state.mouse;
  // The middle of the pixel.
  place.x = (mouse_.x + 0.5) * state.pixels_per_unit - state.image_place.x;
  place.y = (mouse_.y + 0.5) * state.pixels_per_unit - state.image_place.y;
  const bool is_inside = place.x >= 0 && place.y >= 0 && place.x < state.image_place.w && place.y < state.image_place.h;
  place.is_over = is_in_window_ && is_inside && (!gui_has_mouse || drag_ != Drag::None);
}

void Input::process(const SDL_Event& event, ViewState& state, bool gui_has_mouse, bool gui_has_keys,
                    std::vector<Command>& asked) {
  switch (event.type) {
    case SDL_KEYDOWN:
      key_down(event.key.keysym, gui_has_keys, asked);
      break;
    case SDL_KEYUP:
      held_.erase(event.key.keysym.scancode);
      break;
    case SDL_MOUSEBUTTONDOWN:
      note_mouse(event.button.x, event.button.y, state, gui_has_mouse);
      if (state.mouse.is_over && drag_ == Drag::None) button_down(event.button, state);
      break;
    case SDL_MOUSEBUTTONUP:
      if (drag_ != Drag::None && event.button.button == drag_button_) end_drag();
      break;
    case SDL_MOUSEMOTION:
      note_mouse(event.motion.x, event.motion.y, state, gui_has_mouse);
      motion(event.motion, state);
      break;
    case SDL_MOUSEWHEEL:
      if (!gui_has_mouse && state.mouse.is_over) wheel(event.wheel, state);
      break;
    case SDL_WINDOWEVENT:
      if (event.window.event == SDL_WINDOWEVENT_FOCUS_LOST) release_all();
      if (event.window.event == SDL_WINDOWEVENT_LEAVE) is_in_window_ = false;
      break;
    default:
      break;
  }
}

void Input::key_down(const SDL_Keysym& key, bool gui_has_keys, std::vector<Command>& asked) {
  if (gui_has_keys) return;
  if (const auto command = command_of(key)) asked.push_back(*command);
  if ((key.mod & (KMOD_CTRL | KMOD_GUI | KMOD_ALT)) == 0) held_.insert(key.scancode);
}

void Input::button_down(const SDL_MouseButtonEvent& button, ViewState& state) {
  const bool has_shift = (SDL_GetModState() & KMOD_SHIFT) != 0;
  const bool has_alt = (SDL_GetModState() & KMOD_ALT) != 0;
  const bool is_left = button.button == SDL_BUTTON_LEFT;
  if (!is_left && button.button != SDL_BUTTON_RIGHT && button.button != SDL_BUTTON_MIDDLE) return;
  drag_button_ = button.button;
  drag_ = Drag::Turn;
  if (button.button == SDL_BUTTON_MIDDLE) drag_ = Drag::Pan;
  if (button.button == SDL_BUTTON_RIGHT && has_shift) drag_ = Drag::Sun;
  if (is_left && state.tool != Tool::Look && !has_alt) drag_ = Drag::Stroke;
  if (drag_ == Drag::Stroke) editing.press(state.mouse);
  // Turning around the grabbed point feels natural.
  const bool turns_about = state.camera.mode == CameraMode::Orbit || drag_ == Drag::Pan;
  if ((drag_ == Drag::Turn || drag_ == Drag::Pan) && turns_about && state.hover) {
    state.camera.set_pivot(state.hover->position);
  }
  SDL_CaptureMouse(SDL_TRUE);
}

void Input::motion(const SDL_MouseMotionEvent& motion, ViewState& state) {
  const double dx = motion.xrel * state.pixels_per_unit;
  const double dy = motion.yrel * state.pixels_per_unit;
  switch (drag_) {
    case Drag::None:
      break;
    case Drag::Turn:
      state.camera.turn(dx, dy, state.image_place.h);
      break;
    case Drag::Pan:
      state.camera.pan(dx, dy, state.image_place.h);
      break;
    case Drag::Sun:
      state.environment().sun.direction = drag_sun(state.environment(), dx, dy);
      break;
    case Drag::Stroke:
      editing.move(state.mouse);
      break;
  }
}

void Input::wheel(const SDL_MouseWheelEvent& wheel, ViewState& state) {
  const double notches = wheel.preciseY != 0.0F ? static_cast<double>(wheel.preciseY) : wheel.y;
  if (state.camera.mode == CameraMode::Fly) {
    state.camera.change_speed(notches);
    return;
  }
  if (state.camera.mode == CameraMode::Walk) {
    state.walker.grow(notches);
    return;
  }
  state.camera.zoom(notches, state.hover ? std::optional(state.hover->position) : std::nullopt);
}

void Input::end_drag() {
  if (drag_ == Drag::Stroke) editing.release();
  drag_ = Drag::None;
  SDL_CaptureMouse(SDL_FALSE);
}

CameraPush Input::push() const {
  CameraPush sum;
  for (const PushKey& key : kPushKeys) {
    if (!held_.contains(key.code)) continue;
    sum.right += key.push.right;
    sum.up += key.push.up;
    sum.forward += key.push.forward;
  }
  return sum;
}

double Input::boost() const {
  return held_.contains(SDL_SCANCODE_LSHIFT) || held_.contains(SDL_SCANCODE_RSHIFT) ? kBoost : 1.0;
}

void Input::release_all() {
  held_.clear();
  if (drag_ != Drag::None) end_drag();
}

}  // namespace quoin::viewer
