#include "render/vulkan/raster/mesh_pass.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/render/impostor.h>

#include "render/vulkan/raster/mesh_pipelines.h"

namespace quoin::vulkan {
namespace {

VkResult allocate(const Device& device, VkImage image, VkDeviceMemory& memory) {
  VkMemoryRequirements needs{};
  device.api().vkGetImageMemoryRequirements(device.handle(), image, &needs);
  VkResult result = VK_ERROR_OUT_OF_DEVICE_MEMORY;
  for (const VkMemoryPropertyFlags wanted : {VkMemoryPropertyFlags{VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT}, 0U}) {
    const auto type = memory_type(device.memory(), needs.memoryTypeBits, wanted);
    if (!type) continue;
    const std::uint32_t heap = device.memory().memoryTypes[*type].heapIndex;
    if (needs.size > device.memory().memoryHeaps[heap].size) continue;
    const VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, nullptr, needs.size, *type};
    result = device.api().vkAllocateMemory(device.handle(), &info, nullptr, &memory);
    if (result == VK_SUCCESS) return result;
  }
  return result;
}

}  // namespace

Result<Attachment> Attachment::create(const Device& device, const Kind& kind, VkExtent2D size, std::uint32_t samples,
                                      const std::string& doing) {
  const Api& api = device.api();
  Attachment made;
  made.device_ = &device;
  auto info = info_of<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = kind.format;
  info.extent = {size.width, size.height, 1};
  info.mipLevels = 1;
  info.arrayLayers = 1;
  info.samples = static_cast<VkSampleCountFlagBits>(samples);
  info.usage = kind.usage;
  VkResult result = api.vkCreateImage(device.handle(), &info, nullptr, &made.image_);
  if (result == VK_SUCCESS) result = allocate(device, made.image_, made.memory_);
  if (result == VK_SUCCESS) result = api.vkBindImageMemory(device.handle(), made.image_, made.memory_, 0);
  if (result == VK_SUCCESS) {
    auto view = info_of<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
    view.image = made.image_;
    view.viewType = VK_IMAGE_VIEW_TYPE_2D;
    view.format = kind.format;
    view.subresourceRange = {kind.aspect, 0, 1, 0, 1};
    result = api.vkCreateImageView(device.handle(), &view, nullptr, &made.view_);
  }
  if (Status status = device.check(result, doing); !status) return status.error();
  return made;
}

Attachment::~Attachment() {
  if (device_ == nullptr) return;
  const Api& api = device_->api();
  if (view_ != VK_NULL_HANDLE) api.vkDestroyImageView(device_->handle(), view_, nullptr);
  if (image_ != VK_NULL_HANDLE) api.vkDestroyImage(device_->handle(), image_, nullptr);
  if (memory_ != VK_NULL_HANDLE) api.vkFreeMemory(device_->handle(), memory_, nullptr);
}

void Attachment::swap(Attachment& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(image_, other.image_);
  std::swap(memory_, other.memory_);
  std::swap(view_, other.view_);
}

