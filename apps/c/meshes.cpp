// Meshes of grids and arrays; images; rays.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <span>

#include <quoin/mesh/vertex_writer.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render/path_tracer.h>
#include <quoin/scene/scene_meshes.h>
#include <quoin/scene/scene_query.h>

#include "handles.h"

namespace quoin::c {
namespace {

// Meshes an array after checking its scalar type.
template <class Mesh>
quoin_status mesh_array(const quoin_array* array, quoin_mesh* out, Mesh&& mesh) noexcept {
  return guarded([&] {
    const auto given = taken_array(array);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "array is null, or its size");
    if (out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "out is null");
    if (given->scalar < QUOIN_UINT8 || given->scalar > QUOIN_FLOAT64)
      return fail(QUOIN_INVALID_ARGUMENT, "no scalar has this number");
    return mesh(*given);
  });
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

// Converts 16-bit linear light to the colours of smooth vertices. Neighbouring vertices often share a colour.
class ColourEncoder {
 public:
  Rgba8 operator()(const LinearRgba16& colour) {
    if (colour != last_) {
      last_ = colour;
      encoded_ = srgb_colour(Vec3(colour[0], colour[1], colour[2]) / 65535.0F);
      encoded_.a = static_cast<std::uint8_t>(colour[3] / 257);
    }
    return encoded_;
  }

