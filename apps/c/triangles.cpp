// Voxelises triangles.

#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <unordered_map>

#include <quoin/voxelize/voxelize.h>

#include "handles.h"

namespace quoin::c {
namespace {

glm::vec4 light_of(const VoxelProperties& type) {
  return {linear_colour(type.colour), static_cast<float>(type.colour.a) / 255.0F};
}

// The caller's types. Types that differ only in colour share a look, so that similar colours can be merged.
struct Given {
  std::vector<VoxelProperties> looks;                   // with the colour and visibility of the first type
  std::vector<std::size_t> look_of;                     // of each type
  std::vector<glm::vec4> light;                         // of each type
  std::vector<bool> is_clear;                           // of each look: transparent at any alpha
  std::unordered_map<std::string, std::size_t> by_key;  // looks, by all properties except colour

  [[nodiscard]] bool has_shared_looks() const { return looks.size() < look_of.size(); }
};

void add(Given& given, const quoin_type& type) {
  VoxelProperties look = properties_of(type);
  given.light.push_back(light_of(look));
  const bool is_clear = type.transparent != 0;
  std::string key = look.name;
  for (const float value : {look.emission, look.metalness, look.roughness, look.ior, look.scattering, look.anisotropy,
                            is_clear ? 1.0F : 0.0F, static_cast<float>(type.light_cost),
                            static_cast<float>(type.blocks_light), static_cast<float>(type.occludes)})
    key.append(1, '\0').append(std::to_string(std::bit_cast<std::uint32_t>(value)));
  const auto [known, is_new] = given.by_key.try_emplace(std::move(key), given.looks.size());
  if (is_new) {
    given.looks.push_back(std::move(look));
    given.is_clear.push_back(is_clear);
  }
  given.look_of.push_back(known->second);
}

// The material's name is the number of its look, which finish_types reads after voxelisation.
MeshMaterial material_of(const VoxelProperties& look, std::size_t number, glm::vec4 light, bool is_blended) {
  MeshMaterial material;
  material.name = std::to_string(number);
  material.colour = light;
  if (is_blended) material.alpha_mode = AlphaMode::Blend;
  material.roughness = look.roughness;
  material.metalness = look.metalness;
  material.emission = look.emission;
  return material;
}

// Gives the added types, from `first` on, the properties of their looks that materials cannot store.
void finish_types(VoxelRegistry& types, std::size_t first, const Given& given) {
  for (std::size_t i = first; i < types.size(); ++i) {
    const auto number = static_cast<VoxelType>(i);
    const VoxelProperties& made = types[number];
    if (made.name.empty()) continue;  // inner voxels, without a material
    const std::size_t look = std::stoull(made.name);
    VoxelProperties whole = given.looks[look];
    whole.colour = made.colour;
    whole.visibility = given.is_clear[look] ? Visibility::Transparent : made.visibility;
    if (whole.visibility == Visibility::Transparent) whole.occludes.reset();  // no transparent type occludes
    types.replace(number, std::move(whole));
  }
}

const char* wrong_triangles(const quoin_triangles& given) {
  constexpr std::size_t kMost = std::numeric_limits<std::uint32_t>::max();
  if (given.vertex_count > kMost || given.triangle_count > kMost) return "more than 2^32 vertices or triangles";
  if (given.triangle_count == 0 || given.vertex_count == 0) return "the mesh has no triangles";
  if (given.positions == nullptr || given.indices == nullptr) return "positions or indices are null";
  if (given.types == nullptr && given.type_count > 0) return "types are null";
  if (given.type_count > kMaxVoxelTypes) return "too many types";
  return nullptr;
}

// Reads the types. The `size` of each one gives the position of the next.
Result<Given> types_of(const quoin_triangles& triangles) {
  Given given;
  const auto* at = reinterpret_cast<const std::byte*>(triangles.types);
  for (std::size_t i = 0; i < triangles.type_count; ++i) {
    const auto type = taken(reinterpret_cast<const quoin_type*>(at));
    if (!type) return make_error(ErrorCode::InvalidArgument, "invalid size of a type");
    if (const char* wrong = validate_type(*type)) return make_error(ErrorCode::InvalidArgument, wrong);
    add(given, *type);
    at += type->size;
  }
  return given;
}

// Gives each triangle corner its own vertex, coloured by the triangle's type.
Result<TriangleMesh> with_coloured_corners(const TriangleMesh& mesh, const Given& given) {
  TriangleMesh separate;
  if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max() / 3)
    return make_error(ErrorCode::LimitExceeded, "more than 2^32 triangle corners with colours");
  separate.positions.reserve(3 * mesh.triangles.size());
  separate.colours.reserve(3 * mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const std::size_t type = mesh.material_of.empty() ? 0 : mesh.material_of[i];
    for (const std::uint32_t corner : mesh.triangles[i]) {
      separate.positions.push_back(mesh.positions[corner]);
      separate.colours.push_back(given.light[type] * (mesh.colours.empty() ? glm::vec4(1.0F) : mesh.colours[corner]));
    }
    const auto first = static_cast<std::uint32_t>(3 * i);
    separate.triangles.push_back({first, first + 1, first + 2});
  }
  return separate;
}

// Converts positions to voxel units, which the scene and the lattice share. Material indices refer to types;
// `with_materials` maps them to looks.
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
  if (given.materials == nullptr) return mesh;
  const std::size_t materials = std::max(given.type_count, std::size_t{1});
  mesh.material_of.assign(given.materials, given.materials + given.triangle_count);
  for (const std::uint32_t material : mesh.material_of) {
    if (material >= materials) return make_error(ErrorCode::InvalidArgument, "material index out of range");
  }
  return mesh;
}