Result<MeshTarget> MeshTarget::create(const Device& device, VkRenderPass pass, VkExtent2D size, std::uint32_t samples) {
  QUOIN_ASSERT(size.width > 0 && size.height > 0 && samples > 0, "a positive size and sample count");
  const std::string doing = "allocating an image";
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

namespace {

const char* const kDoing = "drawing meshes";
// Number of quads that 16-bit indices reach; more quads take several draws.
constexpr std::uint32_t kQuadsAtOnce = 16'384;
constexpr VkDeviceSize kAlignment = 32;

VkDeviceSize aligned(VkDeviceSize size) {
  return (size + kAlignment - 1) / kAlignment * kAlignment;
}

template <class T>
VkDeviceSize bytes_of(const std::vector<T>& values) {
  return values.size() * sizeof(T);
}

}  // namespace

/// One traversal of the draws, in one mode.
struct MeshPass::Step {
  enum class Over : std::uint8_t {
    Sky,
    Opaque,  ///< the nearest first
    All,     ///< transparent quads like others
    GlassInOrder,
    GlassByChunk,  ///< the furthest first
  };
  enum class Styles : std::uint8_t { All, Blocky, Smooth };
  Over over;
  std::uint32_t mode = kDrawSurfaces;
  VkPipeline blocky = VK_NULL_HANDLE;  // or the sky's
  std::array<VkPipeline, 2> smooth{};  // mirrored: 1
  VkPipeline cutouts = VK_NULL_HANDLE;
  VkPipeline shapes = VK_NULL_HANDLE;
  VkPipeline far = VK_NULL_HANDLE;  // impostors
  bool is_backwards = false;        // keeps the result for equally near surfaces: the first in normal order wins
  Styles styles = Styles::All;

  [[nodiscard]] bool is_glass() const { return over == Over::GlassInOrder || over == Over::GlassByChunk; }
  [[nodiscard]] bool draws(const MeshDraw& draw) const {
    const SurfaceStyle style = draw.mesh->style;
    if (styles != Styles::All && (styles == Styles::Smooth) != (style == SurfaceStyle::Smooth)) return false;
    return is_glass() ? draw.mesh->has_glass() : !(draw.is_far && over == Over::Opaque);
  }
  // Quads of transparent types are drawn with their textures, apart from the others.
  [[nodiscard]] bool has_cutouts(const MeshFrameData& data) const {
    return data.has_cutouts && !is_glass() && (mode == kDrawSurfaces || mode == kDrawDepth);
  }
  [[nodiscard]] bool draws(const MeshDraw& draw, MeshFaces faces) const {
    const StoredMesh& mesh = *draw.mesh;
    if (faces == MeshFaces::Cutouts) return !mesh.glass.empty();
    if (styles == Styles::Smooth || mesh.shapes.count == 0) return false;
    return is_glass() ? !mesh.shapes.glass.empty() : !draw.is_far;
  }
};

Result<std::unique_ptr<MeshPass>> MeshPass::create(Device& device, DeviceMemory& memory) {
  const std::string& name = device.description().name;
  if (!device.physical().draws_triangles) {
    return make_error(ErrorCode::Unsupported, "vulkan: " + name + ": its compute queue does not support graphics");
  }
  VkFormatProperties depths{};
  device.api().vkGetPhysicalDeviceFormatProperties(device.physical().handle, kMeshDepth, &depths);
  if ((depths.optimalTilingFeatures & VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT) == 0) {
    return make_error(ErrorCode::Unsupported, "vulkan: " + name + " lacks 32-bit float depth buffers");
  }
  std::unique_ptr<MeshPass> pass(new MeshPass(device, memory));
  if (Status opened = pass->open(); !opened) return opened.error();
  return pass;
}

Status MeshPass::open() {
  VkPhysicalDeviceProperties properties{};
  device_->api().vkGetPhysicalDeviceProperties(device_->physical().handle, &properties);
  const VkPhysicalDeviceLimits& limits = properties.limits;
  sample_counts_ = limits.framebufferColorSampleCounts & limits.framebufferDepthSampleCounts;
  largest_edge_ = std::min({limits.maxFramebufferWidth, limits.maxFramebufferHeight, limits.maxImageDimension2D,
                            limits.maxViewportDimensions[0], limits.maxViewportDimensions[1]});
  subpixels_ = 1 << std::min(limits.subPixelPrecisionBits, 16U);
  auto pipelines = MeshPipelines::create(*device_);
  if (!pipelines) return pipelines.error();
  pipelines_ = std::move(*pipelines);
  return put_corners();
}

MeshPass::~MeshPass() {
  memory_->release(corners_);
}

std::uint32_t MeshPass::samples_for(int wanted) const {
  QUOIN_ASSERT(wanted > 0, "at least one sample");
  auto samples = static_cast<std::uint32_t>(wanted);
  while (samples > 1 && (sample_counts_ & samples) == 0) samples /= 2;
  return samples;
}

Status MeshPass::put_corners() {
  std::vector<std::uint16_t> indices;
  for (std::uint32_t quad = 0; quad < kQuadsAtOnce; ++quad) {
    for (const std::uint32_t corner : {0, 1, 2, 0, 2, 3}) {
      indices.push_back(static_cast<std::uint16_t>(4 * quad + corner));
    }
  }
  const auto place = memory_->allocate(bytes_of(indices), kDoing);
  if (!place) return place.error();
  corners_ = *place;
  Status done = memory_->write(corners_, std::as_bytes(std::span(indices)));
  if (done) done = memory_->flush();
  if (!done) memory_->discard();
  return done;
}

Status MeshPass::grow(VkDeviceSize bytes) {
  if (staging_.size() >= bytes && frame_.size() >= bytes) return {};
  const VkDeviceSize size = bytes + bytes / 2;
  for (Buffer* buffer : {&staging_, &frame_}) {
    const auto where = buffer == &staging_ ? Buffer::Where::Upload : Buffer::Where::Device;
    *buffer = {};
    auto made = Buffer::create(*device_, size, where, kDoing);
    if (!made) return made.error();
    *buffer = std::move(*made);
  }
  return {};
}

// Writes the shader data of an image to the staging memory.
Status MeshPass::put_frame(MeshFrameData& data) {
  // Instances follow the frame of meshes.
  struct Part {
    const void* from;
    std::size_t bytes;
    std::uint64_t* address;
  };
  ShaderFrame& image = data.image.frame;
  const std::array<Part, 9> parts{{{&data.frame, sizeof data.frame, &data.push.frame},
                                   {data.instances.data(), bytes_of(data.instances), nullptr},
                                   {&image, sizeof image, &data.frame.frame},
                                   {data.glass.data(), bytes_of(data.glass), &data.frame.draws},
                                   {data.order.data(), bytes_of(data.order), &data.frame.order},
                                   {data.image.placed.data(), bytes_of(data.image.placed), &image.placed},
                                   {data.image.tree.data(), bytes_of(data.image.tree), &image.tree},
                                   {data.image.leaves.data(), bytes_of(data.image.leaves), &image.leaves},
                                   {data.lamps.data(), bytes_of(data.lamps), &image.lamps}}};
  static_assert(sizeof(ShaderMeshFrame) % 16 == 0);
  std::array<std::uint64_t, parts.size()> offsets{};
  frame_bytes_ = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    offsets[i] = frame_bytes_;
    frame_bytes_ += i == 0 ? parts[i].bytes : aligned(parts[i].bytes);
  }
  if (Status done = grow(frame_bytes_ + kAlignment); !done) return done;
  QUOIN_ASSERT(frame_bytes_ <= staging_.size() && staging_.mapped() != nullptr, "room for the frame");
  // The allocation left room for this alignment.
  frame_address_ = aligned(frame_.address());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].address != nullptr) *parts[i].address = frame_address_ + offsets[i];
  }
  data.sky.frame = data.push.frame;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].bytes > 0) std::memcpy(staging_.mapped() + offsets[i], parts[i].from, parts[i].bytes);
  }
  return {};
}

