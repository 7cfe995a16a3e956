#include "window_device.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "viewer/window/screen.h"

// Included after Vulkan's headers, because it would otherwise declare their types itself.
#include <SDL_vulkan.h>

namespace quoin::viewer {

namespace {

using MessageListener = std::function<void(const std::string&)>;

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

Error refuse(std::string message) {
  return make_error(ErrorCode::Unsupported, "vulkan: " + std::move(message));
}

bool has_validation() {
  std::uint32_t count = 0;
  vkEnumerateInstanceLayerProperties(&count, nullptr);
  std::vector<VkLayerProperties> layers(count);
  vkEnumerateInstanceLayerProperties(&count, layers.data());
  return std::any_of(layers.begin(), layers.end(), [](const VkLayerProperties& layer) {
    return std::strcmp(layer.layerName, kValidationLayer) == 0;
  });
}

VKAPI_ATTR VkBool32 VKAPI_CALL pass_on(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                       const VkDebugUtilsMessengerCallbackDataEXT* data, void* listener) {
  (*static_cast<const MessageListener*>(listener))(data->pMessage);
  return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messenger_info(MessageListener& listener) {
  auto info = info_of<VkDebugUtilsMessengerCreateInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
  info.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
  info.pfnUserCallback = pass_on;
  info.pUserData = &listener;
  return info;
}

}  // namespace

Result<std::shared_ptr<WindowDevice>> WindowDevice::create(const WindowDeviceOptions& options) {
  std::shared_ptr<WindowDevice> made(new WindowDevice(options));
  if (Status opened = made->open(options); !opened) return opened.error();
  return made;
}

WindowDevice::~WindowDevice() {
  if (handle_ != VK_NULL_HANDLE) {
    vkDeviceWaitIdle(handle_);
    vkDestroyDevice(handle_, nullptr);
  }
  if (instance_ == VK_NULL_HANDLE) return;
  if (surface_ != VK_NULL_HANDLE) vkDestroySurfaceKHR(instance_, surface_, nullptr);
  if (messenger_ != VK_NULL_HANDLE) {
    // Looked up again, because an instance without messages may have replaced volk's function.
    const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"));
    destroy(instance_, messenger_, nullptr);
  }
  vkDestroyInstance(instance_, nullptr);
}

Status WindowDevice::open(const WindowDeviceOptions& options) {
  const bool has_loader = options.get_instance_proc_addr != nullptr;
  if (has_loader) volkInitializeCustom(options.get_instance_proc_addr);
  if (!has_loader || vkCreateInstance == nullptr) return refuse("the Vulkan loader is missing or incomplete");
  if (Status made = make_instance(options); !made) return made;
  surface_ = options.make_surface(instance_);
  if (surface_ == VK_NULL_HANDLE) return refuse("the window cannot show images");
  const std::vector<Candidate> all = candidates();
  if (all.empty()) return refuse("no graphics driver found");
  std::vector<VulkanDeviceInfo> descriptions;
  descriptions.reserve(all.size());
  for (const Candidate& one : all) descriptions.push_back(one.description);
  const auto chosen = choose_vulkan_device(descriptions, options.device);
  if (!chosen) return chosen.error();
  return make_device(all[*chosen]);
}

Status WindowDevice::make_instance(const WindowDeviceOptions& options) {
  if (listener_ && !has_validation()) return refuse(std::string(kValidationLayer) + " is not installed");
  const VulkanRequirements needs = vulkan_requirements();
  auto application = info_of<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
  application.pApplicationName = "quoin view";
  application.apiVersion = needs.api_version;
  std::vector<const char*> extensions(needs.instance_extensions.begin(), needs.instance_extensions.end());
  for (const std::string& name : options.instance_extensions) extensions.push_back(name.c_str());
  VkDebugUtilsMessengerCreateInfoEXT messenger = messenger_info(listener_);
  auto info = info_of<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
  info.pApplicationInfo = &application;
  if (listener_) {
    info.pNext = &messenger;
    info.enabledLayerCount = 1;
    info.ppEnabledLayerNames = &kValidationLayer;
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
  }
  info.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  if (const VkResult result = vkCreateInstance(&info, nullptr, &instance_); result != VK_SUCCESS) {
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER) return refuse("no graphics driver found");
    if (result == VK_ERROR_EXTENSION_NOT_PRESENT) return refuse("no driver can show images in windows");
    return refuse("cannot create an instance (VkResult " + std::to_string(result) + ")");
  }
  // volk's functions are global. The loader's functions, unlike those of a device, work for every device.
  volkLoadInstance(instance_);
  if (vkGetPhysicalDeviceSurfaceSupportKHR == nullptr || vkQueuePresentKHR == nullptr) {
    return refuse("the instance lacks functions");
  }
  return listen();
}

Status WindowDevice::listen() {
  if (!listener_) return {};
  const VkDebugUtilsMessengerCreateInfoEXT messenger = messenger_info(listener_);
  if (vkCreateDebugUtilsMessengerEXT(instance_, &messenger, nullptr, &messenger_) != VK_SUCCESS) {
    return refuse("cannot receive validation messages");
  }
  return {};
}

std::vector<WindowDevice::Candidate> WindowDevice::candidates() const {
  std::uint32_t count = 0;
  std::vector<VkPhysicalDevice> handles;
  if (vkEnumeratePhysicalDevices(instance_, &count, nullptr) == VK_SUCCESS) {
    handles.resize(count);
    vkEnumeratePhysicalDevices(instance_, &count, handles.data());
    handles.resize(count);
  }
  std::vector<Candidate> found;
  for (const VkPhysicalDevice handle : handles) {
    const auto description = describe_vulkan_device(instance_, handle, vkGetInstanceProcAddr);
    if (!description) continue;
    Candidate one{handle, 0, *description};
    if (one.description.missing.empty() && !find_queue_family(one)) {
      one.description.missing = "a way to show images in this window";
    }
    found.push_back(std::move(one));
  }
  return found;
}

// Finds a queue family that computes, draws, and presents to the window.
bool WindowDevice::find_queue_family(Candidate& candidate) const {
  std::uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(candidate.handle, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  vkEnumerateDeviceExtensionProperties(candidate.handle, nullptr, &count, extensions.data());
  const bool has_swapchain = std::any_of(extensions.begin(), extensions.end(), [](const VkExtensionProperties& one) {
    return std::strcmp(one.extensionName, VK_KHR_SWAPCHAIN_EXTENSION_NAME) == 0;
  });
  if (!has_swapchain) return false;
  vkGetPhysicalDeviceQueueFamilyProperties(candidate.handle, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(candidate.handle, &count, families.data());
  constexpr VkQueueFlags kWanted = VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT;
  for (std::uint32_t i = 0; i < count; ++i) {
    VkBool32 can = VK_FALSE;
    if ((families[i].queueFlags & kWanted) != kWanted || families[i].queueCount == 0) continue;
    if (vkGetPhysicalDeviceSurfaceSupportKHR(candidate.handle, i, surface_, &can) != VK_SUCCESS) continue;
    candidate.queue_family = i;
    if (can != VK_FALSE) return true;
  }
  return false;
}

Status WindowDevice::make_device(const Candidate& chosen) {
  physical_ = chosen.handle;
  queue_family_ = chosen.queue_family;
  name_ = chosen.description.name;
  vkGetPhysicalDeviceMemoryProperties(physical_, &memory_);
  const float priority = 1.0F;
  auto queue = info_of<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
  queue.queueFamilyIndex = queue_family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  VkPhysicalDeviceFeatures there{};
  vkGetPhysicalDeviceFeatures(physical_, &there);
  VkPhysicalDeviceFeatures features{};
  features.fillModeNonSolid = there.fillModeNonSolid;
  draws_lines_ = there.fillModeNonSolid != VK_FALSE;
  const VulkanRequirements needs = vulkan_requirements();
  std::vector<const char*> extensions(needs.device_extensions.begin(), needs.device_extensions.end());
  extensions.push_back(VK_KHR_SWAPCHAIN_EXTENSION_NAME);
  auto info = info_of<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  info.pEnabledFeatures = &features;
  info.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  VulkanFeatureStorage storage;
  if (Status enabled = enable_vulkan_features(info, storage); !enabled) return enabled;
  const VkResult result = vkCreateDevice(physical_, &info, nullptr, &handle_);
  if (result != VK_SUCCESS) return check(result, "starting");
  vkGetDeviceQueue(handle_, queue_family_, 0, &queue_);
  return {};
}

BorrowedVulkanDevice WindowDevice::lent() const {
  BorrowedVulkanDevice lent;
  lent.instance = instance_;
  lent.physical_device = physical_;
  lent.device = handle_;
  lent.queue = queue_;
  lent.queue_family = queue_family_;
  lent.fill_mode_non_solid = draws_lines_;
  lent.get_instance_proc_addr = vkGetInstanceProcAddr;
  return lent;  // the window's thread alone uses the queue
}

std::uint32_t WindowDevice::memory_type(std::uint32_t allowed, VkMemoryPropertyFlags wanted) const {
  std::uint32_t any = 0;
  for (std::uint32_t i = memory_.memoryTypeCount; i-- > 0;) {
    if ((allowed >> i & 1U) != 0) any = i;
  }
  for (std::uint32_t i = 0; i < memory_.memoryTypeCount; ++i) {
    if ((allowed >> i & 1U) != 0 && (memory_.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
  }
  return any;
}

Status WindowDevice::check(VkResult result, const std::string& doing) const {
  if (result == VK_SUCCESS) return {};
  const std::string who = "vulkan: " + name_ + ": ";
  switch (result) {
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
    case VK_ERROR_OUT_OF_HOST_MEMORY:
    case VK_ERROR_TOO_MANY_OBJECTS:
      return make_error(ErrorCode::LimitExceeded, who + "out of memory while " + doing);
    case VK_ERROR_DEVICE_LOST:
      return make_error(ErrorCode::DeviceLost, who + "the device was lost while " + doing);
    case VK_ERROR_SURFACE_LOST_KHR:
      return make_error(ErrorCode::Unsupported, who + "the window was lost while " + doing);
    default:
      return make_error(ErrorCode::Unsupported,
                        who + "failed while " + doing + " (VkResult " + std::to_string(result) + ")");
  }
}

Result<WindowDeviceOptions> device_options(SDL_Window* window) {
  unsigned count = 0;
  if (SDL_Vulkan_GetInstanceExtensions(window, &count, nullptr) == SDL_FALSE) {
    return make_error(ErrorCode::Unsupported, "cannot draw in a window with Vulkan: " + sdl_says());
  }
  std::vector<const char*> names(count);
  SDL_Vulkan_GetInstanceExtensions(window, &count, names.data());
  WindowDeviceOptions options;
  options.instance_extensions.assign(names.begin(), names.end());
  options.get_instance_proc_addr = reinterpret_cast<PFN_vkGetInstanceProcAddr>(SDL_Vulkan_GetVkGetInstanceProcAddr());
  options.make_surface = [window](VkInstance instance) {
    VkSurfaceKHR surface = VK_NULL_HANDLE;
    return SDL_Vulkan_CreateSurface(window, instance, &surface) == SDL_TRUE ? surface : VK_NULL_HANDLE;
  };
  return options;
}

Result<std::shared_ptr<VulkanRenderer>> make_renderer(std::shared_ptr<WindowDevice> device) {
  struct Both {
    std::shared_ptr<WindowDevice> device;
    VulkanRenderer renderer;  // destroyed first
  };
  auto renderer = VulkanRenderer::create(device->lent());
  if (!renderer) return renderer.error();
  const auto both = std::make_shared<Both>(Both{std::move(device), std::move(*renderer)});
  return std::shared_ptr<VulkanRenderer>(both, &both->renderer);
}

}  // namespace quoin::viewer
