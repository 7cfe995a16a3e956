#pragma once

#include "render_vk/device/memory.h"

namespace quoin::vulkan {

/// A render target: an image of one layer with its own memory.
class Attachment {
 public:
  struct Kind {
    VkFormat format = VK_FORMAT_UNDEFINED;
    VkImageUsageFlags usage = 0;
    VkImageAspectFlags aspect = 0;
  };

  Attachment() = default;
  /// Errors: LimitExceeded if the device's memory is full.
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

/// The render targets for an image of meshes.
class MeshTarget {
 public:
  MeshTarget() = default;
  /// `pass`: of MeshPipelines, for that many samples. Errors: LimitExceeded.
  [[nodiscard]] static Result<MeshTarget> create(const Device& device, VkRenderPass pass, VkExtent2D size,
                                                 std::uint32_t samples);
  MeshTarget(MeshTarget&& other) noexcept { swap(other); }
  MeshTarget& operator=(MeshTarget&& other) noexcept {
    swap(other);
    return *this;
  }
  ~MeshTarget();

  [[nodiscard]] bool is_of(VkExtent2D size, std::uint32_t samples) const {
    return framebuffer_ != VK_NULL_HANDLE && size_.width == size.width && size_.height == size.height &&
           samples_ == samples;
  }
  [[nodiscard]] VkExtent2D size() const { return size_; }
  [[nodiscard]] std::uint32_t samples() const { return samples_; }
  [[nodiscard]] VkFramebuffer framebuffer() const { return framebuffer_; }
  /// Returns the drawn image, with one sample per pixel.
  [[nodiscard]] VkImage image() const { return samples_ > 1 ? resolved_.image() : colour_.image(); }

 private:
  void swap(MeshTarget& other) noexcept;

  const Device* device_ = nullptr;
  VkExtent2D size_{};
  std::uint32_t samples_ = 0;
  Attachment colour_;
  Attachment depth_;
  Attachment resolved_;  // with several samples
  VkFramebuffer framebuffer_ = VK_NULL_HANDLE;
};

}  // namespace quoin::vulkan
