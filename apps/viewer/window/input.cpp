#include "input.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "viewer/settings.h"

namespace quoin::viewer {
namespace {

constexpr std::array kCommands = {
    CommandInfo{Command::Open, "Open...", "Ctrl+O", SDLK_o, true, false},
    CommandInfo{Command::Save, "Save", "Ctrl+S", SDLK_s, true, false},
    CommandInfo{Command::SaveAs, "Save as...", "Ctrl+Shift+S", SDLK_s, true, true},
    CommandInfo{Command::Screenshot, "Save the image", "F12", SDLK_F12, false, false},
    CommandInfo{Command::Quit, "Quit", "Ctrl+Q", SDLK_q, true, false},
    CommandInfo{Command::Undo, "Undo", "Ctrl+Z", SDLK_z, true, false},
    CommandInfo{Command::Redo, "Redo", "Ctrl+Y", SDLK_y, true, false},
    CommandInfo{Command::ToolLook, "Look", "1", SDLK_1, false, false},
    CommandInfo{Command::ToolPlace, "Place", "2", SDLK_2, false, false},
    CommandInfo{Command::ToolRemove, "Remove", "3", SDLK_3, false, false},
    CommandInfo{Command::ToolPaint, "Paint", "4", SDLK_4, false, false},
    CommandInfo{Command::ToolSmooth, "Smooth (fields)", "5", SDLK_5, false, false},
    CommandInfo{Command::ToolFlatten, "Flatten (fields)", "6", SDLK_6, false, false},
    CommandInfo{Command::BrushSmaller, "Smaller brush", "[", SDLK_LEFTBRACKET, false, false},
    CommandInfo{Command::BrushLarger, "Larger brush", "]", SDLK_RIGHTBRACKET, false, false},
    CommandInfo{Command::BrushShape, "Box or sphere", "B", SDLK_b, false, false},
    CommandInfo{Command::PickType, "Pick the voxel under the mouse", "I", SDLK_i, false, false},
    CommandInfo{Command::CameraMode, "Orbit, fly or walk", "C", SDLK_c, false, false},
    CommandInfo{Command::Focus, "Look at the point under the mouse", "F", SDLK_f, false, false},
    CommandInfo{Command::ViewIso, "Show all", "Home", SDLK_HOME, false, false},
    CommandInfo{Command::ViewFront, "From the front", "Shift+1", SDLK_1, false, true},
    CommandInfo{Command::ViewBack, "From the back", "Shift+2", SDLK_2, false, true},
    CommandInfo{Command::ViewLeft, "From the left", "Shift+3", SDLK_3, false, true},
    CommandInfo{Command::ViewRight, "From the right", "Shift+4", SDLK_4, false, true},
    CommandInfo{Command::ViewTop, "From above", "Shift+5", SDLK_5, false, true},
    CommandInfo{Command::DrawRays, "Ray marching", "F5", SDLK_F5, false, false},
    CommandInfo{Command::DrawBlocks, "Blocky meshes", "F6", SDLK_F6, false, false},
    CommandInfo{Command::DrawSmooth, "Smooth meshes", "F7", SDLK_F7, false, false},
    CommandInfo{Command::DrawDensity, "Density slice", "F4", SDLK_F4, false, false},
    CommandInfo{Command::DrawPaths, "Path tracing", "F3", SDLK_F3, false, false},
    CommandInfo{Command::NextWireframe, "Triangle edges", "F8", SDLK_F8, false, false},
    CommandInfo{Command::NextShading, "Next shading (lit, unlit, occlusion, normals)", "F9", SDLK_F9, false, false},
    CommandInfo{Command::DetailColours, "Level-of-detail colours", "F10", SDLK_F10, false, false},
    CommandInfo{Command::Panel, "Panel", "F2", SDLK_F2, false, false},
    CommandInfo{Command::Help, "Keys and mouse", "F1", SDLK_F1, false, false},
};

}  // namespace

std::span<const CommandInfo> commands() {
  return kCommands;
}

const CommandInfo& info_of(Command command) {
  for (const CommandInfo& info : kCommands) {
    if (info.command == command) return info;
  }
  return kCommands.front();
}

std::optional<Command> command_of(const SDL_Keysym& key) {
  const bool has_control = (key.mod & (KMOD_CTRL | KMOD_GUI)) != 0;
  const bool has_shift = (key.mod & KMOD_SHIFT) != 0;
  if (has_control && has_shift && key.sym == SDLK_z) return Command::Redo;
  for (const CommandInfo& info : kCommands) {
    if (info.key == key.sym && info.with_control == has_control && info.with_shift == has_shift) return info.command;
  }
  return std::nullopt;
}

namespace {

constexpr double kPixelsPerTouch = 4.0;  // when painting: leaves no gaps at usual distances
constexpr int kMaxTouches = 128;

std::optional<SceneHit> pick_at(ViewState& state, double x, double y) {
  return state.open.backend->pick(state.camera.camera(), x, y, state.image_place.w, state.image_place.h);
}

std::optional<BrushAction> action_of(Tool tool) {
  switch (tool) {
    case Tool::Look:
      return std::nullopt;
    case Tool::Place:
      return BrushAction::Place;
    case Tool::Remove:
      return BrushAction::Remove;
    case Tool::Paint:
      return BrushAction::Paint;
    case Tool::Smooth:
      return BrushAction::Smooth;
    case Tool::Flatten:
      return BrushAction::Flatten;
  }
  return std::nullopt;
}

/// Notes that an edit changes all instances of the model, if it has several.
void report_copies(ViewState& state, const SceneHit& hit) {
  const Instance* touched = state.scene().instances().find(hit.instance);
  if (touched == nullptr) return;
  int copies = 0;
  state.scene().instances().for_each([&](InstanceHandle, const Instance& instance) {
    if (instance.grid == touched->grid) ++copies;
  });
  if (copies > 1) state.report("this model has " + std::to_string(copies) + " instances: all of them change");
}

constexpr const char* kNotInMemory = "the edited chunks are not loaded: go back there first";

/// Runs `edit` on the document while rendering is paused. `edit` returns true if it changed anything; so does this.
template <class Edit>
bool edit_paused(ViewState& state, Edit edit) {
  ScenePause pause(*state.open.backend);
  state.last_wait_seconds = pause.waited_seconds();
  state.longest_wait_seconds = std::max(state.longest_wait_seconds, pause.waited_seconds());
  pause.changed = edit(*state.open.document);
  if (pause.changed) {
    state.stats.is_settled = false;
    state.edited_at = std::chrono::steady_clock::now();
  }
  return pause.changed;
}

}  // namespace

void Editing::press(const MousePosition& mouse) {
  *this = {};
  is_pressed_ = true;
  from_ = to_ = mouse;
}

void Editing::move(const MousePosition& mouse) {
  if (!is_pressed_) return;
  to_ = mouse;
  is_moved_ = true;
}

void Editing::advance(ViewState& state) {
  if (!is_pressed_ || !state.can_edit() || !state.has_image_place()) return;
  if (!is_begun_) {
    if (!state.open.backend->is_up_to_date()) return;
    begin(state);
  }
  const Brush* brush = state.open.document->stroke_brush();
  const bool needs_rays = brush != nullptr && follows_surface(brush->action);
  if (is_moved_ && brush != nullptr) {
    if (needs_rays && !state.open.backend->is_up_to_date()) return;
    go_on(state);
  }
  if (is_released_) abandon(state);
}

void Editing::begin(ViewState& state) {
  is_begun_ = true;
  const auto action = action_of(state.tool);
  const auto hit = action ? pick_at(state, from_.x, from_.y) : std::nullopt;
  if (!hit) return;
  if (const char* const why = state.open.document->why_not_edited()) {
    return state.report("cannot edit this world: " + std::string(why));
  }
  report_copies(state, *hit);
  Brush brush = state.brush;
  brush.action = *action;
  const Ray ray = ray_through(state.camera.camera(), {from_.x, from_.y, state.image_place.w, state.image_place.h});
  edit_paused(state, [&](Document& document) {
    if (!document.begin_stroke(brush, *hit, ray.direction)) {
      const bool is_of_fields = *action == BrushAction::Smooth || *action == BrushAction::Flatten;
      state.report(is_of_fields && !hit->in_field ? "cannot smooth or flatten blocks: only smooth ground"
                                                  : "no voxel type to place: choose a colour");
    }
    return true;
  });
}

void Editing::go_on(ViewState& state) {
  const double length = std::hypot(to_.x - from_.x, to_.y - from_.y);
  const bool is_painting = follows_surface(state.open.document->stroke_brush()->action);
  const int touches = is_painting ? std::clamp(static_cast<int>(length / kPixelsPerTouch), 1, kMaxTouches) : 1;
  std::vector<std::optional<SceneHit>> hits;
  for (int touch = 1; is_painting && touch <= touches; ++touch) {
    const double share = static_cast<double>(touch) / touches;
    hits.push_back(pick_at(state, from_.x + share * (to_.x - from_.x), from_.y + share * (to_.y - from_.y)));
  }
  const Ray ray = ray_through(state.camera.camera(), {to_.x, to_.y, state.image_place.w, state.image_place.h});
  edit_paused(state, [&](Document& document) {
    std::int64_t changed = 0;
    if (!is_painting) return document.drag_to(ray, std::nullopt) > 0;
    for (const auto& hit : hits) changed += document.drag_to(ray, hit);
    return changed > 0;
  });
  from_ = to_;
  is_moved_ = false;
}

void Editing::abandon(ViewState& state) {
  state.open.document->end_stroke();
  *this = {};
}

void undo(ViewState& state) {
  if (!state.can_edit()) return;
  if (!state.open.document->history().can_undo()) return state.report("nothing to undo");
  const std::string name = state.open.document->history().undo_name();
  if (!edit_paused(state, [](Document& document) { return document.undo(); })) return state.report(kNotInMemory);
  state.report("undone: " + name);
}

void redo(ViewState& state) {
  if (!state.can_edit()) return;
  if (!state.open.document->history().can_redo()) return state.report("nothing to redo");
  const std::string name = state.open.document->history().redo_name();
  if (!edit_paused(state, [](Document& document) { return document.redo(); })) return state.report(kNotInMemory);
  state.report("redone: " + name);
}

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
