#include <cstring>
#include <new>
#include <type_traits>

#include <quoin/core/assert.h>
#include <quoin/render_vk/vulkan_device.h>

#include "render_vk/device/instance.h"

namespace quoin {

using vulkan::Api;

static_assert(std::is_same_v<VulkanImageHandle, VkImage>);
static_assert(std::is_same_v<VulkanGetInstanceProcAddr, PFN_vkGetInstanceProcAddr>);
static_assert(std::is_same_v<VulkanFunction, PFN_vkVoidFunction>);

Result<std::vector<VulkanDeviceInfo>> vulkan_devices() {
  const auto instance = vulkan::VulkanInstance::create({});
  if (!instance) return instance.error();
  std::vector<VulkanDeviceInfo> devices;
  for (const vulkan::PhysicalDevice& device : (*instance)->devices()) devices.push_back(device.description);
  return devices;
}

Result<VulkanDeviceInfo> describe_vulkan_device(VkInstance_T* instance, VkPhysicalDevice_T* physical_device,
                                                VulkanGetInstanceProcAddr get_instance_proc_addr) {
  if (instance == nullptr) return make_error(ErrorCode::InvalidArgument, "vulkan: the instance is null");
  if (physical_device == nullptr) return make_error(ErrorCode::InvalidArgument, "vulkan: the physical device is null");
  auto api = Api::find(get_instance_proc_addr);
  if (!api) return api.error();
  if (const char* missing = api->load_instance(instance)) {
    return make_error(ErrorCode::Unsupported, std::string("vulkan: the instance lacks ") + missing);
  }
  return vulkan::describe(*api, physical_device).description;
}

Status enable_vulkan_features(VkDeviceCreateInfo& info, VulkanFeatureStorage& storage) {
  using Addresses = VkPhysicalDeviceBufferDeviceAddressFeatures;
  static_assert(sizeof(Addresses) <= sizeof storage.bytes && alignof(Addresses) <= 8);
  QUOIN_ASSERT(info.sType == VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, "a VkDeviceCreateInfo with its sType set");
  // Vulkan declares extension chains const, although some structures in them are outputs.
  for (auto* one = static_cast<VkBaseOutStructure*>(const_cast<void*>(info.pNext)); one != nullptr; one = one->pNext) {
    if (one->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES) {
      reinterpret_cast<VkPhysicalDeviceVulkan12Features*>(one)->bufferDeviceAddress = VK_TRUE;
      return {};
    }
    if (one->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES) {
      reinterpret_cast<Addresses*>(one)->bufferDeviceAddress = VK_TRUE;
      return {};
    }
  }
  auto* addresses = new (storage.bytes.data()) Addresses{};
  addresses->sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES;
  addresses->pNext = const_cast<void*>(info.pNext);
  addresses->bufferDeviceAddress = VK_TRUE;
  info.pNext = addresses;
  return {};
}

}  // namespace quoin
