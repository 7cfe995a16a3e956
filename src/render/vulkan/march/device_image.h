#pragma once

#include <cstdint>
#include <optional>

#include <quoin/render/cpu_renderer.h>
#include <quoin/render/light_options.h>
#include <quoin/render/vulkan_image.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/environment.h>

#include "render/vulkan/device/device_memory.h"
#include "render/vulkan/march/pipelines.h"

namespace quoin {

/// The device state of a VulkanImage: one word per pixel, row by row, sRGB bytes with red lowest.
struct VulkanImage::Impl {
  Impl(vulkan::Device& of_device, const vulkan::Pipelines& with_pipelines)
      : device(&of_device), pipelines(&with_pipelines) {}

  /// Allocates that many pixels; their contents are undefined if the size changes. Errors: LimitExceeded.
  [[nodiscard]] Status resize(int new_width, int new_height);
  /// Allocates `sums` and starts without samples, for this camera. Errors: LimitExceeded.
  [[nodiscard]] Status begin_sums(const Camera& of_camera, const RenderOptions& options);
  /// Records VulkanImage::record_copy, after `prepare_copy` accepted the target.
  void record_copy(VkCommandBuffer commands, const VulkanImageTarget& target) const;
  /// Validates the target. Errors: those of VulkanImage::record_copy.
  [[nodiscard]] Status prepare_copy(const VulkanImageTarget& target);

  vulkan::Device* device;
  const vulkan::Pipelines* pipelines;
  int width = 0;
  int height = 0;
  int samples = 0;
  std::int64_t rays = 0;
  vulkan::Buffer colours;
  vulkan::Buffer swapped;  ///< the colours with blue lowest; only if a target image needed them
  // The camera and light of its samples.
  Camera camera;
  LightOptions light;
  std::optional<Environment> environment;
  vulkan::Buffer sums;  ///< sums of the samples' light, four floats per pixel; only if samples accumulate
};

namespace vulkan {
using ImageImpl = VulkanImage::Impl;
}

}  // namespace quoin
