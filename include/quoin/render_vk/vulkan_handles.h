#pragma once

/// Vulkan's own handles, without its headers: what is declared here is what they declare, so that a program's VkDevice
/// is passed on as it is.

#include <cstdint>
#include <type_traits>

struct VkInstance_T;
struct VkPhysicalDevice_T;
struct VkDevice_T;
struct VkQueue_T;
struct VkCommandBuffer_T;
struct VkImage_T;
struct VkDeviceCreateInfo;

namespace quoin {

/// A VkImage: a pointer where addresses have 64 bits, else a number, as vulkan.h has it unless its
/// VK_USE_64_BIT_PTR_DEFINES says otherwise.
using VulkanImageHandle = std::conditional_t<sizeof(void*) == 8, VkImage_T*, std::uint64_t>;

/// PFN_vkVoidFunction and PFN_vkGetInstanceProcAddr. Windows of 32 bits calls these in another way.
#if defined(_WIN32) && !defined(_WIN64)
using VulkanFunction = void(__stdcall*)();
using VulkanGetInstanceProcAddr = VulkanFunction(__stdcall*)(VkInstance_T* instance, const char* name);
#else
using VulkanFunction = void (*)();
using VulkanGetInstanceProcAddr = VulkanFunction (*)(VkInstance_T* instance, const char* name);
#endif

}  // namespace quoin
