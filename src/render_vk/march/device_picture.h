#pragma once

#include <cstdint>

#include <quoin/render_vk/vulkan_picture.h>

#include "render_vk/device/memory.h"

namespace quoin {

/// What VulkanPicture is to those who draw it: a word a pixel, row by row, sRGB bytes with red the lowest.
struct VulkanPicture::Impl {
  explicit Impl(vulkan::Device& of_device) : device(&of_device) {}

  /// Room for that many pixels, whose contents mean nothing then if the size is another. Errors: LimitExceeded.
  [[nodiscard]] Status resize(int new_width, int new_height);
  /// The same for `sums`, and nothing was drawn so far. Errors: LimitExceeded.
  [[nodiscard]] Status begin_sums();

  vulkan::Device* device;
  int width = 0;
  int height = 0;
  int samples = 0;
  std::int64_t rays = 0;
  vulkan::Buffer colours;
  vulkan::Buffer sums;  ///< of the samples' light, four floats a pixel; only where samples are added one by one
};

}  // namespace quoin
