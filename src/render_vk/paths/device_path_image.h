#pragma once

#include <cstdint>

#include <quoin/scene/camera.h>

#include "render_vk/device/access.h"
#include "render_vk/device/memory.h"

namespace quoin {

/// The device state of a VulkanPathImage.
struct VulkanPathImage::Impl {
  explicit Impl(vulkan::Device& of_device) : device(&of_device) {}

  /// Allocates an empty image. Errors: LimitExceeded; the image then has no memory.
  [[nodiscard]] Status begin(const Camera& of_camera, const PathOptions& with_options);

  vulkan::Device* device;
  int samples = 0;
  std::int64_t rays = 0;
  // The camera of its samples.
  Camera camera;
  PathOptions options;
  vulkan::Buffer sums;   ///< vectors of four floats per pixel: path_data.glsl
  vulkan::Buffer parts;  ///< of surfaces, for the denoiser
};

}  // namespace quoin
