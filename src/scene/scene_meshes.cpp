#include <quoin/scene/scene_meshes.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include <quoin/grid/voxel_field.h>
#include <quoin/mesh/simplify.h>

#include "scene/instance_axes.h"

namespace quoin {

namespace {

/// Grids of at most this many chunks are meshed side by side, one thread each; larger ones one after the other, with
/// all threads on their chunks.
constexpr std::size_t kSmallGridChunks = 4;

/// Adds up the progress of many grids, each weighted by its chunks, for one listener.
class SharedProgress {
 public:
  SharedProgress(const Progress& listener, std::size_t total)
      : listener_(listener), total_(std::max<std::size_t>(total, 1)) {}

  /// Says that `chunks` more are done; false when the listener wants to stop.
  bool advance(double chunks) {
    if (!listener_) return true;
    const std::lock_guard lock(mutex_);
    done_ += chunks;
    if (going_) going_ = listener_(std::min(1.0, done_ / static_cast<double>(total_)));
    return going_;
  }

 private:
  const Progress& listener_;
  std::size_t total_;
  std::mutex mutex_;
  double done_ = 0;
  bool going_ = true;
};

/// Errors: InvalidArgument, naming the first drawn instance that has no place.
Status check_instances(const Scene& scene, InstanceFilter filter) {
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (!is_drawn(scene, instance, filter)) continue;
    if (has_place(instance)) continue;
    return make_error(
        ErrorCode::InvalidArgument,
        "instance \"" + instance.name + "\" has a transform that is not finite or a size that is not positive");
  }
  return {};
}

/// The grids that drawn instances place, each once, in the order of their handles.
std::vector<GridHandle> drawn_grids(const Scene& scene, InstanceFilter filter) {
  std::vector<GridHandle> grids;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (is_drawn(scene, instance, filter)) grids.push_back(instance.grid);
  }
  std::sort(grids.begin(), grids.end());
  grids.erase(std::unique(grids.begin(), grids.end()), grids.end());
  return grids;
}

/// A placement per drawn instance, in their order; `grids[i]` is part `i`. Of one grid's instances where it is given.
std::vector<MeshPlacement> placements_of(const Scene& scene, const std::vector<GridHandle>& grids,
                                         InstanceFilter filter, std::optional<GridHandle> only = {}) {
  std::vector<MeshPlacement> placements;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (!is_drawn(scene, instance, filter) || (only && instance.grid != *only)) continue;
    const auto part = std::lower_bound(grids.begin(), grids.end(), instance.grid) - grids.begin();
    const DQuat rotation = unit_rotation(instance.rotation);
    const Similarity place{instance.position, rotation, instance.voxel_size, instance.mirrored};
    placements.push_back({static_cast<std::size_t>(part), instance.name, place});
  }
  return placements;
}

Result<BlockyMesh> mesh_grid(const Scene& scene, GridHandle handle, const BlockyMeshOptions& options, Threads threads,
                             SharedProgress& progress) {
  const Grid& grid = scene.grids()[handle].grid;
  const auto chunks = static_cast<double>(grid.chunk_count());
  double told = 0;
  auto mesh = build_blocky_mesh(grid, scene.types, options, threads, [&](double fraction) {
    const double more = (fraction - told) * chunks;
    told = fraction;
    return progress.advance(more);
  });
  if (mesh && !progress.advance((1.0 - told) * chunks)) return make_error(ErrorCode::Cancelled, "cancelled");
  return mesh;
}

using MeshResults = std::vector<std::optional<Result<BlockyMesh>>>;

