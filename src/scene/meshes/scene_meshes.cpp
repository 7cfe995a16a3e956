#include <quoin/scene/scene_meshes.h>

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/grid/voxel_field.h>

#include "core/coordinates/unit_rotation.h"
#include "core/work/progress_steps.h"
#include "mesh/surface/voxel_surface.h"
#include "scene/meshes/occlusion_atlas.h"
#include "scene/meshes/scene_mesh_parts.h"

namespace quoin {
namespace {

/// Grids of at most this many chunks are meshed in parallel, one thread each. Larger grids are meshed one after the
/// other, with all threads on their chunks.
constexpr std::size_t kSmallGridChunks = 4;

/// `progress` counts the chunks of all grids.
Result<BlockyMesh> mesh_grid(const Scene& scene, GridHandle handle, const BlockySceneOptions& of_scene, Threads threads,
                             ProgressSteps& progress) {
  BlockyMeshOptions options = of_scene.mesh;
  if (of_scene.cut) options.cut = [&](IVec3 chunk, QuadBuffer& quads) { of_scene.cut(handle, chunk, quads); };
  const Grid& grid = scene.grids()[handle].grid;
  const auto chunks = static_cast<double>(grid.chunk_count());
  double reported = 0;
  auto mesh = build_blocky_mesh(grid, scene.types, options, threads, [&](double fraction) {
    const double more = (fraction - reported) * chunks;
    reported = fraction;
    return progress.add(more);
  });
  if (mesh && !progress.add((1.0 - reported) * chunks)) return make_error(ErrorCode::Cancelled, "cancelled");
  return mesh;
}

using MeshResults = std::vector<std::optional<Result<BlockyMesh>>>;

MeshResults mesh_all(const Scene& scene, const std::vector<GridHandle>& grids, const BlockySceneOptions& options,
                     Threads threads, const Progress& listener) {
  std::size_t chunks = 0;
  std::vector<std::size_t> small;
  std::vector<std::size_t> large;
  for (std::size_t i = 0; i < grids.size(); ++i) {
    const std::size_t count = scene.grids()[grids[i]].grid.chunk_count();
    chunks += count;
    (count <= kSmallGridChunks ? small : large).push_back(i);
  }
  ProgressSteps progress(listener, chunks);
  MeshResults results(grids.size());
  parallel_for(small.size(), threads, [&](std::size_t i) {
    results[small[i]] = mesh_grid(scene, grids[small[i]], options, Threads{1}, progress);
  });
  for (const std::size_t i : large) {
    results[i] = mesh_grid(scene, grids[i], options, threads, progress);
    if (!*results[i]) break;
  }
  return results;
}

void add_stats(const BlockyMesh& mesh, MeshStats& stats) {
  stats.faces_visible += mesh.faces_visible;
  stats.faces_total += mesh.faces_total;
  stats.quads += mesh.quads;
  stats.triangles += mesh.triangle_count();
  stats.vertices += mesh.vertex_count();
}

using Coordinates = std::vector<std::array<float, 2>>;

BlockyTriangles& opaque_of(BlockyMesh& mesh) {
  return mesh.surfaces[static_cast<std::size_t>(SurfaceClass::Opaque)];
}

Status check_atlas(const Scene& scene, const std::vector<GridHandle>& grids, const BlockySceneOptions& options) {
  const BlockyMeshOptions& mesh = options.mesh;
  if (!mesh.merge || !mesh.bake_occlusion || mesh.watertight || mesh.cut || options.cut) {
    return make_error(ErrorCode::InvalidArgument,
                      "cannot make an atlas: it needs merged faces with occlusion, neither cut nor watertight");
  }
  constexpr int kFarthestVoxel = 1 << 24;  // floats cannot represent larger integers exactly
  for (const GridHandle handle : grids) {
    const IBox bounds = scene.grids()[handle].grid.bounds();
    const bool is_near = bounds.empty() || (glm::all(glm::greaterThanEqual(bounds.min, IVec3(-kFarthestVoxel))) &&
                                            glm::all(glm::lessThanEqual(bounds.max, IVec3(kFarthestVoxel))));
    if (!is_near) return make_error(ErrorCode::LimitExceeded, "cannot make an atlas: voxel coordinates exceed 2^24");
    const std::vector<VoxelType> types = scene.grids()[handle].grid.types();
    if (std::ranges::any_of(types, [&](VoxelType type) { return scene.types.is_shaped(type); })) {
      return make_error(ErrorCode::Unsupported, "cannot make an atlas: the scene has shapes within voxels");
    }
  }
  return {};
}

/// Splits quads of textured types into the faces of voxels: in an atlas, their textures cannot repeat.
void split_textured_quads(const VoxelRegistry& types, QuadBuffer& quads) {
  QuadBuffer whole;
  whole.swap(quads);
  quads.reserve(whole.size());
  for (const Quad& quad : whole) {
    const bool is_textured = quad.type() < types.size() && !types[quad.type()].faces.empty();
    const int step_u = is_textured ? 1 : quad.size_u();
    const int step_v = is_textured ? 1 : quad.size_v();
    for (int v = 0; v < quad.size_v(); v += step_v) {
      for (int u = 0; u < quad.size_u(); u += step_u) quads.push_back(quad_part(quad, u, v, step_u, step_v));
    }
  }
}

/// Merges the opaque faces of the meshes across their occlusion, which is stored in the atlas of `meshes`. Returns the
/// texture coordinates of each mesh.
Result<std::vector<Coordinates>> move_into_atlas(const Scene& scene, const std::vector<GridHandle>& grids,
                                                 MeshResults& results, Threads threads, const Progress& progress,
                                                 SceneMeshes& meshes) {
  QUOIN_ASSERT(results.size() == grids.size(), "a mesh per grid");
  MeshResults merged = mesh_all(scene, grids, {.mesh = {.bake_occlusion = false}}, threads, progress);
  OcclusionAtlas atlas;
  for (std::size_t i = 0; i < grids.size(); ++i) {
    if (!merged[i] || !*merged[i])
      return merged[i] ? merged[i]->error() : make_error(ErrorCode::Cancelled, "cancelled");
    BlockyMesh& mesh = **results[i];
    BlockyTriangles& opaque = opaque_of(mesh);
    BlockyTriangles& whole = opaque_of(**merged[i]);
    atlas.add(opaque, whole, scene.types);
    mesh.quads +=
        (static_cast<std::int64_t>(whole.positions.size()) - static_cast<std::int64_t>(opaque.positions.size())) / 4;
    opaque = std::move(whole);
    merged[i].reset();
  }
  std::vector<Coordinates> coordinates(grids.size());
  if (atlas.is_empty()) return coordinates;
  auto drawn = atlas.draw();
  if (!drawn) return drawn.error();
  meshes.atlas = std::move(*drawn);
  for (std::size_t i = 0; i < grids.size(); ++i) coordinates[i] = atlas.coordinates(i);
  return coordinates;
}

/// Returns the part with texture coordinates for its opaque faces. The part owns them.
MeshPart with_atlas(MeshPart part, Coordinates coordinates) {
  using Owned = std::pair<std::shared_ptr<const void>, Coordinates>;
  const auto owner = std::make_shared<const Owned>(std::move(part.owner), std::move(coordinates));
  for (MeshView& view : part.surfaces) {
    if (view.surface != SurfaceClass::Opaque) continue;
    QUOIN_ASSERT(owner->second.size() == view.positions.size(), "texture coordinates for each vertex");
    view.atlas = owner->second;  // it has the colours of types, also of those whose state turns them
    view.block_occlusion = {};
    view.looks = {};
    view.faces = {};
  }
  part.owner = owner;
  return part;
}

}  // namespace

glm::dmat4 MeshPlacement::matrix() const {
  if (const auto* matrix = std::get_if<glm::dmat4>(&world_from_part)) return *matrix;
  const auto& place = std::get<Similarity>(world_from_part);
  glm::dmat4 matrix(world_axes(place.rotation, place.mirrored) * place.scale);
  matrix[3] = glm::dvec4(place.position, 1.0);
  return matrix;
}

MeshPart mesh_part(std::string name, BlockyMesh mesh, const DVec3& pivot) {
  const auto owner = std::make_shared<const BlockyMesh>(std::move(mesh));
  MeshPart part{std::move(name), {}, pivot, owner};
  for (std::size_t i = 0; i < kSurfaceClasses; ++i) {
    const BlockyTriangles& surface = owner->surfaces[i];
    if (!surface.indices.empty()) part.surfaces.push_back(view_of(surface, static_cast<SurfaceClass>(i)));
  }
  return part;
}

MeshPart mesh_part(std::string name, SmoothMesh mesh, const DVec3& pivot) {
  const auto owner = std::make_shared<const SmoothMesh>(std::move(mesh));
  MeshPart part{std::move(name), {}, pivot, owner};
  if (!owner->indices.empty()) part.surfaces.push_back(view_of(*owner));
  return part;
}

MeshPart mesh_part(std::string name, ArraySurface surface, Rgba8 colour, const DVec3& pivot) {
  struct Coloured {
    ArraySurface surface;
    std::vector<LinearRgba16> albedo;
  };
  const std::size_t vertices = surface.positions.size();
  const auto owner = std::make_shared<const Coloured>(
      Coloured{std::move(surface), std::vector<LinearRgba16>(vertices, linear_colour_of(colour))});
  MeshPart part{std::move(name), {}, pivot, owner};
  if (!owner->surface.indices.empty()) part.surfaces.push_back(view_of(owner->surface, owner->albedo));
  return part;
}

namespace {

constexpr int kDeepest = 1024;

// [depth in voxels]: the area of the triangles with this depth behind them. Areas are integers, so that sums do not
// depend on the order.
using AreaByDepth = std::vector<double>;

int depth_behind(const FunctionRef<VoxelType(IVec3)>& type_at, Vec3 middle, Direction face, VoxelType type) {
  const IVec3 inwards = -normal_of(face);
  IVec3 voxel(glm::floor(middle + 0.5F * Vec3(inwards)));
  int depth = 0;
  while (depth < kDeepest && type_at(voxel) == type) {
    ++depth;
    voxel += inwards;
  }
  return std::max(depth, 1);
}

float median(const AreaByDepth& areas) {
  QUOIN_ASSERT(!areas.empty(), "areas of a type");
  double half = 0.0;
  for (const double area : areas) half += area / 2.0;
  for (std::size_t depth = 0; depth < areas.size(); ++depth) {
    half -= areas[depth];
    if (half <= 0.0 && areas[depth] > 0.0) return static_cast<float>(depth);
  }
  return static_cast<float>(areas.size() - 1);
}

}  // namespace

std::vector<GlassThickness> glass_thickness(const FunctionRef<VoxelType(IVec3)>& type_at,
                                            std::span<const MeshView> surfaces) {
  std::map<VoxelType, AreaByDepth> areas;
  for (const MeshView& view : surfaces) {
    if (view.surface != SurfaceClass::Transparent && view.surface != SurfaceClass::EmissiveTransparent) continue;
    QUOIN_ASSERT(view.types.size() == view.positions.size() && view.directions.size() == view.positions.size(),
                 "a type and a direction for each vertex");
    for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
      const std::uint32_t first = view.indices[i];
      const Vec3 a = view.positions[first];
      const Vec3 b = view.positions[view.indices[i + 1]];
      const Vec3 c = view.positions[view.indices[i + 2]];
      const VoxelType type = view.types[first];
      const int voxels = depth_behind(type_at, (a + b + c) / 3.0F, view.directions[first], type);
      AreaByDepth& of_type = areas.try_emplace(type, kDeepest + 1).first->second;
      of_type[static_cast<std::size_t>(voxels)] += glm::length(glm::cross(b - a, c - a));
    }
  }
  std::vector<GlassThickness> thickness;
  thickness.reserve(areas.size());
  for (const auto& [type, each] : areas) thickness.push_back({type, median(each)});
  return thickness;
}

