#include "device_backend.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <new>
#include <system_error>
#include <utility>

#include <quoin/live/live_meshes.h>
#include <quoin/render_vk/vulkan_mesh_renderer.h>

namespace quoin::viewer {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::array kDivisors = {8, 4, 2, 1};
constexpr int kMeshSamples = 4;
constexpr double kDetailDistance = 256.0;  // samples of fields

std::string text(const char* format, double value) {
  std::array<char, 64> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, value);
  return buffer.data();
}

}  // namespace

struct DeviceBackend::Impl {
  /// Meshes of one style, and what draws them.
  struct Meshes {
    SurfaceStyle style;
    SmoothOcclusionOptions occlusion;
    std::unique_ptr<LiveMeshes> live;
    VulkanMeshRenderer renderer;
    bool is_scene_new = true;
  };

  Impl(const Scene& of_scene, const DeviceBackendOptions& given, OpenDevice opener, std::function<void()> listener)
      : scene(&of_scene),
        options(given),
        open_device(std::move(opener)),
        on_frame(std::move(listener)),
        cpu(of_scene, given.cpu, on_frame) {}

  [[nodiscard]] bool uses_device() const {
    if (!request || request->mode == DrawMode::Density) return false;
    if (has_meshes(request->mode)) return true;
    // Smooth occlusion of fields is the processor's.
    return options.rays_on_device && !is_device_gone && request->light.occlusion != OcclusionMode::Smooth;
  }
  [[nodiscard]] bool can_draw_now() const {
    return uses_device() && !is_paused && !is_device_gone && request->width > 0 && request->height > 0;
  }
  Status prepare();
  Result<bool> draw();
  Status prepare_meshes(SurfaceStyle style);
  [[nodiscard]] std::unique_ptr<LiveMeshes> live_meshes(SurfaceStyle style,
                                                        const SmoothOcclusionOptions& occlusion) const;
  void renew_occlusion();
  Result<bool> take_surfaces();
  [[nodiscard]] MeshPictureOptions mesh_picture(bool waits);
  Result<bool> update_renderer();
  /// Without a graphics card meshes have no light that takes rays: a picture with shadows would take seconds.
  [[nodiscard]] bool is_processor() const { return renderer->device().kind == "cpu"; }
  Result<bool> draw_meshes();
  Result<bool> draw_rays();
  Status draw_stage();
  [[nodiscard]] int first_divisor() const;
  [[nodiscard]] int samples_now() const;
  [[nodiscard]] ViewFrame frame(double seconds) const;
  void fail_with(const Error& error);
  void give_up_device();

  const Scene* scene;
  DeviceBackendOptions options;
  OpenDevice open_device;
  std::function<void()> on_frame;
  CpuBackend cpu;

  std::optional<ViewRequest> request;
  bool is_request_new = false;
  bool is_paused = false;
  bool is_settled = false;
  bool is_device_gone = false;
  std::optional<Error> error;

  std::shared_ptr<VulkanRenderer> renderer;
  bool is_scene_new = true;  // to the renderer
  std::shared_ptr<VulkanPicture> picture;
  std::unique_ptr<Meshes> meshes;
  int divisor = 1;
  std::map<int, DetailSelector> selectors;  // by divisor: pictures of another size are another view
  double seconds_per_sample = 0.0;          // and pixel; 0: not known
};

DeviceBackend::DeviceBackend(const Scene& scene, const DeviceBackendOptions& options, OpenDevice open_device,
                             std::function<void()> on_frame)
    : impl_(std::make_unique<Impl>(scene, options, std::move(open_device), std::move(on_frame))) {}

DeviceBackend::~DeviceBackend() = default;

Status DeviceBackend::Impl::prepare() {
  if (renderer) return {};
  auto opened = open_device();
  if (!opened) return opened.error();
  renderer = std::move(*opened);
  picture = std::make_shared<VulkanPicture>(*renderer);
  is_scene_new = true;
  return {};
}