 private:
  LinearRgba16 last_{};
  Rgba8 encoded_{0, 0, 0, 0};
};

void add_smooth_vertices(const MeshView& view, std::size_t at, GridMesh& mesh) {
  ColourEncoder encode;
  std::copy(view.normals.begin(), view.normals.end(), mesh.normals.begin() + static_cast<std::ptrdiff_t>(at));
  std::copy(view.occlusion.begin(), view.occlusion.end(), mesh.occlusion.begin() + static_cast<std::ptrdiff_t>(at));
  for (std::size_t i = 0; i < view.positions.size(); ++i) mesh.colours[at + i] = encode(view.albedo[i]);
}

void add_block_vertices(const MeshView& view, std::size_t at, const std::vector<Rgba8>& palette, GridMesh& mesh) {
  for (std::size_t i = 0; i < view.positions.size(); ++i) {
    mesh.normals[at + i] = normal_at(view, i);
    mesh.colours[at + i] = palette[view.types[i]];
    if (view.looks.empty() || view.looks[i].face == 0) continue;
    // A shape's face without a texture has the colour of its tint.
    const VoxelFace& face = view.faces[view.looks[i].face - 1];
    if (face.texture.is_null())
      mesh.colours[at + i] = {face.tint.r, face.tint.g, face.tint.b, palette[view.types[i]].a};
  }
  for (std::size_t i = 0; i < view.block_occlusion.size(); ++i)
    mesh.occlusion[at + i] = static_cast<float>(view.block_occlusion[i]) / 3.0F;
  mesh.types.resize(mesh.positions.size());
  std::copy(view.types.begin(), view.types.end(), mesh.types.begin() + static_cast<std::ptrdiff_t>(at));
}

std::vector<Rgba8> palette_of(const VoxelRegistry& types) {
  std::vector<Rgba8> palette(types.size());
  for (std::size_t i = 0; i < palette.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    palette[i] = types[type].colour;
    if (types.is_opaque(type)) palette[i].a = 255;
  }
  return palette;
}

// Writes an attribute of a blocky surface's vertices.
template <class Value>
void write_attribute(VertexAttribute attribute, VertexFormat format, const MeshView& view, const SceneMeshes& meshes,
                     const TextureSet& textures, std::span<Value> out) {
  const VertexWriter writer({sizeof(Value), {{attribute, format, 0}}}, meshes.types, textures);
  writer.write(view, Vec3(0.0F), std::as_writable_bytes(out));
}

// Adds the textures of a surface's vertices, which are the mesh's from `at` on.
void add_textures(const MeshView& view, std::size_t at, const SceneMeshes& meshes, const TextureSet& textures,
                  GridMesh& mesh) {
  const std::size_t count = view.positions.size();
  if (view.has_albedo()) {
    std::copy_n(mesh.colours.begin() + static_cast<std::ptrdiff_t>(at), count,
                mesh.tints.begin() + static_cast<std::ptrdiff_t>(at));
    return;
  }
  const std::span numbers = std::span(mesh.textures).subspan(at, count);
  const std::span uvs = std::span(mesh.texture_uvs).subspan(at, count);
  const std::span tints = std::span(mesh.tints).subspan(at, count);
  write_attribute(VertexAttribute::Texture, VertexFormat::Uint32, view, meshes, textures, numbers);
  write_attribute(VertexAttribute::TextureUv, VertexFormat::Float32x2, view, meshes, textures, uvs);
  write_attribute(VertexAttribute::Tint, VertexFormat::Unorm8x4Srgb, view, meshes, textures, tints);
  for (std::size_t i = 0; i < count; ++i) {
    if (numbers[i] == QUOIN_NO_TEXTURE) tints[i] = mesh.colours[at + i];  // opaque, if its type is
    const VoxelFace* const face = face_at(view, i, meshes.types);
    if (face != nullptr) mesh.emission_shares[at + i] = face->emission_share;
  }
}

// `textures`: null for surfaces without textures.
Result<GridMesh> put_together(const SceneMeshes& meshes, const TextureSet* textures) {
  std::size_t vertices = 0;
  std::size_t indices = 0;
  for (const MeshPart& part : meshes.parts) {
    for (const MeshView& view : part.surfaces) {
      vertices += view.positions.size();
      indices += view.indices.size();
    }
  }
  if (vertices > std::numeric_limits<std::uint32_t>::max())
    return make_error(ErrorCode::LimitExceeded, "the mesh has more than 2^32 vertices");
  GridMesh mesh;
  mesh.positions.reserve(vertices);
  mesh.indices.resize(indices);
  mesh.normals.resize(vertices);
  mesh.colours.resize(vertices);
  mesh.occlusion.resize(vertices);
  if (textures != nullptr) {
    mesh.textures.assign(vertices, QUOIN_NO_TEXTURE);
    mesh.texture_uvs.resize(vertices);
    mesh.tints.resize(vertices);
    mesh.emission_shares.resize(vertices, VoxelFace{}.emission_share);
  }
  const std::vector<Rgba8> palette = palette_of(meshes.types);
  std::uint32_t* next = mesh.indices.data();
  for (const MeshPart& part : meshes.parts) {
    for (const MeshView& view : part.surfaces) {
      const std::size_t at = mesh.positions.size();
      const auto base = static_cast<std::uint32_t>(at);
      mesh.positions.insert(mesh.positions.end(), view.positions.begin(), view.positions.end());
      for (const std::uint32_t index : view.indices) *next++ = base + index;
      if (view.has_albedo())
        add_smooth_vertices(view, at, mesh);
      else
        add_block_vertices(view, at, palette, mesh);
      if (textures != nullptr) add_textures(view, at, meshes, *textures, mesh);
    }
  }
  if (!mesh.types.empty()) mesh.types.resize(vertices, kAir);
  return mesh;
}

// `textures`: null: the set of the scene's textures.
Result<GridMesh> mesh_of(const Scene& from, GridHandle handle, const quoin_mesh_options& options,
                         const TexturesBody* textures) {
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
  blocks.mesh.watertight = options.watertight != 0;
  const Threads threads = threads_of(options.threads);
  const auto meshes = options.smooth != 0 ? mesh_scene_smoothly(alone, {}, threads, progress())
                                          : mesh_scene(alone, blocks, threads, progress());
  if (!meshes) return meshes.error();
  // Shapes can have textures that their type has not.
  if (options.smooth != 0 || !(alone.types.has_textures() || alone.types.has_shapes())) {
    return put_together(*meshes, nullptr);
  }
  if (textures != nullptr) return put_together(*meshes, &textures->set);
  TextureSet own;
  own.add(alone.types);
  return put_together(*meshes, &own);
}

template <class Mesh>
quoin_status give_mesh(Mesh mesh, quoin_mesh* out) {
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
  data.types = mesh.types.empty() ? nullptr : mesh.types.data();
  if (!mesh.textures.empty()) {
    data.textures = mesh.textures.data();
    data.texture_uvs = mesh.texture_uvs.front().data();
    data.tints = reinterpret_cast<const std::uint8_t*>(mesh.tints.data());
    data.emission_shares = mesh.emission_shares.data();
  }
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
    return make_error(ErrorCode::InvalidArgument, "invalid camera");
  return look_at({options.camera[0], options.camera[1], options.camera[2]},
                 {options.look_at[0], options.look_at[1], options.look_at[2]}, degrees * std::numbers::pi / 180.0);
}

// Returns the scene's environment, or the given one for scenes without, with the sun of the options.
Environment environment_with(const quoin_render_options& options, const Scene& scene, const Environment& otherwise) {
  Environment environment = scene.environment.value_or(otherwise);
  if (options.has_sun != 0) environment.sun.direction = {options.sun[0], options.sun[1], options.sun[2]};
  return environment;
}

Environment environment_of_paths(const Scene& scene, const quoin_render_options& options) {
  Environment usual = Environment::natural();
  usual.sky.model = SkyModel::Physical;
  usual.exposure = 1.0;
  Environment environment = environment_with(options, scene, usual);
  if (lacks_image(environment.sky)) environment.sky.model = SkyModel::Uniform;
  return environment;
}

Result<Image> rendered_of(const Scene& scene, const quoin_render_options& options, const ImageTaking& taking) {
  const Threads threads = threads_of(options.threads);
  if (options.paths != 0) {
    PathOptions wanted;
    wanted.width = taking.options.width;
    wanted.height = taking.options.height;
    wanted.environment = environment_of_paths(scene, options);
    if (options.samples != 0) wanted.samples = options.samples;
    const auto image =
        PathTracer(scene, InstanceFilter::Visible, threads).render(taking.camera, wanted, threads, progress());
    if (!image) return image.error();
    return develop(*image, develop_options(*wanted.environment));
  }
  auto image =
      CpuRenderer(scene, InstanceFilter::Visible, threads).render(taking.camera, taking.options, threads, progress());
  if (!image) return image.error();
  return std::move(image->colour);
}

quoin_status render(const Scene& scene, const quoin_render_options& options, std::uint8_t* rgb, std::size_t capacity) {
  const auto taking = taking_of(scene, options);
  if (!taking) return fail(taking.error());
  const auto width = static_cast<std::size_t>(taking->options.width);
  if (capacity / 3 / width < static_cast<std::size_t>(taking->options.height))
    return fail(QUOIN_INVALID_ARGUMENT, "the array is too small for the image");
  const auto image = rendered_of(scene, options, *taking);
  if (!image) return fail(image.error());
  std::memcpy(rgb, image->rgb.data(), image->rgb.size());
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

// Returns the scene's tracer, updated to the current scene. The caller's lock keeps the scene unchanged.
const SceneTracer& current_tracer(SceneBody& body) {
  KeptTracer& kept = body.kept;
  const Scene& scene = body.loaded.scene;
  const std::lock_guard lock(kept.mutex);
  if (!kept.tracer) {
    kept.tracer.emplace(scene);
  } else if (scene.has_changed_since(kept.scene_cursor) || scene.types.has_changed_since(kept.types_cursor)) {
    kept.tracer->update();
  }
  kept.scene_cursor = scene.cursor();
  kept.types_cursor = scene.types.cursor();
  return *kept.tracer;
}

}  // namespace

Result<ImageTaking> taking_of(const Scene& scene, const quoin_render_options& options) {
  if (options.width < 0 || options.height < 0 || options.samples < 0)
    return make_error(ErrorCode::InvalidArgument, "width, height or samples is negative");
  ImageTaking taking;
  RenderOptions& wanted = taking.options;
  wanted.width = options.width == 0 ? 1280 : options.width;
  wanted.height = options.height == 0 ? 720 : options.height;
  wanted.samples = options.samples == 0 ? 4 : options.samples;
  wanted.light = natural_light();
  wanted.environment = environment_with(options, scene, Environment::natural());
  if (Status right = check(*wanted.environment); !right) return right.error();
  const auto camera = camera_of(scene, options, wanted.width, wanted.height);
  if (!camera) return camera.error();
  taking.camera = *camera;
  return taking;
}

}  // namespace quoin::c

using namespace quoin;
using namespace quoin::c;

quoin_status quoin_grid_mesh(quoin_scene scene, std::size_t grid, const quoin_mesh_options* options, quoin_mesh* out) {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    if (out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "out is null");
    const auto given = taken_or_default(options);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "the size of the options");
    if (grid >= body.numbers.grids.size()) return fail(QUOIN_INVALID_ARGUMENT, "no grid has this number");
    std::shared_ptr<const TexturesBody> textures;
    if (given->textures != 0) {
      textures = handles().find<const TexturesBody>(given->textures);
      if (textures == nullptr) return fail(QUOIN_BAD_HANDLE, "no textures have this handle");
    }
    auto mesh = mesh_of(body.loaded.scene, body.numbers.grids[grid], *given, textures.get());
    return mesh ? give_mesh(std::move(*mesh), out) : fail(mesh.error());
  });
}

