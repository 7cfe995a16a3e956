#pragma once

#include <memory>
#include <optional>

#include "window_device.h"

struct ImDrawData;

namespace quoin::viewer {

/// Draws the GUI of the current Dear ImGui context with Dear ImGui's own Vulkan backend. Destroyed before the context.
class VulkanGui {
 public:
  /// `pass` is the render pass for `draw`. Errors: LimitExceeded, Unsupported.
  [[nodiscard]] static Result<std::unique_ptr<VulkanGui>> create(const WindowDevice& device, VkRenderPass pass);
  ~VulkanGui();
  VulkanGui(const VulkanGui&) = delete;
  VulkanGui& operator=(const VulkanGui&) = delete;

  /// Records the upload of the fonts. Errors: LimitExceeded.
  [[nodiscard]] Status upload_fonts(VkCommandBuffer commands);
  /// Frees the fonts' pixels in memory. Requires: the commands of the upload have run.
  void end_upload() const;
  /// Records the drawing commands of a frame, for an image of this size.
  /// Requires: the frame before the last one has been drawn. Errors: LimitExceeded.
  [[nodiscard]] Status draw(VkCommandBuffer commands, const ImDrawData& data, VkExtent2D size);

 private:
  explicit VulkanGui(const WindowDevice& device) : device_(&device) {}
  VkResult make_pool();
  template <class Work>
  Status attempt(const Work& work);

  const WindowDevice* device_;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  bool is_open_ = false;
  std::optional<Error> failure_;  // after one the backend may hold invalid handles
};

}  // namespace quoin::viewer
