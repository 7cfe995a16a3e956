// Meshes of grids and arrays; pictures; rays.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <span>

#include <quoin/render/cpu_renderer.h>
#include <quoin/render/path_tracer.h>
#include <quoin/scene/scene_meshes.h>
#include <quoin/scene/scene_query.h>

#include "handles.h"

namespace quoin::c {
namespace {

Threads threads_of(std::int32_t count) {
  return {static_cast<unsigned>(std::clamp(count, 0, 1024))};
}

const char* what_is_wrong(const quoin_array* array, quoin_mesh* out) {
  if (array == nullptr || array->size != sizeof *array) return "array is null, or its size";
  if (out == nullptr) return "out is null";
  if (array->scalar < QUOIN_UINT8 || array->scalar > QUOIN_FLOAT64) return "no scalar has this number";
  return nullptr;
}

ArrayView view_of(const quoin_array& array) {
  ArrayView view;
  view.data = array.data;
  view.type = static_cast<ScalarType>(array.scalar);
  std::copy_n(array.shape, 3, view.size.begin());
  std::copy_n(array.strides, 3, view.strides.begin());
  view.spacing = {array.spacing[0], array.spacing[1], array.spacing[2]};
  if (view.spacing == DVec3(0.0)) view.spacing = DVec3(1.0);
  view.origin = {array.origin[0], array.origin[1], array.origin[2]};
  return view;
}

// A colour of smooth meshes is linear light in 16 bits.
std::uint8_t encoded(std::uint16_t linear) {
  const double x = linear / 65535.0;
  const double srgb = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255.0 * srgb));
}

void add_vertex(const MeshView& view, std::size_t i, const VoxelRegistry& types, GridMesh& mesh) {
  mesh.positions.push_back(view.positions[i]);
  if (view.has_albedo()) {
    mesh.normals.push_back(view.normals[i]);
    const LinearRgba16& colour = view.albedo[i];
    mesh.colours.push_back(
        {encoded(colour[0]), encoded(colour[1]), encoded(colour[2]), static_cast<std::uint8_t>(colour[3] / 257)});
    mesh.occlusion.push_back(view.occlusion.empty() ? 0.0F : view.occlusion[i]);
    return;
  }
  mesh.normals.emplace_back(normal_of(view.directions[i]));
  const VoxelType type = view.types[i];
  Rgba8 colour = types[type].colour;
  if (types.is_opaque(type)) colour.a = 255;
  mesh.colours.push_back(colour);
  mesh.occlusion.push_back(view.block_occlusion.empty() ? 0.0F : static_cast<float>(view.block_occlusion[i]) / 3.0F);
}

Result<GridMesh> mesh_of(const Scene& from, GridHandle handle, const quoin_mesh_options& options) {
  Scene alone;
  alone.types = from.types;
  SceneGrid grid;
  grid.grid = from.grids()[handle].grid.snapshot();
  grid.field = from.grids()[handle].field.snapshot();
  Instance instance;
  instance.grid = alone.add_grid(std::move(grid));
  alone.add_instance(instance);
  BlockySceneOptions blocks;
  blocks.mesh.bake_occlusion = options.no_occlusion == 0;
  const Threads threads = threads_of(options.threads);
  const auto meshes =
      options.smooth != 0 ? mesh_scene_smoothly(alone, {}, threads) : mesh_scene(alone, blocks, threads);
  if (!meshes) return meshes.error();
  GridMesh mesh;
  for (const MeshPart& part : meshes->parts) {
    for (const MeshView& view : part.surfaces) {
      if (mesh.positions.size() + view.positions.size() > std::numeric_limits<std::uint32_t>::max())
        return make_error(ErrorCode::LimitExceeded, "a mesh of more than 2^32 vertices");
      const auto base = static_cast<std::uint32_t>(mesh.positions.size());
      for (std::size_t i = 0; i < view.positions.size(); ++i) add_vertex(view, i, alone.types, mesh);
      for (const std::uint32_t index : view.indices) mesh.indices.push_back(base + index);
    }
  }
  return mesh;
}

template <class Mesh>
quoin_status give(Mesh mesh, quoin_mesh* out) {
  *out = handles().put(std::make_shared<MeshBody>(std::move(mesh)));
  return QUOIN_OK;
}

