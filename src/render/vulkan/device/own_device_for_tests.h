#pragma once

// A device that a test makes by Vulkan alone, as programs do that draw by Vulkan themselves; and images on it.

#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/render/vulkan_device.h>
#include <quoin/render/vulkan_image.h>

#include "render/vulkan/device/device.h"

namespace quoin::vulkan_test {

using vulkan::Api;
using vulkan::info_of;

/// An instance with the validation layer if installed, the first suitable device, and a queue.
class OwnDevice {
 public:
  /// Returns null and sets `why` if there is no suitable device.
  static std::unique_ptr<OwnDevice> create(std::string& why) {
    auto api = Api::load();
    if (!api) return why = api.error().message, nullptr;
    std::unique_ptr<OwnDevice> made(new OwnDevice(*api));
    if (!made->make_instance(true) && !made->make_instance(false)) return why = "no instance", nullptr;
    if (!made->make_device()) return why = "no device that lacks nothing", nullptr;
    return made;
  }
  ~OwnDevice() {
    if (device != VK_NULL_HANDLE) {
      api.vkDeviceWaitIdle(device);
      api.vkDestroyCommandPool(device, pool_, nullptr);
      api.vkDestroyDevice(device, nullptr);
    }
    if (messenger_ != VK_NULL_HANDLE) {
      reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
          api.vkGetInstanceProcAddr(instance, "vkDestroyDebugUtilsMessengerEXT"))(instance, messenger_, nullptr);
    }
    if (instance != VK_NULL_HANDLE) api.vkDestroyInstance(instance, nullptr);
    for (const std::string& message : messages_) ADD_FAILURE() << message;
  }
  OwnDevice(const OwnDevice&) = delete;
  OwnDevice& operator=(const OwnDevice&) = delete;

  [[nodiscard]] BorrowedVulkanDevice lent() {
    BorrowedVulkanDevice lent;
    lent.instance = instance;
    lent.physical_device = physical;
    lent.device = device;
    lent.queue = queue;
    lent.queue_family = family;
    lent.with_queue = [this](const std::function<void()>& use) {
      const std::lock_guard lock(queue_mutex);
      use();
    };
    return lent;
  }

  /// Has commands run, of a command buffer of its own, and waits for them.
  template <class Record>
  void run(const Record& record) {
    auto allocate = info_of<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
    allocate.commandPool = pool_;
    allocate.commandBufferCount = 1;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    ASSERT_EQ(api.vkAllocateCommandBuffers(device, &allocate, &commands), VK_SUCCESS);
    const auto begin = info_of<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    ASSERT_EQ(api.vkBeginCommandBuffer(commands, &begin), VK_SUCCESS);
    record(commands);
    ASSERT_EQ(api.vkEndCommandBuffer(commands), VK_SUCCESS);
    auto submit = info_of<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &commands;
    const auto fence_info = info_of<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
    VkFence fence = VK_NULL_HANDLE;
    ASSERT_EQ(api.vkCreateFence(device, &fence_info, nullptr, &fence), VK_SUCCESS);
    {
      const std::lock_guard lock(queue_mutex);
      ASSERT_EQ(api.vkQueueSubmit(queue, 1, &submit, fence), VK_SUCCESS);
    }
    EXPECT_EQ(api.vkWaitForFences(device, 1, &fence, VK_TRUE, std::numeric_limits<std::uint64_t>::max()), VK_SUCCESS);
    api.vkDestroyFence(device, fence, nullptr);
    api.vkResetCommandPool(device, pool_, 0);
  }

  [[nodiscard]] VkDeviceMemory allocate(const VkMemoryRequirements& needs, VkMemoryPropertyFlags wanted) const {
    VkPhysicalDeviceMemoryProperties kinds{};
    api.vkGetPhysicalDeviceMemoryProperties(physical, &kinds);
    auto info = info_of<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
    info.allocationSize = needs.size;
    while ((needs.memoryTypeBits >> info.memoryTypeIndex & 1U) == 0 ||
           (kinds.memoryTypes[info.memoryTypeIndex].propertyFlags & wanted) != wanted) {
      ++info.memoryTypeIndex;
    }
    VkDeviceMemory memory = VK_NULL_HANDLE;
    EXPECT_EQ(api.vkAllocateMemory(device, &info, nullptr, &memory), VK_SUCCESS);
    return memory;
  }