namespace {

// Places the parts of grids by the drawn instances.
void place_parts(const Scene& scene, const std::vector<GridHandle>& grids, InstanceFilter filter,
                 MeshHierarchy& hierarchy, SceneMeshes& meshes) {
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (!is_drawn(scene, instance, filter)) continue;
    const auto part = std::lower_bound(grids.begin(), grids.end(), instance.grid) - grids.begin();
    QUOIN_ASSERT(
        static_cast<std::size_t>(part) < grids.size() && grids[static_cast<std::size_t>(part)] == instance.grid,
        "a part for each drawn grid");
    meshes.placements.push_back(hierarchy.place(handle, static_cast<std::size_t>(part)));
  }
}

}  // namespace

Result<SceneMeshes> mesh_scene(const Scene& scene, const BlockySceneOptions& options, Threads threads,
                               const Progress& progress) {
  if (auto sound = check_instances(scene, options.instances); !sound) return sound.error();
  const std::vector<GridHandle> grids = drawn_grids(scene, options.instances);
  if (options.atlas) {
    if (auto sound = check_atlas(scene, grids, options); !sound) return sound.error();
  }
  QUOIN_ASSERT(!options.atlas || !options.part_of, "an atlas needs completely loaded grids");
  const bool has_atlas = options.atlas && !scene.types.has_textures();
  BlockySceneOptions wanted = options;
  if (options.atlas && !has_atlas) {
    wanted.cut = [&](GridHandle, IVec3, QuadBuffer& quads) { split_textured_quads(scene.types, quads); };
  }
  const double first_share = has_atlas ? 0.5 : 1.0;
  MeshResults results;
  if (!options.part_of) results = mesh_all(scene, grids, wanted, threads, part_of(progress, 0.0, first_share));
  for (const auto& result : results) {
    if (result && !*result) return result->error();
  }
  QUOIN_ASSERT(options.part_of || results.size() == grids.size(), "a mesh per grid");
  SceneMeshes meshes;
  meshes.types = scene.types;
  std::vector<Coordinates> coordinates;
  if (has_atlas) {
    auto moved = move_into_atlas(scene, grids, results, threads, part_of(progress, first_share, 1.0), meshes);
    if (!moved) return moved.error();
    coordinates = std::move(*moved);
  }
  for (std::size_t i = 0; i < grids.size(); ++i) {
    const SceneGrid& grid = scene.grids()[grids[i]];
    if (options.part_of) {
      auto made = options.part_of(grids[i], meshes.stats);
      if (!made) return made.error();
      made->name = grid.name;
      made->pivot += grid.pivot;
      meshes.parts.push_back(std::move(*made));
    } else {
      add_stats(**results[i], meshes.stats);
      meshes.parts.push_back(mesh_part(grid.name, std::move(**results[i]), grid.pivot));
      GridReader reader(grid.grid);
      meshes.parts.back().thickness =
          glass_thickness([&](IVec3 voxel) { return reader.get(voxel); }, meshes.parts.back().surfaces);
    }
    MeshPart& part = meshes.parts.back();
    if (!meshes.atlas.rgb.empty()) part = with_atlas(std::move(part), std::move(coordinates[i]));
    for (MeshView& view : part.surfaces) {
      if (!options.mesh.bake_occlusion) view.block_occlusion = {};
    }
  }
  MeshHierarchy hierarchy(scene, meshes);
  place_parts(scene, grids, options.instances, hierarchy, meshes);
  SmoothMeshOptions smooth;
  if (!options.mesh.bake_occlusion) smooth.occlusion.method = SmoothOcclusion::None;
  auto done = add_fields(scene, grids, options.instances, {smooth, std::nullopt}, hierarchy, meshes, threads, {});
  if (!done) return done.error();
  return meshes;
}