Result<TriangleMesh> with_materials(TriangleMesh mesh, const Given& given) {
  if (given.looks.empty()) {
    if (!mesh.colours.empty()) mesh.materials.push_back({.alpha_mode = AlphaMode::Blend});
    return mesh;
  }
  const bool is_shared = given.has_shared_looks();
  const bool is_blended = !mesh.colours.empty();
  std::vector<bool> has_alpha(given.looks.size(), is_blended);
  for (std::size_t i = 0; i < given.light.size(); ++i) {
    if (given.light[i].a < 1.0F) has_alpha[given.look_of[i]] = true;
  }
  std::vector<MeshMaterial> materials;
  for (std::size_t i = 0; i < given.looks.size(); ++i) {
    // With shared looks, the corners have the colours; else each type has its own look, in the same order.
    const glm::vec4 light = is_shared ? glm::vec4(1.0F) : given.light[i];
    materials.push_back(material_of(given.looks[i], i, light, has_alpha[i]));
  }
  if (is_shared) {
    auto separate = with_coloured_corners(mesh, given);
    if (!separate) return separate.error();
    separate->material_of = std::move(mesh.material_of);
    mesh = std::move(*separate);
    for (std::uint32_t& material : mesh.material_of) material = static_cast<std::uint32_t>(given.look_of[material]);
  }
  mesh.materials = std::move(materials);
  return mesh;
}

quoin_status voxelize_into(SceneBody& scene, const quoin_triangles& given, const quoin_voxelize_options& options,
                           const char* name, std::size_t* out) {
  const auto looks = types_of(given);
  if (!looks) return fail(looks.error());
  auto soup = mesh_of(given, options.voxel_size == 0.0 ? 1.0 : options.voxel_size);
  if (!soup) return fail(soup.error());
  if (given.type_count > 0) soup->materials.resize(given.type_count);  // check_mesh checks the caller's indices
  if (const Status sound = check_mesh(*soup); !sound) return fail(sound.error());
  soup->materials.clear();
  const auto mesh = with_materials(std::move(*soup), *looks);
  if (!mesh) return fail(mesh.error());
  const auto lattice = lattice_of_voxel(*mesh, 1.0);
  if (!lattice) return fail(lattice.error());
  VoxelizeOptions wanted;
  wanted.lattice = *lattice;
  if (options.fill == QUOIN_FILL_SURFACE) wanted.solid = SolidVoxels::None;
  if (options.fill == QUOIN_FILL_SOLID) wanted.surface = SurfaceVoxels::None;
  if (options.max_types != 0) wanted.max_types = static_cast<std::size_t>(options.max_types);
  VoxelRegistry types = scene.loaded.scene.types;  // a copy: the scene keeps its own on failure
  auto made = voxelize(*mesh, wanted, types, threads_of(options.threads), progress());
  if (!made) return fail(made.error());
  finish_types(types, scene.loaded.scene.types.size(), *looks);
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
      return fail(QUOIN_INVALID_ARGUMENT, "voxel_size, fill or max_types is out of range");
    return voxelize_into(body, *given, *wanted, name, out);
  });
}
