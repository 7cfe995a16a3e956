#pragma once

#include <cstdint>
#include <memory>

#include <glm/vec2.hpp>

#include "window_device.h"

namespace quoin::viewer {

// Mirrors the declaration in shaders/window.glsl, field by field.
struct WindowPush {
  std::uint64_t corners = 0;
  std::uint64_t font = 0;
  glm::ivec2 source{0};
  glm::vec2 origin{0.0F};
  glm::vec2 scale{1.0F};
  glm::vec2 window{1.0F};
};
static_assert(sizeof(WindowPush) == 48);

/// The pipelines that draw a window: an image, and triangles over it.
class WindowPipelines {
 public:
  /// Errors: those of Swapchain::format_of, LimitExceeded.
  [[nodiscard]] static Result<std::unique_ptr<WindowPipelines>> create(const WindowDevice& device);
  ~WindowPipelines();
  WindowPipelines(const WindowPipelines&) = delete;
  WindowPipelines& operator=(const WindowPipelines&) = delete;

  /// Clears the image and leaves it ready to present.
  [[nodiscard]] VkRenderPass pass() const { return pass_; }
  /// Sets the image that `bind_image` draws. Requires: no commands that draw another image are running.
  void show_image(VkImageView view) const;
  void bind_image(VkCommandBuffer commands, const WindowPush& push) const;

 private:
  explicit WindowPipelines(const WindowDevice& device) : device_(&device) {}
  VkResult make_pass(VkFormat format);
  VkResult make_layout();
  VkResult make_set();
  void bind(VkCommandBuffer commands, VkPipeline pipeline, const WindowPush& push) const;

  const WindowDevice* device_;
  VkRenderPass pass_ = VK_NULL_HANDLE;
  VkSampler sampler_ = VK_NULL_HANDLE;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
  VkDescriptorPool sets_ = VK_NULL_HANDLE;
  VkDescriptorSet set_ = VK_NULL_HANDLE;  // one image
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkPipeline image_ = VK_NULL_HANDLE;
};

}  // namespace quoin::viewer
