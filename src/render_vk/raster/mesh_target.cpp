#include "render_vk/raster/mesh_target.h"

#include <array>
#include <utility>

#include "render_vk/raster/mesh_pipelines.h"

namespace quoin::vulkan {

Result<MeshTarget> MeshTarget::create(const Device& device, VkRenderPass pass, VkExtent2D size, std::uint32_t samples) {
  const std::string doing = "making room for a picture";
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
