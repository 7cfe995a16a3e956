#pragma once

#include <quoin/render_vk/vulkan_picture.h>
#include <quoin/render_vk/vulkan_renderer.h>

namespace quoin::vulkan {

/// Gives this layer's sources access to the private parts of its public classes.
struct Access {
  using Renderer = VulkanRenderer::Impl;
  using Picture = VulkanPicture::Impl;
  using PathPicture = VulkanPathPicture::Impl;

  [[nodiscard]] static Renderer& of(VulkanRenderer& renderer) { return *renderer.impl_; }
  [[nodiscard]] static Picture& of(VulkanPicture& picture) { return *picture.impl_; }
  [[nodiscard]] static PathPicture& of(VulkanPathPicture& picture) { return *picture.impl_; }
};

using RendererImpl = Access::Renderer;
using PictureImpl = Access::Picture;
using PathPictureImpl = Access::PathPicture;

}  // namespace quoin::vulkan
