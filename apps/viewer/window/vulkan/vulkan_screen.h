#pragma once

#include <memory>

#include <quoin/render_vk/vulkan_renderer.h>

#include "window_device.h"

struct SDL_Window;

namespace quoin::viewer {

/// Returns the device options for a window with SDL_WINDOW_VULKAN, which must outlive the device. Errors: Unsupported.
[[nodiscard]] Result<WindowDeviceOptions> device_options(SDL_Window* window);

/// Creates a renderer that keeps the device alive. Errors: those of VulkanRenderer::create.
[[nodiscard]] Result<std::shared_ptr<VulkanRenderer>> make_renderer(std::shared_ptr<WindowDevice> device);

}  // namespace quoin::viewer
