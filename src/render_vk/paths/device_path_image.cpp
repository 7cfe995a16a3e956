#include "render_vk/paths/device_path_image.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include <quoin/core/assert.h>

#include "render/path/denoise.h"
#include "render/path/path_request.h"
#include "render_vk/march/renderer_impl.h"
#include "render_vk/paths/path_data.h"

namespace quoin {
namespace {

using DeviceBuffer = vulkan::Buffer;
using vulkan::Vec4;

const char* const kDoing = "allocating an image";

constexpr std::size_t kPartBytes = sizeof(path::SurfaceParts::OfPixel);
static_assert(sizeof(path::SurfacePart) == 15 * sizeof(float));

std::size_t vectors_of(const PathOptions& options) {
  return options.layers ? vulkan::kPathSumsWithLayers : vulkan::kPathSums;
}

std::size_t pixels_of(const PathOptions& options) {
  return static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
}

// Converts a pixel's vectors to sums.
path::PixelSums sums_of(const Vec4* from, bool has_layers) {
  path::PixelSums sums;
  sums.background = Vec3(from[0]);
  sums.scene_share = from[0].w;
  sums.scene = Vec3(from[1]);
  sums.caught_share = from[1].w;
  sums.caught = Vec3(from[2]);
  sums.depth = from[2].w;
  sums.lit = Vec3(from[3]);
  sums.open = Vec3(from[4]);
  if (!has_layers) return sums;
  sums.type = static_cast<VoxelType>(std::bit_cast<std::uint32_t>(from[3].w));
  sums.instance = std::bit_cast<std::uint32_t>(from[4].w);
  sums.albedo = Vec3(from[5]);
  sums.normal = Vec3(from[6]);
  return sums;
}

}  // namespace

VulkanPathImage::VulkanPathImage(VulkanRenderer& renderer) : impl_(std::make_unique<Impl>(*renderer.impl().device)) {}
VulkanPathImage::VulkanPathImage(VulkanPathImage&&) noexcept = default;
VulkanPathImage& VulkanPathImage::operator=(VulkanPathImage&&) noexcept = default;
VulkanPathImage::~VulkanPathImage() = default;

Status VulkanPathImage::Impl::begin(const Camera& of_camera, const PathOptions& with_options) {
  samples = 0;
  rays = 0;
  camera = of_camera;
  options = with_options;
  const auto make = [&](DeviceBuffer& buffer, std::size_t bytes) -> Status {
    if (buffer.size() == bytes) return {};
    buffer = {};
    if (bytes == 0) return {};
    auto made = DeviceBuffer::create(*device, bytes, DeviceBuffer::Where::Device, kDoing);
    if (!made) return made.error();
    buffer = std::move(*made);
    return {};
  };
  const std::size_t pixels = pixels_of(options);
  Status done = make(sums, pixels * vectors_of(options) * sizeof(Vec4));
  if (done) done = make(parts, options.denoise ? pixels * kPartBytes : 0);
  if (!done) return done;
  return device->run(kDoing, [&](VkCommandBuffer commands) {
    device->api().vkCmdFillBuffer(commands, sums.handle(), 0, VK_WHOLE_SIZE, 0);
    if (parts.size() > 0) device->api().vkCmdFillBuffer(commands, parts.handle(), 0, VK_WHOLE_SIZE, 0);
  });
}

int VulkanPathImage::width() const {
  return impl_->samples > 0 ? impl_->options.width : 0;
}
int VulkanPathImage::height() const {
  return impl_->samples > 0 ? impl_->options.height : 0;
}
int VulkanPathImage::samples() const {
  return impl_->samples;
}
std::size_t VulkanPathImage::bytes() const {
  return static_cast<std::size_t>(impl_->sums.size() + impl_->parts.size());
}

Result<PathImage> VulkanPathImage::read(Threads threads) const {
  const Impl& from = *impl_;
  if (from.samples == 0)
    return make_error(ErrorCode::InvalidArgument, "vulkan: cannot read the image: nothing was drawn");
  const char* const doing = "reading an image";
  const auto fetch = [&](const DeviceBuffer& buffer) -> Result<DeviceBuffer> {
    auto landing = DeviceBuffer::create(*from.device, buffer.size(), DeviceBuffer::Where::Read, doing);
    if (!landing) return landing.error();
    const Status done = from.device->run(doing, [&](VkCommandBuffer commands) {
      const VkBufferCopy all{0, 0, buffer.size()};
      from.device->api().vkCmdCopyBuffer(commands, buffer.handle(), landing->handle(), 1, &all);
    });
    if (!done) return done.error();
    return landing;
  };
  const auto sums = fetch(from.sums);
  if (!sums) return sums.error();
  PathImage image = path::empty_image(from.options);
  const std::size_t vectors = vectors_of(from.options);
  const auto* const pixels = reinterpret_cast<const Vec4*>(sums->mapped());
  const auto width = static_cast<std::size_t>(image.width);
  std::vector<std::int64_t> hits(static_cast<std::size_t>(image.height));
  parallel_for(hits.size(), threads, [&](std::size_t y) {
    for (std::size_t pixel = y * width; pixel < (y + 1) * width; ++pixel) {
      const path::PixelSums of_pixel = sums_of(pixels + pixel * vectors, from.options.layers);
      of_pixel.write_to(image, pixel, from.samples);
      if (of_pixel.scene_share > 0.0F) ++hits[y];
    }
  });
  for (const std::int64_t of_row : hits) image.pixels_hit += of_row;
  image.rays = from.rays;
  if (!from.options.denoise) return image;
  const auto parts = fetch(from.parts);
  if (!parts) return parts.error();
  path::SurfaceParts surfaces(image.width, image.height);
  for (std::size_t i = 0; i < pixels_of(from.options); ++i) {
    QUOIN_ASSERT((i + 1) * kPartBytes <= parts->size(), "parts of every pixel");
    std::memcpy(&surfaces.at(i), parts->mapped() + i * kPartBytes, kPartBytes);
  }
  path::denoise(surfaces, from.samples, threads, image);
  return image;
}

}  // namespace quoin
