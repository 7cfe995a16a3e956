#include "render_vk/paths/path_pass.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>
#include <utility>

#include <quoin/core/assert.h>

#include "render/path/path_request.h"
#include "render_vk/march/frame.h"

namespace quoin {
namespace vulkan {
namespace {

const char* const kDoing = "path tracing";
constexpr int kSamplesAtOnce = 16;  // samples of a tile between progress reports
constexpr int kDispatchesAtOnce = 8;
constexpr int kFewSamples = 4;  // fewer samples finish before larger buffers are allocated

Vec4 to_vec4(DVec3 v, double w = 0.0) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), static_cast<float>(w)};
}

double capped(double value) {
  return std::min(value, 1e30);
}

// Sets the options. `from`: the origin of view space in the world.
void put_options(const Camera& camera, const PathOptions& options, DVec3 from, ShaderPathFrame& frame) {
  if (options.background) frame.background = Vec4(*options.background, 1.0F);
  if (const auto& ground = options.ground) {
    frame.flags |= kPathGround | (ground->only_shadows ? kPathOnlyShadows : 0);
    frame.ground = Vec4(ground->colour, static_cast<float>(ground->height - from.y));
    frame.environment.z = static_cast<float>(ground->fade);
  }
  if (const auto& fog = options.fog) {
    frame.flags |= kPathFog;
    frame.fog = Vec4(fog->colour, static_cast<float>(fog->top - from.y));
    frame.air.x = static_cast<float>(fog->density);
    frame.air.y = static_cast<float>(fog->anisotropy);
  }
  frame.air.z = static_cast<float>(options.lamp_brightness);
  frame.lens_right = to_vec4(camera.right, capped(options.lens_radius));
  frame.lens_up = to_vec4(camera.up, capped(options.focus_distance));
  frame.lens_blades = options.lens_blades;
  const double turns = options.lens_turn_radians / (2.0 * std::numbers::pi);
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
    : renderer_(&renderer), image_(&image), places_(renderer.memory, kDoing) {}

Status PathPass::put_lamps(DVec3 view_origin, ShaderPathFrame& paths) {
  const path::PathLamps* const lamps = renderer_->paths->tables.lamps();
  if (lamps == nullptr || lamps->empty()) return {};
  const LampTables tables = lamp_tables(*lamps, view_origin);
  paths.lamp_count = static_cast<std::uint32_t>(tables.lamps.size());
  Status done = places_.upload(tables.lamps, paths.lamps);
  if (done) done = places_.upload(tables.nodes, paths.lamp_nodes);
  return done;
}

Status PathPass::put_tile_buffers(int samples, ShaderFrame& frame, ShaderPathFrame& paths) {
  const PathOptions& options = image_->options;
  const bool has_glass = renderer_->scene.placement().has_transparent;
  tile_edge_ = tile_edge(*renderer_->device, samples, has_glass);
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
  if (done && has_glass) done = places_.reserve(pixels * kBodies * kBodyBytes, frame.bodies);
  return done;
}

Status PathPass::put_frame(int samples) {
  const PathOptions& options = image_->options;
  const Camera& camera = image_->camera;
  RenderOptions plain;
  plain.width = options.width;
  plain.height = options.height;
  const Placement& placement = renderer_->scene.placement();
  FrameData data = make_frame(placement, camera, plain);
  ShaderFrame& frame = data.frame;
  const DVec3 view_origin = camera.position + data.view_origin;
  ShaderPathFrame paths;
  Status done = renderer_->paths->tables.put(renderer_->memory, placement, options, paths);
  if (!done) return done;
  put_options(camera, options, view_origin, paths);
  if (options.denoise && (options.fog.has_value() || renderer_->paths->tables.has_clouds())) paths.flags |= kPathMedia;
  const SkyColours& gradient = renderer_->paths->tables.sky().gradient();
  frame.sky_zenith = Vec4(gradient.zenith, 0.0F);
  frame.sky_horizon = Vec4(gradient.horizon, 0.0F);
  frame.sky_ground = Vec4(gradient.ground, 0.0F);
  frame.grids = placement.grids;
  frame.surfaces = renderer_->paths->tables.surfaces_address();
  frame.last_surface = renderer_->paths->tables.last_surface();
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
        renderer_->paths->pipelines->dispatch(commands, renderer_->scene.placement(), push);
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
  Status done = renderer_->paths->pipelines->prepare(renderer_->scene.placement());
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

}  // namespace vulkan

Status VulkanRenderer::draw_paths(VulkanPathImage& image, const Camera& camera, const PathOptions& options,
                                  Accumulation accumulation, const Progress& progress) {
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
