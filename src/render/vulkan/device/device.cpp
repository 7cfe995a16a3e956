#include "render/vulkan/device/device.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <new>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/render/vulkan_device.h>

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

namespace {

Status check_handles(const BorrowedVulkanDevice& lent) {
  const std::array<std::pair<const void*, const char*>, 4> handles = {
      std::pair{static_cast<const void*>(lent.instance), "instance"},
      std::pair{static_cast<const void*>(lent.physical_device), "physical device"},
      std::pair{static_cast<const void*>(lent.device), "device"},
      std::pair{static_cast<const void*>(lent.queue), "queue"}};
  for (const auto& [handle, name] : handles) {
    if (handle == nullptr)
      return make_error(ErrorCode::InvalidArgument, std::string("vulkan: the ") + name + " is null");
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<Device>> Device::create(const VulkanOptions& options) {
  auto instance = VulkanInstance::create(options.on_validation_message);
  if (!instance) return instance.error();
  const auto physical = (*instance)->choose(options.device);
  if (!physical) return physical.error();
  std::unique_ptr<Device> device(new Device());
  device->instance_ = std::move(*instance);
  if (Status opened = device->open(*physical); !opened) return opened.error();
  return device;
}

Result<std::unique_ptr<Device>> Device::borrow(const BorrowedVulkanDevice& lent) {
  std::unique_ptr<Device> device(new Device());
  if (Status adopted = device->adopt(lent); !adopted) return adopted.error();
  return device;
}

Status Device::open(const PhysicalDevice& physical) {
  api_ = instance_->api();
  physical_ = physical;
  const float priority = 1.0F;
  auto queue = info_of<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
  queue.queueFamilyIndex = physical.queue_family;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  auto info = info_of<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  VkPhysicalDeviceFeatures features{};
  features.fillModeNonSolid = physical.draws_lines ? VK_TRUE : VK_FALSE;
  info.pEnabledFeatures = &features;
  VulkanFeatureStorage storage;
  if (Status enabled = enable_vulkan_features(info, storage); !enabled) return enabled;
  const VkResult result = api_.vkCreateDevice(physical.handle, &info, nullptr, &handle_);
  if (result != VK_SUCCESS) return check(result, "starting");
  return start();
}

Status Device::adopt(const BorrowedVulkanDevice& lent) {
  if (Status whole = check_handles(lent); !whole) return whole;
  auto api = Api::find(lent.get_instance_proc_addr);
  if (!api) return api.error();
  api_ = *api;
  if (const char* missing = api_.load_instance(lent.instance))
    return refuse(std::string("the instance lacks ") + missing);
  physical_ = describe(api_, lent.physical_device);
  const VulkanDeviceInfo& description = physical_.description;
  if (!description.missing.empty()) return refuse(description.name + " lacks " + description.missing);
  const VkQueueFlags can = queue_flags(api_, lent.physical_device, lent.queue_family);
  if (can == 0) {
    const std::string family = std::to_string(lent.queue_family);
    return make_error(ErrorCode::InvalidArgument, "vulkan: " + description.name + " has no queue family " + family);
  }
  if ((can & VK_QUEUE_COMPUTE_BIT) == 0) return refuse(description.name + ": the queue does not support compute");
  physical_.queue_family = lent.queue_family;
  physical_.draws_triangles = (can & VK_QUEUE_GRAPHICS_BIT) != 0;
  physical_.draws_lines = physical_.draws_triangles && lent.fill_mode_non_solid;
  queue_ = lent.queue;
  with_queue_ = lent.with_queue;
  handle_ = lent.device;
  return start();
}

// Initialises the device, owned or borrowed.
Status Device::start() {
  if (const char* missing = api_.load_device(handle_)) return refuse(description().name + " lacks " + missing);
  api_.vkGetPhysicalDeviceMemoryProperties(physical_.handle, &memory_);
  if (instance_) api_.vkGetDeviceQueue(handle_, physical_.queue_family, 0, &queue_);
  return check(make_commands(), "starting");
}

VkResult Device::make_commands() {
  auto pool = info_of<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
  pool.queueFamilyIndex = physical_.queue_family;
  VkResult result = api_.vkCreateCommandPool(handle_, &pool, nullptr, &pool_);
  if (result != VK_SUCCESS) return result;
  auto buffer = info_of<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
  buffer.commandPool = pool_;
  buffer.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  buffer.commandBufferCount = 1;
  result = api_.vkAllocateCommandBuffers(handle_, &buffer, &commands_);
  if (result != VK_SUCCESS) return result;
  const auto fence = info_of<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
  return api_.vkCreateFence(handle_, &fence, nullptr, &fence_);
}

Device::~Device() {
  if (handle_ == VK_NULL_HANDLE) return;
  // Waits only on an owned device: the owner of a borrowed one must not be blocked, and all commands submitted here
  // have completed.
  if (instance_) api_.vkDeviceWaitIdle(handle_);
  if (fence_ != VK_NULL_HANDLE) api_.vkDestroyFence(handle_, fence_, nullptr);
  if (pool_ != VK_NULL_HANDLE) api_.vkDestroyCommandPool(handle_, pool_, nullptr);
  if (instance_) api_.vkDestroyDevice(handle_, nullptr);
}

Error Device::error_of(VkResult result, const std::string& doing) const {
  const std::string who = "vulkan: " + description().name + ": ";
  switch (result) {
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return {ErrorCode::LimitExceeded, who + "out of device memory while " + doing, {}, {}};
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return {ErrorCode::LimitExceeded, who + "out of host memory while " + doing, {}, {}};
    case VK_ERROR_TOO_MANY_OBJECTS:
      return {ErrorCode::LimitExceeded, who + "too many memory allocations while " + doing, {}, {}};
    case VK_ERROR_DEVICE_LOST:
      return {ErrorCode::DeviceLost, who + "the device was lost while " + doing, {}, {}};
    default:
      return {
          ErrorCode::Unsupported, who + "failed while " + doing + " (VkResult " + std::to_string(result) + ")", {}, {}};
  }
}

VkResult Device::submit(const VkSubmitInfo& info) {
  VkResult result = VK_NOT_READY;  // unless it is done
  const auto use = [&] { result = api_.vkQueueSubmit(queue_, 1, &info, fence_); };
  if (with_queue_) {
    with_queue_(use);
  } else {
    use();
  }
  QUOIN_ASSERT(result != VK_NOT_READY, "BorrowedVulkanDevice::with_queue must call its argument");
  return result;
}

Status Device::run(const std::string& doing, const std::function<void(VkCommandBuffer)>& record) {
  auto begin = info_of<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  VkResult result = api_.vkResetCommandPool(handle_, pool_, 0);
  if (result == VK_SUCCESS) result = api_.vkBeginCommandBuffer(commands_, &begin);
  if (result != VK_SUCCESS) return check(result, doing);
  record(commands_);
  separate(commands_);
  result = api_.vkEndCommandBuffer(commands_);
  auto info = info_of<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
  info.commandBufferCount = 1;
  info.pCommandBuffers = &commands_;
  if (result == VK_SUCCESS) result = submit(info);
  if (result != VK_SUCCESS) return check(result, doing);
  result = api_.vkWaitForFences(handle_, 1, &fence_, VK_TRUE, std::numeric_limits<std::uint64_t>::max());
  if (result == VK_SUCCESS) result = api_.vkResetFences(handle_, 1, &fence_);
  return check(result, doing);
}

void Device::separate(VkCommandBuffer commands) const {
  constexpr VkPipelineStageFlags kDevice = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
  auto barrier = info_of<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
  barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_READ_BIT |
                          VK_ACCESS_TRANSFER_WRITE_BIT | VK_ACCESS_HOST_READ_BIT;
  api_.vkCmdPipelineBarrier(commands, kDevice, kDevice | VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier, 0, nullptr, 0,
                            nullptr);
}

VkResult make_shader(const Device& device, std::span<const std::uint32_t> code, VkShaderModule& shader) {
  auto info = info_of<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  info.codeSize = code.size_bytes();
  info.pCode = code.data();
  return device.api().vkCreateShaderModule(device.handle(), &info, nullptr, &shader);
}

VkResult make_compute_pipeline(const Device& device, VkPipelineLayout layout, std::span<const std::uint32_t> code,
                               std::span<const ShaderConstant> constants, VkPipeline& pipeline) {
  std::vector<VkBool32> values;
  std::vector<VkSpecializationMapEntry> entries;
  for (const ShaderConstant& constant : constants) {
    const auto offset = static_cast<std::uint32_t>(values.size() * sizeof(VkBool32));
    entries.push_back({constant.number, offset, sizeof(VkBool32)});
    values.push_back(constant.value ? VK_TRUE : VK_FALSE);
  }
  const VkSpecializationInfo specialization{static_cast<std::uint32_t>(entries.size()), entries.data(),
                                            values.size() * sizeof(VkBool32), values.data()};
  auto info = info_of<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  info.layout = layout;
  info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.pName = "main";
  info.stage.pSpecializationInfo = &specialization;
  VkResult result = make_shader(device, code, info.stage.module);
  if (result != VK_SUCCESS) return result;
  const Api& api = device.api();
  result = api.vkCreateComputePipelines(device.handle(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline);
  api.vkDestroyShaderModule(device.handle(), info.stage.module, nullptr);
  return result;
}

VkResult make_push_layout(const Device& device, VkShaderStageFlags stages, std::uint32_t bytes,
                          VkPipelineLayout& layout) {
  const VkPushConstantRange range{stages, 0, bytes};
  auto info = info_of<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  info.pushConstantRangeCount = 1;
  info.pPushConstantRanges = &range;
  return device.api().vkCreatePipelineLayout(device.handle(), &info, nullptr, &layout);
}

}  // namespace quoin::vulkan

namespace quoin {

using vulkan::Api;

static_assert(std::is_same_v<VulkanImageHandle, VkImage>);
static_assert(std::is_same_v<VulkanGetInstanceProcAddr, PFN_vkGetInstanceProcAddr>);
static_assert(std::is_same_v<VulkanFunction, PFN_vkVoidFunction>);

Result<std::vector<VulkanDeviceInfo>> vulkan_devices() {
  const auto instance = vulkan::VulkanInstance::create({});
  if (!instance) return instance.error();
  std::vector<VulkanDeviceInfo> devices;
  for (const vulkan::PhysicalDevice& device : (*instance)->devices()) devices.push_back(device.description);
  return devices;
}

Result<VulkanDeviceInfo> describe_vulkan_device(VkInstance_T* instance, VkPhysicalDevice_T* physical_device,
                                                VulkanGetInstanceProcAddr get_instance_proc_addr) {
  if (instance == nullptr) return make_error(ErrorCode::InvalidArgument, "vulkan: the instance is null");
  if (physical_device == nullptr) return make_error(ErrorCode::InvalidArgument, "vulkan: the physical device is null");
  auto api = Api::find(get_instance_proc_addr);
  if (!api) return api.error();
  if (const char* missing = api->load_instance(instance)) {
    return make_error(ErrorCode::Unsupported, std::string("vulkan: the instance lacks ") + missing);
  }
  return vulkan::describe(*api, physical_device).description;
}

Status enable_vulkan_features(VkDeviceCreateInfo& info, VulkanFeatureStorage& storage) {
  using Addresses = VkPhysicalDeviceBufferDeviceAddressFeatures;
  static_assert(sizeof(Addresses) <= sizeof storage.bytes && alignof(Addresses) <= 8);
  QUOIN_ASSERT(info.sType == VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, "a VkDeviceCreateInfo with its sType set");
  // Vulkan declares extension chains const, although some structures in them are outputs.
  for (auto* one = static_cast<VkBaseOutStructure*>(const_cast<void*>(info.pNext)); one != nullptr; one = one->pNext) {
    if (one->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES) {
      reinterpret_cast<VkPhysicalDeviceVulkan12Features*>(one)->bufferDeviceAddress = VK_TRUE;
      return {};
    }
    if (one->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES) {
      reinterpret_cast<Addresses*>(one)->bufferDeviceAddress = VK_TRUE;
      return {};
    }
  }
  auto* addresses = new (storage.bytes.data()) Addresses{};
  addresses->sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES;
  addresses->pNext = const_cast<void*>(info.pNext);
  addresses->bufferDeviceAddress = VK_TRUE;
  info.pNext = addresses;
  return {};
}

}  // namespace quoin

namespace quoin::vulkan {
namespace {

// The loader stays loaded until the program ends: some drivers fail when they are unloaded.
PFN_vkGetInstanceProcAddr find_loader() {
  for (const char* name : {"libvulkan.so.1", "libvulkan.so"}) {
    void* library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) continue;
    if (void* entry = dlsym(library, "vkGetInstanceProcAddr")) {
      return reinterpret_cast<PFN_vkGetInstanceProcAddr>(entry);
    }
  }
  return nullptr;
}

PFN_vkGetInstanceProcAddr loader() {
  static const PFN_vkGetInstanceProcAddr entry = find_loader();
  return entry;
}

Error no_loader() {
  return make_error(ErrorCode::Unsupported, "vulkan: no Vulkan loader found (libvulkan.so.1, version 1.1 or newer)");
}

}  // namespace

Result<Api> Api::load() {
  Api api;
  api.vkGetInstanceProcAddr = loader();
  bool is_complete = api.vkGetInstanceProcAddr != nullptr;
#define QUOIN_VULKAN_LOAD(name)                                                                        \
  if (is_complete) api.name = reinterpret_cast<PFN_##name>(api.vkGetInstanceProcAddr(nullptr, #name)); \
  is_complete = is_complete && api.name != nullptr;
  QUOIN_VULKAN_OF_LOADER(QUOIN_VULKAN_LOAD)
#undef QUOIN_VULKAN_LOAD
  if (!is_complete) return no_loader();
  return api;
}

Result<Api> Api::find(PFN_vkGetInstanceProcAddr entry) {
  Api api;
  api.vkGetInstanceProcAddr = entry == nullptr ? loader() : entry;
  if (api.vkGetInstanceProcAddr == nullptr) return no_loader();
  return api;
}

const char* Api::load_instance(VkInstance instance) {
  const char* missing = nullptr;
#define QUOIN_VULKAN_LOAD(name)                                                \
  name = reinterpret_cast<PFN_##name>(vkGetInstanceProcAddr(instance, #name)); \
  if ((name) == nullptr && missing == nullptr) missing = #name;
  QUOIN_VULKAN_OF_INSTANCE(QUOIN_VULKAN_LOAD)
#undef QUOIN_VULKAN_LOAD
  return missing;
}

const char* Api::load_device(VkDevice device) {
  const char* missing = nullptr;
#define QUOIN_VULKAN_LOAD(name)                                            \
  name = reinterpret_cast<PFN_##name>(vkGetDeviceProcAddr(device, #name)); \
  if ((name) == nullptr && missing == nullptr) missing = #name;
  QUOIN_VULKAN_OF_DEVICE(QUOIN_VULKAN_LOAD)
#undef QUOIN_VULKAN_LOAD
  return missing;
}

}  // namespace quoin::vulkan
