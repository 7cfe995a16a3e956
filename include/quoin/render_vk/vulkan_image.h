#pragma once

#include <cstdint>

#include <quoin/render_vk/vulkan_handles.h>

namespace quoin {

/// A VkImage of a program, as a picture is put into it (VulkanPicture::record_copy), and where.
///
/// The image is two-dimensional, of one sample, made with VK_IMAGE_USAGE_TRANSFER_DST_BIT on the renderer's device, and
/// belongs to the queue family that the commands run on.
struct VulkanImageTarget {
  VulkanImageHandle image{};  ///< VkImage
  /// VkFormat: VK_FORMAT_R8G8B8A8_UNORM or _SRGB, VK_FORMAT_B8G8R8A8_UNORM or _SRGB. Bytes are the picture's, which are
  /// sRGB, in each of them.
  std::uint32_t format = 0;
  int width = 0;  ///< of the mip level, in pixels
  int height = 0;
  int x = 0;  ///< the pixel that the picture's upper left one becomes; all of the picture lies in the image
  int y = 0;
  std::uint32_t mip_level = 0;
  std::uint32_t array_layer = 0;
  std::uint32_t layout_before = 0;  ///< VkImageLayout that it is in. VK_IMAGE_LAYOUT_UNDEFINED (0): all else may go
  std::uint32_t layout_after = 0;   ///< VkImageLayout that it is left in; not UNDEFINED or PREINITIALIZED
};

}  // namespace quoin
