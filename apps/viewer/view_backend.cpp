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
         a.wireframe == b.wireframe && a.look == b.look && a.slice == b.slice && a.whole_only == b.whole_only &&
         a.camera == b.camera && a.light == b.light;
}

PathOptions path_options(const ViewRequest& request, int width, int height, int samples, const DBox& bounds) {
  PathOptions options;
  static_cast<Look&>(options) = request.look ? request.look->look : natural_look().look;
  if (options.sky == SkyModel::Environment) options.sky = SkyModel::Uniform;  // the environment image is not loaded
  options.lens_radius = 0.0;
  options.width = width;
  options.height = height;
  options.samples = samples;
  options.denoise = true;
  const LightOptions& light = request.light;
  options.sun = light.sun;
  options.sun_brightness *= light.sun_brightness;
  options.sky_brightness *= light.sky_brightness;
  options.lamp_brightness = light.lamp_brightness;
  fit_look(bounds, options);
  if (request.look) {
    options.max_bounces = request.look->max_bounces;
    options.max_scatterings = request.look->max_scatterings;
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
  DevelopOptions options =
      request.look ? request.look->develop : natural_look(SkyModel::Gradient, request.light.sun).develop;
  options.exposure *= request.light.exposure;
  return options;
}

}  // namespace quoin::viewer