Status DeviceBackend::Impl::prepare_meshes(SurfaceStyle style) {
  if (meshes && meshes->style == style) {
    renew_occlusion();
    return {};
  }
  meshes.reset();
  auto drawer = VulkanMeshRenderer::create(*renderer);
  if (!drawer) return drawer.error();
  const SmoothOcclusionOptions occlusion = request->light.smooth;
  meshes.reset(new Meshes{style, occlusion, live_meshes(style, occlusion), std::move(*drawer)});
  is_request_new = true;
  return {};
}

std::unique_ptr<LiveMeshes> DeviceBackend::Impl::live_meshes(SurfaceStyle style,
                                                             const SmoothOcclusionOptions& occlusion) const {
  LiveMeshOptions live;
  live.style = style;
  live.instances = options.cpu.instances;
  live.threads = options.cpu.threads;
  live.on_ready = on_frame;
  live.detail_distance = kDetailDistance;
  live.occlusion = occlusion;
  return std::make_unique<LiveMeshes>(live);
}

// Has all chunks meshed with another occlusion, once those that are under way are done: surfaces stay until the new
// ones come, and none is left of a chunk that an edit emptied.
void DeviceBackend::Impl::renew_occlusion() {
  if (meshes->occlusion == request->light.smooth || meshes->is_scene_new) return;
  meshes->live->update(*scene, request->camera.position);
  if (meshes->live->pending() > 0) return;
  meshes->occlusion = request->light.smooth;
  meshes->live = live_meshes(meshes->style, meshes->occlusion);
  is_request_new = true;
}

// Has the renderer know the scene; returns whether it was another.
Result<bool> DeviceBackend::Impl::update_renderer() {
  if (!std::exchange(is_scene_new, false)) return false;
  if (Status taken = renderer->update(*scene, options.cpu.instances, options.cpu.threads); !taken) {
    return taken.error();
  }
  return true;
}

// Takes over what was edited and what workers made of it; returns whether there is another picture.
Result<bool> DeviceBackend::Impl::take_surfaces() {
  Result<bool> updated = false;
  // Only light by rays and levels of detail need the voxels on the device.
  if (request->detail_by_pixels || !is_processor()) updated = update_renderer();
  if (!updated) return updated.error();
  const bool is_scene_changed = std::exchange(meshes->is_scene_new, false);
  if (is_scene_changed) {
    if (Status taken = meshes->renderer.update(*scene, options.cpu.instances); !taken) return taken.error();
  }
  // The levels of detail of fields follow the camera.
  if (is_scene_changed || is_request_new || meshes->live->pending() > 0)
    meshes->live->update(*scene, request->camera.position);
  const std::vector<SurfaceUpdate> surfaces = meshes->live->take();
  if (surfaces.empty()) return *updated || is_scene_changed;
  if (Status put = meshes->renderer.put(surfaces); !put) return put.error();
  return true;
}

MeshPictureOptions DeviceBackend::Impl::mesh_picture(bool waits) {
  MeshPictureOptions wanted;
  wanted.width = request->width;
  wanted.height = request->height;
  wanted.samples = std::min(request->samples, kMeshSamples);
  wanted.light = request->light;
  wanted.wireframe = request->wireframe;
  wanted.detail_colours = request->detail_colours;
  wanted.threads = options.cpu.threads;
  if (request->detail_by_pixels) wanted.detail.emplace().rule = DetailPolicy::Rule::ByPixels;
  wanted.selector = &selectors[1];
  if (!waits) wanted.impostor_seconds = 0.0;
  if (is_processor()) {
    wanted.light.shadows = false;
    wanted.light.lamps = 0;
  }
  return wanted;
}

Result<bool> DeviceBackend::Impl::draw_meshes() {
  const bool is_smooth = request->mode == DrawMode::Smooth;
  if (Status ready = prepare_meshes(is_smooth ? SurfaceStyle::Smooth : SurfaceStyle::Blocky); !ready) {
    return ready.error();
  }
  const auto has_changed = take_surfaces();
  if (!has_changed) return has_changed.error();
  const bool is_new = std::exchange(is_request_new, false) || *has_changed;
  // What is shown for a moment does not wait for impostors: what has none is shown halved till then.
  const bool is_last = !is_new && meshes->live->pending() == 0;
  if (is_new) is_settled = false;
  if (is_settled || (!is_new && !is_last)) return false;
  divisor = 1;
  if (Status drawn = meshes->renderer.draw(*picture, request->camera, mesh_picture(is_last)); !drawn) {
    return drawn.error();
  }
  // Otherwise the next picture is a better one.
  is_settled = (is_last || (meshes->live->pending() == 0 && !request->detail_by_pixels)) &&
               meshes->occlusion == request->light.smooth;
  return true;
}

