#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "render_vk/device/instance.h"

namespace quoin::vulkan {

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