// Prepares the frame's data and the images.
Status MeshPass::prepare(MeshFrameData& data, VkExtent2D size, std::uint32_t samples) {
  if (Status done = put_frame(data); !done) return done;
  if (target_.is_of(size, samples)) return {};
  target_ = {};
  const auto pass = pipelines_->render_pass(samples);
  if (!pass) return pass.error();
  auto target = MeshTarget::create(*device_, *pass, size, samples);
  if (!target) return target.error();
  target_ = std::move(*target);
  return {};
}

std::vector<MeshPass::Step> MeshPass::steps_for(const MeshFrameData& data, Wireframe wireframe, MeshLight light) const {
  if (wireframe == Wireframe::Only) return {{Step::Over::Sky}, {Step::Over::All, kDrawEdgesOnly}};
  const bool shows_values = data.has(kShowOcclusion | kShowNormals);
  // Solid surfaces come first, so that less of the sky is drawn.
  const auto solid = shows_values ? Step::Over::All : Step::Over::Opaque;
  std::vector<Step> steps{{solid}, {Step::Over::Sky}};
  if (light != MeshLight::Plain) {
    steps.front().is_backwards = true;
    steps.insert(steps.begin(), {solid, kDrawDepth});
  }
  const bool has_edges = wireframe == Wireframe::Over;
  const auto add_nearest_glass = [&](Step::Styles styles) {
    for (const std::uint32_t mode : {kDrawGlassDepth, kDrawGlassPassed, kDrawGlassAdded}) {
      steps.push_back({Step::Over::GlassByChunk, mode});
      steps.back().styles = styles;
    }
  };
  if (data.glass_by_rays) {
    // Drawn before the glass, which would hide them.
    if (has_edges) steps.push_back({Step::Over::Opaque, kDrawEdgesOver});
    add_nearest_glass(Step::Styles::All);
    if (has_edges) steps.push_back({Step::Over::GlassByChunk, kDrawEdgesOver});
    return steps;
  }
  if (data.glass_quads > 0) {
    const auto over = data.glass_quads > kMaxOrdered ? Step::Over::GlassByChunk : Step::Over::GlassInOrder;
    for (std::uint32_t channel = 0; channel < 3; ++channel) {
      steps.push_back({over, kDrawGlass + channel});
      steps.back().styles = Step::Styles::Blocky;
    }
  }
  if (data.has_smooth_glass) add_nearest_glass(Step::Styles::Smooth);
  if (has_edges) steps.push_back({Step::Over::All, kDrawEdgesOver});
  return steps;
}

