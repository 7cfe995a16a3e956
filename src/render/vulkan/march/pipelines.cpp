#include "render/vulkan/march/pipelines.h"

#include <algorithm>
#include <span>

#include <quoin/core/assert.h>

namespace quoin::vulkan {
namespace {

constexpr std::uint32_t kFar[] = {
#include "far.comp.inc"
};
constexpr std::uint32_t kPrimary[] = {
#include "primary.comp.inc"
};
constexpr std::uint32_t kGlass[] = {
#include "glass.comp.inc"
};
constexpr std::uint32_t kLight[] = {
#include "light.comp.inc"
};
constexpr std::uint32_t kResolve[] = {
#include "resolve.comp.inc"
};
constexpr std::uint32_t kSwap[] = {
#include "swap.comp.inc"
};

// Every device supports this many workgroups in each direction.
constexpr std::uint32_t kMaxAcross = 32768;

template <class T>
std::span<const std::byte> bytes_of(const T& push) {
  static_assert(sizeof(T) <= sizeof(ShaderPush));
  return std::as_bytes(std::span(&push, 1));
}

std::span<const std::uint32_t> code_of(Pass pass) {
  switch (pass) {
    case Pass::FarDepths:
    case Pass::FarFaces:
      return kFar;
    case Pass::Primary:
      return kPrimary;
    case Pass::Glass:
      return kGlass;
    case Pass::Resolve:
      return kResolve;
    case Pass::Swap:
      return kSwap;
    default:
      return kLight;
  }
}

}  // namespace

Result<std::unique_ptr<Pipelines>> Pipelines::create(Device& device) {
  std::unique_ptr<Pipelines> made(new Pipelines(device));
  VkResult result = make_push_layout(device, VK_SHADER_STAGE_COMPUTE_BIT, sizeof(ShaderPush), made->layout_);
  for (const Pass pass : {Pass::Resolve, Pass::Swap}) {
    if (result == VK_SUCCESS) result = made->make(pass, {});
  }
  if (Status status = device.check(result, "compiling shaders"); !status) return status.error();
  return made;
}

Status Pipelines::add(const PassFeatures& features, bool has_glass, bool has_far) {
  VkResult result = make(Pass::Primary, features);
  for (const Pass pass : {Pass::FarDepths, Pass::FarFaces}) {
    if (result == VK_SUCCESS && has_far) result = make(pass, {});
  }
  if (result == VK_SUCCESS && has_glass) result = make(Pass::Glass, features);
  if (result == VK_SUCCESS) result = make(has_glass ? Pass::LightWithGlass : Pass::Light, features);
  return device_->check(result, "compiling shaders");
}

Pipelines::~Pipelines() {
  const Api& api = device_->api();
  for (const Variants& variants : pipelines_) {
    for (const VkPipeline pipeline : variants) {
      if (pipeline != VK_NULL_HANDLE) api.vkDestroyPipeline(device_->handle(), pipeline, nullptr);
    }
  }
  if (layout_ != VK_NULL_HANDLE) api.vkDestroyPipelineLayout(device_->handle(), layout_, nullptr);
}

// Makes the pass's pipeline with the features that it depends on, once.
VkResult Pipelines::make(Pass pass, const PassFeatures& features) {
  const PassFeatures used = features.of(pass);
  VkPipeline& pipeline = pipelines_[static_cast<std::size_t>(pass)][used.index()];
  if (pipeline != VK_NULL_HANDLE) return VK_SUCCESS;
  // Passes of one shader differ in its constants.
  const bool is_second = pass == Pass::LightWithGlass || pass == Pass::FarFaces;
  const std::array constants = {ShaderConstant{0, is_second},        ShaderConstant{4, used.fields},
                                ShaderConstant{6, used.field_glass}, ShaderConstant{7, used.textures},
                                ShaderConstant{8, used.shapes},      ShaderConstant{9, used.cells}};
  return make_compute_pipeline(*device_, layout_, code_of(pass), constants, pipeline);
}

void Pipelines::dispatch(VkCommandBuffer commands, Pass pass, const ShaderPush& push,
                         const PassFeatures& features) const {
  constexpr std::int32_t kGroup = 8;
  const auto groups = [](std::int32_t pixels) { return static_cast<std::uint32_t>((pixels + kGroup - 1) / kGroup); };
  dispatch(commands, pipeline(pass, features), bytes_of(push), groups(push.size_x), groups(push.size_y));
}

void Pipelines::dispatch_far(VkCommandBuffer commands, Pass pass, const ShaderPush& push) const {
  QUOIN_ASSERT(push.far_groups > 0, "at least one group");
  const std::uint32_t across = std::min(push.far_groups, kMaxAcross);
  dispatch(commands, pipeline(pass, {}), bytes_of(push), across, (push.far_groups + across - 1) / across);
}

void Pipelines::swap_red_and_blue(VkCommandBuffer commands, const SwapPush& push) const {
  QUOIN_ASSERT(push.pixels > 0, "at least one pixel");
  constexpr std::uint32_t kGroup = 256;
  const std::uint32_t groups = (push.pixels + kGroup - 1) / kGroup;
  const std::uint32_t across = std::min(groups, kMaxAcross);
  SwapPush whole = push;
  whole.across = across * kGroup;
  dispatch(commands, pipeline(Pass::Swap, {}), bytes_of(whole), across, (groups + across - 1) / across);
}

void Pipelines::dispatch(VkCommandBuffer commands, VkPipeline pipeline, std::span<const std::byte> push,
                         std::uint32_t across, std::uint32_t down) const {
  QUOIN_ASSERT(pipeline != VK_NULL_HANDLE, "a pass that was made");
  QUOIN_ASSERT(across > 0 && across <= kMaxAcross && down > 0, "1 to 32,768 workgroups");
  const Api& api = device_->api();
  api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
  api.vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, static_cast<std::uint32_t>(push.size()),
                         push.data());
  api.vkCmdDispatch(commands, across, down, 1);
  device_->separate(commands);
}

}  // namespace quoin::vulkan
