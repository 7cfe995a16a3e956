#pragma once

#include <cstdint>
#include <memory>

#include <glm/vec2.hpp>

#include "render_vk/device/device.h"

namespace quoin::vulkan {

// What src/render_vk/shaders/window.glsl declares, field by field.
struct WindowPush {
  std::uint64_t data = 0;
  std::uint64_t font = 0;
  glm::ivec2 source{0};
  glm::vec2 origin{0.0F};
  glm::vec2 scale{1.0F};
  glm::vec2 window{1.0F};
};
static_assert(sizeof(WindowPush) == 48);

/// How a window is drawn: a picture, and triangles over it.
class WindowPipelines {
 public:
  /// Errors: those of Swapchain::format_of, LimitExceeded.
  [[nodiscard]] static Result<std::unique_ptr<WindowPipelines>> create(Device& device);
  ~WindowPipelines();
  WindowPipelines(const WindowPipelines&) = delete;
  WindowPipelines& operator=(const WindowPipelines&) = delete;

  /// Clears, and leaves images ready to be shown.
  [[nodiscard]] VkRenderPass pass() const { return pass_; }
  void bind_picture(VkCommandBuffer commands, const WindowPush& push) const { bind(commands, picture_, push); }
  void bind_overlay(VkCommandBuffer commands, const WindowPush& push) const { bind(commands, overlay_, push); }

 private:
  explicit WindowPipelines(Device& device) : device_(&device) {}
  VkResult make_pass(VkFormat format);
  VkResult make_layout();
  void bind(VkCommandBuffer commands, VkPipeline pipeline, const WindowPush& push) const;

  Device* device_;
  VkRenderPass pass_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkPipeline picture_ = VK_NULL_HANDLE;
  VkPipeline overlay_ = VK_NULL_HANDLE;
};

}  // namespace quoin::vulkan