Status MeshPass::find_pipelines(std::vector<Step>& steps, std::uint32_t samples, MeshLight light,
                                const MeshFrameData& data) {
  for (Step& step : steps) {
    // Edges are as bright as their surface, but without shadows.
    const bool is_lit = step.over != Step::Over::Sky && (step.mode == kDrawSurfaces || is_channel_of_glass(step.mode));
    const bool is_coloured = data.has_textures && step.mode == kDrawSurfaces && step.over != Step::Over::Sky;
    const auto has_materials = [](const MeshDraw& draw) { return draw.mesh->with_materials != 0; };
    const bool is_coloured_smooth = is_coloured && std::ranges::any_of(data.draws, has_materials);
    const bool has_edges = step.mode == kDrawEdgesOver || step.mode == kDrawEdgesOnly;
    const bool is_textured_glass = data.has_textured_glass && step.is_glass() && !has_edges;
    const bool is_mixed = step.over == Step::Over::GlassInOrder && data.has_shape_glass;
    MeshLight lit = is_lit ? light : MeshLight::Plain;
    if (is_nearest_glass(step.mode)) lit = data.glass_by_rays ? MeshLight::TracedThroughGlass : light;
    const auto find = [&](MeshWay::What what, bool mirrored, VkPipeline& out,
                          MeshFaces faces = MeshFaces::Quads) -> Status {
      bool reads_textures = what == MeshWay::What::Smooth ? is_coloured_smooth : is_coloured || is_textured_glass;
      if (faces != MeshFaces::Quads) reads_textures = data.has_type_textures && !has_edges;
      const auto found = pipelines_->pipeline({what, step.mode, mirrored, step.over == Step::Over::GlassInOrder, faces,
                                               lit, data.glass_by_rays && is_nearest_glass(step.mode),
                                               lit != MeshLight::Plain && data.has_fields, reads_textures,
                                               lit != MeshLight::Plain && data.has_shapes,
                                               lit == MeshLight::TracedThroughGlass && data.has_cells, samples});
      if (!found) return found.error();
      out = *found;
      return {};
    };
    if (step.over == Step::Over::Sky) {
      if (Status done = find(MeshWay::What::Sky, false, step.blocky); !done) return done;
      continue;
    }
    Status done;
    for (const MeshDraw& draw : data.draws) {
      if (!done || !step.draws(draw)) continue;
      const bool is_smooth = draw.mesh->style == SurfaceStyle::Smooth;
      VkPipeline& pipeline = is_smooth ? step.smooth[draw.mirrored ? 1 : 0] : step.blocky;
      const auto what = is_smooth ? MeshWay::What::Smooth : MeshWay::What::Blocky;
      const MeshFaces faces = is_mixed && !is_smooth ? MeshFaces::Mixed : MeshFaces::Quads;
      if (pipeline == VK_NULL_HANDLE) done = find(what, is_smooth && draw.mirrored, pipeline, faces);
    }
    const auto any_draws = [&](MeshFaces faces) {
      return std::ranges::any_of(data.draws, [&](const MeshDraw& draw) { return step.draws(draw, faces); });
    };
    if (done && step.has_cutouts(data) && any_draws(MeshFaces::Cutouts)) {
      done = find(MeshWay::What::Blocky, false, step.cutouts, MeshFaces::Cutouts);
    }
    if (done && step.over != Step::Over::GlassInOrder && any_draws(MeshFaces::Shapes)) {
      done = find(MeshWay::What::Blocky, false, step.shapes, MeshFaces::Shapes);
    }
    if (done && !step.is_glass() && !data.far.empty()) done = find(MeshWay::What::Far, false, step.far);
    if (!done) return done;
  }
  return {};
}