MeshResults mesh_all(const Scene& scene, const std::vector<GridHandle>& grids, const BlockyMeshOptions& options,
                     Threads threads, const Progress& listener) {
  std::size_t chunks = 0;
  std::vector<std::size_t> small;
  std::vector<std::size_t> large;
  for (std::size_t i = 0; i < grids.size(); ++i) {
    const std::size_t count = scene.grids()[grids[i]].grid.chunk_count();
    chunks += count;
    (count <= kSmallGridChunks ? small : large).push_back(i);
  }
  SharedProgress progress(listener, chunks);
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

/// A listener for the stretch from `begin` to `end` of another's work.
Progress part_of(const Progress& whole, double begin, double end) {
  if (!whole) return {};
  return [&whole, begin, end](double fraction) { return whole(begin + fraction * (end - begin)); };
}

struct Surface {
  const SmoothMeshOptions& mesh;
  std::optional<float> simplify_error;
};

/// Meshes, simplifies where that is asked for, and counts.
Result<SmoothMesh> surface_of(const DensityGrid& field, const VoxelRegistry& types, const Surface& wanted,
                              MeshStats& stats, Threads threads, const Progress& progress) {
  auto mesh = build_smooth_mesh(field, types, wanted.mesh, threads, progress);
  if (!mesh) return mesh;
  if (wanted.simplify_error) {
    const auto error = simplify_smooth_mesh(*mesh, *wanted.simplify_error);
    if (!error) return error.error();
    stats.simplify_error = std::max(stats.simplify_error, *error);
  }
  stats.triangles += static_cast<std::int64_t>(mesh->indices.size() / 3);
  stats.vertices += static_cast<std::int64_t>(mesh->positions.size());
  return mesh;
}

/// Adds a part for the field of each grid that has one with a surface, and its placements: those of the grid's
/// instances, in their order.
Status add_fields(const Scene& scene, const std::vector<GridHandle>& grids, InstanceFilter filter,
                  const Surface& wanted, SceneMeshes& meshes, Threads threads) {
  for (const GridHandle handle : grids) {
    const SceneGrid& grid = scene.grids()[handle];
    if (grid.field.chunk_count() == 0) continue;
    auto mesh = surface_of(grid.field, scene.types, wanted, meshes.stats, threads, {});
    if (!mesh) return mesh.error();
    if (mesh->indices.empty()) continue;
    for (MeshPlacement& placement : placements_of(scene, {handle}, filter, handle)) {
      placement.part = meshes.parts.size();
      meshes.placements.push_back(std::move(placement));
    }
    meshes.parts.push_back(mesh_part(grid.name, std::move(*mesh), grid.pivot));
  }
  return {};
}

}  // namespace

glm::dmat4 MeshPlacement::matrix() const {
  if (const auto* matrix = std::get_if<glm::dmat4>(&world_from_part)) return *matrix;
  const auto& place = std::get<Similarity>(world_from_part);
  Instance instance;
  instance.rotation = place.rotation;
  instance.mirrored = place.mirrored;
  glm::dmat4 matrix(world_axes(instance) * place.scale);
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

Result<SceneMeshes> mesh_scene(const Scene& scene, const BlockySceneOptions& options, Threads threads,
                               const Progress& progress) {
  if (auto sound = check_instances(scene, options.instances); !sound) return sound.error();
  const std::vector<GridHandle> grids = drawn_grids(scene, options.instances);
  MeshResults results = mesh_all(scene, grids, options.mesh, threads, progress);
  for (const auto& result : results) {
    if (result && !*result) return result->error();
  }
  SceneMeshes meshes;
  meshes.types = scene.types;
  for (std::size_t i = 0; i < grids.size(); ++i) {
    const SceneGrid& grid = scene.grids()[grids[i]];
    add_stats(**results[i], meshes.stats);
    MeshPart& part = meshes.parts.emplace_back(mesh_part(grid.name, std::move(**results[i]), grid.pivot));
    for (MeshView& view : part.surfaces) {
      if (!options.mesh.occlusion) view.block_occlusion = {};
    }
  }
  meshes.placements = placements_of(scene, grids, options.instances);
  SmoothMeshOptions smooth;
  if (!options.mesh.occlusion) smooth.occlusion.form = SmoothOcclusion::None;
  if (auto done = add_fields(scene, grids, options.instances, {smooth, std::nullopt}, meshes, threads); !done) {
    return done.error();
  }
  return meshes;
}

Result<SceneMeshes> mesh_scene_smoothly(const Scene& scene, const SmoothSceneOptions& options, Threads threads,
                                        const Progress& progress) {
  if (auto sound = check_instances(scene, options.instances); !sound) return sound.error();
  SceneMeshes meshes;
  const std::vector<GridHandle> grids = drawn_grids(scene, options.instances);
  std::vector<MeshPlacement> placements = placements_of(scene, grids, options.instances);
  std::ranges::stable_sort(placements, {}, &MeshPlacement::part);
  auto placement = placements.begin();
  for (std::size_t i = 0; i < grids.size(); ++i) {
    const SceneGrid& grid = scene.grids()[grids[i]];
    const auto share = [&](std::size_t done) { return static_cast<double>(done) / static_cast<double>(grids.size()); };
    auto mesh = surface_of(field_from_grid(grid.grid, threads), scene.types, {options.mesh, options.simplify_error},
                           meshes.stats, threads, part_of(progress, share(i), share(i + 1)));
    if (!mesh) return mesh.error();
    const bool is_empty = mesh->indices.empty();
    for (; placement != placements.end() && placement->part == i; ++placement) {
      // As a matrix: of two rotations that are the same, files then have the one with a positive w.
      if (!is_empty) meshes.placements.push_back({meshes.parts.size(), placement->name, placement->matrix()});
    }
    // The field's sample is the voxel's centre.
    if (!is_empty) meshes.parts.push_back(mesh_part(grid.name, std::move(*mesh), grid.pivot - 0.5));
  }
  const Surface wanted{options.mesh, options.simplify_error};
  if (auto done = add_fields(scene, grids, options.instances, wanted, meshes, threads); !done) return done.error();
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