quoin_status quoin_surface_nets(const quoin_array* array, double iso, std::int32_t solid_below, std::int32_t threads,
                                quoin_mesh* out) {
  return mesh_array(array, out, [&](const quoin_array& given) {
    ArraySurfaceOptions options;
    options.iso = iso;
    options.solid = solid_below == 0 ? SolidSide::Above : SolidSide::Below;
    auto surface = surface_from_array(view_of(given), options, threads_of(threads), progress());
    return surface ? give_mesh(std::move(*surface), out) : fail(surface.error());
  });
}

quoin_status quoin_mesh_labels(const quoin_array* array, std::int64_t background, std::int32_t relaxation_steps,
                               std::int32_t threads, quoin_mesh* out) {
  return mesh_array(array, out, [&](const quoin_array& given) {
    LabelSurfaceOptions options;
    options.background = background;
    options.relaxation_steps = relaxation_steps;
    auto surfaces = surfaces_from_labels(view_of(given), options, threads_of(threads), progress());
    if (!surfaces) return fail(surfaces.error());
    LabelMesh mesh;
    for (const LabelInterface& one : surfaces->interfaces) {
      mesh.interfaces.insert(mesh.interfaces.end(), {one.back, one.front, static_cast<std::int64_t>(one.first_index),
                                                     static_cast<std::int64_t>(one.index_count)});
    }
    mesh.surfaces = std::move(*surfaces);
    return give_mesh(std::move(mesh), out);
  });
}