Status MeshPass::draw(MeshFrameData& data, VkExtent2D size, std::uint32_t samples, Wireframe wireframe, MeshLight light,
                      const Buffer& colours) {
  std::vector<Step> steps = steps_for(data, wireframe, light);
  Status done = find_pipelines(steps, samples, light, data);
  if (done) done = prepare(data, size, samples);
  if (!done) return done;
  return device_->run(kDoing, [&](VkCommandBuffer commands) { record(commands, data, steps, colours); });
}

void MeshPass::copy_frame(VkCommandBuffer commands) const {
  const VkBufferCopy all{0, frame_address_ - frame_.address(), frame_bytes_};
  device_->api().vkCmdCopyBuffer(commands, staging_.handle(), frame_.handle(), 1, &all);
  // Also orders uploads by earlier commands before these.
  auto barrier = info_of<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
  barrier.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_INDEX_READ_BIT;
  device_->api().vkCmdPipelineBarrier(
      commands, VK_PIPELINE_STAGE_TRANSFER_BIT,
      VK_PIPELINE_STAGE_VERTEX_INPUT_BIT | VK_PIPELINE_STAGE_VERTEX_SHADER_BIT | VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT,
      0, 1, &barrier, 0, nullptr, 0, nullptr);
}

void MeshPass::record(VkCommandBuffer commands, const MeshFrameData& data, const std::vector<Step>& steps,
                      const Buffer& colours) const {
  const Api& api = device_->api();
  copy_frame(commands);
  const VkExtent2D size = target_.size();
  std::array<VkClearValue, 2> clear{};
  clear[1].depthStencil = {0.0F, 0};  // depths are reversed
  auto begin = info_of<VkRenderPassBeginInfo>(VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO);
  begin.renderPass = pipelines_->render_pass(target_.samples()).value();
  begin.framebuffer = target_.framebuffer();
  begin.renderArea.extent = size;
  begin.clearValueCount = clear.size();
  begin.pClearValues = clear.data();
  api.vkCmdBeginRenderPass(commands, &begin, VK_SUBPASS_CONTENTS_INLINE);
  const VkViewport viewport{0.0F, 0.0F, static_cast<float>(size.width), static_cast<float>(size.height), 0.0F, 1.0F};
  api.vkCmdSetViewport(commands, 0, 1, &viewport);
  const VkRect2D all{{0, 0}, size};
  api.vkCmdSetScissor(commands, 0, 1, &all);
  for (const Step& step : steps) record_step(commands, data, step);
  api.vkCmdEndRenderPass(commands);
  copy_image(commands, colours);
}