// Returns whether there is another picture.
Result<bool> DeviceBackend::Impl::draw() {
  try {
    if (Status ready = prepare(); !ready) return ready.error();
    return request->mode == DrawMode::Rays ? draw_rays() : draw_meshes();
  } catch (const std::bad_alloc&) {
    return make_error(ErrorCode::LimitExceeded, "out of memory");
  } catch (const std::system_error& why) {
    return make_error(ErrorCode::LimitExceeded, std::string("cannot start another thread: ") + why.what());
  }
}

int DeviceBackend::Impl::first_divisor() const {
  const double pixels = static_cast<double>(request->width) * request->height;
  int chosen = kDivisors.front();
  if (seconds_per_sample <= 0.0) return chosen;
  for (const int finer : kDivisors) {
    if (pixels / (finer * finer) * seconds_per_sample <= options.frame_seconds) chosen = finer;
  }
  return chosen;
}

// As many as the time of a frame allows, so that fast devices settle soon.
int DeviceBackend::Impl::samples_now() const {
  if (divisor > 1 || picture->samples() == 0) return 1;
  const double whole = static_cast<double>(request->width) * request->height * seconds_per_sample;
  const int affordable = whole > 0.0 ? static_cast<int>(std::min(options.frame_seconds / whole, 64.0)) : 1;
  return std::clamp(affordable, 1, request->samples - picture->samples());
}

Status DeviceBackend::Impl::draw_stage() {
  const bool is_first = std::exchange(is_request_new, false);
  const bool is_new = is_first || divisor > 1;
  divisor = is_first ? first_divisor() : std::max(divisor / 2, 1);
  RenderOptions wanted;
  wanted.width = (request->width + divisor - 1) / divisor;
  wanted.height = (request->height + divisor - 1) / divisor;
  wanted.samples = is_new ? 1 : samples_now();
  wanted.light = request->light;
  wanted.detail_colours = request->detail_colours;
  if (request->detail_by_pixels) wanted.detail.emplace().rule = DetailPolicy::Rule::ByPixels;
  wanted.selector = &selectors[divisor];
  // What is shown for a moment does not wait for impostors.
  if (divisor > 1) wanted.impostor_seconds = 0.0;
  const Accumulation accumulation = is_new ? Accumulation::Restart : Accumulation::Continue;
  const Clock::time_point start = Clock::now();
  if (Status drawn = renderer->draw(*picture, request->camera, wanted, accumulation); !drawn) return drawn;
  seconds_per_sample = seconds_since(start) / (static_cast<double>(wanted.width) * wanted.height * wanted.samples);
  is_settled = divisor == 1 && picture->samples() >= request->samples;
  return {};
}

Result<bool> DeviceBackend::Impl::draw_rays() {
  const auto updated = update_renderer();
  if (!updated) return updated.error();
  if (*updated) is_request_new = true;
  if (is_request_new) is_settled = false;
  if (is_settled) return false;
  if (Status drawn = draw_stage(); !drawn) return drawn.error();
  return true;
}

ViewFrame DeviceBackend::Impl::frame(double seconds) const {
  ViewFrame made;
  made.on_device = picture;
  made.samples = picture->samples();
  made.is_whole = divisor == 1;
  made.is_settled = is_settled;
  made.seconds = seconds;
  made.rays = picture->rays();
  return made;
}

void DeviceBackend::Impl::fail_with(const Error& what) {
  error = what;
  meshes.reset();
  give_up_device();
}

void DeviceBackend::Impl::give_up_device() {
  is_device_gone = true;
  if (request && !uses_device()) cpu.show(*request);
}

