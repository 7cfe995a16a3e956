#include <quoin/render/light_options.h>

#include <cmath>

namespace quoin {

LightOptions natural_light() {
  LightOptions options;
  options.max_lamps = 64;
  options.glass_surfaces = true;
  options.field_occlusion_reach = 3.0;
  return options;
}

Status check(const LightOptions& options) {
  const auto refuse = [](const char* message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (options.occlusion_rays < 1 || options.occlusion_rays > 4096) {
    return refuse("occlusion rays: must be 1 to 4096");
  }
  if (!std::isfinite(options.occlusion_distance_voxels) || options.occlusion_distance_voxels < 0.0) {
    return refuse("occlusion distance: must be finite and not negative");
  }
  if (!(options.field_occlusion_reach >= 0.0 && options.field_occlusion_reach <= 1024.0)) {
    return refuse("field occlusion reach: must be 0 to 1024");
  }
  if (!(options.shadow_distance_voxels >= 0.0)) return refuse("shadow distance: must not be negative");
  if (!(options.least_light >= 0.0 && options.least_light <= 1e9)) return refuse("least light: must be 0 to 1e9");
  if (options.max_lamps < 0 || options.max_lamps > 1024) return refuse("max_lamps: must be 0 to 1024");
  return {};
}

}  // namespace quoin
