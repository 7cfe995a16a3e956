#include "render_vk/raster/graphics_pipeline.h"

#include <array>

namespace quoin::vulkan {
namespace {

/// A shader, as long as pipelines are made of it.
class Module {
 public:
  Module(const Device& device, std::span<const std::uint32_t> code) : device_(&device) {
    auto info = info_of<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
    info.codeSize = code.size_bytes();
    info.pCode = code.data();
    result_ = device.api().vkCreateShaderModule(device.handle(), &info, nullptr, &handle_);
  }
  ~Module() {
    if (handle_ != VK_NULL_HANDLE) device_->api().vkDestroyShaderModule(device_->handle(), handle_, nullptr);
  }
  Module(const Module&) = delete;
  Module& operator=(const Module&) = delete;

  [[nodiscard]] VkResult result() const { return result_; }
  [[nodiscard]] VkPipelineShaderStageCreateInfo stage(VkShaderStageFlagBits at) const {
    auto info = info_of<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
    info.stage = at;
    info.module = handle_;
    info.pName = "main";
    return info;
  }

 private:
  const Device* device_;
  VkShaderModule handle_ = VK_NULL_HANDLE;
  VkResult result_ = VK_SUCCESS;
};

}  // namespace

GraphicsPipelineInfo::GraphicsPipelineInfo() {
  raster = info_of<VkPipelineRasterizationStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO);
  raster.lineWidth = 1.0F;
  depth = info_of<VkPipelineDepthStencilStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO);
  blend.colorWriteMask =
      VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
}

VkResult make_graphics_pipeline(const Device& device, std::span<const std::uint32_t> vertex_shader,
                                std::span<const std::uint32_t> fragment_shader, const GraphicsPipelineInfo& wanted,
                                VkPipeline& pipeline) {
  const Module vertex(device, vertex_shader);
  const Module fragment(device, fragment_shader);
  if (vertex.result() != VK_SUCCESS) return vertex.result();
  if (fragment.result() != VK_SUCCESS) return fragment.result();
  const std::array stages = {vertex.stage(VK_SHADER_STAGE_VERTEX_BIT), fragment.stage(VK_SHADER_STAGE_FRAGMENT_BIT)};
  return make_graphics_pipeline(device, stages, wanted, pipeline);
}

VkResult make_graphics_pipeline(const Device& device, std::span<const VkPipelineShaderStageCreateInfo, 2> stages,
                                const GraphicsPipelineInfo& wanted, VkPipeline& pipeline) {
  const auto input =
      info_of<VkPipelineVertexInputStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO);
  auto assembly =
      info_of<VkPipelineInputAssemblyStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO);
  assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  auto viewport = info_of<VkPipelineViewportStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO);
  viewport.viewportCount = viewport.scissorCount = 1;
  auto samples =
      info_of<VkPipelineMultisampleStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO);
  samples.rasterizationSamples = wanted.samples;
  auto blend = info_of<VkPipelineColorBlendStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO);
  blend.attachmentCount = 1;
  blend.pAttachments = &wanted.blend;
  constexpr std::array kLater = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  auto later = info_of<VkPipelineDynamicStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO);
  later.dynamicStateCount = static_cast<std::uint32_t>(kLater.size());
  later.pDynamicStates = kLater.data();
  auto info = info_of<VkGraphicsPipelineCreateInfo>(VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO);
  info.stageCount = static_cast<std::uint32_t>(stages.size());
  info.pStages = stages.data();
  info.pVertexInputState = &input;
  info.pInputAssemblyState = &assembly;
  info.pViewportState = &viewport;
  info.pRasterizationState = &wanted.raster;
  info.pMultisampleState = &samples;
  info.pDepthStencilState = &wanted.depth;
  info.pColorBlendState = &blend;
  info.pDynamicState = &later;
  info.layout = wanted.layout;
  info.renderPass = wanted.pass;
  return device.api().vkCreateGraphicsPipelines(device.handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline);
}

}  // namespace quoin::vulkan