void MeshPass::record_step(VkCommandBuffer commands, const MeshFrameData& data, const Step& step) const {
  const Api& api = device_->api();
  if (step.over == Step::Over::Sky) {
    api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, step.blocky);
    push(commands, data.sky);
    return api.vkCmdDraw(commands, 3, 1, 0, 0);
  }
  ShaderMeshPush values = data.push;
  values.numbers |= step.mode;
  bind_corners(commands);
  if (step.over == Step::Over::GlassInOrder) {
    if (data.order.empty()) return;
    api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, step.blocky);
    push(commands, values);
    return draw_quads(commands, 0, static_cast<std::uint32_t>(data.order.size()));
  }
  if (step.is_backwards) {
    draw_far(commands, data, step);
    bind_corners(commands);
    draw_others(commands, data, step, MeshFaces::Shapes);
    draw_others(commands, data, step, MeshFaces::Cutouts);
  }
  draw_chunks(commands, data, step, values);
  if (step.is_backwards) return;
  draw_others(commands, data, step, MeshFaces::Cutouts);
  draw_others(commands, data, step, MeshFaces::Shapes);
  if (!step.is_glass()) draw_far(commands, data, step);
}

void MeshPass::draw_others(VkCommandBuffer commands, const MeshFrameData& data, const Step& step,
                           MeshFaces faces) const {
  const bool are_shapes = faces == MeshFaces::Shapes;
  const VkPipeline pipeline = are_shapes ? step.shapes : step.cutouts;
  if (pipeline == VK_NULL_HANDLE) return;
  device_->api().vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline);
  bind_corners(commands);
  const bool is_backwards = step.is_glass() || step.is_backwards;
  for (std::size_t i = 0; i < data.draws.size(); ++i) {
    const MeshDraw& draw = data.draws[is_backwards ? data.draws.size() - 1 - i : i];
    if (!step.draws(draw, faces)) continue;
    const StoredMesh& mesh = *draw.mesh;
    const ShaderMeshInstance& instance = data.instances[draw.instance];
    ShaderMeshPush values = data.push;
    values.numbers |= step.mode;
    values.clip = instance.clip;
    values.eye = instance.eye;
    values.room = instance.room;
    values.offset = {draw.offset.x, draw.offset.y, draw.offset.z};
    values.instance = draw.instance;
    values.data = are_shapes ? mesh.shapes.records : mesh.place.address;
    values.far_faces = mesh.shapes.faces;
    const std::uint32_t first = are_shapes ? mesh.shapes.opaque : mesh.opaque.back();
    const std::uint32_t end = are_shapes ? mesh.shapes.count : first + static_cast<std::uint32_t>(mesh.glass.size());
    if (are_shapes && !step.is_glass() && first > 0) {
      push(commands, values);
      draw_quads(commands, 0, first);
    }
    if (first == end) continue;
    values.numbers |= kMeshIsTransparent;
    if (step.over == Step::Over::Opaque) values.numbers |= kMeshSolidOnly;
    push(commands, values);
    draw_quads(commands, first, end);
  }
}

void MeshPass::draw_chunks(VkCommandBuffer commands, const MeshFrameData& data, const Step& step,
                           ShaderMeshPush values) const {
  VkPipeline bound = VK_NULL_HANDLE;
  const bool is_backwards = step.is_glass() || step.is_backwards;
  for (std::size_t i = 0; i < data.draws.size(); ++i) {
    const MeshDraw& draw = data.draws[is_backwards ? data.draws.size() - 1 - i : i];
    const bool is_smooth = draw.mesh->style == SurfaceStyle::Smooth;
    if (!step.draws(draw)) continue;
    const VkPipeline wanted = is_smooth ? step.smooth[draw.mirrored ? 1 : 0] : step.blocky;
    QUOIN_ASSERT(wanted != VK_NULL_HANDLE && draw.instance < data.instances.size(), "a pipeline, and an instance");
    if (wanted != bound) {
      device_->api().vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, wanted);
      if (!is_smooth) bind_corners(commands);
      bound = wanted;
    }
    values.data = draw.mesh->place.address;
    values.offset = {draw.offset.x, draw.offset.y, draw.offset.z};
    values.instance = draw.instance;
    const ShaderMeshInstance& instance = data.instances[draw.instance];
    values.clip = instance.clip;
    values.eye = instance.eye;
    values.room = instance.room;
    values.numbers = data.push.numbers | step.mode | draw.mesh->with_materials << kMeshVerticesShift;
    push(commands, values);
    draw_mesh(commands, draw, step);
  }
}

