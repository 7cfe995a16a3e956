#include "window_memory.h"

#include <cstring>

namespace quoin::viewer {

namespace {

const char* const kMakingRoom = "allocating memory for a window";

}  // namespace

Status WindowBuffer::put(std::span<const std::byte> bytes) {
  if (bytes.empty()) return {};
  if (size_ < bytes.size()) {
    free();
    if (Status grown = device_->check(grow(bytes.size() * 3 / 2), kMakingRoom); !grown) {
      free();
      return grown;
    }
  }
  std::memcpy(mapped_, bytes.data(), bytes.size());
  return {};
}

VkResult WindowBuffer::grow(VkDeviceSize size) {
  auto info = info_of<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
  info.size = size;
  info.usage = VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT | VK_BUFFER_USAGE_INDEX_BUFFER_BIT;
  VkResult result = vkCreateBuffer(device_->handle(), &info, nullptr, &handle_);
  if (result != VK_SUCCESS) return result;
  VkMemoryRequirements needs{};
  vkGetBufferMemoryRequirements(device_->handle(), handle_, &needs);
  auto flags = info_of<VkMemoryAllocateFlagsInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO);
  flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
  auto memory = info_of<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
  memory.pNext = &flags;
  memory.allocationSize = needs.size;
  memory.memoryTypeIndex = device_->memory_type(
      needs.memoryTypeBits, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
  result = vkAllocateMemory(device_->handle(), &memory, nullptr, &memory_);
  if (result == VK_SUCCESS) result = vkBindBufferMemory(device_->handle(), handle_, memory_, 0);
  void* mapped = nullptr;
  if (result == VK_SUCCESS) result = vkMapMemory(device_->handle(), memory_, 0, VK_WHOLE_SIZE, 0, &mapped);
  if (result != VK_SUCCESS) return result;
  mapped_ = static_cast<std::byte*>(mapped);
  auto address = info_of<VkBufferDeviceAddressInfo>(VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO);
  address.buffer = handle_;
  address_ = vkGetBufferDeviceAddress(device_->handle(), &address);
  size_ = size;
  return VK_SUCCESS;
}

void WindowBuffer::free() {
  if (handle_ != VK_NULL_HANDLE) vkDestroyBuffer(device_->handle(), handle_, nullptr);
  if (memory_ != VK_NULL_HANDLE) vkFreeMemory(device_->handle(), memory_, nullptr);
  handle_ = VK_NULL_HANDLE;
  memory_ = VK_NULL_HANDLE;
  size_ = 0;
}

Result<bool> CopiedImage::fit(int width, int height) {
  if (width == width_ && height == height_) return false;
  free();
  if (Status made = device_->check(make(width, height), kMakingRoom); !made) {
    free();
    return made.error();
  }
  width_ = width;
  height_ = height;
  return true;
}

VkResult CopiedImage::make(int width, int height) {
  auto info = info_of<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = kFormat;
  info.extent = {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 1};
  info.mipLevels = info.arrayLayers = 1;
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_SAMPLED_BIT;
  VkResult result = vkCreateImage(device_->handle(), &info, nullptr, &image_);
  if (result != VK_SUCCESS) return result;
  VkMemoryRequirements needs{};
  vkGetImageMemoryRequirements(device_->handle(), image_, &needs);
  auto memory = info_of<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
  memory.allocationSize = needs.size;
  memory.memoryTypeIndex = device_->memory_type(needs.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  result = vkAllocateMemory(device_->handle(), &memory, nullptr, &memory_);
  if (result == VK_SUCCESS) result = vkBindImageMemory(device_->handle(), image_, memory_, 0);
  if (result != VK_SUCCESS) return result;
  auto view = info_of<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
  view.image = image_;
  view.viewType = VK_IMAGE_VIEW_TYPE_2D;
  view.format = kFormat;
  view.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  return vkCreateImageView(device_->handle(), &view, nullptr, &view_);
}

void CopiedImage::free() {
  if (view_ != VK_NULL_HANDLE) vkDestroyImageView(device_->handle(), view_, nullptr);
  if (image_ != VK_NULL_HANDLE) vkDestroyImage(device_->handle(), image_, nullptr);
  if (memory_ != VK_NULL_HANDLE) vkFreeMemory(device_->handle(), memory_, nullptr);
  view_ = VK_NULL_HANDLE;
  image_ = VK_NULL_HANDLE;
  memory_ = VK_NULL_HANDLE;
  width_ = height_ = 0;
}

VulkanImageTarget CopiedImage::target() const {
  VulkanImageTarget target;
  target.image = image_;
  target.format = kFormat;
  target.width = width_;
  target.height = height_;
  target.layout_before = VK_IMAGE_LAYOUT_UNDEFINED;
  target.layout_after = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
  return target;
}

}  // namespace quoin::viewer
