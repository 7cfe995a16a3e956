#pragma once

#define VK_NO_PROTOTYPES
#include <vulkan/vulkan.h>

namespace quoin::viewer {

// Vulkan is loaded by SDL, not linked, so that the program starts without it.
#define QUOIN_VIEWER_VULKAN_OF_LOADER(X) \
  X(vkCreateInstance)                    \
  X(vkEnumerateInstanceLayerProperties)

#define QUOIN_VIEWER_VULKAN_OF_INSTANCE(X)     \
  X(vkCreateDevice)                            \
  X(vkDestroyInstance)                         \
  X(vkDestroySurfaceKHR)                       \
  X(vkEnumerateDeviceExtensionProperties)      \
  X(vkEnumeratePhysicalDevices)                \
  X(vkGetDeviceProcAddr)                       \
  X(vkGetPhysicalDeviceFeatures)               \
  X(vkGetPhysicalDeviceMemoryProperties)       \
  X(vkGetPhysicalDeviceQueueFamilyProperties)  \
  X(vkGetPhysicalDeviceSurfaceCapabilitiesKHR) \
  X(vkGetPhysicalDeviceSurfaceFormatsKHR)      \
  X(vkGetPhysicalDeviceSurfacePresentModesKHR) \
  X(vkGetPhysicalDeviceSurfaceSupportKHR)

#define QUOIN_VIEWER_VULKAN_OF_DEVICE(X) \
  X(vkAcquireNextImageKHR)               \
  X(vkAllocateCommandBuffers)            \
  X(vkAllocateDescriptorSets)            \
  X(vkAllocateMemory)                    \
  X(vkBeginCommandBuffer)                \
  X(vkBindBufferMemory)                  \
  X(vkBindImageMemory)                   \
  X(vkCmdBeginRenderPass)                \
  X(vkCmdBindDescriptorSets)             \
  X(vkCmdBindIndexBuffer)                \
  X(vkCmdBindPipeline)                   \
  X(vkCmdDraw)                           \
  X(vkCmdDrawIndexed)                    \
  X(vkCmdEndRenderPass)                  \
  X(vkCmdPushConstants)                  \
  X(vkCmdSetScissor)                     \
  X(vkCmdSetViewport)                    \
  X(vkCreateBuffer)                      \
  X(vkCreateCommandPool)                 \
  X(vkCreateDescriptorPool)              \
  X(vkCreateDescriptorSetLayout)         \
  X(vkCreateFence)                       \
  X(vkCreateFramebuffer)                 \
  X(vkCreateGraphicsPipelines)           \
  X(vkCreateImage)                       \
  X(vkCreateImageView)                   \
  X(vkCreatePipelineLayout)              \
  X(vkCreateRenderPass)                  \
  X(vkCreateSampler)                     \
  X(vkCreateSemaphore)                   \
  X(vkCreateShaderModule)                \
  X(vkCreateSwapchainKHR)                \
  X(vkDestroyBuffer)                     \
  X(vkDestroyCommandPool)                \
  X(vkDestroyDescriptorPool)             \
  X(vkDestroyDescriptorSetLayout)        \
  X(vkDestroyDevice)                     \
  X(vkDestroyFence)                      \
  X(vkDestroyFramebuffer)                \
  X(vkDestroyImage)                      \
  X(vkDestroyImageView)                  \
  X(vkDestroyPipeline)                   \
  X(vkDestroyPipelineLayout)             \
  X(vkDestroyRenderPass)                 \
  X(vkDestroySampler)                    \
  X(vkDestroySemaphore)                  \
  X(vkDestroyShaderModule)               \
  X(vkDestroySwapchainKHR)               \
  X(vkDeviceWaitIdle)                    \
  X(vkEndCommandBuffer)                  \
  X(vkFreeMemory)                        \
  X(vkGetBufferDeviceAddress)            \
  X(vkGetBufferMemoryRequirements)       \
  X(vkGetDeviceQueue)                    \
  X(vkGetImageMemoryRequirements)        \
  X(vkGetSwapchainImagesKHR)             \
  X(vkMapMemory)                         \
  X(vkQueuePresentKHR)                   \
  X(vkQueueSubmit)                       \
  X(vkResetCommandPool)                  \
  X(vkResetFences)                       \
  X(vkUpdateDescriptorSets)              \
  X(vkWaitForFences)

/// Returns a Vulkan structure with its `sType` set.
template <class T>
[[nodiscard]] T info_of(VkStructureType type) {
  T info{};
  info.sType = type;
  return info;
}

/// The Vulkan functions that windows need. Each of the three load functions returns true if all were found.
struct VulkanFunctions {
  // NOLINTBEGIN(readability-identifier-naming): Vulkan's own names
  PFN_vkGetInstanceProcAddr vkGetInstanceProcAddr = nullptr;
#define QUOIN_VIEWER_VULKAN_MEMBER(name) PFN_##name name = nullptr;
  QUOIN_VIEWER_VULKAN_OF_LOADER(QUOIN_VIEWER_VULKAN_MEMBER)
  QUOIN_VIEWER_VULKAN_OF_INSTANCE(QUOIN_VIEWER_VULKAN_MEMBER)
  QUOIN_VIEWER_VULKAN_OF_DEVICE(QUOIN_VIEWER_VULKAN_MEMBER)
#undef QUOIN_VIEWER_VULKAN_MEMBER
  // NOLINTEND(readability-identifier-naming)

  [[nodiscard]] bool load(PFN_vkGetInstanceProcAddr entry);
  [[nodiscard]] bool load_instance(VkInstance instance);
  [[nodiscard]] bool load_device(VkDevice device);
};

}  // namespace quoin::viewer
