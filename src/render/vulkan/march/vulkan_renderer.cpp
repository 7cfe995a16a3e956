#include <quoin/render/vulkan_renderer.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/progress.h>
#include <quoin/render/cpu_renderer.h>

#include "render/shared/image_request.h"
#include "render/vulkan/device/device_memory.h"
#include "render/vulkan/march/device_image.h"
#include "render/vulkan/march/device_impostors.h"
#include "render/vulkan/march/device_scene.h"
#include "render/vulkan/march/pipelines.h"
#include "render/vulkan/march/renderer_impl.h"
#include "render/vulkan/march/shader_scene.h"

namespace quoin::vulkan {
namespace {

// Draws one image tile by tile: each tile is drawn in device memory and then read back, or stays there.
class ImagePass {
 public:
  // Requires: `placement` and `light` belong to the renderer's scene.
  ImagePass(RendererImpl& renderer, const Placement& placement, DeviceLight light)
      : device_(renderer.device.get()),
        memory_(&renderer.memory),
        pipelines_(renderer.pipelines.get()),
        scene_(&renderer.scene),
        textures_(&renderer.textures),
        placement_(&placement),
        features_(renderer.features_of(placement)),
        light_(std::move(light)),
        content_(renderer.voxels),
        places_(renderer.memory, "drawing") {}
  ImagePass(const ImagePass&) = delete;
  ImagePass& operator=(const ImagePass&) = delete;

  // Renders as VulkanRenderer::render, for validated arguments.
  [[nodiscard]] Result<RenderedImage> render(const Camera& camera, const RenderOptions& options,
                                             const Progress& progress);

  // Draws as VulkanRenderer::draw, for validated arguments.
  [[nodiscard]] Status draw(ImageImpl& image, const Camera& camera, const RenderOptions& options,
                            const Progress& progress);

 private:
  struct Tile {
    std::int32_t x, y, width, height;
    FarTiles::Range far;
  };

  Status put_frame(const Camera& camera, const RenderOptions& options);
  Status put_far(const RenderOptions& options);
  [[nodiscard]] int most_lamps() const { return light_.lamps.table == nullptr ? 0 : light_.lamps.table->longest; }
  void find_hits(VkCommandBuffer commands, const ShaderPush& push) const;
  Status begin(const Camera& camera, const RenderOptions& options);
  Status make_tile_buffers(const RenderOptions& options);
  [[nodiscard]] std::vector<Tile> tiles_of(const RenderOptions& options) const;
  [[nodiscard]] ShaderPush push_for_sample(const Tile& tile, int sample) const;
  Status take_sample(const Tile& tile, int sample);
  Status add_samples(ImageImpl& image, const RenderOptions& options, const Progress& progress);
  Status take_sample(std::span<const Tile> tiles, int sample);
  Status resolve(std::span<const Tile> tiles);
  Status finish_glass(ShaderPush push);
  Status read_tile(const Tile& tile, RenderedImage& image);
  Status read_counters(ShaderCounters& counters);
  [[nodiscard]] ShaderPush push_for(const Tile& tile) const;

