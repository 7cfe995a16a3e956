// Replaces the other files of this folder in builds without Vulkan.

#include "viewer/window/screen.h"

namespace quoin::viewer {

Result<std::unique_ptr<Screen>> open_vulkan_screen(int, int, const std::string&) {
  // The library's error names the missing part.
  const auto devices = vulkan_devices();
  return devices ? make_error(ErrorCode::Unsupported, "vulkan: this build has no Vulkan windows") : devices.error();
}

}  // namespace quoin::viewer
