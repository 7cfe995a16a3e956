// In place of everything else in this folder where the library is built without Vulkan.

#include <quoin/render_vk/vulkan_renderer.h>

namespace quoin {
namespace {

tl::unexpected<Error> refusal() {
  return fail(ErrorCode::Unsupported, "vulkan: this build is without it: " QUOIN_VULKAN_MISSING);
}

}  // namespace

struct VulkanRenderer::Impl {
  VulkanDevice device;
};

VulkanRenderer::VulkanRenderer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VulkanRenderer::VulkanRenderer(VulkanRenderer&&) noexcept = default;
VulkanRenderer& VulkanRenderer::operator=(VulkanRenderer&&) noexcept = default;
VulkanRenderer::~VulkanRenderer() = default;

Result<std::vector<VulkanDevice>> vulkan_devices() {
  return refusal();
}
Result<VulkanRenderer> VulkanRenderer::create(const VulkanOptions&) {
  return refusal();
}
const VulkanDevice& VulkanRenderer::device() const {
  return impl_->device;
}
Status VulkanRenderer::update(const Scene&, bool, Threads) {
  return refusal();
}
std::uint64_t VulkanRenderer::uploaded_bytes() const {
  return 0;
}
Result<Picture> VulkanRenderer::render(const Camera&, const RenderOptions&, const Progress&) {
  return refusal();
}

}  // namespace quoin
