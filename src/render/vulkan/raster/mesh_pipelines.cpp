#include "render/vulkan/raster/mesh_pipelines.h"

#include <array>
#include <cstdint>
#include <span>

#include "render/vulkan/device/device.h"
#include "render/vulkan/raster/mesh_shader_data.h"

namespace quoin::vulkan {
namespace {

// A pipeline whose shaders read the triangles' corners from memory. Viewport and scissor are dynamic.
struct GraphicsPipelineInfo {
  VkRenderPass pass = VK_NULL_HANDLE;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  VkPipelineRasterizationStateCreateInfo raster{};
  VkPipelineDepthStencilStateCreateInfo depth{};
  VkPipelineColorBlendAttachmentState blend{};
  VkSampleCountFlagBits samples = VK_SAMPLE_COUNT_1_BIT;

  // Filled triangles, both sides, no depth test, no blending.
  GraphicsPipelineInfo();
};

GraphicsPipelineInfo::GraphicsPipelineInfo() {
  raster = info_of<VkPipelineRasterizationStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO);
  raster.lineWidth = 1.0F;
  depth = info_of<VkPipelineDepthStencilStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO);
  blend.colorWriteMask =
      VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
}

// `stages`: of vertices and of fragments.
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

constexpr std::uint32_t kSkyVertex[] = {
#include "sky.vert.inc"
};
constexpr std::uint32_t kSkyFragment[] = {
#include "sky.frag.inc"
};
constexpr std::uint32_t kBlockyVertex[] = {
#include "blocky.vert.inc"
};
constexpr std::uint32_t kBlockyFragment[] = {
#include "blocky.frag.inc"
};
constexpr std::uint32_t kFarVertex[] = {
#include "far.vert.inc"
};
constexpr std::uint32_t kFarFragment[] = {
#include "far.frag.inc"
};
constexpr std::uint32_t kSmoothVertex[] = {
#include "smooth.vert.inc"
};
constexpr std::uint32_t kSmoothFragment[] = {
#include "smooth.frag.inc"
};

constexpr std::uint32_t kBlockyGlassFragment[] = {
#include "blocky_glass.frag.inc"
};
constexpr std::uint32_t kSmoothGlassVertex[] = {
#include "smooth_glass.vert.inc"
};
constexpr std::uint32_t kSmoothGlassFragment[] = {
#include "smooth_glass.frag.inc"
};

constexpr std::uint32_t kBlockyPlainFragment[] = {
#include "blocky_plain.frag.inc"
};
constexpr std::uint32_t kSmoothPlainFragment[] = {
#include "smooth_plain.frag.inc"
};

enum Shader : std::size_t {
  SkyVertex,
  SkyFragment,
  BlockyVertex,
  BlockyFragment,
  BlockyPlainFragment,
  BlockyGlassFragment,
  SmoothVertex,
  SmoothFragment,
  SmoothPlainFragment,
  SmoothGlassVertex,
  SmoothGlassFragment,
  FarVertex,
  FarFragment,
  ShaderCount
};
constexpr std::array<std::span<const std::uint32_t>, ShaderCount> kCode = {
    kSkyVertex,           kSkyFragment,  kBlockyVertex,   kBlockyFragment,      kBlockyPlainFragment,
    kBlockyGlassFragment, kSmoothVertex, kSmoothFragment, kSmoothPlainFragment, kSmoothGlassVertex,
    kSmoothGlassFragment, kFarVertex,    kFarFragment};

// Returns the vertex and fragment shaders, as indices of `kCode`. Shaders for vision through glass take seconds to
// compile on a CPU driver, so they are separate from all others; shaders with rays take a second.
std::array<std::size_t, 2> shaders_of(const MeshWay& way) {
  const bool is_depth = way.mode == kDrawDepth || way.mode == kDrawGlassDepth;
  const bool sees_through = way.glass_by_rays && way.mode != kDrawGlassDepth;
  const bool is_plain = way.light == MeshLight::Plain || is_depth;
  switch (way.what) {
    case MeshWay::What::Sky:
      return {SkyVertex, SkyFragment};
    case MeshWay::What::Blocky:
      if (sees_through) return {BlockyVertex, BlockyGlassFragment};
      return {BlockyVertex, is_plain ? BlockyPlainFragment : BlockyFragment};
    case MeshWay::What::Smooth:
      if (sees_through) return {SmoothGlassVertex, SmoothGlassFragment};
      return {SmoothVertex, is_plain ? SmoothPlainFragment : SmoothFragment};
    case MeshWay::What::Far:
      return {FarVertex, FarFragment};
  }
  return {};
}

