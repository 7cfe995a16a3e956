#include "window_pipelines.h"

#include <array>
#include <span>

#include "swapchain.h"

namespace quoin::viewer {

namespace {

constexpr std::uint32_t kImageVertex[] = {
#include "window_image.vert.inc"
};
constexpr std::uint32_t kImageFragment[] = {
#include "window_image.frag.inc"
};
constexpr VkShaderStageFlags kStages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;

/// A shader module, needed only while pipelines are created.
class Shader {
 public:
  Shader(const WindowDevice& device, VkShaderStageFlagBits stage, std::span<const std::uint32_t> code)
      : device_(&device), stage_(stage) {
    auto info = info_of<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
    info.codeSize = code.size_bytes();
    info.pCode = code.data();
    result_ = vkCreateShaderModule(device.handle(), &info, nullptr, &handle_);
  }
  ~Shader() {
    if (handle_ != VK_NULL_HANDLE) vkDestroyShaderModule(device_->handle(), handle_, nullptr);
  }
  Shader(const Shader&) = delete;
  Shader& operator=(const Shader&) = delete;

  [[nodiscard]] VkResult result() const { return result_; }
  [[nodiscard]] VkPipelineShaderStageCreateInfo stage() const {
    auto info = info_of<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
    info.stage = stage_;
    info.module = handle_;
    info.pName = "main";
    return info;
  }

 private:
  const WindowDevice* device_;
  VkShaderStageFlagBits stage_;
  VkShaderModule handle_ = VK_NULL_HANDLE;
  VkResult result_ = VK_SUCCESS;
};

/// The differences between the two pipelines.
struct PipelineParts {
  VkRenderPass pass = VK_NULL_HANDLE;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  std::span<const std::uint32_t> vertex;
  std::span<const std::uint32_t> fragment;
  bool is_blended = false;
};

VkPipelineColorBlendAttachmentState blending(bool is_blended) {
  VkPipelineColorBlendAttachmentState blend{};
  blend.colorWriteMask =
      VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
  blend.blendEnable = is_blended ? VK_TRUE : VK_FALSE;
  blend.srcColorBlendFactor = VK_BLEND_FACTOR_SRC_ALPHA;
  blend.dstColorBlendFactor = blend.dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
  blend.srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE;
  return blend;
}

// Creates a triangle pipeline without vertex input; viewport and scissor are dynamic.
VkResult make_pipeline(const WindowDevice& device, const PipelineParts& parts, VkPipeline& pipeline) {
  const Shader vertex(device, VK_SHADER_STAGE_VERTEX_BIT, parts.vertex);
  const Shader fragment(device, VK_SHADER_STAGE_FRAGMENT_BIT, parts.fragment);
  if (vertex.result() != VK_SUCCESS) return vertex.result();
  if (fragment.result() != VK_SUCCESS) return fragment.result();
  const std::array stages = {vertex.stage(), fragment.stage()};
  const auto input =
      info_of<VkPipelineVertexInputStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO);
  auto assembly =
      info_of<VkPipelineInputAssemblyStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO);
  assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  auto viewport = info_of<VkPipelineViewportStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO);
  viewport.viewportCount = viewport.scissorCount = 1;
  auto raster =
      info_of<VkPipelineRasterizationStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO);
  raster.lineWidth = 1.0F;
  auto samples =
      info_of<VkPipelineMultisampleStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO);
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
  const VkPipelineColorBlendAttachmentState blend = blending(parts.is_blended);
  auto blends = info_of<VkPipelineColorBlendStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO);
  blends.attachmentCount = 1;
  blends.pAttachments = &blend;
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
  info.pRasterizationState = &raster;
  info.pMultisampleState = &samples;
  info.pColorBlendState = &blends;
  info.pDynamicState = &later;
  info.layout = parts.layout;
  info.renderPass = parts.pass;
  return vkCreateGraphicsPipelines(device.handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline);
}

}  // namespace

