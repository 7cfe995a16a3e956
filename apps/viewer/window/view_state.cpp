#include "view_state.h"

namespace quoin::viewer {

namespace {

constexpr double kWalkersFov = 1.15;  // radians

}  // namespace

void ViewState::set_camera_mode(CameraMode mode) {
  if (mode == CameraMode::Walk && camera.mode != mode) {
    const DBox bounds = scene().bounds();
    DVec3 feet(0.0);
    if (!bounds.empty()) {
      const DVec3 middle = 0.5 * bounds.min + 0.5 * bounds.max;
      feet = {middle.x, bounds.max.y, middle.z};
    }
    if (hover) feet = hover->position;
    walker.stand(feet, bounds);
    fov_before_walk = camera.camera().vertical_fov;
    camera.look_level(kWalkersFov);
  }
  if (mode != CameraMode::Walk && camera.mode == CameraMode::Walk) camera.set_vertical_fov(fov_before_walk);
  camera.mode = mode;
  settings.camera_mode = mode;
}

}  // namespace quoin::viewer