Result<SceneMeshes> mesh_volume(const Volume& volume, const VolumeMeshOptions& options, Threads threads,
                                const Progress& progress) {
  constexpr double kFieldShare = 0.4;
  VoxelRegistry types;
  VoxelProperties look;
  look.name = volume.name;
  look.colour = options.colour;
  const auto material = types.add(look);
  if (!material) return material.error();
  const auto field = field_from_volume(volume, {options.iso, *material}, threads, part_of(progress, 0.0, kFieldShare));
  if (!field) return field.error();
  SceneMeshes meshes;
  meshes.stats.solid_samples = field->solid_count();
  auto mesh = surface_of(*field, types, {options.mesh, options.simplify_error}, meshes.stats, threads,
                         part_of(progress, kFieldShare, 1.0));
  if (!mesh) return mesh.error();
  if (mesh->indices.empty()) return meshes;
  meshes.parts.push_back(mesh_part(volume.name, std::move(*mesh)));
  meshes.placements.push_back({0, volume.name, volume.world_from_voxel});
  return meshes;
}

Status check_instances(const Scene& scene, InstanceFilter filter) {
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (!is_drawn(scene, instance, filter)) continue;
    if (has_valid_transform(instance)) continue;
    return make_error(ErrorCode::InvalidArgument,
                      "instance \"" + instance.name + "\" needs a finite transform with a positive scale");
  }
  return {};
}