  // NOLINTBEGIN(readability-identifier-naming): public members for tests
  Api api;
  VkInstance instance = VK_NULL_HANDLE;
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  VkQueue queue = VK_NULL_HANDLE;
  std::uint32_t family = 0;
  std::mutex queue_mutex;
  // NOLINTEND(readability-identifier-naming)

 private:
  explicit OwnDevice(const Api& loaded) : api(loaded) {}

  static VKAPI_ATTR VkBool32 VKAPI_CALL hear(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                             const VkDebugUtilsMessengerCallbackDataEXT* data, void* device) {
    auto& me = *static_cast<OwnDevice*>(device);
    const std::lock_guard lock(me.messages_mutex_);
    me.messages_.emplace_back(data->pMessage);
    return VK_FALSE;
  }

  bool make_instance(bool is_validated) {
    auto application = info_of<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
    application.apiVersion = vulkan_requirements().api_version;
    auto info = info_of<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
    info.pApplicationInfo = &application;
    const char* const layer = "VK_LAYER_KHRONOS_validation";
    const char* const extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
    if (is_validated) {
      info.enabledLayerCount = info.enabledExtensionCount = 1;
      info.ppEnabledLayerNames = &layer;
      info.ppEnabledExtensionNames = &extension;
    }
    if (api.vkCreateInstance(&info, nullptr, &instance) != VK_SUCCESS) return false;
    if (api.load_instance(instance) != nullptr) return false;
    if (!is_validated) return true;
    auto messenger =
        info_of<VkDebugUtilsMessengerCreateInfoEXT>(VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
    messenger.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    messenger.messageType =
        VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
    messenger.pfnUserCallback = hear;
    messenger.pUserData = this;
    return reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(api.vkGetInstanceProcAddr(
               instance, "vkCreateDebugUtilsMessengerEXT"))(instance, &messenger, nullptr, &messenger_) == VK_SUCCESS;
  }

  bool make_device() {
    std::uint32_t count = 0;
    api.vkEnumeratePhysicalDevices(instance, &count, nullptr);
    std::vector<VkPhysicalDevice> all(count);
    api.vkEnumeratePhysicalDevices(instance, &count, all.data());
    for (const VkPhysicalDevice one : all) {
      const auto description = describe_vulkan_device(instance, one);
      if (physical == VK_NULL_HANDLE && description && description->missing.empty()) physical = one;
    }
    if (physical == VK_NULL_HANDLE) return false;
    api.vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    api.vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families.data());
    constexpr VkQueueFlags kWanted = VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT;
    while (family < count && (families[family].queueFlags & kWanted) != kWanted) ++family;
    if (family == count) return false;
    const float priority = 1.0F;
    auto queues = info_of<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
    queues.queueFamilyIndex = family;
    queues.queueCount = 1;
    queues.pQueuePriorities = &priority;
    auto info = info_of<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
    info.queueCreateInfoCount = 1;
    info.pQueueCreateInfos = &queues;
    VulkanFeatureStorage storage;
    EXPECT_TRUE(enable_vulkan_features(info, storage));
    if (api.vkCreateDevice(physical, &info, nullptr, &device) != VK_SUCCESS) return false;
    if (api.load_device(device) != nullptr) return false;
    api.vkGetDeviceQueue(device, family, 0, &queue);
    auto pool = info_of<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
    pool.queueFamilyIndex = family;
    return api.vkCreateCommandPool(device, &pool, nullptr, &pool_) == VK_SUCCESS;
  }

  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  std::mutex messages_mutex_;
  std::vector<std::string> messages_;
};

/// An image of two mip levels and two layers, with read access to its bytes.
class OwnImage {
 public:
  OwnImage(OwnDevice& device, VkFormat format, int width, int height)
      : device_(&device), format_(format), width_(width), height_(height) {
    auto info = info_of<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = format;
    info.extent = {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 1};
    info.mipLevels = info.arrayLayers = 2;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
    EXPECT_EQ(device.api.vkCreateImage(device.device, &info, nullptr, &image_), VK_SUCCESS);
    VkMemoryRequirements needs{};
    device.api.vkGetImageMemoryRequirements(device.device, image_, &needs);
    memory_ = device.allocate(needs, 0);
    EXPECT_EQ(device.api.vkBindImageMemory(device.device, image_, memory_, 0), VK_SUCCESS);
    make_buffer();
  }
  ~OwnImage() {
    const Api& api = device_->api;
    api.vkDestroyImage(device_->device, image_, nullptr);
    api.vkFreeMemory(device_->device, memory_, nullptr);
    api.vkDestroyBuffer(device_->device, buffer_, nullptr);
    api.vkFreeMemory(device_->device, buffer_memory_, nullptr);
  }
  OwnImage(const OwnImage&) = delete;
  OwnImage& operator=(const OwnImage&) = delete;

