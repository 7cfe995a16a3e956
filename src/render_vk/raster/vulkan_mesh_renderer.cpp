#include <quoin/render_vk/vulkan_mesh_renderer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "light/surfaces.h"
#include "render/picture_request.h"
#include "render_vk/march/device_picture.h"
#include "render_vk/march/renderer_impl.h"
#include "render_vk/raster/mesh_pass.h"
#include "scene/instance_axes.h"

namespace quoin {

using vulkan::Vec4;

struct VulkanMeshRenderer::Impl {
  Impl(vulkan::RendererImpl& of_renderer, std::unique_ptr<vulkan::MeshPass> with_pass)
      : device(of_renderer.device.get()),
        memory(&of_renderer.memory),
        pass(std::move(with_pass)),
        store(of_renderer.memory) {}
  ~Impl() { memory->release(surfaces); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void place(const Scene& scene, InstanceFilter filter);
  Status put_surfaces(const VoxelRegistry& types);
  Status upload_surfaces(const std::vector<Vec4>& table);

  vulkan::Device* device;
  vulkan::DeviceMemory* memory;
  std::unique_ptr<vulkan::MeshPass> pass;
  vulkan::MeshStore store;
  std::vector<vulkan::MeshInstance> instances;
  vulkan::Place surfaces;
  std::vector<Vec4> surface_table;  // what lies there
  std::int64_t drawn_triangles = 0;
};

namespace {

// What a type looks like, and as glass of one voxel, as shaders/mesh.glsl reads it.
std::vector<Vec4> table_of(const VoxelRegistry& types) {
  // Brighter than anything, but its products with what is interpolated stay numbers.
  constexpr float kBrightest = 1e15F;
  const Surfaces surfaces(types);
  std::vector<Vec4> table;
  for (std::size_t type = 0; type <= types.size(); ++type) {
    const Surface& surface = surfaces[static_cast<VoxelType>(std::min(type, kMaxVoxelTypes))];
    table.emplace_back(surface.colour, 1.0F - std::exp(surface.log_clarity));
    table.emplace_back(glm::min(surface.emitted, Vec3(kBrightest)), 0.0F);
    table.emplace_back(glm::exp(surface.log_transmittance), 0.0F);
  }
  return table;
}

Status check(const Camera& camera, const MeshPictureOptions& options) {
  constexpr std::array kSamples = {1, 2, 4, 8};
  RenderOptions request;
  request.width = options.width;
  request.height = options.height;
  request.light = options.light;
  if (Status right = check(camera, request); !right) return right;
  if (std::find(kSamples.begin(), kSamples.end(), options.samples) == kSamples.end()) {
    return make_error(ErrorCode::InvalidArgument, "samples: of meshes must be 1, 2, 4 or 8");
  }
  return {};
}

}  // namespace

VulkanMeshRenderer::VulkanMeshRenderer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VulkanMeshRenderer::VulkanMeshRenderer(VulkanMeshRenderer&&) noexcept = default;
VulkanMeshRenderer& VulkanMeshRenderer::operator=(VulkanMeshRenderer&&) noexcept = default;
VulkanMeshRenderer::~VulkanMeshRenderer() = default;

Result<VulkanMeshRenderer> VulkanMeshRenderer::create(VulkanRenderer& renderer) {
  vulkan::RendererImpl& shared = vulkan::Access::of(renderer);
  auto pass = vulkan::MeshPass::create(*shared.device, shared.memory);
  if (!pass) return pass.error();
  return VulkanMeshRenderer(std::make_unique<Impl>(shared, std::move(*pass)));
}

Status VulkanMeshRenderer::update(const Scene& scene, InstanceFilter filter) {
  impl_->place(scene, filter);
  return impl_->put_surfaces(scene.types);
}

void VulkanMeshRenderer::Impl::place(const Scene& scene, InstanceFilter filter) {
  instances.clear();
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    const SceneGrid* grid = scene.grids().find(instance.grid);
    if (grid == nullptr || !passes(filter, instance) || !has_place(instance) || !is_finite(grid->pivot)) return;
    instances.push_back(
        {instance.grid, world_axes(instance), instance.position, grid->pivot, instance.voxel_size, instance.mirrored});
  });
}

Status VulkanMeshRenderer::Impl::put_surfaces(const VoxelRegistry& types) {
  std::vector<Vec4> table = table_of(types);
  if (table == surface_table) return {};
  surface_table.clear();
  Status done = upload_surfaces(table);
  if (done) {
    surface_table = std::move(table);
  } else {
    memory->discard();
  }
  return done;
}

Status VulkanMeshRenderer::Impl::upload_surfaces(const std::vector<Vec4>& table) {
  const auto bytes = std::as_bytes(std::span(table));
  if (bytes.size() > surfaces.size) {
    memory->release(surfaces);
    const auto larger = memory->allocate(bytes.size(), "uploading the types");
    if (!larger) return larger.error();
    surfaces = *larger;
  }
  if (Status done = memory->write(surfaces, bytes); !done) return done;
  return memory->flush();
}

Status VulkanMeshRenderer::put(std::span<const SurfaceUpdate> surfaces) {
  return impl_->store.put(surfaces);
}

void VulkanMeshRenderer::clear() {
  impl_->store.clear();
}

Status VulkanMeshRenderer::draw(VulkanPicture& picture, const Camera& camera, const MeshPictureOptions& options) {
  vulkan::PictureImpl& target = vulkan::Access::of(picture);
  vulkan::Device& device = *impl_->device;
  const std::string who = "vulkan: " + device.description().name;
  if (Status right = check(camera, options); !right) return right;
  const auto largest = static_cast<std::int64_t>(impl_->pass->largest_edge());
  if (options.width > largest || options.height > largest) {
    const std::string edge = std::to_string(largest);
    return make_error(ErrorCode::InvalidArgument, who + " draws meshes of at most " + edge + " x " + edge + " pixels");
  }
  if (options.wireframe != Wireframe::Off && !device.physical().draws_lines) {
    return make_error(ErrorCode::Unsupported, who + " lacks fillModeNonSolid, which draws edges of triangles");
  }
  if (target.device != &device) {
    return make_error(ErrorCode::InvalidArgument, "vulkan: the picture is of another renderer than the meshes");
  }
  // Nothing was updated yet, or that failed: then there are no types either.
  if (impl_->surface_table.empty()) impl_->instances.clear();
  auto data = vulkan::make_mesh_frame(impl_->store, impl_->instances, camera, options, impl_->pass->subpixels());
  if (!data) return data.error();
  data->push.surfaces = impl_->surfaces.address;
  const std::size_t types = std::max<std::size_t>(impl_->surface_table.size() / 3, 1);
  data->push.numbers |= static_cast<std::uint32_t>(types - 1) << vulkan::kMeshLastSurfaceShift;
  if (Status sized = target.resize(options.width, options.height); !sized) return sized;
  target.samples = 0;
  target.rays = 0;
  target.sums = {};
  const std::uint32_t samples = impl_->pass->samples_for(options.samples);
  const VkExtent2D size{static_cast<std::uint32_t>(options.width), static_cast<std::uint32_t>(options.height)};
  if (Status done = impl_->pass->draw(*data, size, samples, options.wireframe, target.colours); !done) return done;
  target.samples = static_cast<int>(samples);
  impl_->drawn_triangles = data->triangles();
  return {};
}

VulkanMeshRenderer::Stats VulkanMeshRenderer::stats() const {
  return {impl_->store.chunks(), impl_->store.triangles(), impl_->drawn_triangles, impl_->store.bytes()};
}

}  // namespace quoin
