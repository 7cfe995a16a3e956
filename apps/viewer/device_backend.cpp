#include "device_backend.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <utility>

#include "device_drawer.h"

namespace quoin::viewer {

namespace {

constexpr int kSamplesAtRest = 4;  // the same as meshes

}  // namespace

struct DeviceBackend::Impl {
  /// The state that the drawing thread publishes, because only it can access the drawer.
  struct Reported {
    std::string name;
    std::string activity;
    std::optional<double> progress;  // of `activity`
    std::vector<std::pair<std::string, std::string>> stats;
    std::size_t image_bytes = 0;
    bool has_scene = false;
    bool traces_light = false;
    bool is_processor = false;  // a software device
    std::array<bool, kDrawModes> is_slow{};
  };

  Impl(const Scene& of_scene, const DeviceBackendOptions& given, OpenDevice opener, std::function<void()> listener)
      : scene(of_scene), options(given), on_frame(std::move(listener)), cpu(of_scene, given.cpu, on_frame) {
    std::function<void()> on_surfaces = on_frame;
    if (has_thread()) on_surfaces = [this] { note_surfaces(); };
    drawer = std::make_unique<DeviceDrawer>(of_scene, given, std::move(opener), std::move(on_surfaces));
  }
  ~Impl() {
    stop();
    // Its workers notify through members declared below, so they must end first.
    drawer.reset();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  [[nodiscard]] bool has_thread() const { return !options.rays_on_device; }
  [[nodiscard]] bool uses_device() const {
    if (!request || request->mode == DrawMode::Density) return false;
    if (has_meshes(request->mode)) return true;
    // Only the processor draws smooth occlusion of fields.
    return options.rays_on_device && !is_device_gone && request->light.occlusion_mode != OcclusionMode::Smooth;
  }
  [[nodiscard]] bool can_draw_now() const {
    return uses_device() && !is_paused && !is_device_gone && request->width > 0 && request->height > 0;
  }
  // Returns true if ray marching can show the same image as the meshes.
  [[nodiscard]] bool is_marched_alike(DrawMode mode) const {
    return mode == DrawMode::Blocks || (mode == DrawMode::Smooth && (is_all_fields || !is_refused));
  }
  // The mode in which the processor ray-marches the view at rest.
  [[nodiscard]] DrawMode marched_mode() const {
    return request->mode == DrawMode::Smooth && !is_all_fields ? DrawMode::Smooth : DrawMode::Rays;
  }
  // Returns true if ray-traced light is added at rest, because the software device is too slow for it.
  [[nodiscard]] bool is_lit_at_rest() const {
    const LightOptions& light = request->light;
    const bool has_shadows = light.model == LightModel::Rays && (light.shadows || light.max_lamps > 0);
    const bool wants_rays = has_shadows || light.glass_surfaces;
    return reported.is_processor && is_marched_alike(request->mode) && request->wireframe == Wireframe::Off &&
           light.shading == Shading::Lit && wants_rays;
  }
  [[nodiscard]] ViewRequest request_of_light() const;
  [[nodiscard]] std::optional<ViewFrame> take_light();
  [[nodiscard]] std::optional<ViewFrame> draw_here();
  void show_by_processor();
  void give_up_device();
  [[nodiscard]] Reported report() const;

  // The drawing thread.
  void start();
  void stop();
  void note_surfaces();
  void work();
  [[nodiscard]] bool has_work() const;
  void wait_for_work(std::unique_lock<std::mutex>& lock);
  void step(std::unique_lock<std::mutex>& lock);
  [[nodiscard]] Result<std::optional<ViewFrame>> draw_apart(std::unique_lock<std::mutex>& lock);
  void publish(Result<std::optional<ViewFrame>> drawn, DrawMode mode, std::uint64_t number);

  const Scene& scene;
  DeviceBackendOptions options;
  std::function<void()> on_frame;
  CpuBackend cpu;
  std::unique_ptr<DeviceDrawer> drawer;  // used by the thread, if there is one
  std::thread worker;

  mutable std::mutex mutex;  // guards the members below, if there is a thread
  std::condition_variable wake;
  std::condition_variable idle;
  std::optional<ViewRequest> request;  // only the window's thread changes it
  std::uint64_t request_number = 0;
  bool is_request_new = false;  // not yet seen by the thread
  bool is_edited = false;
  bool has_surfaces = false;
  bool is_paused = false;
  bool is_reading = false;  // the thread reads the scene
  bool is_busy = false;     // the device opens, updates or draws
  bool is_stopped = false;
  bool is_device_gone = false;
  bool is_drawn = false;  // the device has drawn an image in the requested mode
  bool rests = false;     // the device has drawn its final image
  bool is_all_fields = false;
  bool is_refused = false;  // the processor refused smooth surfaces of voxels
  std::optional<ViewFrame> frame;
  std::optional<Error> error;
  Reported reported;
};

DeviceBackend::DeviceBackend(const Scene& scene, const DeviceBackendOptions& options, OpenDevice open_device,
                             std::function<void()> on_frame)
    : impl_(std::make_unique<Impl>(scene, options, std::move(open_device), std::move(on_frame))) {}

DeviceBackend::~DeviceBackend() = default;

void DeviceBackend::Impl::start() {
  if (!has_thread() || worker.joinable() || is_stopped) return;
  worker = std::thread([this] { work(); });
}

void DeviceBackend::Impl::stop() {
  {
    const std::lock_guard lock(mutex);
    is_stopped = true;
  }
  wake.notify_all();
  if (worker.joinable()) worker.join();
}

void DeviceBackend::Impl::note_surfaces() {
  {
    const std::lock_guard lock(mutex);
    has_surfaces = true;
  }
  wake.notify_all();
}

bool DeviceBackend::Impl::has_work() const {
  if (is_stopped) return true;
  if (!can_draw_now()) return false;
  return is_request_new || is_edited || has_surfaces || (drawer->wants_frames() && !drawer->rests_until());
}

void DeviceBackend::Impl::wait_for_work(std::unique_lock<std::mutex>& lock) {
  while (!has_work()) {
    const auto rest = can_draw_now() ? drawer->rests_until() : std::nullopt;
    if (rest) {
      wake.wait_until(lock, *rest);
    } else {
      wake.wait(lock);
    }
  }
}

void DeviceBackend::Impl::work() {
  yield_to_window();
  std::unique_lock lock(mutex);
  for (;;) {
    wait_for_work(lock);
    if (is_stopped) return;
    step(lock);
    lock.unlock();
    if (on_frame) on_frame();
    lock.lock();
  }
}

void DeviceBackend::Impl::step(std::unique_lock<std::mutex>& lock) {
  is_busy = true;
  if (std::exchange(is_request_new, false)) drawer->want(*request);
  if (std::exchange(is_edited, false)) drawer->note_edit();
  has_surfaces = false;
  const std::uint64_t number = request_number;
  const DrawMode mode = request->mode;
  auto drawn = [&]() -> Result<std::optional<ViewFrame>> {
    try {
      return draw_apart(lock);
    } catch (const std::bad_alloc&) {
      return make_error(ErrorCode::LimitExceeded, "out of memory");
    } catch (const std::system_error& why) {
      return make_error(ErrorCode::LimitExceeded, std::string("cannot start another thread: ") + why.what());
    }
  }();
  if (!lock.owns_lock()) lock.lock();
  is_reading = is_busy = false;
  publish(std::move(drawn), mode, number);
  idle.notify_all();
}

// Reads the scene only briefly, so that edits do not wait for the device.
Result<std::optional<ViewFrame>> DeviceBackend::Impl::draw_apart(std::unique_lock<std::mutex>& lock) {
  if (drawer->renderer() == nullptr) reported.activity = "opening a device";
  lock.unlock();
  if (Status opened = drawer->open(); !opened) return opened.error();
  lock.lock();
  if (is_paused || is_stopped) {
    has_surfaces = true;  // possibly: not checked yet
    return std::optional<ViewFrame>();
  }
  is_reading = true;
  lock.unlock();
  if (Status read = drawer->read_scene(); !read) return read.error();
  lock.lock();
  reported = report();
  // When stopping, skips compiling shaders and drawing an image that would not be shown.
  if (is_stopped) return std::optional<ViewFrame>();
  is_reading = drawer->draws_from_scene();
  idle.notify_all();
  lock.unlock();
  auto drawn = drawer->draw();
  if (!drawn || !*drawn) return drawn;
  auto read = (*drawn)->on_device->read();
  if (!read) return read.error();
  (*drawn)->colour = std::move(*read);
  (*drawn)->on_device.reset();
  return drawn;
}

void DeviceBackend::Impl::publish(Result<std::optional<ViewFrame>> drawn, DrawMode mode, std::uint64_t number) {
  if (!drawn) {
    error = drawn.error();
    is_device_gone = true;
    reported = {};
    return;
  }
  reported = report();
  // The request may have changed meanwhile.
  if (!*drawn || request->mode != mode) return;
  frame = std::move(**drawn);
  if (request_number != number) frame->is_settled = false;
  is_drawn = true;
  rests = frame->is_settled && is_lit_at_rest();
  if (rests) frame->is_settled = false;
}

DeviceBackend::Impl::Reported DeviceBackend::Impl::report() const {
  Reported now;
  if (drawer->renderer() != nullptr) now.name = drawer->renderer()->device().name;
  now.stats = drawer->stats();
  now.image_bytes = drawer->image_bytes();
  now.has_scene = drawer->has_scene();
  now.is_processor = drawer->is_processor();
  now.traces_light = drawer->renderer() != nullptr && !now.is_processor;
  for (std::size_t mode = 0; mode < now.is_slow.size(); ++mode) {
    now.is_slow.at(mode) = drawer->is_slow(static_cast<DrawMode>(mode));
  }
  const auto [meshed, all] = drawer->meshing();
  if (all > 0) {
    now.activity = "meshing " + std::to_string(meshed) + "/" + std::to_string(all);
    now.progress = static_cast<double>(meshed) / static_cast<double>(all);
  }
  return now;
}

// The ray-marched version of the image, in full light, with the occlusion of meshes.
ViewRequest DeviceBackend::Impl::request_of_light() const {
  ViewRequest of_cpu = *request;
  of_cpu.mode = marched_mode();
  of_cpu.whole_only = true;  // the device's image is whole, so coarser ones would not be shown
  of_cpu.samples = std::min(request->samples, kSamplesAtRest);
  if (of_cpu.light.occlusion_mode != OcclusionMode::Off) of_cpu.light.occlusion_mode = OcclusionMode::Smooth;
  return of_cpu;
}

// The processor idles while the device draws, except until the device's first image and for light that the device
// lacks.
void DeviceBackend::Impl::show_by_processor() {
  ViewRequest of_cpu = *request;
  if (uses_device() && !is_device_gone && rests) {
    of_cpu = request_of_light();
  } else if (uses_device() && !is_device_gone) {
    const bool stands_in = has_thread() && !is_drawn;
    of_cpu.mode = stands_in ? DrawMode::Rays : marched_mode();
    of_cpu.samples = 1;
    if (!stands_in) of_cpu.width = of_cpu.height = 0;
  }
  cpu.show(of_cpu);
}

// Returns the processor's image of the view at rest. If the processor refuses, the device's image remains and is drawn
// again.
std::optional<ViewFrame> DeviceBackend::Impl::take_light() {
  if (request->mode == DrawMode::Smooth && cpu.smooth_refusal()) {
    is_refused = true;
    rests = false;
    is_request_new = true;
    wake.notify_all();
    return std::nullopt;
  }
  auto lit = cpu.take();
  if (!lit || !lit->is_whole) return std::nullopt;
  lit->mode = request->mode;
  return lit;
}

void DeviceBackend::Impl::give_up_device() {
  is_device_gone = true;
  if (request && !uses_device()) cpu.show(*request);
}

std::optional<ViewFrame> DeviceBackend::Impl::draw_here() {
  auto drawn = drawer->read_and_draw();
  if (drawn) return std::move(*drawn);
  error = drawn.error();
  give_up_device();
  return std::nullopt;
}

void DeviceBackend::forget_device() {
  impl_->stop();
  impl_->is_stopped = true;
  impl_->drawer.reset();
  impl_->give_up_device();
}

std::string DeviceBackend::name() const {
  const Impl& me = *impl_;
  const std::lock_guard lock(me.mutex);
  const std::string device = me.has_thread() || !me.drawer ? me.reported.name : me.report().name;
  return me.uses_device() && !device.empty() ? device : me.cpu.name();
}

bool DeviceBackend::traces_light(DrawMode mode) const {
  if (!has_meshes(mode)) return ViewBackend::traces_light(mode);
  const Impl& me = *impl_;
  const std::lock_guard lock(me.mutex);
  if (!me.has_thread() && me.drawer) return me.report().traces_light;
  return me.reported.traces_light || (me.reported.is_processor && me.is_marched_alike(mode));
}

bool DeviceBackend::can_draw(DrawMode mode) const {
  const std::lock_guard lock(impl_->mutex);
  return !has_meshes(mode) || !impl_->is_device_gone;
}

void DeviceBackend::show(const ViewRequest& request) {
  Impl& me = *impl_;
  {
    const std::lock_guard lock(me.mutex);
    if (me.request && is_same(*me.request, request)) return;
    if (!me.request || me.request->mode != request.mode) {
      me.is_drawn = false;
      me.frame.reset();
    }
    me.request = request;
    me.rests = false;
    me.is_all_fields = has_meshes(request.mode) && me.scene.voxel_count() == 0;
    me.is_request_new = true;
    ++me.request_number;
    if (me.frame) me.frame->is_settled = false;
    me.error.reset();
    if (!me.has_thread() && me.drawer) me.drawer->want(request);
    if (me.has_thread() && has_meshes(request.mode) && !me.is_device_gone) me.start();
    me.show_by_processor();
  }
  me.wake.notify_all();
}

std::optional<ViewFrame> DeviceBackend::take() {
  Impl& me = *impl_;
  if (!me.has_thread()) {
    if (!me.uses_device()) return me.cpu.take();
    return me.can_draw_now() ? me.draw_here() : std::nullopt;
  }
  const std::lock_guard lock(me.mutex);
  if (!me.uses_device() || me.is_device_gone) return me.cpu.take();
  if (me.frame) {
    me.show_by_processor();
    return std::exchange(me.frame, std::nullopt);
  }
  if (me.rests) return me.take_light();
  auto stand_in = me.is_drawn ? std::nullopt : me.cpu.take();
  if (stand_in) stand_in->is_settled = false;
  return stand_in;
}

bool DeviceBackend::wants_frames() const {
  const Impl& me = *impl_;
  return !me.has_thread() && me.can_draw_now() && me.drawer->wants_frames();
}

std::vector<std::pair<std::string, std::string>> DeviceBackend::stats() const {
  const Impl& me = *impl_;
  const std::lock_guard lock(me.mutex);
  if (!me.uses_device() || !me.drawer) return {};
  return me.has_thread() ? me.reported.stats : me.drawer->stats();
}

// The ray tracing structures are as large on a device as in memory here.
std::size_t DeviceBackend::bytes() const {
  const Impl& me = *impl_;
  const std::lock_guard lock(me.mutex);
  const bool is_here = !me.has_thread() && me.drawer;
  const bool has_scene = is_here ? me.drawer->has_scene() : me.reported.has_scene;
  const std::size_t image_bytes = is_here ? me.drawer->image_bytes() : me.reported.image_bytes;
  return me.cpu.bytes() * (has_scene ? 2 : 1) + image_bytes;
}

std::string DeviceBackend::activity() const {
  const Impl& me = *impl_;
  const std::lock_guard lock(me.mutex);
  if (!me.uses_device() || !me.drawer) return me.cpu.activity();
  if (!me.has_thread()) return me.report().activity;
  if (!me.reported.activity.empty()) return me.reported.activity;
  if (me.is_refused && me.request->mode == DrawMode::Smooth) return "too large for shadows";
  return me.rests ? me.cpu.activity() : "";
}

std::optional<double> DeviceBackend::progress() const {
  const Impl& me = *impl_;
  const std::lock_guard lock(me.mutex);
  if (!me.uses_device() || !me.drawer) return std::nullopt;
  return me.has_thread() ? me.reported.progress : me.report().progress;
}

bool DeviceBackend::is_slow(DrawMode mode) const {
  const Impl& me = *impl_;
  const std::lock_guard lock(me.mutex);
  if (!me.drawer) return false;
  return me.has_thread() ? me.reported.is_slow.at(static_cast<std::size_t>(mode)) : me.drawer->is_slow(mode);
}

bool DeviceBackend::ends_late() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->is_busy;
}

std::optional<Error> DeviceBackend::fault() {
  const std::lock_guard lock(impl_->mutex);
  return impl_->error ? impl_->error : impl_->cpu.fault();
}

double DeviceBackend::pause() {
  const auto start = std::chrono::steady_clock::now();
  {
    std::unique_lock lock(impl_->mutex);
    impl_->is_paused = true;
    impl_->idle.wait(lock, [this] { return !impl_->is_reading; });
  }
  impl_->cpu.pause();
  return seconds_since(start);
}

void DeviceBackend::resume(bool changed) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->is_paused = false;
    if (changed) {
      impl_->rests = false;
      impl_->is_refused = false;
      if (impl_->request) {
        impl_->is_all_fields = has_meshes(impl_->request->mode) && impl_->scene.voxel_count() == 0;
        impl_->show_by_processor();
      }
      impl_->is_edited = true;
      if (!impl_->has_thread() && impl_->drawer) impl_->drawer->note_edit();
      if (impl_->frame) impl_->frame->is_settled = false;
      ++impl_->request_number;
    }
  }
  impl_->wake.notify_all();
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