  /// The whole of a level, from UNDEFINED to be read.
  [[nodiscard]] VulkanImageTarget target(std::uint32_t level = 0, std::uint32_t layer = 0) const {
    VulkanImageTarget target;
    target.image = image_;
    target.format = format_;
    target.width = std::max(width_ >> level, 1);
    target.height = std::max(height_ >> level, 1);
    target.mip_level = level;
    target.array_layer = layer;
    target.layout_before = VK_IMAGE_LAYOUT_UNDEFINED;
    target.layout_after = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
    return target;
  }

  /// Returns the bytes of a level in VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, red first in any format.
  [[nodiscard]] std::vector<std::uint8_t> read(const VulkanImageTarget& level) {
    const std::vector<std::uint8_t> bytes = [&] {
      device_->run([&](VkCommandBuffer commands) {
        const VkBufferImageCopy all = whole(level);
        device_->api.vkCmdCopyImageToBuffer(commands, image_, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, buffer_, 1, &all);
      });
      return std::vector<std::uint8_t>(mapped_, mapped_ + byte_count(level));
    }();
    return red_first(bytes);
  }
  /// Gives a level these bytes and leaves it in VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL.
  void write(const VulkanImageTarget& level, const std::vector<std::uint8_t>& bytes) {
    const std::vector<std::uint8_t> ordered = red_first(bytes);
    std::memcpy(mapped_, ordered.data(), ordered.size());
    device_->run([&](VkCommandBuffer commands) {
      auto barrier = info_of<VkImageMemoryBarrier>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER);
      barrier.dstAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
      barrier.newLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
      barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
      barrier.image = image_;
      barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, level.mip_level, 1, level.array_layer, 1};
      device_->api.vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT, 0,
                                        0, nullptr, 0, nullptr, 1, &barrier);
      const VkBufferImageCopy all = whole(level);
      device_->api.vkCmdCopyBufferToImage(commands, buffer_, image_, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &all);
    });
  }

 private:
  static std::size_t byte_count(const VulkanImageTarget& level) {
    return std::size_t{4} * static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height);
  }
  static VkBufferImageCopy whole(const VulkanImageTarget& level) {
    VkBufferImageCopy all{};
    all.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, level.mip_level, level.array_layer, 1};
    all.imageExtent = {static_cast<std::uint32_t>(level.width), static_cast<std::uint32_t>(level.height), 1};
    return all;
  }
  [[nodiscard]] std::vector<std::uint8_t> red_first(std::vector<std::uint8_t> bytes) const {
    const bool is_swapped = format_ == VK_FORMAT_B8G8R8A8_UNORM || format_ == VK_FORMAT_B8G8R8A8_SRGB;
    for (std::size_t i = 0; is_swapped && i < bytes.size(); i += 4) std::swap(bytes[i], bytes[i + 2]);
    return bytes;
  }
  void make_buffer() {
    const Api& api = device_->api;
    auto info = info_of<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
    info.size = byte_count(target());
    info.usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT;
    EXPECT_EQ(api.vkCreateBuffer(device_->device, &info, nullptr, &buffer_), VK_SUCCESS);
    VkMemoryRequirements needs{};
    api.vkGetBufferMemoryRequirements(device_->device, buffer_, &needs);
    buffer_memory_ =
        device_->allocate(needs, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    EXPECT_EQ(api.vkBindBufferMemory(device_->device, buffer_, buffer_memory_, 0), VK_SUCCESS);
    void* mapped = nullptr;
    EXPECT_EQ(api.vkMapMemory(device_->device, buffer_memory_, 0, VK_WHOLE_SIZE, 0, &mapped), VK_SUCCESS);
    mapped_ = static_cast<std::uint8_t*>(mapped);
  }

  OwnDevice* device_;
  VkFormat format_;
  int width_;
  int height_;
  VkImage image_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory buffer_memory_ = VK_NULL_HANDLE;
  std::uint8_t* mapped_ = nullptr;
};

}  // namespace quoin::vulkan_test
