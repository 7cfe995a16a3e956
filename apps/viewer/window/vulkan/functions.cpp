#include "functions.h"

namespace quoin::viewer {

bool VulkanFunctions::load(PFN_vkGetInstanceProcAddr entry) {
  vkGetInstanceProcAddr = entry;
  bool is_complete = entry != nullptr;
#define QUOIN_VIEWER_VULKAN_LOAD(name)                                                           \
  if (is_complete) (name) = reinterpret_cast<PFN_##name>(vkGetInstanceProcAddr(nullptr, #name)); \
  is_complete = is_complete && (name) != nullptr;
  QUOIN_VIEWER_VULKAN_OF_LOADER(QUOIN_VIEWER_VULKAN_LOAD)
#undef QUOIN_VIEWER_VULKAN_LOAD
  return is_complete;
}

bool VulkanFunctions::load_instance(VkInstance instance) {
  bool is_complete = true;
#define QUOIN_VIEWER_VULKAN_LOAD(name)                                         \
  name = reinterpret_cast<PFN_##name>(vkGetInstanceProcAddr(instance, #name)); \
  is_complete = is_complete && (name) != nullptr;
  QUOIN_VIEWER_VULKAN_OF_INSTANCE(QUOIN_VIEWER_VULKAN_LOAD)
#undef QUOIN_VIEWER_VULKAN_LOAD
  return is_complete;
}

bool VulkanFunctions::load_device(VkDevice device) {
  bool is_complete = true;
#define QUOIN_VIEWER_VULKAN_LOAD(name)                                     \
  name = reinterpret_cast<PFN_##name>(vkGetDeviceProcAddr(device, #name)); \
  is_complete = is_complete && (name) != nullptr;
  QUOIN_VIEWER_VULKAN_OF_DEVICE(QUOIN_VIEWER_VULKAN_LOAD)
#undef QUOIN_VIEWER_VULKAN_LOAD
  return is_complete;
}

}  // namespace quoin::viewer