const char* const kCompiling = "compiling shaders";

VkAttachmentDescription attachment(VkFormat format, std::uint32_t samples, VkAttachmentLoadOp load, bool is_copied,
                                   VkImageLayout layout) {
  VkAttachmentDescription made{};
  made.format = format;
  made.samples = static_cast<VkSampleCountFlagBits>(samples);
  made.loadOp = load;
  made.storeOp = is_copied ? VK_ATTACHMENT_STORE_OP_STORE : VK_ATTACHMENT_STORE_OP_DONT_CARE;
  made.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
  made.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  made.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
  made.finalLayout = is_copied ? VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL : layout;
  return made;
}

// Orders the pass after earlier uses of the images, and before their copies.
std::array<VkSubpassDependency, 2> around_pass() {
  constexpr VkPipelineStageFlags kDepthStages =
      VK_PIPELINE_STAGE_EARLY_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_LATE_FRAGMENT_TESTS_BIT;
  constexpr VkPipelineStageFlags kColourStage = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT;
  constexpr VkAccessFlags kWrites = VK_ACCESS_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT |
                                    VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_READ_BIT |
                                    VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT;
  return {VkSubpassDependency{VK_SUBPASS_EXTERNAL, 0, kColourStage | kDepthStages | VK_PIPELINE_STAGE_TRANSFER_BIT,
                              kColourStage | kDepthStages, kWrites | VK_ACCESS_TRANSFER_READ_BIT, kWrites, 0},
          VkSubpassDependency{0, VK_SUBPASS_EXTERNAL, kColourStage, VK_PIPELINE_STAGE_TRANSFER_BIT,
                              VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT, VK_ACCESS_TRANSFER_READ_BIT, 0}};
}

bool is_edges(const MeshWay& way) {
  return way.mode == kDrawEdgesOver || way.mode == kDrawEdgesOnly;
}

VkPipelineRasterizationStateCreateInfo rasterization_of(const MeshWay& way) {
  auto state =
      info_of<VkPipelineRasterizationStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO);
  state.polygonMode = is_edges(way) ? VK_POLYGON_MODE_LINE : VK_POLYGON_MODE_FILL;
  const bool is_culled = way.what == MeshWay::What::Smooth && way.mode != kDrawEdgesOnly;
  state.cullMode = is_culled ? VK_CULL_MODE_BACK_BIT : VK_CULL_MODE_NONE;
  state.frontFace = way.mirrored ? VK_FRONT_FACE_CLOCKWISE : VK_FRONT_FACE_COUNTER_CLOCKWISE;
  state.lineWidth = 1.0F;
  // Depths are reversed: more is nearer.
  state.depthBiasEnable = way.mode == kDrawEdgesOver ? VK_TRUE : VK_FALSE;
  state.depthBiasConstantFactor = 16.0F;
  state.depthBiasSlopeFactor = 1.0F;
  return state;
}

VkPipelineDepthStencilStateCreateInfo depth_of(const MeshWay& way) {
  auto state =
      info_of<VkPipelineDepthStencilStateCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO);
  const bool is_sky = way.what == MeshWay::What::Sky;
  state.depthTestEnable = way.mode != kDrawEdgesOnly ? VK_TRUE : VK_FALSE;
  // With traced light, depths are drawn first, so that each pixel is lit once.
  const bool is_lit_once = way.mode == kDrawSurfaces && way.light != MeshLight::Plain;
  const bool has_depth = is_lit_once || way.mode == kDrawGlassPassed || way.mode == kDrawGlassAdded;
  const bool is_depth = way.mode == kDrawDepth || way.mode == kDrawGlassDepth;
  const bool writes = (way.mode == kDrawSurfaces && !is_sky && !has_depth) || is_depth;
  state.depthWriteEnable = writes ? VK_TRUE : VK_FALSE;
  // The first of equally near surfaces wins; edges lie on their surfaces; the sky fills empty pixels.
  state.depthCompareOp = VK_COMPARE_OP_GREATER;
  if (has_depth) state.depthCompareOp = VK_COMPARE_OP_EQUAL;
  if (is_sky || way.mode == kDrawEdgesOver) state.depthCompareOp = VK_COMPARE_OP_GREATER_OR_EQUAL;
  return state;
}

