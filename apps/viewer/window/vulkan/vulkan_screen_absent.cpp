// Replaces the other files of this folder in builds without Vulkan or without the libraries for its windows.

#include "viewer/window/screen.h"

namespace quoin::viewer {

Result<std::unique_ptr<Screen>> open_vulkan_screen(int, int, const std::string&) {
  if (const auto devices = vulkan_devices(); !devices) return devices.error();
  return make_error(ErrorCode::Unsupported, "vulkan: this build has no Vulkan windows: " QUOIN_VIEWER_VULKAN_MISSING);
}

}  // namespace quoin::viewer