Similarity similarity_of(const Instance& instance) {
  return {instance.position, unit_rotation(instance.rotation), instance.voxel_size, instance.mirrored};
}

std::string MeshHierarchy::layer_name(LayerHandle handle) const {
  const SceneLayer* layer = scene_.layers().find(handle);
  return layer == nullptr ? std::string() : layer->name;
}

std::optional<std::size_t> MeshHierarchy::group_of(GroupHandle handle) {
  // Collects the missing groups from the lowest upwards, then adds them from the top.
  std::vector<GroupHandle> way;
  for (GroupHandle each = handle; scene_.groups().find(each) != nullptr && !groups_.contains(each);
       each = parent_of(scene_, each)) {
    way.push_back(each);
  }
  for (auto each = way.rbegin(); each != way.rend(); ++each) {
    const SceneGroup& group = scene_.groups()[*each];
    const auto parent = groups_.find(parent_of(scene_, *each));
    MeshGroup made{group.name, std::nullopt, layer_name(group.layer), {}};
    if (parent != groups_.end()) made.parent = parent->second;
    made.world_from_group = {group.position, unit_rotation(group.rotation), 1.0, group.mirrored};
    groups_[*each] = meshes_.groups.size();
    meshes_.groups.push_back(std::move(made));
  }
  const auto found = groups_.find(handle);
  return found == groups_.end() ? std::nullopt : std::optional(found->second);
}

