#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/progress.h>
#include <quoin/render/vulkan_image.h>
#include <quoin/render/vulkan_renderer.h>
#include <quoin/scene/camera.h>

#include "render/path/denoise.h"
#include "render/path/path_request.h"
#include "render/shared/image_request.h"
#include "render/vulkan/device/device.h"
#include "render/vulkan/device/device_memory.h"
#include "render/vulkan/march/device_scene.h"
#include "render/vulkan/march/renderer_impl.h"
#include "render/vulkan/march/shader_scene.h"
#include "render/vulkan/paths/device_paths.h"
#include "render/vulkan/paths/path_data.h"

namespace quoin {

// The device state of a VulkanPathImage.
struct VulkanPathImage::Impl {
  explicit Impl(vulkan::Device& of_device) : device(&of_device) {}

  // Allocates an empty image. Errors: LimitExceeded; the image then has no memory.
  [[nodiscard]] Status begin(const Camera& of_camera, const PathOptions& with_options);

  vulkan::Device* device;
  int samples = 0;
  std::int64_t rays = 0;
  // The camera of its samples.
  Camera camera;
  PathOptions options;
  vulkan::Buffer sums;   // vectors of four floats per pixel: path_data.glsl
  vulkan::Buffer parts;  // of surfaces, for the denoiser
};

namespace {

using DeviceBuffer = vulkan::Buffer;
using vulkan::Vec4;

const char* const kAllocating = "allocating an image";

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
    auto made = DeviceBuffer::create(*device, bytes, DeviceBuffer::Where::Device, kAllocating);
    if (!made) return made.error();
    buffer = std::move(*made);
    return {};
  };
  const std::size_t pixels = pixels_of(options);
  Status done = make(sums, pixels * vectors_of(options) * sizeof(Vec4));
  if (done) done = make(parts, options.denoise ? pixels * kPartBytes : 0);
  if (!done) return done;
  return device->run(kAllocating, [&](VkCommandBuffer commands) {
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

namespace quoin::vulkan {

using PathImageImpl = VulkanPathImage::Impl;

// The path tracing shader in the variants that scenes need: with or without glass, by their features. Each variant is
// created at first use.
class PathPipelines {
 public:
  [[nodiscard]] static Result<std::unique_ptr<PathPipelines>> create(Device& device);
  ~PathPipelines();
  PathPipelines(const PathPipelines&) = delete;
  PathPipelines& operator=(const PathPipelines&) = delete;

  // Errors: those of VulkanRenderer.
  [[nodiscard]] Status prepare(const PassFeatures& features, bool has_glass);
  // Records steps of a tile's paths, and a barrier before their results are read. Requires: it was prepared.
  void dispatch(VkCommandBuffer commands, const PassFeatures& features, bool has_glass, const PathPush& push) const;

 private:
  explicit PathPipelines(Device& device) : device_(&device) {}
  [[nodiscard]] static std::size_t variant_of(const PassFeatures& features, bool has_glass) {
    return 2 * features.index() + (has_glass ? 1 : 0);
  }

  Device* device_;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  std::array<VkPipeline, 2 * PassFeatures::kCount> pipelines_{};
};

namespace {

constexpr std::uint32_t kPaths[] = {
#include "paths.comp.inc"
};

}  // namespace

Result<std::unique_ptr<PathPipelines>> PathPipelines::create(Device& device) {
  std::unique_ptr<PathPipelines> made(new PathPipelines(device));
  const VkResult result = make_push_layout(device, VK_SHADER_STAGE_COMPUTE_BIT, sizeof(PathPush), made->layout_);
  if (Status status = device.check(result, "compiling shaders"); !status) return status.error();
  return made;
}

PathPipelines::~PathPipelines() {
  const Api& api = device_->api();
  for (const VkPipeline pipeline : pipelines_) {
    if (pipeline != VK_NULL_HANDLE) api.vkDestroyPipeline(device_->handle(), pipeline, nullptr);
  }
  if (layout_ != VK_NULL_HANDLE) api.vkDestroyPipelineLayout(device_->handle(), layout_, nullptr);
}

Status PathPipelines::prepare(const PassFeatures& features, bool has_glass) {
  VkPipeline& pipeline = pipelines_[variant_of(features, has_glass)];
  if (pipeline != VK_NULL_HANDLE) return {};
  const std::array constants = {ShaderConstant{0, has_glass},
                                ShaderConstant{4, features.fields || features.field_glass},
                                ShaderConstant{6, features.field_glass},
                                ShaderConstant{7, features.textures},
                                ShaderConstant{8, features.shapes},
                                ShaderConstant{9, features.cells}};
  const VkResult result = make_compute_pipeline(*device_, layout_, kPaths, constants, pipeline);
  return device_->check(result, "compiling shaders");
}

void PathPipelines::dispatch(VkCommandBuffer commands, const PassFeatures& features, bool has_glass,
                             const PathPush& push) const {
  constexpr std::int32_t kGroup = 8;
  const auto groups = [](std::int32_t pixels) { return static_cast<std::uint32_t>((pixels + kGroup - 1) / kGroup); };
  const VkPipeline pipeline = pipelines_[variant_of(features, has_glass)];
  QUOIN_ASSERT(pipeline != VK_NULL_HANDLE, "a variant that was prepared");
  const Api& api = device_->api();
  api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
  api.vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof push, &push);
  api.vkCmdDispatch(commands, groups(push.size_x), groups(push.size_y), 1);
  device_->separate(commands);
}

// The data shared by the path-traced images of one renderer.
struct PathScene {
  explicit PathScene(std::unique_ptr<PathPipelines> made) : pipelines(std::move(made)) {}

  std::unique_ptr<PathPipelines> pipelines;
  DevicePaths tables;
  std::uint64_t update_count = 0;  // of the renderer, when the tables were last updated
};

// Adds samples to a path-traced image, tile by tile.
//
//   tile: begin -> [ some steps of every pixel's path; the next sample's path starts when one ends ] until all end
class PathPass {
 public:
  PathPass(RendererImpl& renderer, PathImageImpl& image);
  PathPass(const PathPass&) = delete;
  PathPass& operator=(const PathPass&) = delete;

  // Adds `samples` samples. After an error the image has none.
  [[nodiscard]] Status draw(int samples, const Progress& progress);

 private:
  struct Tile {
    std::int32_t x, y, width, height;
  };
  Status put_frame(int samples);
  Status put_lamps(DVec3 view_origin, ShaderPathFrame& paths);
  Status put_tile_buffers(int samples, ShaderFrame& frame, ShaderPathFrame& paths);
  Status add_samples(int samples, const Progress& progress);
  Status take(const Tile& tile, int first, int count, const Progress& progress, double done_before);

  RendererImpl* renderer_;
  PathImageImpl* image_;
  PassFeatures features_;
  bool has_glass_;
  Places places_;
  std::uint64_t frame_address_ = 0;
  std::int32_t tile_edge_ = 0;
  Buffer counters_;  // on the device
  Buffer results_;   // their copy for the CPU
};

namespace {

const char* const kDoing = "path tracing";
constexpr int kSamplesAtOnce = 16;  // samples of a tile between progress reports
constexpr int kDispatchesAtOnce = 8;
constexpr int kFewSamples = 4;  // fewer samples finish before larger buffers are allocated

double capped(double value) {
  return std::min(value, 1e30);
}

// Sets the options. `from`: the origin of view space in the world.
void put_options(const Camera& camera, const PathOptions& options, DVec3 from, ShaderPathFrame& frame) {
  const Environment& environment = *options.environment;
  if (environment.sky.background) frame.background = Vec4(*environment.sky.background, 1.0F);
  if (const auto& ground = environment.ground) {
    frame.flags |= kPathGround | (ground->only_shadows ? kPathOnlyShadows : 0);
    frame.ground = Vec4(ground->colour, static_cast<float>(ground->height - from.y));
    frame.environment.z = static_cast<float>(ground->fade);
  }
  if (const auto& fog = environment.fog) {
    frame.flags |= kPathFog;
    frame.fog = Vec4(fog->colour, static_cast<float>(fog->top - from.y));
    frame.air.x = static_cast<float>(fog->density);
    frame.air.y = static_cast<float>(fog->anisotropy);
  }
  frame.air.z = static_cast<float>(environment.lamp_brightness);
  frame.lens_right = to_vec4(camera.right, capped(options.lens.radius));
  frame.lens_up = to_vec4(camera.up, capped(options.lens.focus_distance));
  frame.lens_blades = options.lens.blades;
  const double turns = options.lens.turn_radians / (2.0 * std::numbers::pi);
  frame.lens_turn = static_cast<float>(turns - std::floor(turns));
  frame.max_bounces = options.max_bounces;
  frame.max_scatterings = options.max_scatterings;
  frame.seed = options.seed;
  if (options.layers) frame.flags |= kPathLayers;
  frame.sum_pitch = options.layers ? kPathSumsWithLayers : kPathSums;
}

// Returns the tile edge. Graphics hardware needs many pixels at a time to be busy; glass lists may take a sixteenth of
// its memory.
int tile_edge(const Device& device, int samples, bool has_glass) {
  if (device.physical().type == VK_PHYSICAL_DEVICE_TYPE_CPU) return 128;
  constexpr int kEdge = 1024;
  VkDeviceSize most = 0;
  const VkPhysicalDeviceMemoryProperties& memory = device.memory();
  for (const VkMemoryHeap& heap : std::span(memory.memoryHeaps, memory.memoryHeapCount)) {
    if ((heap.flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) != 0) most = std::max(most, heap.size);
  }
  const bool has_room = !has_glass || VkDeviceSize{kEdge} * kEdge * kBodies * kBodyBytes <= most / 16;
  return samples > kFewSamples && has_room ? kEdge : kEdge / 2;
}

}  // namespace

PathPass::PathPass(RendererImpl& renderer, PathImageImpl& image)
    : renderer_(&renderer),
      image_(&image),
      features_(renderer.features_of(renderer.scene.placement())),
      has_glass_(renderer.scene.placement().has_transparent),
      places_(renderer.memory, kDoing) {}

Status PathPass::put_lamps(DVec3 view_origin, ShaderPathFrame& paths) {
  const path::PathLamps* const lamps = renderer_->paths->tables.lamps();
  if (lamps == nullptr || lamps->empty()) return {};
  const LampTables tables = lamp_tables(*lamps, renderer_->texels, view_origin);
  paths.lamp_count = static_cast<std::uint32_t>(tables.lamps.size());
  Status done = places_.upload(tables.lamps, paths.lamps);
  if (done) done = places_.upload(tables.nodes, paths.lamp_nodes);
  return done;
}

Status PathPass::put_tile_buffers(int samples, ShaderFrame& frame, ShaderPathFrame& paths) {
  const PathOptions& options = image_->options;
  tile_edge_ = tile_edge(*renderer_->device, samples, has_glass_);
  const auto pixels = static_cast<std::size_t>(std::min(tile_edge_, options.width)) *
                      static_cast<std::size_t>(std::min(tile_edge_, options.height));
  for (Buffer* buffer : {&counters_, &results_}) {
    const auto where = buffer == &counters_ ? Buffer::Where::Device : Buffer::Where::Read;
    auto made = Buffer::create(*renderer_->device, sizeof(ShaderCounters), where, kDoing);
    if (!made) return made.error();
    *buffer = std::move(*made);
  }
  frame.counters = counters_.address();
  paths.sums = image_->sums.address();
  if (image_->parts.size() > 0) paths.parts = image_->parts.address();
  Status done = places_.reserve(pixels * kPathStateBytes, paths.states);
  if (done && has_glass_) done = places_.reserve(pixels * kBodies * kBodyBytes, frame.bodies);
  return done;
}

Status PathPass::put_frame(int samples) {
  const PathOptions& options = image_->options;
  const Camera& camera = image_->camera;
  RenderOptions plain;
  plain.width = options.width;
  plain.height = options.height;
  plain.environment = options.environment;
  const Placement& placement = renderer_->scene.placement();
  FrameData data = make_frame(placement, camera, plain);
  ShaderFrame& frame = data.frame;
  const DVec3 view_origin = camera.position + data.view_origin;
  ShaderPathFrame paths;
  Status done = renderer_->paths->tables.put(renderer_->memory, placement, options, paths);
  if (!done) return done;
  put_options(camera, options, view_origin, paths);
  const bool has_media = options.environment->fog.has_value() || renderer_->paths->tables.has_clouds();
  if (options.denoise && has_media) paths.flags |= kPathMedia;
  const SkyColours& gradient = renderer_->paths->tables.sky().gradient();
  frame.sky_zenith = Vec4(gradient.zenith, 0.0F);
  frame.sky_horizon = Vec4(gradient.horizon, 0.0F);
  frame.sky_ground = Vec4(gradient.ground, 0.0F);
  frame.grids = placement.grids;
  frame.surfaces = renderer_->paths->tables.surfaces_address();
  frame.last_surface = renderer_->paths->tables.last_surface();
  renderer_->scene.put_shapes_in(frame);
  renderer_->textures.put_in(frame);
  done = put_lamps(view_origin, paths);
  if (done) done = places_.upload(data.placed, frame.placed);
  if (done) done = places_.upload(data.tree, frame.tree);
  if (done) done = places_.upload(data.leaves, frame.leaves);
  if (done) done = put_tile_buffers(samples, frame, paths);
  if (done) done = places_.upload(std::vector<ShaderPathFrame>{paths}, frame.paths);
  if (done) done = places_.upload(std::vector<ShaderFrame>{frame}, frame_address_);
  if (done) done = renderer_->memory.flush();
  return done;
}

// Takes some samples of a tile. `done_before`: progress of the image before it.
Status PathPass::take(const Tile& tile, int first, int count, const Progress& progress, double done_before) {
  QUOIN_ASSERT(frame_address_ != 0 && first >= 0 && count > 0, "samples of a frame that was sent");
  PathPush push;
  push.frame = frame_address_;
  push.corner_x = tile.x;
  push.corner_y = tile.y;
  push.size_x = tile.width;
  push.size_y = tile.height;
  push.first = static_cast<std::uint32_t>(first);
  push.count = static_cast<std::uint32_t>(count);
  push.width = static_cast<std::uint32_t>(image_->options.width);
  push.begins = 1;
  const Api& api = renderer_->device->api();
  for (;;) {
    Status done = renderer_->device->run(kDoing, [&](VkCommandBuffer commands) {
      for (int i = 0; i < kDispatchesAtOnce; ++i) {
        api.vkCmdFillBuffer(commands, counters_.handle(), offsetof(ShaderCounters, pending), 4, 0);
        renderer_->device->separate(commands);
        renderer_->paths->pipelines->dispatch(commands, features_, has_glass_, push);
        push.begins = 0;
      }
      const VkBufferCopy all{0, 0, sizeof(ShaderCounters)};
      api.vkCmdCopyBuffer(commands, counters_.handle(), results_.handle(), 1, &all);
    });
    if (!done) return done;
    if (progress && !progress(done_before)) return make_error(ErrorCode::Cancelled, "cancelled");
    ShaderCounters counters;
    std::memcpy(&counters, results_.mapped(), sizeof counters);
    if (counters.pending == 0) return {};
  }
}

Status PathPass::add_samples(int samples, const Progress& progress) {
  const PathOptions& options = image_->options;
  std::vector<Tile> tiles;
  for (std::int32_t y = 0; y < options.height; y += tile_edge_) {
    for (std::int32_t x = 0; x < options.width; x += tile_edge_) {
      tiles.push_back({x, y, std::min(tile_edge_, options.width - x), std::min(tile_edge_, options.height - y)});
    }
  }
  const double all = static_cast<double>(tiles.size()) * samples;
  double count = 0.0;
  for (const Tile& tile : tiles) {
    for (int first = 0; first < samples; first += kSamplesAtOnce) {
      const int some = std::min(kSamplesAtOnce, samples - first);
      if (Status done = take(tile, image_->samples + first, some, progress, count / all); !done) return done;
      count += some;
    }
  }
  if (progress && !progress(1.0)) return make_error(ErrorCode::Cancelled, "cancelled");
  return {};
}

Status PathPass::draw(int samples, const Progress& progress) {
  Status done = renderer_->paths->pipelines->prepare(features_, has_glass_);
  if (done) done = put_frame(samples);
  if (done) {
    done = renderer_->device->run(kDoing, [&](VkCommandBuffer commands) {
      renderer_->device->api().vkCmdFillBuffer(commands, counters_.handle(), 0, sizeof(ShaderCounters), 0);
    });
  }
  if (done) done = add_samples(samples, progress);
  // Incomplete sums, with tiles missing, are discarded.
  if (!done) {
    image_->samples = 0;
    return done;
  }
  ShaderCounters counters;
  std::memcpy(&counters, results_.mapped(), sizeof counters);
  image_->samples += samples;
  image_->rays += counters.rays();
  return done;
}

}  // namespace quoin::vulkan

namespace quoin {

Status VulkanRenderer::draw_paths(VulkanPathImage& image, const Camera& camera, const PathOptions& asked,
                                  Accumulation accumulation, const Progress& progress) {
  const PathOptions options = with_environment(asked, impl_->environment);
  if (Status status = path::check(camera, options); !status) return status;
  vulkan::PathImageImpl& target = image.impl();
  if (target.device != impl_->device.get()) {
    return make_error(ErrorCode::InvalidArgument, "vulkan: the image belongs to another renderer");
  }
  const bool has_another_size = target.options.width != options.width || target.options.height != options.height;
  if (accumulation == Accumulation::Restart || target.samples == 0 || has_another_size) {
    if (Status begun = target.begin(camera, options); !begun) return begun;
  }
  PathOptions as_before = options;
  as_before.samples = target.options.samples;
  QUOIN_ASSERT(target.camera == camera, "all samples of an image have the same camera");
  QUOIN_ASSERT(target.options == as_before, "all samples of an image have the same options");
  if (target.samples + options.samples > path::kMaxPathSamples) {
    return make_error(ErrorCode::LimitExceeded,
                      "vulkan: a path-traced image accumulates at most 65,536 samples per pixel");
  }
  if (impl_->paths == nullptr) {
    auto made = vulkan::PathPipelines::create(*impl_->device);
    if (!made) return made.error();
    impl_->paths = std::make_shared<vulkan::PathScene>(std::move(*made));
  }
  if (std::exchange(impl_->paths->update_count, impl_->update_count) != impl_->update_count) {
    impl_->paths->tables.look_at(impl_->voxels);
  }
  vulkan::PathPass pass(*impl_, target);
  return pass.draw(options.samples, progress);
}

Result<PathImage> VulkanRenderer::render_paths(const Camera& camera, const PathOptions& options, Threads threads,
                                               const Progress& progress) {
  VulkanPathImage image(*this);
  if (Status done = draw_paths(image, camera, options, Accumulation::Restart, progress); !done) {
    return done.error();
  }
  return image.read(threads);
}

}  // namespace quoin