void show(const GridMesh& mesh, quoin_mesh_data& data) {
  data.vertex_count = mesh.positions.size();
  data.index_count = mesh.indices.size();
  data.positions = reinterpret_cast<const float*>(mesh.positions.data());
  data.normals = reinterpret_cast<const float*>(mesh.normals.data());
  data.colours = reinterpret_cast<const std::uint8_t*>(mesh.colours.data());
  data.occlusion = mesh.occlusion.data();
  data.indices = mesh.indices.data();
}
void show(const ArraySurface& mesh, quoin_mesh_data& data) {
  data.vertex_count = mesh.positions.size();
  data.index_count = mesh.indices.size();
  data.positions = reinterpret_cast<const float*>(mesh.positions.data());
  data.normals = reinterpret_cast<const float*>(mesh.normals.data());
  data.indices = mesh.indices.data();
}
void show(const LabelMesh& mesh, quoin_mesh_data& data) {
  data.vertex_count = mesh.surfaces.positions.size();
  data.index_count = mesh.surfaces.indices.size();
  data.positions = reinterpret_cast<const float*>(mesh.surfaces.positions.data());
  data.indices = mesh.surfaces.indices.data();
  data.interface_count = mesh.interfaces.size() / 4;
  data.interfaces = mesh.interfaces.data();
}

bool is_finite(const double* v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

Result<Camera> camera_of(const Scene& scene, const quoin_render_options& options, int width, int height) {
  if (options.has_camera == 0)
    return frame_scene(scene, View::Iso, static_cast<double>(width) / static_cast<double>(height));
  const double degrees = options.fov_degrees == 0.0 ? 45.0 : options.fov_degrees;
  if (!is_finite(options.camera) || !is_finite(options.look_at) || !(degrees > 0.0 && degrees < 180.0))
    return make_error(ErrorCode::InvalidArgument, "a camera that cannot be");
  return look_at({options.camera[0], options.camera[1], options.camera[2]},
                 {options.look_at[0], options.look_at[1], options.look_at[2]}, degrees * std::numbers::pi / 180.0);
}

Result<Image> picture_of(const Scene& scene, const quoin_render_options& options, int width, int height) {
  const auto camera = camera_of(scene, options, width, height);
  if (!camera) return camera.error();
  const Threads threads = threads_of(options.threads);
  if (options.paths != 0) {
    PathOptions wanted;
    wanted.width = width;
    wanted.height = height;
    if (options.samples != 0) wanted.samples = options.samples;
    const auto picture = PathTracer(scene, InstanceFilter::Visible, threads).render(*camera, wanted, threads);
    if (!picture) return picture.error();
    return develop(*picture);
  }
  RenderOptions wanted;
  wanted.width = width;
  wanted.height = height;
  wanted.samples = options.samples == 0 ? 4 : options.samples;
  wanted.light = natural_light();
  auto picture = CpuRenderer(scene, InstanceFilter::Visible, threads).render(*camera, wanted, threads);
  if (!picture) return picture.error();
  return std::move(picture->colour);
}

quoin_status render(const Scene& scene, const quoin_render_options& options, std::uint8_t* rgb, std::size_t capacity) {
  if (options.width < 0 || options.height < 0 || options.samples < 0)
    return fail(QUOIN_INVALID_ARGUMENT, "a size or a number of samples below 0");
  const int width = options.width == 0 ? 1280 : options.width;
  const int height = options.height == 0 ? 720 : options.height;
  if (capacity / 3 / static_cast<std::size_t>(width) < static_cast<std::size_t>(height))
    return fail(QUOIN_INVALID_ARGUMENT, "the array has no room for the picture");
  const auto picture = picture_of(scene, options, width, height);
  if (!picture) return fail(picture.error());
  std::memcpy(rgb, picture->rgb.data(), picture->rgb.size());
  return QUOIN_OK;
}

void put_hit(const std::optional<SceneHit>& hit, std::size_t i, const quoin_hits& out) {
  if (out.t != nullptr) out.t[i] = hit ? hit->t : std::numeric_limits<double>::infinity();
  if (out.type != nullptr) out.type[i] = hit ? hit->type : kAir;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t at = 3 * i + static_cast<std::size_t>(axis);
    if (out.voxel != nullptr) out.voxel[at] = hit ? hit->voxel[axis] : 0;
    if (out.normal != nullptr) out.normal[at] = hit ? hit->normal[axis] : 0.0;
  }
}

}  // namespace
}  // namespace quoin::c

using namespace quoin;
using namespace quoin::c;

