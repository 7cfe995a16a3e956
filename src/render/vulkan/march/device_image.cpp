#include "render/vulkan/march/device_image.h"

#include <cstring>
#include <string>
#include <utility>

#include <quoin/core/assert.h>

#include "render/vulkan/march/renderer_impl.h"

namespace quoin {
namespace {

const char* const kAllocating = "allocating an image";

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
  auto made = vulkan::Buffer::create(*device, bytes, vulkan::Buffer::Where::Device, kAllocating);
  if (!made) return made.error();
  colours = std::move(*made);
  width = new_width;
  height = new_height;
  return {};
}

Status VulkanImage::Impl::begin_sums(const Camera& of_camera, const RenderOptions& options) {
  QUOIN_ASSERT(colours.handle() != VK_NULL_HANDLE, "an image with pixels");
  samples = 0;
  rays = 0;
  camera = of_camera;
  light = options.light;
  environment = options.environment;
  if (sums.handle() != VK_NULL_HANDLE) return {};
  auto made = vulkan::Buffer::create(*device, colours.size() * 4, vulkan::Buffer::Where::Device, kAllocating);
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
  auto staging = vulkan::Buffer::create(device, impl_->colours.size(), vulkan::Buffer::Where::Upload, kAllocating);
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

namespace {

using vulkan::info_of;

const char* const kCopying = "copying to an image";

// Copies an image into a Vulkan image of the calling program.

Error wrong(const std::string& message) {
  return make_error(ErrorCode::InvalidArgument, "vulkan: " + message);
}

bool has_red_first(std::uint32_t format) {
  return format == VK_FORMAT_R8G8B8A8_UNORM || format == VK_FORMAT_R8G8B8A8_SRGB;
}
bool has_blue_first(std::uint32_t format) {
  return format == VK_FORMAT_B8G8R8A8_UNORM || format == VK_FORMAT_B8G8R8A8_SRGB;
}

bool is_layout_to_leave(std::uint32_t layout) {
  return layout != VK_IMAGE_LAYOUT_UNDEFINED && layout != VK_IMAGE_LAYOUT_PREINITIALIZED;
}

bool lies_within(int from, int size, int whole) {
  return from >= 0 && std::int64_t{from} + size <= whole;
}

std::string size_text(int width, int height) {
  std::string text = std::to_string(width);
  text += " x ";
  text += std::to_string(height);
  return text;
}

Status check(const VulkanImageTarget& target, int width, int height) {
  if (target.image == VK_NULL_HANDLE) return wrong("the image is null");
  if (!has_red_first(target.format) && !has_blue_first(target.format)) {
    return make_error(ErrorCode::Unsupported,
                      "vulkan: the target must be R8G8B8A8 or B8G8R8A8, UNORM or SRGB, not VkFormat " +
                          std::to_string(target.format));
  }
  if (target.width <= 0 || target.height <= 0)
    return wrong("invalid image size " + size_text(target.width, target.height));
  if (!lies_within(target.x, width, target.width) || !lies_within(target.y, height, target.height)) {
    std::string message = "a drawn image of " + size_text(width, height);
    message += " at (" + std::to_string(target.x) + ", " + std::to_string(target.y);
    message += ") does not fit the target image of " + size_text(target.width, target.height);
    return wrong(message);
  }
  if (!is_layout_to_leave(target.layout_after)) {
    return wrong("layout_after: an image cannot be left in VkImageLayout " + std::to_string(target.layout_after));
  }
  return {};
}

// Waits for all earlier uses of the image, and for drawing to end.
void begin_copy(const vulkan::Api& api, VkCommandBuffer commands, VkImageMemoryBarrier image) {
  auto rendered = info_of<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
  rendered.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
  rendered.dstAccessMask = VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT;
  image.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
  image.dstAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
  image.newLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
  api.vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                           VK_PIPELINE_STAGE_TRANSFER_BIT | VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, 0, 1, &rendered, 0,
                           nullptr, 1, &image);
}

// Makes the copy visible to all later commands.
void end_copy(const vulkan::Api& api, VkCommandBuffer commands, VkImageMemoryBarrier image) {
  image.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
  image.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  image.oldLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
  api.vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 0, nullptr,
                           0, nullptr, 1, &image);
}

}  // namespace

Status VulkanImage::Impl::prepare_copy(const VulkanImageTarget& target) {
  if (samples == 0) return wrong("cannot copy the image: nothing was drawn");
  if (Status right = check(target, width, height); !right) return right;
  if (!has_blue_first(target.format) || swapped.handle() != VK_NULL_HANDLE) return {};
  auto made = vulkan::Buffer::create(*device, colours.size(), vulkan::Buffer::Where::Device, kCopying);
  if (!made) return made.error();
  swapped = std::move(*made);
  return {};
}

void VulkanImage::Impl::record_copy(VkCommandBuffer commands, const VulkanImageTarget& target) const {
  const vulkan::Api& api = device->api();
  auto image = info_of<VkImageMemoryBarrier>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER);
  image.oldLayout = static_cast<VkImageLayout>(target.layout_before);
  image.newLayout = static_cast<VkImageLayout>(target.layout_after);
  image.srcQueueFamilyIndex = image.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  image.image = target.image;
  image.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, target.mip_level, 1, target.array_layer, 1};
  begin_copy(api, commands, image);
  const bool is_swapped = has_blue_first(target.format);
  QUOIN_ASSERT(samples > 0 && (!is_swapped || swapped.handle() != VK_NULL_HANDLE), "a target that was prepared");
  if (is_swapped) {
    const auto pixels = static_cast<std::uint32_t>(width) * static_cast<std::uint32_t>(height);
    pipelines->swap_red_and_blue(commands, {colours.address(), swapped.address(), pixels, 0});
  }
  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, target.mip_level, target.array_layer, 1};
  region.imageOffset = {target.x, target.y, 0};
  region.imageExtent = {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 1};
  api.vkCmdCopyBufferToImage(commands, is_swapped ? swapped.handle() : colours.handle(), target.image,
                             VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
  end_copy(api, commands, image);
}

Status VulkanImage::record_copy(VkCommandBuffer_T* commands, const VulkanImageTarget& target) const {
  if (commands == nullptr) return wrong("the command buffer is null");
  if (Status ready = impl_->prepare_copy(target); !ready) return ready;
  impl_->record_copy(commands, target);
  return {};
}

Status VulkanImage::copy_to(const VulkanImageTarget& target) const {
  if (Status ready = impl_->prepare_copy(target); !ready) return ready;
  return impl_->device->run(kCopying, [&](VkCommandBuffer commands) { impl_->record_copy(commands, target); });
}

}  // namespace quoin
