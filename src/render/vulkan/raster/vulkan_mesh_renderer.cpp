#include <quoin/core/assert.h>
#include <quoin/render/vulkan_mesh_renderer.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include <glm/geometric.hpp>

#include "render/light/light_model.h"
#include "render/shared/image_request.h"
#include "render/vulkan/march/device_image.h"
#include "render/vulkan/march/renderer_impl.h"
#include "render/vulkan/raster/mesh_pass.h"
#include "render/vulkan/raster/mesh_store.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {

using vulkan::Vec4;

namespace {

// Beyond this, the least recently drawn meshes of halved grids are dropped.
constexpr std::size_t kMaxLevelBytes = std::size_t{256} << 20;

RenderOptions request_of(const MeshImageOptions& options) {
  RenderOptions request;
  request.width = options.width;
  request.height = options.height;
  request.light = options.light;
  request.environment = options.environment;
  request.detail = options.detail;
  return request;
}

Status check(const Camera& camera, const MeshImageOptions& options) {
  constexpr std::array kSamples = {1, 2, 4, 8};
  if (Status right = check(camera, request_of(options)); !right) return right;
  if (std::find(kSamples.begin(), kSamples.end(), options.samples) == kSamples.end()) {
    return make_error(ErrorCode::InvalidArgument, "samples: must be 1, 2, 4 or 8 for meshes");
  }
  return {};
}

bool traces_light(const RenderOptions& options) {
  const LightOptions& light = options.light;
  if (light.shading != Shading::Lit) return false;
  if (is_propagated(light)) return true;
  return (light.shadows && daylight_of(*options.environment).sun_brightness > 0.0) || light.max_lamps > 0;
}

std::array<std::uint32_t, 7> sides_of(const ImpostorFaces::Level& level) {
  std::array<std::uint32_t, 7> begin{};
  std::copy_n(level.begin.begin(), begin.size(), begin.begin());
  return begin;
}

vulkan::MeshImpostor impostor_of(const vulkan::ShaderFar& far, const vulkan::DevicePlaced& placed) {
  vulkan::MeshImpostor impostor;
  const ImpostorFaces& faces = *placed.impostor;
  const auto add = [&](const vulkan::ShaderFarLevel& part, std::size_t level, bool is_coarser) {
    if (part.count > 0) impostor.parts.push_back({part, sides_of(faces.level(level)), is_coarser});
  };
  add(far.level, placed.impostor_level, false);
  add(far.coarser, placed.impostor_level + 1, true);
  add(far.unseen, ImpostorFaces::kLevels, false);
  impostor.coarser = static_cast<std::uint32_t>(far.at.w);
  impostor.near = far.near;
  impostor.faces = far.faces;
  impostor.centre = faces.centre;
  // The corners of the largest box in the content's sphere, with a rounding margin.
  impostor.radius = 1.7321 * faces.levels[0].size + 1.0;
  return impostor;
}

}  // namespace

