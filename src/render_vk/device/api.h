#pragma once

#define VK_NO_PROTOTYPES
#include <vulkan/vulkan.h>

#include <quoin/core/result.h>

namespace quoin::vulkan {

// Vulkan is not linked but looked up at run time, so that a program also starts without it.
#define QUOIN_VULKAN_OF_LOADER(X)           \
  X(vkCreateInstance)                       \
  X(vkEnumerateInstanceExtensionProperties) \
  X(vkEnumerateInstanceLayerProperties)     \
  X(vkEnumerateInstanceVersion)

#define QUOIN_VULKAN_OF_INSTANCE(X)      \
  X(vkCreateDevice)                      \
  X(vkDestroyInstance)                   \
  X(vkEnumeratePhysicalDevices)          \
  X(vkGetDeviceProcAddr)                 \
  X(vkGetPhysicalDeviceFeatures)         \
  X(vkGetPhysicalDeviceFeatures2)        \
  X(vkGetPhysicalDeviceFormatProperties) \
  X(vkGetPhysicalDeviceMemoryProperties) \
  X(vkGetPhysicalDeviceProperties)       \
  X(vkGetPhysicalDeviceQueueFamilyProperties)

#define QUOIN_VULKAN_OF_DEVICE(X)  \
  X(vkAllocateCommandBuffers)      \
  X(vkAllocateMemory)              \
  X(vkBeginCommandBuffer)          \
  X(vkBindBufferMemory)            \
  X(vkBindImageMemory)             \
  X(vkCmdBeginRenderPass)          \
  X(vkCmdBindIndexBuffer)          \
  X(vkCmdBindPipeline)             \
  X(vkCmdCopyBuffer)               \
  X(vkCmdCopyBufferToImage)        \
  X(vkCmdCopyImageToBuffer)        \
  X(vkCmdDispatch)                 \
  X(vkCmdDraw)                     \
  X(vkCmdDrawIndexed)              \
  X(vkCmdEndRenderPass)            \
  X(vkCmdFillBuffer)               \
  X(vkCmdPipelineBarrier)          \
  X(vkCmdPushConstants)            \
  X(vkCmdSetDepthBias)             \
  X(vkCmdSetScissor)               \
  X(vkCmdSetViewport)              \
  X(vkCreateBuffer)                \
  X(vkCreateCommandPool)           \
  X(vkCreateComputePipelines)      \
  X(vkCreateFence)                 \
  X(vkCreateFramebuffer)           \
  X(vkCreateGraphicsPipelines)     \
  X(vkCreateImage)                 \
  X(vkCreateImageView)             \
  X(vkCreatePipelineLayout)        \
  X(vkCreateRenderPass)            \
  X(vkCreateShaderModule)          \
  X(vkDestroyBuffer)               \
  X(vkDestroyCommandPool)          \
  X(vkDestroyDevice)               \
  X(vkDestroyFence)                \
  X(vkDestroyFramebuffer)          \
  X(vkDestroyImage)                \
  X(vkDestroyImageView)            \
  X(vkDestroyPipeline)             \
  X(vkDestroyPipelineLayout)       \
  X(vkDestroyRenderPass)           \
  X(vkDestroyShaderModule)         \
  X(vkDeviceWaitIdle)              \
  X(vkEndCommandBuffer)            \
  X(vkFreeMemory)                  \
  X(vkGetBufferDeviceAddress)      \
  X(vkGetBufferMemoryRequirements) \
  X(vkGetDeviceQueue)              \
  X(vkGetImageMemoryRequirements)  \
  X(vkMapMemory)                   \
  X(vkQueueSubmit)                 \
  X(vkResetCommandPool)            \
  X(vkResetFences)                 \
  X(vkWaitForFences)

/// Returns an empty Vulkan structure with its sType set.
template <class T>
[[nodiscard]] T info_of(VkStructureType type) {
  T info{};
  info.sType = type;
  return info;
}

/// The Vulkan functions in use.
struct Api {
  // NOLINTBEGIN(readability-identifier-naming): Vulkan's own names
  PFN_vkGetInstanceProcAddr vkGetInstanceProcAddr = nullptr;
#define QUOIN_VULKAN_MEMBER(name) PFN_##name name = nullptr;
  QUOIN_VULKAN_OF_LOADER(QUOIN_VULKAN_MEMBER)
  QUOIN_VULKAN_OF_INSTANCE(QUOIN_VULKAN_MEMBER)
  QUOIN_VULKAN_OF_DEVICE(QUOIN_VULKAN_MEMBER)
#undef QUOIN_VULKAN_MEMBER
  // NOLINTEND(readability-identifier-naming)

  /// Loads the functions of the Vulkan loader. Errors: Unsupported if there is none.
  [[nodiscard]] static Result<Api> load();
  /// Finds the functions for an instance made by the caller, through `entry` unless null. Errors: as `load`.
  [[nodiscard]] static Result<Api> find(PFN_vkGetInstanceProcAddr entry);
  /// Return the name of the first missing function; null if all are there.
  [[nodiscard]] const char* load_instance(VkInstance instance);
  [[nodiscard]] const char* load_device(VkDevice device);
};

}  // namespace quoin::vulkan
