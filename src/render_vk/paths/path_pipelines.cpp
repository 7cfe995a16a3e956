#include "render_vk/paths/path_pipelines.h"

#include <quoin/core/assert.h>

namespace quoin::vulkan {
namespace {

constexpr std::uint32_t kPaths[] = {
#include "paths.comp.inc"
};

constexpr std::size_t kGlass = 1;
constexpr std::size_t kFields = 2;
constexpr std::size_t kFieldGlass = 4;

}  // namespace

Result<std::unique_ptr<PathPipelines>> PathPipelines::create(Device& device) {
  std::unique_ptr<PathPipelines> made(new PathPipelines(device));
  const VkResult result = make_push_layout(device, VK_SHADER_STAGE_COMPUTE_BIT, sizeof(PathPush), made->layout_);
  if (Status status = device.check(result, "compiling shaders"); !status) return status.error();
  return made;
}

PathPipelines::~PathPipelines() {
  const Api& api = device_->api();
  for (const VkPipeline pipeline : pipelines_) {
    if (pipeline != VK_NULL_HANDLE) api.vkDestroyPipeline(device_->handle(), pipeline, nullptr);
  }
  if (layout_ != VK_NULL_HANDLE) api.vkDestroyPipelineLayout(device_->handle(), layout_, nullptr);
}

std::size_t PathPipelines::variant_of(const Placement& placement) {
  return (placement.has_transparent ? kGlass : 0) | (placement.has_fields ? kFields : 0) |
         (placement.has_field_glass ? kFieldGlass : 0);
}

Status PathPipelines::prepare(const Placement& placement) {
  const std::size_t variant = variant_of(placement);
  if (pipelines_[variant] != VK_NULL_HANDLE) return {};
  const std::array constants = {ShaderConstant{0, (variant & kGlass) != 0},
                                ShaderConstant{4, (variant & (kFields | kFieldGlass)) != 0},
                                ShaderConstant{6, (variant & kFieldGlass) != 0}};
  const VkResult result = make_compute_pipeline(*device_, layout_, kPaths, constants, pipelines_[variant]);
  return device_->check(result, "compiling shaders");
}

void PathPipelines::dispatch(VkCommandBuffer commands, const Placement& placement, const PathPush& push) const {
  constexpr std::int32_t kGroup = 8;
  const auto groups = [](std::int32_t pixels) { return static_cast<std::uint32_t>((pixels + kGroup - 1) / kGroup); };
  QUOIN_ASSERT(pipelines_[variant_of(placement)] != VK_NULL_HANDLE, "a variant that was prepared");
  const Api& api = device_->api();
  api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_[variant_of(placement)]);
  api.vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof push, &push);
  api.vkCmdDispatch(commands, groups(push.size_x), groups(push.size_y), 1);
  device_->separate(commands);
}

}  // namespace quoin::vulkan
