#include "cpu_backend.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <new>
#include <thread>
#include <utility>

#include <quoin/render/cpu_renderer.h>
#include <quoin/render/path_tracer.h>
#include <quoin/scene/smooth_scene.h>

namespace quoin::viewer {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::array kDivisors = {4, 3, 2, 1};
constexpr int kSampleFactor = 4;
constexpr double kPatienceAfterEdits = 4.0;  // factor for the first image if the camera stayed, to keep it fine
// Lamps of a draft. The castle at a quarter, two cores: 73 ms in full light; without lamps 23, with 2 of them 28, with
// 4 33.
constexpr int kDraftLamps = 2;

/// One of the images that lead to the settled one.
struct Stage {
  int divisor = 1;
  int samples = 1;
  bool is_draft = false;  ///< with simpler light than requested

  [[nodiscard]] int width(const ViewRequest& request) const { return (request.width + divisor - 1) / divisor; }
  [[nodiscard]] int height(const ViewRequest& request) const { return (request.height + divisor - 1) / divisor; }
  [[nodiscard]] double pixels(const ViewRequest& request) const {
    return static_cast<double>(width(request)) * height(request);
  }
  [[nodiscard]] bool is_last(const ViewRequest& request) const {
    return divisor == 1 && samples >= request.samples && !is_draft;
  }
  [[nodiscard]] Stage next(const ViewRequest& request) const {
    if (divisor > 1 || is_draft) return {(divisor + 1) / 2, 1, false};
    return {1, std::min(samples * kSampleFactor, request.samples), false};
  }
};

// Returns the light of a draft: few lamps, vertex occlusion. Shadings that show values instead of colours stay as they
// are.
LightOptions draft_of(LightOptions light) {
  if (light.shading != Shading::Lit) return light;
  if (light.model == LightModel::Rays) light.max_lamps = std::min(light.max_lamps, kDraftLamps);
  if (light.occlusion_mode == OcclusionMode::Rays) light.occlusion_mode = OcclusionMode::Vertex;
  return light;
}

bool has_drafts(const ViewRequest& request) {
  return request.mode != DrawMode::Density && request.mode != DrawMode::Paths && !request.whole_only &&
         draft_of(request.light) != request.light;
}

RenderOptions options_for(const ViewRequest& request, const Stage& stage) {
  RenderOptions options;
  options.width = stage.width(request);
  options.height = stage.height(request);
  options.samples = stage.samples;
  options.light = stage.is_draft ? draft_of(request.light) : request.light;
  options.environment = marched_environment(request);
  // Short-lived images do not wait for impostors.
  if (stage.divisor > 1) options.detail.impostor_seconds = 0.0;
  options.detail.colours = request.detail_colours;
  if (request.detail_by_pixels) options.detail.policy.emplace().rule = DetailPolicy::Rule::ByPixels;
  return options;
}

// Draws a density slice, which is final after the first sample.
Result<RenderedImage> draw_densities(const Scene& scene, const ViewRequest& request, const Stage& stage,
                                     const CpuBackendOptions& options) {
  DensitySliceOptions slice;
  slice.width = stage.width(request);
  slice.height = stage.height(request);
  slice.axis = request.slice.axis;
  slice.at = request.slice.at;
  slice.instances = options.instances;
  auto drawn = draw_density_slice(scene, slice, options.threads);
  if (!drawn) return drawn.error();
  RenderedImage image;
  image.colour = std::move(drawn->colour);
  return image;
}

/// The data for path tracing.
struct PathPart {
  PathPart(const Scene& scene, const CpuBackendOptions& options)
      : tracer(scene, options.instances, options.threads), bounds(scene.bounds(options.instances)) {}

  PathTracer tracer;
  DBox bounds;
  PathMemory memory;
};

/// The data for ray-marching smooth surfaces.
struct SmoothPart {
  explicit SmoothPart(const CpuBackendOptions& options) : fields({options.instances, options.max_density_bytes}) {}

