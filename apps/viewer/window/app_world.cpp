#include "app.h"

#include <cstdio>

namespace quoin::viewer {

// Moves the chunks of a world on disk with the camera. If another thread renders, chunks move only after an image has
// arrived since the last move; otherwise no image would ever be finished. Nothing moves during a stroke, because it is
// one undo step.
void App::stream_world() {
  WorldWindow* const world = state_.open.document->world();
  if (world == nullptr || state_.saver || !state_.open.backend) return;
  ViewBackend& backend = *state_.open.backend;
  const Camera camera = state_.camera.camera();
  world->set_other_bytes(backend.bytes() + state_.open.document->history().bytes());
  report_world(world->plan(camera));
  if (unframed_ && world->is_complete()) frame_world();
  const bool may_move = has_seen_chunks_ || !asked_ || backend.fault().has_value();
  if (!world->has_chunks_to_move() || !may_move || state_.open.document->stroke_brush() != nullptr) return;
  const ChangeCursor before = state_.scene().cursor();
  ScenePause pause(backend);
  report_world(world->move(camera));
  pause.changed = state_.scene().has_changed_since(before);
  if (!pause.changed) return;
  has_seen_chunks_ = false;
  state_.stats.is_settled = false;
}

// Frames a small world like any other scene once it is loaded, unless the user has moved the camera.
void App::frame_world() {
  if (state_.camera.camera() == *unframed_) show_from(View::Iso);
  unframed_.reset();
}

void App::report_world(const Status& saving) {
  state_.open.document->note_saving(saving);
  const std::string text = saving ? "" : to_string(saving.error());
  if (text != reported_saving_ && !saving) state_.report(saving.error());
  reported_saving_ = text;
  const std::vector<std::string> problems = state_.open.document->world()->take_problems();
  if (problems.empty()) return;
  if (!options_.screenshot.empty()) {
    for (const std::string& problem : problems) std::fprintf(stderr, "quoin: warning: %s\n", problem.c_str());
  }
  const std::size_t more = problems.size() - 1;
  state_.message = Message{problems.front() + (more > 0 ? " (and " + std::to_string(more) + " more)" : ""), true};
}

Status App::save_world() {
  WorldWindow* const world = state_.open.document->world();
  if (world == nullptr || !world->why_not_written().empty()) return {};
  Status saved = world->flush();
  report_world(saved);
  return saved;
}

// Returns true while chunks are loading or an edit waits to be saved, so that frames must continue.
bool App::is_streaming() const {
  constexpr std::chrono::seconds kUntilSaved{3};
  const WorldWindow* const world = state_.open.document->world();
  if (world == nullptr || state_.saver || !state_.open.backend) return false;
  return !world->is_complete() || Clock::now() - state_.edited_at < kUntilSaved;
}

// Returns false if the walker must wait for the ground below.
bool App::has_ground() const {
  const WorldWindow* const world = state_.open.document->world();
  return world == nullptr || world->is_loaded_at(state_.walker.feet());
}

}  // namespace quoin::viewer
