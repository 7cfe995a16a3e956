#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#define VK_NO_PROTOTYPES
#include <vulkan/vulkan.h>

#include <quoin/core/result.h>
#include <quoin/render/vulkan_renderer.h>

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

using MessageListener = std::function<void(const std::string&)>;

/// A device that could be used, or the reason why not.
struct PhysicalDevice {
  VkPhysicalDevice handle = VK_NULL_HANDLE;
  VkPhysicalDeviceType type = VK_PHYSICAL_DEVICE_TYPE_OTHER;
  std::uint32_t queue_family = 0;
  bool draws_triangles = false;  ///< true if the queue supports graphics
  bool draws_lines = false;      ///< true if it can draw triangle edges
  VulkanDeviceInfo description;
};

/// Describes a device, with its best suited queue family.
[[nodiscard]] PhysicalDevice describe(const Api& api, VkPhysicalDevice handle);
/// Returns the capabilities of a queue family; 0 if there is no such family.
[[nodiscard]] VkQueueFlags queue_flags(const Api& api, VkPhysicalDevice device, std::uint32_t family);

/// The Vulkan instance that this library creates when the caller lends no device.
class VulkanInstance {
 public:
  /// With `listener` the validation layer is loaded. Errors: Unsupported.
  [[nodiscard]] static Result<std::unique_ptr<VulkanInstance>> create(MessageListener listener);
  ~VulkanInstance();
  VulkanInstance(const VulkanInstance&) = delete;
  VulkanInstance& operator=(const VulkanInstance&) = delete;

  [[nodiscard]] const Api& api() const { return api_; }
  [[nodiscard]] const std::vector<PhysicalDevice>& devices() const { return devices_; }
  /// Chooses a device as documented for VulkanOptions::device. Errors: Unsupported.
  [[nodiscard]] Result<PhysicalDevice> choose(const std::string& wanted) const;

 private:
  explicit VulkanInstance(const Api& api, MessageListener listener) : api_(api), listener_(std::move(listener)) {}
  Status open();
  Status listen();
  Status list_devices();

  Api api_;
  MessageListener listener_;
  VkInstance handle_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  std::vector<PhysicalDevice> devices_;
};

/// A device, its one queue, and one batch of commands at a time.
class Device {
 public:
  /// Creates a device. Errors: Unsupported, LimitExceeded.
  [[nodiscard]] static Result<std::unique_ptr<Device>> create(const VulkanOptions& options);
  /// Uses the caller's device, which is not destroyed. Errors: as VulkanRenderer::create.
  [[nodiscard]] static Result<std::unique_ptr<Device>> borrow(const BorrowedVulkanDevice& lent);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] const Api& api() const { return api_; }
  [[nodiscard]] VkDevice handle() const { return handle_; }
  [[nodiscard]] const VulkanDeviceInfo& description() const { return physical_.description; }
  /// The capabilities and the Vulkan handle of the device.
  [[nodiscard]] const PhysicalDevice& physical() const { return physical_; }
  [[nodiscard]] const VkPhysicalDeviceMemoryProperties& memory() const { return memory_; }

  /// Converts a failed call to an error. `doing`: as in "drawing".
  [[nodiscard]] Error error_of(VkResult result, const std::string& doing) const;
  /// Converts a call's result to a status.
  [[nodiscard]] Status check(VkResult result, const std::string& doing) const {
    if (result == VK_SUCCESS) return {};
    return error_of(result, doing);
  }

  /// Runs the commands that `record` records, and waits for them. Their writes are then visible to the CPU and to later
  /// commands.
  [[nodiscard]] Status run(const std::string& doing, const std::function<void(VkCommandBuffer)>& record);

  /// Adds a barrier between commands where the later read or overwrite the results of the earlier.
  void separate(VkCommandBuffer commands) const;

 private:
  Device() = default;
  Status open(const PhysicalDevice& physical);
  Status adopt(const BorrowedVulkanDevice& lent);
  Status start();
  VkResult make_commands();
  VkResult submit(const VkSubmitInfo& info);

  std::unique_ptr<VulkanInstance> instance_;  // null: the device is borrowed
  std::function<void(const std::function<void()>&)> with_queue_;
  Api api_;
  PhysicalDevice physical_;
  VkPhysicalDeviceMemoryProperties memory_{};
  VkDevice handle_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  VkFence fence_ = VK_NULL_HANDLE;
};

/// Creates a shader, to be destroyed after its pipelines are created.
[[nodiscard]] VkResult make_shader(const Device& device, std::span<const std::uint32_t> code, VkShaderModule& shader);
/// A specialization constant of a compute shader.
struct ShaderConstant {
  std::uint32_t number = 0;
  bool value = false;
};
/// Creates a compute pipeline.
[[nodiscard]] VkResult make_compute_pipeline(const Device& device, VkPipelineLayout layout,
                                             std::span<const std::uint32_t> code,
                                             std::span<const ShaderConstant> constants, VkPipeline& pipeline);
/// Makes a layout with `bytes` of push constants; shaders find all other data by address.
[[nodiscard]] VkResult make_push_layout(const Device& device, VkShaderStageFlags stages, std::uint32_t bytes,
                                        VkPipelineLayout& layout);

}  // namespace quoin::vulkan