void blend(VkBlendFactor added, VkBlendFactor kept, VkPipelineColorBlendAttachmentState& state) {
  state.blendEnable = VK_TRUE;
  state.srcColorBlendFactor = state.srcAlphaBlendFactor = added;
  state.dstColorBlendFactor = state.dstAlphaBlendFactor = kept;
  state.colorBlendOp = state.alphaBlendOp = VK_BLEND_OP_ADD;
}

// Glass has a different transmittance for each channel, but blending has one alpha, so glass is drawn once per channel.
// If each pixel has a single glass fragment, the stored colour is multiplied by the transmittance, and the glass's
// light is added in a second pass.
VkPipelineColorBlendAttachmentState blend_of(const MeshWay& way) {
  VkPipelineColorBlendAttachmentState state{};
  state.colorWriteMask =
      VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
  if (way.mode == kDrawDepth || way.mode == kDrawGlassDepth) state.colorWriteMask = 0;
  if (way.mode == kDrawGlassPassed) blend(VK_BLEND_FACTOR_ZERO, VK_BLEND_FACTOR_SRC_COLOR, state);
  if (way.mode == kDrawGlassAdded) blend(VK_BLEND_FACTOR_ONE, VK_BLEND_FACTOR_ONE, state);
  if (is_channel_of_glass(way.mode)) {
    state.colorWriteMask = VkColorComponentFlags{VK_COLOR_COMPONENT_R_BIT} << (way.mode - kDrawGlass);
    blend(VK_BLEND_FACTOR_ONE, VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA, state);
  }
  return state;
}

// The two shader stages with their specialization constants.
struct Stages {
  std::array<VkBool32, 11> values;
  std::array<VkSpecializationMapEntry, 11> entries;
  VkSpecializationInfo constants;
  std::array<VkPipelineShaderStageCreateInfo, 2> all{};

  Stages(const MeshWay& way, const std::array<VkShaderModule, 2>& shaders)
      : values{way.ordered,
               is_channel_of_glass(way.mode),
               way.light != MeshLight::Plain,
               way.light == MeshLight::TracedThroughGlass,
               way.fields,
               is_nearest_glass(way.mode) ? way.mode : 0,
               way.fields && way.light == MeshLight::TracedThroughGlass,
               way.textures,
               way.shapes,
               way.cells,
               static_cast<VkBool32>(way.faces)},
        constants{static_cast<std::uint32_t>(entries.size()), entries.data(), sizeof values, values.data()} {
    for (std::uint32_t i = 0; i < entries.size(); ++i) {
      // Numbers as in the shaders: 0 to 9, and 20, which is theirs alone.
      const std::uint32_t id = i < 10 ? i : 20;
      entries[i] = {id, i * static_cast<std::uint32_t>(sizeof(VkBool32)), sizeof(VkBool32)};
    }
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i].sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
      all[i].stage = i == 0 ? VK_SHADER_STAGE_VERTEX_BIT : VK_SHADER_STAGE_FRAGMENT_BIT;
      all[i].module = shaders[i];
      all[i].pName = "main";
      all[i].pSpecializationInfo = &constants;
    }
  }
  Stages(const Stages&) = delete;
  Stages& operator=(const Stages&) = delete;
};

}  // namespace

Result<std::unique_ptr<MeshPipelines>> MeshPipelines::create(Device& device) {
  static_assert(kCode.size() == kShaders);
  std::unique_ptr<MeshPipelines> made(new MeshPipelines(device));
  constexpr VkShaderStageFlags kStages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;
  VkResult result = make_push_layout(device, kStages, sizeof(ShaderMeshPush), made->layout_);
  for (std::size_t i = 0; i < kShaders && result == VK_SUCCESS; ++i) {
    result = make_shader(device, kCode[i], made->shaders_[i]);
  }
  if (Status status = device.check(result, kCompiling); !status) return status.error();
  return made;
}