  SmoothScene fields;
  std::optional<CpuRenderer> renderer;
  std::map<int, DetailSelector> selectors;
};

}  // namespace

struct CpuBackend::Impl {
  Impl(const Scene& shown, const CpuBackendOptions& given, std::function<void()> listener)
      : scene(shown), options(given), on_frame(std::move(listener)), renderer(shown, given.instances, given.threads) {
    count_bytes();
    worker = std::thread([this] { work(); });
  }

  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      is_stopped = true;
      halt = true;
    }
    wake.notify_all();
    worker.join();
  }

  void work();
  [[nodiscard]] bool has_work() const {
    const bool can_draw = request && !is_done && request->width > 0 && request->height > 0;
    return is_stopped || (!is_paused && !is_broken && (is_stale || can_draw));
  }
  void update(std::unique_lock<std::mutex>& lock);
  void draw(std::unique_lock<std::mutex>& lock);
  [[nodiscard]] Result<RenderedImage> rendered_of(const ViewRequest& wanted, const Stage& now, const Progress& goes_on);
  [[nodiscard]] Result<RenderedImage> path_image(const ViewRequest& wanted, const Stage& now, const Progress& goes_on);
  void prepare_paths();
  void count_bytes();
  [[nodiscard]] Status prepare_smooth(const Progress& goes_on);
  void refuse_smooth(Error why);
  void publish(Result<RenderedImage> image, const ViewRequest& of, const Stage& stage, double seconds);
  [[nodiscard]] Stage first_stage() const;
  [[nodiscard]] std::optional<Stage> finest(bool is_draft, double patience) const;
  [[nodiscard]] bool may_begin(int divisor) const;
  void note_speed(const Stage& drawn, const ViewRequest& of, double seconds);
  void report() const {
    if (on_frame) on_frame();
  }

  const Scene& scene;
  CpuBackendOptions options;
  std::function<void()> on_frame;
  CpuRenderer renderer;
  std::map<int, DetailSelector> selectors;  // by divisor: images of another size are another view
  std::unique_ptr<SmoothPart> smooth;       // used by the worker
  std::unique_ptr<PathPart> paths;          // used by the worker
  std::atomic<bool> is_smooth_stale{true};
  std::atomic<bool> are_paths_stale{true};
  std::atomic<std::size_t> held{0};     // bytes of the data made from the scene
  std::atomic<int> smooth_percent{-1};  // progress of making `smooth`; -1: idle
  std::atomic<bool> is_preparing_paths{false};

  mutable std::mutex mutex;  // guards the members below, except the atomic ones
  std::condition_variable wake;
  std::condition_variable idle;
  std::optional<ViewRequest> request;
  std::optional<Stage> stage;  // the next one; empty until the first has been chosen
  bool is_done = false;
  bool is_camera_new = true;
  bool is_paused = false;
  bool is_stale = false;
  bool is_busy = false;  // the worker reads the scene
  bool is_stopped = false;
  bool is_broken = false;  // out of memory: the worker waits for the next change of the scene
  std::optional<ViewFrame> frame;
  std::optional<Error> error;
  std::optional<Error> refusal;               // of smooth images
  std::array<double, 2> seconds_per_pixel{};  // in full light and for drafts; 0: not known
  Stage first{kDivisors.front()};             // first stage of the last request

  std::atomic<std::uint64_t> request_number{0};
  std::atomic<std::uint64_t> mode_number{0};  // of the last request that changed the mode
  std::atomic<bool> halt{false};

  std::thread worker;
};

void CpuBackend::Impl::work() {
  yield_to_window();
  std::unique_lock lock(mutex);
  for (;;) {
    wake.wait(lock, [this] { return has_work(); });
    if (is_stopped) return;
    is_busy = true;
    try {
      is_stale ? update(lock) : draw(lock);
    } catch (const std::bad_alloc&) {
      if (!lock.owns_lock()) lock.lock();
      error = Error{ErrorCode::LimitExceeded, "out of memory", "", std::nullopt};
      is_broken = true;
    }
    is_busy = false;
    idle.notify_all();
    lock.unlock();
    report();
    lock.lock();
  }
}

