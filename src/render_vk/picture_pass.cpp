#include "render_vk/picture_pass.h"

#include <algorithm>
#include <cstring>

#include "light/occlusion_directions.h"
#include "render/camera_rays.h"
#include "render/picture_request.h"

namespace quoin::vulkan {
namespace {

constexpr std::int32_t kTileEdge = 256;
constexpr std::int32_t kTileEdgeWithGlass = 128;
// A batch of commands should be over before anything thinks that the device hangs.
constexpr std::int64_t kMostRays = std::int64_t{1} << 22;
const char* const kDoing = "drawing";

// The edge of the tiles, a power of two.
std::int32_t tile_edge(const RenderOptions& options, bool has_glass) {
  const LightOptions& light = options.light;
  const std::int64_t rays = 2 + (light.occlusion == OcclusionMode::Rays ? light.occlusion_rays : 0);
  std::int32_t edge = has_glass ? kTileEdgeWithGlass : kTileEdge;
  while (edge > 16 && std::int64_t{edge} * edge * rays > kMostRays) edge /= 2;
  return edge;
}

}  // namespace

PicturePass::~PicturePass() {
  memory_->discard();
  for (Place& place : places_) memory_->release(place);
}

Status PicturePass::reserve(std::size_t bytes, std::uint64_t& address) {
  const auto place = memory_->allocate(bytes, kDoing);
  if (!place) return tl::unexpected(place.error());
  places_.push_back(*place);
  address = place->address;
  return {};
}

template <class T>
Status PicturePass::upload(const std::vector<T>& values, std::uint64_t& address) {
  const auto bytes = std::as_bytes(std::span(values));
  if (bytes.empty()) return {};
  if (Status done = reserve(bytes.size(), address); !done) return done;
  return memory_->write(places_.back(), bytes);
}

Status PicturePass::put_frame(const Camera& camera, const RenderOptions& options) {
  FrameData data = make_frame(*scene_, camera, options);
  frame_ = data.frame;
  frame_.grids = scene_->grids_address();
  frame_.surfaces = scene_->surfaces_address();
  Status done = upload(data.placed, frame_.placed);
  if (done) done = upload(data.tree, frame_.tree);
  if (done) done = upload(data.leaves, frame_.leaves);
  if (done) done = upload(data.directions, frame_.directions);
  if (done) done = upload(data.turns, frame_.turns);
  if (done) done = upload(srgb_thresholds(), frame_.thresholds);
  if (done) done = make_tile_buffers(options);
  if (done) done = upload(std::vector<ShaderFrame>{frame_}, frame_address_);
  if (done) done = memory_->flush();
  return done;
}

Status PicturePass::make_tile_buffers(const RenderOptions& options) {
  const bool has_glass = scene_->has_transparent();
  tile_edge_ = tile_edge(options, has_glass);
  const auto pixels = static_cast<std::size_t>(std::min(tile_edge_, options.width)) *
                      static_cast<std::size_t>(std::min(tile_edge_, options.height));
  const VkDeviceSize bytes = pixels * 8 + sizeof(ShaderCounters) + 16;
  for (Buffer* buffer : {&output_, &results_}) {
    const auto where = buffer == &output_ ? Buffer::Where::Device : Buffer::Where::Read;
    auto made = Buffer::create(*device_, bytes, where, kDoing);
    if (!made) return tl::unexpected(made.error());
    *buffer = std::move(*made);
  }
  frame_.counters = output_.address();
  frame_.colours = output_.address() + sizeof(ShaderCounters);
  frame_.depths = frame_.colours + pixels * 4;
  Status done = reserve(pixels * kPointBytes, frame_.points);
  if (done) done = reserve(pixels * kStateBytes, frame_.states);
  if (done) done = reserve(pixels * kSumBytes, frame_.sums);
  if (!has_glass) return done;
  if (done) done = reserve(pixels * kBodies * kBodyBytes, frame_.bodies);
  if (done) done = reserve(pixels * kBodies * kBodyBytes, frame_.sun_bodies);
  return done;
}

ShaderPush PicturePass::push_for(const Tile& tile) const {
  ShaderPush push;
  push.frame = frame_address_;
  push.corner_x = tile.x;
  push.corner_y = tile.y;
  push.size_x = tile.width;
  push.size_y = tile.height;
  return push;
}

Status PicturePass::take_sample(const Tile& tile, int sample) {
  ShaderPush push = push_for(tile);
  const PixelPoint point = sample_point(sample);
  push.point_x = static_cast<float>(point.x);
  push.point_y = static_cast<float>(point.y);
  push.point_low_x = static_cast<float>(point.x - static_cast<double>(push.point_x));
  push.point_low_y = static_cast<float>(point.y - static_cast<double>(push.point_y));
  push.seed = hash_of(static_cast<std::uint32_t>(sample), 0);
  push.first = sample == 0 ? 1 : 0;
  const bool has_glass = scene_->has_transparent();
  Status done = device_->run(kDoing, [&](VkCommandBuffer commands) {
    pipelines_->dispatch(commands, Pass::Primary, push);
    if (has_glass) return;
    pipelines_->dispatch(commands, Pass::Light, push);
  });
  return done && has_glass ? finish_glass(push) : done;
}

// Bodies of glass are lit as many at a time as there is room for, until no pixel has more.
Status PicturePass::finish_glass(ShaderPush push) {
  for (;;) {
    Status done = device_->run(kDoing, [&](VkCommandBuffer commands) {
      const VkDeviceSize pending = offsetof(ShaderCounters, pending);
      device_->api().vkCmdFillBuffer(commands, output_.handle(), pending, 4, 0);
      device_->separate(commands);
      pipelines_->dispatch(commands, Pass::Glass, push);
      pipelines_->dispatch(commands, Pass::LightWithGlass, push);
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

Status PicturePass::read_tile(const Tile& tile, Picture& picture) {
  Status done = device_->run(kDoing, [&](VkCommandBuffer commands) {
    pipelines_->dispatch(commands, Pass::Resolve, push_for(tile));
    const VkBufferCopy all{0, 0, output_.size()};
    device_->api().vkCmdCopyBuffer(commands, output_.handle(), results_.handle(), 1, &all);
  });
  if (!done) return done;
  const std::byte* colours = results_.mapped() + (frame_.colours - frame_.counters);
  const std::byte* depths = results_.mapped() + (frame_.depths - frame_.counters);
  const auto columns = static_cast<std::size_t>(tile.width);
  for (std::int32_t y = 0; y < tile.height; ++y) {
    const std::size_t from = static_cast<std::size_t>(y) * columns;
    const std::size_t to = static_cast<std::size_t>(tile.y + y) * static_cast<std::size_t>(picture.colour.width) +
                           static_cast<std::size_t>(tile.x);
    for (std::size_t x = 0; x < columns; ++x) {
      std::memcpy(picture.colour.rgb.data() + 3 * (to + x), colours + 4 * (from + x), 3);
    }
    if (picture.depth.values.empty()) continue;
    std::memcpy(picture.depth.values.data() + to, depths + 4 * from, 4 * columns);
  }
  return {};
}

Status PicturePass::read_counters(ShaderCounters& counters) {
  Status done = device_->run(kDoing, [&](VkCommandBuffer commands) {
    const VkBufferCopy region{0, 0, sizeof(ShaderCounters)};
    device_->api().vkCmdCopyBuffer(commands, output_.handle(), results_.handle(), 1, &region);
  });
  if (done) std::memcpy(&counters, results_.mapped(), sizeof counters);
  return done;
}

Result<Picture> PicturePass::render(const Camera& camera, const RenderOptions& options, const Progress& progress) {
  Status done = put_frame(camera, options);
  if (done) {
    done = device_->run(kDoing, [&](VkCommandBuffer commands) {
      device_->api().vkCmdFillBuffer(commands, output_.handle(), 0, sizeof(ShaderCounters), 0);
    });
  }
  Picture picture = empty_picture(options);
  const std::int64_t across = (options.width + tile_edge_ - 1) / std::max(tile_edge_, 1);
  const std::int64_t down = (options.height + tile_edge_ - 1) / std::max(tile_edge_, 1);
  const auto all = static_cast<double>(across * down * options.samples);
  for (std::int64_t i = 0; i < across * down && done; ++i) {
    const auto x = static_cast<std::int32_t>(i % across) * tile_edge_;
    const auto y = static_cast<std::int32_t>(i / across) * tile_edge_;
    const Tile tile{x, y, std::min(tile_edge_, options.width - x), std::min(tile_edge_, options.height - y)};
    for (int sample = 0; sample < options.samples && done; ++sample) {
      done = take_sample(tile, sample);
      if (!done || !progress) continue;
      const auto count = static_cast<double>(i * options.samples + sample + 1);
      if (!progress(count / all)) return fail(ErrorCode::Cancelled, "cancelled");
    }
    if (done) done = read_tile(tile, picture);
  }
  ShaderCounters counters;
  if (done) done = read_counters(counters);
  if (!done) return tl::unexpected(done.error());
  picture.rays = static_cast<std::int64_t>(counters.rays_low | std::uint64_t{counters.rays_high} << 32);
  picture.pixels_hit = counters.hits;
  return picture;
}

}  // namespace quoin::vulkan
