#include "render_vk/raster/mesh_target.h"

#include <array>
#include <utility>

#include <quoin/core/assert.h>

#include "render_vk/raster/mesh_pipelines.h"

namespace quoin::vulkan {
namespace {

VkResult allocate(const Device& device, VkImage image, VkDeviceMemory& memory) {
  VkMemoryRequirements needs{};
  device.api().vkGetImageMemoryRequirements(device.handle(), image, &needs);
  VkResult result = VK_ERROR_OUT_OF_DEVICE_MEMORY;
  for (const VkMemoryPropertyFlags wanted : {VkMemoryPropertyFlags{VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT}, 0U}) {
    const auto type = memory_type(device.memory(), needs.memoryTypeBits, wanted);
    if (!type) continue;
    const std::uint32_t heap = device.memory().memoryTypes[*type].heapIndex;
    if (needs.size > device.memory().memoryHeaps[heap].size) continue;
    const VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, nullptr, needs.size, *type};
    result = device.api().vkAllocateMemory(device.handle(), &info, nullptr, &memory);
    if (result == VK_SUCCESS) return result;
  }
  return result;
}

}  // namespace

Result<Attachment> Attachment::create(const Device& device, const Kind& kind, VkExtent2D size, std::uint32_t samples,
                                      const std::string& doing) {
  const Api& api = device.api();
  Attachment made;
  made.device_ = &device;
  auto info = info_of<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = kind.format;
  info.extent = {size.width, size.height, 1};
  info.mipLevels = 1;
  info.arrayLayers = 1;
  info.samples = static_cast<VkSampleCountFlagBits>(samples);
  info.usage = kind.usage;
  VkResult result = api.vkCreateImage(device.handle(), &info, nullptr, &made.image_);
  if (result == VK_SUCCESS) result = allocate(device, made.image_, made.memory_);
  if (result == VK_SUCCESS) result = api.vkBindImageMemory(device.handle(), made.image_, made.memory_, 0);
  if (result == VK_SUCCESS) {
    auto view = info_of<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
    view.image = made.image_;
    view.viewType = VK_IMAGE_VIEW_TYPE_2D;
    view.format = kind.format;
    view.subresourceRange = {kind.aspect, 0, 1, 0, 1};
    result = api.vkCreateImageView(device.handle(), &view, nullptr, &made.view_);
  }
  if (Status status = device.check(result, doing); !status) return status.error();
  return made;
}

Attachment::~Attachment() {
  if (device_ == nullptr) return;
  const Api& api = device_->api();
  if (view_ != VK_NULL_HANDLE) api.vkDestroyImageView(device_->handle(), view_, nullptr);
  if (image_ != VK_NULL_HANDLE) api.vkDestroyImage(device_->handle(), image_, nullptr);
  if (memory_ != VK_NULL_HANDLE) api.vkFreeMemory(device_->handle(), memory_, nullptr);
}

void Attachment::swap(Attachment& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(image_, other.image_);
  std::swap(memory_, other.memory_);
  std::swap(view_, other.view_);
}

Result<MeshTarget> MeshTarget::create(const Device& device, VkRenderPass pass, VkExtent2D size, std::uint32_t samples) {
  QUOIN_ASSERT(size.width > 0 && size.height > 0 && samples > 0, "a positive size and sample count");
  const std::string doing = "allocating an image";
  constexpr VkImageUsageFlags kColour = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
  const Attachment::Kind drawn{kMeshColour, samples > 1 ? kColour : kColour | VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
                               VK_IMAGE_ASPECT_COLOR_BIT};
  const Attachment::Kind copied{kMeshColour, kColour | VK_IMAGE_USAGE_TRANSFER_SRC_BIT, VK_IMAGE_ASPECT_COLOR_BIT};
  const Attachment::Kind depths{kMeshDepth, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT, VK_IMAGE_ASPECT_DEPTH_BIT};
  MeshTarget made;
  made.device_ = &device;
  made.size_ = size;
  made.samples_ = samples;
  const auto add = [&](Attachment& to, const Attachment::Kind& kind, std::uint32_t count) -> Status {
    auto image = Attachment::create(device, kind, size, count, doing);
    if (!image) return image.error();
    to = std::move(*image);
    return {};
  };
  Status done = add(made.colour_, drawn, samples);
  if (done) done = add(made.depth_, depths, samples);
  if (done && samples > 1) done = add(made.resolved_, copied, 1);
  if (!done) return done.error();
  const std::array views = {made.colour_.view(), made.depth_.view(), made.resolved_.view()};
  auto info = info_of<VkFramebufferCreateInfo>(VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO);
  info.renderPass = pass;
  info.attachmentCount = samples > 1 ? 3 : 2;
  info.pAttachments = views.data();
  info.width = size.width;
  info.height = size.height;
  info.layers = 1;
  const VkResult result = device.api().vkCreateFramebuffer(device.handle(), &info, nullptr, &made.framebuffer_);
  if (Status status = device.check(result, doing); !status) return status.error();
  return made;
}

MeshTarget::~MeshTarget() {
  if (framebuffer_ != VK_NULL_HANDLE) device_->api().vkDestroyFramebuffer(device_->handle(), framebuffer_, nullptr);
}

void MeshTarget::swap(MeshTarget& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(size_, other.size_);
  std::swap(samples_, other.samples_);
  std::swap(colour_, other.colour_);
  std::swap(depth_, other.depth_);
  std::swap(resolved_, other.resolved_);
  std::swap(framebuffer_, other.framebuffer_);
}

}  // namespace quoin::vulkan
