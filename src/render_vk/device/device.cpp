#include "render_vk/device/device.h"

#include <array>
#include <limits>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

namespace quoin::vulkan {
namespace {

Error refuse(std::string message) {
  return make_error(ErrorCode::Unsupported, "vulkan: " + std::move(message));
}

Status check_handles(const BorrowedVulkanDevice& lent) {
  const std::array<std::pair<const void*, const char*>, 4> handles = {
      std::pair{static_cast<const void*>(lent.instance), "instance"},
      std::pair{static_cast<const void*>(lent.physical_device), "physical device"},
      std::pair{static_cast<const void*>(lent.device), "device"},
      std::pair{static_cast<const void*>(lent.queue), "queue"}};
  for (const auto& [handle, name] : handles) {
    if (handle == nullptr)
      return make_error(ErrorCode::InvalidArgument, std::string("vulkan: the ") + name + " is null");
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<Device>> Device::create(const VulkanOptions& options) {
  auto instance = VulkanInstance::create(options.on_validation_message);
  if (!instance) return instance.error();
  const auto physical = (*instance)->choose(options.device);
  if (!physical) return physical.error();
  std::unique_ptr<Device> device(new Device());
  device->instance_ = std::move(*instance);
  if (Status opened = device->open(*physical); !opened) return opened.error();
  return device;
}

Result<std::unique_ptr<Device>> Device::borrow(const BorrowedVulkanDevice& lent) {
  std::unique_ptr<Device> device(new Device());
  if (Status adopted = device->adopt(lent); !adopted) return adopted.error();
  return device;
}

Status Device::open(const PhysicalDevice& physical) {
  api_ = instance_->api();
  physical_ = physical;
  const float priority = 1.0F;
  auto queue = info_of<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
  queue.queueFamilyIndex = physical.queue_family;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  auto info = info_of<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  VkPhysicalDeviceFeatures features{};
  features.fillModeNonSolid = physical.draws_lines ? VK_TRUE : VK_FALSE;
  info.pEnabledFeatures = &features;
  VulkanFeatureStorage storage;
  if (Status enabled = enable_vulkan_features(info, storage); !enabled) return enabled;
  const VkResult result = api_.vkCreateDevice(physical.handle, &info, nullptr, &handle_);
  if (result != VK_SUCCESS) return check(result, "starting");
  return start();
}

Status Device::adopt(const BorrowedVulkanDevice& lent) {
  if (Status whole = check_handles(lent); !whole) return whole;
  auto api = Api::find(lent.get_instance_proc_addr);
  if (!api) return api.error();
  api_ = *api;
  if (const char* missing = api_.load_instance(lent.instance))
    return refuse(std::string("the instance lacks ") + missing);
  physical_ = describe(api_, lent.physical_device);
  const VulkanDeviceInfo& description = physical_.description;
  if (!description.missing.empty()) return refuse(description.name + " lacks " + description.missing);
  const VkQueueFlags can = queue_flags(api_, lent.physical_device, lent.queue_family);
  if (can == 0) {
    const std::string family = std::to_string(lent.queue_family);
    return make_error(ErrorCode::InvalidArgument, "vulkan: " + description.name + " has no queue family " + family);
  }
  if ((can & VK_QUEUE_COMPUTE_BIT) == 0) return refuse(description.name + ": the queue does not support compute");
  physical_.queue_family = lent.queue_family;
  physical_.draws_triangles = (can & VK_QUEUE_GRAPHICS_BIT) != 0;
  physical_.draws_lines = physical_.draws_triangles && lent.fill_mode_non_solid;
  queue_ = lent.queue;
  with_queue_ = lent.with_queue;
  handle_ = lent.device;
  return start();
}

// Initialises the device, owned or borrowed.
Status Device::start() {
  if (const char* missing = api_.load_device(handle_)) return refuse(description().name + " lacks " + missing);
  api_.vkGetPhysicalDeviceMemoryProperties(physical_.handle, &memory_);
  if (instance_) api_.vkGetDeviceQueue(handle_, physical_.queue_family, 0, &queue_);
  return check(make_commands(), "starting");
}

VkResult Device::make_commands() {
  auto pool = info_of<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
  pool.queueFamilyIndex = physical_.queue_family;
  VkResult result = api_.vkCreateCommandPool(handle_, &pool, nullptr, &pool_);
  if (result != VK_SUCCESS) return result;
  auto buffer = info_of<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
  buffer.commandPool = pool_;
  buffer.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  buffer.commandBufferCount = 1;
  result = api_.vkAllocateCommandBuffers(handle_, &buffer, &commands_);
  if (result != VK_SUCCESS) return result;
  const auto fence = info_of<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
  return api_.vkCreateFence(handle_, &fence, nullptr, &fence_);
}

Device::~Device() {
  if (handle_ == VK_NULL_HANDLE) return;
  // Waits only on an owned device: the owner of a borrowed one must not be blocked, and all commands submitted here
  // have completed.
  if (instance_) api_.vkDeviceWaitIdle(handle_);
  if (fence_ != VK_NULL_HANDLE) api_.vkDestroyFence(handle_, fence_, nullptr);
  if (pool_ != VK_NULL_HANDLE) api_.vkDestroyCommandPool(handle_, pool_, nullptr);
  if (instance_) api_.vkDestroyDevice(handle_, nullptr);
}

Error Device::error_of(VkResult result, const std::string& doing) const {
  const std::string who = "vulkan: " + description().name + ": ";
  switch (result) {
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return {ErrorCode::LimitExceeded, who + "out of device memory while " + doing, {}, {}};
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return {ErrorCode::LimitExceeded, who + "out of host memory while " + doing, {}, {}};
    case VK_ERROR_TOO_MANY_OBJECTS:
      return {ErrorCode::LimitExceeded, who + "too many memory allocations while " + doing, {}, {}};
    case VK_ERROR_DEVICE_LOST:
      return {ErrorCode::DeviceLost, who + "the device was lost while " + doing, {}, {}};
    default:
      return {
          ErrorCode::Unsupported, who + "failed while " + doing + " (VkResult " + std::to_string(result) + ")", {}, {}};
  }
}

VkResult Device::submit(const VkSubmitInfo& info) {
  VkResult result = VK_NOT_READY;  // unless it is done
  const auto use = [&] { result = api_.vkQueueSubmit(queue_, 1, &info, fence_); };
  if (with_queue_) {
    with_queue_(use);
  } else {
    use();
  }
  QUOIN_ASSERT(result != VK_NOT_READY, "BorrowedVulkanDevice::with_queue must call its argument");
  return result;
}

Status Device::run(const std::string& doing, const std::function<void(VkCommandBuffer)>& record) {
  auto begin = info_of<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  VkResult result = api_.vkResetCommandPool(handle_, pool_, 0);
  if (result == VK_SUCCESS) result = api_.vkBeginCommandBuffer(commands_, &begin);
  if (result != VK_SUCCESS) return check(result, doing);
  record(commands_);
  separate(commands_);
  result = api_.vkEndCommandBuffer(commands_);
  auto info = info_of<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
  info.commandBufferCount = 1;
  info.pCommandBuffers = &commands_;
  if (result == VK_SUCCESS) result = submit(info);
  if (result != VK_SUCCESS) return check(result, doing);
  result = api_.vkWaitForFences(handle_, 1, &fence_, VK_TRUE, std::numeric_limits<std::uint64_t>::max());
  if (result == VK_SUCCESS) result = api_.vkResetFences(handle_, 1, &fence_);
  return check(result, doing);
}

void Device::separate(VkCommandBuffer commands) const {
  constexpr VkPipelineStageFlags kDevice = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
  auto barrier = info_of<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
  barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_READ_BIT |
                          VK_ACCESS_TRANSFER_WRITE_BIT | VK_ACCESS_HOST_READ_BIT;
  api_.vkCmdPipelineBarrier(commands, kDevice, kDevice | VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier, 0, nullptr, 0,
                            nullptr);
}

VkResult make_shader(const Device& device, std::span<const std::uint32_t> code, VkShaderModule& shader) {
  auto info = info_of<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  info.codeSize = code.size_bytes();
  info.pCode = code.data();
  return device.api().vkCreateShaderModule(device.handle(), &info, nullptr, &shader);
}

VkResult make_compute_pipeline(const Device& device, VkPipelineLayout layout, std::span<const std::uint32_t> code,
                               std::span<const ShaderConstant> constants, VkPipeline& pipeline) {
  std::vector<VkBool32> values;
  std::vector<VkSpecializationMapEntry> entries;
  for (const ShaderConstant& constant : constants) {
    const auto offset = static_cast<std::uint32_t>(values.size() * sizeof(VkBool32));
    entries.push_back({constant.number, offset, sizeof(VkBool32)});
    values.push_back(constant.value ? VK_TRUE : VK_FALSE);
  }
  const VkSpecializationInfo specialization{static_cast<std::uint32_t>(entries.size()), entries.data(),
                                            values.size() * sizeof(VkBool32), values.data()};
  auto info = info_of<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  info.layout = layout;
  info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.pName = "main";
  info.stage.pSpecializationInfo = &specialization;
  VkResult result = make_shader(device, code, info.stage.module);
  if (result != VK_SUCCESS) return result;
  const Api& api = device.api();
  result = api.vkCreateComputePipelines(device.handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline);
  api.vkDestroyShaderModule(device.handle(), info.stage.module, nullptr);
  return result;
}

VkResult make_push_layout(const Device& device, VkShaderStageFlags stages, std::uint32_t bytes,
                          VkPipelineLayout& layout) {
  const VkPushConstantRange range{stages, 0, bytes};
  auto info = info_of<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  info.pushConstantRangeCount = 1;
  info.pPushConstantRanges = &range;
  return device.api().vkCreatePipelineLayout(device.handle(), &info, nullptr, &layout);
}

}  // namespace quoin::vulkan
