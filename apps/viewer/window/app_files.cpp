#include "app.h"

#include <algorithm>
#include <utility>

#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>

#include "viewer/device_backend.h"

namespace quoin::viewer {

namespace {

/// Returns the first unused name of the form STEM-NUMBER.png in the working folder.
std::filesystem::path free_name(const std::string& stem) {
  std::error_code ignored;
  for (int number = 1; number < 10'000; ++number) {
    std::filesystem::path path = stem + "-" + std::to_string(number) + ".png";
    if (!std::filesystem::exists(path, ignored)) return path;
  }
  return stem + ".png";
}

Result<Image> image_of(const ViewFrame& frame) {
  return frame.on_device ? frame.on_device->read() : Result<Image>(frame.colour);
}

}  // namespace

void App::run_file_command(Command command) {
  switch (command) {
    case Command::Open:
      return leave({false, {}});
    case Command::Quit:
      return leave({true, {}});
    case Command::Screenshot:
      return want_image();
    case Command::Save:
      if (!state_.can_edit()) return;
      if (!state_.open.document->can_save_in_place()) return ask_where_to_save();
      return save(state_.open.document->path());
    case Command::SaveAs:
      return ask_where_to_save();
    default:
      return;
  }
}

void App::leave(Leaving leaving) {
  if (leaving_ || state_.saver) return;
  input_.editing.abandon(state_);
  leaving_ = std::move(leaving);
  (void)save_world();  // if that fails, the user is asked whether to discard the changes
  if (!state_.open.document->is_dirty()) go_on_leaving();
}

void App::go_on_leaving() {
  const Leaving leaving = *std::exchange(leaving_, std::nullopt);
  if (leaving.is_quit) {
    asked_.reset();
    save_wanted_images();
    is_running_ = false;
  } else if (!leaving.open.empty()) {
    load(leaving.open);
  } else {
    const auto& recent = state_.settings.recent;
    std::filesystem::path near = state_.open.document->path();
    if (near.empty() && !recent.empty()) near = recent.front();
    chooser_.show(FileChooser::Purpose::Open, near);
  }
}

void App::load(const std::filesystem::path& path) {
  if (state_.loader) {
    state_.loader->cancel();
    abandoned_.push_back(std::move(state_.loader));
  }
  kept_camera_.reset();
  const Document& now = *state_.open.document;
  // An open world would block opening the same file again.
  if (now.world() != nullptr && is_same_file(path, now.path()) && save_world()) close_document();
  DeviceBackendOptions backend;
  backend.cpu = {options_.instances(), options_.threads, CpuBackendOptions{}.first_frame_seconds};
  backend.rays_on_device = screen_->renderer() != nullptr;
  // If another thread renders, the window need not wait for it.
  if (!backend.rays_on_device) backend.frame_seconds = backend.cpu.first_frame_seconds;
  const auto make = [this, backend](const Document& document) -> std::unique_ptr<ViewBackend> {
    return std::make_unique<DeviceBackend>(
        document.scene(), backend, [this] { return open_device(); }, wake_window);
  };
  LoadOptions wanted = options_.load;
  if (!state_.has_named_packs) {
    wanted.packs = state_.settings.packs();
    wanted.scene_packs = !wanted.packs.empty();
  }
  // The raw-volume options describe only the file that the viewer was started with.
  if (path != options_.file) wanted.raw.reset();
  WorldOptions world = options_.world;
  if (!options_.screenshot.empty()) world.may_write = false;
  const PackFallback fallback = state_.has_named_packs ? PackFallback::Error : PackFallback::OwnPack;
  state_.loader = std::make_unique<Loader>(path, wanted, world, fallback, make, wake_window);
}

// Uses another resource pack for the open file and later ones.
void App::choose_pack(const std::string& pack) {
  if (!state_.can_choose_pack()) return;
  Settings wanted = state_.settings;
  wanted.pack = pack;
  const VoxelRegistry* const plain = state_.open.backend ? state_.open.document->plain_types() : nullptr;
  const VoxelRegistry none;
  packed_ = documents_;
  state_.pack_loader =
      std::make_unique<PackLoader>(plain == nullptr ? none : *plain, wanted.packs(), pack, wake_window);
}

// Shows the looks of a pack once it has been read. If it cannot be read, the pack in use stays.
void App::take_packed() {
  if (!state_.pack_loader || !state_.pack_loader->is_done() || state_.loader || state_.saver) return;
  const std::unique_ptr<PackLoader> packed = std::move(state_.pack_loader);
  if (!packed->result()) return state_.report(packed->result().error());
  if (packed_ != documents_) return choose_pack(packed->choice());  // another file was opened meanwhile
  state_.settings.pack = packed->choice();
  state_.has_named_packs = false;
  const PackedTypes& looks = *packed->result();
  const VoxelRegistry* const plain = state_.open.backend ? state_.open.document->plain_types() : nullptr;
  if (plain != nullptr && plain->size() == looks.types.size()) {
    const ScenePause pause(*state_.open.backend);
    state_.open.document->set_looks(looks.types);
    state_.stats.is_settled = false;
  }
  if (!looks.warning.empty()) state_.report(looks.warning);
  const Document& now = *state_.open.document;
  if (!now.reopens_for_looks()) return;
  if (now.is_dirty()) return state_.report("save the changes and open the scene file again to see the other blocks");
  load(now.path());
  kept_camera_ = state_.camera.camera();
}

void App::take_loaded() {
  std::erase_if(abandoned_, [](const std::unique_ptr<Loader>& loader) { return loader->is_done(); });
  if (!state_.loader || !state_.loader->is_done()) return;
  const std::unique_ptr<Loader> loader = std::move(state_.loader);
  auto opened = loader->take();
  if (opened) {
    adopt(std::move(*opened));
    return;
  }
  state_.report(opened.error());
  if (!options_.screenshot.empty()) end_with(opened.error());
}

// Replaces the document by an empty one.
void App::close_document() {
  ++documents_;
  asked_.reset();
  save_wanted_images();
  input_.editing = {};
  state_.hover.reset();
  state_.open.backend.reset();  // reads the document, so it is destroyed first
  state_.open.document = std::make_unique<Document>();
  state_.open.render_settings.reset();
  state_.open.environment.reset();
  has_seen_chunks_ = true;
  unframed_.reset();
  reported_saving_.clear();
  state_.stats = {};
  state_.image = {};
  reported_error_.clear();
  lossy_save_.reset();
  screen_->forget_image();
}

void App::adopt(OpenDocument opened) {
  state_.message.reset();
  close_document();
  state_.open = std::move(opened);
  const LoadedScene& loaded = state_.open.document->loaded();
  state_.settings.note_recent(state_.open.document->path());
  DVec3& sun = state_.settings.environment.sun.direction;
  if (const auto& settings = loaded.render_settings) {
    state_.open.render_settings = std::make_shared<const FileRenderSettings>(*settings);
    sun = settings->environment.sun.direction;
  }
  if (const auto& environment = loaded.scene.environment) {
    if (is_only_sun(*environment)) {
      sun = environment->sun.direction;
    } else {
      state_.open.environment = environment;
    }
  }
  state_.brush.choose(1);
  state_.tool = Tool::Look;  // the first click into a world should not change it
  const SDL_Point output = screen_->output_size();
  if (!state_.has_image_place()) state_.image_place = {0, 0, std::max(output.x, 1), std::max(output.y, 1)};
  if (const WorldWindow* const world = state_.open.document->world()) {
    look_through(world->first_camera(state_.aspect()));
    if (world->is_whole() && !loaded.camera) unframed_ = state_.camera.camera();
    if (!world->why_not_written().empty() && options_.screenshot.empty()) {
      state_.report("this world is read-only: " + world->why_not_written());
    } else if (state_.has_named_packs && options_.screenshot.empty()) {
      state_.report("--pack has no effect on this world, which stores its looks; quoin convert --pack changes them");
    }
  } else if (kept_camera_) {
    look_through(*kept_camera_);
  } else if (loaded.camera) {
    look_through(*loaded.camera);
  } else {
    show_from(View::Iso);
  }
  const bool has_fault = state_.message && state_.message->is_error;
  const std::size_t instances = state_.scene().instances().size();
  if (!has_fault && options_.instances() == InstanceFilter::Visible && instances > 0 &&
      hidden_parts(state_.scene()).instances == instances) {
    return state_.report("the whole scene is hidden: the panel (F2) has switches under Scene");
  }
  if (!loaded.warnings.empty() && !has_fault) {
    const std::size_t more = loaded.warnings.size() - 1;
    state_.report(loaded.warnings.front() + (more > 0 ? " (and " + std::to_string(more) + " more warnings)" : ""));
  }
}

void App::ask_where_to_save() {
  if (!state_.can_edit()) return;
  chooser_.show(FileChooser::Purpose::Save, state_.open.document->proposed_path());
}

void App::save(const std::filesystem::path& path, bool accepts_unsupported) {
  if (!state_.can_edit()) return;
  input_.editing.abandon(state_);
  state_.saver = std::make_unique<Saver>(*state_.open.document, path, accepts_unsupported, wake_window);
}

void App::take_saved() {
  if (!state_.saver || !state_.saver->is_done()) return;
  const std::unique_ptr<Saver> saver = std::move(state_.saver);
  if (!saver->status()) {
    leaving_.reset();
    state_.report(saver->status().error());
    // Keeps the name, so that the user can correct it.
    if (saver->status().error().code != ErrorCode::Cancelled) chooser_.show(FileChooser::Purpose::Save, saver->path());
    return;
  }
  if (!saver->losses().empty()) {
    lossy_save_ = LossySave{saver->path(), saver->losses()};
    return;
  }
  state_.open.document->note_written(saver->path(), saver->state());
  const std::string warning = saver->warnings().empty() ? "" : " (" + saver->warnings().front() + ")";
  state_.report("saved " + saver->path().string() + warning);
  if (leaving_ && !state_.open.document->is_dirty()) go_on_leaving();
}

// Saves the current view: finished if the view does not change before that, else as it is shown now. Keys pressed
// before this one may have changed the view since it was last drawn.
void App::want_image() {
  if (!state_.open.backend || !state_.has_image_place()) return;
  const ViewRequest request = request_now();
  if (asked_ && is_same(*asked_, request) && is_settled()) return save_image(image_of(state_.image));
  // A held key saves one image.
  const bool is_wanted = !wanted_.empty() && is_same(wanted_.back().request, request) &&
                         !state_.scene().has_changed_since(wanted_.back().scene);
  if (!is_wanted) wanted_.push_back({request, state_.scene().cursor(), image_in_mode(request.mode)});
  state_.report("saving the image when it is finished");
}

// Returns the image on the screen if it shows that mode.
std::optional<Result<Image>> App::image_in_mode(DrawMode mode) const {
  if (state_.stats.width == 0 || state_.image.mode != mode) return std::nullopt;
  return image_of(state_.image);
}

void App::save_wanted_images() {
  std::vector<WantedImage> waiting;
  for (WantedImage& wanted : std::exchange(wanted_, {})) {
    const bool is_drawing = state_.open.backend && asked_;
    const bool is_current =
        is_drawing && is_same(*asked_, wanted.request) && !state_.scene().has_changed_since(wanted.scene);
    const bool is_done = is_current && is_settled();
    if (is_done || !wanted.shown) wanted.shown = image_in_mode(wanted.request.mode);
    const bool may_come = is_drawing && asked_->mode == wanted.request.mode;
    if (!is_done && (is_current || (!wanted.shown && may_come))) {
      waiting.push_back(std::move(wanted));
    } else if (wanted.shown) {
      save_image(*wanted.shown);
    } else {
      state_.report(make_error(ErrorCode::Cancelled, "cannot save the image: the mode changed before it was drawn"));
    }
  }
  wanted_ = std::move(waiting);
}

void App::save_image(const Result<Image>& image) {
  const std::string name = stem_of_file(state_.open.document->path());
  const std::filesystem::path path = free_name(name.empty() ? "quoin" : name);
  const auto written = image ? write_png(*image, path) : image.error();
  if (!written) return state_.report(written.error());
  std::error_code ignored;
  const bool is_whole = image->width >= state_.image_place.w;
  state_.report(
      "saved " + std::filesystem::absolute(path, ignored).string() +
      (is_whole ? ""
                : ", unfinished: " + std::to_string(image->width) + " x " + std::to_string(image->height) + " pixels"));
}

void App::write_screenshot(const std::filesystem::path& path) {
  const Result<Image> image = image_of(state_.image);
  const auto written = image ? write_png(*image, path) : image.error();
  if (!written) end_with(written.error());
}

}  // namespace quoin::viewer