void DeviceBackend::forget_device() {
  impl_->meshes.reset();
  impl_->picture.reset();
  impl_->renderer.reset();
  impl_->give_up_device();
}

std::string DeviceBackend::name() const {
  if (!impl_->uses_device() || !impl_->renderer) return impl_->cpu.name();
  return impl_->renderer->device().name;
}

bool DeviceBackend::traces_light(DrawMode mode) const {
  return mode == DrawMode::Rays || (has_meshes(mode) && impl_->renderer && !impl_->is_processor());
}

bool DeviceBackend::can_draw(DrawMode mode) const {
  return !has_meshes(mode) || !impl_->is_device_gone;
}

void DeviceBackend::show(const ViewRequest& request) {
  Impl& me = *impl_;
  if (me.request && is_same(*me.request, request)) return;
  me.request = request;
  me.is_request_new = true;
  me.error.reset();
  ViewRequest of_cpu = request;
  // It rests while the device draws.
  if (me.uses_device()) of_cpu.width = of_cpu.height = 0;
  me.cpu.show(of_cpu);
}

std::optional<ViewFrame> DeviceBackend::take() {
  Impl& me = *impl_;
  if (!me.uses_device()) return me.cpu.take();
  if (!me.can_draw_now()) return std::nullopt;
  const Clock::time_point start = Clock::now();
  const Result<bool> drawn = me.draw();
  if (!drawn) {
    me.fail_with(drawn.error());
    return std::nullopt;
  }
  if (!*drawn) return std::nullopt;
  return me.frame(seconds_since(start));
}

bool DeviceBackend::wants_frames() const {
  const Impl& me = *impl_;
  if (!me.can_draw_now()) return false;
  const bool is_rays = me.request->mode == DrawMode::Rays;
  const bool is_stale =
      is_rays ? me.is_scene_new || !me.is_settled
              : !me.meshes || me.meshes->is_scene_new || (!me.is_settled && me.meshes->live->pending() == 0);
  return me.is_request_new || is_stale;
}

std::vector<std::pair<std::string, std::string>> DeviceBackend::stats() const {
  const Impl& me = *impl_;
  if (!me.uses_device() || !me.meshes || me.request->mode == DrawMode::Rays) return {};
  const VulkanMeshRenderer::Stats drawn = me.meshes->renderer.stats();
  const LiveMeshes::Stats live = me.meshes->live->stats();
  return {{"triangles, each once", text("%.0f", static_cast<double>(drawn.triangles))},
          {"triangles drawn", text("%.0f", static_cast<double>(drawn.drawn_triangles))},
          {"chunks", text("%.0f", static_cast<double>(drawn.chunks))},
          {"still to mesh", text("%.0f", static_cast<double>(me.meshes->live->pending()))},
          {"meshes", text("%.1f MB", static_cast<double>(drawn.bytes) / 1e6)},
          {"last chunk took", text("%.2f ms", live.last_mesh_seconds * 1e3)},
          {"edit to mesh", text("%.2f ms", live.last_latency_seconds * 1e3)}};
}

std::optional<Error> DeviceBackend::fault() {
  return impl_->error ? impl_->error : impl_->cpu.fault();
}

double DeviceBackend::pause() {
  impl_->is_paused = true;
  return impl_->cpu.pause();
}

void DeviceBackend::resume(bool changed) {
  impl_->is_paused = false;
  if (changed) {
    impl_->is_scene_new = true;
    if (impl_->meshes) impl_->meshes->is_scene_new = true;
  }
  impl_->cpu.resume(changed);
}

std::optional<SlideResult> DeviceBackend::slide(const OrientedBox& box, DVec3 displacement,
                                                const SlideOptions& options) {
  return impl_->cpu.slide(box, displacement, options);
}

std::optional<SceneHit> DeviceBackend::pick(const Camera& camera, double x, double y, int width, int height) {
  return impl_->cpu.pick(camera, x, y, width, height);
}

bool DeviceBackend::is_up_to_date() {
  return impl_->cpu.is_up_to_date();
}

}  // namespace quoin::viewer
