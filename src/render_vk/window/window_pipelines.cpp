#include "render_vk/window/window_pipelines.h"

#include "render_vk/raster/graphics_pipeline.h"
#include "render_vk/window/swapchain.h"

namespace quoin::vulkan {
namespace {

constexpr std::uint32_t kPictureVertex[] = {
#include "window_picture.vert.inc"
};
constexpr std::uint32_t kPictureFragment[] = {
#include "window_picture.frag.inc"
};
constexpr std::uint32_t kOverlayVertex[] = {
#include "window_overlay.vert.inc"
};
constexpr std::uint32_t kOverlayFragment[] = {
#include "window_overlay.frag.inc"
};
constexpr VkShaderStageFlags kStages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;

}  // namespace

Result<std::unique_ptr<WindowPipelines>> WindowPipelines::create(Device& device) {
  const auto format = Swapchain::format_of(device);
  if (!format) return format.error();
  std::unique_ptr<WindowPipelines> made(new WindowPipelines(device));
  VkResult result = made->make_pass(format->format);
  if (result == VK_SUCCESS) result = made->make_layout();
  GraphicsPipelineInfo info;
  info.pass = made->pass_;
  info.layout = made->layout_;
  if (result == VK_SUCCESS) {
    result = make_graphics_pipeline(device, kPictureVertex, kPictureFragment, info, made->picture_);
  }
  info.blend.blendEnable = VK_TRUE;
  info.blend.srcColorBlendFactor = VK_BLEND_FACTOR_SRC_ALPHA;
  info.blend.dstColorBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
  info.blend.srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE;
  info.blend.dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
  if (result == VK_SUCCESS) {
    result = make_graphics_pipeline(device, kOverlayVertex, kOverlayFragment, info, made->overlay_);
  }
  if (Status status = device.check(result, "compiling shaders"); !status) return status.error();
  return made;
}

WindowPipelines::~WindowPipelines() {
  const Api& api = device_->api();
  for (const VkPipeline pipeline : {picture_, overlay_}) {
    if (pipeline != VK_NULL_HANDLE) api.vkDestroyPipeline(device_->handle(), pipeline, nullptr);
  }
  if (layout_ != VK_NULL_HANDLE) api.vkDestroyPipelineLayout(device_->handle(), layout_, nullptr);
  if (pass_ != VK_NULL_HANDLE) api.vkDestroyRenderPass(device_->handle(), pass_, nullptr);
}

VkResult WindowPipelines::make_pass(VkFormat format) {
  VkAttachmentDescription image{};
  image.format = format;
  image.samples = VK_SAMPLE_COUNT_1_BIT;
  image.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR;
  image.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  image.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
  image.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  image.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
  image.finalLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
  const VkAttachmentReference colour{0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
  VkSubpassDescription subpass{};
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.colorAttachmentCount = 1;
  subpass.pColorAttachments = &colour;
  // The image must have been handed over before it is written.
  VkSubpassDependency handed{};
  handed.srcSubpass = VK_SUBPASS_EXTERNAL;
  handed.srcStageMask = handed.dstStageMask = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT;
  handed.dstAccessMask = VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT;
  auto info = info_of<VkRenderPassCreateInfo>(VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO);
  info.attachmentCount = 1;
  info.pAttachments = &image;
  info.subpassCount = 1;
  info.pSubpasses = &subpass;
  info.dependencyCount = 1;
  info.pDependencies = &handed;
  return device_->api().vkCreateRenderPass(device_->handle(), &info, nullptr, &pass_);
}

VkResult WindowPipelines::make_layout() {
  const VkPushConstantRange range{kStages, 0, sizeof(WindowPush)};
  auto info = info_of<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  info.pushConstantRangeCount = 1;
  info.pPushConstantRanges = &range;
  return device_->api().vkCreatePipelineLayout(device_->handle(), &info, nullptr, &layout_);
}

void WindowPipelines::bind(VkCommandBuffer commands, VkPipeline pipeline, const WindowPush& push) const {
  device_->api().vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline);
  device_->api().vkCmdPushConstants(commands, layout_, kStages, 0, sizeof push, &push);
}

}  // namespace quoin::vulkan
