#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/render_vk/vulkan_device.h>

#include "functions.h"

namespace quoin::viewer {

/// What a window and its user want of a device.
struct WindowDeviceOptions {
  std::string device;  ///< as VulkanOptions::device
  PFN_vkGetInstanceProcAddr get_instance_proc_addr = nullptr;
  std::vector<std::string> instance_extensions;  ///< that windows take
  /// Makes the window's surface, which the device destroys; null where that fails.
  std::function<VkSurfaceKHR(VkInstance instance)> make_surface;
  /// Told what the validation layer says, which is then loaded.
  std::function<void(const std::string& message)> on_validation_message;
};

/// An instance, a window's surface, and a device with one queue that computes, draws and shows pictures there: all of
/// it the viewer's own, and as Quoin's renderers need it.
///
/// Threads: one at a time.
class WindowDevice {
 public:
  /// Errors: Unsupported, saying what is missing.
  [[nodiscard]] static Result<std::shared_ptr<WindowDevice>> create(const WindowDeviceOptions& options);
  ~WindowDevice();
  WindowDevice(const WindowDevice&) = delete;
  WindowDevice& operator=(const WindowDevice&) = delete;

  /// For VulkanRenderer::create; this must outlive the renderer.
  [[nodiscard]] BorrowedVulkanDevice lent() const;

  [[nodiscard]] const VulkanFunctions& api() const { return api_; }
  [[nodiscard]] VkPhysicalDevice physical() const { return physical_; }
  [[nodiscard]] VkDevice handle() const { return handle_; }
  [[nodiscard]] VkQueue queue() const { return queue_; }
  [[nodiscard]] std::uint32_t queue_family() const { return queue_family_; }
  [[nodiscard]] VkSurfaceKHR surface() const { return surface_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// A kind of memory that is among the `allowed` ones and has all that is wanted; else any of the allowed ones.
  [[nodiscard]] std::uint32_t memory_type(std::uint32_t allowed, VkMemoryPropertyFlags wanted) const;

  /// What a call comes to. `doing`: as in "showing a picture".
  [[nodiscard]] Status check(VkResult result, const std::string& doing) const;

 private:
  struct Candidate {
    VkPhysicalDevice handle = VK_NULL_HANDLE;
    std::uint32_t queue_family = 0;
    VulkanDeviceInfo description;
  };

  explicit WindowDevice(const WindowDeviceOptions& options) : listener_(options.on_validation_message) {}
  Status open(const WindowDeviceOptions& options);
  Status make_instance(const WindowDeviceOptions& options);
  Status listen();
  [[nodiscard]] std::vector<Candidate> candidates() const;
  [[nodiscard]] bool find_queue_family(Candidate& candidate) const;
  Status make_device(const Candidate& chosen);

  std::function<void(const std::string&)> listener_;
  VulkanFunctions api_;
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  VkSurfaceKHR surface_ = VK_NULL_HANDLE;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkPhysicalDeviceMemoryProperties memory_{};
  VkDevice handle_ = VK_NULL_HANDLE;
  VkQueue queue_ = VK_NULL_HANDLE;
  std::uint32_t queue_family_ = 0;
  bool draws_lines_ = false;
  std::string name_;
};

}  // namespace quoin::viewer
