#pragma once

#include <quoin/render_vk/vulkan_image.h>
#include <quoin/render_vk/vulkan_renderer.h>

namespace quoin::vulkan {

using RendererImpl = VulkanRenderer::Impl;
using ImageImpl = VulkanImage::Impl;
using PathImageImpl = VulkanPathImage::Impl;

}  // namespace quoin::vulkan
