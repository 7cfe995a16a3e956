#pragma once

#include <quoin/render_vk/vulkan_picture.h>
#include <quoin/render_vk/vulkan_renderer.h>

namespace quoin::vulkan {

/// What the public classes of this layer keep from everybody else.
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
