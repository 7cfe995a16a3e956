#include "copied_image.h"

namespace quoin::viewer {

namespace {

constexpr VkFormat kUnchangedBytes = VK_FORMAT_R8G8B8A8_UNORM;

}  // namespace

Status CopiedImage::fit(int width, int height) {
  if (width == width_ && height == height_) return {};
  free();
  if (Status made = device_->check(make(width, height), "allocating memory for a window"); !made) {
    free();
    return made;
  }
  width_ = width;
  height_ = height;
  return {};
}

VkResult CopiedImage::make(int width, int height) {
  auto info = info_of<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = kUnchangedBytes;
  info.extent = {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 1};
  info.mipLevels = info.arrayLayers = 1;
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
  VkResult result = vkCreateImage(device_->handle(), &info, nullptr, &image_);
  if (result != VK_SUCCESS) return result;
  VkMemoryRequirements needs{};
  vkGetImageMemoryRequirements(device_->handle(), image_, &needs);
  auto memory = info_of<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
  memory.allocationSize = needs.size;
  memory.memoryTypeIndex = device_->memory_type(needs.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  result = vkAllocateMemory(device_->handle(), &memory, nullptr, &memory_);
  return result == VK_SUCCESS ? vkBindImageMemory(device_->handle(), image_, memory_, 0) : result;
}

void CopiedImage::free() {
  if (image_ != VK_NULL_HANDLE) vkDestroyImage(device_->handle(), image_, nullptr);
  if (memory_ != VK_NULL_HANDLE) vkFreeMemory(device_->handle(), memory_, nullptr);
  image_ = VK_NULL_HANDLE;
  memory_ = VK_NULL_HANDLE;
  width_ = height_ = 0;
}

VulkanImageTarget CopiedImage::target() const {
  VulkanImageTarget target;
  target.image = image_;
  target.format = kUnchangedBytes;
  target.width = width_;
  target.height = height_;
  target.layout_before = VK_IMAGE_LAYOUT_UNDEFINED;
  target.layout_after = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
  return target;
}

}  // namespace quoin::viewer
