#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <volk.h>

#include <quoin/core/result.h>
#include <quoin/render/vulkan_device.h>
#include <quoin/render/vulkan_renderer.h>

struct SDL_Window;

namespace quoin::viewer {

/// Returns a Vulkan structure with its `sType` set.
template <class T>
[[nodiscard]] T info_of(VkStructureType type) {
  T info{};
  info.sType = type;
  return info;
}

/// Requirements of a window for its device.
struct WindowDeviceOptions {
  std::string device;  ///< as VulkanOptions::device
  PFN_vkGetInstanceProcAddr get_instance_proc_addr = nullptr;
  std::vector<std::string> instance_extensions;  ///< required by windows
  /// Makes the window's surface, which the device destroys. Returns null on failure.
  std::function<VkSurfaceKHR(VkInstance instance)> make_surface;
  /// If set, the validation layer is loaded and its messages are passed here.
  std::function<void(const std::string& message)> on_validation_message;
};

/// An instance, a window's surface, and a device with one queue that computes, draws and presents. The viewer owns
/// them; they fulfil the requirements of Quoin's renderers.
///
/// Threads: one at a time.
class WindowDevice {
 public:
  /// Errors: Unsupported, with the missing feature.
  [[nodiscard]] static Result<std::shared_ptr<WindowDevice>> create(const WindowDeviceOptions& options);
  ~WindowDevice();
  WindowDevice(const WindowDevice&) = delete;
  WindowDevice& operator=(const WindowDevice&) = delete;

  /// Returns the device for VulkanRenderer::create; `this` must outlive the renderer.
  [[nodiscard]] BorrowedVulkanDevice lent() const;

  [[nodiscard]] VkPhysicalDevice physical() const { return physical_; }
  [[nodiscard]] VkDevice handle() const { return handle_; }
  [[nodiscard]] VkQueue queue() const { return queue_; }
  [[nodiscard]] std::uint32_t queue_family() const { return queue_family_; }
  [[nodiscard]] VkSurfaceKHR surface() const { return surface_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Returns an `allowed` memory type with all `wanted` properties, or else any allowed one.
  [[nodiscard]] std::uint32_t memory_type(std::uint32_t allowed, VkMemoryPropertyFlags wanted) const;

  /// Converts the result of a Vulkan call. `doing` names the call in the error, as in "showing an image".
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

/// Returns the device options for a window with SDL_WINDOW_VULKAN, which must outlive the device. Errors: Unsupported.
[[nodiscard]] Result<WindowDeviceOptions> device_options(SDL_Window* window);

/// Creates a renderer that keeps the device alive. Errors: those of VulkanRenderer::create.
[[nodiscard]] Result<std::shared_ptr<VulkanRenderer>> make_renderer(std::shared_ptr<WindowDevice> device);

}  // namespace quoin::viewer