void CpuBackend::Impl::update(std::unique_lock<std::mutex>& lock) {
  lock.unlock();
  renderer.update(options.threads);
  if (paths) paths->memory.note_edit();
  count_bytes();
  lock.lock();
  is_stale = false;
}

// The path tracer has its own structures, as large as the ray marcher's.
void CpuBackend::Impl::count_bytes() {
  const std::size_t structures = renderer.tracer().bytes();
  std::size_t all = structures;
  if (paths) all += structures + paths->memory.bytes();
  if (smooth) all += smooth->fields.bytes() + (smooth->renderer ? smooth->renderer->tracer().bytes() : 0);
  held = all;
}

std::optional<Stage> CpuBackend::Impl::finest(bool is_draft, double patience) const {
  std::optional<Stage> chosen;
  const double each = seconds_per_pixel.at(is_draft ? 1 : 0);
  if (each <= 0.0) return chosen;
  for (const int divisor : kDivisors) {
    const Stage finer{divisor, 1, is_draft};
    if (!may_begin(divisor)) continue;
    const bool is_as_before = divisor == first.divisor && is_draft == first.is_draft;
    if (finer.pixels(*request) * each <= patience * (is_as_before ? kConstancy : 1.0)) chosen = finer;
  }
  return chosen;
}

// After an edit, path-traced images continue at a size that the history has.
bool CpuBackend::Impl::may_begin(int divisor) const {
  return !paths || paths->memory.may_begin(*request, divisor);
}

// As fine as time allows; a draft if an image in full light would be smaller than a half.
Stage CpuBackend::Impl::first_stage() const {
  if (request->whole_only) return {};
  const double patience = options.first_frame_seconds * (is_camera_new ? 1.0 : kPatienceAfterEdits);
  const std::optional<Stage> full = finest(false, patience);
  if (!has_drafts(*request)) {
    if (full) return *full;
    return {paths ? paths->memory.first_divisor(*request, kDivisors) : kDivisors.front()};
  }
  if (full && full->divisor <= 2) return *full;
  return finest(true, patience).value_or(Stage{kDivisors.front(), 1, true});
}

void CpuBackend::Impl::draw(std::unique_lock<std::mutex>& lock) {
  const bool is_first = !stage.has_value();
  if (is_first) stage = first = first_stage();
  const bool is_kept_on = is_first && !request->whole_only;
  ViewRequest wanted = *request;
  const bool is_density = wanted.mode == DrawMode::Density;
  if (is_density) wanted.samples = 1;
  if (wanted.mode == DrawMode::Paths) wanted.samples = kPathSamples;
  const Stage now = *stage;
  const std::uint64_t number = request_number;
  const std::uint64_t mode = mode_number;
  lock.unlock();
  const Clock::time_point start = Clock::now();
  auto image = rendered_of(
      wanted, now, [&](double) { return !halt && mode_number == mode && (is_kept_on || request_number == number); });
  const double seconds = seconds_since(start);
  lock.lock();
  if (mode_number != mode || (!image && image.error().code == ErrorCode::Cancelled)) return;
  if (refusal && wanted.mode == DrawMode::Smooth) {
    is_done = request_number == number;
    return;
  }
  publish(std::move(image), wanted, now, seconds);
  if (request_number != number) {
    if (frame) frame->is_settled = false;
    return;
  }
  is_done = error.has_value() || now.is_last(wanted);
  is_camera_new = false;
  stage = now.next(wanted);
}