struct VulkanMeshRenderer::Impl {
  Impl(vulkan::RendererImpl& of_renderer, std::unique_ptr<vulkan::MeshPass> with_pass)
      : renderer(&of_renderer),
        device(of_renderer.device.get()),
        memory(&of_renderer.memory),
        pass(std::move(with_pass)),
        store(of_renderer.memory, of_renderer.texels),
        levels(store),
        textures(of_renderer.memory, of_renderer.texels) {}
  ~Impl() {
    memory->release(surfaces);
    memory->release(means);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void place(const Scene& of_scene, InstanceFilter filter);
  Status put_surfaces(const VoxelRegistry& types);
  [[nodiscard]] Status check_request(const vulkan::ImageImpl& target, const Camera& camera,
                                     const MeshImageOptions& options) const;
  [[nodiscard]] Result<std::vector<vulkan::MeshInstance>> detailed(const vulkan::Placement& placement, Threads threads);
  Status put_image(const vulkan::Placement& placement, const Camera& camera, const RenderOptions& request,
                   Threads threads, vulkan::MeshFrameData& data);
  [[nodiscard]] bool has_glass_by_rays(const MeshImageOptions& options) const;
  [[nodiscard]] Result<vulkan::MeshFrameData> make_frame(const Camera& camera, const MeshImageOptions& options,
                                                         vulkan::MeshLight& light, Threads threads);

  vulkan::RendererImpl* renderer;
  vulkan::Device* device;
  vulkan::DeviceMemory* memory;
  std::unique_ptr<vulkan::MeshPass> pass;
  vulkan::MeshStore store;
  vulkan::LevelMeshes levels;
  const Scene* scene = nullptr;
  Environment environment = Environment::reference();  // of the scene
  ChangeCursor at_update;                              // of it
  InstanceFilter shown = InstanceFilter::Visible;
  std::vector<vulkan::MeshInstance> instances;  // in the order of their handles; voxels, then the field
  vulkan::Place surfaces;
  std::vector<Vec4> surface_table;  // the content of `surfaces`
  vulkan::Place means;              // of shapes; faces of shapes read it, also those of former types
  std::vector<Vec4> mean_table;     // its content
  ChangeCursor followed_types;      // of both tables, unless they are empty
  bool has_unoccluding = false;     // some of its opaque types do not darken corners
  vulkan::DeviceTextures textures;  // of the same types
  vulkan::SolidFaces solid;         // of the same types
  std::int64_t drawn_triangles = 0;
};

VulkanMeshRenderer::VulkanMeshRenderer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VulkanMeshRenderer::VulkanMeshRenderer(VulkanMeshRenderer&&) noexcept = default;
VulkanMeshRenderer& VulkanMeshRenderer::operator=(VulkanMeshRenderer&&) noexcept = default;
VulkanMeshRenderer::~VulkanMeshRenderer() = default;

Result<VulkanMeshRenderer> VulkanMeshRenderer::create(VulkanRenderer& renderer) {
  vulkan::RendererImpl& shared = renderer.impl();
  auto pass = vulkan::MeshPass::create(*shared.device, shared.memory);
  if (!pass) return pass.error();
  return VulkanMeshRenderer(std::make_unique<Impl>(shared, std::move(*pass)));
}

Status VulkanMeshRenderer::update(const Scene& scene, InstanceFilter filter) {
  impl_->place(scene, filter);
  impl_->levels.look_at(scene);
  Status done = impl_->put_surfaces(scene.types);
  if (done) done = impl_->textures.put(scene.types);
  if (done) impl_->solid = vulkan::SolidFaces::of(scene.types);
  if (!done) impl_->surface_table.clear();
  return done;
}

void VulkanMeshRenderer::Impl::place(const Scene& of_scene, InstanceFilter filter) {
  const ChangeCursor before = std::exchange(at_update, of_scene.cursor());
  if (scene != &of_scene || !before.shares_container_with(at_update)) levels.clear();
  scene = &of_scene;
  environment = environment_of(of_scene);
  shown = filter;
  instances.clear();
  scene->instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    const SceneGrid* grid = scene->grids().find(instance.grid);
    if (grid == nullptr || !passes(filter, of_scene, instance) || !has_valid_transform(instance) ||
        !is_finite(grid->pivot))
      return;
    vulkan::MeshInstance placed;
    placed.handle = handle;
    placed.mesh = {instance.grid, 0};
    placed.world_axes = world_axes(instance);
    placed.position = instance.position;
    placed.pivot = grid->pivot;
    placed.voxel_size = instance.voxel_size;
    placed.mirrored = instance.mirrored;
    instances.push_back(placed);
    if (grid->field.chunk_count() == 0) return;
    placed.mesh.content = SurfaceContent::Field;
    instances.push_back(placed);
  });
}

Status VulkanMeshRenderer::Impl::put_surfaces(const VoxelRegistry& types) {
  if (!surface_table.empty() && !types.has_changed_since(followed_types)) return {};
  const ChangeCursor now = types.cursor();
  std::vector<Vec4> table = vulkan::surface_table(types);
  std::vector<Vec4> of_shapes = vulkan::shape_means(types);
  if (table == surface_table && of_shapes == mean_table) {
    followed_types = now;
    return {};
  }
  surface_table.clear();
  Status done = vulkan::put_table(*memory, surfaces, std::as_bytes(std::span(table)));
  if (done) done = vulkan::put_table(*memory, means, std::as_bytes(std::span(of_shapes)));
  if (done) done = memory->flush();
  if (done) {
    surface_table = std::move(table);
    mean_table = std::move(of_shapes);
    has_unoccluding = types.has_unoccluding() || types.has_shapes();
    followed_types = now;
  } else {
    memory->discard();
  }
  return done;
}

Status VulkanMeshRenderer::put(std::span<const SurfaceUpdate> surfaces) {
  return impl_->store.put(surfaces);
}

