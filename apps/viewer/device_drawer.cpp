#include "device_drawer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <new>
#include <system_error>

#include <quoin/render/vulkan_mesh_renderer.h>

namespace quoin::viewer {

namespace {

constexpr std::array kRayDivisors = {8, 4, 2, 1};
constexpr std::array kMeshDivisors = {4, 3, 2, 1};
constexpr int kMeshSamples = 4;
constexpr double kDetailDistance = 256.0;  // samples of fields
constexpr std::chrono::milliseconds kRest{150};
constexpr double kSlowStart = 10.0;  // a first image is slow if it takes this many times `slow_seconds`

std::string text(const char* format, double value) {
  std::array<char, 64> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, value);
  return buffer.data();
}

}  // namespace

DeviceDrawer::DeviceDrawer(const Scene& scene, const DeviceBackendOptions& options, OpenDevice open_device,
                           std::function<void()> on_surfaces)
    : scene_(&scene), options_(options), open_device_(std::move(open_device)), on_surfaces_(std::move(on_surfaces)) {}

void DeviceDrawer::want(const ViewRequest& request) {
  const bool is_other_kind = !request_ || request_->mode != request.mode || request_->wireframe != request.wireframe ||
                             request_->light.shading != request.light.shading ||
                             request_->light.model != request.light.model;
  if (is_other_kind) {
    mesh_seconds_.clear();
    has_shaders_ = false;
  }
  if (!request_ || request_->mode != request.mode) {
    mode_since_ = Clock::now();
    is_mode_drawn_ = false;
  }
  request_ = request;
  is_request_new_ = true;
  wanted_at_ = Clock::now();
}

void DeviceDrawer::note_edit() {
  is_scene_new_ = true;
  if (meshes_) meshes_->is_scene_new = true;
}

bool DeviceDrawer::wants_frames() const {
  if (!request_) return false;
  const bool is_rays = !has_meshes(request_->mode);
  const bool is_stale = is_rays ? is_scene_new_ || !is_settled_
                                : !meshes_ || meshes_->is_scene_new || (!is_settled_ && meshes_->live->pending() == 0);
  return is_request_new_ || is_stale;
}

std::optional<DeviceDrawer::Clock::time_point> DeviceDrawer::rests_until() const {
  const bool is_moving = !request_ || !has_meshes(request_->mode) || is_request_new_ || !meshes_ ||
                         meshes_->is_scene_new || meshes_->live->pending() > 0;
  if (is_moving || is_settled_ || foreseen_seconds(1) <= options_.frame_seconds) return std::nullopt;
  const Clock::time_point rest = wanted_at_ + kRest;
  return Clock::now() < rest ? std::optional(rest) : std::nullopt;
}

Status DeviceDrawer::open() {
  if (renderer_) return {};
  auto opened = open_device_();
  if (!opened) return opened.error();
  renderer_ = std::move(*opened);
  image_ = std::make_shared<VulkanImage>(*renderer_);
  is_scene_new_ = true;
  return {};
}

Status DeviceDrawer::read_scene() {
  if (!has_meshes(request_->mode)) return update_renderer();
  const bool is_smooth = request_->mode == DrawMode::Smooth;
  if (Status ready = prepare_meshes(is_smooth ? SurfaceStyle::Smooth : SurfaceStyle::Blocky); !ready) return ready;
  return take_surfaces();
}

// Levels of detail and light need the voxels on the device.
bool DeviceDrawer::needs_voxels() const {
  return request_->detail_by_pixels || !is_processor() || request_->light.model == LightModel::Propagated;
}

// Meshes without voxels are drawn from device memory alone.
bool DeviceDrawer::draws_from_scene() const {
  return !has_meshes(request_->mode) || needs_voxels();
}

Result<std::optional<ViewFrame>> DeviceDrawer::read_and_draw() {
  try {
    if (Status opened = open(); !opened) return opened.error();
    if (Status read = read_scene(); !read) return read.error();
    return draw();
  } catch (const std::bad_alloc&) {
    return make_error(ErrorCode::LimitExceeded, "out of memory");
  } catch (const std::system_error& why) {
    return make_error(ErrorCode::LimitExceeded, std::string("cannot start another thread: ") + why.what());
  }
}

