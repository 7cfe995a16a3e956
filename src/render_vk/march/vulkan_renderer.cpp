#include <quoin/core/assert.h>
#include <quoin/render_vk/vulkan_renderer.h>

#include <utility>

#include "render/image_request.h"
#include "render_vk/march/image_pass.h"
#include "render_vk/march/renderer_impl.h"

namespace quoin {

namespace {

Status check_request(const Camera& camera, const RenderOptions& options) {
  if (options.light.occlusion_mode == OcclusionMode::Smooth) {
    return make_error(ErrorCode::Unsupported, "vulkan: smooth occlusion of marched fields needs the CPU renderer");
  }
  return check(camera, options);
}

}  // namespace

Result<vulkan::Subject> vulkan::Subject::of(RendererImpl& impl, const Camera& camera, const RenderOptions& options,
                                            Threads threads) {
  Subject subject(impl.scene.placement());
  if (!options.detail.policy || impl.voxels == nullptr) return subject;
  const ImageDetail detail = impl.chooser->choose(*impl.voxels, impl.instances, camera, options);
  auto placed = impl.detail.place(impl.scene, *impl.voxels, detail, camera, options, threads);
  if (!placed) return placed.error();
  subject.detailed_ = std::move(*placed);
  return subject;
}

Result<std::unique_ptr<VulkanRenderer::Impl>> VulkanRenderer::Impl::create(
    Result<std::unique_ptr<vulkan::Device>> device, std::uint64_t block_bytes) {
  QUOIN_ASSERT(block_bytes >= kLeastBlock, "blocks of at least 64 KiB");
  if (!device) return device.error();
  auto pipelines = vulkan::Pipelines::create(**device);
  if (!pipelines) return pipelines.error();
  return std::make_unique<Impl>(std::move(*device), std::move(*pipelines), block_bytes);
}

VulkanRenderer::VulkanRenderer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VulkanRenderer::VulkanRenderer(VulkanRenderer&&) noexcept = default;
VulkanRenderer& VulkanRenderer::operator=(VulkanRenderer&&) noexcept = default;
VulkanRenderer::~VulkanRenderer() = default;

Result<VulkanRenderer> VulkanRenderer::create(const VulkanOptions& options) {
  auto impl = Impl::create(vulkan::Device::create(options), options.block_bytes);
  if (!impl) return impl.error();
  return VulkanRenderer(std::move(*impl));
}

Result<VulkanRenderer> VulkanRenderer::create(const BorrowedVulkanDevice& device, std::uint64_t block_bytes) {
  auto impl = Impl::create(vulkan::Device::borrow(device), block_bytes);
  if (!impl) return impl.error();
  return VulkanRenderer(std::move(*impl));
}

const VulkanDeviceInfo& VulkanRenderer::device() const {
  return impl_->device->description();
}

Status VulkanRenderer::update(const Scene& scene, InstanceFilter filter, Threads threads) {
  const std::uint64_t before = impl_->memory.written();
  try {
    Status done = impl_->scene.update(scene, filter, threads);
    if (done && impl_->scene.placement().has_fields) done = impl_->pipelines->add_fields();
    if (done && impl_->scene.placement().has_field_glass) done = impl_->pipelines->add_field_glass();
    impl_->uploaded = impl_->memory.written() - before;
    impl_->look_at(done ? &scene : nullptr, filter);
    return done;
  } catch (...) {
    impl_->look_at(nullptr, filter);  // the previous scene may be destroyed before the next image
    throw;
  }
}

void VulkanRenderer::use_light(const SceneLight* light) {
  impl_->levels.use(light);
}

std::uint64_t VulkanRenderer::uploaded_bytes() const {
  return impl_->uploaded;
}

Result<RenderedImage> VulkanRenderer::render(const Camera& camera, const RenderOptions& options, Threads threads,
                                             const Progress& progress) {
  if (const Status status = check_request(camera, options); !status) return status.error();
  const auto subject = vulkan::Subject::of(*impl_, camera, options, threads);
  if (!subject) return subject.error();
  auto light = impl_->light_tables(options.light, threads);
  if (!light) return light.error();
  vulkan::ImagePass pass(*impl_->device, impl_->memory, *impl_->pipelines, impl_->scene, subject->placement(),
                         std::move(*light), impl_->voxels);
  return pass.render(camera, options, progress);
}

Status VulkanRenderer::draw(VulkanImage& image, const Camera& camera, const RenderOptions& options,
                            Accumulation accumulation, Threads threads, const Progress& progress) {
  constexpr int kMaxSamples = 4096;
  if (Status status = check_request(camera, options); !status) return status;
  vulkan::ImageImpl& target = image.impl();
  if (target.device != impl_->device.get()) {
    return make_error(ErrorCode::InvalidArgument, "vulkan: the image belongs to another renderer");
  }
  if (Status status = target.resize(options.width, options.height); !status) return status;
  // Mesh images and written images have no sums to add to.
  const bool is_new = accumulation == Accumulation::Restart || target.samples == 0;
  if (is_new || target.sums.handle() == VK_NULL_HANDLE) {
    if (Status status = target.begin_sums(camera, options.light); !status) return status;
  }
  QUOIN_ASSERT(target.camera == camera, "all samples of an image have the same camera");
  QUOIN_ASSERT(target.light == options.light, "all samples of an image have the same light");
  if (target.samples + options.samples > kMaxSamples) {
    return make_error(ErrorCode::LimitExceeded, "vulkan: an image accumulates at most 4096 samples per pixel");
  }
  const auto subject = vulkan::Subject::of(*impl_, camera, options, threads);
  if (!subject) return subject.error();
  auto light = impl_->light_tables(options.light, threads);
  if (!light) return light.error();
  vulkan::ImagePass pass(*impl_->device, impl_->memory, *impl_->pipelines, impl_->scene, subject->placement(),
                         std::move(*light), impl_->voxels);
  return pass.draw(target, camera, options, progress);
}

}  // namespace quoin
