#include "app.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <thread>
#include <utility>

namespace quoin::viewer {

namespace {

constexpr int kFramesAfterEvents = 3;  // frames that the GUI needs to settle
constexpr int kPatience = 250;         // milliseconds until an interrupt is noticed
constexpr int kPatienceOfBars = 60;
constexpr double kFrameSeconds = 1.0 / 60.0;

double seconds_between(std::chrono::steady_clock::time_point from, std::chrono::steady_clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

std::optional<View> view_of(Command command) {
  switch (command) {
    case Command::ViewFront:
      return View::Front;
    case Command::ViewBack:
      return View::Back;
    case Command::ViewLeft:
      return View::Left;
    case Command::ViewRight:
      return View::Right;
    case Command::ViewTop:
      return View::Top;
    case Command::ViewIso:
      return View::Iso;
    default:
      return std::nullopt;
  }
}

std::optional<Tool> tool_of(Command command) {
  switch (command) {
    case Command::ToolLook:
      return Tool::Look;
    case Command::ToolPlace:
      return Tool::Place;
    case Command::ToolRemove:
      return Tool::Remove;
    case Command::ToolPaint:
      return Tool::Paint;
    case Command::ToolSmooth:
      return Tool::Smooth;
    case Command::ToolFlatten:
      return Tool::Flatten;
    default:
      return std::nullopt;
  }
}

void change_brush(Command command, Brush& brush) {
  if (command == Command::BrushSmaller) brush.radius = std::max(brush.radius - 1, 0);
  if (command == Command::BrushLarger) brush.radius = std::min(brush.radius + 1, kMaxBrush);
  if (command != Command::BrushShape) return;
  brush.shape = brush.shape == BrushShape::Box ? BrushShape::Sphere : BrushShape::Box;
}

}  // namespace

App::App(const ViewerOptions& options, Settings settings, std::unique_ptr<Screen> screen)
    : options_(options),
      screen_(std::move(screen)),
      gui_(std::make_unique<Gui>(*screen_, settings.ui_scale > 0.0 ? settings.ui_scale : scale_of_display(*screen_))) {
  state_.camera.mode = settings.camera_mode;
  state_.settings = std::move(settings);
  if (!gui_->status()) stand_in(Error(gui_->status().error()));
  if (options_.mode) state_.settings.mode = *options_.mode;
  if (options_.light) state_.settings.light.model = *options_.light;
  if (const auto renderer = screen_->renderer(); renderer && renderer->device().kind == "cpu" && !options_.is_bare) {
    state_.report(renderer->device().name + " is a slow software device; --backend auto is faster");
  }
  state_.has_named_packs = options_.uses_own_packs;
  if (!options_.file.empty()) load(options_.file);
}

App::~App() {
  close();
}

// Closes the window first, because threads may take a moment to end.
void App::close() {
  SDL_HideWindow(screen_->window());
  state_.saver.reset();
}

bool App::ends_late() {
  close();
  const bool reads = state_.loader != nullptr || state_.pack_loader != nullptr || !abandoned_.empty();
  return reads || (state_.open.backend && state_.open.backend->ends_late());
}

Status App::run(const std::function<bool()>& is_interrupted) {
  while (is_running_) {
    wait_and_process();
    if (is_interrupted && is_interrupted()) break;
    if (frames_left_ > 0 || is_animating()) {
      frame();
      frames_left_ = std::max(frames_left_ - 1, 0);
    }
  }
  note_size();
  show_detail(false);
  forget_slow_mode();
  // The process may end without destructors from here on.
  state_.saver.reset();
  if (Status saved = save_world(); !saved && status_) status_ = saved;
  return status_;
}

// Resets a slow mode, so that the next file does not start in it.
void App::forget_slow_mode() {
  if (state_.open.backend && state_.open.backend->is_slow(state_.settings.mode)) state_.settings.mode = DrawMode::Rays;
}

void App::note_size() {
  const bool is_given = options_.width > 0;
  const Uint32 odd = SDL_WINDOW_MAXIMIZED | SDL_WINDOW_MINIMIZED | SDL_WINDOW_FULLSCREEN;
  if (is_given || (SDL_GetWindowFlags(screen_->window()) & odd) != 0) return;
  SDL_GetWindowSize(screen_->window(), &state_.settings.width, &state_.settings.height);
}

// Returns true if the next frame should follow at once.
bool App::is_moving() const {
  const bool is_drawing = state_.open.backend && state_.open.backend->wants_frames();
  const bool is_falling = state_.camera.mode == CameraMode::Walk && state_.walker.is_moving();
  return is_drawing || is_falling || state_.camera.is_gliding() || !input_.push().is_zero() || input_.editing.is_busy();
}

bool App::is_animating() const {
  if (screen_->is_minimised()) return is_streaming();
  return is_moving() || is_streaming() || state_.loader || state_.saver || state_.pack_loader || state_.message ||
         state_.waiting_since || ImGui::GetIO().WantTextInput;
}

int App::patience_milliseconds() const {
  if (frames_left_ > 0 && !screen_->is_minimised()) return 0;
  if (!is_animating()) return kPatience;
  return (is_moving() || is_streaming()) && !screen_->is_minimised() ? 0 : kPatienceOfBars;
}

void App::wait_and_process() {
  const int patience = postponed_ ? 0 : patience_milliseconds();
  was_idle_ = patience > 0;
  SDL_Event event;
  bool has_event = true;
  if (postponed_) {
    event = *std::exchange(postponed_, std::nullopt);
  } else {
    has_event = patience > 0 ? SDL_WaitEventTimeout(&event, patience) != 0 : SDL_PollEvent(&event) != 0;
  }
  std::set<SDL_Scancode> pressed;
  std::set<Uint8> used_buttons;
  bool is_mouse_moved = false;
  for (; has_event; has_event = SDL_PollEvent(&event) != 0) {
    // The GUI reads keys and buttons once per frame: it would miss a key or a button that is released within a frame,
    // and a click of a double click. It also finds the part under the mouse there, which a click depends on.
    const bool is_let_go = event.type == SDL_KEYUP && pressed.contains(event.key.keysym.scancode);
    const bool is_button = event.type == SDL_MOUSEBUTTONDOWN || event.type == SDL_MOUSEBUTTONUP;
    const bool is_second_use = is_button && used_buttons.contains(event.button.button);
    if (is_let_go || is_second_use || (event.type == SDL_MOUSEBUTTONDOWN && is_mouse_moved)) {
      postponed_ = event;
      return;
    }
    if (event.type == SDL_KEYDOWN) pressed.insert(event.key.keysym.scancode);
    if (is_button) used_buttons.insert(event.button.button);
    is_mouse_moved |= event.type == SDL_MOUSEMOTION;
    process(event);
  }
}

void App::process(const SDL_Event& event) {
  frames_left_ = std::max(frames_left_, is_wake(event) ? 1 : kFramesAfterEvents);
  // Tab would give the keyboard to the first number field of the panel and stop the flight.
  const bool is_tab = event.type == SDL_KEYDOWN && event.key.keysym.sym == SDLK_TAB;
  if (!is_tab || gui_->wants_keys()) gui_->process(event);
  if (event.type == SDL_QUIT) leave({true, {}});
  if (event.type == SDL_DROPFILE) {
    const std::filesystem::path file = event.drop.file;
    SDL_free(event.drop.file);
    leave({false, file});
  }
  std::vector<Command> asked;
  const bool is_modal = chooser_.is_shown() || leaving_ || state_.loader;
  input_.process(event, state_, gui_->wants_mouse() || is_modal, gui_->wants_keys() || is_modal, asked);
  for (const Command command : asked) run_command(command);
}

void App::frame() {
  const Clock::time_point now = Clock::now();
  const double elapsed = seconds_between(last_frame_, now);
  last_frame_ = now;
  // After an idle period the first time step has the usual length.
  const double step = was_idle_ ? kFrameSeconds : std::min(elapsed, 0.1);
  take_loaded();
  take_saved();
  take_packed();
  stream_world();
  if (screen_->is_minimised()) return;
  if (state_.camera.mode == CameraMode::Walk) {
    if (has_ground())
      state_.walker.advance(step, input_.push(), input_.boost(), state_.camera,
                            [&](const OrientedBox& box, DVec3 way, const SlideOptions& options) {
                              return state_.open.backend ? state_.open.backend->slide(box, way, options) : std::nullopt;
                            });
  } else {
    state_.camera.advance(step, input_.push(), input_.boost());
  }
  input_.editing.advance(state_);
  state_.pixels_per_unit = screen_->pixels_per_unit();
  gui_->begin_frame();
  input_.find_mouse(state_, gui_->wants_mouse());
  draw_gui();
  ask_for_image();
  take_image();
  if (Status shown = screen_->show(state_.image_place, gui_->end_frame()); !shown) stand_in(shown.error());
  update_title();
  state_.frame_seconds += 0.1 * (seconds_between(last_frame_, Clock::now()) - state_.frame_seconds);
  pace();
}

void App::pace() {
  if (screen_->has_vsync()) return;
  const double left = kFrameSeconds - seconds_between(last_frame_, Clock::now());
  if (left > 0.001) std::this_thread::sleep_for(std::chrono::duration<double>(left));
}

void App::place_image(float top, float right, float bottom) {
  const SDL_Point output = screen_->output_size();
  const auto pixels = [this](float units) { return static_cast<int>(std::lround(units * state_.pixels_per_unit)); };
  state_.image_place = {0, pixels(top), std::max(output.x - pixels(right), 0),
                        std::max(output.y - pixels(top) - pixels(bottom), 0)};
}

ViewRequest App::request_now() const {
  ViewRequest request;
  request.camera = state_.camera.camera();
  request.width = state_.image_place.w;
  request.height = state_.image_place.h;
  request.light = state_.settings.light;
  request.samples = state_.settings.samples;
  request.detail_by_pixels = state_.settings.detail_by_pixels;
  request.detail_colours = state_.settings.detail_colours;
  request.mode = state_.settings.mode;
  request.wireframe = state_.settings.wireframe;
  request.slice = state_.settings.slice;
  request.environment = state_.environment();
  request.exposure = state_.settings.exposure;
  request.render_settings = state_.open.render_settings;
  return request;
}

void App::ask_for_image() {
  if (!state_.open.backend || !state_.has_image_place()) return;
  const ViewRequest request = request_now();
  // The image drawn before belongs to another request, even if it had settled.
  if (!asked_ || !is_same(*asked_, request)) state_.stats.is_settled = false;
  asked_ = request;
  state_.open.backend->show(request);
}

void App::take_image() {
  if (!state_.open.backend) return;
  if (auto frame = state_.open.backend->take()) take_frame(std::move(*frame));
  take_fault();
  save_wanted_images();
  if (!options_.screenshot.empty() && is_settled() && is_running_) {
    is_running_ = false;
    write_screenshot(options_.screenshot);
  }
}

bool App::is_settled() const {
  const WorldWindow* const world = state_.open.document->world();
  return (world == nullptr || world->is_complete()) && state_.stats.is_settled &&
         state_.stats.width == state_.image_place.w && state_.stats.height == state_.image_place.h;
}

void App::take_frame(ViewFrame frame) {
  const int width = frame.on_device ? frame.on_device->width() : frame.colour.width;
  const int height = frame.on_device ? frame.on_device->height() : frame.colour.height;
  state_.stats = {width, height, frame.samples, frame.is_settled, frame.seconds, frame.rays};
  has_seen_chunks_ = true;
  if (Status taken = screen_->show_image(frame); !taken) {
    screen_->forget_image();
    state_.report(taken.error());
  }
  // This frame's status line is already drawn. If the image is final, it would not be drawn again.
  if (frame.is_settled) frames_left_ = std::max(frames_left_, 2);
  state_.image = std::move(frame);
}

// A fault lasts until the next request and is shown once.
void App::take_fault() {
  const auto fault = state_.open.backend->fault();
  const std::string text = fault ? to_string(*fault) : "";
  if (text == std::exchange(reported_error_, text) || !fault) return;
  state_.report(*fault);
  if (!options_.screenshot.empty()) end_with(*fault);
  if (state_.why_not_drawn_as(state_.settings.mode) != nullptr) state_.settings.mode = DrawMode::Rays;
}

Result<std::shared_ptr<VulkanRenderer>> App::open_device() {
  if (auto of_screen = screen_->renderer()) return of_screen;
  if (renderer_) return renderer_;
  VulkanOptions options;
  options.device = options_.device;
  auto made = VulkanRenderer::create(options);
  if (!made) return made.error();
  renderer_ = std::make_shared<VulkanRenderer>(std::move(*made));
  return renderer_;
}

// After the device that shows the window has failed, SDL shows the window and the processor draws.
void App::stand_in(const Error& why) {
  if (!screen_->renderer()) return end_with(why);
  const SDL_Point size = [this] {
    SDL_Point now{0, 0};
    SDL_GetWindowSize(screen_->window(), &now.x, &now.y);
    return now;
  }();
  auto other = open_sdl_screen(size.x, size.y);
  if (!other) return end_with(other.error());
  const double scale = gui_->scale();
  state_.image = {};
  state_.stats = {};
  if (state_.open.backend) state_.open.backend->forget_device();
  gui_.reset();
  screen_ = std::move(*other);
  gui_ = std::make_unique<Gui>(*screen_, scale);
  if (!gui_->status()) end_with(gui_->status().error());
  state_.settings.mode = DrawMode::Rays;
  state_.report(why);
}

void App::end_with(const Error& error) {
  status_ = error;
  is_running_ = false;
}

void App::update_hover() {
  if (!state_.open.backend || input_.editing.is_busy()) return;
  if (!state_.mouse.is_over) {
    state_.hover.reset();
    return;
  }
  if (!state_.open.backend->is_up_to_date()) return;
  state_.hover = state_.open.backend->pick(state_.camera.camera(), state_.mouse.x, state_.mouse.y, state_.image_place.w,
                                           state_.image_place.h);
}

void App::update_title() {
  screen_->set_title(std::string(state_.open.document->is_dirty() ? "* " : "") + state_.open.document->name() +
                     " - Quoin");
}

void App::run_command(Command command) {
  if (run_draw_command(command)) return;
  if (const auto view = view_of(command)) return show_from(*view);
  if (const auto tool = tool_of(command)) {
    state_.tool = *tool;
    return;
  }
  switch (command) {
    case Command::Undo:
      return undo(state_);
    case Command::Redo:
      return redo(state_);
    case Command::BrushSmaller:
    case Command::BrushLarger:
    case Command::BrushShape:
      return change_brush(command, state_.brush);
    case Command::PickType:
      return pick_type();
    case Command::CameraMode:
      switch (state_.camera.mode) {
        case CameraMode::Orbit:
          return state_.set_camera_mode(CameraMode::Fly);
        case CameraMode::Fly:
          return state_.set_camera_mode(CameraMode::Walk);
        case CameraMode::Walk:
          return state_.set_camera_mode(CameraMode::Orbit);
      }
      return;
    case Command::Focus:
      if (state_.hover) state_.camera.face(state_.hover->position);
      return;
    case Command::Panel:
      state_.settings.is_panel_shown = !state_.settings.is_panel_shown;
      return;
    case Command::Help:
      state_.is_help_shown = !state_.is_help_shown;
      return;
    default:
      return run_file_command(command);
  }
}

void App::show_from(View view) {
  if (!state_.open.backend || !state_.has_image_place()) return;
  const double aspect = static_cast<double>(state_.image_place.w) / state_.image_place.h;
  look_through(frame_scene(state_.scene(), view, aspect, options_.instances()));
}

void App::look_through(const Camera& camera) {
  if (state_.camera.mode == CameraMode::Walk) state_.set_camera_mode(CameraMode::Orbit);
  state_.camera.set(camera, state_.bounds(camera.position, options_.instances()));
}

void App::pick_type() {
  if (!state_.hover) return state_.report("no voxel under the mouse");
  const SceneHit& hit = *state_.hover;
  const Instance* const instance = state_.scene().instances().find(hit.instance);
  const SceneGrid* const grid = instance == nullptr ? nullptr : state_.scene().grids().find(instance->grid);
  if (hit.in_field || grid == nullptr) return state_.brush.choose(hit.type);
  // A picked state stays as it is; voxels of types without states turn to the face.
  const VoxelType type = hit.type;
  const bool has_state = type < state_.scene().types.size() && state_.scene().types[type].state_bits > 0;
  if (!has_state) return state_.brush.choose(type);
  state_.brush.choose(type, grid->grid.data(hit.voxel).state);
}

const char* ViewState::why_not_drawn_as(DrawMode mode) const {
  if (!open.backend) return nullptr;
  if (!open.backend->can_draw(mode)) return "cannot draw meshes: no graphics device";
  if (mode != DrawMode::Density) return nullptr;
  bool has_field = false;
  scene().grids().for_each([&](GridHandle, const SceneGrid& grid) { has_field |= grid.field.chunk_count() != 0; });
  return has_field ? nullptr : "cannot draw a density slice: the scene has no density field";
}

void App::draw_as(DrawMode mode) {
  if (const char* const why = state_.why_not_drawn_as(mode)) return state_.report(why);
  state_.settings.mode = mode;
}

// Shows the levels of detail in colours, and restores the settings afterwards.
void App::show_detail(bool is_shown) {
  Settings& settings = state_.settings;
  if (is_shown) {
    before_detail_ = BeforeDetail{settings.mode, settings.detail_by_pixels};
    settings.detail_by_pixels = true;
    draw_as(DrawMode::Rays);
    state_.report(kDetailLegend);
  } else if (before_detail_) {
    settings.detail_by_pixels = before_detail_->by_pixels;
    draw_as(before_detail_->mode);
    before_detail_.reset();
  }
  settings.detail_colours = is_shown;
}

bool App::run_draw_command(Command command) {
  Settings& settings = state_.settings;
  const auto next = [](auto value, int count) {
    return static_cast<decltype(value)>((static_cast<int>(value) + 1) % count);
  };
  switch (command) {
    case Command::DrawRays:
      draw_as(DrawMode::Rays);
      return true;
    case Command::DrawBlocks:
      draw_as(DrawMode::Blocks);
      return true;
    case Command::DrawSmooth:
      draw_as(DrawMode::Smooth);
      return true;
    case Command::DrawDensity:
      draw_as(DrawMode::Density);
      return true;
    case Command::DrawPaths:
      draw_as(DrawMode::Paths);
      return true;
    case Command::NextWireframe:
      settings.wireframe = next(settings.wireframe, 3);
      break;
    case Command::NextShading:
      settings.light.shading = next(settings.light.shading, 5);
      return true;
    case Command::DetailColours:
      show_detail(!settings.detail_colours);
      return true;
    default:
      return false;
  }
  if (!has_meshes(settings.mode)) {
    state_.report("switched to blocky meshes: only meshes have triangle edges");
    draw_as(DrawMode::Blocks);
  }
  return true;
}

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
  // A failed save gives one error, and stays failed until the next save.
  const bool has_failed = !saving || state_.open.document->world()->stats().has_save_failed;
  if (!saving || !has_failed) state_.open.document->note_saving(saving);
  const std::string text = saving ? reported_saving_ : to_string(saving.error());
  if (!saving && text != reported_saving_) state_.report(saving.error());
  reported_saving_ = has_failed ? text : "";
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

namespace {

/// Returns true if there is a device other than software devices.
bool has_graphics_card() {
  const auto devices = vulkan_devices();
  return devices && std::any_of(devices->begin(), devices->end(), [](const VulkanDeviceInfo& device) {
           return device.missing.empty() && device.kind != "cpu";
         });
}

/// Returns an error if the requested device is missing, before it is needed.
Status check_device(const std::string& device) {
  if (device.empty()) return {};
  VulkanOptions options;
  options.device = device;
  const auto made = VulkanRenderer::create(options);
  return made ? Status{} : made.error();
}

Result<std::unique_ptr<Screen>> open_screen(const ViewerOptions& options, int width, int height) {
  if (options.backend == ViewerBackend::Vulkan) return open_vulkan_screen(width, height, options.device);
  if (options.backend == ViewerBackend::Auto && has_graphics_card()) {
    auto screen = open_vulkan_screen(width, height, options.device);
    // If a graphics card cannot present to this display, the viewer starts without it; a device requested by name is
    // required.
    if (screen || !options.device.empty()) return screen;
  }
  if (Status there = check_device(options.device); !there) return there.error();
  return open_sdl_screen(width, height);
}

}  // namespace

Status run_viewer(const ViewerOptions& options, const std::function<bool()>& is_interrupted) {
  const std::filesystem::path path = options.is_bare ? std::filesystem::path() : settings_path();
  Settings settings = path.empty() ? Settings{} : read_settings(path);
  auto video = SdlVideo::start();
  if (!video) return video.error();
  const bool has_size = options.width > 0 && options.height > 0;
  auto screen =
      open_screen(options, has_size ? options.width : settings.width, has_size ? options.height : settings.height);
  if (!screen) return screen.error();
  App app(options, std::move(settings), std::move(*screen));
  if (Status status = app.run(is_interrupted); !status) return status;
  Status written = path.empty() ? Status() : write_settings(app.settings(), path);
  if (written && options.leave_at_once && app.ends_late()) options.leave_at_once();
  return written;
}

}  // namespace quoin::viewer