Result<std::optional<ViewFrame>> DeviceDrawer::draw() {
  const Clock::time_point start = Clock::now();
  if ((request_->mode == DrawMode::Paths) != (paths_ != nullptr)) {
    paths_ = paths_ ? nullptr : std::make_unique<VulkanPathImage>(*renderer_);
    path_memory_.clear();
    seconds_per_sample_ = 0.0;
  }
  const Result<bool> drawn = has_meshes(request_->mode) ? draw_meshes() : draw_rays();
  if (!drawn) return drawn.error();
  if (!*drawn) return std::optional<ViewFrame>();
  if (!std::exchange(is_mode_drawn_, true) && is_processor()) {
    is_slow_.at(static_cast<std::size_t>(request_->mode)) |=
        seconds_since(mode_since_) > kSlowStart * options_.slow_seconds;
  }
  return std::optional(frame(seconds_since(start)));
}

Status DeviceDrawer::prepare_meshes(SurfaceStyle style) {
  if (meshes_ && meshes_->style == style) {
    renew_occlusion();
    return {};
  }
  meshes_.reset();
  auto drawer = VulkanMeshRenderer::create(*renderer_);
  if (!drawer) return drawer.error();
  const SmoothOcclusionOptions occlusion = request_->light.smooth_occlusion;
  meshes_.reset(new Meshes{style, occlusion, live_meshes(style, occlusion), std::move(*drawer)});
  is_request_new_ = true;
  return {};
}

std::unique_ptr<LiveMeshes> DeviceDrawer::live_meshes(SurfaceStyle style,
                                                      const SmoothOcclusionOptions& occlusion) const {
  LiveMeshOptions live;
  live.style = style;
  live.region_edge = kChunkEdge;  // the renderer uploads whole chunks
  live.instances = options_.cpu.instances;
  live.workers = options_.cpu.threads;
  live.on_ready = on_surfaces_;
  live.detail_distance = kDetailDistance;
  live.occlusion = occlusion;
  return std::make_unique<LiveMeshes>(live);
}

// Meshes all chunks again with another occlusion, once meshing under way is done. Surfaces stay until the new ones
// arrive, and no surface is left of a chunk that an edit emptied.
void DeviceDrawer::renew_occlusion() {
  if (meshes_->occlusion == request_->light.smooth_occlusion || meshes_->is_scene_new) return;
  meshes_->live->update(*scene_, request_->camera.position);
  if (meshes_->live->pending() > 0) return;
  meshes_->occlusion = request_->light.smooth_occlusion;
  meshes_->live = live_meshes(meshes_->style, meshes_->occlusion);
  is_request_new_ = true;
}

// Uploads the scene to the renderer, or its changes.
Status DeviceDrawer::update_renderer() {
  if (!std::exchange(is_scene_new_, false)) return {};
  is_request_new_ = true;
  path_memory_.note_edit();
  return renderer_->update(*scene_, options_.cpu.instances, options_.cpu.threads);
}

// Applies edits and finished meshes.
Status DeviceDrawer::take_surfaces() {
  if (needs_voxels()) {
    if (Status updated = update_renderer(); !updated) return updated;
  }
  const bool is_scene_changed = std::exchange(meshes_->is_scene_new, false);
  if (is_scene_changed) {
    is_request_new_ = true;
    if (Status taken = meshes_->renderer.update(*scene_, options_.cpu.instances); !taken) return taken;
  }
  // The levels of detail of fields depend on the camera.
  if (is_request_new_ || meshes_->live->pending() > 0) meshes_->live->update(*scene_, request_->camera.position);
  count_pending();
  const std::vector<SurfaceUpdate> surfaces = meshes_->live->take();
  if (surfaces.empty()) return {};
  is_request_new_ = true;
  return meshes_->renderer.put(surfaces);
}

void DeviceDrawer::count_pending() {
  const std::size_t left = meshes_->live->pending();
  meshes_->to_mesh = left == 0 ? 0 : std::max(meshes_->to_mesh, left);
}

std::pair<std::size_t, std::size_t> DeviceDrawer::meshing() const {
  if (!request_ || !has_meshes(request_->mode) || !meshes_) return {0, 0};
  const std::size_t left = meshes_->live->pending();
  const std::size_t all = std::max(meshes_->to_mesh, left);
  return left == 0 ? std::pair{left, left} : std::pair{all - left, all};
}

MeshImageOptions DeviceDrawer::mesh_image() const {
  MeshImageOptions wanted;
  wanted.width = (request_->width + divisor_ - 1) / divisor_;
  wanted.height = (request_->height + divisor_ - 1) / divisor_;
  wanted.samples = samples_;
  wanted.light = request_->light;
  wanted.environment = marched_environment(*request_);
  wanted.wireframe = request_->wireframe;
  wanted.detail.colours = request_->detail_colours;
  if (request_->detail_by_pixels) wanted.detail.policy.emplace().rule = DetailPolicy::Rule::ByPixels;
  if (!waits_) wanted.detail.impostor_seconds = 0.0;
  // Without a graphics card, ray-traced light and glass would take seconds per image.
  if (is_processor()) {
    wanted.light.shadows = false;
    wanted.light.max_lamps = 0;
    wanted.glass_by_rays = false;
  }
  return wanted;
}

