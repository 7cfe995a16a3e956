#include <quoin/scene/scene_meshes.h>

#include <utility>

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include <quoin/core/assert.h>
#include <quoin/grid/voxel_field.h>

#include "core/work/progress_steps.h"
#include "mesh/blocky/occlusion_atlas.h"
#include "mesh/surface/face_materials.h"
#include "scene/instance_axes.h"
#include "scene/meshes/glass_thickness.h"
#include "scene/meshes/mesh_parts.h"

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
  constexpr int kFarthest = 1 << 24;  // floats cannot represent larger integers exactly
  for (const GridHandle handle : grids) {
    const IBox bounds = scene.grids()[handle].grid.bounds();
    const bool is_near = bounds.empty() || (glm::all(glm::greaterThanEqual(bounds.min, IVec3(-kFarthest))) &&
                                            glm::all(glm::lessThanEqual(bounds.max, IVec3(kFarthest))));
    if (!is_near) return make_error(ErrorCode::LimitExceeded, "cannot make an atlas: voxel coordinates exceed 2^24");
  }
  return {};
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
    view.atlas = owner->second;
    view.block_occlusion = {};
  }
  part.owner = owner;
  return part;
}

}  // namespace

glm::dmat4 MeshPlacement::matrix() const {
  if (const auto* matrix = std::get_if<glm::dmat4>(&world_from_part)) return *matrix;
  const auto& place = std::get<Similarity>(world_from_part);
  Instance turned;
  turned.rotation = place.rotation;
  turned.mirrored = place.mirrored;
  glm::dmat4 matrix(world_axes(turned) * place.scale);
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
  const double first_share = options.atlas ? 0.5 : 1.0;
  MeshResults results;
  if (!options.part_of) results = mesh_all(scene, grids, options, threads, part_of(progress, 0.0, first_share));
  for (const auto& result : results) {
    if (result && !*result) return result->error();
  }
  QUOIN_ASSERT(options.part_of || results.size() == grids.size(), "a mesh per grid");
  SceneMeshes meshes;
  meshes.types = scene.types;
  std::vector<Coordinates> coordinates;
  if (options.atlas) {
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
      meshes.parts.back().thickness = glass_thickness(reader, meshes.parts.back().surfaces);
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

}  // namespace quoin
