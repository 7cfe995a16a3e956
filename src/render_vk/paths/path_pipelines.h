#pragma once

#include <array>
#include <memory>

#include "render_vk/device/device.h"
#include "render_vk/march/device_scene.h"
#include "render_vk/paths/path_data.h"

namespace quoin::vulkan {

/// The path tracing shader in the variants that scenes need: with glass, with fields, with transparent fields. Each
/// variant is created at first use.
class PathPipelines {
 public:
  [[nodiscard]] static Result<std::unique_ptr<PathPipelines>> create(Device& device);
  ~PathPipelines();
  PathPipelines(const PathPipelines&) = delete;
  PathPipelines& operator=(const PathPipelines&) = delete;

  /// Errors: those of VulkanRenderer.
  [[nodiscard]] Status prepare(const Placement& placement);
  /// Records steps of a tile's paths, and a barrier before their results are read. Requires: it was prepared.
  void dispatch(VkCommandBuffer commands, const Placement& placement, const PathPush& push) const;

 private:
  explicit PathPipelines(Device& device) : device_(&device) {}
  [[nodiscard]] static std::size_t variant_of(const Placement& placement);

  Device* device_;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  std::array<VkPipeline, 8> pipelines_{};
};

}  // namespace quoin::vulkan