// Estimates the time of an image in motion: its measured time, or less if coarser images scaled by pixels took less.
// 0: not known.
double DeviceDrawer::foreseen_seconds(int divisor) const {
  double least = 0.0;
  for (const auto& [known, seconds] : mesh_seconds_) {
    if (known < divisor) continue;
    const double most = seconds * known * known / (divisor * divisor);
    least = least > 0.0 ? std::min(least, most) : most;
  }
  return least;
}

int DeviceDrawer::moving_divisor() const {
  int chosen = kMeshDivisors.front();
  for (const int finer : kMeshDivisors) {
    const double seconds = foreseen_seconds(finer);
    if (seconds <= 0.0) continue;
    if (seconds <= options_.frame_seconds * (finer == divisor_ ? kConstancy : 1.0)) chosen = finer;
  }
  return chosen;
}

void DeviceDrawer::note_mesh_seconds(double seconds, bool is_moving) {
  if (!is_moving) return;
  // The first image compiles shaders, so its time does not count.
  if (!std::exchange(has_shaders_, true)) return;
  double& known = mesh_seconds_[divisor_];
  known = seconds_known(known, seconds);
  if (divisor_ == kMeshDivisors.front() && known > options_.slow_seconds)
    is_slow_.at(static_cast<std::size_t>(request_->mode)) = true;
}

Result<bool> DeviceDrawer::draw_meshes() {
  const bool is_moving = std::exchange(is_request_new_, false);
  if (is_moving) is_settled_ = false;
  if (is_settled_ || (!is_moving && (meshes_->live->pending() > 0 || rests_until()))) return false;
  // Ray marching stands in until there are meshes: an image of the sky alone would be worse.
  const bool has_stand_in = !options_.rays_on_device;
  const bool is_empty = meshes_->renderer.stats().triangles == 0 && meshes_->live->pending() > 0;
  if (has_stand_in && !is_mode_drawn_ && is_empty) return false;
  divisor_ = is_moving ? moving_divisor() : 1;
  samples_ = is_moving && is_processor() ? 1 : std::min(request_->samples, kMeshSamples);
  // Short-lived images do not wait for impostors; instances without one use halved grids.
  waits_ = !is_moving;
  MeshImageOptions wanted = mesh_image();
  wanted.detail.selector = &selectors_[divisor_];
  const Clock::time_point start = Clock::now();
  if (Status drawn = meshes_->renderer.draw(*image_, request_->camera, wanted, options_.cpu.threads); !drawn)
    return drawn.error();
  note_mesh_seconds(seconds_since(start), is_moving);
  const bool is_best =
      divisor_ == 1 && samples_ == std::min(request_->samples, kMeshSamples) && (waits_ || !request_->detail_by_pixels);
  // Otherwise the next image is better.
  is_settled_ = is_best && meshes_->live->pending() == 0 && meshes_->occlusion == request_->light.smooth_occlusion;
  return true;
}

// After an edit, path-traced images continue at a size that the history has.
int DeviceDrawer::first_divisor() const {
  const double pixels = static_cast<double>(request_->width) * request_->height;
  int chosen = path_memory_.first_divisor(*request_, kRayDivisors);
  if (seconds_per_sample_ <= 0.0) return chosen;
  for (const int finer : kRayDivisors) {
    if (!path_memory_.may_begin(*request_, finer)) continue;
    if (pixels / (finer * finer) * seconds_per_sample_ <= options_.frame_seconds) chosen = finer;
  }
  return chosen;
}

// Images start coarse, become finer, then get more samples.
DeviceDrawer::Stage DeviceDrawer::next_stage() {
  const bool is_first = std::exchange(is_request_new_, false);
  const bool is_new = is_first || divisor_ > 1;
  divisor_ = is_first ? first_divisor() : std::max(divisor_ / 2, 1);
  return {(request_->width + divisor_ - 1) / divisor_, (request_->height + divisor_ - 1) / divisor_,
          is_new ? Accumulation::Restart : Accumulation::Continue};
}