MeshPlacement MeshHierarchy::place(InstanceHandle handle, std::size_t part) {
  const Instance& instance = scene_.instances()[handle];
  MeshPlacement placement{part, instance.name, similarity_of(instance)};
  placement.group = group_of(instance.group);
  placement.layer = layer_name(instance.layer);
  placement.instance = handle;
  return placement;
}

Status simplify_and_count(SmoothMesh& mesh, std::optional<float> error, std::vector<std::uint32_t>& tags,
                          MeshStats& stats) {
  if (error) {
    const std::size_t before = mesh.indices.size() / 3;
    const auto reached = simplify_smooth_mesh(mesh, *error, tags);
    if (!reached) return reached.error();
    stats.simplified_away += static_cast<std::int64_t>(before) - static_cast<std::int64_t>(mesh.indices.size() / 3);
    stats.simplify_error = std::max(stats.simplify_error, *reached);
  }
  stats.triangles += static_cast<std::int64_t>(mesh.indices.size() / 3);
  stats.vertices += static_cast<std::int64_t>(mesh.positions.size());
  return {};
}

Result<SmoothMesh> surface_of(const DensityGrid& field, const VoxelRegistry& types, const SurfaceOptions& wanted,
                              MeshStats& stats, Threads threads, const Progress& progress) {
  auto mesh = build_smooth_mesh(field, types, wanted.mesh, threads, progress);
  if (!mesh) return mesh;
  std::vector<std::uint32_t> no_tags;
  if (auto done = simplify_and_count(*mesh, wanted.simplify_error, no_tags, stats); !done) return done.error();
  return mesh;
}

void append(SmoothMesh& all, SmoothMesh more) {
  if (all.indices.empty()) {
    all = std::move(more);
    return;
  }
  const auto first = static_cast<std::uint32_t>(all.positions.size());
  const auto add = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  add(all.positions, more.positions);
  add(all.normals, more.normals);
  add(all.occlusion, more.occlusion);
  add(all.albedo, more.albedo);
  add(all.types, more.types);
  add(all.materials, more.materials);
  for (const std::uint32_t index : more.indices) all.indices.push_back(first + index);
}