quoin_status quoin_mesh_view(quoin_mesh mesh, quoin_mesh_data* out) {
  return guarded([&] {
    const auto body = handles().find<MeshBody>(mesh);
    if (body == nullptr) return fail(QUOIN_BAD_HANDLE, "no mesh has this handle");
    quoin_mesh_data data{};
    std::visit([&](const auto& one) { show(one, data); }, *body);
    return report(data, out);
  });
}

quoin_status quoin_scene_render(quoin_scene scene, const quoin_render_options* options, std::uint8_t* rgb,
                                std::size_t capacity) {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    if (rgb == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "rgb is null");
    const auto given = taken_or_default(options);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "the size of the options");
    return render(body.loaded.scene, *given, rgb, capacity);
  });
}

quoin_status quoin_scene_rays(quoin_scene scene, std::size_t count, const double* origins, const double* directions,
                              double max_t, const quoin_hits* out) {
  return with_scene(scene, Use::Read, [&](SceneBody& body) {
    const auto hits = taken(out);
    if (!hits) return fail(QUOIN_INVALID_ARGUMENT, "out is null, or its size");
    if (count == 0) return QUOIN_OK;
    if (origins == nullptr || directions == nullptr)
      return fail(QUOIN_INVALID_ARGUMENT, "origins or directions is null");
    const SceneTracer& tracer = current_tracer(body);
    constexpr std::size_t kAtOnce = 1024;
    parallel_for((count - 1) / kAtOnce + 1, {}, [&](std::size_t batch) {
      for (std::size_t i = batch * kAtOnce; i < std::min(count, (batch + 1) * kAtOnce); ++i) {
        const double* o = origins + 3 * i;
        const double* d = directions + 3 * i;
        put_hit(first_hit(tracer, {{o[0], o[1], o[2]}, {d[0], d[1], d[2]}}, max_t), i, *hits);
      }
    });
    return QUOIN_OK;
  });
}
