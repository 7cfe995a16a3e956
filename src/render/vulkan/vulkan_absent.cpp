// Replaces the folders of this layer if the library is built without Vulkan.

#include <quoin/render/vulkan_device.h>
#include <quoin/render/vulkan_image.h>
#include <quoin/render/vulkan_mesh_renderer.h>
#include <quoin/render/vulkan_renderer.h>

namespace quoin {
namespace {

Error refusal() {
  return make_error(ErrorCode::Unsupported, "vulkan: not supported by this build: " QUOIN_VULKAN_MISSING);
}

}  // namespace

struct VulkanRenderer::Impl {
  VulkanDeviceInfo device;
};

VulkanRenderer::VulkanRenderer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VulkanRenderer::VulkanRenderer(VulkanRenderer&&) noexcept = default;
VulkanRenderer& VulkanRenderer::operator=(VulkanRenderer&&) noexcept = default;
VulkanRenderer::~VulkanRenderer() = default;

Result<std::vector<VulkanDeviceInfo>> vulkan_devices() {
  return refusal();
}
Result<VulkanDeviceInfo> describe_vulkan_device(VkInstance_T*, VkPhysicalDevice_T*, VulkanGetInstanceProcAddr) {
  return refusal();
}
Status enable_vulkan_features(VkDeviceCreateInfo&, VulkanFeatureStorage&) {
  return refusal();
}
Result<VulkanRenderer> VulkanRenderer::create(const VulkanOptions&) {
  return refusal();
}
Result<VulkanRenderer> VulkanRenderer::create(const BorrowedVulkanDevice&, std::uint64_t) {
  return refusal();
}
const VulkanDeviceInfo& VulkanRenderer::device() const {
  return impl_->device;
}
Status VulkanRenderer::update(const Scene&, InstanceFilter, Threads) {
  return refusal();
}
void VulkanRenderer::use_light(const SceneLight*) {}

std::uint64_t VulkanRenderer::uploaded_bytes() const {
  return 0;
}
Result<RenderedImage> VulkanRenderer::render(const Camera&, const RenderOptions&, Threads, const Progress&) {
  return refusal();
}
Status VulkanRenderer::draw(VulkanImage&, const Camera&, const RenderOptions&, Accumulation, Threads, const Progress&) {
  return refusal();
}

Result<PathImage> VulkanRenderer::render_paths(const Camera&, const PathOptions&, Threads, const Progress&) {
  return refusal();
}
Status VulkanRenderer::draw_paths(VulkanPathImage&, const Camera&, const PathOptions&, Accumulation, const Progress&) {
  return refusal();
}

// A renderer to make these for cannot be had.
struct VulkanImage::Impl {};

VulkanImage::VulkanImage(VulkanRenderer&) {}
VulkanImage::VulkanImage(VulkanImage&&) noexcept = default;
VulkanImage& VulkanImage::operator=(VulkanImage&&) noexcept = default;
VulkanImage::~VulkanImage() = default;

int VulkanImage::width() const {
  return 0;
}
int VulkanImage::height() const {
  return 0;
}
int VulkanImage::samples() const {
  return 0;
}
std::int64_t VulkanImage::rays() const {
  return 0;
}
std::size_t VulkanImage::bytes() const {
  return 0;
}
Result<Image> VulkanImage::read() const {
  return refusal();
}
Status VulkanImage::write(const Image&) {
  return refusal();
}
Status VulkanImage::record_copy(VkCommandBuffer_T*, const VulkanImageTarget&) const {
  return refusal();
}
Status VulkanImage::copy_to(const VulkanImageTarget&) const {
  return refusal();
}

struct VulkanPathImage::Impl {};

VulkanPathImage::VulkanPathImage(VulkanRenderer&) {}
VulkanPathImage::VulkanPathImage(VulkanPathImage&&) noexcept = default;
VulkanPathImage& VulkanPathImage::operator=(VulkanPathImage&&) noexcept = default;
VulkanPathImage::~VulkanPathImage() = default;

int VulkanPathImage::width() const {
  return 0;
}
int VulkanPathImage::height() const {
  return 0;
}
int VulkanPathImage::samples() const {
  return 0;
}
std::size_t VulkanPathImage::bytes() const {
  return 0;
}
Result<PathImage> VulkanPathImage::read(Threads) const {
  return refusal();
}

struct VulkanMeshRenderer::Impl {};

VulkanMeshRenderer::VulkanMeshRenderer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VulkanMeshRenderer::VulkanMeshRenderer(VulkanMeshRenderer&&) noexcept = default;
VulkanMeshRenderer& VulkanMeshRenderer::operator=(VulkanMeshRenderer&&) noexcept = default;
VulkanMeshRenderer::~VulkanMeshRenderer() = default;

Result<VulkanMeshRenderer> VulkanMeshRenderer::create(VulkanRenderer&) {
  return refusal();
}
Status VulkanMeshRenderer::update(const Scene&, InstanceFilter) {
  return refusal();
}
Status VulkanMeshRenderer::put(std::span<const SurfaceUpdate>) {
  return refusal();
}
void VulkanMeshRenderer::clear() {}
Status VulkanMeshRenderer::draw(VulkanImage&, const Camera&, const MeshImageOptions&, Threads) {
  return refusal();
}
VulkanMeshRenderer::Stats VulkanMeshRenderer::stats() const {
  return {};
}

}  // namespace quoin
