// In place of everything else in this folder where Quoin is built without Vulkan.

#include "viewer/window/screen.h"

namespace quoin::viewer {

Result<std::unique_ptr<Screen>> open_vulkan_screen(int, int, const std::string&) {
  // The library says what was missing.
  const auto devices = vulkan_devices();
  return devices ? make_error(ErrorCode::Unsupported, "vulkan: this build has no windows by it") : devices.error();
}

}  // namespace quoin::viewer
