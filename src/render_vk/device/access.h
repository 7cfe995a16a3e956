#pragma once

#include <quoin/render_vk/vulkan_picture.h>
#include <quoin/render_vk/vulkan_renderer.h>

namespace quoin::vulkan {

using RendererImpl = VulkanRenderer::Impl;
using PictureImpl = VulkanPicture::Impl;
using PathPictureImpl = VulkanPathPicture::Impl;

}  // namespace quoin::vulkan