quoin_status quoin_grid_mesh(quoin_scene scene, std::size_t grid, const quoin_mesh_options* options, quoin_mesh* out) {
  return with_scene(scene, [&](SceneBody& body) {
    if (out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "out is null");
    if (options != nullptr && options->size != sizeof *options)
      return fail(QUOIN_INVALID_ARGUMENT, "the size of the options");
    if (grid >= body.grids.size()) return fail(QUOIN_INVALID_ARGUMENT, "no grid has this number");
    auto mesh = mesh_of(body.loaded.scene, body.grids[grid], options == nullptr ? quoin_mesh_options{} : *options);
    return mesh ? give(std::move(*mesh), out) : fail(mesh.error());
  });
}

quoin_status quoin_surface_nets(const quoin_array* array, double iso, std::int32_t solid_below, std::int32_t threads,
                                quoin_mesh* out) {
  return guarded([&] {
    if (const char* wrong = what_is_wrong(array, out)) return fail(QUOIN_INVALID_ARGUMENT, wrong);
    ArraySurfaceOptions options;
    options.iso = iso;
    options.solid = solid_below == 0 ? SolidSide::Above : SolidSide::Below;
    auto surface = surface_from_array(view_of(*array), options, threads_of(threads));
    return surface ? give(std::move(*surface), out) : fail(surface.error());
  });
}

quoin_status quoin_mesh_labels(const quoin_array* array, std::int64_t background, std::int32_t relaxation_steps,
                               std::int32_t threads, quoin_mesh* out) {
  return guarded([&] {
    if (const char* wrong = what_is_wrong(array, out)) return fail(QUOIN_INVALID_ARGUMENT, wrong);
    LabelSurfaceOptions options;
    options.background = background;
    options.relaxation_steps = relaxation_steps;
    auto surfaces = surfaces_from_labels(view_of(*array), options, threads_of(threads));
    if (!surfaces) return fail(surfaces.error());
    LabelMesh mesh;
    for (const LabelInterface& one : surfaces->interfaces) {
      mesh.interfaces.insert(mesh.interfaces.end(), {one.back, one.front, static_cast<std::int64_t>(one.first_index),
                                                     static_cast<std::int64_t>(one.index_count)});
    }
    mesh.surfaces = std::move(*surfaces);
    return give(std::move(mesh), out);
  });
}

quoin_status quoin_mesh_view(quoin_mesh mesh, quoin_mesh_data* out) {
  return guarded([&] {
    const auto body = handles().find<MeshBody>(mesh);
    if (body == nullptr) return fail(QUOIN_BAD_HANDLE, "no mesh has this handle");
    if (out == nullptr || out->size != sizeof *out) return fail(QUOIN_INVALID_ARGUMENT, "out is null, or its size");
    *out = {};
    out->size = sizeof *out;
    std::visit([&](const auto& one) { show(one, *out); }, *body);
    return QUOIN_OK;
  });
}

quoin_status quoin_scene_render(quoin_scene scene, const quoin_render_options* options, std::uint8_t* rgb,
                                std::size_t capacity) {
  return with_scene(scene, [&](SceneBody& body) {
    if (rgb == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "rgb is null");
    if (options != nullptr && options->size != sizeof *options)
      return fail(QUOIN_INVALID_ARGUMENT, "the size of the options");
    return render(body.loaded.scene, options == nullptr ? quoin_render_options{} : *options, rgb, capacity);
  });
}

quoin_status quoin_scene_rays(quoin_scene scene, std::size_t count, const double* origins, const double* directions,
                              double max_t, const quoin_hits* out) {
  return with_scene(scene, [&](SceneBody& body) {
    if (out == nullptr || out->size != sizeof *out) return fail(QUOIN_INVALID_ARGUMENT, "out is null, or its size");
    if (count == 0) return QUOIN_OK;
    if (origins == nullptr || directions == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "there are no rays");
    const SceneTracer tracer(body.loaded.scene);
    constexpr std::size_t kAtOnce = 1024;
    parallel_for((count + kAtOnce - 1) / kAtOnce, {}, [&](std::size_t batch) {
      for (std::size_t i = batch * kAtOnce; i < std::min(count, (batch + 1) * kAtOnce); ++i) {
        const double* o = origins + 3 * i;
        const double* d = directions + 3 * i;
        put_hit(first_hit(tracer, {{o[0], o[1], o[2]}, {d[0], d[1], d[2]}}, max_t), i, *out);
      }
    });
    return QUOIN_OK;
  });
}