// As many samples as the frame time allows, so that fast devices settle soon.
int DeviceDrawer::samples_now(const Stage& stage, int before, int wanted) const {
  if (stage.accumulation == Accumulation::Restart) return 1;
  const double seconds = stage.pixels() * seconds_per_sample_;
  const int affordable = seconds > 0.0 ? static_cast<int>(std::min(options_.frame_seconds / seconds, 64.0)) : 1;
  return std::clamp(affordable, 1, wanted - before);
}

Status DeviceDrawer::draw_stage() {
  const Stage stage = next_stage();
  RenderOptions wanted;
  wanted.width = stage.width;
  wanted.height = stage.height;
  wanted.samples = samples_now(stage, image_->samples(), request_->samples);
  wanted.light = request_->light;
  wanted.environment = marched_environment(*request_);
  wanted.detail.colours = request_->detail_colours;
  if (request_->detail_by_pixels) wanted.detail.policy.emplace().rule = DetailPolicy::Rule::ByPixels;
  wanted.detail.selector = &selectors_[divisor_];
  // Short-lived images do not wait for impostors.
  if (divisor_ > 1) wanted.detail.impostor_seconds = 0.0;
  const Clock::time_point start = Clock::now();
  if (Status drawn = renderer_->draw(*image_, request_->camera, wanted, stage.accumulation); !drawn) return drawn;
  seconds_per_sample_ = seconds_since(start) / (stage.pixels() * wanted.samples);
  is_settled_ = divisor_ == 1 && image_->samples() >= request_->samples;
  return {};
}

Result<bool> DeviceDrawer::draw_rays() {
  if (is_request_new_) is_settled_ = false;
  if (is_settled_) return false;
  if (request_->mode == DrawMode::Paths) return draw_path_stage();
  if (Status drawn = draw_stage(); !drawn) return drawn.error();
  return true;
}

// Adds path tracing samples as the frame time allows. Reads, denoises and shows the image whenever the number of
// samples has doubled.
Result<bool> DeviceDrawer::draw_path_stage() {
  const Stage stage = next_stage();
  const int to_show = stage.accumulation == Accumulation::Restart ? 1 : std::min(2 * shown_samples_, kPathSamples);
  const PathOptions wanted =
      path_options(*request_, stage.width, stage.height, samples_now(stage, paths_->samples(), to_show),
                   scene_->bounds(options_.cpu.instances));
  const Clock::time_point start = Clock::now();
  if (Status drawn = renderer_->draw_paths(*paths_, request_->camera, wanted, stage.accumulation); !drawn)
    return drawn.error();
  seconds_per_sample_ = seconds_since(start) / (stage.pixels() * wanted.samples);
  is_settled_ = divisor_ == 1 && paths_->samples() >= kPathSamples;
  if (paths_->samples() < to_show) return false;
  auto taken = paths_->read(options_.cpu.threads);
  if (!taken) return taken.error();
  path_memory_.of(*request_).refine(*taken, paths_->samples(), options_.cpu.threads);
  const auto colour = develop(*taken, develop_options(*request_));
  if (!colour) return colour.error();
  if (Status written = image_->write(*colour); !written) return written.error();
  shown_samples_ = paths_->samples();
  return true;
}

ViewFrame DeviceDrawer::frame(double seconds) const {
  ViewFrame made;
  made.on_device = image_;
  made.mode = request_->mode;
  made.samples = paths_ ? shown_samples_ : image_->samples();
  made.is_whole = image_->width() == request_->width && image_->height() == request_->height;
  made.is_settled = is_settled_;
  made.seconds = seconds;
  made.rays = image_->rays();
  return made;
}

std::vector<std::pair<std::string, std::string>> DeviceDrawer::stats() const {
  if (!meshes_ || !request_ || !has_meshes(request_->mode)) return {};
  const VulkanMeshRenderer::Stats drawn = meshes_->renderer.stats();
  const LiveMeshes::Stats live = meshes_->live->stats();
  return {{"triangles", text("%.0f", static_cast<double>(drawn.triangles))},
          {"triangles drawn", text("%.0f", static_cast<double>(drawn.drawn_triangles))},
          {"chunks", text("%.0f", static_cast<double>(drawn.chunks))},
          {"chunks to mesh", text("%.0f", static_cast<double>(meshes_->live->pending()))},
          {"meshes", text("%.1f MB", static_cast<double>(drawn.bytes) / 1e6)},
          {"last chunk meshed", text("%.2f ms", live.last_mesh_seconds * 1e3)},
          {"edit to mesh", text("%.2f ms", live.last_latency_seconds * 1e3)}};
}

}  // namespace quoin::viewer