void MeshPass::draw_far(VkCommandBuffer commands, const MeshFrameData& data, const Step& step) const {
  if (data.far.empty()) return;
  QUOIN_ASSERT(step.far != VK_NULL_HANDLE, "a pipeline for impostors");
  device_->api().vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, step.far);
  bind_corners(commands);
  for (std::size_t i = 0; i < data.far.size(); ++i) {
    const FarDraw& draw = data.far[step.is_backwards ? data.far.size() - 1 - i : i];
    const ShaderMeshInstance& instance = data.instances[draw.instance];
    ShaderMeshPush values = data.push;
    values.clip = instance.clip;
    values.eye = instance.eye;
    values.room = instance.room;
    values.offset = {draw.offset.x, draw.offset.y, draw.offset.z};
    values.instance = draw.instance;
    values.data = draw.level.faces;
    values.far_faces = draw.faces;
    values.numbers |= step.mode | draw.numbers;
    push(commands, values);
    for (const auto& [first, end] : draw.runs) draw_quads(commands, first, end);
  }
}

void MeshPass::draw_mesh(VkCommandBuffer commands, const MeshDraw& draw, const Step& step) const {
  const StoredMesh& mesh = *draw.mesh;
  if (mesh.style == SurfaceStyle::Smooth) {
    device_->api().vkCmdBindIndexBuffer(commands, memory_->buffer_of(mesh.place), mesh.place.offset + mesh.first_index,
                                        VK_INDEX_TYPE_UINT32);
    QUOIN_ASSERT(mesh.glass_indices <= mesh.indices, "at most all indices");
    const std::uint32_t opaque = mesh.indices - mesh.glass_indices;
    const std::uint32_t first = step.is_glass() ? opaque : 0;
    const std::uint32_t end = step.is_glass() || step.over == Step::Over::All ? mesh.indices : opaque;
    if (first < end) device_->api().vkCmdDrawIndexed(commands, end - first, 1, first, 0, 0);
    return;
  }
  const std::uint32_t opaque = mesh.opaque.back();
  const auto all = opaque + static_cast<std::uint32_t>(mesh.glass.size());
  if (step.is_glass()) return draw_quads(commands, opaque, all);
  if (step.mode == kDrawEdgesOnly) return draw_quads(commands, draw.is_far ? opaque : 0, all);
  const bool with_glass = step.over == Step::Over::All && step.cutouts == VK_NULL_HANDLE;
  for (const auto& [first, end] : visible_quads(draw, with_glass)) draw_quads(commands, first, end);
}

void MeshPass::draw_quads(VkCommandBuffer commands, std::uint32_t first, std::uint32_t end) const {
  while (first < end) {
    const std::uint32_t count = std::min(end - first, kQuadsAtOnce);
    device_->api().vkCmdDrawIndexed(commands, 6 * count, 1, 0, static_cast<std::int32_t>(4 * first), 0);
    first += count;
  }
}

void MeshPass::bind_corners(VkCommandBuffer commands) const {
  device_->api().vkCmdBindIndexBuffer(commands, memory_->buffer_of(corners_), corners_.offset, VK_INDEX_TYPE_UINT16);
}

void MeshPass::push(VkCommandBuffer commands, const ShaderMeshPush& values) const {
  device_->api().vkCmdPushConstants(commands, pipelines_->layout(),
                                    VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT, 0, sizeof values,
                                    &values);
}

void MeshPass::copy_image(VkCommandBuffer commands, const Buffer& colours) const {
  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.imageExtent = {target_.size().width, target_.size().height, 1};
  device_->api().vkCmdCopyImageToBuffer(commands, target_.image(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                                        colours.handle(), 1, &region);
}

}  // namespace quoin::vulkan
