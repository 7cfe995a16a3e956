#pragma once

#include "render_vk/device/memory.h"

namespace quoin::vulkan {

/// What is drawn to: an image of one layer with memory of its own.
class Attachment {
 public:
  struct Kind {
    VkFormat format = VK_FORMAT_UNDEFINED;
    VkImageUsageFlags usage = 0;
    VkImageAspectFlags aspect = 0;
  };

  Attachment() = default;
  /// Errors: LimitExceeded when the device's memory is full.
  [[nodiscard]] static Result<Attachment> create(const Device& device, const Kind& kind, VkExtent2D size,
                                                 std::uint32_t samples, const std::string& doing);
  Attachment(Attachment&& other) noexcept { swap(other); }
  Attachment& operator=(Attachment&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Attachment();

  [[nodiscard]] VkImage image() const { return image_; }
  [[nodiscard]] VkImageView view() const { return view_; }

 private:
  void swap(Attachment& other) noexcept;

  const Device* device_ = nullptr;
  VkImage image_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  VkImageView view_ = VK_NULL_HANDLE;
};

}  // namespace quoin::vulkan
