#include "scene/meshes/mesh_parts.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "mesh/surface/simplify.h"
#include "mesh/surface/voxel_surface.h"
#include "scene/instance_axes.h"

namespace quoin {

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
  const DQuat rotation = unit_rotation(instance.rotation);
  MeshPlacement placement{part, instance.name,
                          Similarity{instance.position, rotation, instance.voxel_size, instance.mirrored}};
  placement.group = group_of(instance.group);
  placement.layer = layer_name(instance.layer);
  placement.instance = handle;
  return placement;
}

Status simplify_and_count(SmoothMesh& mesh, std::optional<float> error, std::vector<std::uint32_t>& tags,
                          MeshStats& stats) {
  if (error) {
    const std::size_t before = mesh.indices.size() / 3;
    const auto reached = simplify_tagged(mesh, *error, tags);
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

/// The surfaces of a field.
Result<SmoothBodies> bodies_of_field(const DensityGrid& field, const VoxelRegistry& types, const SurfaceOptions& wanted,
                                     MeshStats& stats, Threads threads, const Progress& progress) {
  const std::vector<std::uint32_t> bodies = smooth::bodies_of(types, field);
  SmoothBodies made;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const auto share = [&](std::size_t k) { return static_cast<double>(k) / static_cast<double>(bodies.size()); };
    const bool is_alone = bodies.size() == 1;
    const DensityGrid own = is_alone ? DensityGrid() : smooth::field_of_body(field, types, bodies[i], threads);
    auto mesh =
        surface_of(is_alone ? field : own, types, wanted, stats, threads, part_of(progress, share(i), share(i + 1)));
    if (!mesh) return mesh.error();
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