MeshPipelines::~MeshPipelines() {
  const Api& api = device_->api();
  for (const auto& [way, pipeline] : pipelines_) api.vkDestroyPipeline(device_->handle(), pipeline, nullptr);
  for (const auto& [samples, pass] : passes_) api.vkDestroyRenderPass(device_->handle(), pass, nullptr);
  for (const VkShaderModule shader : shaders_) {
    if (shader != VK_NULL_HANDLE) api.vkDestroyShaderModule(device_->handle(), shader, nullptr);
  }
  if (layout_ != VK_NULL_HANDLE) api.vkDestroyPipelineLayout(device_->handle(), layout_, nullptr);
}

Result<VkRenderPass> MeshPipelines::render_pass(std::uint32_t samples) {
  if (const auto known = passes_.find(samples); known != passes_.end()) return known->second;
  VkRenderPass pass = VK_NULL_HANDLE;
  if (Status status = device_->check(make_pass(samples, pass), kCompiling); !status) return status.error();
  passes_[samples] = pass;
  return pass;
}

Result<VkPipeline> MeshPipelines::pipeline(const MeshWay& way) {
  if (const auto known = pipelines_.find(way); known != pipelines_.end()) return known->second;
  const auto pass = render_pass(way.samples);
  if (!pass) return pass.error();
  VkPipeline pipeline = VK_NULL_HANDLE;
  if (Status status = device_->check(make(way, *pass, pipeline), kCompiling); !status) {
    return status.error();
  }
  pipelines_[way] = pipeline;
  return pipeline;
}

VkResult MeshPipelines::make_pass(std::uint32_t samples, VkRenderPass& pass) const {
  const bool is_resolved = samples > 1;
  constexpr VkImageLayout kColourLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
  constexpr VkImageLayout kDepthLayout = VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
  // The sky covers all empty pixels.
  const std::array attachments = {
      attachment(kMeshColour, samples, VK_ATTACHMENT_LOAD_OP_DONT_CARE, !is_resolved, kColourLayout),
      attachment(kMeshDepth, samples, VK_ATTACHMENT_LOAD_OP_CLEAR, false, kDepthLayout),
      attachment(kMeshColour, 1, VK_ATTACHMENT_LOAD_OP_DONT_CARE, true, kColourLayout)};
  const VkAttachmentReference colour{0, kColourLayout};
  const VkAttachmentReference depth{1, kDepthLayout};
  const VkAttachmentReference resolved{2, kColourLayout};
  VkSubpassDescription subpass{};
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.colorAttachmentCount = 1;
  subpass.pColorAttachments = &colour;
  subpass.pDepthStencilAttachment = &depth;
  subpass.pResolveAttachments = is_resolved ? &resolved : nullptr;
  const auto dependencies = around_pass();
  auto info = info_of<VkRenderPassCreateInfo>(VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO);
  info.attachmentCount = is_resolved ? 3 : 2;
  info.pAttachments = attachments.data();
  info.subpassCount = 1;
  info.pSubpasses = &subpass;
  info.dependencyCount = dependencies.size();
  info.pDependencies = dependencies.data();
  return device_->api().vkCreateRenderPass(device_->handle(), &info, nullptr, &pass);
}

VkResult MeshPipelines::make(const MeshWay& way, VkRenderPass pass, VkPipeline& pipeline) const {
  const auto [vertices, fragments] = shaders_of(way);
  const Stages stages(way, {shaders_[vertices], shaders_[fragments]});
  GraphicsPipelineInfo info;
  info.pass = pass;
  info.layout = layout_;
  info.raster = rasterization_of(way);
  info.depth = depth_of(way);
  info.blend = blend_of(way);
  info.samples = static_cast<VkSampleCountFlagBits>(way.samples);
  return make_graphics_pipeline(*device_, stages.all, info, pipeline);
}

}  // namespace quoin::vulkan