void VulkanMeshRenderer::clear() {
  impl_->levels.clear();
  impl_->store.clear();
}

Status VulkanMeshRenderer::Impl::check_request(const vulkan::ImageImpl& target, const Camera& camera,
                                               const MeshImageOptions& options) const {
  const std::string who = "vulkan: " + device->description().name;
  if (Status right = check(camera, options); !right) return right;
  const auto refuse = [](const std::string& message) { return make_error(ErrorCode::InvalidArgument, message); };
  const auto largest = static_cast<std::int64_t>(pass->largest_edge());
  if (options.width > largest || options.height > largest) {
    const std::string edge = std::to_string(largest);
    return refuse(who + " draws meshes of at most " + edge + " x " + edge + " pixels");
  }
  if (options.wireframe != Wireframe::Off && !device->physical().draws_lines) {
    return make_error(ErrorCode::Unsupported, who + " lacks fillModeNonSolid, which wireframes need");
  }
  if (target.device != device) return refuse("vulkan: the image belongs to another renderer than the meshes");
  const bool needs_voxels =
      options.detail.policy.has_value() || traces_light(request_of(options)) || has_glass_by_rays(options);
  const bool has_voxels =
      renderer->voxels == scene && renderer->at_update.shares_container_with(at_update) && renderer->instances == shown;
  if (needs_voxels && scene != nullptr && !has_voxels) {
    return refuse(
        "vulkan: shadows, lamps, ray-traced glass and levels of detail need VulkanRenderer::update with the meshes' "
        "scene");
  }
  return {};
}

bool VulkanMeshRenderer::Impl::has_glass_by_rays(const MeshImageOptions& options) const {
  const bool shows_glass = !shows_values(options.light.shading) && options.wireframe != Wireframe::Only;
  if (!options.glass_by_rays || !shows_glass || !store.has_glass() || scene == nullptr) return false;
  return !solid.has_any || store.has_glass([this](VoxelType type) { return solid.leaves_glass(type); });
}

// Returns the instances as drawn in an image; puts the meshes of halved grids into the store.
Result<std::vector<vulkan::MeshInstance>> VulkanMeshRenderer::Impl::detailed(const vulkan::Placement& placement,
                                                                             Threads threads) {
  std::vector<vulkan::MeshInstance> shown_as = instances;
  levels.begin();
  auto next = placement.placed.begin();
  for (vulkan::MeshInstance& instance : shown_as) {
    next = vulkan::find_placed(next, placement.placed.end(), instance.handle);
    if (next == placement.placed.end()) break;
    const PlacedGrid& placed = next->placed;
    if (placed.instance != instance.handle) continue;
    instance.placed = static_cast<std::int32_t>(next - placement.placed.begin());
    instance.origin = next->origin;
    // Surfels are not rasterised: grids with a field are drawn from their meshes, whose levels the live meshes choose.
    instance.shows_means = next->is_far || placed.level > 0;
    instance.is_far = next->is_far && (next->impostor == nullptr || next->impostor->surfels.empty());
    if (placed.level == 0) continue;
    instance.mesh.level = placed.level;
    instance.pivot = placed.pivot;
    instance.voxel_size = placed.voxel_size;
    Status done = levels.put(instance.mesh, placed, scene->types, threads);
    if (!done) return done.error();
  }
  levels.drop_unused(kMaxLevelBytes);
  for (const vulkan::ShaderFar& far : placement.far) {
    QUOIN_ASSERT(far.origin.w >= 0 && static_cast<std::size_t>(far.origin.w) < placement.placed.size(),
                 "an instance of the placement");
    const vulkan::DevicePlaced& placed = placement.placed[static_cast<std::size_t>(far.origin.w)];
    const auto found = std::lower_bound(
        shown_as.begin(), shown_as.end(), placed.placed.instance,
        [](const vulkan::MeshInstance& instance, InstanceHandle handle) { return instance.handle < handle; });
    if (found == shown_as.end() || found->handle != placed.placed.instance) continue;
    if (!placed.impostor->surfels.empty()) continue;
    // A simple grid can have fewer merged quads than visible faces; its mesh is then drawn. If some chunks have no
    // mesh, it may still be on its way.
    const vulkan::MeshStore::StoredGrid* mesh = store.find(found->mesh);
    found->is_far = mesh == nullptr || mesh->chunks.size() < scene->grids()[found->mesh.grid].grid.chunk_count() ||
                    mesh->opaque_quads > std::int64_t{far.level.count} + far.coarser.count + far.unseen.count;
    if (found->is_far) found->impostor = impostor_of(far, placed);
  }
  return shown_as;
}

