#pragma once

#include <cstdint>
#include <span>

#include "render_vk/device/device.h"

namespace quoin::vulkan {

/// How triangles are drawn whose corners shaders read from memory. Viewport and scissor are set when that is recorded.
struct GraphicsPipelineInfo {
  VkRenderPass pass = VK_NULL_HANDLE;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  VkPipelineRasterizationStateCreateInfo raster{};
  VkPipelineDepthStencilStateCreateInfo depth{};
  VkPipelineColorBlendAttachmentState blend{};
  VkSampleCountFlagBits samples = VK_SAMPLE_COUNT_1_BIT;

  /// Filled triangles, both sides, no depth, nothing blended.
  GraphicsPipelineInfo();
};

/// `stages`: of vertices and of fragments.
[[nodiscard]] VkResult make_graphics_pipeline(const Device& device,
                                              std::span<const VkPipelineShaderStageCreateInfo, 2> stages,
                                              const GraphicsPipelineInfo& info, VkPipeline& pipeline);

}  // namespace quoin::vulkan
