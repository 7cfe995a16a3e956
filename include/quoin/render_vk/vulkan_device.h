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

/// Vulkan's own handles, without its headers: what is declared here is what they declare, so that a program's VkDevice
/// is passed on as it is.
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

/// A device that Vulkan offers.
struct VulkanDeviceInfo {
  std::string name;
  std::string kind;     ///< discrete, integrated, virtual, cpu or other
  std::string missing;  ///< what it lacks of what Quoin needs; empty: nothing
};

/// The devices of this machine, in Vulkan's order.
///
/// Errors: Unsupported when the library was built without Vulkan, when there is no loader, or no driver.
[[nodiscard]] Result<std::vector<VulkanDeviceInfo>> vulkan_devices();

/// Returns the index of the device that `wanted` names: a number is an index, anything else a part of a name, in
/// capitals or not; empty: the first of the best kind (discrete, integrated, virtual, cpu, other) that lacks nothing.
///
/// Errors: Unsupported when there is no such device, naming those there are, and when it lacks something, saying what.
[[nodiscard]] Result<std::size_t> choose_vulkan_device(std::span<const VulkanDeviceInfo> devices,
                                                       const std::string& wanted);

/// What an instance and a device that a program makes by itself need for Quoin's renderers.
struct VulkanRequirements {
  /// At least, of the instance (VkApplicationInfo::apiVersion) and of the device: VK_API_VERSION_1_2.
  std::uint32_t api_version = 0;
  std::span<const char* const> instance_extensions;  ///< none so far
  std::span<const char* const> device_extensions;    ///< none so far
  /// Members of Vulkan's structures of features that must be true; `enable_vulkan_features` sets them.
  std::span<const char* const> features;
  /// The same of features without which some pictures are refused; BorrowedVulkanDevice says which are enabled.
  std::span<const char* const> optional_features;
};

/// The same for every device; also in builds without Vulkan. Lifetime: for ever.
[[nodiscard]] VulkanRequirements vulkan_requirements();

/// Returns the name of a physical device of a program's own instance, and what it lacks. `instance` must have been
/// made with at least `vulkan_requirements().api_version`. `get_instance_proc_addr` is vkGetInstanceProcAddr; null:
/// that of the loader that the library finds (libvulkan.so.1).
///
/// Errors: InvalidArgument when a handle is null; Unsupported when the library was built without Vulkan, or when there
///         is no loader.
[[nodiscard]] Result<VulkanDeviceInfo> describe_vulkan_device(
    VkInstance_T* instance, VkPhysicalDevice_T* physical_device,
    VulkanGetInstanceProcAddr get_instance_proc_addr = nullptr);

/// Memory for a structure that `enable_vulkan_features` chains.
struct VulkanFeatureStorage {
  alignas(8) std::array<std::byte, 64> bytes{};
};

/// Enables what `vulkan_requirements().features` names: in the structures that are chained to `info` already
/// (VkPhysicalDeviceVulkan12Features or VkPhysicalDeviceBufferDeviceAddressFeatures), whose other members stay as they
/// are, or else in one more, which is put in `storage` and chained first.
///
/// Requires: `info.sType` says what it is; what is chained to it may be written to; `storage` stays in its place until
///           vkCreateDevice has returned.
/// Errors:   Unsupported when the library was built without Vulkan.
[[nodiscard]] Status enable_vulkan_features(VkDeviceCreateInfo& info, VulkanFeatureStorage& storage);

/// A program's own device, for VulkanRenderer::create.
/// Lifetime: Quoin destroys none of these; all must outlive the renderer.
struct BorrowedVulkanDevice {
  VkInstance_T* instance = nullptr;               ///< VkInstance, made as `vulkan_requirements` says
  VkPhysicalDevice_T* physical_device = nullptr;  ///< VkPhysicalDevice
  VkDevice_T* device = nullptr;                   ///< VkDevice, made as `vulkan_requirements` says
  VkQueue_T* queue = nullptr;                     ///< VkQueue that computes; for meshes it must draw too
  std::uint32_t queue_family = 0;                 ///< of that queue
  bool fill_mode_non_solid = false;               ///< that feature is enabled: wireframes need it
  /// vkGetInstanceProcAddr; null: the loader's (libvulkan.so.1).
  VulkanGetInstanceProcAddr get_instance_proc_addr = nullptr;
  /// Vulkan wants one thread at a time to use a queue. Quoin submits from the thread that calls it, and only while it
  /// runs `use`, which this must do once, before it returns: with the lock held that guards the queue. Empty: nobody
  /// else uses the queue during calls of Quoin's that may draw, upload or read.
  std::function<void(const std::function<void()>& use)> with_queue{};
};

}  // namespace quoin