Result<RenderedImage> CpuBackend::Impl::rendered_of(const ViewRequest& wanted, const Stage& now,
                                                    const Progress& goes_on) {
  if (wanted.mode == DrawMode::Density) return draw_densities(scene, wanted, now, options);
  if (wanted.mode == DrawMode::Paths) return path_image(wanted, now, goes_on);
  paths.reset();
  are_paths_stale = true;
  RenderOptions render = options_for(wanted, now);
  if (wanted.mode != DrawMode::Smooth) {
    smooth.reset();
    is_smooth_stale = true;
    render.detail.selector = &selectors[now.divisor];
    return renderer.render(wanted.camera, render, options.threads, goes_on);
  }
  if (Status prepared = prepare_smooth(goes_on); !prepared) return prepared.error();
  render.detail.selector = &smooth->selectors[now.divisor];
  return smooth->renderer->render(wanted.camera, render, options.threads, goes_on);
}

Result<RenderedImage> CpuBackend::Impl::path_image(const ViewRequest& wanted, const Stage& now,
                                                   const Progress& goes_on) {
  smooth.reset();
  is_smooth_stale = true;
  prepare_paths();
  auto taken = paths->tracer.render(
      wanted.camera, path_options(wanted, now.width(wanted), now.height(wanted), now.samples, paths->bounds),
      options.threads, goes_on);
  if (!taken) return taken.error();
  paths->memory.of(wanted).refine(*taken, now.samples, options.threads);
  count_bytes();
  auto colour = develop(*taken, develop_options(wanted));
  if (!colour) return colour.error();
  RenderedImage image;
  image.colour = std::move(*colour);
  image.rays = taken->rays;
  return image;
}

void CpuBackend::Impl::prepare_paths() {
  if (!are_paths_stale) return;
  struct Preparing {
    explicit Preparing(std::atomic<bool>& is_preparing) : flag(is_preparing) { flag = true; }
    ~Preparing() { flag = false; }  // also if memory runs out
    Preparing(const Preparing&) = delete;
    Preparing& operator=(const Preparing&) = delete;
    std::atomic<bool>& flag;
  } const preparing(is_preparing_paths);
  report();
  if (paths) {
    paths->tracer.update(options.threads);
    paths->bounds = scene.bounds(options.instances);
  } else {
    paths = std::make_unique<PathPart>(scene, options);
  }
  are_paths_stale = false;
  count_bytes();
}

// Makes the fields, or updates their changed parts.
Status CpuBackend::Impl::prepare_smooth(const Progress& goes_on) {
  if (!is_smooth_stale) return {};
  const auto report_progress = [&](double share) {
    const int percent = static_cast<int>(share * 100.0);
    if (smooth_percent.exchange(percent) != percent) report();
    return goes_on(share);
  };
  Status made = [&]() -> Status {
    try {
      if (!smooth) smooth = std::make_unique<SmoothPart>(options);
      if (Status updated = smooth->fields.update(scene, options.threads, report_progress); !updated) return updated;
      if (smooth->renderer) {
        smooth->renderer->update(options.threads);
      } else {
        smooth->renderer.emplace(smooth->fields.scene(), InstanceFilter::All, options.threads);
      }
      return {};
    } catch (const std::bad_alloc&) {
      smooth.reset();
      return make_error(ErrorCode::LimitExceeded, "out of memory");
    }
  }();
  smooth_percent = -1;
  if (made) {
    is_smooth_stale = false;
    count_bytes();
  } else if (made.error().code != ErrorCode::Cancelled) {
    refuse_smooth(made.error());
  }
  return made;
}

void CpuBackend::Impl::refuse_smooth(Error why) {
  const std::lock_guard lock(mutex);
  refusal = std::move(why);
}

void CpuBackend::Impl::publish(Result<RenderedImage> image, const ViewRequest& of, const Stage& drawn, double seconds) {
  if (!image) {
    error = image.error();
    return;
  }
  const bool is_whole = image->colour.width == of.width && image->colour.height == of.height;
  frame = ViewFrame{std::move(image->colour), nullptr, of.mode,    drawn.samples, is_whole,
                    drawn.is_last(of),        seconds, image->rays};
  if (drawn.samples == 1) note_speed(drawn, of, seconds);
}

