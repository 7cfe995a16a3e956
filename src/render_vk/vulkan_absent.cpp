// In place of all that lies in this folder's rooms where the library is built without Vulkan.

#include <quoin/render_vk/vulkan_device.h>
#include <quoin/render_vk/vulkan_mesh_renderer.h>
#include <quoin/render_vk/vulkan_picture.h>
#include <quoin/render_vk/vulkan_renderer.h>

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
Result<Picture> VulkanRenderer::render(const Camera&, const RenderOptions&, Threads, const Progress&) {
  return refusal();
}
Status VulkanRenderer::draw(VulkanPicture&, const Camera&, const RenderOptions&, Accumulation, Threads,
                            const Progress&) {
  return refusal();
}

Result<PathPicture> VulkanRenderer::render_paths(const Camera&, const PathOptions&, Threads, const Progress&) {
  return refusal();
}
Status VulkanRenderer::draw_paths(VulkanPathPicture&, const Camera&, const PathOptions&, Accumulation,
                                  const Progress&) {
  return refusal();
}

// A renderer to make these for cannot be had.
struct VulkanPicture::Impl {};

VulkanPicture::VulkanPicture(VulkanRenderer&) {}
VulkanPicture::VulkanPicture(VulkanPicture&&) noexcept = default;
VulkanPicture& VulkanPicture::operator=(VulkanPicture&&) noexcept = default;
VulkanPicture::~VulkanPicture() = default;

int VulkanPicture::width() const {
  return 0;
}
int VulkanPicture::height() const {
  return 0;
}
int VulkanPicture::samples() const {
  return 0;
}
std::int64_t VulkanPicture::rays() const {
  return 0;
}
std::size_t VulkanPicture::bytes() const {
  return 0;
}
Result<Image> VulkanPicture::read() const {
  return refusal();
}
Status VulkanPicture::write(const Image&) {
  return refusal();
}
Status VulkanPicture::record_copy(VkCommandBuffer_T*, const VulkanImageTarget&) const {
  return refusal();
}
Status VulkanPicture::copy_to(const VulkanImageTarget&) const {
  return refusal();
}

struct VulkanPathPicture::Impl {};

VulkanPathPicture::VulkanPathPicture(VulkanRenderer&) {}
VulkanPathPicture::VulkanPathPicture(VulkanPathPicture&&) noexcept = default;
VulkanPathPicture& VulkanPathPicture::operator=(VulkanPathPicture&&) noexcept = default;
VulkanPathPicture::~VulkanPathPicture() = default;

int VulkanPathPicture::width() const {
  return 0;
}
int VulkanPathPicture::height() const {
  return 0;
}
int VulkanPathPicture::samples() const {
  return 0;
}
std::size_t VulkanPathPicture::bytes() const {
  return 0;
}
Result<PathPicture> VulkanPathPicture::read(Threads) const {
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
Status VulkanMeshRenderer::draw(VulkanPicture&, const Camera&, const MeshPictureOptions&, Threads) {
  return refusal();
}
VulkanMeshRenderer::Stats VulkanMeshRenderer::stats() const {
  return {};
}

}  // namespace quoin
