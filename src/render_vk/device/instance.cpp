#include "render_vk/device/instance.h"

#include <algorithm>
#include <cstring>
#include <optional>

namespace quoin::vulkan {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

Error refuse(std::string message) {
  return make_error(ErrorCode::Unsupported, "vulkan: " + std::move(message));
}

bool has_validation(const Api& api) {
  std::uint32_t count = 0;
  api.vkEnumerateInstanceLayerProperties(&count, nullptr);
  std::vector<VkLayerProperties> layers(count);
  api.vkEnumerateInstanceLayerProperties(&count, layers.data());
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

std::string kind_of(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return "discrete";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return "integrated";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return "virtual";
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return "cpu";
    default:
      return "other";
  }
}

std::vector<VkQueueFamilyProperties> queue_families(const Api& api, VkPhysicalDevice device) {
  std::uint32_t count = 0;
  api.vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  api.vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  families.resize(count);
  return families;
}

// Returns the first queue family with all capabilities in `wanted`.
std::optional<std::uint32_t> queue_family(const Api& api, VkPhysicalDevice device, VkQueueFlags wanted) {
  const std::vector<VkQueueFamilyProperties> families = queue_families(api, device);
  const auto found = std::find_if(families.begin(), families.end(), [=](const VkQueueFamilyProperties& family) {
    return (family.queueFlags & wanted) == wanted && family.queueCount > 0;
  });
  if (found == families.end()) return std::nullopt;
  return static_cast<std::uint32_t>(found - families.begin());
}

bool has_addresses(const Api& api, VkPhysicalDevice device) {
  auto addresses = info_of<VkPhysicalDeviceBufferDeviceAddressFeatures>(
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES);
  VkPhysicalDeviceFeatures2 features{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &addresses, {}};
  api.vkGetPhysicalDeviceFeatures2(device, &features);
  return addresses.bufferDeviceAddress != VK_FALSE;
}

}  // namespace

VkQueueFlags queue_flags(const Api& api, VkPhysicalDevice device, std::uint32_t family) {
  const std::vector<VkQueueFamilyProperties> families = queue_families(api, device);
  return family < families.size() ? families[family].queueFlags : 0;
}

PhysicalDevice describe(const Api& api, VkPhysicalDevice handle) {
  VkPhysicalDeviceProperties properties{};
  api.vkGetPhysicalDeviceProperties(handle, &properties);
  PhysicalDevice device;
  device.handle = handle;
  device.type = properties.deviceType;
  device.description = {properties.deviceName, kind_of(properties.deviceType), ""};
  auto family = queue_family(api, handle, VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT);
  device.draws_triangles = family.has_value();
  if (!family) family = queue_family(api, handle, VK_QUEUE_COMPUTE_BIT);
  if (properties.apiVersion < VK_API_VERSION_1_2) {
    device.description.missing = "Vulkan 1.2";
  } else if (!family) {
    device.description.missing = "a compute queue";
  } else if (!has_addresses(api, handle)) {
    device.description.missing = "bufferDeviceAddress";
  }
  VkPhysicalDeviceFeatures features{};
  api.vkGetPhysicalDeviceFeatures(handle, &features);
  device.draws_lines = device.draws_triangles && features.fillModeNonSolid != VK_FALSE;
  device.queue_family = family.value_or(0);
  return device;
}

Result<std::unique_ptr<VulkanInstance>> VulkanInstance::create(MessageListener listener) {
  auto api = Api::load();
  if (!api) return api.error();
  std::unique_ptr<VulkanInstance> instance(new VulkanInstance(*api, std::move(listener)));
  if (Status opened = instance->open(); !opened) return opened.error();
  if (Status listed = instance->list_devices(); !listed) return listed.error();
  return instance;
}

VulkanInstance::~VulkanInstance() {
  if (handle_ == VK_NULL_HANDLE) return;
  if (messenger_ != VK_NULL_HANDLE) {
    const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        api_.vkGetInstanceProcAddr(handle_, "vkDestroyDebugUtilsMessengerEXT"));
    destroy(handle_, messenger_, nullptr);
  }
  api_.vkDestroyInstance(handle_, nullptr);
}

Status VulkanInstance::open() {
  std::uint32_t version = 0;
  if (api_.vkEnumerateInstanceVersion(&version) != VK_SUCCESS || version < VK_API_VERSION_1_2) {
    return refuse("the Vulkan loader is older than version 1.2");
  }
  if (listener_ && !has_validation(api_)) return refuse(std::string(kValidationLayer) + " is not installed");
  auto application = info_of<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
  application.pApplicationName = application.pEngineName = "quoin";
  application.apiVersion = VK_API_VERSION_1_2;
  std::vector<const char*> extensions;
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
  if (const VkResult result = api_.vkCreateInstance(&info, nullptr, &handle_); result != VK_SUCCESS) {
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER) return refuse("no graphics driver found");
    return refuse("cannot create an instance (VkResult " + std::to_string(result) + ")");
  }
  if (const char* missing = api_.load_instance(handle_))
    return refuse(std::string("the Vulkan loader lacks ") + missing);
  return listen();
}

Status VulkanInstance::listen() {
  if (!listener_) return {};
  const VkDebugUtilsMessengerCreateInfoEXT messenger = messenger_info(listener_);
  const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      api_.vkGetInstanceProcAddr(handle_, "vkCreateDebugUtilsMessengerEXT"));
  if (create(handle_, &messenger, nullptr, &messenger_) != VK_SUCCESS)
    return refuse("cannot receive validation messages");
  return {};
}

Status VulkanInstance::list_devices() {
  std::uint32_t count = 0;
  std::vector<VkPhysicalDevice> handles;
  if (api_.vkEnumeratePhysicalDevices(handle_, &count, nullptr) == VK_SUCCESS) {
    handles.resize(count);
    api_.vkEnumeratePhysicalDevices(handle_, &count, handles.data());
    handles.resize(count);
  }
  if (handles.empty()) return refuse("no graphics driver found");
  for (const VkPhysicalDevice handle : handles) devices_.push_back(describe(api_, handle));
  return {};
}

Result<PhysicalDevice> VulkanInstance::choose(const std::string& wanted) const {
  std::vector<VulkanDeviceInfo> descriptions;
  descriptions.reserve(devices_.size());
  for (const PhysicalDevice& device : devices_) descriptions.push_back(device.description);
  const auto chosen = choose_vulkan_device(descriptions, wanted);
  if (!chosen) return chosen.error();
  return devices_[*chosen];
}

}  // namespace quoin::vulkan
