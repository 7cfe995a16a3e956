#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <quoin/render_vk/vulkan_renderer.h>

#include "render_vk/device/api.h"

namespace quoin::vulkan {

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

}  // namespace quoin::vulkan
