#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include <quoin/core/result.h>

/// Vulkan handles without the Vulkan headers. The declarations match vulkan.h, so that an application's VkDevice can be
/// passed as it is.
struct VkInstance_T;
struct VkPhysicalDevice_T;
struct VkDevice_T;
struct VkQueue_T;
struct VkCommandBuffer_T;
struct VkImage_T;
struct VkDeviceCreateInfo;

namespace [[gnu::visibility("default")]] quoin {

/// Vulkan's VkImage handle. It is a pointer on 64-bit platforms, else an integer, as in vulkan.h unless the application
/// defines VK_USE_64_BIT_PTR_DEFINES otherwise.
using VulkanImageHandle = std::conditional_t<sizeof(void*) == 8, VkImage_T*, std::uint64_t>;

/// PFN_vkVoidFunction and PFN_vkGetInstanceProcAddr. 32-bit Windows has a different calling convention.
#if defined(_WIN32) && !defined(_WIN64)
using VulkanFunction = void(__stdcall*)();
using VulkanGetInstanceProcAddr = VulkanFunction(__stdcall*)(VkInstance_T* instance, const char* name);
#else
using VulkanFunction = void (*)();
using VulkanGetInstanceProcAddr = VulkanFunction (*)(VkInstance_T* instance, const char* name);
#endif

/// A Vulkan device of this machine.
struct VulkanDeviceInfo {
  std::string name;
  std::string kind;     ///< discrete, integrated, virtual, cpu or other
  std::string missing;  ///< missing features that Quoin needs; empty if the device is suitable
};

/// Returns the devices of this machine, in Vulkan's order.
///
/// Errors: Unsupported if the library was built without Vulkan, or if there is no loader or no driver.
[[nodiscard]] Result<std::vector<VulkanDeviceInfo>> vulkan_devices();

/// Returns the index of the device that `wanted` selects. A number is an index; any other text is part of a device
/// name, ignoring case. Empty: the first suitable device of the best kind (discrete, integrated, virtual, cpu, other).
///
/// Errors: Unsupported if no device matches, listing the available devices, and if the device lacks a feature, naming
///         it.
[[nodiscard]] Result<std::size_t> choose_vulkan_device(std::span<const VulkanDeviceInfo> devices,
                                                       const std::string& wanted);

/// Requirements of Quoin's renderers for an instance and a device that the application creates.
struct VulkanRequirements {
  /// Minimum version of the instance (VkApplicationInfo::apiVersion) and of the device: VK_API_VERSION_1_2.
  std::uint32_t api_version = 0;
  std::span<const char* const> instance_extensions;  ///< currently none
  std::span<const char* const> device_extensions;    ///< currently none
  /// Names of the Vulkan feature members that must be true; `enable_vulkan_features` sets them.
  std::span<const char* const> features;
  /// Names of optional feature members. Without them, some images are rejected; set the matching flags of
  /// BorrowedVulkanDevice.
  std::span<const char* const> optional_features;
};

/// Returns the requirements, which are the same for every device and in builds without Vulkan.
/// Lifetime: the spans stay valid for the whole program.
[[nodiscard]] VulkanRequirements vulkan_requirements();

/// Returns the name of a physical device of the application's own instance, and its missing features.
/// `get_instance_proc_addr` is vkGetInstanceProcAddr; null: the function of the loader that the library finds
/// (libvulkan.so.1).
///
/// Requires: `instance` was created with at least `vulkan_requirements().api_version`.
/// Errors:   InvalidArgument if a handle is null; Unsupported if the library was built without Vulkan or there is no
///           loader.
[[nodiscard]] Result<VulkanDeviceInfo> describe_vulkan_device(
    VkInstance_T* instance, VkPhysicalDevice_T* physical_device,
    VulkanGetInstanceProcAddr get_instance_proc_addr = nullptr);

/// Memory for a structure that `enable_vulkan_features` adds to the pNext chain.
struct VulkanFeatureStorage {
  alignas(8) std::array<std::byte, 64> bytes{};
};

/// Enables the features in `vulkan_requirements().features`. Sets them in a structure already chained to `info`
/// (VkPhysicalDeviceVulkan12Features or VkPhysicalDeviceBufferDeviceAddressFeatures) and keeps its other members. If
/// there is none, places a new structure in `storage` and chains it first.
///
/// Requires: `info.sType` is set; the structures in its chain are writable; `storage` stays in place until
///           vkCreateDevice has returned.
/// Errors:   Unsupported if the library was built without Vulkan.
[[nodiscard]] Status enable_vulkan_features(VkDeviceCreateInfo& info, VulkanFeatureStorage& storage);

/// The application's own device, for VulkanRenderer::create.
/// Lifetime: Quoin destroys none of these handles; all must outlive the renderer.
struct BorrowedVulkanDevice {
  VkInstance_T* instance = nullptr;               ///< VkInstance that meets `vulkan_requirements`
  VkPhysicalDevice_T* physical_device = nullptr;  ///< VkPhysicalDevice
  VkDevice_T* device = nullptr;                   ///< VkDevice that meets `vulkan_requirements`
  VkQueue_T* queue = nullptr;                     ///< VkQueue with compute support; meshes also need graphics support
  std::uint32_t queue_family = 0;                 ///< family of `queue`
  bool fill_mode_non_solid = false;               ///< true if the feature is enabled; wireframes need it
  /// vkGetInstanceProcAddr; null: the loader's function (libvulkan.so.1).
  VulkanGetInstanceProcAddr get_instance_proc_addr = nullptr;
  /// Runs `use` once, before it returns, while holding the lock that guards the queue. Quoin submits to the queue only
  /// inside `use`, on the thread that calls Quoin, because Vulkan allows one thread at a time per queue. Empty: the
  /// application does not use the queue during calls of Quoin that may draw, upload or read.
  std::function<void(const std::function<void()>& use)> with_queue{};
};

}  // namespace quoin
