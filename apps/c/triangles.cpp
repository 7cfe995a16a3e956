// Triangles that become voxels.

#include <cmath>
#include <limits>

#include <quoin/voxelize/voxelize.h>

#include "handles.h"

namespace quoin::c {
namespace {

float linear(std::uint8_t srgb) {
  const float x = static_cast<float>(srgb) / 255.0F;
  return x <= 0.04045F ? x / 12.92F : std::pow((x + 0.055F) / 1.055F, 2.4F);
}

MeshMaterial material_of(const quoin_type& type) {
  MeshMaterial material;
  material.name = text_in(type.name);
  material.colour = {linear(type.rgba[0]), linear(type.rgba[1]), linear(type.rgba[2]),
                     static_cast<float>(type.rgba[3]) / 255.0F};
  if (type.rgba[3] < 255) material.alpha_mode = AlphaMode::Blend;
  material.roughness = type.roughness;
  material.metalness = type.metalness;
  material.emission = type.emission;
  return material;
}

const char* wrong_triangles(const quoin_triangles& given) {
  constexpr std::size_t kMost = std::numeric_limits<std::uint32_t>::max();
  if (given.vertex_count > kMost || given.triangle_count > kMost) return "more than 2^32 vertices or triangles";
  if (given.triangle_count == 0 || given.vertex_count == 0) return "there are no triangles";
  if (given.positions == nullptr || given.indices == nullptr) return "positions or indices are null";
  if (given.types == nullptr && given.type_count > 0) return "types are null";
  if (given.type_count > kMaxVoxelTypes) return "too many types";
  return nullptr;
}

// Positions in units of a voxel, so that those of the scene and of the lattice are the same.
Result<TriangleMesh> mesh_of(const quoin_triangles& given, double voxel_size) {
  TriangleMesh mesh;
  mesh.positions.reserve(given.vertex_count);
  for (std::size_t i = 0; i < given.vertex_count; ++i) {
    const float* at = given.positions + 3 * i;
    mesh.positions.push_back(DVec3(at[0], at[1], at[2]) / voxel_size);
    if (given.colours == nullptr) continue;
    const float* colour = given.colours + 4 * i;
    mesh.colours.emplace_back(colour[0], colour[1], colour[2], colour[3]);
  }
  mesh.triangles.reserve(given.triangle_count);
  for (std::size_t i = 0; i < given.triangle_count; ++i) {
    const std::uint32_t* at = given.indices + 3 * i;
    mesh.triangles.push_back({at[0], at[1], at[2]});
  }
  // Each has a size of its own, which says where the next one lies.
  const auto* at = reinterpret_cast<const std::byte*>(given.types);
  for (std::size_t i = 0; i < given.type_count; ++i) {
    const auto type = taken(reinterpret_cast<const quoin_type*>(at));
    if (!type) return make_error(ErrorCode::InvalidArgument, "the size of a type");
    if (const char* wrong = what_is_wrong(*type)) return make_error(ErrorCode::InvalidArgument, wrong);
    mesh.materials.push_back(material_of(*type));
    at += type->size;
  }
  if (given.materials == nullptr) return mesh;
  const std::size_t materials = std::max(given.type_count, std::size_t{1});
  mesh.material_of.assign(given.materials, given.materials + given.triangle_count);
  for (const std::uint32_t material : mesh.material_of) {
    if (material >= materials) return make_error(ErrorCode::InvalidArgument, "a material that is not there");
  }
  return mesh;
}

quoin_status voxelize_into(SceneBody& scene, const quoin_triangles& given, const quoin_voxelize_options& options,
                           const char* name, std::size_t* out) {
  const auto mesh = mesh_of(given, options.voxel_size == 0.0 ? 1.0 : options.voxel_size);
  if (!mesh) return fail(mesh.error());
  if (const Status sound = check_mesh(*mesh); !sound) return fail(sound.error());
  const auto lattice = lattice_of_voxel(*mesh, 1.0);
  if (!lattice) return fail(lattice.error());
  VoxelizeOptions wanted;
  wanted.lattice = *lattice;
  if (options.fill == QUOIN_FILL_SURFACE) wanted.solid = SolidVoxels::None;
  if (options.fill == QUOIN_FILL_SOLID) wanted.surface = SurfaceVoxels::None;
  if (options.max_types != 0) wanted.max_types = static_cast<std::size_t>(options.max_types);
  VoxelRegistry types = scene.loaded.scene.types;  // which stay as they are where this fails
  auto made = voxelize(*mesh, wanted, types, threads_of(options.threads), progress());
  if (!made) return fail(made.error());
  scene.loaded.scene.types = std::move(types);
  for (std::string& warning : made->warnings) scene.loaded.warnings.push_back(std::move(warning));
  SceneGrid grid;
  grid.name = name == nullptr ? "" : name;
  grid.grid = std::move(made->grid);
  place(scene, std::move(grid), lattice->origin, out);
  return QUOIN_OK;
}

}  // namespace
}  // namespace quoin::c

using namespace quoin;
using namespace quoin::c;

quoin_status quoin_grid_voxelize(quoin_scene scene, const quoin_triangles* triangles,
                                 const quoin_voxelize_options* options, const char* name, std::size_t* out) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    const auto given = taken(triangles);
    if (!given) return fail(QUOIN_INVALID_ARGUMENT, "triangles are null, or their size");
    if (const char* wrong = wrong_triangles(*given)) return fail(QUOIN_INVALID_ARGUMENT, wrong);
    const auto wanted = taken_or_default(options);
    if (!wanted) return fail(QUOIN_INVALID_ARGUMENT, "the size of the options");
    if (!(wanted->voxel_size >= 0.0) || !std::isfinite(wanted->voxel_size) || wanted->max_types < 0 ||
        wanted->fill < QUOIN_FILL_ALL || wanted->fill > QUOIN_FILL_SURFACE)
      return fail(QUOIN_INVALID_ARGUMENT, "a size of voxels, a fill or a number of types that cannot be");
    return voxelize_into(body, *given, *wanted, name, out);
  });
}