void CpuBackend::Impl::note_speed(const Stage& drawn, const ViewRequest& of, double seconds) {
  double& known = seconds_per_pixel.at(drawn.is_draft ? 1 : 0);
  known = seconds_known(known, seconds / drawn.pixels(of));
}

CpuBackend::CpuBackend(const Scene& scene, const CpuBackendOptions& options, std::function<void()> on_frame)
    : impl_(std::make_unique<Impl>(scene, options, std::move(on_frame))) {}
CpuBackend::~CpuBackend() = default;

std::string CpuBackend::name() const {
  return "processor";
}

void CpuBackend::show(const ViewRequest& request) {
  {
    const std::lock_guard lock(impl_->mutex);
    if (impl_->request && is_same(*impl_->request, request)) return;
    impl_->is_camera_new = !impl_->request || impl_->request->camera != request.camera || impl_->is_camera_new;
    if (impl_->request && impl_->request->mode != request.mode) {
      impl_->seconds_per_pixel = {};
      impl_->frame.reset();
      ++impl_->mode_number;
    }
    impl_->request = request;
    impl_->stage.reset();
    impl_->is_done = false;
    impl_->error.reset();
    ++impl_->request_number;
    if (impl_->frame) impl_->frame->is_settled = false;
  }
  impl_->wake.notify_all();
}

std::optional<ViewFrame> CpuBackend::take() {
  const std::lock_guard lock(impl_->mutex);
  return std::exchange(impl_->frame, std::nullopt);
}

std::size_t CpuBackend::bytes() const {
  return impl_->held;
}

std::string CpuBackend::activity() const {
  if (impl_->is_preparing_paths) return "preparing path tracing";
  const int percent = impl_->smooth_percent;
  return percent < 0 ? "" : "preparing light " + std::to_string(percent) + " %";
}

std::optional<Error> CpuBackend::smooth_refusal() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->refusal;
}

std::optional<Error> CpuBackend::fault() {
  const std::lock_guard lock(impl_->mutex);
  return impl_->error;
}

double CpuBackend::pause() {
  const Clock::time_point start = Clock::now();
  std::unique_lock lock(impl_->mutex);
  impl_->is_paused = true;
  impl_->halt = true;
  impl_->idle.wait(lock, [this] { return !impl_->is_busy; });
  return seconds_since(start);
}

void CpuBackend::resume(bool changed) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->is_paused = false;
    impl_->halt = impl_->is_stopped;
    if (changed) {
      impl_->is_stale = true;
      impl_->is_smooth_stale = true;
      impl_->are_paths_stale = true;
      impl_->is_broken = false;
      impl_->refusal.reset();
      impl_->is_done = false;
      impl_->stage.reset();
      impl_->frame.reset();
      impl_->error.reset();
      ++impl_->request_number;
    }
  }
  impl_->wake.notify_all();
}

std::optional<SceneHit> CpuBackend::pick(const Camera& camera, double x, double y, int width, int height) {
  // Only `resume`, on this thread, requests an update of the tracer, so it cannot change here without one under way.
  if (width <= 0 || height <= 0 || !is_up_to_date()) return std::nullopt;
  {
    const std::lock_guard lock(impl_->mutex);
    if (impl_->request && impl_->request->mode == DrawMode::Density) return std::nullopt;
  }
  return quoin::pick(impl_->renderer.tracer(), camera, {x, y, width, height});
}

std::optional<SlideResult> CpuBackend::slide(const OrientedBox& box, DVec3 displacement, const SlideOptions& options) {
  if (!is_up_to_date()) return std::nullopt;
  return move_and_slide(impl_->renderer.tracer(), box, displacement, options);
}

bool CpuBackend::is_up_to_date() {
  const std::lock_guard lock(impl_->mutex);
  return !impl_->is_stale;
}

}  // namespace quoin::viewer
