#include "render_vk/device/device.h"

#include <limits>

namespace quoin::vulkan {

Result<std::unique_ptr<Device>> Device::create(const VulkanOptions& options) {
  auto instance = VulkanInstance::create(options.on_validation_message, options.surface);
  if (!instance) return instance.error();
  const auto physical = (*instance)->choose(options.device);
  if (!physical) return physical.error();
  std::unique_ptr<Device> device(new Device());
  device->instance_ = std::move(*instance);
  if (Status opened = device->open(*physical); !opened) return opened.error();
  return device;
}

Status Device::open(const PhysicalDevice& physical) {
  api_ = instance_->api();
  physical_ = physical;
  api_.vkGetPhysicalDeviceMemoryProperties(physical.handle, &memory_);
  const float priority = 1.0F;
  auto queue = info_of<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
  queue.queueFamilyIndex = physical.queue_family;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  auto addresses = info_of<VkPhysicalDeviceBufferDeviceAddressFeatures>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES);
  addresses.bufferDeviceAddress = VK_TRUE;
  auto info = info_of<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
  info.pNext = &addresses;
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  VkPhysicalDeviceFeatures features{};
  features.fillModeNonSolid = physical.draws_lines ? VK_TRUE : VK_FALSE;
  info.pEnabledFeatures = &features;
  const char* const swapchain = VK_KHR_SWAPCHAIN_EXTENSION_NAME;
  if (surface() != VK_NULL_HANDLE) {
    info.enabledExtensionCount = 1;
    info.ppEnabledExtensionNames = &swapchain;
  }
  const VkResult result = api_.vkCreateDevice(physical.handle, &info, nullptr, &handle_);
  if (result != VK_SUCCESS) return check(result, "starting");
  api_.load_device(handle_);
  api_.vkGetDeviceQueue(handle_, physical.queue_family, 0, &queue_);
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
  api_.vkDeviceWaitIdle(handle_);
  if (fence_ != VK_NULL_HANDLE) api_.vkDestroyFence(handle_, fence_, nullptr);
  if (pool_ != VK_NULL_HANDLE) api_.vkDestroyCommandPool(handle_, pool_, nullptr);
  api_.vkDestroyDevice(handle_, nullptr);
}

Error Device::error_of(VkResult result, const std::string& doing) const {
  const std::string who = "vulkan: " + description().name + ": ";
  switch (result) {
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return {ErrorCode::LimitExceeded, who + "out of its memory while " + doing, {}, {}};
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return {ErrorCode::LimitExceeded, who + "out of the machine's memory while " + doing, {}, {}};
    case VK_ERROR_TOO_MANY_OBJECTS:
      return {ErrorCode::LimitExceeded, who + "out of blocks of memory while " + doing, {}, {}};
    case VK_ERROR_DEVICE_LOST:
      return {ErrorCode::Unsupported, who + "the device was lost while " + doing, {}, {}};
    case VK_ERROR_SURFACE_LOST_KHR:
      return {ErrorCode::Unsupported, who + "the window was lost while " + doing, {}, {}};
    default:
      return {
          ErrorCode::Unsupported, who + "failed while " + doing + " (VkResult " + std::to_string(result) + ")", {}, {}};
  }
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
  auto submit = info_of<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &commands_;
  if (result == VK_SUCCESS) result = api_.vkQueueSubmit(queue_, 1, &submit, fence_);
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

}  // namespace quoin::vulkan