Result<std::unique_ptr<WindowPipelines>> WindowPipelines::create(const WindowDevice& device) {
  const auto format = Swapchain::format_of(device);
  if (!format) return format.error();
  std::unique_ptr<WindowPipelines> made(new WindowPipelines(device));
  VkResult result = made->make_pass(format->format);
  if (result == VK_SUCCESS) result = made->make_layout();
  if (result == VK_SUCCESS) result = made->make_set();
  PipelineParts parts{made->pass_, made->layout_, kImageVertex, kImageFragment, false};
  if (result == VK_SUCCESS) result = make_pipeline(device, parts, made->image_);
  if (Status status = device.check(result, "compiling shaders"); !status) return status.error();
  return made;
}

WindowPipelines::~WindowPipelines() {
  if (image_ != VK_NULL_HANDLE) vkDestroyPipeline(device_->handle(), image_, nullptr);
  if (layout_ != VK_NULL_HANDLE) vkDestroyPipelineLayout(device_->handle(), layout_, nullptr);
  if (sets_ != VK_NULL_HANDLE) vkDestroyDescriptorPool(device_->handle(), sets_, nullptr);
  if (set_layout_ != VK_NULL_HANDLE) vkDestroyDescriptorSetLayout(device_->handle(), set_layout_, nullptr);
  if (sampler_ != VK_NULL_HANDLE) vkDestroySampler(device_->handle(), sampler_, nullptr);
  if (pass_ != VK_NULL_HANDLE) vkDestroyRenderPass(device_->handle(), pass_, nullptr);
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
  // The image must be acquired before it is written.
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
  return vkCreateRenderPass(device_->handle(), &info, nullptr, &pass_);
}

// The push constants, and one image whose pixels are read directly.
VkResult WindowPipelines::make_layout() {
  const auto nearest = info_of<VkSamplerCreateInfo>(VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO);
  VkResult result = vkCreateSampler(device_->handle(), &nearest, nullptr, &sampler_);
  if (result != VK_SUCCESS) return result;
  VkDescriptorSetLayoutBinding binding{};
  binding.descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
  binding.descriptorCount = 1;
  binding.stageFlags = VK_SHADER_STAGE_FRAGMENT_BIT;
  binding.pImmutableSamplers = &sampler_;
  auto set = info_of<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  set.bindingCount = 1;
  set.pBindings = &binding;
  result = vkCreateDescriptorSetLayout(device_->handle(), &set, nullptr, &set_layout_);
  if (result != VK_SUCCESS) return result;
  const VkPushConstantRange range{kStages, 0, sizeof(WindowPush)};
  auto info = info_of<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  info.setLayoutCount = 1;
  info.pSetLayouts = &set_layout_;
  info.pushConstantRangeCount = 1;
  info.pPushConstantRanges = &range;
  return vkCreatePipelineLayout(device_->handle(), &info, nullptr, &layout_);
}

VkResult WindowPipelines::make_set() {
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1};
  auto pool = info_of<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
  pool.maxSets = 1;
  pool.poolSizeCount = 1;
  pool.pPoolSizes = &size;
  const VkResult result = vkCreateDescriptorPool(device_->handle(), &pool, nullptr, &sets_);
  if (result != VK_SUCCESS) return result;
  auto info = info_of<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
  info.descriptorPool = sets_;
  info.descriptorSetCount = 1;
  info.pSetLayouts = &set_layout_;
  return vkAllocateDescriptorSets(device_->handle(), &info, &set_);
}

void WindowPipelines::show_image(VkImageView view) const {
  VkDescriptorImageInfo image{};
  image.imageView = view;
  image.imageLayout = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
  auto write = info_of<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
  write.dstSet = set_;
  write.descriptorCount = 1;
  write.descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
  write.pImageInfo = &image;
  vkUpdateDescriptorSets(device_->handle(), 1, &write, 0, nullptr);
}

void WindowPipelines::bind_image(VkCommandBuffer commands, const WindowPush& push) const {
  bind(commands, image_, push);
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, layout_, 0, 1, &set_, 0, nullptr);
}

void WindowPipelines::bind(VkCommandBuffer commands, VkPipeline pipeline, const WindowPush& push) const {
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline);
  vkCmdPushConstants(commands, layout_, kStages, 0, sizeof push, &push);
}

}  // namespace quoin::viewer