MeshPart part_of_bodies(std::string name, SmoothBodies bodies, const DVec3& pivot) {
  const auto owner = std::make_shared<const SmoothBodies>(std::move(bodies));
  MeshPart part{std::move(name), {}, pivot, owner};
  for (const SmoothMesh& mesh : *owner) {
    if (mesh.indices.empty()) continue;
    part.surfaces.push_back(view_of(mesh));
    part.surfaces.back().surface = &mesh == owner->data() ? SurfaceClass::Opaque : SurfaceClass::Transparent;
    part.surfaces.back().types = mesh.types;
  }
  return part;
}

namespace {

/// Aligns the materials of a mesh, or drops them if none has textures.
void keep_textured_materials(const VoxelRegistry& types, SmoothMesh& mesh, MeshStats& stats) {
  const auto is_textured = [&](VoxelType type) { return type < types.size() && !types[type].faces.empty(); };
  const auto has_textures = [&](const VertexMaterials& each) { return std::ranges::any_of(each.types, is_textured); };
  if (std::ranges::none_of(mesh.materials, has_textures)) mesh.materials = {};
  const std::size_t before = mesh.positions.size();
  align_materials(mesh);
  stats.vertices += static_cast<std::int64_t>(mesh.positions.size() - before);
}

/// The surfaces of a field.
Result<SmoothBodies> bodies_of_field(const DensityGrid& field, const VoxelRegistry& types, const SurfaceOptions& wanted,
                                     MeshStats& stats, Threads threads, const Progress& progress) {
  const std::vector<std::uint32_t> bodies = smooth::bodies_of(types, field);
  SmoothBodies made;
  SmoothMeshOptions with_materials = wanted.mesh;
  with_materials.materials = types.has_textures();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const auto share = [&](std::size_t k) { return static_cast<double>(k) / static_cast<double>(bodies.size()); };
    const bool is_alone = bodies.size() == 1;
    const DensityGrid own = is_alone ? DensityGrid() : smooth::field_of_body(field, types, bodies[i], threads);
    const bool is_opaque = bodies[i] == 0;
    const SurfaceOptions options{is_opaque ? with_materials : wanted.mesh, wanted.simplify_error};
    auto mesh =
        surface_of(is_alone ? field : own, types, options, stats, threads, part_of(progress, share(i), share(i + 1)));
    if (!mesh) return mesh.error();
    if (is_opaque) keep_textured_materials(types, *mesh, stats);
    append(made[bodies[i] == 0 ? 0 : 1], std::move(*mesh));
  }
  return made;
}

}  // namespace

Status add_fields(const Scene& scene, const std::vector<GridHandle>& grids, InstanceFilter filter,
                  const SurfaceOptions& wanted, MeshHierarchy& hierarchy, SceneMeshes& meshes, Threads threads,
                  const Progress& progress) {
  const auto share = [&](std::size_t done) { return static_cast<double>(done) / static_cast<double>(grids.size()); };
  for (std::size_t i = 0; i < grids.size(); ++i) {
    const GridHandle handle = grids[i];
    const SceneGrid& grid = scene.grids()[handle];
    if (grid.field.chunk_count() == 0) continue;
    auto bodies = bodies_of_field(grid.field, scene.types, wanted, meshes.stats, threads,
                                  part_of(progress, share(i), share(i + 1)));
    if (!bodies) return bodies.error();
    MeshPart part = part_of_bodies(grid.name, std::move(*bodies), grid.pivot);
    if (part.surfaces.empty()) continue;
    for (const InstanceHandle placed : scene.instances().handles()) {
      const Instance& instance = scene.instances()[placed];
      if (instance.grid != handle || !is_drawn(scene, instance, filter)) continue;
      meshes.placements.push_back(hierarchy.place(placed, meshes.parts.size()));
    }
    meshes.parts.push_back(std::move(part));
  }
  return {};
}

}  // namespace quoin
