#include "viewer.h"

#include "app.h"

#include <algorithm>

namespace quoin::viewer {

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
