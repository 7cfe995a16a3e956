#include "render_vk/march/device_image.h"

#include <cstring>
#include <utility>

#include <quoin/core/assert.h>

#include "render_vk/march/renderer_impl.h"

namespace quoin {

namespace {

const char* const kDoing = "allocating an image";

}  // namespace

VulkanImage::VulkanImage(VulkanRenderer& renderer)
    : impl_(std::make_unique<Impl>(*renderer.impl().device, *renderer.impl().pipelines)) {}
VulkanImage::VulkanImage(VulkanImage&&) noexcept = default;
VulkanImage& VulkanImage::operator=(VulkanImage&&) noexcept = default;
VulkanImage::~VulkanImage() = default;

Status VulkanImage::Impl::resize(int new_width, int new_height) {
  QUOIN_ASSERT(new_width > 0 && new_height > 0, "a positive image size");
  if (width == new_width && height == new_height) return {};
  width = height = samples = 0;
  rays = 0;
  colours = {};
  swapped = {};
  sums = {};
  const VkDeviceSize bytes =
      VkDeviceSize{4} * static_cast<VkDeviceSize>(new_width) * static_cast<VkDeviceSize>(new_height);
  auto made = vulkan::Buffer::create(*device, bytes, vulkan::Buffer::Where::Device, kDoing);
  if (!made) return made.error();
  colours = std::move(*made);
  width = new_width;
  height = new_height;
  return {};
}

Status VulkanImage::Impl::begin_sums(const Camera& of_camera, const LightOptions& in_light) {
  QUOIN_ASSERT(colours.handle() != VK_NULL_HANDLE, "an image with pixels");
  samples = 0;
  rays = 0;
  camera = of_camera;
  light = in_light;
  if (sums.handle() != VK_NULL_HANDLE) return {};
  auto made = vulkan::Buffer::create(*device, colours.size() * 4, vulkan::Buffer::Where::Device, kDoing);
  if (!made) return made.error();
  sums = std::move(*made);
  return {};
}

int VulkanImage::width() const {
  return impl_->width;
}
int VulkanImage::height() const {
  return impl_->height;
}
int VulkanImage::samples() const {
  return impl_->samples;
}
std::int64_t VulkanImage::rays() const {
  return impl_->rays;
}
std::size_t VulkanImage::bytes() const {
  return static_cast<std::size_t>(impl_->colours.size() + impl_->swapped.size() + impl_->sums.size());
}

Result<Image> VulkanImage::read() const {
  if (impl_->samples == 0)
    return make_error(ErrorCode::InvalidArgument, "vulkan: cannot read the image: nothing was drawn");
  vulkan::Device& device = *impl_->device;
  auto landing = vulkan::Buffer::create(device, impl_->colours.size(), vulkan::Buffer::Where::Read, "reading an image");
  if (!landing) return landing.error();
  const Status done = device.run("reading an image", [&](VkCommandBuffer commands) {
    const VkBufferCopy all{0, 0, landing->size()};
    device.api().vkCmdCopyBuffer(commands, impl_->colours.handle(), landing->handle(), 1, &all);
  });
  if (!done) return done.error();
  Image image;
  image.width = impl_->width;
  image.height = impl_->height;
  const std::size_t pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  image.rgb.resize(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) std::memcpy(image.rgb.data() + 3 * i, landing->mapped() + 4 * i, 3);
  return image;
}

Status VulkanImage::write(const Image& image) {
  const bool has_pixels = image.width > 0 && image.height > 0;
  const std::size_t pixels =
      has_pixels ? static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) : 0;
  if (pixels == 0 || image.rgb.size() != 3 * pixels) {
    return make_error(ErrorCode::InvalidArgument, "vulkan: the image's size does not match its pixels");
  }
  if (Status sized = impl_->resize(image.width, image.height); !sized) return sized;
  vulkan::Device& device = *impl_->device;
  auto staging = vulkan::Buffer::create(device, impl_->colours.size(), vulkan::Buffer::Where::Upload, kDoing);
  if (!staging) return staging.error();
  std::memset(staging->mapped(), 0xFF, 4 * pixels);  // opaque
  for (std::size_t i = 0; i < pixels; ++i) std::memcpy(staging->mapped() + 4 * i, image.rgb.data() + 3 * i, 3);
  Status done = device.run("uploading an image", [&](VkCommandBuffer commands) {
    const VkBufferCopy all{0, 0, staging->size()};
    device.api().vkCmdCopyBuffer(commands, staging->handle(), impl_->colours.handle(), 1, &all);
  });
  impl_->samples = done ? 1 : 0;
  impl_->rays = 0;
  impl_->sums = {};  // belong to another image
  return done;
}

}  // namespace quoin