  Device* device_;
  DeviceMemory* memory_;
  Pipelines* pipelines_;
  const DeviceScene* scene_;
  const DeviceTextures* textures_;
  const Placement* placement_;
  PassFeatures features_;
  DeviceLight light_;
  const Scene* content_;               // the source of the scene; null: empty
  const ImageImpl* target_ = nullptr;  // null: the image is read back
  Places places_;
  ShaderFrame frame_;
  std::uint64_t frame_address_ = 0;
  std::int32_t tile_edge_ = 0;
  int occlusion_rays_ = 0;
  std::vector<FarTiles::Range> far_;  // of the tiles
  Place far_place_;                   // depths and numbers of a tile's impostors, half each
  Buffer output_;                     // colours, depths, counters
  Buffer results_;                    // their copy for the CPU
};

// Limits of the work per tile and per batch, so that no driver's watchdog resets the device.
constexpr std::int64_t kMaxRays = std::int64_t{1} << 22;
constexpr std::int64_t kMaxRaysAtOnce = std::int64_t{1} << 24;
const char* const kDoing = "drawing";

// `lamps`: the maximum number of lamps that light a point.
std::int64_t rays_of_pixel(const RenderOptions& options, int lamps) {
  const LightOptions& light = options.light;
  return 2 + lamps + (light.occlusion_mode == OcclusionMode::Rays ? light.occlusion_rays : 0);
}

// Returns the edge of the tiles, a power of two. Graphics hardware needs many pixels at a time to be busy; glass lists
// take 1.5 kB per pixel.
std::int32_t tile_edge(const RenderOptions& options, int lamps, bool has_glass, bool is_processor) {
  std::int32_t edge = is_processor ? 256 : 1024;
  if (has_glass) edge = is_processor ? 128 : 256;
  while (edge > 16 && std::int64_t{edge} * edge * rays_of_pixel(options, lamps) > kMaxRays) edge /= 2;
  return edge;
}

const std::vector<float>& thresholds() {
  static const std::vector<float> shared = srgb_thresholds();
  return shared;
}

}  // namespace

Status ImagePass::put_frame(const Camera& camera, const RenderOptions& options) {
  FrameData data = make_frame(*placement_, camera, options);
  put_scene(*scene_, *placement_, data);
  textures_->put_in(data.frame);
  occlusion_rays_ = options.light.occlusion_rays;
  std::vector<ShaderLamp> lamps;
  if (light_.lamps.table != nullptr) lamps = put_lamps(light_.lamps, camera, data);
  QUOIN_ASSERT(light_.levels.table == nullptr || content_ != nullptr, "light levels of a scene");
  if (light_.levels.table != nullptr) put_levels(light_.levels, *content_, *placement_, options, data);
  frame_ = data.frame;
  Status done = places_.upload(data.placed, frame_.placed);
  if (done) done = places_.upload(data.tree, frame_.tree);
  if (done) done = places_.upload(data.leaves, frame_.leaves);
  if (done) done = places_.upload(data.directions, frame_.directions);
  if (done) done = places_.upload(data.turns, frame_.turns);
  if (done) done = places_.upload(lamps, frame_.lamps);
  if (done) done = places_.upload(thresholds(), frame_.thresholds);
  if (done) done = make_tile_buffers(options);
  if (done) done = put_far(options);
  if (done) done = places_.upload(std::vector<ShaderFrame>{frame_}, frame_address_);
  if (done) done = memory_->flush();
  return done;
}

Status ImagePass::put_far(const RenderOptions& options) {
  const FarTiles tiles = far_tiles(placement_->far, tile_edge_, options.width, options.height);
  far_ = tiles.ranges;
  frame_.far_count = static_cast<std::uint32_t>(placement_->far.size());
  if (tiles.parts.empty()) return {};
  Status done = places_.upload(placement_->far, frame_.fars);
  if (done) done = places_.upload(tiles.parts, frame_.far_parts);
  const auto pixels = static_cast<std::size_t>(tile_edge_) * static_cast<std::size_t>(tile_edge_);
  if (done) done = places_.reserve(pixels * 8, frame_.far_depths);
  if (!done) return done;
  far_place_ = places_.last();
  frame_.far_numbers = frame_.far_depths + pixels * 4;
  return {};
}

Status ImagePass::make_tile_buffers(const RenderOptions& options) {
  const bool has_glass = placement_->has_transparent;
  tile_edge_ = tile_edge(options, most_lamps(), has_glass, device_->physical().type == VK_PHYSICAL_DEVICE_TYPE_CPU);
  const auto pixels = static_cast<std::size_t>(std::min(tile_edge_, options.width)) *
                      static_cast<std::size_t>(std::min(tile_edge_, options.height));
  const VkDeviceSize bytes = (target_ == nullptr ? pixels * 8 : 0) + sizeof(ShaderCounters) + 16;
  for (Buffer* buffer : {&output_, &results_}) {
    const auto where = buffer == &output_ ? Buffer::Where::Device : Buffer::Where::Read;
    auto made = Buffer::create(*device_, bytes, where, kDoing);
    if (!made) return made.error();
    *buffer = std::move(*made);
  }
  frame_.counters = output_.address();
  frame_.colours = output_.address() + sizeof(ShaderCounters);
  frame_.depths = frame_.colours + pixels * 4;
  Status done = places_.reserve(pixels * kPointBytes, frame_.points);
  if (done) done = places_.reserve(pixels * kStateBytes, frame_.states);
  if (target_ != nullptr) {
    frame_.colours = target_->colours.address();
    frame_.sums = target_->sums.address();
    if (done) done = places_.reserve(pixels * 4, frame_.depths);
  } else if (done) {
    done = places_.reserve(pixels * kSumBytes, frame_.sums);
  }
  if (!has_glass) return done;
  if (done) done = places_.reserve(pixels * kBodies * kBodyBytes, frame_.bodies);
  if (done) done = places_.reserve(pixels * kBodies * kBodyBytes, frame_.sun_bodies);
  return done;
}

ShaderPush ImagePass::push_for(const Tile& tile) const {
  QUOIN_ASSERT(frame_address_ != 0 && tile.width > 0 && tile.height > 0, "a tile of a frame that was sent");
  ShaderPush push;
  push.frame = frame_address_;
  push.corner_x = tile.x;
  push.corner_y = tile.y;
  push.size_x = tile.width;
  push.size_y = tile.height;
  push.far_first = tile.far.first;
  push.far_count = tile.far.count;
  push.far_groups = tile.far.groups;
  push.pitch = static_cast<std::uint32_t>(target_ == nullptr ? tile.width : target_->width);
  if (target_ != nullptr)
    push.base = static_cast<std::uint32_t>(tile.y) * push.pitch + static_cast<std::uint32_t>(tile.x);
  return push;
}

ShaderPush ImagePass::push_for_sample(const Tile& tile, int sample) const {
  ShaderPush push = push_for(tile);
  set_sample(sample, occlusion_rays_, push);
  return push;
}

// Finds the hit of each pixel's ray.
void ImagePass::find_hits(VkCommandBuffer commands, const ShaderPush& push) const {
  if (push.far_groups > 0) {
    const VkDeviceSize half = (frame_.far_numbers - frame_.far_depths);
    const VkBuffer buffer = memory_->buffer_of(far_place_);
    constexpr std::uint32_t kInfinity = 0x7F800000;
    device_->api().vkCmdFillBuffer(commands, buffer, far_place_.offset, half, kInfinity);
    device_->api().vkCmdFillBuffer(commands, buffer, far_place_.offset + half, half, ~0U);
    device_->separate(commands);
    pipelines_->dispatch_far(commands, Pass::FarDepths, push);
    pipelines_->dispatch_far(commands, Pass::FarFaces, push);
  }
  pipelines_->dispatch(commands, Pass::Primary, push, features_);
}

Status ImagePass::take_sample(const Tile& tile, int sample) {
  const ShaderPush push = push_for_sample(tile, sample);
  const bool has_glass = placement_->has_transparent;
  Status done = device_->run(kDoing, [&](VkCommandBuffer commands) {
    find_hits(commands, push);
    if (has_glass) return;
    pipelines_->dispatch(commands, Pass::Light, push, features_);
  });
  return done && has_glass ? finish_glass(push) : done;
}

// Lights as many glass bodies at a time as fit, until no pixel has more.
Status ImagePass::finish_glass(ShaderPush push) {
  for (;;) {
    Status done = device_->run(kDoing, [&](VkCommandBuffer commands) {
      const VkDeviceSize pending = offsetof(ShaderCounters, pending);
      device_->api().vkCmdFillBuffer(commands, output_.handle(), pending, 4, 0);
      device_->separate(commands);
      pipelines_->dispatch(commands, Pass::Glass, push, features_);
      pipelines_->dispatch(commands, Pass::LightWithGlass, push, features_);
      const VkBufferCopy counters{0, 0, sizeof(ShaderCounters)};
      device_->api().vkCmdCopyBuffer(commands, output_.handle(), results_.handle(), 1, &counters);
    });
    if (!done) return done;
    ShaderCounters counters;
    std::memcpy(&counters, results_.mapped(), sizeof counters);
    if (counters.pending == 0) return {};
    ++push.round;
  }
}

Status ImagePass::read_tile(const Tile& tile, RenderedImage& image) {
  Status done = device_->run(kDoing, [&](VkCommandBuffer commands) {
    pipelines_->dispatch(commands, Pass::Resolve, push_for(tile));
    const VkBufferCopy all{0, 0, output_.size()};
    device_->api().vkCmdCopyBuffer(commands, output_.handle(), results_.handle(), 1, &all);
  });
  if (!done) return done;
  QUOIN_ASSERT(tile.x + tile.width <= image.colour.width && tile.y + tile.height <= image.colour.height,
               "a tile of the image");
  const std::byte* colours = results_.mapped() + (frame_.colours - frame_.counters);
  const std::byte* depths = results_.mapped() + (frame_.depths - frame_.counters);
  const auto columns = static_cast<std::size_t>(tile.width);
  for (std::int32_t y = 0; y < tile.height; ++y) {
    const std::size_t from = static_cast<std::size_t>(y) * columns;
    const std::size_t to = static_cast<std::size_t>(tile.y + y) * static_cast<std::size_t>(image.colour.width) +
                           static_cast<std::size_t>(tile.x);
    for (std::size_t x = 0; x < columns; ++x) {
      std::memcpy(image.colour.rgb.data() + 3 * (to + x), colours + 4 * (from + x), 3);
    }
    if (image.depth.values.empty()) continue;
    std::memcpy(image.depth.values.data() + to, depths + 4 * from, 4 * columns);
  }
  return {};
}

Status ImagePass::read_counters(ShaderCounters& counters) {
  Status done = device_->run(kDoing, [&](VkCommandBuffer commands) {
    const VkBufferCopy region{0, 0, sizeof(ShaderCounters)};
    device_->api().vkCmdCopyBuffer(commands, output_.handle(), results_.handle(), 1, &region);
  });
  if (done) std::memcpy(&counters, results_.mapped(), sizeof counters);
  return done;
}

std::vector<ImagePass::Tile> ImagePass::tiles_of(const RenderOptions& options) const {
  std::vector<Tile> tiles;
  for (std::int32_t y = 0; y < options.height; y += tile_edge_) {
    for (std::int32_t x = 0; x < options.width; x += tile_edge_) {
      QUOIN_ASSERT(tiles.size() < far_.size(), "one range of impostors per tile");
      const FarTiles::Range far = far_[tiles.size()];
      tiles.push_back({x, y, std::min(tile_edge_, options.width - x), std::min(tile_edge_, options.height - y), far});
    }
  }
  return tiles;
}

Status ImagePass::begin(const Camera& camera, const RenderOptions& options) {
  if (Status done = put_frame(camera, options); !done) return done;
  const bool has_far = std::ranges::any_of(far_, [](const FarTiles::Range& range) { return range.groups > 0; });
  if (Status done = pipelines_->add(features_, placement_->has_transparent, has_far); !done) return done;
  return device_->run(kDoing, [&](VkCommandBuffer commands) {
    device_->api().vkCmdFillBuffer(commands, output_.handle(), 0, sizeof(ShaderCounters), 0);
  });
}

Result<RenderedImage> ImagePass::render(const Camera& camera, const RenderOptions& options, const Progress& progress) {
  Status done = begin(camera, options);
  if (!done) return done.error();
  RenderedImage image = empty_image(options);
  const std::vector<Tile> tiles = tiles_of(options);
  const double all = static_cast<double>(tiles.size()) * options.samples;
  double count = 0.0;
  for (const Tile& tile : tiles) {
    for (int sample = 0; sample < options.samples && done; ++sample) {
      done = take_sample(tile, sample);
      count += 1.0;
      if (done && progress && !progress(count / all)) return make_error(ErrorCode::Cancelled, "cancelled");
    }
    if (done) done = read_tile(tile, image);
  }
  ShaderCounters counters;
  if (done) done = read_counters(counters);
  if (!done) return done.error();
  image.rays = counters.rays();
  image.pixels_hit = counters.hits;
  return image;
}

// Takes one sample of some tiles, in one batch if there is no glass (the CPU must count the rounds of glass).
Status ImagePass::take_sample(std::span<const Tile> tiles, int sample) {
  if (placement_->has_transparent) {
    for (const Tile& tile : tiles) {
      if (Status done = take_sample(tile, sample); !done) return done;
    }
    return {};
  }
  return device_->run(kDoing, [&](VkCommandBuffer commands) {
    for (const Tile& tile : tiles) {
      const ShaderPush push = push_for_sample(tile, sample);
      find_hits(commands, push);
      pipelines_->dispatch(commands, Pass::Light, push, features_);
    }
  });
}

Status ImagePass::resolve(std::span<const Tile> tiles) {
  return device_->run(kDoing, [&](VkCommandBuffer commands) {
    for (const Tile& tile : tiles) pipelines_->dispatch(commands, Pass::Resolve, push_for(tile));
  });
}

Status ImagePass::add_samples(ImageImpl& image, const RenderOptions& options, const Progress& progress) {
  const std::vector<Tile> tiles = tiles_of(options);
  const std::int64_t rays_of_tile = rays_of_pixel(options, most_lamps()) * tile_edge_ * tile_edge_;
  const auto at_once = static_cast<std::size_t>(std::max<std::int64_t>(kMaxRaysAtOnce / rays_of_tile, 1));
  const double all = static_cast<double>(tiles.size()) * options.samples;
  double count = 0.0;
  for (int sample = 0; sample < options.samples; ++sample) {
    for (std::size_t first = 0; first < tiles.size(); first += at_once) {
      const auto some = std::span(tiles).subspan(first, std::min(at_once, tiles.size() - first));
      if (Status done = take_sample(some, image.samples + sample); !done) return done;
      count += static_cast<double>(some.size());
      if (progress && !progress(count / all)) return make_error(ErrorCode::Cancelled, "cancelled");
    }
  }
  return resolve(tiles);
}

Status ImagePass::draw(ImageImpl& image, const Camera& camera, const RenderOptions& options, const Progress& progress) {
  target_ = &image;
  RenderOptions all = options;
  all.samples += image.samples;  // the divisor of the sums
  Status done = begin(camera, all);
  if (done) done = add_samples(image, options, progress);
  ShaderCounters counters;
  if (done) done = read_counters(counters);
  // Incomplete sums, with tiles missing, are discarded.
  image.samples = done ? all.samples : 0;
  image.rays = done ? image.rays + counters.rays() : 0;
  return done;
}

}  // namespace quoin::vulkan

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
    if (done) done = impl_->textures.put(scene.types);
    if (!done) impl_->scene.clear();
    impl_->uploaded = impl_->memory.written() - before;
    impl_->look_at(done ? &scene : nullptr, filter);
    return done;
  } catch (...) {
    impl_->scene.clear();
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

Result<RenderedImage> VulkanRenderer::render(const Camera& camera, const RenderOptions& asked, Threads threads,
                                             const Progress& progress) {
  const RenderOptions options = with_environment(asked, impl_->environment);
  if (const Status status = check_request(camera, options); !status) return status.error();
  const auto subject = vulkan::Subject::of(*impl_, camera, options, threads);
  if (!subject) return subject.error();
  auto light = impl_->light_tables(options, threads);
  if (!light) return light.error();
  vulkan::ImagePass pass(*impl_, subject->placement(), std::move(*light));
  return pass.render(camera, options, progress);
}

Status VulkanRenderer::draw(VulkanImage& image, const Camera& camera, const RenderOptions& asked,
                            Accumulation accumulation, Threads threads, const Progress& progress) {
  const RenderOptions options = with_environment(asked, impl_->environment);
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
    if (Status status = target.begin_sums(camera, options); !status) return status;
  }
  QUOIN_ASSERT(target.camera == camera, "all samples of an image have the same camera");
  QUOIN_ASSERT(target.light == options.light && target.environment == options.environment,
               "all samples of an image have the same light");
  if (target.samples + options.samples > kMaxSamples) {
    return make_error(ErrorCode::LimitExceeded, "vulkan: an image accumulates at most 4096 samples per pixel");
  }
  const auto subject = vulkan::Subject::of(*impl_, camera, options, threads);
  if (!subject) return subject.error();
  auto light = impl_->light_tables(options, threads);
  if (!light) return light.error();
  vulkan::ImagePass pass(*impl_, subject->placement(), std::move(*light));
  return pass.draw(target, camera, options, progress);
}

}  // namespace quoin
