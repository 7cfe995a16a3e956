#include "editing.h"

#include <algorithm>
#include <cmath>

namespace quoin::viewer {

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
  edit_paused(state, [&](Document& document) {
    if (!document.begin_stroke(brush, *hit)) {
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

}  // namespace quoin::viewer
