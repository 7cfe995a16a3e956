#include "view_backend.h"

#include <algorithm>

#ifdef __linux__
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace quoin::viewer {

void yield_to_window() {
#ifdef __linux__
  constexpr int kNice = 5;  // a third of the processor time of a thread at 0, if both are busy
  const auto thread = static_cast<id_t>(::gettid());
  if (::getpriority(PRIO_PROCESS, thread) < kNice) ::setpriority(PRIO_PROCESS, thread, kNice);
#endif
}

double seconds_known(double known, double measured) {
  constexpr double kNews = 0.3;  // weight of the new measurement
  return known > 0.0 ? known + kNews * (measured - known) : measured;
}

bool is_same(const ViewRequest& a, const ViewRequest& b) {
  return a.width == b.width && a.height == b.height && a.samples == b.samples &&
         a.detail_by_pixels == b.detail_by_pixels && a.detail_colours == b.detail_colours && a.mode == b.mode &&
         a.wireframe == b.wireframe && a.environment == b.environment && a.exposure == b.exposure &&
         a.render_settings == b.render_settings && a.slice == b.slice && a.whole_only == b.whole_only &&
         a.camera == b.camera && a.light == b.light;
}

Environment marched_environment(const ViewRequest& request) {
  Environment environment = request.environment;
  environment.exposure = environment.exposure.value_or(1.0) * request.exposure;
  return environment;
}

namespace {

// Returns the environment of path-traced images: the file's render settings, with sun and brightness of the panel.
Environment traced_environment(const ViewRequest& request) {
  const Environment& wanted = request.environment;
  if (!request.render_settings) return wanted;
  Environment environment = request.render_settings->environment;
  environment.sun.direction = wanted.sun.direction;
  environment.sun.brightness *= wanted.sun.brightness;
  environment.sky.brightness *= wanted.sky.brightness;
  environment.lamp_brightness = wanted.lamp_brightness;
  return environment;
}

}  // namespace

PathOptions path_options(const ViewRequest& request, int width, int height, int samples, const DBox& bounds) {
  PathOptions options;
  Environment& environment = options.environment.emplace(traced_environment(request));
  // The viewer does not read the sky image of a .vox file or of a world.
  if (lacks_image(environment.sky)) environment.sky.model = SkyModel::Uniform;
  options.width = width;
  options.height = height;
  options.samples = samples;
  options.denoise = true;
  if (request.render_settings) {
    fit_environment(bounds, environment);
    options.max_bounces = request.render_settings->max_bounces;
    options.max_scatterings = request.render_settings->max_scatterings;
  }
  return options;
}

bool PathMemory::is_of(const ViewRequest& request) const {
  ViewRequest wanted = request;
  wanted.samples = kPathSamples;
  return request_ && is_same(*request_, wanted);
}

PathHistory& PathMemory::of(const ViewRequest& request) {
  if (!is_of(request)) {
    history_.clear();
    request_ = request;
    request_->samples = kPathSamples;
  }
  return history_;
}

void PathMemory::clear() {
  history_.clear();
  request_.reset();
}

bool PathMemory::may_begin(const ViewRequest& request, int divisor) const {
  if (!is_of(request) || !history_.has_earlier()) return true;
  const auto pixels = [divisor](int all) { return (all + divisor - 1) / divisor; };
  return history_.knows(pixels(request.width), pixels(request.height), 1);
}

int PathMemory::first_divisor(const ViewRequest& request, std::span<const int> divisors) const {
  const auto found = std::ranges::find_if(divisors, [&](int divisor) { return may_begin(request, divisor); });
  return found != divisors.end() ? *found : divisors.front();
}

DevelopOptions develop_options(const ViewRequest& request) {
  DevelopOptions options = develop_options(traced_environment(request));
  options.exposure *= request.exposure;
  return options;
}

}  // namespace quoin::viewer