// Writes the rays' content and the light.
Status VulkanMeshRenderer::Impl::put_image(const vulkan::Placement& placement, const Camera& camera,
                                           const RenderOptions& request, Threads threads, vulkan::MeshFrameData& data) {
  data.image = vulkan::make_frame(placement, camera, request);
  data.has_fields = placement.has_fields;
  data.has_shapes = placement.has_shapes;
  data.has_cells = placement.has_transparent && textures.has_cells();
  vulkan::ShaderFrame& frame = data.image.frame;
  frame.grids = placement.grids;
  frame.surfaces = surfaces.address;
  frame.last_surface = static_cast<std::uint32_t>(std::max<std::size_t>(surface_table.size() / 3, 1) - 1);
  if (has_unoccluding) frame.flags |= vulkan::kUnoccluding;
  textures.put_in(frame);
  renderer->scene.put_shapes_in(frame);
  frame.shape_means = means.address;
  const bool shows_colours = !shows_values(request.light.shading) && !request.detail.colours;
  data.has_textures = shows_colours && !textures.empty();
  data.has_type_textures = !textures.empty();
  if (scene == nullptr || !traces_light(request)) return {};
  const auto lamps = renderer->lamp_table(request, threads);
  if (!lamps) return lamps.error();
  if (lamps->table != nullptr) {
    data.lamps = vulkan::put_lamps(*lamps, camera, data.image);
  }
  const auto light = renderer->level_table(request.light, threads);
  if (!light) return light.error();
  if (light->table != nullptr) vulkan::put_levels(*light, *scene, placement, request, data.image);
  return {};
}

Result<vulkan::MeshFrameData> VulkanMeshRenderer::Impl::make_frame(const Camera& camera,
                                                                   const MeshImageOptions& options,
                                                                   vulkan::MeshLight& light, Threads threads) {
  const RenderOptions request = request_of(options);
  const bool traces = traces_light(request) && scene != nullptr;
  const bool glass_by_rays = has_glass_by_rays(options);
  const vulkan::Placement nothing;
  std::optional<vulkan::Subject> subject;
  if (scene != nullptr && (traces || glass_by_rays || request.detail.policy)) {
    auto made = vulkan::Subject::of(*renderer, camera, request, threads);
    if (!made) return made.error();
    subject.emplace(std::move(*made));
  }
  const vulkan::Placement& placement = subject ? subject->placement() : nothing;
  // Before the first update, or after a failed one, there are no types.
  if (surface_table.empty()) instances.clear();
  const auto shown_as = detailed(placement, threads);
  if (!shown_as) return shown_as.error();
  auto data = vulkan::make_mesh_frame(store, *shown_as, camera, request, pass->subpixels(), glass_by_rays, solid);
  if (!data) return data.error();
  if (Status done = put_image(placement, camera, request, threads, *data); !done) return done.error();
  if (traces) light = placement.has_transparent ? vulkan::MeshLight::TracedThroughGlass : vulkan::MeshLight::Traced;
  return data;
}

Status VulkanMeshRenderer::draw(VulkanImage& image, const Camera& camera, const MeshImageOptions& asked,
                                Threads threads) {
  const MeshImageOptions options = with_environment(asked, impl_->environment);
  vulkan::ImageImpl& target = image.impl();
  if (Status right = impl_->check_request(target, camera, options); !right) return right;
  auto light = vulkan::MeshLight::Plain;
  auto data = impl_->make_frame(camera, options, light, threads);
  if (!data) return data.error();
  if (Status sized = target.resize(options.width, options.height); !sized) return sized;
  target.samples = 0;
  target.rays = 0;
  target.sums = {};
  const std::uint32_t samples = impl_->pass->samples_for(options.samples);
  const VkExtent2D size{static_cast<std::uint32_t>(options.width), static_cast<std::uint32_t>(options.height)};
  if (Status done = impl_->pass->draw(*data, size, samples, options.wireframe, light, target.colours); !done) {
    return done;
  }
  target.samples = static_cast<int>(samples);
  impl_->drawn_triangles = data->triangles();
  return {};
}

VulkanMeshRenderer::Stats VulkanMeshRenderer::stats() const {
  return {impl_->store.chunks(), impl_->store.triangles(), impl_->drawn_triangles, impl_->store.bytes()};
}

}  // namespace quoin
